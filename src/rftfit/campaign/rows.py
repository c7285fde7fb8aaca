"""Reads tables that a user makes (csv, tsv or xlsx), and checks them cell by cell against a schema.

`read_rows` gives each row as a `DraftRow`; `read_table_columns` does the same work for tables of millions of rows, as
columns; `read_sheets` gives plain cells of a table in any layout. Rows are numbered as in a spreadsheet: the first is
1.

A *problem* is a sentence for the user on one place (`Problem`). Problems are collected, not raised, so that the user
sees all of them at once; only a table that cannot be read at all raises `CampaignError`.
"""

from __future__ import annotations

import contextlib
import csv
import io
import math
import re
import zipfile
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, MutableSequence, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, islice, repeat, zip_longest
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.campaign import files
from rftfit.campaign.problems import (
    CampaignError,
    Place,
    Problem,
    Severity,
    did_you_mean,
    join_words,
)
from rftfit.table.numbers import COMMA, NOT_FINITE, cut_unit, has_decimal_commas, number_of
from rftfit.table.parse import Kind, Layout, read_cells_of
from rftfit.table.text import as_utf8, decoded, is_web_page, records_of, text_head, utf16_of
from rftfit.table.units import cut_header, folded_name, unit_among, units_like
from rftfit.table.workbook import (
    ERROR_VALUES,
    MOMENTS,
    WORKBOOK,
    open_workbook,
    place_of_column,
    rows_of,
    text_of,
)

Form = Literal["name", "choice", "number", "path", "flag", "text"]
"""What the cells of a column hold: a name for files, one of some words, a number, a path, yes or no, or any text."""
Others = Literal["refused", "warned", "ignored"]
"""What is done about a column that the schema does not have."""
Line = tuple[int, list[str]]
"""Number of a row, and its cells."""
Columns = dict[str, npt.NDArray[Any]]
"""Name of a column, to its values for n rows, shape (n,)."""


@dataclass(frozen=True)
class TableColumn:
    """One column of a table, as the program wants it.

    `meaning`: Words for the user.
    `needed`: True if the table must have the column, and each of its cells a value.
    `choices`: Words that a cell of the form choice may hold; None where they are not known, as after an error in the
    config: each cell is then bad, without a problem.
    `low`, `high`: Inclusive range of a number; `above`: exclusive lower limit; None: no limit.
    `unit`: Unit in which the program gets a number. A header may state another one of the same dimension, as in
    ``x_mm`` or ``x (mm)``, and is then converted.
    `default`: Unit of the numbers in the file where the header states none; empty: `unit`.
    `also`: Other names of the column in a header.
    `names_with_unit`: Further names, only for a header that states the unit.
    `hint`: Words added to what is allowed.
    `period`: Numbers that differ by this mean the same: 180 for the angle of a plate, which has two faces; 0: none.
    """

    name: str
    form: Form = "number"
    meaning: str = ""
    needed: bool = True
    choices: tuple[str, ...] | None = None
    low: float | None = None
    high: float | None = None
    above: float | None = None
    unit: str = ""
    default: str = ""
    also: tuple[str, ...] = ()
    names_with_unit: tuple[str, ...] = ()
    hint: str = ""
    period: float = 0.0

    @cached_property
    def units(self) -> Mapping[str, float]:
        """Unit that a header or a cell may state, to the factor by which its numbers are converted to `unit`."""
        return units_like(self.unit)

    @cached_property
    def stems(self) -> frozenset[str]:
        """Names without a unit, in the spelling of `folded_name`, for headers that state the unit beside the name."""
        stems = (name for name, unit in cut_header(self.name) if unit_among(unit, self.units))
        return frozenset([*stems, *self.names_with_unit])

    def unit_in(self, header: str) -> str:
        """Return the unit that a header states behind a name; empty: none."""
        units = (unit_among(unit, self.units) for _, unit in cut_header(header))
        return next(filter(None, units), "")

    def is_needed_in(self, _: Mapping[str, str]) -> bool:
        """Return whether the cell of a row must be filled; a derived class may decide by the cells of the row."""
        return self.needed

    @property
    def header_needed(self) -> bool:
        """True if a table without this column cannot be read; in a derived class not all rows may need the column."""
        return self.needed

    @property
    def allowed(self) -> str:
        """Words on what a cell may hold, for messages: ``0 to 90 degrees``."""
        allowed = {
            "name": "letters A-Z a-z, digits, and . _ -",
            "choice": ", ".join(self.choices or ()),
            "path": "a path inside the raw folder, with /",
            "flag": "yes, no or blank",
            "text": "any text",
            "number": "a number",
        }[self.form]
        if self.low is not None and self.high is not None:
            allowed = f"{self.low:g} to {self.high:g}"
        elif self.above is not None:
            allowed += f" above {self.above:g}"
            allowed += "" if self.high is None else f", up to {self.high:g}"
        elif self.low is not None:
            allowed += f" of at least {self.low:g}"
        allowed += self.unit and f" {self.unit}"
        return allowed + (self.hint and f"; {self.hint}")

    def holds(self, value: float) -> bool:
        """Return whether a number is in the range."""
        return (
            (self.low is None or value >= self.low)
            and (self.high is None or value <= self.high)
            and (self.above is None or value > self.above)
        )

    def why_unused(self, cells: Mapping[str, str]) -> str | None:  # noqa: ARG002
        """Return why a row does not use this column: empty if it does, None if that is unknown.

        Here each row does; in a derived class that may depend on the other `cells` of the row, by name of column.
        """
        return ""


