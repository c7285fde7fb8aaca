"""Logs in xlsx workbooks and Parquet files."""

from __future__ import annotations

import fnmatch
import math
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from rftfit.logs.base import Log, LogError, Reader, check_unpacked, library_errors, ns_to_s
from rftfit.logs.stamps import of_moment, seconds_of
from rftfit.logs.text import NUMBER
from rftfit.logs.units import is_units_row, names_and_units, unit_word

MOST_ROWS = 1_048_576
_HEADER_ROWS = 60
_MOST_SHEETS = 50
_PLAIN = frozenset({float, int})
_ROWS_AT_A_TIME = 50_000
_TREES, _TREE = (".rels", "styles.xml", "workbook.xml", "[Content_Types].xml"), 100
"""Parts of a workbook that the library reads as a whole, and how many times their size that takes."""
_NUMBERS_AT_A_TIME = 1 << 22  # so that a table of many columns takes no more memory


def _checked(path: Path, what: str, blocks: Iterator[Log]) -> Iterator[Log]:
    """Hand blocks on; whatever a library raises on a damaged file becomes one message."""
    rows = 0
    what = f"this {what} cannot be read; is it cut short? Its list of contents stands at its end"
    try:
        with library_errors(path, what):
            for log in blocks:
                rows += log.rows
                yield log
    except LogError as error:
        error.rows = error.rows or rows
        raise
    if rows == 0:
        raise LogError("header_only", f"{path}: a header and no data")


