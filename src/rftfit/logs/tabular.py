"""Logs in xlsx workbooks and Parquet files: which sheet and columns hold the table, and its rows block by block.

A sheet is read as rows of cells; its table is found among titles and remarks, each row becomes a line of text, and the
lines are parsed as those of a text log. A Parquet file has fields of one type each; a field of lists or records becomes
several columns. Rows, columns and lists are indexed from 0. *Labels* are words or few whole numbers that may say which
of several sensors a row is from.
"""

from __future__ import annotations

import fnmatch
import zipfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rftfit.logs.base import (
    BOUNDS,
    FIRST,
    Log,
    LogError,
    check_unpacked,
    library_errors,
    most_frequent,
)
from rftfit.logs.delimited import is_value, judge_columns, plan_columns
from rftfit.logs.labels import LabelledReader, may_be_labels
from rftfit.logs.quantities import units_by_name
from rftfit.logs.sources import check_where
from rftfit.logs.text import Block, ReadingPlan, TableReader
from rftfit.table.numbers import COMMA, IN_THOUSANDS, NO_VALUE, plain_number
from rftfit.table.parse import OTHER_SOURCE, Layout, are_allowed, numbers_among_words
from rftfit.table.stamps import DAY_S, RestartingClock, ns_to_s, seconds_of
from rftfit.table.units import canonical_unit, is_units_row
from rftfit.table.workbook import (
    ERROR_VALUES,
    NO_RESULT,
    WORKBOOK,
    formula_of,
    open_workbook,
    rows_of,
    text_of,
)

MOST_ROWS = 1_048_576
"""Most rows of a sheet in Excel."""
_LEAST_TO_COUNT, _PIECE_BYTES = MOST_ROWS * len("<row/>"), 1 << 20
"""Bytes of the smallest sheet with more rows than that, and of the pieces in which they are counted."""
_PLAIN_NUMBER_TYPES = frozenset({float, int})
"""Types of cells that are numbers without any test."""
_ROWS_AT_A_TIME = 50_000
"""Most rows of a sheet in one block."""
_READ_WHOLE, _TIMES_SIZE = (".rels", "styles.xml", "workbook.xml", "[Content_Types].xml"), 100
"""Ends of the names of parts of a workbook that the library reads as a whole, and how many times their size that takes."""
_NUMBERS_AT_A_TIME = 1 << 22
"""Most numbers in one block: of a table with many columns it has fewer rows, so that it takes no more memory."""


def _with_checks(path: Path, file_type: str, blocks: Iterator[Log]) -> Iterator[Log]:
    """Yield the blocks; turn whatever a library raises into a `LogError`, and raise one for a file without rows.

    `file_type`: Words for the file in messages.
    """
    rows = 0
    problem = (
        f"this {file_type} cannot be read; is it cut short? Its list of contents stands at its end"
    )
    try:
        with library_errors(path, problem):
            for log in blocks:
                rows += log.rows
                yield log
    except LogError as error:
        error.rows = error.rows or rows
        raise
    if rows == 0:
        raise LogError("header_only", f"{path}: a header and no data")