@dataclass(frozen=True)
class Schema:
    """Format of a table: its columns, and the rules for all else.

    `area`: First part of the codes of problems, as ``sheet`` in ``sheet.empty``.
    `rows`: Noun for its rows in messages.
    `comments`: True if lines that start with ``#`` are left out.
    `lenient`: True if a bad cell is only marked in its row, without a problem: the caller leaves such rows out.
    `most_rows`: Most rows of a table that is read by rows; one with more is refused.
    `missing`: Column to the numbers that mean no data, in the unit of the file: a row with one of them has no data.
    `decimal`: Decimal mark of its numbers, which the reader finds in the file.
    `file`: Name of the table in problems, which the reader sets.
    """

    area: str
    columns: tuple[TableColumn, ...]
    rows: str = "rows"
    comments: bool = False
    others: Others = "refused"
    lenient: bool = False
    most_rows: int = 200_000
    missing: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    decimal: str = "."
    file: str = ""

    def refusal(
        self, code: str, allowed: str, value_found: str | None = None, row: int | None = None
    ) -> CampaignError:
        """Make the error, to be raised, for a table that cannot be read at all; arguments as in `Problem`."""
        place = Place(self.file, row)
        return CampaignError([Problem(f"{self.area}.{code}", place, value_found, allowed)])

    @property
    def names(self) -> list[str]:
        """All names by which a header may name a column: those of the columns, and their other names."""
        return [name for column in self.columns for name in (column.name, *column.also)]

    @property
    def no_rows(self) -> tuple[Problem, ...]:
        """Problem of a table with a header and no row, in a tuple to be added to the others."""
        allowed = f"no {self.rows} yet: below the header, one row for each is needed"
        return self.refusal("empty", allowed).problems


@dataclass(slots=True, eq=False)
class DraftRow:
    """A row while it is being checked: its good cells, and which are bad.

    `row`: Number of the row as in a spreadsheet; 0: the problems are of the whole table.
    `problems`: The list of problems of the whole table, to which this row adds its own.
    `text`: Column to its cell as text; blank and bad cells are empty.
    `number`: Column to the number of a good cell, in the unit of the schema.
    `bad`: Columns whose cell has an error, or is blank though needed.
    `no_data`: True if a cell has a number that means no data; `number` has 0 there.
    """

    schema: Schema
    row: int
    problems: MutableSequence[Problem]
    text: dict[str, str] = field(default_factory=dict)
    number: dict[str, float] = field(default_factory=dict)
    bad: set[str] = field(default_factory=set)
    no_data: bool = False

    def note(
        self,
        column: str,
        code: str,
        value_found: str | None,
        allowed: str,
        nearest: str | None = None,
        severity: Severity = "error",
    ) -> None:
        """Add a problem of one cell; the arguments as in `Problem`. An error makes the column bad in this row.

        `code`: Without the area of the schema, which is put in front.
        """
        if severity == "error":
            self.bad.add(column)
        place = Place(self.schema.file, self.row or None, column)
        code_of_area = f"{self.schema.area}.{code}"
        self.problems.append(Problem(code_of_area, place, value_found, allowed, nearest, severity))

    def yes(self, column: str) -> bool:
        """Return whether the cell of a flag says yes; False also where it is blank or bad."""
        return self.text.get(column) == "yes"

    def check_file(
        self, column: TableColumn, folder: files.Folder, lost: str, above: str = ""
    ) -> None:
        """Check that the file that a cell names exists; for the folder of a ROS 2 bag the cell gets its index file.

        `folder`, `above`: Folder of the files, and folder within it that the cell leaves out. `lost`: Words on what
        happens to the row where the file is missing; empty: no warning.
        """
        name = self.text[column.name]
        if not name:
            return
        start = f"{above}/" if above else ""
        # the noun in codes and words: "log" of the column force_log
        status, what = folder.status(start + name), column.name.rpartition("_")[2]
        if status == "outside":
            allowed = f"{column.allowed}; a link leads out of it"
            self.note(column.name, "path-outside", name, allowed)
        elif status == "folder" and folder.status(f"{start}{name}/{files.BAG}") == "file":
            self.text[column.name] = f"{name}/{files.BAG}"
        elif status in ("folder", "other"):
            which = "a folder" if status == "folder" else "no regular file"
            self.note(column.name, f"{what}-not-a-file", name, f"a {what} file; this is {which}")
        elif status == "missing" and lost:
            nearest = folder.nearest(start + name)
            allowed = f"a file that exists in the raw folder; {lost}"
            nearest = nearest and nearest[len(start) :]
            self.note(column.name, f"{what}-missing", name, allowed, nearest, "warning")


# --- A table as text, and where its columns stand


@dataclass
class _Table:
    """Header and rows of a file as text, without blank rows.

    `rows`: Number of each row, and its cells. `bad`: Number of the row and index of the column of a cell of a workbook
    that holds no typed value, to its code and text. `header_row`, `last`: Numbers of the header's row and of the last
    row that was read, blank or not.
    """

    header: list[str] = field(default_factory=list)
    rows: list[Line] = field(default_factory=list)
    bad: dict[tuple[int, int], tuple[str, str]] = field(default_factory=dict)
    header_row: int = 1
    last: int = 0
    delimiter: str = ","
    decimal: str = "."

    def add(self, row: int, cells: list[str]) -> None:
        """Add a row; the first one that is not blank is the header."""
        self.last = row
        if not any(cells):
            return
        if self.header:
            self.rows.append((row, cells))
        else:
            self.header, self.header_row = cells, row


