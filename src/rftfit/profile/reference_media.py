"""The media that a further medium is scaled from: their chi, generic coefficients and scatter."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.fourier import TERMS
from rftfit.profile.scaling import vertical_penetration

if TYPE_CHECKING:
    from collections.abc import Mapping
    from importlib.resources.abc import Traversable
    from pathlib import Path

    from rftfit.conventions import FloatArray

GENERIC = "generic"

PRINTED_NOTE = (
    "fewer than two laboratory media with a usable grid: scaled with the published five media"
)
"""Reason in the tables of a campaign whose natural sands are scaled with the printed tables."""


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
    printed : bool
        Whether these are the published tables.
    """

    name: str
    media: tuple[str, ...]
    chi: FloatArray
    m0: FloatArray
    scaled: FloatArray
    printed: bool = False

    @property
    def note(self) -> str:
        """What a table of a campaign says of it; empty for the campaign's own media."""
        return PRINTED_NOTE if self.printed else ""


def published() -> Reference:
    """Chi of Table S3 and coefficients of Table S2, as printed.

    Returns
    -------
    Reference
    """
    # read here, not as data frames: pandas alone takes longer to import than the scaling to run
    folder = files("rftfit.reference")
    chi = {
        row["medium"]: float(row["value"])
        for row in table_rows(folder.joinpath("table_s3.csv"))
        if row["quantity"] == "chi"
    }
    printed: dict[str, dict[str, float]] = {}
    for row in table_rows(folder.joinpath("table_s2.csv")):
        printed.setdefault(row["medium"], {})[row["coefficient"]] = float(row["value"])
    values = {
        medium: np.array([terms[term] for term in TERMS]) for medium, terms in printed.items()
    }
    return reference_from("published Tables S2 and S3", chi, values, printed=True)


def reference_from(
    name: str,
    chi: Mapping[str, float],
    coefficients: Mapping[str, FloatArray],
    *,
    printed: bool = False,
) -> Reference:
    """Put together chi and coefficients of media.

    Parameters
    ----------
    name : str
        For people: which tables.
    chi : mapping of str to float
        By medium.
    coefficients : mapping of str to numpy.ndarray, shape (9,)
        Of these media, N/cm^3, and of `GENERIC`.
    printed : bool, optional
        Whether these are the published tables.

    Returns
    -------
    Reference
    """
    own = np.stack([coefficients[medium] for medium in chi])
    # the printed zeta is rounded on its own: the sum keeps alpha_z(0, 90 deg) of each profile at 1
    scaled = own / vertical_penetration(own)[:, None]
    values = np.array(list(chi.values()))
    return Reference(name, tuple(chi), values, coefficients[GENERIC], scaled, printed)


def routine(method: str, *, printed: bool = False) -> str:
    """Name the method of a natural sand in the tables.

    Parameters
    ----------
    method : str
        Of the fits, as the config has it.
    printed : bool, optional
        Whether it is scaled with the published media, not with the campaign's own.

    Returns
    -------
    str
    """
    return f"scaling routine ({method}{', published media' if printed else ''})"


def routines(method: str) -> tuple[str, str]:
    """Name the methods that a natural sand may stand under.

    Parameters
    ----------
    method : str
        Of the fits, as the config has it.

    Returns
    -------
    tuple of str
        With the campaign's own media, with the published ones.
    """
    return routine(method), routine(method, printed=True)


def table_rows(source: Path | Traversable) -> list[dict[str, str]]:
    """Read a csv table whose lines beginning with ``#`` are comments.

    Parameters
    ----------
    source : Path or Traversable

    Returns
    -------
    list of dict
        Cells as text, by column.
    """
    lines = source.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
