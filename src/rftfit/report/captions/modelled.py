"""What captions say about the model: coefficients, scaling, legs, sands, the paper's numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.page import tables
from rftfit.page.tables import PROFILES, leg_name, percent, profile_name, value
from rftfit.report.captions.words import chosen, escaped, rst

if TYPE_CHECKING:
    from rftfit.page.page import PageInputs
    from rftfit.report.captions.words import Row


def fit(inputs: PageInputs) -> list[Row]:
    """Terms kept of each medium's nine by the configured method, and the misfit.

    Returns ``title, kept, rms`` (N/cm^3).
    """
    every = inputs.coefficients
    own = every[(every["method"] == inputs.config.fourier.method) & (every["medium"] != "generic")]
    return [
        {
            "title": rst(inputs.titles.get(str(medium), str(medium))),
            "kept": int((rows["kept"].astype(str).str.lower() == "true").sum()),
            "rms": value(rows["misfit_rms_N_per_cm3"].iloc[0]),
        }
        for medium, rows in own.groupby("medium", sort=False)
    ]


def generic(inputs: PageInputs) -> list[Row]:
    """Write the generic coefficients M0 by the configured method.

    Returns ``term, value`` (no unit).
    """
    every = inputs.coefficients
    own = every[(every["method"] == inputs.config.fourier.method) & (every["medium"] == "generic")]
    return [
        {"term": rst(str(term)), "value": value(number)}
        for term, number in zip(own["coefficient"], own["value_N_per_cm3"], strict=True)
    ]


def peaks(inputs: PageInputs, medium: str = "", role: str = "") -> list[Row]:
    """Sum up the errors of the predicted peak lift, profile by profile.

    Returns ``profile, number, within_10, within_33, low, high, legs``: `legs` is a list of ``leg``
    and ``error``, empty for more than one medium.
    """
    if inputs.leg_errors.empty:
        return []
    own = chosen(inputs.leg_errors, inputs, medium, role)
    own = own[(own["component"] == "z") & own["peak_error_percent"].notna()]
    rows = []
    for profile in PROFILES:
        part = own[own["profile"] == profile]
        if part.empty:
            continue
        error = part["peak_error_percent"]
        legs = list(zip(part["leg"], error, strict=True)) if medium else []
        rows.append(
            {
                "profile": profile_name(profile),
                "number": len(part),
                "within_10": int((error.abs() <= 10).sum()),
                "within_33": int((error.abs() <= 33).sum()),
                "low": percent(error.min()),
                "high": percent(error.max()),
                "legs": [{"leg": rst(leg_name(str(n))), "error": percent(e)} for n, e in legs],
            }
        )
    return rows


def sands(inputs: PageInputs) -> list[Row]:
    """Penetration of the natural sands over the stated and the detected linear regime."""
    found: list[Row] = escaped(tables.sand_table(inputs))
    return found


def correction(inputs: PageInputs) -> list[Row]:
    """Factors on the force in natural sands that were tried, and whether they earn their place."""
    found: list[Row] = escaped(tables.correction_table(inputs))
    return found


def reproduction(inputs: PageInputs) -> Row:
    """Count the verdicts on the paper's numbers, and name those that are not the same.

    Returns ``rows, others, counts``.
    """
    found: Row = escaped(tables.reproduction(inputs.reproduction))
    return found