class HeaderCell(NamedTuple):
    """Header of a column in the file.

    `position`: Index of the column in the file. `name`: Its name there. `unit`: Unit in the file. `scale`: Factor
    from this unit to the unit of the schema; NaN where it is not known. `is_stated`: True if the header states the unit.
    """

    position: int
    name: str
    unit: str
    scale: float
    is_stated: bool


_Headers = dict[str, HeaderCell]
"""Name of a column of the schema, to its header in the file; without columns that the file does not have."""


# --- Reading by rows


def read_rows(
    path: Path, schema: Schema, file: str | None = None
) -> tuple[list[DraftRow], list[Problem]]:
    """Read a table, a workbook or text, as its content shows.

    `file`: Its name in problems; default: its path. Returns every row, good or bad, and all problems; for a lenient
    schema without those of single cells. A table that cannot be read has no rows, and its reason among the problems.
    """
    schema = replace(schema, file=str(path) if file is None else file)
    try:
        table = _read_table(path, schema)
        headers, problems = _find_columns(table, schema)
    except CampaignError as error:
        return [], list(error.problems)
    if not table.rows:
        problems += schema.no_rows
    # a deque of length 0 forgets what is added to it
    problems_of_cells = deque[Problem](maxlen=0) if schema.lenient else problems
    return _check_rows(table, headers, schema, problems_of_cells), problems


def _check_rows(
    table: _Table, headers: _Headers, schema: Schema, problems: MutableSequence[Problem]
) -> list[DraftRow]:
    """Make a draft of each row of a table, checked cell by cell, and add the problems of cells to `problems`."""
    schema = replace(schema, decimal=table.decimal)
    # for a column that the file does not have: its cells count as blank
    no_header = HeaderCell(-1, "", "", 1.0, is_stated=False)
    columns = [(column, headers.get(column.name, no_header)) for column in schema.columns]
    # in a table of another program a column without a name may be an index: "-" stands for its name
    names = table.header if schema.others == "refused" else ["-"] * len(table.header)
    drafts: list[DraftRow] = []
    for row, cells in table.rows:
        width = len(cells)
        cell_of_column = {
            name: cells[header.position] if header.position < width else ""
            for name, header in headers.items()
        }
        draft = DraftRow(schema, row, problems)
        for column, header in columns:
            draft.text[column.name] = ""
            bad = table.bad.get((row, header.position)) if table.bad else None
            _read_cell(draft, column, cell_of_column, bad, header.scale)
        if schema.others != "ignored":
            _check_cells_without_header(draft, names, cells)
        drafts.append(draft)
    return drafts


# --- Reading by columns


BAD = "?"
"""Text in place of a bad cell."""


@dataclass
class TableRows:
    """Rows of a table as columns: a list of `DraftRow` would need too much memory for millions of rows.

    `columns`: Those of the schema; a missing number is NaN, and a text is replaced by its code, a whole number. Also
    ``row`` (number of the row), ``bad`` (True: some cell has an error, or is blank though needed) and ``no_data``
    (True: some cell has a number that means no data). `texts`: Column of texts, to each of its different texts, to the
    code; a bad cell has the text `BAD`.
    """

    columns: Columns
    texts: dict[str, dict[str, int]]

    @classmethod
    def of(
        cls, drafts: Sequence[DraftRow], schema: Schema, texts: dict[str, dict[str, int]]
    ) -> TableRows:
        """Make columns of checked rows; new texts are added to `texts`, which further blocks of the table share."""
        columns: Columns = {
            "row": np.array([draft.row for draft in drafts], dtype=np.int64),
            "bad": np.array([bool(draft.bad) for draft in drafts], dtype=bool),
            "no_data": np.array([draft.no_data for draft in drafts], dtype=bool),
        }
        for column in schema.columns:
            name = column.name
            if column.form == "number":
                numbers = [draft.number.get(name, math.nan) for draft in drafts]
                columns[name] = np.array(numbers, dtype=float)
            else:
                cells_of_column = (
                    BAD if name in draft.bad else draft.text.get(name, "") for draft in drafts
                )
                columns[name] = _code_texts(cells_of_column, texts.setdefault(name, {}))
        return cls(columns, texts)


def _code_texts(texts: Iterable[str], codes: dict[str, int]) -> npt.NDArray[np.int32]:
    """Return the code of each text, shape (n,); a new text is added to `codes` with the next number."""
    return np.array([codes.setdefault(text, len(codes)) for text in texts], dtype=np.int32)


MAX_TEXT = 500_000_000
"""Most bytes of a csv that is read by columns."""
_FIRST_BLOCK, _BLOCK = 1 << 12, 1 << 21
"""Bytes of the first block of a csv, which holds the header, and of the further ones, at least."""
_MOST_PROBLEMS = 100
"""Number of problems at which reading by columns stops."""


