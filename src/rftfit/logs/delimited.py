"""Reads any delimited text by a description in the config, and guesses this description for an unknown text.

The description, *the keys of* `text`, says delimiter, decimal mark, and where names and units stand. From it and from
the head of a file (its first 64 kB) `DelimitedReader.plan` makes a `ReadingPlan`; which columns hold numbers or times
is judged by the first rows (`judge_columns`), also for other readers of tables. `guess_text_settings` finds the
description of an unknown text: it tries each delimiter and decimal mark, and keeps what gives most numbers.

A `Line` has its `text`, the offset `stop` behind its end in the head, and `whole`: False if the head ends within it. A
*stamp* is a date or a time as text.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import compress, islice
from typing import Any, NamedTuple

import numpy as np

from rftfit.campaign.config import TextFormat
from rftfit.logs.base import FIRST, HEAD_BYTES, most_frequent
from rftfit.logs.quantities import units_by_name
from rftfit.logs.text import ReadingPlan, TableReader, TextReader
from rftfit.table.numbers import IN_THOUSANDS, NO_VALUE, PLAIN_NUMBER, plain_number
from rftfit.table.parse import Kind, Layout, are_allowed, rewritten
from rftfit.table.stamps import (
    ORDERS,
    PERIOD_S,
    RestartingClock,
    date_order,
    is_clock_time,
    is_stamp,
    note_of,
)
from rftfit.table.text import (
    Line,
    cells_of,
    decode_first_lines,
    decoded,
    each_line,
    text_head,
    utf16_of,
)
from rftfit.table.units import is_units_row

DELIMITER_WORDS = {"\t": "tab", " ": "blank", "|": "bar"}
"""Delimiter to its name in the config."""

_DELIMITERS = {word: character for character, word in DELIMITER_WORDS.items()}
"""Name of a delimiter in the config, to the character."""
_SPACED = r"\d{1,3}([ '\u2019\u00a0\u202f\u2009]\d{3})+"
"""Pattern of a number with blanks or apostrophes between thousands."""
# the other mark stands between thousands only where the decimal mark follows: 1,000 may be a decimal number
_NUMBERS = {
    point: re.compile(
        rf"[+-]?(\d+[{point}]?\d*|\d{{1,3}}([{group}]\d{{3}})+[{point}]\d*|{_SPACED}([{point}]\d*)?|[{point}]\d+)"
        r"([eE][+-]?\d+)?"
    )
    for point, group in (".,", ",.")
}
"""Decimal mark, to the pattern of a number with it."""


class DelimitedReader(TextReader):
    """Text as the section `text` of the config describes it; it reads a file only where the config says so."""

    name = "delimited"
    description = "any delimited text, described by `text` in the config"
    evidence = "the section `text` of the config"
    selects = True

    def __init__(self, text: TextFormat | None = None) -> None:
        self._format = text

    def plan(self, head: bytes) -> ReadingPlan:
        """Find the header rows where the config says they are, and the kind of each column in the rows below.

        Raises ValueError where they are not there, or do not fit the rows.
        """
        text = self._format
        if text is None:
            raise ValueError("the dialect delimited needs `text` in the config: the format")
        delimiter = _DELIMITERS.get(text.delimiter, text.delimiter)
        head_lines = each_line(head, text.encoding)
        # the lines above the rows; rows of the header are moved to them from `lines`, those below
        above = list(islice(head_lines, text.skip_lines))
        content = (line for line in head_lines if _is_content(line, text.comment))
        lines = [*islice(content, FIRST.rows + FIRST.header_rows)]
        marks = find_line_marks([line.text for line in lines], delimiter)
        # from here on lines have only cells and delimiters
        lines = [line._replace(text=marks.strip(line.text)) for line in lines]
        gef_names, gef_units = _columns_of_gef(above)
        gef_voids = _voids_of_gef(above)

        def take_row(description: str) -> list[str]:
            """Move a row of the header from `lines` to `above`; return its cells. `description`: for the error."""
            if not (lines and lines[0].whole):
                raise ValueError(f"no row of {description}")
            above.append(_take_row(lines))
            return _cells(above[-1], delimiter)

        name_cells: list[str] = []
        unit_cells: list[str] = []
        if text.names:
            name_cells = take_row(f"names below the first {text.skip_lines} lines (skip_lines)")
        if text.units:
            unit_cells = take_row("units below the row of names (units: true)")
        # the monitor's stamp stands before the row of names, too
        if marks.arrow and name_cells and is_stamp(name_cells[0].strip()):
            name_cells[0] = "time"
        name_cells = name_cells or list(marks.labels)
        if not name_cells:
            name_cells, unit_cells = gef_names, gef_units
        for _ in range(_further_header_rows([_cells(line, delimiter) for line in lines])):
            above.append(lines.pop(0))
        rows = [_cells(line, delimiter) for line in lines if line.whole]
        rows = self._rows_of_source(rows)[: FIRST.rows]
        name_cells, unit_cells = without_mark(name_cells, rows), without_mark(unit_cells, rows)
        units = units_by_name(name_cells, unit_cells, _row_width(rows, name_cells))
        layout = Layout(
            tuple(units),
            delimiter=delimiter,
            decimal=text.decimal,
            quote=delimiter != " ",
            comment=text.comment,
            dates=ORDERS.get(text.dates, ""),
            void=gef_voids,
            rewrites=marks.rewrites,
        )
        # an iterator, read only if the first rows leave a column unclear
        rows_below = (
            marks.strip(line.text).split(delimiter)
            for line in each_line(head[lines[-1].stop :] if lines else b"", text.encoding)
            if line.whole and _is_content(line, text.comment)
        )
        plan = plan_columns(self, layout, units, rows, text.rate_Hz, rows_below)
        return replace(plan, start=above[-1].stop if above else 0)

    def _rows_of_source(self, rows: list[list[str]]) -> list[list[str]]:
        """Return the rows that `where` chooses by the number of a column: others may have other cells.

        `rows`: Cells of the first rows. Where `where` names a column instead, its place is not known yet.
        """
        for name, allowed in self.where.items():
            if number := re.fullmatch(r"column ([1-9]\d*)", name):
                column = int(number[1]) - 1
                labels = [cells[column].strip() if column < len(cells) else "" for cells in rows]
                rows = [*compress(rows, are_allowed(labels, allowed))]
        return rows


def plan_columns(
    reader: TableReader,
    layout: Layout,
    units: Mapping[str, str],
    rows: Sequence[Sequence[str]],
    rate: float | None = None,
    rows_below: Iterable[Sequence[str]] = (),
) -> ReadingPlan:
    """Plan how to read the columns of a table, by its first rows.

    Parameters
    ----------
    reader : TableReader
        Its `asked` are the columns asked for, its `where` the sources that the config chose.
    layout : Layout
        Names of the columns, and how a line is split into cells.
    units : mapping of str to str
        Column to its unit as the header states it.
    rows : sequence
        Cells of the first rows.
    rate : float, optional
        Rows a second, Hz; if it is given, the time is the number of the row over this rate.
    rows_below : iterable, optional
        Cells of the rows below; iterated over only if the first rows leave a column unclear.

    Returns
    -------
    ReadingPlan
        The plan; its `start`, where the rows begin in the file, is left 0.
    """
    names = layout.names
    # times as text become seconds; a note says how, and a time of day is counted on over midnight by a clock
    seen = judge_columns(rows, names, layout.decimal, layout.dates, rows_below)
    notes = [f"time is the row number / {rate:g} Hz (the config)"] if rate else []
    clocks: dict[str, RestartingClock] = {}
    clock_times: set[str] = set()
    for name, first_time in seen.first_times.items():
        note = note_of(first_time, seen.dates)
        notes += [note.replace("time", name, 1)] if note else []
        if is_clock_time(first_time):
            clock_times.add(name)
        if note in PERIOD_S:
            clocks[name] = RestartingClock(PERIOD_S[note])
    units_of_log = {**units, **dict.fromkeys(seen.first_times, "s")}

    def derive(columns: dict[str, np.ndarray], line_numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Make clock times continuous, and add the time where the config states the rate."""
        for name in clocks.keys() & columns:
            columns[name] = clocks[name].follow(columns[name])
        return {**columns, "time": line_numbers / rate} if rate else columns

    if rate:
        seen.unread.pop("time", None)
        units_of_log["time"] = "s"
    return ReadingPlan(
        replace(
            layout,
            kinds=seen.kinds,
            dates=seen.dates,
            no_value=layout.no_value or NO_VALUE,
            mixed=seen.mixed,
            other_decimal=seen.other_decimal,
            # a column that is not there is refused by `narrow`, which knows the file
            where=tuple(
                (names.index(name), allowed)
                for name, allowed in reader.where.items()
                if name in names
            ),
        ),
        units_of_log,
        0,
        derive if rate or clocks else None,
        notes=tuple(notes),
        unread=seen.unread,
        labels=_label_columns(reader, names, seen.kinds, rows),
        header=units,
        clock_times=frozenset(clock_times),
    )


