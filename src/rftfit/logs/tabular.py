"""Logs in xlsx workbooks and Parquet files."""

from __future__ import annotations

import math
import warnings
import zipfile
from contextlib import closing
from copy import copy
from dataclasses import replace
from importlib import import_module
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.base import Log, LogError, Reader, check_unpacked, ns_to_s
from rftfit.logs.delimited import is_units_row
from rftfit.logs.stamps import of_moment, seconds_of
from rftfit.logs.text import NUMBER
from rftfit.logs.units import names_and_units, unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import Self

MOST_ROWS = 1_048_576
_HEADER_ROWS = 60
_PLAIN = frozenset({float, int})
_ROWS_AT_A_TIME = 50_000
_TREES, _TREE = (".rels", "styles.xml", "workbook.xml", "[Content_Types].xml"), 100
"""Parts of a workbook that the library reads as a whole, and how many times their size that takes."""
_NUMBERS_AT_A_TIME = 1 << 22  # so that a table of many columns takes no more memory


def _checked(path: Path, what: str, blocks: Iterator[Log]) -> Iterator[Log]:
    """Hand blocks on; whatever a library raises on a damaged file becomes one message."""
    rows = 0
    try:
        for log in blocks:
            rows += log.rows
            yield log
    except (LogError, GeneratorExit):
        raise
    except FileNotFoundError:
        raise LogError("missing", f"{path}: log missing") from None
    # from KeyError to zlib.error
    except Exception as error:  # noqa: BLE001
        why = str(error) or type(error).__name__
        text = f"{path}: this {what} cannot be read ({why}); is it cut short? Its list of contents "
        raise LogError("unreadable", f"{text}stands at its end", rows) from None
    if rows == 0:
        raise LogError("header_only", f"{path}: a header and no data")