def read_table_columns(
    path: Path, schema: Schema, file: str
) -> tuple[TableRows, _Headers, list[Problem]]:
    """Read a table of any length by columns, block by block; a block with a bad cell is checked cell by cell.

    The first block is small and read by rows: it shows header, delimiter and decimal mark. Returns the rows, the header
    of each column, and all problems; after many problems only those of the first rows. A table that cannot be read has
    no rows and no headers.
    """
    schema = replace(schema, file=file)
    problems: list[Problem] = []
    texts: dict[str, dict[str, int]] = {}
    try:
        data = _long_text(path, schema)
        # `position`: where the part that has not been read begins
        position = _next_row_start(data, 0, _FIRST_BLOCK)
        if not data[:position].strip():  # no header there: all is read by rows
            position = len(data)
        if data:
            table = _read_csv(data[:position].decode(), schema, path.suffix.lower())
        else:
            table = _read_table(path, schema)
        headers, problems = _find_columns(table, schema)
        drafts = _check_rows(table, headers, schema, problems)
        blocks = [TableRows.of(drafts, schema, texts).columns]
        while position < len(data):
            start, position = position, _next_row_start(data, position, _BLOCK)
            block = data[start:position]
            columns = _read_valid_rows(block, table, headers, schema, texts)
            if columns is None:
                table.rows = []
                _add_rows(table, block.decode(), schema)
                drafts = _check_rows(table, headers, schema, problems)
                columns = TableRows.of(drafts, schema, texts).columns
            blocks.append(columns)
            if position < len(data) and len(problems) > _MOST_PROBLEMS:
                allowed = "this put right first: the rows below were not looked at"
                raise schema.refusal("many-problems", allowed, row=table.last)
    except CampaignError as error:
        return TableRows.of([], schema, texts), {}, [*problems, *error.problems]
    if table.last <= table.header_row:
        problems += schema.no_rows
    # each column is taken out of the blocks, so that a long table is in memory once
    joined = {name: np.concatenate([block.pop(name) for block in blocks]) for name in [*blocks[0]]}
    return TableRows(joined, texts), headers, problems


def _read_valid_rows(
    block: bytes, table: _Table, headers: _Headers, schema: Schema, texts: dict[str, dict[str, int]]
) -> Columns | None:
    """Read a block of rows as columns, by Arrow; None where a cell is not valid: `_check_rows` then says why.

    `table`: The first rows, by which delimiter, decimal mark and the number of the last row are known; the number is
    advanced. `texts`: As in `TableRows`; new texts are added.
    """
    kinds: list[Kind] = ["skip"] * len(table.header)
    for column in schema.columns:
        if column.name in headers:
            kinds[headers[column.name].position] = "number" if column.form == "number" else "word"
    names = tuple(map(str, range(len(kinds))))
    layout = Layout(names, tuple(kinds), table.delimiter, table.decimal, quote=True)
    cells = read_cells_of(layout, block, len(kinds))
    size = block.count(b"\n") + (not block.endswith(b"\n"))
    if cells is None or cells.num_rows != size:
        return None  # a bad cell, a blank line, or a quote that swallowed line ends
    columns: Columns = {name: np.zeros(size, dtype=bool) for name in ("bad", "no_data")}
    columns["row"] = np.arange(table.last + 1, table.last + 1 + size)
    draft = DraftRow(schema, 0, deque(maxlen=0))
    for column in schema.columns:
        name, header = column.name, headers.get(column.name)
        # numbers; of a text its different values and, for each row, the index of one of them
        values: Any = cells.column(str(header.position)).combine_chunks() if header else None
        if column.form == "number":
            if header is None:
                columns[name] = np.full(size, math.nan)
                continue
            numbers = values.to_numpy()
            if missing := schema.missing.get(name):
                means_no_data = np.isin(numbers, missing)
                columns["no_data"] |= means_no_data
                numbers = np.where(means_no_data, 0.0, numbers)
            columns[name] = numbers * header.scale + 0.0  # never -0
            ends = columns[name].min(), columns[name].max()  # NaN if any number is
            if not all(math.isfinite(end) and column.holds(end) for end in ends):
                return None
            continue
        # each different text is checked once; a column that the file does not have is blank
        good_texts = []
        for text in values.dictionary.to_pylist() if header else [""]:
            draft.text[name] = ""
            if header:
                _read_cell(draft, column, {name: text.strip()}, None, 1.0)
            good_texts.append(draft.text[name])
        if draft.bad:
            return None
        codes = _code_texts(good_texts, texts.setdefault(name, {}))
        columns[name] = codes[values.indices.to_numpy()] if header else np.repeat(codes, size)
    table.last += size
    return columns


_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0"
"""First bytes of an xls, and of an encrypted workbook."""


def _long_text(path: Path, schema: Schema) -> bytes:
    """Return a text table in UTF-8 with line feeds as line ends; empty for a workbook, which is read by rows."""
    cure = "leave out columns that are not needed, keep every tenth row, or part the table by media"
    data = files.read_bytes(path, schema.file, schema.area, MAX_TEXT, cure)
    if path.suffix.lower() in (".xlsx", ".xlsm") or data.startswith((WORKBOOK, _OLD_WORKBOOK)):
        return b""
    plain = data.isascii() and b"\r" not in data
    return data if plain else _decode_table(data, schema).encode()


def _next_row_start(text: bytes, begin: int, size: int) -> int:
    """Return the index of the first row that starts `size` or more bytes after `begin`, itself the start of a row.

    A line end between quotes is part of a cell: a row ends only where the number of quotes since `begin` is even.
    """
    stop = text.find(b"\n", begin + size) + 1 or len(text)
    quotes = text.count(b'"', begin, stop)
    while quotes % 2 and stop < len(text):
        begin, stop = stop, text.find(b"\n", stop) + 1 or len(text)
        quotes += text.count(b'"', begin, stop)
    return stop


# --- One cell


