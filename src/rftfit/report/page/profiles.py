"""The profiles of a medium as the scripts of the page want them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.profile.depth_only import DepthOnlyProfile
from rftfit.profile.reference_media import routines
from rftfit.profile.table import TableProfile
from rftfit.report.page.references import generic_of, used_coefficients

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.report.page.inputs import PageInputs


def profiles_of(inputs: PageInputs, medium: str) -> dict[str, dict[str, Any]]:
    """Parameters of every profile of a medium.

    Parameters
    ----------
    inputs : PageInputs
    medium : str

    Returns
    -------
    dict of str to dict
        By name (``table``, ``fourier``, ``generic``, ``depth_only``); each with its ``kind`` and
        what that needs. A natural sand has the generic profile only; a profile whose numbers are
        missing altogether is left out.
    """
    found: dict[str, dict[str, Any]] = {}
    method: str = inputs.config.fourier.method
    if inputs.config.media[medium].role == "laboratory":
        table = TableProfile.from_table(inputs.alpha[medium], inputs.config.media[medium].title)
        found["table"] = {
            "kind": "table",
            "beta": table.beta.tolist(),
            "gamma": table.gamma.tolist(),
            "z": _lists(table.alpha_z),
            "x": _lists(table.alpha_x),
            "reason": table.reason,
        }
        own = used_coefficients(inputs.coefficients, method, medium)
        if np.isfinite(own).all():
            found["fourier"] = {"kind": "fourier", "values": own.tolist()}
    zeta, m0 = zeta_of(inputs, medium), generic_of(inputs, medium)
    if np.isfinite(zeta) and np.isfinite(m0).all():
        found["generic"] = {"kind": "fourier", "values": (zeta * m0).tolist()}
    if "table" in found:
        depth_only = DepthOnlyProfile.of(table).values
        if np.isfinite(depth_only).all():
            found["depth_only"] = {"kind": "depth_only", "values": depth_only.tolist()}
    return found


def zeta_of(inputs: PageInputs, medium: str) -> float:
    """Scaling factor of a medium by the configured method.

    Parameters
    ----------
    inputs : PageInputs
    medium : str

    Returns
    -------
    float
        NaN where the penetration table has none.
    """
    method: str = inputs.config.fourier.method
    laboratory = inputs.config.media[medium].role == "laboratory"
    names = [method] if laboratory else routines(method)
    table = inputs.penetration
    rows = table[table["method"].isin(names) & (table["medium"] == medium)]
    return float(rows["zeta"].iloc[0]) if len(rows) else float("nan")


def _lists(values: FloatArray) -> list[list[float | None]]:
    return [[float(v) if np.isfinite(v) else None for v in row] for row in values]
