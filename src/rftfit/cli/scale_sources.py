"""The scaling routine's chi and generic coefficients from a campaign's results."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.profile.fourier import TERMS
from rftfit.profile.reference_media import GENERIC, reference_from, routine, table_rows

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.profile.reference_media import Reference


def from_results(folder: Path, method: str) -> Reference:
    """Chi and coefficients of a campaign.

    Parameters
    ----------
    folder : Path
        Its results, with ``penetration.csv`` and ``coefficients.csv``.
    method : str
        Of the fit, as in these tables.

    Returns
    -------
    Reference

    Raises
    ------
    InputError
        If a table is missing or damaged, or does not have this method, or fewer than two media
        have a chi.
    """
    penetration, coefficients = folder / "penetration.csv", folder / "coefficients.csv"
    rows = _of_method(penetration, method, ("method", "medium", "chi"))
    chi = {row["medium"]: _number(penetration, row, "chi") for row in rows}
    chi = {medium: value for medium, value in chi.items() if math.isfinite(value)}
    if len(chi) < 2:
        raise InputError(
            f"{penetration}: the scatter of chi needs at least two media with a chi by {method!r}, "
            f"found {len(chi)}; without --results the published five are used"
        )
    needed = ("method", "medium", "coefficient", "value_N_per_cm3")
    fitted: dict[str, dict[str, float]] = {}
    for row in _of_method(coefficients, method, needed):
        # a term that was dropped keeps its value in the table, and counts as nothing
        kept = row.get("kept", "True").strip().lower() != "false"
        value = _number(coefficients, row, "value_N_per_cm3") if kept else 0.0
        fitted.setdefault(row["medium"], {})[row["coefficient"]] = value
    for medium in (GENERIC, *chi):
        lacking = [
            term for term in TERMS if not math.isfinite(fitted.get(medium, {}).get(term, math.nan))
        ]
        if lacking:
            raise InputError(
                f"{coefficients}: no value by {method!r} for {medium}: {', '.join(lacking)}; make "
                "these tables again with `rftfit run`"
            )
    values = {
        medium: np.array([terms[term] for term in TERMS])
        for medium, terms in fitted.items()
        if medium in (GENERIC, *chi)
    }
    return reference_from(f"{folder.as_posix()}, method {method}", chi, values)


def _of_method(path: Path, method: str, needed: tuple[str, ...]) -> list[dict[str, str]]:
    try:
        rows = table_rows(path)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such table; `rftfit run` makes it") from None
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    lacking = [name for name in needed if not rows or rows[0].get(name) is None]
    if lacking:
        raise InputError(f"{path}: no column {', '.join(lacking)}, or no rows")
    chosen = [row for row in rows if row["method"] == method]
    if not chosen:
        if any(row["method"] == routine(method, printed=True) for row in rows):
            raise InputError(
                f"{path}: this campaign has no medium fitted by {method!r}, its sands are scaled "
                "with the published five; without --results these are used here too"
            )
        known = ", ".join(dict.fromkeys(row["method"] for row in rows))
        raise InputError(f"{path}: no rows of the method {method!r}; allowed: {known}")
    return chosen


def _number(path: Path, row: dict[str, str], column: str) -> float:
    text = row[column] or "nan"
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{path}: found {text!r} in column {column}; allowed: a number") from None