# code of a problem of a cell of a workbook, to the words on what is allowed
_BAD_CELLS = {
    "formula": "a value; this formula was never calculated: open the workbook in a spreadsheet and "
    "save it, or type the value",
    "date": "what you typed; the spreadsheet made a date of it: set the cell's format to Text and "
    "type it again",
    "cell-error": "a value; the spreadsheet shows an error here",
    "merged-cell": "a value of its own; this cell is merged with the one that has it: unmerge them "
    "and fill each",
}


def _read_cell(
    draft: DraftRow,
    column: TableColumn,
    cells: Mapping[str, str],
    bad: tuple[str, str] | None,
    scale: float,
) -> None:
    """Read the cell of a column into a row, or add its problem.

    `cells`: Cells of the row, by the columns that the file has. `bad`: Code and text of a cell of a workbook that holds
    no typed value (`_bad_cell`); None for any other. `scale`: As in `HeaderCell`.
    """
    name = column.name
    cell = cells.get(name, "")
    why_unused = column.why_unused(cells)
    if bad is not None and (column.form != "text" or bad[0] not in ("date", "merged-cell")):
        draft.note(name, *bad, _BAD_CELLS[bad[0]])
    elif not cell:
        if column.is_needed_in(cells) and not why_unused:
            draft.bad.add(name)
            # a missing column is one problem of the header, not a problem of each row
            if why_unused is not None and (name in cells or not column.header_needed):
                allowed = f"this cell must not be blank; allowed: {column.allowed}"
                draft.note(name, "required", None, allowed)
    elif why_unused:
        # only where there is a reason: where it is None, kind or direction are wrong, and no warning is sure
        draft.note(name, "ignored", cell, f"nothing: {why_unused}", severity="warning")
    elif column.form == "number":
        _read_number(draft, column, cell, scale)
    else:
        _READERS[column.form](draft, column, cell)


def _read_number(draft: DraftRow, column: TableColumn, cell: str, scale: float) -> None:
    """Read a number, perhaps with a unit, which then replaces the unit of the header; `scale`: as in `HeaderCell`."""
    if math.isnan(scale):  # the unit is unknown, which is a problem of the header
        draft.bad.add(column.name)
        return
    nearest, hint = None, ""
    written, unit_word = cut_unit(cell)
    if unit := unit_among(unit_word, column.units) if unit_word else None:
        cell, scale = written, column.units[unit]
    number = number_of(cell, draft.schema.decimal)
    value = number * scale
    if number in draft.schema.missing.get(column.name, ()):
        draft.no_data, value = True, 0.0
    if math.isfinite(value) and column.holds(value):
        draft.text[column.name] = cell
        draft.number[column.name] = value + 0.0  # never -0
        return
    if math.isfinite(value):
        code = "out-of-range"
        if column.period and column.low is not None:
            nearest, hint = same_angle(value / scale, column.period, column.low)
    elif COMMA.fullmatch(cell):
        code, nearest, hint = "decimal-comma", cell.replace(",", "."), "; with a decimal point"
    elif NOT_FINITE.fullmatch(cell) or not math.isnan(number):
        code = "not-finite"
    else:
        code = "not-a-number"
    draft.note(column.name, code, cell, column.allowed + hint, nearest)


def same_angle(value: float, period: float, low: float) -> tuple[str, str]:
    """Return the angle at which a plate is the same, as text, and the words on why it is.

    `value`, `period`, `low`: In degrees; the angle that is returned lies in the `period` from `low` on.
    """
    same = f"{(value - low) % period + low:g}"
    return same, f"; a plate has two faces: {value:g} is the plate at {same}"


_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}")


def _read_name(draft: DraftRow, column: TableColumn, cell: str) -> None:
    """Read a name, such as that of a run: it becomes part of the name of a file."""
    if files.is_device(cell):
        draft.note(column.name, "reserved-name", cell, files.DEVICE)
    elif _NAME.fullmatch(cell):
        draft.text[column.name] = cell
    else:
        allowed = "letters A-Z a-z, digits, and . _ -, at most 100, not beginning with . or -"
        draft.note(column.name, "bad-name", cell, allowed)


def _read_choice(draft: DraftRow, column: TableColumn, cell: str) -> None:
    """Read one of the words of the column; where they are not known, the cell is bad without a problem.

    They are unknown after an error in the config, which is a problem already.
    """
    words = column.choices
    if words is None:
        draft.bad.add(column.name)
    elif cell in words:
        draft.text[column.name] = cell
    else:
        nearest = did_you_mean(cell, words)
        draft.note(column.name, "unknown-word", cell, f"one of {join_words(words)}", nearest)


def _read_path(draft: DraftRow, column: TableColumn, cell: str) -> None:
    """Read a relative path, which stays inside its folder; whether the file exists is not checked here."""
    try:
        draft.text[column.name] = files.plain_path(cell)
    except files.BadPath as bad:
        draft.note(column.name, bad.code, cell, f"{column.allowed}; {bad.allowed}", bad.nearest)


YES = ("yes", "true", "1")
NO = ("no", "false", "0")


def _read_flag(draft: DraftRow, column: TableColumn, cell: str) -> None:
    """Read yes or no; a flag that is not set becomes empty."""
    word = cell.casefold()
    if word in YES or word in NO:
        draft.text[column.name] = "yes" if word in YES else ""
    else:
        allowed = f"{column.allowed} (also true, false, 1, 0)"
        draft.note(column.name, "bad-flag", cell, allowed, did_you_mean(cell, ("yes", "no")))