class XlsxReader(TableReader):
    """A row of names somewhere in the first rows, perhaps one of units, then numbers."""

    name = "xlsx"
    selects = True
    description = (
        "xlsx workbook, first sheet with a table of numbers or that of options: {sheet: ...}"
    )
    evidence = "the archive's parts: an xlsx workbook"
    takes = ("sheet",)

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        marks = (b"[Content_Types].xml", b"xl/", b"_rels/.rels")
        return head.startswith(WORKBOOK) and any(mark in head for mark in marks)

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a sheet, some ten thousand rows at a time."""
        yield from _with_checks(path, "workbook", self._blocks(path))

    def _blocks(self, path: Path) -> Iterator[Log]:
        """Yield the blocks of a sheet, after a check of the sizes that the archive states, which may be any."""
        if path.stat().st_size == 0:
            raise LogError("empty", f"{path}: the file is empty")
        with path.open("rb") as file:
            with zipfile.ZipFile(file) as archive:
                sizes = [
                    part.file_size * (_TIMES_SIZE if part.filename.endswith(_READ_WHOLE) else 1)
                    for part in archive.infolist()
                ]
                check_unpacked(path, sum(sizes))
                _refuse_many_rows(path, archive)
            with open_workbook(file) as workbook:
                sheet, notes = _choose_sheet(path, workbook, self.options.get("sheet", ""))
                with rows_of(sheet) as rows:
                    limited_rows = _without_wide(path, islice(rows, MOST_ROWS))
                    plan, lines = self._plan(path, sheet.title, limited_rows)
                    plan = replace(plan, notes=(*notes, *plan.notes))
                    yield from self.logs_of(path, plan, lines)
                    # for a stray row far below, the library returns all the blank rows above
                    if next(rows, None) is not None:
                        raise _below_last_row(path)

    def _plan(
        self, path: Path, title: str, rows: Iterator[tuple[Any, ...]]
    ) -> tuple[ReadingPlan, Iterator[Block]]:
        """Return a plan how to read the table of a sheet, and its rows as blocks of lines of text.

        `title`: Name of the sheet. `rows`: Iterator of all its rows, from the first one.
        """
        head = list(islice(rows, FIRST.sheet_rows))
        first = _first_row_of_table(head)
        first_rows = head[first:]
        name_cells, unit_cells = _header_above(head, first)
        if not name_cells:
            raise LogError("header", f"{path}: no row of names above the numbers of the sheet")
        columns = _judge_columns(first_rows, len(name_cells))
        # name of each column, to its unit
        units = units_by_name(name_cells, unit_cells, len(columns))
        names = tuple(units)
        layout = Layout(names, delimiter="\t", no_value=(*NO_VALUE, *ERROR_VALUES))
        cells_of_rows = [line_of(row, columns).split("\t") for row in first_rows]
        plan = plan_columns(self, layout, units, [row for row in cells_of_rows if any(row)])
        # index of a column that is not read, to the reason
        unread = {
            index: f"{column.unclear!r} (text: a decimal comma or thousands? Make numbers of it)"
            for index, column in enumerate(columns)
            if column.unclear
        }
        if blank := [index for index, column in enumerate(columns) if column.is_blank]:
            formulas = _formulas_of(path, title, first, blank)
            unread |= {index: f"{formula!r} ({NO_RESULT})" for index, formula in formulas.items()}
        kinds = [
            "skip" if index in unread or not column.is_of_table else kind
            for index, (kind, column) in enumerate(zip(plan.layout.kinds, columns, strict=True))
        ]
        plan = replace(
            plan,
            layout=replace(plan.layout, kinds=tuple(kinds)),
            unread={**plan.unread, **{names[index]: why for index, why in unread.items()}},
        )
        plan = self.narrow(path, plan)
        return plan, _blocks_of_lines(chain(first_rows, rows), columns)


def _header_above(head: Sequence[Sequence[Any]], first: int) -> tuple[list[str], list[str]]:
    """Return the cells of the row of names above a table, and of the row of units below the names; empty without.

    `head`: First rows of the sheet. `first`: Index of the row in which the numbers begin.
    """
    # cells beside the table, which are left out, are neither names nor units
    width = 1 + max(chain([-1], *map(_number_columns, head[first : first + 2])))
    row_above = head[first - 1] if first else ()
    while width < len(row_above) and row_above[width] is not None:
        width += 1  # a name above cells that are filled further below
    above = [
        cells
        for row in head[:first]
        if any(cells := [text_of(cell) for cell in row[: width or None]])
    ]
    units = above.pop() if len(above) > 1 and is_units_row(above[-1], len(above[-2])) else []
    return (above[-1] if above else []), units


class _Column(NamedTuple):
    """A column of a sheet, judged by its cells in the first rows.

    `is_of_table`: Whether the column has a name, or numbers in most rows. `is_blank`: Whether all cells are blank.
    `unclear`: First text with a comma that may be decimal or between thousands, if no cell decides which.
    `has_commas`: Whether texts have a decimal comma.
    """

    is_of_table: bool
    is_blank: bool
    unclear: str
    has_commas: bool


def _judge_columns(rows: Sequence[Sequence[Any]], n_named: int) -> list[_Column]:
    """Judge the columns of a sheet by the first `rows` of its table; `n_named`: number of columns with a name.

    Columns at the right end that are not of the table are left out.
    """
    filled_rows = [row for row in rows if any(cell is not None for cell in row)]
    columns = []
    for index in range(max([n_named, *map(len, rows)])):
        cells = [row[index] for row in filled_rows if index < len(row)]
        filled = [cell for cell in cells if text_of(cell) not in (*NO_VALUE, *ERROR_VALUES)]
        texts = [plain_number(cell.strip()) for cell in filled if isinstance(cell, str)]
        commas = [text for text in texts if COMMA.fullmatch(text)]
        has_commas = not all(map(IN_THOUSANDS[","].fullmatch, commas))
        count = sum(_is_number(cell) for cell in filled)
        columns.append(
            _Column(
                index < n_named or count * 2 > len(filled_rows),
                not filled and bool(filled_rows),
                commas[0] if commas and not has_commas else "",
                has_commas,
            )
        )
    while columns and not columns[-1].is_of_table:
        # somebody may have typed something beside the table
        columns.pop()
    return columns


def _blocks_of_lines(rows: Iterator[Sequence[Any]], columns: Sequence[_Column]) -> Iterator[Block]:
    """Yield the rows of a sheet as lines of text, without blank ones, some ten thousand at a time."""
    at_a_time = max(1, min(_ROWS_AT_A_TIME, _NUMBERS_AT_A_TIME // len(columns)))
    while block := list(islice(rows, at_a_time)):
        lines = [line for row in block if (line := line_of(row, columns)).strip("\t")]
        yield Block("\n".join([*lines, ""]).encode(), b"")


def line_of(row: Sequence[Any], columns: Sequence[_Column]) -> str:
    """Return a row of a sheet as a line of text: a cell for each of the `columns`, with a tab between them.

    A decimal comma becomes a point where the column has such commas.
    """
    # most cells are numbers: a call of a function for each would take as long as reading the file
    cells = [
        repr(cell) if type(cell) in _PLAIN_NUMBER_TYPES else " ".join(text_of(cell).split())
        for cell in row[: len(columns)]
    ]
    for index, cell in enumerate(cells):
        if columns[index].has_commas and COMMA.fullmatch(plain := plain_number(cell)):
            cells[index] = plain.replace(",", ".")
    return "\t".join([*cells, *[""] * (len(columns) - len(cells))])


def _without_wide(path: Path, rows: Iterator[tuple[Any, ...]]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows; refuse a sheet with a cell far beside its table: the library returns all blank cells between."""
    blank, filled = 0, 1
    for row in rows:
        row_blank = row.count(None)
        blank += row_blank
        filled += len(row) - row_blank
        if blank > BOUNDS.blank_cells and blank > BOUNDS.blank_for_each * filled:
            wide = f"{blank // filled} blank cells for one that is filled, up to column {len(row)}"
            raise LogError("too_large", f"{path}: {wide}: delete what stands far beside the table")
        yield row