def _label_columns(
    reader: TableReader, names: Sequence[str], kinds: Sequence[Kind], rows: Iterable[Sequence[str]]
) -> frozenset[str]:
    """Return the names of the columns that may say where a row is from, as from which of two sensors.

    They hold words, or few different whole numbers that are not asked for. `kinds`, `rows`: Kind of each column, and
    cells of the first rows.
    """
    asked = reader.asked_among(names) or {*names}
    if "skip" not in kinds and asked.issuperset(names):
        return frozenset()
    columns = zip(*_rows_of_width(rows, len(names)), strict=True)
    return frozenset(
        name
        for name, kind, column in zip(names, kinds, columns, strict=False)
        if kind == "skip" or (name not in asked and _are_labels(column))
    )


_WHOLE_OR_BLANK = re.compile(r"[+-]?\d+([.,]0+)?|")


def _are_labels(cells: Sequence[str]) -> bool:
    """Return whether the cells of a column are whole numbers or blank, each twice on average or more often."""
    distinct = {*cells}
    return len(distinct) * 2 <= len(cells) and all(map(_WHOLE_OR_BLANK.fullmatch, distinct))


_GEF_COLUMN = re.compile(r"#COLUMNINFO\s*=\s*(\d+)\s*,\s*([^,]*),\s*([^,]*)", re.IGNORECASE)