def _read_text(draft: DraftRow, column: TableColumn, cell: str) -> None:
    """Read any text without control characters."""
    if sign := files.unshowable(cell):
        allowed = "text without control characters: it is printed in tables and figures"
        draft.note(column.name, "control", sign, allowed)
    else:
        draft.text[column.name] = cell


_READERS = {
    "name": _read_name,
    "choice": _read_choice,
    "path": _read_path,
    "flag": _read_flag,
    "text": _read_text,
}


# --- The header


def _find_columns(table: _Table, schema: Schema) -> tuple[_Headers, list[Problem]]:
    """Find the columns of the schema in the header; return their headers, and the problems.

    Raises CampaignError where the header seems to stand in a row below.
    """
    headers: _Headers = {}
    problems: list[Problem] = []
    note = DraftRow(schema, table.header_row, problems).note
    unknown: list[str] = []
    names = schema.names
    with_unknown_unit: _Headers = {}
    # first the columns of the file: which column of the schema each one is
    for index, name in enumerate(table.header):
        column, unit = _column_of(name, schema)
        if column is None:
            unknown += [name] if name else []
        elif unit is None:
            header = HeaderCell(index, name, "", math.nan, is_stated=True)
            with_unknown_unit.setdefault(column.name, header)
        elif column.name in headers:
            allowed = (
                f"each column once; it is also column number {headers[column.name].position + 1}"
            )
            note(name, "duplicate-column", name, allowed)
        else:
            unit_in_file = unit or column.default
            scale = column.units[unit_in_file] if unit_in_file else 1.0
            headers[column.name] = HeaderCell(index, name, unit_in_file, scale, bool(unit))
    # a header that names a column, but with a unit that it cannot have: a problem, unless another header has the column
    for column in schema.columns:
        if column.name not in with_unknown_unit:
            continue
        header = with_unknown_unit[column.name]
        if column.name in headers:
            unknown.append(header.name)
        else:
            allowed = f"{column.name} in {', '.join(column.units)}"
            note(header.name, "unknown-unit", header.name, allowed)
            headers[column.name] = header
    if not headers and (below := _header_below(table, schema)):
        allowed = (
            f"the names of the columns, which stand in row {below}: take out the rows above it"
        )
        first_name = next(filter(None, table.header))
        raise schema.refusal("header-below", allowed, first_name, table.header_row)
    # then the columns of the schema that are missing, and those of the file that are left over
    missing = [column for column in schema.columns if column.name not in headers]
    for name in () if schema.others == "ignored" else unknown:
        # first among the columns that are missing, so that two misspellings get different answers
        nearest = did_you_mean(name, [column.name for column in missing])
        nearest = nearest or did_you_mean(name, names)
        if schema.others == "warned":
            allowed = f"this column is not read; those that are: {', '.join(names)}"
            note(name, "unknown-column", None, allowed, nearest, "warning")
        else:
            note(name, "unknown-column", name, f"one of {', '.join(names)}", nearest)
    for column in missing:
        if column.header_needed:
            allowed = f"this column is missing; it is needed: {column.meaning}"
            if name := next((name for name in unknown if folded_name(name) in column.stems), ""):
                allowed += f"; is it {name!r}? Say its unit there, as in {name} ({column.unit})"
            nearest = did_you_mean(column.name, unknown) if schema.others != "refused" else None
            note(column.name, "missing-column", None, allowed, nearest)
    return headers, problems


def _header_below(table: _Table, schema: Schema) -> int:
    """Return the row, below a title, that has at least two names of columns; 0: there is none."""
    names = {column.name for column in schema.columns}
    return next((row for row, cells in table.rows if len(names & set(cells)) > 1), 0)


def _column_of(header: str, schema: Schema) -> tuple[TableColumn | None, str | None]:
    """Return the column that a header names, None without one, and the unit that it states.

    The unit is empty where the header states none, and None where it states one that the column cannot have or where
    there is no column. Names of the schema itself go before a name with a unit.
    """
    for column in schema.columns:
        if header == column.name:
            return column, ""
        if header in column.also:
            return column, column.unit_in(header)
    with_unknown_unit: TableColumn | None = None
    for name, word in cut_header(header):
        for column in schema.columns:
            if name in column.stems:
                if unit := unit_among(word, column.units):
                    return column, unit
                with_unknown_unit = column
    return with_unknown_unit, None


def _check_cells_without_header(
    draft: DraftRow, names: Sequence[str], cells: Sequence[str]
) -> None:
    """Add a problem for each filled cell below a blank header, as where a comma cut a cell in two.

    `names`, `cells`: Headers of the columns of the file, and the cells of the row, in the same order.
    """
    for index, cell in enumerate(cells):
        if cell and (index >= len(names) or not names[index]):
            allowed = (
                "nothing where the header is blank; a comma in a note or a decimal comma cuts a row "
                "in the wrong place: put such a cell in quotes, write numbers with a point"
            )
            draft.note(f"number {index + 1}", "no-header", cell, allowed)


# --- Text and workbooks


MAX_BYTES = 50_000_000
"""Most bytes of a table that is read by rows."""


