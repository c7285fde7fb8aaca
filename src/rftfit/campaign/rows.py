"""Reading tables that a user makes by hand: text cells from csv, tsv or xlsx."""

from __future__ import annotations

import csv
import datetime as dt
import io
import warnings
import zipfile
from dataclasses import dataclass, field
from importlib import import_module
from itertools import islice
from typing import TYPE_CHECKING, Any

from rftfit.campaign.columns import BY_NAME
from rftfit.campaign.problems import Problem
from rftfit.campaign.reading import decode, read_bytes

if TYPE_CHECKING:
    from pathlib import Path


# --- The run sheet as a plain table of text cells, from csv or tsv; workbooks are in `workbook`.


MAX_BYTES = 50_000_000
MAX_ROWS = 200_000

_WORKBOOK = b"PK\x03\x04"
_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0"
_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}


@dataclass(frozen=True, slots=True)
class Odd:
    """A cell of a workbook that is not what it looks like.

    `code`: Of the problem to be made of it.
    `found`, `allowed`: For that problem.
    """

    code: str
    found: str
    allowed: str


@dataclass
class Table:
    """Header and rows as text.

    `rows`: Row number as a spreadsheet counts, and its cells; blank rows are left out.
    `odd`: Cells that need a second look, by row number and position.
    """

    header: list[str] = field(default_factory=list)
    rows: list[tuple[int, list[str]]] = field(default_factory=list)
    odd: dict[tuple[int, int], Odd] = field(default_factory=dict)
    header_row: int = 1

    def add(self, row: int, cells: list[str]) -> None:
        """Take in one row; the first that is not blank is the header.

        `row`: As a spreadsheet numbers it. `cells`: Without the spaces around them; a row of empty
        cells is left out.
        """
        if not any(cells):
            return
        if self.header:
            self.rows.append((row, cells))
        else:
            self.header, self.header_row = cells, row


def too_many_rows(file: str) -> Problem:
    """Make the problem of a sheet that goes on for ever.

    `file`: Name of the sheet. Returns at the last row that is read.
    """
    allowed = f"at most {MAX_ROWS} rows are read; delete the empty rows below the last run"
    return Problem(file, MAX_ROWS, None, None, allowed, "sheet.too-many-rows")


def read_table(path: Path, file: str) -> tuple[Table | None, list[Problem]]:
    """Read a run sheet; whether it is a workbook is seen from its content.

    `file`: Its name, for problems. Returns `table`: None when nothing can be read.
    """
    data = read_bytes(path, file, "sheet", MAX_BYTES)
    if isinstance(data, Problem):
        return None, [data]
    if data.startswith(_WORKBOOK):
        # openpyxl is slow to import, and few sheets need it

        return read_workbook(data, file)
    if data.startswith(_OLD_WORKBOOK):
        allowed = "csv, tsv or xlsx; this is an old or encrypted workbook: save it as .xlsx"
        return None, [Problem(file, None, None, "xls", allowed, "sheet.not-a-workbook")]
    if path.suffix.lower() in (".xlsx", ".xlsm") and data.strip():
        allowed = "a workbook, as the name says; this file is none: save it again as .xlsx or .csv"
        return None, [Problem(file, None, None, None, allowed, "sheet.not-a-workbook")]
    text = decode(data, file, "sheet")
    if isinstance(text, Problem):
        return None, [text]
    return _read_text(text, file, path.suffix.lower())


def _read_text(text: str, file: str, suffix: str) -> tuple[Table | None, list[Problem]]:
    table = Table()
    delimiter = _delimiter(text, suffix)
    reader = csv.reader(io.StringIO(text), delimiter=delimiter, strict=True)
    row = 0
    try:
        for row, cells in enumerate(reader, start=1):
            if row > MAX_ROWS:
                return None, [too_many_rows(file)]
            table.add(row, [cell.strip() for cell in cells])
    except csv.Error as error:
        allowed = f"this row cannot be taken apart into cells ({error}); look for a stray quote"
        return None, [Problem(file, row + 1, None, None, allowed, "sheet.not-csv")]
    # one long cell that names several columns: cut by something else
    if len(table.header) == 1 and sum(name in table.header[0] for name in BY_NAME) > 2:
        allowed = f"cells separated by {', '.join(_DELIMITERS.values())}"
        found = table.header[0]
        return None, [
            Problem(file, table.header_row, None, found, allowed, "sheet.wrong-delimiter")
        ]
    return table, []


def _delimiter(text: str, suffix: str) -> str:
    """Choose the delimiter that finds most columns in the header; at a draw, that of the file's name."""
    header = next((line for line in text.split("\n", 100) if line.strip()), "")
    order = ["\t", ",", ";"] if suffix in (".tsv", ".tab") else [",", ";", "\t"]

    def known(delimiter: str) -> int:
        names = [name.strip().strip('"').strip() for name in header.split(delimiter)]
        return sum(name in BY_NAME for name in names)

    return max(order, key=known)