def _columns_of_gef(lines: Sequence[Line]) -> tuple[list[str], list[str]]:
    """Return names and units of the columns from the header of a penetration test (GEF); empty for other files.

    `lines`: Lines above the rows, such as ``#COLUMNINFO= 1, m, depth, 1``: number, unit and name of a column.
    """
    stated = {int(c[1]): c for line in lines if (c := _GEF_COLUMN.match(line.text.strip()))}
    if sorted(stated) != list(range(1, len(stated) + 1)):
        return [], []
    columns = [stated[number] for number in sorted(stated)]
    return [c[3].strip() for c in columns], [c[2].strip() for c in columns]


_GEF_VOID = re.compile(r"#COLUMNVOID\s*=\s*\d+\s*,\s*([-+.\d]+)", re.IGNORECASE)


def _voids_of_gef(lines: Sequence[Line]) -> tuple[float, ...]:
    """Return the numbers that mean no data, from the header of a penetration test (GEF): ``#COLUMNVOID= 1, -9999``."""
    stated = [match[1] for line in lines if (match := _GEF_VOID.match(line.text.strip()))]
    return tuple({float(number) for number in stated if PLAIN_NUMBER.fullmatch(number)})


def _further_header_rows(rows: Sequence[list[str]]) -> int:
    """Return how many rows of words stand between a header and the first row with a number, as in TOA5 and AGS4.

    `rows`: Cells of the lines below the header. 0 also where these words are no part of the table.
    """
    for rows_above, cells in enumerate(rows[: FIRST.header_rows]):
        if any(map(is_value, cells)):
            return rows_above
        if len(cells) != len(rows[0]) or not any(cell.strip() for cell in cells):
            break
    return 0