def _refuse_many_rows(path: Path, archive: zipfile.ZipFile) -> None:
    """Raise `LogError` for a workbook with more than `MOST_ROWS` rows in a sheet, before a sheet is read."""
    for part in archive.infolist():
        if not part.filename.startswith("xl/worksheets/") or part.file_size < _LEAST_TO_COUNT:
            continue
        with archive.open(part) as sheet:
            count, end = 0, b""
            while content := sheet.read(_PIECE_BYTES):
                # a tag may lie across two pieces
                content = end + content
                # <row>, or <x:row> and </x:row> of a program that names its namespace
                count += content.count(b"<row") + content.count(b":row") // 2
                end = content[-3:]
                if count > MOST_ROWS:
                    raise _below_last_row(path)


def _below_last_row(path: Path) -> LogError:
    """Make the error for a sheet with more than `MOST_ROWS` rows."""
    text = f"found a cell below row {MOST_ROWS}, the last one that a sheet can have"
    return LogError("too_large", f"{path}: {text}: save the workbook anew", MOST_ROWS)


def _choose_sheet(
    path: Path, book: Any, requested_sheet: str | float
) -> tuple[Any, tuple[str, ...]]:
    """Return the sheet to read, and a note, in a tuple, where others exist.

    `requested_sheet`: Name, pattern or number from 1 in the config; empty: the first visible sheet with a table. Raises
    `LogError` where there is no such sheet. A sheet without a table is returned only where none has one.
    """
    visible = [sheet for sheet in book.worksheets if sheet.sheet_state == "visible"]
    hidden_titles = [sheet.title for sheet in book.worksheets if sheet not in visible]
    listed = ", ".join(sheet.title for sheet in visible)
    hidden = f"; hidden: {', '.join(hidden_titles)}" if hidden_titles else ""
    title = str(requested_sheet)
    # a hidden sheet is read by its name only
    sheets = [sheet for sheet in book.worksheets if sheet.title == title]
    if not sheets and isinstance(requested_sheet, str):
        sheets = [sheet for sheet in visible if fnmatch.fnmatchcase(sheet.title, title or "*")]
    elif not sheets:
        sheets = [sheet for n, sheet in enumerate(visible, start=1) if n == requested_sheet]
    if not sheets:
        problem = f"no sheet {requested_sheet!r}" if requested_sheet else "no visible sheet"
        raise LogError("sheet", f"{path}: {problem}; allowed: {listed}{hidden}")
    table = next((sheet for sheet in sheets[: BOUNDS.sheets] if _has_table(path, sheet)), None)
    if table is None and hidden_titles and not requested_sheet:
        problem = f"no table of numbers in {listed}{hidden}: options: {{sheet: NAME}} reads a hidden sheet"
        raise LogError("sheet", f"{path}: {problem}")
    sheet = table or sheets[0]
    other_titles = ", ".join(repr(other.title) for other in book.worksheets if other is not sheet)
    if not other_titles or (requested_sheet and len(sheets) == 1):
        return sheet, ()
    note = f"sheet {sheet.title!r}, the first with a table of numbers; the workbook also has "
    return sheet, (f"{note}{other_titles}: options: {{sheet: ...}}",)