# --- The first sheet of an xlsx workbook as a table of text cells.


MAX_UNPACKED = 40_000_000
MAX_TAGS = 3_000_000
"""Some four a cell: enough for 45,000 runs, and read in seconds whatever they are."""

MAX_COLUMNS = 64

_ERROR_VALUES = ("#N/A", "#REF!", "#DIV/0!", "#NAME?", "#NULL!", "#NUM!", "#VALUE!")
_DATES = (dt.date, dt.time, dt.timedelta)


def read_workbook(data: bytes, file: str) -> tuple[Table | None, list[Problem]]:
    """Read the first sheet of a workbook.

    `data`: Of the whole file. `file`: Its name, for problems. Returns `table`: Numbers as the
    shortest text that means them, true and false as words; dates, error values and formulas that
    were never calculated are in ``odd``. None when nothing can be read.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(info.file_size for info in archive.infolist())
            if unpacked > MAX_UNPACKED:
                size, most = unpacked / 1e6, MAX_UNPACKED / 1e6
                allowed = f"{size:.0f} MB when unpacked are too large; at most {most:g} MB are read"
                return None, [Problem(file, None, None, None, allowed, "sheet.too-large")]
            parts = {name: archive.read(name) for name in archive.namelist()}
            refused = _refused(parts)
            if refused is not None:
                return None, [Problem(file, None, None, None, *refused)]
            formulas = _has_formulas(parts)
        table = Table()
        with warnings.catch_warnings():
            # about styles and validation rules, which do not matter here
            warnings.simplefilter("ignore")
            rows = _rows(data, formulas=False)
            uncalculated = _rows(data, formulas=True) if formulas else None
            for row, cells in enumerate(rows, start=1):
                if row > MAX_ROWS:
                    return None, [too_many_rows(file)]
                texts = [_text(value) for value in cells]
                if uncalculated is not None:
                    for place, source in enumerate(next(uncalculated, ())):
                        if cells[place] is None and source is not None:
                            texts[place] = str(getattr(source, "text", source))
                            table.odd[row, place] = Odd(
                                "sheet.formula",
                                texts[place],
                                "a value; this formula was never calculated: open the workbook in "
                                "a spreadsheet and save it, or type the value",
                            )
                table.add(row, texts)
                _look_closer(table, row, cells)
    # the library raises whatever its parsers do, from KeyError to zlib.error, on a damaged file
    except Exception as error:  # noqa: BLE001
        why = str(error) or type(error).__name__
        allowed = f"this workbook cannot be read ({why}); save it again as .xlsx or .csv"
        return None, [Problem(file, None, None, None, allowed, "sheet.not-a-workbook")]
    return table, []


def _refused(parts: dict[str, bytes]) -> tuple[str, str] | None:
    """Say what no spreadsheet writes: text and code of a problem."""
    if any(b"<!DOCTYPE" in part or b"<!ENTITY" in part for part in parts.values()):
        allowed = "a workbook as a spreadsheet saves it; this one declares XML entities"
        return allowed, "sheet.not-a-workbook"
    if (tags := sum(part.count(b"<") for part in parts.values())) > MAX_TAGS:
        allowed = f"{tags / 1e6:.0f} million XML tags are too many; at most {MAX_TAGS / 1e6:g}"
        return f"{allowed} million are read", "sheet.too-large"
    return None


def _has_formulas(parts: dict[str, bytes]) -> bool:
    sheets = [part for name, part in parts.items() if name.startswith("xl/worksheets/")]
    return any(b"<f>" in part or b"<f " in part for part in sheets)


def _rows(data: bytes, *, formulas: bool) -> Any:
    # imported by name: slow, and without type information
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=not formulas)
    sheet: Any = book.worksheets[0]
    # the stated size of a sheet is often wrong
    sheet.reset_dimensions()
    rows = sheet.iter_rows(max_col=MAX_COLUMNS, values_only=True)
    return islice(rows, MAX_ROWS + 1)


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    if isinstance(value, _DATES):
        return value.isoformat() if not isinstance(value, dt.timedelta) else str(value)
    text = str(value).replace("_x000D_\n", "\n").replace("\r\n", "\n").replace("\r", "\n")
    return text.strip()


def _look_closer(table: Table, row: int, cells: tuple[Any, ...]) -> None:
    for place, value in enumerate(cells):
        if isinstance(value, _DATES):
            table.odd[row, place] = Odd(
                "sheet.date",
                f"the date {_text(value)}",
                "what you typed; the spreadsheet made a date of it: set the cell's format to Text "
                "and type it again",
            )
        elif isinstance(value, str) and value in _ERROR_VALUES:
            table.odd[row, place] = Odd(
                "sheet.cell-error", value, "a value; the spreadsheet shows an error here"
            )