def is_value(cell: str) -> bool:
    """Return whether a cell is a number in any spelling, or a time."""
    plain = plain_number(cell.strip())
    return is_stamp(plain) or any(number.fullmatch(plain) for number in _NUMBERS.values())


class LineMarks(NamedTuple):
    """What stands before the numbers of each line, printed by a monitor of a serial port or by the board.

    `arrow`: Whether each line begins with the Arduino monitor's ``12:03:36.100 -> ``. `labels`: A name for each
    cell, as in ``force:1.2``; empty without. `rewrites`: Patterns and replacements that, in this order, leave only
    cells.
    """

    arrow: bool
    labels: tuple[str, ...]
    rewrites: tuple[tuple[re.Pattern[bytes], bytes], ...]

    def strip(self, line: str) -> str:
        """Remove these marks from a line, so that only cells and delimiters are left."""
        return rewritten(line.encode(), self.rewrites).decode() if self.rewrites else line


_EXCEL_TEXT = re.compile(rb'="([^"\r\n]*)"'), rb"\1"
"""Pattern of a cell that Excel is to take as text, ``="007"``, and its replacement."""
# the arrow of a monitor becomes a delimiter, so that the stamp before it is a cell
_ARROW = re.compile(rb"^(\d\d?:\d\d:\d\d(?:\.\d+)?) -> ", re.MULTILINE)
_LABELLED = re.compile(r"\s*([^\W\d][\w .()/\[\]-]{0,40}?)\s*[:=]\s*([-+.\d].*)")
"""A cell with a label before its number: ``force:1.2``, ``force = 1.2``."""
_SPACED_LABEL = re.compile(rb"([A-Za-z_]\w*)[ \t]*[:=][ \t]+(?=[-+.\d])")
"""A label with a blank behind it."""


def find_line_marks(lines: Sequence[str], delimiter: str) -> LineMarks:
    """Find the stamps of a serial monitor and the labels of a serial plotter, if they stand in most of the lines.

    `lines`: First lines of the file, below those to be skipped.
    """
    rewrites: list[tuple[re.Pattern[bytes], bytes]] = []
    filled = [line.encode() for line in lines if line.strip()]
    # where blanks separate cells, a label and its number must become one cell: "force: 1.2" -> "force:1.2"
    join_label = [(_SPACED_LABEL, rb"\1:")] if delimiter == " " else []
    for rewrite in (_EXCEL_TEXT, (_ARROW, rb"\1" + delimiter.encode()), *join_label):
        if sum(bool(rewrite[0].search(line)) for line in filled) * 2 > len(filled):
            rewrites.append(rewrite)
            filled = [rewritten(line, [rewrite]) for line in filled]
    arrow = any(pattern is _ARROW for pattern, _ in rewrites)
    if not any(b":" in line or b"=" in line for line in filled):
        return LineMarks(arrow, (), tuple(rewrites))
    labels_of_lines = [
        tuple(match[1] if (match := _LABELLED.fullmatch(cell)) else "" for cell in cells)
        for line in filled
        if (cells := cells_of(line.decode(), delimiter))
    ]
    # the most frequent labels, which count if they stand in more than half of the lines
    labels = max(set(labels_of_lines), key=labels_of_lines.count, default=())
    if not any(labels) or labels_of_lines.count(labels) <= max(1, len(labels_of_lines) / 2):
        return LineMarks(arrow, (), tuple(rewrites))
    between = r"\s" if delimiter == " " else re.escape(delimiter)
    # long labels first: force_x ends with the label x
    for label in sorted({*labels} - {""}, key=len, reverse=True):
        before = rf"(^|{between})[ \t]*{re.escape(label)}\s*[:=][ \t]*"
        rewrites.append((re.compile(before.encode(), re.MULTILINE), rb"\1"))
    return LineMarks(arrow, labels, tuple(rewrites))


