"""The first sheet of an xlsx workbook as a table of text cells.

A workbook is a zip archive of XML written by anybody: sizes are looked at before anything is
unpacked, and whatever the reading library stumbles over becomes one readable problem.
"""

from __future__ import annotations

import datetime as dt
import io
import warnings
import zipfile
from importlib import import_module
from itertools import islice
from typing import Any

from rftfit.campaign.problems import Problem
from rftfit.campaign.table import MAX_ROWS, Odd, Table, too_many_rows

MAX_UNPACKED = 40_000_000
MAX_TAGS = 3_000_000
"""Some four a cell: enough for 45,000 runs, and read in seconds whatever they are."""

MAX_COLUMNS = 64

_ERROR_VALUES = ("#N/A", "#REF!", "#DIV/0!", "#NAME?", "#NULL!", "#NUM!", "#VALUE!")
_DATES = (dt.date, dt.time, dt.timedelta)


def read_workbook(data: bytes, file: str) -> tuple[Table | None, list[Problem]]:
    """Read the first sheet of a workbook.

    Parameters
    ----------
    data : bytes
        Of the whole file.
    file : str
        Its name, for problems.

    Returns
    -------
    table : Table or None
        Numbers as the shortest text that means them, true and false as words; dates, error values
        and formulas that were never calculated are in ``odd``. None when nothing can be read.
    problems : list of Problem
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
