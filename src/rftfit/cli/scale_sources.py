"""Where the scaling routine's chi and generic coefficients come from: print, or a campaign's results."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.profile.fourier import TERMS
from rftfit.profile.scaling import vertical_penetration

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable
    from pathlib import Path

    from rftfit.conventions import FloatArray

GENERIC = "generic"


@dataclass(frozen=True)
class Reference:
    """What a new medium is scaled from.

    Attributes
    ----------
    name : str
        For people: which tables.
    media : tuple of str
    chi : numpy.ndarray, shape (media,)
    m0 : numpy.ndarray, shape (9,)
        Generic coefficients.
    scaled : numpy.ndarray, shape (media, 9)
        M / zeta of each medium: their scatter about `m0` is that of a further medium.
    """

    name: str
    media: tuple[str, ...]
    chi: FloatArray
    m0: FloatArray
    scaled: FloatArray


def published() -> Reference:
    """Chi of Table S3 and coefficients of Table S2, as printed.

    Returns
    -------
    Reference
    """
    # read here, not as data frames: pandas alone takes longer to import than this command to run
    folder = files("rftfit.reference")
    chi = {
        row["medium"]: float(row["value"])
        for row in _rows(folder.joinpath("table_s3.csv"))
        if row["quantity"] == "chi"
    }
    printed: dict[str, dict[str, float]] = {}
    for row in _rows(folder.joinpath("table_s2.csv")):
        printed.setdefault(row["medium"], {})[row["coefficient"]] = float(row["value"])
    return _reference("published Tables S2 and S3", chi, printed)


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
    return _reference(f"{folder.as_posix()}, method {method}", chi, fitted)


def _reference(
    name: str, chi: dict[str, float], coefficients: dict[str, dict[str, float]]
) -> Reference:
    values = {
        medium: np.array([terms[term] for term in TERMS]) for medium, terms in coefficients.items()
    }
    own = np.stack([values[medium] for medium in chi])
    # the printed zeta is rounded on its own: the sum keeps alpha_z(0, 90 deg) of each profile at 1
    scaled = own / vertical_penetration(own)[:, None]
    return Reference(name, tuple(chi), np.array(list(chi.values())), values[GENERIC], scaled)


def _rows(source: Path | Traversable) -> list[dict[str, str]]:
    lines = source.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def _of_method(path: Path, method: str, needed: tuple[str, ...]) -> list[dict[str, str]]:
    try:
        rows = _rows(path)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such table; `rftfit run` makes it") from None
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    lacking = [name for name in needed if not rows or rows[0].get(name) is None]
    if lacking:
        raise InputError(f"{path}: no column {', '.join(lacking)}, or no rows")
    chosen = [row for row in rows if row["method"] == method]
    if not chosen:
        known = ", ".join(dict.fromkeys(row["method"] for row in rows))
        raise InputError(f"{path}: no rows of the method {method!r}; allowed: {known}")
    return chosen


def _number(path: Path, row: dict[str, str], column: str) -> float:
    text = row[column] or "nan"
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{path}: found {text!r} in column {column}; allowed: a number") from None