def _take_row(lines: list[Line]) -> Line:
    """Remove the first line from `lines` and return it, joined with the next ones up to the end of an open quote.

    A spreadsheet puts names with line breaks in quotes. Without an end of the quote only the first line is taken.
    """
    for count in range(1, min(FIRST.name_lines, len(lines)) + 1):
        text = " ".join(line.text.strip() for line in lines[:count])
        if text.count('"') % 2 == 0:
            last = lines[count - 1]
            del lines[:count]
            return Line(text if count > 1 else last.text, last.stop, last.whole)
    return lines.pop(0)


def _is_content(line: Line, comment: str) -> bool:
    """Return whether a line is neither blank nor a comment."""
    text = line.text.strip()
    return bool(text) and not (comment and text.startswith(comment))


def _cells(line: Line, delimiter: str) -> list[str]:
    """Return the cells of a line, split at each delimiter where its quotes do not match."""
    return cells_of(line.text, delimiter) or line.text.split(delimiter)


def _row_width(rows: Sequence[list[str]], names: Sequence[str]) -> int:
    """Return the number of cells of a row: the number of names, but for a delimiter at the end of the names or rows.

    `rows`: Cells of the first rows. `names`: Cells of the row of names; empty: there is no such row.
    """
    if not rows:
        return max(len(names), 1)
    widths = [len(cells) for cells in rows]
    usual = most_frequent(widths)
    if not names or len(names) in widths:
        return len(names) or usual
    names_end_blank = not names[-1].strip() and usual == len(names) - 1
    ends = [cells[-1].strip() for cells in rows if len(cells) == len(names) + 1]
    rows_end_blank = not any(ends) and usual == len(names) + 1
    if names_end_blank or rows_end_blank:
        return usual
    raise ValueError(f"{len(names)} names, but {usual} cells in most rows")


class ColumnKinds(NamedTuple):
    """Kind of each column, as the first rows show it.

    `kinds`: In the order of the columns: number, stamp (a time as text) or skip (not read). `first_times`: Column of
    times as text, to its first time. `dates`: Order of day, month and year (``dmy``); empty: no dates. `unread`: Column
    that holds neither numbers nor times, to its first cell and why it is not read. `mixed`: Indices of columns of
    numbers in which words or no values were found. `other_decimal`: Indices of columns with the other decimal mark.
    """

    kinds: tuple[Kind, ...]
    first_times: dict[str, str]
    dates: str
    unread: dict[str, str]
    mixed: frozenset[int] = frozenset()
    other_decimal: frozenset[int] = frozenset()