def _has_table(path: Path, sheet: Any) -> bool:
    """Return whether a table of numbers begins in the first rows of a sheet, and continues in the row below."""
    with rows_of(sheet) as rows:
        head = list(islice(_without_wide(path, rows), FIRST.sheet_rows))
    below = head[_first_row_of_table(head) + 1 :]
    return _first_row_of_table(below) < len(below)


def _number_columns(row: Sequence[Any]) -> set[int]:
    """Return the columns, from 0, in which a row has a number or a time."""
    return {index for index, cell in enumerate(row) if _is_number(cell)}


def _is_number(cell: Any) -> bool:
    """Return whether a cell is a number, also one stored as text, a date or a time."""
    return type(cell) in _PLAIN_NUMBER_TYPES or (cell is not None and is_value(text_of(cell)))


def _first_row_of_table(head: Sequence[Sequence[Any]]) -> int:
    """Return the row, from 0, at which a table begins; the number of rows where there is none.

    The row and the next one have numbers in the same columns, and so have at least half of the rows below. `head`:
    Cells of the first rows of a sheet.
    """
    # the columns with a number, of each row
    numbers = [_number_columns(row) for row in head]
    for start, columns in enumerate(numbers):
        below = [columns_of_row for columns_of_row in numbers[start + 1 :] if columns_of_row]
        # the columns of this row with numbers in at least half of the rows below
        table = {c for c in columns if sum(c in of_row for of_row in below) * 2 >= len(below)}
        # two columns of numbers, of which the next row needs only one: it may be damaged in part
        if len(table) >= 2 and (start + 1 == len(head) or table & numbers[start + 1] or not below):
            # names such as 1, 2, 3 are stored as text, while the numbers below are not
            next_row = head[start + 1] if start + 1 < len(head) else ()
            are_names = bool(next_row) and all(
                isinstance(head[start][column], str)
                and not isinstance(next_row[column] if column < len(next_row) else None, str)
                for column in table
            )
            return start + 1 if are_names else start
    return len(head)


