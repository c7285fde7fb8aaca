"""Look-up of numbers in tables of results, by a key that names cells of their row; when a cell agrees with a key.

A key is a dict from column to word, as ``{"medium": "yuma", "leg": "c_leg"}``. A word may also stand in the name of the table,
as ``results/alpha/{medium}.csv``; the others choose the row.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from rftfit.errors import InputError
from rftfit.measure.slopes import NORMAL_95
from rftfit.store.tables import unguarded
from rftfit.suite.declared import EVERY, NumberCells, format_key
from rftfit.table.numbers import NO_VALUE
from rftfit.table.text import records_of


class NoRow(LookupError):
    """A table does not exist, lacks a column, or does not have exactly one row with a key."""


class TableNumber(NamedTuple):
    """A number of a table (or a word), in the unit of the answer.

    `lo`, `hi`: Its 95 % interval; NaN: not stated. `error`: Difference that is allowed, of a published number; NaN: not
    stated. `cells`: All cells of its row, by column.
    """

    value: float | str
    lo: float
    hi: float
    error: float
    cells: Mapping[str, str]


class CalculatedTables:
    """Tables below the folder of an example, each read once, as texts."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._tables: dict[str, pd.DataFrame] = {}

    def read(self, name: str) -> pd.DataFrame:
        """Read a table with commas or blanks between its cells, each cell as text; raise NoRow if there is no such file.

        `name`: Path from the folder. Commands of this program put notes, which begin with #, above a table: they are left
        out. A cell without a value becomes an empty text.
        """
        if name not in self._tables:
            path = self.folder / name
            if not path.is_file():
                raise NoRow(f"there is no {name}")
            text = path.read_text(encoding="utf-8")
            # without a note at the top, a line that begins with # is a row: only empty lines are left out
            begin_of_left_out = "#" if text.startswith("#") else "\n"
            lines = [
                line for line in text.splitlines(keepends=True) if line[0] != begin_of_left_out
            ]
            delimiter = "," if "," in lines[0] else " "
            header, *rows = records_of(lines, delimiter)
            table = pd.DataFrame(rows, columns=header).fillna("")
            self._tables[name] = table.map(lambda cell: "" if cell in NO_VALUE else unguarded(cell))
        return self._tables[name]

    def rows(self, cells: NumberCells, key: Mapping[str, str]) -> pd.DataFrame:
        """Return the rows of the table of `cells` that have the cells of a key; the word `EVERY` allows any cell.

        Raises NoRow if the table or one of the columns is not there.
        """
        table = self.read(fill_words(cells.table, key))
        for column, word in _cells_of_row(cells, key).items():
            if column not in table:
                raise NoRow(f"{fill_words(cells.table, key)} has no column {column}")
            if word != EVERY:
                table = table[[is_same(cell, word) for cell in table[column]]]
        return table

    def number(self, cells: NumberCells, key: Mapping[str, str]) -> TableNumber:
        """Look up a number in the only row with a key; raise NoRow if there is not exactly one.

        `cells`: Table and columns in which it stands.
        """
        rows = self.rows(cells, key)
        if len(rows) != 1:
            count = "no row" if rows.empty else f"{len(rows)} rows"
            raise NoRow(f"{fill_words(cells.table, key)} has {count} with {format_key(key)}")
        row = {str(name): str(cell) for name, cell in rows.iloc[0].items()}
        return read_number(cells, row)


def read_number(cells: NumberCells, row: Mapping[str, str]) -> TableNumber:
    """Read a number and its interval from the cells of a row, by column; `cells` says in which columns they stand.

    Raises NoRow if one of these is not there. An interval is stated by its ends, or by a standard error.
    """
    lacking = {cells.value, cells.lo, cells.hi, cells.se, cells.error} - {None, *row}
    if lacking:
        raise NoRow(f"{cells.table} has no column {', '.join(sorted(map(str, lacking)))}")
    value = parse_cell(row[cells.value])
    if isinstance(value, str):
        return TableNumber(value, math.nan, math.nan, math.nan, row)
    value *= cells.factor

    def number_in(column: str | None) -> float:
        """Return the number in a column, in the unit of the answer; NaN without a column or a number."""
        number = math.nan if column is None else parse_cell(row[column])
        return math.nan if isinstance(number, str) else number * cells.factor

    lo, hi = number_in(cells.lo), number_in(cells.hi)
    if cells.se is not None:
        half = NORMAL_95 * abs(number_in(cells.se))
        lo, hi = value - half, value + half
    # a negative factor exchanges the ends
    return TableNumber(value, min(lo, hi), max(lo, hi), abs(number_in(cells.error)), row)


def parse_cell(cell: str) -> float | str:
    """Return the number in a cell, NaN for an empty one, or its text if it is no number."""
    if not cell.strip():
        return math.nan
    try:
        return float(cell)
    except ValueError:
        return cell


def fill_words(pattern: str, key: Mapping[str, str]) -> str:
    """Replace names in braces by words of a key, as in `results/alpha/{medium}.csv`; InputError if the key lacks one."""
    try:
        return pattern.format_map(key)
    except (KeyError, ValueError, IndexError):
        raise InputError(
            f"example.yaml: '{pattern}' needs a word that the key '{format_key(key)}' does not have"
        ) from None


def _cells_of_row(cells: NumberCells, key: Mapping[str, str]) -> dict[str, str]:
    """Return the cells that a row must have, by column: `cells.row`, else the key's words that `table` does not use."""
    if cells.row:
        return {column: fill_words(pattern, key) for column, pattern in cells.row.items()}
    return {name: word for name, word in key.items() if f"{{{name}}}" not in cells.table}


_SAME = 1e-6
"""Relative difference below which numbers of a key are equal, since tables have six digits."""


def is_same(cell: str, word: str) -> bool:
    """Return True if a cell agrees with a word of a key; two numbers are compared as numbers: 90 agrees with 90.0."""
    numbers = parse_cell(cell), parse_cell(word)
    if all(isinstance(number, float) and math.isfinite(number) for number in numbers):
        return math.isclose(*map(float, numbers), rel_tol=_SAME, abs_tol=1e-12)
    return cell == word


def look_up(folder: Path, cells: NumberCells, key: Mapping[str, str]) -> float:
    """Look up a number that a command of an example needs in the results of an earlier one, below `folder`.

    Raises
    ------
    InputError
        If there is no such number.
    """
    try:
        value = CalculatedTables(folder).number(cells, key).value
    except NoRow as error:
        raise InputError(f"example.yaml, key given: {error}") from error
    if isinstance(value, str) or math.isnan(value):
        raise InputError(f"example.yaml, key given: {cells.table} has no number in {cells.value}")
    return value