def judge_columns(
    rows: Iterable[Sequence[str]],
    names: Sequence[str],
    decimal: str = ".",
    dates: str = "",
    rows_below: Iterable[Sequence[str]] = (),
) -> ColumnKinds:
    """Find out which columns hold numbers, or times as text, by their cells that have a value.

    A column of words and numbers is one of numbers, if any cell is a number: its words are no values. The
    `rows_below` are searched for numbers if a column has none in the first `rows`. `rows`: Cells of each row; those
    with another number of cells than there are `names` are passed over. `dates`: As in `ColumnKinds`; empty: found
    here.
    """
    columns: list[Sequence[str]] = [*zip(*_rows_of_width(rows, len(names)), strict=True)]
    columns = [_without_thousands(cells, decimal) for cells in columns or [()] * len(names)]
    number = _NUMBERS[decimal].fullmatch

    def count_numbers(cells: Sequence[str]) -> int:
        """Count the cells that are numbers in any spelling."""
        # the first test is enough for most cells, and faster
        return sum(bool(number(cell) or number(plain_number(cell))) for cell in cells)

    other_decimal = {
        index for index, cells in enumerate(columns) if _has_other_decimal(cells, decimal)
    }
    other_mark = "," if decimal == "." else "."
    for index in other_decimal:
        columns[index] = [cell.replace(other_mark, decimal) for cell in columns[index]]
    n_numbers = [*map(count_numbers, columns)]
    unclear = {
        index
        for index, cells in enumerate(columns)
        if not n_numbers[index] and not any(map(is_stamp, cells))
    }
    if unclear and len(unclear) < len(
        names
    ):  # all columns are unclear in a file that is no such table
        below = [*zip(*_rows_of_width(rows_below, len(names)), strict=True)]
        for index in unclear if below else ():
            columns[index] = (*columns[index], *below[index])
            n_numbers[index] = count_numbers(below[index])
    kinds: list[Kind] = []
    first_times: dict[str, str] = {}
    unread: dict[str, str] = {}
    mixed: set[int] = set()
    for index, (name, cells) in enumerate(zip(names, columns, strict=True)):
        filled = [cell for cell in cells if cell not in NO_VALUE]
        times = list(filter(is_stamp, filled))
        are_times = len(times) * 2 > len(filled)
        are_numbers = n_numbers[index] * 2 > len(filled)
        order = dates or date_order(times)
        if not cells:
            kinds.append("number")
        elif are_numbers or (n_numbers[index] and not are_times):
            kinds.append("number")
            nan_count = sum(cell.casefold() == "nan" for cell in filled)
            is_often_nan = nan_count * FIRST.blank_by_share >= len(cells)
            if not are_numbers or is_often_nan:
                mixed.add(index)
        elif not filled and not name.startswith("column "):
            # a column with a name and no value yet: its values may begin below
            kinds.append("number")
            mixed.add(index)
        elif are_times and order:
            kinds.append("stamp")
            first_times[name], dates = times[0], order
        else:
            kinds.append("skip")
            why = (
                "day or month first? the config says it (`text: {dates: month first}` of this log)"
                if are_times
                else "no number and no time"
            )
            if filled:
                unread[name] = f"{filled[0]!r} ({why})"
    if not any(kind == "number" and index not in mixed for index, kind in enumerate(kinds)):
        # where no column holds numbers alone, all are read as such: each row is then counted with its reason
        return ColumnKinds(tuple[Kind, ...](["number"] * len(names)), {}, "", {})
    mixed |= other_decimal
    return ColumnKinds(
        tuple(kinds), first_times, dates, unread, frozenset(mixed), frozenset(other_decimal)
    )


def _without_thousands(column: Sequence[str], decimal: str) -> Sequence[str]:
    """Return the cells of a column without marks between thousands: 10204 for 10.204 where the decimal mark is a comma.

    Unchanged where the mark of any cell cannot stand between thousands, as in 10.2.
    """
    mark = "." if decimal == "," else ","
    marked = [cell for cell in column if mark in cell]
    if not marked or not all(map(IN_THOUSANDS[mark].fullmatch, marked)):
        return column
    return [cell.replace(mark, "") for cell in column]


def _has_other_decimal(column: Sequence[str], decimal: str) -> bool:
    """Return whether most cells of a column are numbers with the other decimal mark, which cannot mark thousands."""
    mark = "," if decimal == "." else "."
    marked = [plain_number(cell) for cell in column if mark in cell]
    are_numbers = [cell for cell in marked if _NUMBERS[mark].fullmatch(cell)]
    may_be_thousands = all(map(IN_THOUSANDS[mark].fullmatch, are_numbers))
    return (
        not may_be_thousands
        and len(are_numbers) * 2 > len(column)
        and not any(map(is_stamp, marked))
    )


def _rows_of_width(rows: Iterable[Sequence[str]], width: int) -> list[list[str]]:
    """Return the stripped cells of the rows that have `width` cells."""
    return [[cell.strip() for cell in cells] for cells in rows if len(cells) == width]