def _formulas_of(path: Path, title: str, first: int, columns: Collection[int]) -> dict[int, str]:
    """Return index of each of the `columns` that has a formula from row `first` on, to the first one.

    Cells that look blank may be formulas that were never calculated, which the user must be told. `title`: Of the
    sheet.
    """
    first_of_column: dict[int, str] = {}
    with (
        path.open("rb") as file,
        open_workbook(file, formulas=True) as workbook,
        rows_of(workbook[title]) as rows,
    ):
        for row in islice(rows, first, FIRST.sheet_rows):
            for column in columns:
                if formula := formula_of(row[column] if column < len(row) else None):
                    first_of_column.setdefault(column, formula)
    return first_of_column


class ParquetReader(LabelledReader):
    """Each column of numbers is read; units are in the names, or in the metadata ``unit`` of the field."""

    name = "parquet"
    selects = True
    description = "Parquet table; units in the column names (force_N, Force [N]) or their metadata"
    evidence = "its first four bytes, PAR1"
    marks = (b"PAR1",)

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a table, some million numbers at a time."""
        return _with_checks(path, "Parquet file", self._batches(path))

    def _batches(self, path: Path) -> Iterator[Log]:
        """Yield a log for each batch of rows: first which fields are read, and as which columns, then their numbers.

        Rows of other sources than those of `where`, and rows with damaged numbers, are counted as dropped. Raises
        `LogError` where no column holds numbers.
        """
        import pyarrow.parquet as pq
        from pyarrow.types import is_time

        with path.open("rb") as opened, pq.ParquetFile(opened) as file:
            # what can be read, by the name of the field in the file, and what cannot, by the name of the column
            fields, unread = _number_fields(file)
            schema = file.schema_arrow
            names_in_file = tuple(
                name
                for field in schema
                for name in (fields[field.name].names if field.name in fields else [field.name])
            )
            self.check_asked(path, unread, names_in_file)
            columns_to_read = self.choose_columns(names_in_file)
            # fields with a column to be read
            chosen = {
                field: columns
                for field, columns in fields.items()
                if not {*columns.names}.isdisjoint(columns_to_read)
            } or fields
            if not chosen:
                listed = "; ".join(f"{name}: {why}" for name, why in unread.items())
                raise LogError(
                    "header", f"{path}: no column of this table holds numbers ({listed})"
                )
            count = sum(len(columns.names) for columns in chosen.values())
            check_unpacked(path, 8 * count * file.metadata.num_rows)
            # the fields that tell sources apart: by `where` of the config, or perhaps by their labels
            field_by_name = dict(zip(units_by_name(schema.names), schema.names, strict=True))
            check_where(path, self.where, field_by_name)
            sources = [(field_by_name[name], allowed) for name, allowed in self.where.items()]
            label_fields = self._label_fields(file, chosen)
            read = list(dict.fromkeys([*chosen, *(field for field, _ in sources), *label_fields]))
            units = {name: columns.unit for columns in chosen.values() for name in columns.names}
            at_a_time = max(1, _NUMBERS_AT_A_TIME // count)
            clocks = {
                field.name: RestartingClock(DAY_S)
                for field in schema
                if field.name in chosen and is_time(field.type)
            }
            for batch in file.iter_batches(at_a_time, columns=read):
                if not batch.num_rows:
                    continue
                numbers, blank = _numbers_of_batch(batch, chosen, clocks)
                asked = {
                    name: values for name, values in numbers.items() if name in columns_to_read
                }
                log = Log(
                    path,
                    asked or numbers,
                    units,
                    batch.num_rows,
                    unread=unread,
                    names_in_file=names_in_file,
                    labels={
                        name: np.array(
                            [*map(text_of, batch.column(field).to_pylist())], dtype=object
                        )
                        for field, name in label_fields.items()
                    },
                    clock_times=frozenset(n for field in clocks for n in chosen[field].names),
                )
                is_of_source = np.ones(batch.num_rows, dtype=bool)
                for field, allowed in sources:
                    is_of_source &= are_allowed(batch.column(field).to_pylist(), allowed)
                blank = {
                    name: is_blank[is_of_source]
                    for name, is_blank in blank.items()
                    if name in log.columns
                }
                log = log.take(is_of_source, OTHER_SOURCE)
                yield log.without_blanks(blank, keeps_blanks=self.keeps_blanks)

    def _label_fields(self, file: Any, chosen: Collection[str]) -> dict[str, str]:
        """Return the columns that may say where a row is from: field of the file, to the name of the column.

        They hold words, or few whole numbers, and are not read otherwise. `file`: The open file. `chosen`: Fields that
        are read as numbers.
        """
        from pyarrow import types

        names = units_by_name(file.schema_arrow.names)
        fields = {}
        for field, name in zip(file.schema_arrow, names, strict=True):
            kind = _type_of(field)
            if field.name in chosen or name in self.where:
                continue
            if _is_of_texts(kind) or (
                (types.is_integer(kind) or types.is_boolean(kind))
                and may_be_labels(_read_numbers(_first_rows(file)[field.name])[0])
            ):
                fields[field.name] = name
        return fields


class _Field(NamedTuple):
    """A field of a Parquet file that holds numbers: one column of the log, or one for each index of a list or record.

    `names`, `unit`: Names of these columns, and their unit; empty: none is stated. `read`: Function from the Arrow
    array of the field to its numbers, shape (n,) or (n, columns), and to which rows have no value, bool of shape (n,).
    """

    names: list[str]
    unit: str
    read: Callable[[Any], tuple[np.ndarray, np.ndarray]]


def _numbers_of_batch(
    batch: Any, fields: Mapping[str, _Field], clocks: Mapping[str, RestartingClock]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return column, to its numbers, shape (n,), and column, to which rows have no value, where there are such rows.

    `batch`: n rows. `clocks`: Fields of times of a day, which are counted on over midnight.
    """
    numbers: dict[str, np.ndarray] = {}
    blank: dict[str, np.ndarray] = {}
    for field, columns in fields.items():
        array = batch.column(field)
        if hasattr(array, "dictionary_decode"):
            array = array.dictionary_decode()
        values, is_blank = columns.read(array)
        if field in clocks:
            values = clocks[field].follow(values)
        for index, name in enumerate(columns.names):
            numbers[name] = values if values.ndim == 1 else values[:, index]
            if is_blank.any():
                blank[name] = is_blank
    return numbers, blank


