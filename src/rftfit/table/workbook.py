"""Opens workbooks (xlsx), and converts each cell to the text that a csv of the sheet would hold.

Sheets and logs in workbooks are then read as their csv is. `value` stands for the value of a cell as openpyxl returns
it: None, bool, int, float, str, a type of `MOMENTS`, or an object for an array formula.
"""

from __future__ import annotations

import datetime as dt
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from typing import Any, BinaryIO

WORKBOOK = b"PK\x03\x04"
"""First bytes of a workbook, which is a zip archive."""
ERROR_VALUES = ("#N/A", "#REF!", "#DIV/0!", "#NAME?", "#NULL!", "#NUM!", "#VALUE!")
"""Errors that a spreadsheet shows in place of the result of a formula."""
NO_RESULT = (
    "a formula whose result the workbook does not hold: open and save it in a spreadsheet program"
)
"""Refusal of a cell that a program wrote as a formula without calculating it."""
MOMENTS = (dt.date, dt.time, dt.timedelta)
"""Types of cells that are dates, times of day or durations."""


@contextmanager
def open_workbook(file: BinaryIO, *, formulas: bool = False) -> Iterator[Any]:
    """Open a workbook of openpyxl to be read row by row, with its sheets in `worksheets`; close it after the block.

    `formulas`: True: cells hold their formulas in place of the results, to find the cells of which no result is stored.
    """
    # imported by name: slow, and without type information
    openpyxl: Any = import_module("openpyxl")
    with warnings.catch_warnings():
        # the library warns of styles and validation rules that it does not read
        warnings.simplefilter("ignore")
        # closed explicitly: rows that are never asked for would keep the file open
        with closing(
            openpyxl.load_workbook(file, read_only=True, data_only=not formulas)
        ) as workbook:
            for sheet in workbook.worksheets:
                # the stated size of a sheet is often wrong
                sheet.reset_dimensions()
            yield workbook


@contextmanager
def rows_of(sheet: Any, most_columns: int | None = None) -> Iterator[Iterator[tuple[Any, ...]]]:
    """Provide an iterator of the rows of a sheet, each a tuple of values, until the end of the block.

    `most_columns`: Number of columns that are read; default: all.
    """
    with closing(row for row in sheet.iter_rows(max_col=most_columns, values_only=True)) as rows:
        yield rows


def place_of_column(letters: str) -> int:
    """Return the place of a column, from 0, by its letters in a sheet: 0 for ``A``, 26 for ``AA``."""
    # the letters are digits from 1 to 26 in base 26
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1


def formula_of(value: Any) -> str:
    """Return the formula of a cell, which begins with ``=``; empty for any other value."""
    # an array formula, which fills a range of cells, is an object with the formula as its `text`
    text = str(getattr(value, "text", value) or "")
    return text if text.startswith("=") else ""


def text_of(value: Any) -> str:
    """Return the text that a csv would hold for the value of a cell, stripped.

    A number is written as shortly as it can be read back (3 for 3.0), a bool as yes or no, a duration as
    hours:minutes:seconds, a date or time in ISO 8601; an empty cell is an empty text.
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, dt.timedelta):
        minutes, seconds = divmod(value, dt.timedelta(minutes=1))
        # only a datetime formats a fraction of a second
        return f"{minutes // 60}:{minutes % 60:02}:{dt.datetime.min + seconds:%S.%f}"
    if isinstance(value, dt.date | dt.time):
        return value.isoformat()
    # line ends of Windows, which a workbook may hold as this code of a carriage return
    return str(value).replace("_x000D_\n", "\n").replace("\r\n", "\n").replace("\r", "\n").strip()
