"""How the cells of a text are told apart, and what some of its lines hold."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rftfit.logs.base import added

Kind = Literal["number", "integer", "same", "skip"]


@dataclass(frozen=True)
class Layout:
    """How the cells of a line are told apart, and what each holds.

    Parameters
    ----------
    names : tuple of str
        Of the columns, each once.
    kinds : tuple of {"number", "integer", "same", "skip"}
        Integers are exact within 64 bits; of a cell that should always be the `same`, whether it is;
        skipped cells may hold anything.
    delimiter : str
        One character; a blank stands for any number of blanks and tabs.
    decimal : str
        ``.`` or ``,``.
    quote : bool
        Whether cells may stand in double quotes.
    comment : str
        Lines that begin with this are no data lines; empty: there are none.
    optional : int
        How many of the last columns, all skipped ones, a line may leave out.
    same : str
        What the cells of kind "same" should hold.
    """

    names: tuple[str, ...]
    kinds: tuple[Kind, ...]
    delimiter: str = ","
    decimal: str = "."
    quote: bool = False
    comment: str = ""
    optional: int = 0
    same: str = ""

    @property
    def wanted(self) -> list[int]:
        """Places of the columns that are read."""
        return [place for place, kind in enumerate(self.kinds) if kind != "skip"]


@dataclass(frozen=True)
class Rows:
    """What some lines hold.

    Parameters
    ----------
    columns : dict of str to numpy.ndarray
        Of the good rows; float64, int64 or bool.
    index : numpy.ndarray of int, shape (n,)
        Which data line of these lines each good row is, from 0: a bad line keeps its place.
    rows : int
        Data lines.
    dropped : dict of str to int
        Reason to number of lines left out; with n they add up to `rows`.
    """

    columns: dict[str, np.ndarray]
    index: np.ndarray
    rows: int
    dropped: dict[str, int]

    def take(self, keep: np.ndarray, reason: str) -> Rows:
        """Leave out the rows where `keep` is False.

        Parameters
        ----------
        keep : numpy.ndarray of bool, shape (n,)
        reason : str

        Returns
        -------
        Rows
        """
        lost = int(keep.size - np.count_nonzero(keep))
        if not lost:
            return self
        columns = {name: values[keep] for name, values in self.columns.items()}
        dropped = added(self.dropped, {reason: lost})
        return Rows(columns, self.index[keep], self.rows, dropped)


def cells_of(line: str, delimiter: str, *, quote: bool) -> list[str] | None:
    """Split a line into its cells.

    Parameters
    ----------
    line : str
    delimiter : str
        A blank stands for any number of blanks and tabs.
    quote : bool
        Whether cells may stand in double quotes.

    Returns
    -------
    list of str or None
        None where the quotes do not match.
    """
    if delimiter == " ":
        return [cell for cell in line.replace("\t", " ").split(" ") if cell]
    if not quote or '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True), [])
    except csv.Error:
        return None