class XlsxReader(Reader):
    """A row of names somewhere in the first rows, perhaps one of units, then numbers."""

    name = "xlsx"
    description = (
        "xlsx workbook, first sheet with a table of numbers or that of options: {sheet: ...}"
    )
    evidence = "the archive's parts: an xlsx workbook"
    takes = ("sheet",)

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        marks = (b"[Content_Types].xml", b"xl/", b"_rels/.rels")
        return head.startswith(b"PK\x03\x04") and any(mark in head for mark in marks)

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a sheet, some ten thousand rows at a time."""
        with warnings.catch_warnings():
            # about styles and validation rules, which do not matter here
            warnings.simplefilter("ignore")
            yield from _checked(path, "workbook", self._blocks(path))

    def _blocks(self, path: Path) -> Iterator[Log]:
        if path.stat().st_size == 0:
            raise LogError("empty", f"{path}: the file is empty")
        # imported by name: slow, and without type information
        openpyxl: Any = import_module("openpyxl")
        with path.open("rb") as file:
            with zipfile.ZipFile(file) as archive:
                parts = archive.infolist()
            times = {part: _TREE if part.filename.endswith(_TREES) else 1 for part in parts}
            check_unpacked(path, sum(part.file_size * times[part] for part in parts))
            book = openpyxl.load_workbook(file, read_only=True, data_only=True)
            # closed by hand: rows that nobody asks for keep the file open
            with closing(book):
                sheet, notes = _choose(path, book, self.given.get("sheet", ""))
                with closing(row for row in sheet.iter_rows(values_only=True)) as rows:
                    for log in self._logs(path, islice(rows, MOST_ROWS)):
                        yield replace(log, notes=notes)
                    # the library makes up all rows above a stray one
                    if next(rows, None) is not None:
                        text = f"a cell below row {MOST_ROWS}, the last one that a sheet can have"
                        text = f"{path}: found {text}: save the workbook anew"
                        raise LogError("too_large", text, MOST_ROWS)

    def _logs(self, path: Path, rows: Iterator[tuple[Any, ...]]) -> Iterator[Log]:
        head = list(islice(rows, _HEADER_ROWS))
        first = _begin(head)
        block = head[first:]
        # cells beside the table are no names and no units
        width = 1 + max((p for row in block[:2] for p in _places(row)), default=-1)
        above = [
            ["" if cell is None else str(cell) for cell in row[: width or None]]
            for row in head[:first]
            if any(cell is not None for cell in row[: width or None])
        ]
        if not above:
            raise LogError("header", f"{path}: no row of names above the numbers of the sheet")
        below: list[str] = []
        if len(above) > 1 and is_units_row(above[-1], len(above[-2])):
            below = above.pop()
        cells = above[-1] + [""] * (max(map(len, block), default=0) - len(above[-1]))
        names, units = names_and_units(cells, below)
        chosen, unread = _number_columns(block, names, given=len(above[-1]))
        self.check_asked(path, unread)
        wanted = self.wanted([names[place] for place in chosen])
        chosen = [place for place in chosen if names[place] in wanted] or chosen
        times = [p for p in chosen if any(_is_moment(row[p]) for row in block[:1] if len(row) > p)]
        units = ["s" if place in times else unit for place, unit in enumerate(units)]
        filled = 0
        for row in rows:
            block.append(row)
            filled += len(row)
            if len(block) >= _ROWS_AT_A_TIME or filled >= _NUMBERS_AT_A_TIME:
                yield _sheet_log(path, names, units, chosen, block, unread)
                block, filled = [], 0
        log = _sheet_log(path, names, units, chosen, block, unread)
        if log.rows:
            yield log


def _choose(path: Path, book: Any, wanted: str | float) -> tuple[Any, tuple[str, ...]]:
    """Find the sheet that is wanted, or the first visible one with a table of numbers."""
    visible = [sheet for sheet in book.worksheets if sheet.sheet_state == "visible"]
    others = [sheet.title for sheet in book.worksheets if sheet not in visible]
    listed = ", ".join(sheet.title for sheet in visible)
    hidden = f"; hidden: {', '.join(others)}" if others else ""
    if isinstance(wanted, str) or str(wanted) in book.sheetnames:
        # a hidden sheet is read by its name only
        named = [sheet for sheet in book.worksheets if sheet.title == str(wanted)]
        found = named or [s for s in visible if fnmatch.fnmatchcase(s.title, str(wanted) or "*")]
    else:
        found = [visible[int(wanted) - 1]] if wanted in range(1, len(visible) + 1) else []
    if not found:
        what = f"no sheet {wanted!r}" if wanted else "no visible sheet"
        raise LogError("sheet", f"{path}: {what}; allowed: {listed}{hidden}")
    for sheet in found:
        sheet.reset_dimensions()  # the stated size of a sheet is often wrong
    table = next(filter(_has_table, found[:_MOST_SHEETS]), None)
    if table is None and others and not wanted:
        text = f"no table of numbers in {listed}{hidden}: options: {{sheet: NAME}} reads a hidden sheet"
        raise LogError("sheet", f"{path}: {text}")
    sheet = table or found[0]
    rest = [s.title for s in book.worksheets if s is not sheet]
    note = f"sheet {sheet.title!r}, the first with a table of numbers; the workbook also has "
    several = rest and (not wanted or len(found) > 1)
    return sheet, (
        f"{note}{', '.join(map(repr, rest))}: options: {{sheet: ...}}",
    ) if several else ()


def _has_table(sheet: Any) -> bool:
    with closing(row for row in sheet.iter_rows(values_only=True)) as rows:
        head = list(islice(rows, _HEADER_ROWS))
    below = head[_begin(head) + 1 :]
    return _begin(below) < len(below)


def _places(row: Sequence[Any]) -> set[int]:
    """Columns in which a row has a number or a time."""
    filled = {place: cell for place, cell in enumerate(row) if cell is not None}
    return {place for place, cell in filled.items() if _number(cell) is not None}


def _begin(head: Sequence[Sequence[Any]]) -> int:
    """Row at which a table begins: the first of two in a row with numbers where most of those below have some."""
    numbers = [_places(row) for row in head]
    for start, own in enumerate(numbers):
        below = [found for found in numbers[start + 1 :] if found]
        table = {p for p in own if sum(p in found for found in below) * 2 >= len(below)}
        # the second may be damaged in part
        if len(table) >= 2 and (start + 1 == len(head) or table & numbers[start + 1] or not below):
            return start
    return len(head)


def _number(cell: Any) -> float | None:
    """Return a number, or a date or time in s."""
    if type(cell) in (float, int):
        return float(cell)
    seconds = seconds_of(cell.strip()) if isinstance(cell, str) else of_moment(cell)
    return None if math.isnan(seconds) else seconds


def _is_moment(cell: Any) -> bool:
    return not isinstance(cell, float | int | None)


def _number_columns(
    rows: Sequence[Sequence[Any]], names: Sequence[str], given: int
) -> tuple[list[int], dict[str, str]]:
    """Places of the columns that hold numbers or times in the first rows, and why named others are not read."""
    chosen, unread = [], {}
    rows = [row for row in rows if any(cell is not None for cell in row)]
    for place, name in enumerate(names):
        cells = [row[place] for row in rows if len(row) > place and row[place] is not None]
        numbers = sum(_number(cell) is not None for cell in cells)
        if not rows or numbers * 2 > len(rows):
            chosen.append(place)
        elif cells and place < given:
            unread[name] = f"{str(cells[0])!r} (no number and no time)"
    return chosen, unread


def _sheet_log(
    path: Path,
    names: Sequence[str],
    units: Sequence[str],
    chosen: list[int],
    block: list[Any],
    unread: Mapping[str, str],
) -> Log:
    most = max(chosen, default=-1)
    # below a table somebody may have typed something beside it
    rows = [row for row in block if any(cell is not None for cell in row[: most + 1])]
    kept: list[list[Any]] = []
    for row in rows:
        cells = [row[place] for place in chosen] if len(row) > most else [None]
        # most cells are numbers: looking at each of them by a function takes as long as reading
        if not _PLAIN.issuperset(map(type, cells)):
            cells = [_number(cell) for cell in cells]
            if None in cells:
                continue
        kept.append(cells)
    dropped = {NUMBER: len(rows) - len(kept)} if len(kept) < len(rows) else {}
    values = np.array(kept, dtype=float).reshape(-1, len(chosen)).T
    columns = {names[place]: values[index] for index, place in enumerate(chosen)}
    stated = {names[p]: units[p] for p in chosen}
    return Log(path, columns, stated, len(rows), dropped, unread=unread).finite()


class ParquetReader(Reader):
    """Every column of numbers; units from the names, or from the field's metadata ``unit``."""

    name = "parquet"
    description = "Parquet table; units in the column names (force_N, Force [N]) or their metadata"
    evidence = "its first four bytes, PAR1"
    marks = (b"PAR1",)

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a table, some million numbers at a time."""
        return _checked(path, "Parquet file", self._batches(path))

    def _batches(self, path: Path) -> Iterator[Log]:
        import pyarrow.parquet as pq

        with path.open("rb") as opened, pq.ParquetFile(opened) as file:
            chosen = _fields(file.schema_arrow)
            wanted = self.wanted([name for name, _ in chosen.values()])
            chosen = {f: own for f, own in chosen.items() if own[0] in wanted} or chosen
            if not chosen:
                raise LogError("header", f"{path}: no column of this table holds numbers")
            check_unpacked(path, 8 * len(chosen) * file.metadata.num_rows)
            units = dict(chosen.values())
            at_a_time = max(1, _NUMBERS_AT_A_TIME // len(chosen))
            for batch in file.iter_batches(at_a_time, columns=list(chosen)):
                if batch.num_rows:
                    columns = {name: _numbers(batch.column(f)) for f, (name, _) in chosen.items()}
                    yield Log(path, columns, units, batch.num_rows).finite()


def _fields(schema: Any) -> dict[str, tuple[str, str]]:
    """Column of the file to the name and unit that it has here."""
    from pyarrow import types

    checks = (types.is_integer, types.is_floating, types.is_timestamp, types.is_boolean)
    fields = [field for field in schema if any(check(field.type) for check in checks)]
    names, units = names_and_units(field.name for field in fields)
    chosen = {}
    for field, name, unit in zip(fields, names, units, strict=True):
        metadata = field.metadata or {}
        stated = metadata.get(b"unit") or metadata.get(b"units") or b""
        own = "s" if types.is_timestamp(field.type) else unit
        chosen[field.name] = (name, own or unit_word(stated.decode("utf-8", "replace")))
    return chosen


def _numbers(array: Any) -> np.ndarray:
    import pyarrow as pa

    if pa.types.is_timestamp(array.type):
        missing = np.asarray(array.is_null())
        stamps = array.cast(pa.timestamp("ns", array.type.tz)).cast(pa.int64()).fill_null(0)
        return np.where(missing, np.nan, ns_to_s(stamps.to_numpy(zero_copy_only=False)))
    return np.asarray(array.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=float)
