"""What the field calculator scales a new medium from: this campaign's fits, or the printed ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.fourier import TERMS
from rftfit.profile.reference_media import (
    GENERIC,
    Reference,
    published,
    reference_from,
    routine,
)

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.report.page.inputs import PageInputs


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
        [reference_from(f"this campaign, method {method}", chi, values)]
        if whole and len(chi) > 1
        else []
    )
    return [*found, published()]


def generic_of(inputs: PageInputs, medium: str) -> FloatArray:
    """Find the generic coefficients that a medium is scaled from, by the configured fit.

    Parameters
    ----------
    inputs : PageInputs
    medium : str

    Returns
    -------
    numpy.ndarray, shape (9,)
        NaN where there are none.
    """
    method = inputs.config.fourier.method
    if medium in scaled_from_print(inputs):
        return published().m0
    return used_coefficients(inputs.coefficients, method, GENERIC)


def scaled_from_print(inputs: PageInputs) -> list[str]:
    """List the natural sands that were scaled with the published media.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of str
        Empty where the campaign has a usable medium of its own.
    """
    rows = inputs.penetration
    method = routine(inputs.config.fourier.method, printed=True)
    return [str(medium) for medium in rows.loc[rows["method"] == method, "medium"]]


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