def _number_fields(file: Any) -> tuple[dict[str, _Field], dict[str, str]]:
    """Return the fields that hold numbers, by name, and column, to the reason why it is not read; `file`: open."""
    schema = file.schema_arrow
    units = units_by_name(schema.names)
    # read once, and only if a field needs them
    first_rows = cache(partial(_first_rows, file))
    fields, unread = {}, {}
    for field, (name, unit_in_name) in zip(schema, units.items(), strict=True):
        metadata = field.metadata or {}
        stated = metadata.get(b"unit") or metadata.get(b"units") or b""
        unit = unit_in_name or canonical_unit(stated.decode("utf-8", "replace"))
        number_field = _number_field(field, name, unit, first_rows)
        if isinstance(number_field, str):
            unread[name] = number_field
        else:
            fields[field.name] = number_field
    return fields, unread


def _number_field(
    field: Any, name: str, unit: str, first_rows: Callable[[], Mapping[str, Any]]
) -> _Field | str:
    """Return how a field is read as numbers, or the reason why it is not read.

    `field`: Name and type, by Arrow. `name`, `unit`: Name and unit of its column. `first_rows`: Function that returns
    each field with its first values, by which lists and texts are judged.
    """
    from pyarrow import types

    kind = _type_of(field)
    if types.is_timestamp(kind) or types.is_duration(kind) or types.is_time(kind):
        return _Field([name], "s", _read_seconds)
    if _is_of_numbers(kind):
        return _Field([name], unit, _read_numbers)
    if types.is_fixed_size_list(kind) or types.is_list(kind) or types.is_large_list(kind):
        if not _is_of_numbers(kind.value_type):
            return f"lists of {kind.value_type}"
        width = _list_width(first_rows(), field.name)
        if not 0 < width <= BOUNDS.columns:
            most = f"more than {BOUNDS.columns}" if width else "so no columns"
            return f"lists of {width} numbers a row, {most}"
        listed = [f"{name} column {number}" for number in range(1, width + 1)]
        return _Field(listed, unit, partial(_read_lists, width))
    if types.is_struct(kind):
        if inside := [inner.name for inner in kind if _is_of_numbers(inner.type)]:
            members = [f"{name}.{member}" for member in inside]
            return _Field(members, unit, partial(_read_records, inside))
    elif _is_of_texts(kind):
        # judged as a column of a text log, beside one of numbers: a table of texts alone would count as damaged numbers
        cells = [cell for cell in first_rows()[field.name].to_pylist() if cell is not None]
        seen = judge_columns([[cell, "0"] for cell in cells], ["text", "number"])
        if seen.kinds[0] == "skip" or not any(cell.strip() for cell in cells):
            return seen.unread.get("text", "text without a value in the first rows")
        if seen.kinds[0] == "stamp":
            return _Field([name], "s", partial(_read_text_seconds, seen.dates))
        return _Field([name], unit, _read_text_numbers)
    return f"values of the type {kind}"


