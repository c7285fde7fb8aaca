"""Texts among the numbers of a log: labels of rows, units in the cells of a column, and a repeated header."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.conventions import FloatArray
from rftfit.logs.base import FIRST, Log, LogError, Reader
from rftfit.logs.quantities import guess, guesses, names_and_units
from rftfit.logs.sources import refuse_several_sources
from rftfit.table.units import CHAIN_UNITS, is_units_row, unit_word


class LabelledReader(Reader):
    """Base of the readers of tables: further columns may say in which unit a row is, and from which source."""

    def load(self, path: Path) -> Log:
        """Read a file as a whole; raises `LogError` if it cannot be used at all."""
        return heed_labels(super().load(path), self)


def heed_labels(log: Log, reader: Reader) -> Log:
    """Refuse a log whose rows are of several sources or units; give columns the unit that stands in each row.

    Parameters
    ----------
    log : Log
        The log with its `labels`.
    reader : Reader
        Its `asked` are the columns asked for, its `where` the sources that the config chose.

    Returns
    -------
    Log
        The log with the units that its rows state.

    Raises
    ------
    LogError
        If rows of several sources take turns, or the unit changes from row to row.
    """
    labels = _labels_of(log, reader)
    if not labels:
        return log
    log = _with_units_of_rows(log, labels)
    names = _readings_of(log, reader, labels)
    refuse_several_sources(
        log.path, labels, reader.where, [log.columns[name] for name in names], log.rows
    )
    return log


def _labels_of(log: Log, reader: Reader) -> dict[str, Sequence[str]]:
    """Return the columns that may say where a row is from: words, and whole numbers that are not asked for.

    Column to the text of each row.
    """
    labels: dict[str, Sequence[str]] = {
        name: words.tolist() for name, words in log.labels.items() if name not in reader.where
    }
    not_asked = log.columns.keys() - {*QUANTITIES}
    if not_asked and reader.asked:
        not_asked -= {log.name_of(name) for name in reader.asked}
    whole = [name for name in not_asked if may_be_labels(log.columns[name])]
    quantities = {*guesses(log).values()} if whole else {}
    for name in whole:
        if name not in quantities and name not in reader.where:
            labels[name] = [f"{value:g}" for value in log.columns[name]]
    return labels


def may_be_labels(values: FloatArray) -> bool:
    """Return whether the numbers of a column, shape (n,), are whole and few, so that they may be labels."""
    # a fast answer first: most columns of readings have a fraction in their first rows
    first = values[:16]
    if (first[first == first] % 1).any():  # noqa: PLR0124  # without NaN
        return False
    finite = values[np.isfinite(values)]
    if not finite.size or finite.min() == finite.max() or (finite % 1).any():
        return False
    return bool(np.unique(finite).size <= min(FIRST.labels, finite.size // 2))


def _readings_of(log: Log, reader: Reader, labels: Collection[str]) -> list[str]:
    """Return the columns of readings: those asked for, else those with the name of a quantity, else all.

    Labels and times are never readings.
    """
    quantities = guesses(log)
    time = quantities.get("time", "")
    asked = {log.name_of(name) for name in reader.asked or ()}
    for chosen in (asked, {*quantities.values()}, {*log.columns}):
        if names := [name for name in log.columns if name in chosen - {*labels, time}]:
            return names
    return []


# --- Units in the cells of a column


def _with_units_of_rows(log: Log, labels: Mapping[str, Sequence[str]]) -> Log:
    """Set the unit of a column from the unit that a column of words states in each row; refuse a unit that changes."""
    units = dict(log.units)
    unread = dict(log.unread)
    for name in log.labels:
        words = [word for word in dict.fromkeys(labels.get(name, ())) if word]
        stated = [unit_word(word) for word in words]
        if not words or not all(unit in CHAIN_UNITS for unit in stated):
            continue
        if len({*stated}) > 1:
            listed = ", ".join(map(repr, words))
            text = (
                f"{log.path}: the unit in the column {name} changes from row to row: {listed}; allowed: one unit in a log; "
                f"`where: {{{name}: {words[0]}}}` in the config takes the rows of one"
            )
            raise LogError("unit_changes", text, log.rows)
        column = _column_with_unit(log, name, stated[0])
        header_unit = units.get(column, "")
        if header_unit and header_unit != stated[0]:
            text = (
                f"{log.path}: the header says that {column} is in {header_unit}, the column {name} beside it {words[0]!r}; "
                "allowed: one unit: mend the header, or leave out the wrong column"
            )
            raise LogError("unit_changes", text, log.rows)
        if column in units:  # a column that no quantity asked for has no unit to be set
            units[column] = stated[0]
        unread.pop(name, None)
    return replace(log, units=units, unread=unread)


def _column_with_unit(log: Log, name: str, unit: str) -> str:
    """Return the column to which a column of units, `name`, belongs: the nearest column whose name fits the unit."""
    unit_place = log.places.index(name)
    candidates = [
        (place > unit_place, abs(place - unit_place), column)
        for place, column in enumerate(log.places)
        if column not in log.labels and guess(column, unit) == guess(column, "")
    ]
    # a unit stands behind its number; a column behind the unit is used only where there is none before
    return min(candidates, default=(False, 0, ""))[2]


# --- A header that is repeated within the table


class HeaderChange(NamedTuple):
    """A line within the table that gives other names or units than the header.

    `line`: Number of the data line, from 1. `changes`: A phrase for each change.
    """

    line: int
    changes: list[str]

    def sentence(self, path: Path) -> str:
        """Return the sentence for the user: what changes, and the cure."""
        return (
            f"{path}: the header stands again in data line {self.line} and says something else: {'; '.join(self.changes)}; "
            "allowed: the same columns and units in the whole log: cut the file there"
        )


_FEWEST_NAMES = 2
"""Fewest cells with the name of a quantity that make a line of words a header."""


def changed_header(
    cells: Sequence[str], names: Sequence[str], units: Sequence[str], wanted: Collection[int]
) -> list[str]:
    """Compare a line of words within a table with the header of the table.

    Parameters
    ----------
    cells : sequence of str
        Cells of the line.
    names, units : sequence of str
        Name and unit of each column in the header.
    wanted : collection of int
        Places of the columns that are read, from 0.

    Returns
    -------
    list of str
        A phrase for each wanted column with another name or unit; empty if there is none, or the line is no header.
    """
    if len(cells) < len(names):
        return []
    if is_units_row(cells, len(names)):
        stated_names, stated_units = list(names), [unit_word(cell) for cell in cells]
    else:
        again, stated_units = names_and_units(cells[: len(names)])
        stated_names = list(again)
        same_names = len({*stated_names} & {*names})
        quantities = sum(bool(_quantity(name)) for name in stated_names)
        if same_names * 2 < len(names) and quantities < _FEWEST_NAMES:
            return []
    return [*_changes(stated_names, stated_units, names, units, wanted)]


def _changes(
    stated_names: Sequence[str],
    stated_units: Sequence[str],
    names: Sequence[str],
    units: Sequence[str],
    wanted: Collection[int],
) -> Iterator[str]:
    """Yield a phrase for each wanted column whose name or unit (`stated_...`) differs from the header."""
    for place in sorted(wanted):
        name, unit, again, unit_again = (
            row[place] for row in (names, units, stated_names, stated_units)
        )
        same_name = again.casefold() == name.casefold() or (
            _quantity(again) == _quantity(name) != ""
        )
        if not same_name:
            yield f"column {place + 1} is {again!r}, and {name!r} above"
        elif unit_again and unit_again != unit:
            yield f"{name!r} is in {unit_again}, and in {unit or 'no unit'} above"


def _quantity(name: str) -> str:
    """Return the quantity that a name alone suggests; empty: none."""
    return guess(name, "")
