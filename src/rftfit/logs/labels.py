"""Labels of rows, units that stand in the cells of a column, and a header that is repeated within a log.

In a long table a column may say of each row which sensor or which unit it is of. A *label* is such a word, or a whole
number; *readings* are the columns of forces and positions. Without a look at labels, rows of two sensors would be read
as one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.conventions import FloatArray
from rftfit.logs.base import FIRST, Log, LogError, Reader
from rftfit.logs.quantities import guess, guesses, units_by_name
from rftfit.logs.sources import refuse_several_sources
from rftfit.table.units import QUANTITY_UNITS, canonical_unit, is_units_row


class LabelledReader(Reader):
    """Base of the readers of tables, in which a column may say the unit or the source of each row."""

    def load(self, path: Path) -> Log:
        """Read a file as a whole; raises `LogError` if it cannot be used at all."""
        return heed_labels(super().load(path), self)


def heed_labels(log: Log, reader: Reader) -> Log:
    """Refuse a log whose rows are of several sources or units; else give columns the unit that stands in each row.

    A source is a sensor or a run.

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
    readings = [log.columns[name] for name in _readings_of(log, reader, labels)]
    refuse_several_sources(log.path, labels, reader.where, readings, log.rows)
    return log


def _labels_of(log: Log, reader: Reader) -> dict[str, Sequence[str]]:
    """Return the columns that may say where a row is from: column, to the label of each row.

    They hold words, or few whole numbers that are not asked for. Columns of `where` are left out: the config chose by
    them.
    """
    labels: dict[str, Sequence[str]] = {
        name: words.tolist() for name, words in log.labels.items() if name not in reader.where
    }
    # columns of numbers that are no readings: by name, by what the config asks for, and by a guess
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
    if (first[np.isfinite(first)] % 1).any():
        return False
    finite = values[np.isfinite(values)]
    if not finite.size or finite.min() == finite.max() or (finite % 1).any():
        return False
    return bool(np.unique(finite).size <= min(FIRST.labels, finite.size // 2))


def _readings_of(log: Log, reader: Reader, labels: Collection[str]) -> list[str]:
    """Return the columns of readings: those asked for, else those with the name of a quantity, else all.

    Labels and times are never readings. `labels`: Names of the columns of labels.
    """
    quantities = guesses(log)
    time = quantities.get("time", "")
    asked = {log.name_of(name) for name in reader.asked or ()}
    for candidates in (asked, {*quantities.values()}, {*log.columns}):
        readings = candidates - {*labels, time}
        if names := [name for name in log.columns if name in readings]:
            return names
    return []


# --- Units in the cells of a column


def _with_units_of_rows(log: Log, labels: Mapping[str, Sequence[str]]) -> Log:
    """Set the unit of a column from the unit that a column of words states in each row.

    Raises `LogError` for a unit that changes, or that contradicts the header. `labels`: As `_labels_of` returns them.
    """
    units = dict(log.units)
    unread = dict(log.unread)
    for name in log.labels:
        words = [word for word in dict.fromkeys(labels.get(name, ())) if word]
        stated = [canonical_unit(word) for word in words]
        if not words or not all(unit in QUANTITY_UNITS for unit in stated):
            continue
        if len({*stated}) > 1:
            listed = ", ".join(map(repr, words))
            change = (
                f"{log.path}: the unit in the column {name} changes from row to row: {listed}; allowed: one unit in a log; "
                f"`where: {{{name}: {words[0]}}}` in the config takes the rows of one"
            )
            raise LogError("unit_changes", change, log.rows)
        column = _column_with_unit(log, name, stated[0])
        header_unit = units.get(column, "")
        if header_unit and header_unit != stated[0]:
            contradiction = (
                f"{log.path}: the header says that {column} is in {header_unit}, the column {name} beside it {words[0]!r}; "
                "allowed: one unit: mend the header, or leave out the wrong column"
            )
            raise LogError("unit_changes", contradiction, log.rows)
        if column in units:  # a column that no quantity asked for has no unit to be set
            units[column] = stated[0]
        unread.pop(name, None)
    return replace(log, units=units, unread=unread)


def _column_with_unit(log: Log, name: str, unit: str) -> str:
    """Return the column to which a column of units, `name`, belongs: the nearest column whose name fits the unit.

    Empty where none fits.
    """
    unit_index = log.names_in_file.index(name)
    # a unit stands behind its number; a column behind the unit is used only where there is none before
    by_nearness = sorted(
        (index > unit_index, abs(index - unit_index), column)
        for index, column in enumerate(log.names_in_file)
    )
    fitting = (
        column
        for *_, column in by_nearness
        # the guess by name and unit is empty where the two contradict each other
        if column not in log.labels and guess(column, unit) == guess(column, "")
    )
    return next(fitting, "")


# --- A header that is repeated within the table


_FEWEST_NAMES = 2
"""Fewest cells with the name of a quantity that make a line of words a header."""


def changed_header(
    cells: Sequence[str], header: Mapping[str, str], columns_to_read: Collection[int]
) -> list[str]:
    """Compare a line of words within a table with the header of the table: a log started anew may have other columns.

    Parameters
    ----------
    cells : sequence of str
        Cells of the line.
    header : mapping of str to str
        Name of each column in the header to its unit.
    columns_to_read : collection of int
        Indices of the columns that are read, from 0.

    Returns
    -------
    list of str
        A phrase for each of these columns with another name or unit; empty if there is none, or the line is no header.
    """
    if len(cells) < len(header):
        return []
    if is_units_row(cells, len(header)):
        repeated = dict(zip(header, map(canonical_unit, cells), strict=False))
    else:
        repeated = units_by_name(cells[: len(header)])
        quantities = sum(bool(guess(name, "")) for name in repeated)
        # few names of the header, and few of quantities: any other words
        if len(repeated.keys() & header) * 2 < len(header) and quantities < _FEWEST_NAMES:
            return []
    pairs = [*zip(header.items(), repeated.items(), strict=True)]
    changes = []
    for column in sorted(columns_to_read):
        (name, unit), (repeated_name, repeated_unit) = pairs[column]
        is_same_quantity = guess(repeated_name, "") == guess(name, "") != ""
        if repeated_name.casefold() != name.casefold() and not is_same_quantity:
            changes.append(f"column {column + 1} is {repeated_name!r}, and {name!r} above")
        elif repeated_unit and repeated_unit != unit:
            changes.append(f"{name!r} is in {repeated_unit}, and in {unit or 'no unit'} above")
    return changes