def _type_of(field: Any) -> Any:
    """Return the type of the values of a field, also where each distinct value is stored once (a dictionary)."""
    from pyarrow import types

    return field.type.value_type if types.is_dictionary(field.type) else field.type


def _is_of_numbers(kind: Any) -> bool:
    """Return whether a type of Arrow holds numbers, or true and false."""
    from pyarrow import types

    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal)
    return any(is_kind(kind) for is_kind in tests)


def _is_of_texts(kind: Any) -> bool:
    """Return whether a type of Arrow holds texts."""
    from pyarrow import types

    return bool(types.is_string(kind) or types.is_large_string(kind))


def _first_rows(file: Any) -> dict[str, Any]:
    """Return field, to the Arrow array of its first values; an empty list for a file without rows."""
    for batch in file.iter_batches(FIRST.sheet_rows):
        return dict(zip(batch.schema.names, batch.columns, strict=True))
    return {name: [] for name in file.schema_arrow.names}


def _list_width(head: Mapping[str, Any], name: str) -> int:
    """Return the most frequent length of the lists of a field in the first rows (`head`), 0 where all are blank."""
    widths = [len(cells) for cells in head[name].to_pylist() if cells] if len(head[name]) else []
    return most_frequent(widths)


# --- Functions `read` of fields: each takes an Arrow array, and returns numbers, and which rows have no value


def _read_lists(width: int, array: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of lists, shape (n, width), NaN without a value; a list of another length is no value."""
    import pyarrow.compute as pc

    has_width = pc.fill_null(pc.equal(pc.list_value_length(array), width), False)
    inner, _ = _read_numbers(pc.list_flatten(array.filter(has_width)))
    has_value = np.asarray(has_width)
    values = np.full((has_value.size, width), np.nan)
    values[has_value] = inner.reshape(-1, width)
    return values, ~has_value


def _read_records(members: Sequence[str], array: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the `members` of records, shape (n, members)."""
    values = [_read_numbers(array.field(member))[0] for member in members]
    return np.stack(values, axis=1), np.asarray(array.is_null())


def _read_text_numbers(array: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers that are stored as text; any other text is no value."""
    return _read_numbers(numbers_among_words(array))


def _read_text_seconds(order: str, array: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the seconds of times that are stored as text; `order`: order of day, month and year (``dmy``)."""
    cells = ["" if cell is None else cell.strip() for cell in array.to_pylist()]
    seconds = np.array([seconds_of(cell, order) for cell in cells], dtype=float)
    return seconds, np.isnan(seconds)


def _read_seconds(array: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return dates (since 1970), times of a day (since midnight) and durations in seconds, NaN without a value."""
    import pyarrow as pa

    is_blank = np.asarray(array.is_null())
    zone = getattr(array.type, "tz", None)
    type_in_ns = pa.duration("ns") if pa.types.is_duration(array.type) else pa.timestamp("ns", zone)
    type_in_ns = pa.time64("ns") if pa.types.is_time(array.type) else type_in_ns
    stamps = array.cast(type_in_ns).cast(pa.int64()).fill_null(0)
    seconds = np.where(is_blank, np.nan, ns_to_s(stamps.to_numpy(zero_copy_only=False)))
    return seconds, is_blank


def _read_numbers(array: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers, or true and false, as float64, NaN without a value."""
    import pyarrow as pa

    numbers = array.cast(pa.float64()).to_numpy(zero_copy_only=False)
    return np.asarray(numbers, dtype=float), np.asarray(array.is_null())
