"""The force profiles that the robot runs on, from the tables of the earlier stages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.profile.depth_only import DepthOnlyProfile
from rftfit.profile.fourier import TERMS
from rftfit.profile.nine_terms import FourierProfile, scaled_generic
from rftfit.profile.scaling import vertical_penetration
from rftfit.profile.table import TableProfile

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.profile.base import Profile

PROFILES = ("table", "generic", "depth_only")
"""Measured table, scaled generic coefficients, depth-only model: those of the paper's Fig. S13."""

_GENERIC = "generic"


def robot_profile(
    name: str, medium: str, alpha: pd.DataFrame, coefficients: pd.DataFrame, method: str
) -> Profile:
    """Make one profile of the robot's medium.

    Parameters
    ----------
    name : str
        One of `PROFILES`, or ``fourier``: the medium's own nine terms.
    medium : str
    alpha : pandas.DataFrame
        Alpha table of the medium.
    coefficients : pandas.DataFrame
        Coefficients of all media and M0.
    method : str
        Of the nine-term fit.

    Returns
    -------
    Profile
        One that is NaN, with a reason, where the tables have no number.

    Raises
    ------
    InputError
        If there is no such profile.
    """
    if name == "table":
        return TableProfile.from_table(alpha, f"measured table of {medium}")
    if name == "depth_only":
        return DepthOnlyProfile.of(TableProfile.from_table(alpha))
    if name not in ("fourier", _GENERIC):
        raise InputError(f"profile: found {name!r}; allowed: {', '.join(PROFILES)}, fourier")
    own, reason = _terms(coefficients, medium, method)
    if name == "fourier":
        return FourierProfile(own, f"nine terms ({method}) of {medium}", reason)
    m0, why = _terms(coefficients, _GENERIC, method)
    zeta = float(vertical_penetration(own))
    told = f"generic ({method}) times zeta = {zeta:.4f} of {medium}"
    if not np.isfinite(own).all() or not np.isfinite(m0).all():
        return FourierProfile(np.full(9, np.nan), told, reason or why)
    return scaled_generic(zeta, m0, told)


def _terms(coefficients: pd.DataFrame, medium: str, method: str) -> tuple[FloatArray, str]:
    """Nine coefficients, a dropped term being 0; NaN and a reason where there are none."""
    rows = coefficients[
        (coefficients["method"] == method) & (coefficients["medium"] == medium)
    ].drop_duplicates("coefficient")
    rows = rows.set_index("coefficient").reindex(list(TERMS))
    if rows["method"].isna().any():
        return np.full(9, np.nan), f"no nine-term fit ({method}) of {medium}"
    kept = (rows["kept"].astype(str).str.lower() != "false").to_numpy()
    value = np.where(kept, rows["value_N_per_cm3"].to_numpy(float), 0.0)
    reasons = [
        str(text) for text in dict.fromkeys(rows["reason"]) if isinstance(text, str) and text
    ]
    reason = "; ".join(reasons) or f"a coefficient of {medium} is missing"
    return value, "" if np.isfinite(value).all() else reason