def _read_table(path: Path, schema: Schema) -> _Table:
    """Read header and rows of a workbook or a text, as its first bytes show; raises CampaignError if it is neither."""
    data = files.read_bytes(path, schema.file, schema.area, MAX_BYTES)
    suffix = path.suffix.lower()
    if data.startswith(WORKBOOK):
        return _read_workbook(data, schema)
    if data.startswith(_OLD_WORKBOOK):
        allowed = "csv, tsv or xlsx; this is an old or encrypted workbook: save it as .xlsx"
        raise schema.refusal("not-a-workbook", allowed, "xls")
    if suffix in (".xlsx", ".xlsm") and data.strip():
        allowed = "a workbook, as the name says; this file is none: save it again as .xlsx or .csv"
        raise schema.refusal("not-a-workbook", allowed)
    return _read_csv(_decode_table(data, schema), schema, suffix)


def _decode_table(data: bytes, schema: Schema) -> str:
    """Decode a text table; all line ends become line feeds. Raises CampaignError for a binary file or a web page."""
    if data and not text_head(data if utf16_of(data) else data.replace(b"\0", b"")):
        allowed = "csv or tsv as text, or xlsx; this file is none of them: save it again from a spreadsheet"
        raise schema.refusal("not-text", allowed)
    if is_web_page(data):
        allowed = "csv, tsv or xlsx; this is a web page under another name: open it in a spreadsheet and save it as .xlsx"
        raise schema.refusal("web-page", allowed)
    return decoded(as_utf8(data)).replace("\r\n", "\n").replace("\r", "\n")


def _too_many_rows(schema: Schema) -> CampaignError:
    """Make the error for a table with too many rows."""
    allowed = f"at most {schema.most_rows} rows are read; delete empty rows below the last"
    return schema.refusal("too-many-rows", allowed, row=schema.most_rows)


def _read_csv(text: str, schema: Schema, suffix: str) -> _Table:
    """Read header and rows of a text; delimiter and decimal mark are found by the names and numbers in it."""
    if schema.comments:
        text = re.sub(r"(?m)^[ \t]*#.*$", "", text)
    first_line = next((line for line in io.StringIO(text) if line.strip()), "")

    def count_names(delimiter: str) -> tuple[int, int]:
        """Return the number of cells in the first line that name a column, if it is split here, and of delimiters."""
        cells = (cell.strip().strip('"').strip() for cell in first_line.split(delimiter))
        known_names = sum(_column_of(cell, schema)[1] is not None for cell in cells)
        return known_names, first_line.count(delimiter)

    # of delimiters with as many known names, the most frequent; then by the ending of the file's name
    delimiters = ["\t", ",", ";"] if suffix in (".tsv", ".tab") else [",", ";", "\t"]
    table = _Table(delimiter=max(delimiters, key=count_names))
    _add_rows(table, text, schema, schema.most_rows)
    if has_decimal_commas(cell for _, cells in table.rows for cell in cells):
        table.decimal = ","
    # a single long cell with several names: the cells are separated by something else
    several, names = min(3, len(schema.names)), schema.names
    if len(table.header) == 1 and sum(name in table.header[0] for name in names) >= several > 1:
        allowed = "cells separated by comma, semicolon, tab"
        raise schema.refusal("wrong-delimiter", allowed, table.header[0], table.header_row)
    return table


def _add_rows(table: _Table, text: str, schema: Schema, most: float = math.inf) -> None:
    """Add the rows of a text to a table, below its last row; raises CampaignError for more than `most` rows."""
    try:
        records = records_of(io.StringIO(text), table.delimiter)
        for row, cells in enumerate(records, start=table.last + 1):
            if row > most:
                raise _too_many_rows(schema)
            table.add(row, [cell.strip() for cell in cells])
    except csv.Error as error:
        allowed = f"this row cannot be split into cells ({error}); look for a stray quote"
        raise schema.refusal("not-csv", allowed, row=table.last + 1) from None


MAX_UNPACKED = 40_000_000
"""Most bytes of a workbook when unpacked."""
MAX_TAGS = 3_000_000
"""Most XML tags of a workbook, about four for each cell: enough for 45,000 runs, and any are read in seconds."""

MAX_COLUMNS = 64
"""Most columns of a sheet that are read."""
_MERGED = re.compile(rb'<mergeCell ref="([A-Z]+)([0-9]+):([A-Z]+)([0-9]+)"')
_Range = tuple[bytes, bytes, bytes, bytes]
"""Merged cells of a sheet: letters of the left column, top row, right column, bottom row."""
_MOST_MERGED = 1000
"""Most ranges of merged cells, and most rows of each, that are searched."""


def _read_workbook(data: bytes, schema: Schema) -> _Table:
    """Read header and rows of the first sheet as text; bad cells are noted in the table, without a problem yet.

    The sheet is read twice side by side, as results and as formulas: a formula without a result was never calculated.
    """
    table = _Table()
    with contextlib.ExitStack() as opened:
        opened.enter_context(_workbook_errors(schema))
        has_formulas, merged_ranges = _check_archive(data, schema)

        def first_sheet(*, formulas: bool = False) -> tuple[Any, Iterator[tuple[Any, ...]]]:
            """Open the first sheet; return it, and its rows, with the formulas of its cells or their results."""
            file = io.BytesIO(data)
            sheet = opened.enter_context(open_workbook(file, formulas=formulas)).worksheets[0]
            return sheet, opened.enter_context(rows_of(sheet, MAX_COLUMNS))

        sheet, rows = first_sheet()
        merged = _merged_cells(merged_ranges.get(sheet._worksheet_path, ()))
        text_of_merged: dict[tuple[int, int], str] = {}
        rows_of_formulas = first_sheet(formulas=True)[1] if has_formulas else iter(())
        rows_of_both = zip(rows, chain(rows_of_formulas, repeat(())), strict=False)
        for row, (values, formulas) in enumerate(rows_of_both, start=1):
            if row > schema.most_rows:
                raise _too_many_rows(schema)
            texts = [text_of(value) for value in values]
            for index, (value, formula) in enumerate(zip_longest(values, formulas)):
                if bad := _bad_cell(value, formula):
                    table.bad[row, index] = bad
                    texts[index] = texts[index] or bad[1]
            # the first cell of merged ones has their value; the others look blank, and are bad if it is not
            for index, first_cell in merged.get(row, {}).items() if any(texts) else ():
                if first_cell == (row, index):
                    text_of_merged[first_cell] = texts[index] if index < len(texts) else ""
                elif text_of_merged.get(first_cell):
                    table.bad[row, index] = ("merged-cell", text_of_merged[first_cell])
            table.add(row, texts)
    return table


