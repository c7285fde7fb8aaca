"""Logs in xlsx workbooks and Parquet files."""

from __future__ import annotations

import math
import warnings
import zipfile
from contextlib import closing
from copy import copy
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.base import Log, LogError, Reader
from rftfit.logs.delimited import is_units_row
from rftfit.logs.text import FINITE, NUMBER
from rftfit.logs.units import split_unit, unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path


# --- Logs in the first sheet of an xlsx workbook.


MAX_UNPACKED = 4_000_000_000
_HEADER_ROWS = 60
_AT_A_TIME = 50_000


class XlsxReader(Reader):
    """A row of names somewhere in the first rows, perhaps one of units, then numbers."""

    name = "xlsx"
    evidence = "the archive's parts: an xlsx workbook"

    def __init__(self) -> None:
        self._sheet = ""

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "xlsx workbook, first sheet or the one of options: {sheet: NAME}"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        marks = (b"[Content_Types].xml", b"xl/", b"_rels/.rels")
        return head.startswith(b"PK\x03\x04") and any(mark in head for mark in marks)

    def with_options(self, options: Mapping[str, object]) -> XlsxReader:
        """Return the reader of the sheet that ``sheet`` names."""
        if set(options) - {"sheet"}:
            raise ValueError(f"the dialect xlsx has the option sheet only, found {list(options)}")
        reader = copy(self)
        reader._sheet = str(options.get("sheet", ""))
        return reader

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a sheet, some ten thousand rows at a time."""
        total = 0
        try:
            with warnings.catch_warnings():
                # about styles and validation rules, which do not matter here
                warnings.simplefilter("ignore")
                for log in _logs(path, self._sheet):
                    total += log.rows
                    yield log
        except (LogError, GeneratorExit):
            raise
        except FileNotFoundError:
            raise LogError("missing", f"{path}: log missing") from None
        # the library raises whatever its parsers do, from KeyError to zlib.error, on a damaged file
        except Exception as error:  # noqa: BLE001
            why = str(error) or type(error).__name__
            text = f"{path}: this workbook cannot be read ({why}); is it cut short? Save it again"
            raise LogError("unreadable", text, total) from None
        if total == 0:
            raise LogError("header_only", f"{path}: a header row and no data")


def _logs(path: Path, wanted: str) -> Iterator[Log]:
    if path.stat().st_size == 0:
        raise LogError("empty", f"{path}: the file is empty")
    with zipfile.ZipFile(path) as archive:
        unpacked = sum(info.file_size for info in archive.infolist())
    if unpacked > MAX_UNPACKED:
        size, most = unpacked / 1e6, MAX_UNPACKED / 1e6
        raise LogError(
            "too_large",
            f"{path}: {size:.0f} MB when unpacked; at most {most:g} MB are read: export it as .csv",
        )
    # imported by name: slow, and without type information
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    try:
        if wanted and wanted not in book.sheetnames:
            sheets = ", ".join(book.sheetnames)
            raise LogError("sheet", f"{path}: no sheet {wanted!r}; allowed: {sheets}")
        sheet: Any = book[wanted] if wanted else book.worksheets[0]
        # the stated size of a sheet is often wrong
        sheet.reset_dimensions()
        # closed by hand: rows that nobody asks for keep the file open
        with closing(row for row in sheet.iter_rows(values_only=True)) as rows:
            yield from _tables(path, rows)
    finally:
        book.close()


def _tables(path: Path, rows: Iterator[tuple[Any, ...]]) -> Iterator[Log]:
    head: list[tuple[Any, ...]] = []
    for row in rows:
        head.append(row)
        if len(head) > _HEADER_ROWS or (len(head) > 1 and _is_row(row) and _is_row(head[-2])):
            break
    first = next((place for place, row in enumerate(head) if _is_row(row)), len(head))
    above = [_texts(row) for row in head[:first] if any(cell is not None for cell in row)]
    if not above:
        raise LogError("header", f"{path}: no row of names above the numbers of the sheet")
    units: list[str] = []
    if len(above) > 1 and is_units_row(above[-1], len(above[-2])):
        units = [unit_word(cell) for cell in above.pop()]
    cells = above[-1]
    width = max(len(cells), len(head[first]) if first < len(head) else 0)
    cells += [""] * (width - len(cells))
    split = [split_unit(cell) for cell in cells]
    names = unique([name for name, _ in split])
    stated = [unit for _, unit in split]
    units = [own or other for own, other in zip(units or stated, stated, strict=False)]
    read = _numeric(head[first:], names)
    block: list[tuple[Any, ...]] = head[first:]
    for row in rows:
        block.append(row)
        if len(block) >= _AT_A_TIME:
            yield _log(path, names, units, read, block)
            block = []
    log = _log(path, names, units, read, block)
    if log.rows:
        yield log


def _is_row(row: Sequence[Any]) -> bool:
    filled = [cell for cell in row if cell is not None]
    numbers = sum(isinstance(cell, int | float) for cell in filled)
    return numbers >= 2 and numbers * 2 >= len(filled)


def _texts(row: Sequence[Any]) -> list[str]:
    return ["" if cell is None else str(cell) for cell in row]


def _numeric(rows: Sequence[Sequence[Any]], names: Sequence[str]) -> list[int]:
    """Places of the columns that hold numbers in the first rows; texts and dates are left out."""
    return [
        place
        for place in range(len(names))
        if not rows
        or sum(len(row) > place and isinstance(row[place], int | float) for row in rows) * 2
        > len(rows)
    ]


def _log(
    path: Path, names: Sequence[str], units: Sequence[str], read: list[int], block: list[Any]
) -> Log:
    rows = [row for row in block if any(cell is not None for cell in row)]
    kept: list[list[Any]] = []
    dropped: dict[str, int] = {}
    most = max(read, default=-1)
    for row in rows:
        cells = [row[place] for place in read] if len(row) > most else [None]
        if all(type(cell) in (float, int) for cell in cells):
            kept.append(cells)
        else:
            dropped[NUMBER] = dropped.get(NUMBER, 0) + 1
    values = np.array(kept, dtype=float).reshape(-1, len(read)).T
    columns = {names[place]: values[index] for index, place in enumerate(read)}
    log = Log(path, columns, {names[p]: units[p] for p in read}, len(rows), dropped)
    return log.take(np.isfinite(values).all(axis=0), FINITE) if math.prod(values.shape) else log


# --- Logs in Parquet files.


_COLUMNAR_AT_A_TIME = 1 << 22  # numbers, so that a table of many columns takes no more memory
_MAGIC = b"PAR1"


class ParquetReader(Reader):
    """Every column of numbers; units from the names, or from the field's metadata ``unit``."""

    name = "parquet"
    evidence = "its first four bytes, PAR1"

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "Parquet table; units in the column names (force_N, Force [N]) or their metadata"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        return head.startswith(_MAGIC)

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a table, some million numbers at a time."""
        import pyarrow.parquet as pq

        if not path.is_file():
            raise LogError("missing", f"{path}: log missing")
        rows = 0
        try:
            with pq.ParquetFile(path) as file:
                chosen = _columns(file.schema_arrow)
                if not chosen:
                    raise LogError("header", f"{path}: no column of this table holds numbers")
                at_a_time = max(1, _COLUMNAR_AT_A_TIME // len(chosen))
                for batch in file.iter_batches(at_a_time, columns=list(chosen)):
                    rows += batch.num_rows
                    if batch.num_rows:
                        yield _columnar_log(path, chosen, batch)
        except (LogError, GeneratorExit):
            raise
        # the library raises whatever its parsers do on a damaged file
        except Exception as error:  # noqa: BLE001
            text = f"{path}: this Parquet file cannot be read ({error}); is it cut short? Its list "
            text += "of contents stands at its end, so a cut file gives no row"
            raise LogError("unreadable", text, rows) from None
        if rows == 0:
            raise LogError("header_only", f"{path}: a header and no data")


def _columns(schema: Any) -> dict[str, tuple[str, str]]:
    """Column of the file to the name and unit that it has here."""
    import pyarrow.types as kinds

    fields = [
        field
        for field in schema
        if kinds.is_integer(field.type)
        or kinds.is_floating(field.type)
        or kinds.is_timestamp(field.type)
        or kinds.is_boolean(field.type)
    ]
    split = [split_unit(field.name) for field in fields]
    names = unique([name for name, _ in split])
    chosen = {}
    for field, name, (_, unit) in zip(fields, names, split, strict=True):
        metadata = field.metadata or {}
        stated = metadata.get(b"unit") or metadata.get(b"units") or b""
        unit = "s" if kinds.is_timestamp(field.type) else unit  # noqa: PLW2901
        chosen[field.name] = (name, unit or unit_word(stated.decode("utf-8", "replace")))
    return chosen


def _columnar_log(path: Path, chosen: dict[str, tuple[str, str]], batch: Any) -> Log:
    columns = {}
    units = {}
    for source, (name, unit) in chosen.items():
        columns[name] = _numbers(batch.column(source))
        units[name] = unit
    log = Log(path, columns, units, batch.num_rows)
    finite = np.ones(log.size, dtype=bool)
    for values in columns.values():
        finite &= np.isfinite(values)
    return log.take(finite, FINITE)


def _numbers(array: Any) -> np.ndarray:
    import pyarrow as pa
    import pyarrow.types as kinds

    from rftfit.logs.base import ns_to_s

    if kinds.is_timestamp(array.type):
        missing = np.asarray(array.is_null())
        stamps = array.cast(pa.timestamp("ns", array.type.tz)).cast(pa.int64()).fill_null(0)
        return np.where(missing, np.nan, ns_to_s(stamps.to_numpy(zero_copy_only=False)))
    return np.asarray(array.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=float)