class XlsxReader(Reader):
    """A row of names somewhere in the first rows, perhaps one of units, then numbers."""

    name = "xlsx"
    description = "xlsx workbook, first sheet or the one of options: {sheet: NAME}"
    evidence = "the archive's parts: an xlsx workbook"
    _sheet = ""

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        marks = (b"[Content_Types].xml", b"xl/", b"_rels/.rels")
        return head.startswith(b"PK\x03\x04") and any(mark in head for mark in marks)

    def with_options(self, options: Mapping[str, object]) -> Self:
        """Return the reader of the sheet that ``sheet`` names."""
        if set(options) - {"sheet"}:
            raise ValueError(f"the dialect xlsx has the option sheet only, found {list(options)}")
        reader = copy(self)
        reader._sheet = str(options.get("sheet", ""))
        return reader

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a sheet, some ten thousand rows at a time."""
        with warnings.catch_warnings():
            # about styles and validation rules, which do not matter here
            warnings.simplefilter("ignore")
            yield from _checked(path, "workbook", _sheet_blocks(path, self._sheet))


def _sheet_blocks(path: Path, wanted: str) -> Iterator[Log]:
    if path.stat().st_size == 0:
        raise LogError("empty", f"{path}: the file is empty")
    # imported by name: slow, and without type information
    openpyxl: Any = import_module("openpyxl")
    with path.open("rb") as file:
        with zipfile.ZipFile(file) as archive:
            parts = archive.infolist()
        check_unpacked(
            path, sum(p.file_size * (_TREE if p.filename.endswith(_TREES) else 1) for p in parts)
        )
        book = openpyxl.load_workbook(file, read_only=True, data_only=True)
        if wanted and wanted not in book.sheetnames:
            sheets = ", ".join(book.sheetnames)
            raise LogError("sheet", f"{path}: no sheet {wanted!r}; allowed: {sheets}")
        sheet: Any = book[wanted] if wanted else book.worksheets[0]
        others = [name for name in book.sheetnames if name != sheet.title]
        note = (
            f"sheet {sheet.title!r}; the workbook also has {', '.join(map(repr, others))}: options"
        )
        notes = (f"{note}: {{sheet: ...}}",) if others and not wanted else ()
        # the stated size of a sheet is often wrong
        sheet.reset_dimensions()
        # closed by hand: rows that nobody asks for keep the file open
        with closing(book), closing(row for row in sheet.iter_rows(values_only=True)) as rows:
            for log in _row_blocks(path, islice(rows, MOST_ROWS)):
                yield replace(log, notes=notes)
            # the library makes up all rows above a stray one
            if next(rows, None) is not None:
                text = f"a cell below row {MOST_ROWS}, the last one that a sheet can have"
                raise LogError(
                    "too_large", f"{path}: found {text}: save the workbook anew", MOST_ROWS
                )


def _row_blocks(path: Path, rows: Iterator[tuple[Any, ...]]) -> Iterator[Log]:
    head: list[tuple[Any, ...]] = []
    for row in rows:
        head.append(row)
        if len(head) > _HEADER_ROWS or (len(head) > 1 and _is_data(row) and _is_data(head[-2])):
            break
    first = next((place for place, row in enumerate(head) if _is_data(row)), len(head))
    above = [
        ["" if cell is None else str(cell) for cell in row]
        for row in head[:first]
        if any(cell is not None for cell in row)
    ]
    if not above:
        raise LogError("header", f"{path}: no row of names above the numbers of the sheet")
    units: list[str] = []
    if len(above) > 1 and is_units_row(above[-1], len(above[-2])):
        units = [unit_word(cell) for cell in above.pop()]
    block = head[first:]
    cells = above[-1]
    cells += [""] * (len(block[0]) - len(cells) if block else 0)
    names, stated = names_and_units(cells)
    units = [own or other for own, other in zip(units or stated, stated, strict=False)]
    chosen = _number_columns(block, names)
    times = [p for p in chosen if block and not isinstance(block[0][p], float | int | None)]
    units = ["s" if place in times else unit for place, unit in enumerate(units)]
    filled = 0
    for row in rows:
        block.append(row)
        filled += len(row)
        if len(block) >= _ROWS_AT_A_TIME or filled >= _NUMBERS_AT_A_TIME:
            yield _sheet_log(path, names, units, chosen, block)
            block, filled = [], 0
    log = _sheet_log(path, names, units, chosen, block)
    if log.rows:
        yield log


def _number(cell: Any) -> float | None:
    """Return a number, or a date or time in s."""
    if type(cell) in (float, int):
        return float(cell)
    seconds = seconds_of(cell.strip()) if isinstance(cell, str) else of_moment(cell)
    return None if math.isnan(seconds) else seconds


def _is_data(row: Sequence[Any]) -> bool:
    filled = [cell for cell in row if cell is not None]
    numbers = sum(_number(cell) is not None for cell in filled)
    return numbers >= 2 and numbers * 2 >= len(filled)


def _number_columns(rows: Sequence[Sequence[Any]], names: Sequence[str]) -> list[int]:
    """Places of the columns that hold numbers or times in the first rows; texts are left out."""
    rows = [row for row in rows if any(cell is not None for cell in row)]

    def numbers(place: int) -> int:
        return sum(len(row) > place and _number(row[place]) is not None for row in rows)

    return [place for place in range(len(names)) if not rows or numbers(place) * 2 > len(rows)]


def _sheet_log(
    path: Path, names: Sequence[str], units: Sequence[str], chosen: list[int], block: list[Any]
) -> Log:
    rows = [row for row in block if any(cell is not None for cell in row)]
    most = max(chosen, default=-1)
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
    log = Log(path, columns, {names[p]: units[p] for p in chosen}, len(rows), dropped)
    return log.finite()


class ParquetReader(Reader):
    """Every column of numbers; units from the names, or from the field's metadata ``unit``."""

    name = "parquet"
    description = "Parquet table; units in the column names (force_N, Force [N]) or their metadata"
    evidence = "its first four bytes, PAR1"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        return head.startswith(b"PAR1")

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a table, some million numbers at a time."""
        return _checked(path, "Parquet file", _batches(path))


def _batches(path: Path) -> Iterator[Log]:
    import pyarrow.parquet as pq

    if not path.is_file():
        raise LogError("missing", f"{path}: log missing")
    with path.open("rb") as opened, pq.ParquetFile(opened) as file:
        chosen = _fields(file.schema_arrow)
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