def read_sheets(path: Path, schema: Schema) -> Iterator[tuple[str, list[Line]]]:
    """Yield name, and number and cells of each row that is not blank, of every sheet of a table in any layout.

    A text counts as one sheet with the name of its file. `schema`: Only its names for problems, and `most_rows`, are
    used. Raises CampaignError if the file cannot be read.
    """
    data = files.read_bytes(path, schema.file, schema.area, MAX_BYTES)
    if not data.startswith(WORKBOOK):
        text = _decode_table(data, schema)
        table = _Table(delimiter=max(",;\t", key=text.count))
        _add_rows(table, text, schema, schema.most_rows)
        header = [(table.header_row, table.header)] if table.header else []
        yield path.stem, [*header, *table.rows]
        return
    with _workbook_errors(schema):
        _check_archive(data, schema)
        with open_workbook(io.BytesIO(data)) as workbook:
            for sheet in workbook.worksheets:
                with rows_of(sheet, MAX_COLUMNS) as rows:
                    texts = ([*map(text_of, row)] for row in islice(rows, schema.most_rows))
                    numbered = [pair for pair in enumerate(texts, start=1) if any(pair[1])]
                yield sheet.title, numbered


@contextlib.contextmanager
def _workbook_errors(schema: Schema) -> Iterator[None]:
    """Turn whatever the library that reads workbooks raises in the block on a damaged file into a CampaignError."""
    try:
        yield
    except CampaignError:
        raise
    # the library raises anything from KeyError to zlib.error
    except Exception as error:
        why = str(error) or type(error).__name__
        allowed = f"this workbook cannot be read ({why}); save it again as .xlsx or .csv"
        raise schema.refusal("not-a-workbook", allowed) from error


def _check_archive(data: bytes, schema: Schema) -> tuple[bool, dict[str, list[_Range]]]:
    """Refuse an archive that no spreadsheet writes, before it is parsed: few bytes can unpack to any size.

    Returns whether there are formulas, and the merged ranges of each sheet by its path in the archive.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        unpacked = sum(info.file_size for info in archive.infolist())
        if unpacked > MAX_UNPACKED:
            size, most = unpacked / 1e6, MAX_UNPACKED / 1e6
            allowed = f"{size:.0f} MB when unpacked are too large; at most {most:g} MB are read: save it as csv"
            raise schema.refusal("too-large", allowed)
        parts = {name: archive.read(name) for name in archive.namelist()}
    if any(b"<!DOCTYPE" in content or b"<!ENTITY" in content for content in parts.values()):
        allowed = "a workbook as a spreadsheet saves it; this one declares XML entities"
        raise schema.refusal("not-a-workbook", allowed)
    if (tags := sum(content.count(b"<") for content in parts.values())) > MAX_TAGS:
        allowed = f"{tags / 1e6:.0f} million XML tags are too many; at most {MAX_TAGS / 1e6:g} million are read: save the sheet as csv"
        raise schema.refusal("too-large", allowed)
    sheets = {name: content for name, content in parts.items() if name.startswith("xl/worksheets/")}
    has_formulas = any(b"<f>" in content or b"<f " in content for content in sheets.values())
    # merged ranges are found here, as the read-only mode of the library ignores them
    return has_formulas, {name: _MERGED.findall(content) for name, content in sheets.items()}


def _merged_cells(ranges: Sequence[_Range]) -> dict[int, dict[int, tuple[int, int]]]:
    """Return row, to column from 0, to the row and column of the first cell of the merged range that holds this cell.

    A spreadsheet shows the value of this first cell in all of the range, and stores it there alone.
    """
    first_cells: dict[int, dict[int, tuple[int, int]]] = {}
    for left, top, right, bottom in ranges[:_MOST_MERGED]:
        first, last = place_of_column(left.decode()), place_of_column(right.decode())
        for row in range(int(top), min(int(bottom), int(top) + _MOST_MERGED) + 1):
            columns = range(first, min(last, MAX_COLUMNS - 1) + 1)
            first_cells.setdefault(row, {}).update(dict.fromkeys(columns, (int(top), first)))
    return first_cells


def _bad_cell(value: Any, formula: Any) -> tuple[str, str] | None:
    """Return code and text of a cell that holds no value typed by the user, else None.

    `value`: Content of the cell, or the result of its formula. `formula`: Content of the cell; None where it is blank
    or no sheet has formulas.
    """
    if value is None and formula is not None:
        return "formula", str(getattr(formula, "text", formula))
    if isinstance(value, MOMENTS):
        return "date", f"the date {text_of(value)}"
    if isinstance(value, str) and value in ERROR_VALUES:
        return "cell-error", value
    return None