_MARK = re.compile(r"\s*(#+|%+|//+)\s*")
"""Mark before a comment: `#` of gnuplot, NumPy and LAMMPS, `%` of MATLAB and TeX."""


def without_mark(names: list[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a row of names without the mark of a comment; a ``#`` that is the name of a column stays.

    `names`, `rows`: Cells of the row of names, and of the rows below, whose width tells a mark from a name.
    """
    mark = _MARK.match(names[0]) if names else None
    if mark is None:
        return names
    first_name = names[0][mark.end() :].strip()
    if first_name:
        return [first_name, *names[1:]]
    widths = [len(cells) for cells in rows]
    return names if not widths or most_frequent(widths) >= len(names) else names[1:]


# --- The format of an unknown text


def guess_text_settings(head: bytes) -> dict[str, Any] | None:
    """Guess the format of a text file: the keys of `text` in the config that differ from the defaults, to their values.

    None where no format gives at least two rows of at least two cells, at least half of which are numbers.
    """
    first_lines = decode_first_lines(text_head(head), FIRST.format_lines)
    left = [line for line in first_lines if line.whole]
    n_lines = len(left)
    # rows, and the number of the line in which each begins: a row of names may have several lines
    rows, line_numbers = [], []
    while left:
        line_numbers.append(n_lines - len(left))
        rows.append(_take_row(left))
    scored_formats = [
        scored
        for delimiter in (",", ";", "\t", "|", " ")
        for decimal in ".,"
        if delimiter != decimal and (scored := _score_format(rows, delimiter, decimal)) is not None
    ]
    if not scored_formats:
        return None
    _, text = max(scored_formats, key=lambda scored: scored[0])
    # the config counts lines of the file
    text["skip_lines"] = line_numbers[text["skip_lines"]]
    try:
        DelimitedReader(TextFormat.model_validate(_without_defaults(text))).plan(head)
    except ValueError:
        # the supposed names do not fit the rows: columns are named by number
        text["skip_lines"] += text["names"] + text["units"]
        text |= {"names": False, "units": False}
    return _without_defaults(text)


def _without_defaults(text: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of `text` without those that have their default; the delimiter is always stated."""
    fields = TextFormat.model_fields
    return {
        key: value
        for key, value in text.items()
        if key == "delimiter" or fields[key].default != value
    }


def _score_format(
    lines: Sequence[Line], delimiter: str, decimal: str
) -> tuple[float, dict[str, Any]] | None:
    """Read the lines with a delimiter and a decimal mark; return a score (high is good) and the keys of `text`.

    The score is the share of numbers in the lines from the first row on, about 0 to 1, with small extras. None where
    fewer than two lines look like rows of two or more cells. Here `skip_lines` counts the given `lines`.
    """
    marks = find_line_marks([line.text for line in lines], delimiter)
    table = [cells_of(marks.strip(line.text), delimiter) or [] for line in lines]
    shares = [_share_of_numbers(cells, decimal) for cells in table]
    widths = [len(cells) for cells, share in zip(table, shares, strict=True) if share >= 0.5]
    if not widths:
        return None
    width = most_frequent(widths)
    # lines that look like rows, by their numbers from 0
    candidates = [
        number
        for number, (cells, share) in enumerate(zip(table, shares, strict=True))
        if len(cells) == width and share >= 0.5
    ]
    first = _first_of_data(candidates, len(table))
    rows = [number for number in candidates if number >= first]
    if width < 2 or len(rows) < 2:
        return None
    above = [without_mark(cells, [[""] * width]) for cells in table[:first]]
    # labels within the cells are the names, whatever stands above
    names_at, units = (None, False) if marks.labels else _header_above(above, width, decimal)
    names = names_at is not None
    text = {
        "delimiter": DELIMITER_WORDS.get(delimiter, delimiter),
        "decimal": decimal,
        "skip_lines": names_at if names_at is not None else first,
        "names": names,
        "units": units and names,
    }
    score = sum(shares[number] for number in rows) / (len(table) - first)
    # more columns decide between formats that fit alike
    score += 0.01 * min(width, 20)
    # decides between delimiters, as names between blanks may stand above rows between tabs
    score += 0.005 * (names_at is not None and len(above[names_at]) == width)
    return score, text


def _first_of_data(candidates: Sequence[int], n_lines: int) -> int:
    """Return the line, from 0, where the data begin.

    Settings in the header may look like a row, and results like a short table: a short run of rows is skipped.
    `candidates`: Numbers of the lines that look like rows. `n_lines`: Number of all lines.
    """
    runs: list[list[int]] = []
    for number in candidates:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    longest = max(map(len, runs))
    for run in runs:
        if len(run) * FIRST.shorter_by >= longest and len(run) > 1:
            return run[0]
    # single lines alone: the last line may be the only row of a log that has just begun
    return candidates[-1] if candidates[-1] == n_lines - 1 else candidates[0]


def _header_above(above: Sequence[list[str]], width: int, decimal: str) -> tuple[int | None, bool]:
    """Return the line of the names above data of `width` columns, or None, and whether a row of units follows.

    `above`: Cells of all lines above the data; the line is an index of these.
    """
    filled = [number for number, cells in enumerate(above) if any(map(str.strip, cells))]
    if not filled:
        return None, False
    last = filled[-1]
    # a units row, perhaps with one or two rows of words below it: the types of AGS4, the sampling of TOA5
    for number in reversed([number for number in filled if number > last - 3]):
        if number - 1 in filled and is_units_row(above[number], width):
            is_header = _are_names(above[number - 1], width, decimal)
            return (number - 1, True) if is_header else (None, False)
        if len(above[number]) != width or not _are_names(above[number], width, decimal):
            break
    return (last, False) if _are_names(above[last], width, decimal) else (None, False)


def _share_of_numbers(cells: Sequence[str], decimal: str) -> float:
    """Return the share of the cells of a line that are numbers or times; 1 where only blank cells are neither.

    A blank cell at the end does not count; a line of one cell, which may be any text, has no share.
    """
    plain = [plain_number(cell.strip()) for cell in cells]
    if len(plain) > 1 and not plain[-1]:  # a delimiter at the end of a line
        plain.pop()
    numbers = sum(bool(_NUMBERS[decimal].fullmatch(cell)) or is_stamp(cell) for cell in plain)
    filled = sum(cell not in NO_VALUE for cell in plain)
    if numbers == filled > 1:
        return 1.0
    return numbers / len(plain) if len(cells) > 1 else 0.0


def _are_names(cells: Sequence[str], width: int, decimal: str) -> bool:
    """Return whether cells may be the names of `width` columns: about as many, of which less than half are numbers."""
    filled = [cell for cell in cells if cell.strip()]
    is_near_width = abs(len(cells) - width) <= 1
    # a blank cell is added, as a line of one cell has no share; it does not count
    return bool(filled) and is_near_width and _share_of_numbers([*filled, ""], decimal) < 0.5


def encoding_of(head: bytes) -> str:
    """Return the name of the encoding of a file, for people; ``binary`` for a file that is no text."""
    if utf16_of(head):
        return "UTF-16"
    if head and not text_head(head):
        return "binary"
    if head.startswith(codecs.BOM_UTF8):
        return "UTF-8 with a byte order mark"
    if head.isascii():
        return "ASCII"
    try:
        # a head that is not the whole file may end within a character
        codecs.getincrementaldecoder("utf-8")().decode(head, final=len(head) < HEAD_BYTES)
    except UnicodeDecodeError:
        return "8 bits a character, not UTF-8; read as Windows-1252"
    return "UTF-8"


def read_first_lines(head: bytes) -> list[str]:
    """Return the first five lines of a file, to be shown; each cut to 100 characters."""
    text = text_head(head)
    if not text:
        return [repr(decoded(head[:60]))]
    return [line.text[:100] for line in decode_first_lines(text, 5)]
