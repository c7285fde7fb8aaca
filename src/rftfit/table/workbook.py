"""Workbooks: the one function that opens them, and each cell as the text that a csv would hold."""

from __future__ import annotations

import datetime as dt
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from typing import Any, BinaryIO

WORKBOOK = b"PK\x03\x04"
"""First bytes of a workbook, as of any archive."""
ERROR_VALUES = ("#N/A", "#REF!", "#DIV/0!", "#NAME?", "#NULL!", "#NUM!", "#VALUE!")
"""What a spreadsheet shows in place of the result of a formula."""
NO_RESULT = (
    "a formula whose result the workbook does not hold: open and save it in a spreadsheet program"
)
_MOMENTS = (dt.date, dt.time, dt.timedelta)


@contextmanager
def open_workbook(file: BinaryIO, *, formulas: bool = False) -> Iterator[Any]:
    """Open a workbook to be read row by row; `formulas`: cells hold these in place of their results."""
    # imported by name: slow, and without type information
    openpyxl: Any = import_module("openpyxl")
    with warnings.catch_warnings():
        # about styles and validation rules, which do not matter here
        warnings.simplefilter("ignore")
        # closed by hand: rows that nobody asks for keep the file open
        with closing(
            openpyxl.load_workbook(file, read_only=True, data_only=not formulas)
        ) as workbook:
            for sheet in workbook.worksheets:
                # the stated size of a sheet is often wrong
                sheet.reset_dimensions()
            yield workbook


@contextmanager
def rows_of(sheet: Any, most_columns: int | None = None) -> Iterator[Iterator[tuple[Any, ...]]]:
    """Read the rows of a sheet, each a tuple of values."""
    with closing(row for row in sheet.iter_rows(max_col=most_columns, values_only=True)) as rows:
        yield rows


def place_of_column(letters: str) -> int:
    """Place of a column that a sheet calls by letters: 0 of ``A``."""
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1


def is_moment(value: Any) -> bool:
    """Tell a date, a time of day or a length of time from other values of a cell."""
    return isinstance(value, _MOMENTS)


def formula_of(value: Any) -> str:
    """Formula that a cell holds, one of a range as well; empty of another value."""
    text = str(getattr(value, "text", value) or "")
    return text if text.startswith("=") else ""


def text_of(value: Any) -> str:
    """Text of a cell without the blanks around it: of a number the shortest one that means it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < _MOST_WHOLE else repr(value)
    if isinstance(value, dt.timedelta):
        minutes, seconds = divmod(value, dt.timedelta(minutes=1))
        return f"{minutes // 60}:{minutes % 60:02}:{_EPOCH + seconds:%S.%f}"
    if isinstance(value, dt.date | dt.time):
        return value.isoformat()
    return str(value).replace("_x000D_\n", "\n").replace("\r\n", "\n").replace("\r", "\n").strip()


_MOST_WHOLE = 1e15
_EPOCH = dt.datetime(1970, 1, 1)
