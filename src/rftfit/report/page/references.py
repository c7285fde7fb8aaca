"""What the field calculator scales a new medium from: this campaign's fits, or the printed ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.fourier import TERMS
from rftfit.profile.scaling import vertical_penetration
from rftfit.reference import load

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.report.page.inputs import PageInputs

GENERIC = "generic"


@dataclass(frozen=True)
class Reference:
    """Reference media of the scaling routine.

    Parameters
    ----------
    name : str
        For people.
    media : tuple of str
    chi : numpy.ndarray, shape (media,)
    m0 : numpy.ndarray, shape (9,)
        Generic coefficients.
    scaled : numpy.ndarray, shape (media, 9)
        Coefficients of each medium over its zeta.
    """

    name: str
    media: tuple[str, ...]
    chi: FloatArray
    m0: FloatArray
    scaled: FloatArray


def references_of(inputs: PageInputs) -> list[Reference]:
    """List the references: this campaign's by the configured fit, if it has one; the printed ones.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of Reference
        The first is what ``rftfit scale --results`` uses, the last what it uses without.
    """
    method = inputs.config.fourier.method
    rows = inputs.penetration[inputs.penetration["method"] == method]
    chi = {
        str(medium): float(value)
        for medium, value in zip(rows["medium"], rows["chi"], strict=True)
        if np.isfinite(value)
    }
    values = {
        medium: used_coefficients(inputs.coefficients, method, medium) for medium in (GENERIC, *chi)
    }
    whole = all(np.isfinite(own).all() for own in values.values())
    found = (
        [_reference(f"this campaign, method {method}", chi, values)]
        if whole and len(chi) > 1
        else []
    )
    return [*found, published()]


def published() -> Reference:
    """Chi of Table S3 and coefficients of Table S2, as printed.

    Returns
    -------
    Reference
    """
    chi_rows, printed = load("table_s3"), load("table_s2")
    chi_rows = chi_rows[chi_rows["quantity"] == "chi"]
    chi = {str(m): float(v) for m, v in zip(chi_rows["medium"], chi_rows["value"], strict=True)}
    values = {}
    for medium in (GENERIC, *chi):
        rows = printed[printed["medium"] == medium]
        own = dict(zip(rows["coefficient"], rows["value"].astype(float), strict=True))
        values[medium] = np.array([own[term] for term in TERMS])
    return _reference("published Tables S2 and S3", chi, values)


def used_coefficients(table: pd.DataFrame, method: str, medium: str) -> FloatArray:
    """Nine coefficients of a medium; a dropped term counts as 0.

    Parameters
    ----------
    table : pandas.DataFrame
        Coefficients, long.
    method, medium : str

    Returns
    -------
    numpy.ndarray, shape (9,)
        N/cm^3; NaN where the table has none.
    """
    rows = table[(table["method"] == method) & (table["medium"] == medium)]
    found = {
        # read back from csv, the column may hold text
        str(row["coefficient"]): 0.0
        if str(row["kept"]).strip().lower() == "false"
        else float(row["value_N_per_cm3"])
        for row in rows.to_dict("records")
    }
    return np.array([found.get(term, np.nan) for term in TERMS])


def _reference(name: str, chi: Mapping[str, float], values: Mapping[str, FloatArray]) -> Reference:
    own = np.stack([values[medium] for medium in chi])
    # the printed zeta is rounded on its own: the sum keeps alpha_z(0, 90 deg) of each profile at 1
    scaled = own / vertical_penetration(own)[:, None]
    return Reference(name, tuple(chi), np.array(list(chi.values())), values[GENERIC], scaled)
