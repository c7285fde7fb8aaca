"""Writing xlsx workbooks that are the same bytes every time and never hold a formula by accident."""

from __future__ import annotations

import contextlib
import datetime as dt
import math
import re
from typing import TYPE_CHECKING, Any

import rftfit
from rftfit.store import atomic_path

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from xlsxwriter.format import Format  # type: ignore[import-untyped]
    from xlsxwriter.workbook import Workbook  # type: ignore[import-untyped]
    from xlsxwriter.worksheet import Worksheet  # type: ignore[import-untyped]

# the file's own date; a real one would make every file differ
_CREATED = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)

_FORMATS: dict[str, dict[str, Any]] = {
    "title": {"bold": True, "font_size": 12},
    "block": {"bold": True},
    "head": {"bold": True, "bottom": 1, "align": "right"},
    "side": {"bold": True, "align": "right"},
    "angle": {"bold": True, "bottom": 1, "num_format": "0.##"},
    "angle_side": {"bold": True, "num_format": "0.##"},
    "number": {"num_format": "0.0000"},
    "grey": {"num_format": "0.0000", "font_color": "#9A9A9A", "italic": True},
    "missing": {"font_color": "#C00000", "align": "right"},
    "text": {},
}


class Book:
    """An open workbook and its formats.

    Parameters
    ----------
    workbook : xlsxwriter.workbook.Workbook
    """

    def __init__(self, workbook: Workbook) -> None:
        self.workbook = workbook
        self.formats: dict[str, Format] = {
            name: workbook.add_format(how) for name, how in _FORMATS.items()
        }
        self._names: set[str] = set()

    def sheet(self, name: str) -> Worksheet:
        """Add a sheet under a name that spreadsheet programs accept.

        Parameters
        ----------
        name : str
            Cut to 31 characters and freed from brackets, colons, slashes and the like; numbered if taken.

        Returns
        -------
        xlsxwriter.worksheet.Worksheet
        """
        clean = re.sub(r"[\[\]:*?/\\]", "_", name).strip("'")[:31] or "sheet"
        unique, count = clean, 1
        # the name "history" is kept by spreadsheet programs for themselves
        while unique.casefold() in self._names | {"history"}:
            count += 1
            unique = f"{clean[: 30 - len(str(count))]}_{count}"
        self._names.add(unique.casefold())
        return self.workbook.add_worksheet(unique)

    def text(self, sheet: Worksheet, row: int, column: int, text: str, form: str = "text") -> None:
        """Write text as text, whatever it begins with.

        Parameters
        ----------
        sheet : xlsxwriter.worksheet.Worksheet
        row, column : int
        text : str
        form : str
            Name of a format.
        """
        # write() would take "=..." for a formula and "http..." for a link
        sheet.write_string(row, column, text, self.formats[form])

    def value(
        self,
        sheet: Worksheet,
        row: int,
        column: int,
        value: float,
        form: str = "number",
        missing: tuple[str, str] = ("no value", ""),
    ) -> None:
        """Write a number in full precision, or, for NaN, a word with its reason as a comment.

        Parameters
        ----------
        sheet : xlsxwriter.worksheet.Worksheet
        row, column : int
        value : float
        form : str
            Name of a format.
        missing : (str, str)
            Word and reason for NaN; no comment if the reason is empty.
        """
        if math.isfinite(value):
            sheet.write_number(row, column, value, self.formats[form])
            return
        self.text(sheet, row, column, missing[0], "missing")
        if missing[1]:
            sheet.write_comment(row, column, missing[1], {"x_scale": 2, "author": "rftfit"})

    def about(self, title: str, lines: list[str]) -> None:
        """Add the first sheet: what this is, and which version of the program made it.

        Parameters
        ----------
        title : str
        lines : list of str
        """
        sheet = self.sheet("About")
        sheet.set_column(0, 0, 110)
        self.text(sheet, 0, 0, title, "title")
        made = f"Made by rftfit {rftfit.__version__}."
        for row, line in enumerate([made, *lines], start=2):
            self.text(sheet, row, 0, line)


@contextlib.contextmanager
def new_book(target: str | Path) -> Iterator[Book]:
    """Open a workbook that appears at `target` when the block ends without an error.

    Parameters
    ----------
    target : str or Path

    Yields
    ------
    Book

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    import xlsxwriter  # type: ignore[import-untyped]
    from xlsxwriter.exceptions import FileCreateError  # type: ignore[import-untyped]

    options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False}
    with atomic_path(target) as path:
        workbook = xlsxwriter.Workbook(str(path), options)
        workbook.set_properties({"created": _CREATED, "author": "rftfit"})
        yield Book(workbook)
        try:
            workbook.close()
        except FileCreateError as error:
            # so that the caller sees the one error of all failed writing
            raise OSError(str(error)) from error
