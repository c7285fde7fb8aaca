"""The run sheet as a plain table of text cells, from csv or tsv; workbooks are in `workbook`."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rftfit.campaign.columns import BY_NAME
from rftfit.campaign.files import decode, read_bytes
from rftfit.campaign.problems import Problem

if TYPE_CHECKING:
    from pathlib import Path

MAX_BYTES = 50_000_000
MAX_ROWS = 200_000

_WORKBOOK = b"PK\x03\x04"
_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0"
_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}


@dataclass(frozen=True, slots=True)
class Odd:
    """A cell of a workbook that is not what it looks like.

    Attributes
    ----------
    code : str
        Of the problem to be made of it.
    found, allowed : str
        For that problem.
    """

    code: str
    found: str
    allowed: str


@dataclass
class Table:
    """Header and rows as text.

    Attributes
    ----------
    header : list of str
    rows : list of (int, list of str)
        Row number as a spreadsheet counts, and its cells; blank rows are left out.
    odd : dict
        Cells that need a second look, by row number and position.
    header_row : int
    """

    header: list[str] = field(default_factory=list)
    rows: list[tuple[int, list[str]]] = field(default_factory=list)
    odd: dict[tuple[int, int], Odd] = field(default_factory=dict)
    header_row: int = 1

    def add(self, row: int, cells: list[str]) -> None:
        """Take in one row; the first that is not blank is the header.

        Parameters
        ----------
        row : int
            As a spreadsheet numbers it.
        cells : list of str
            Without the spaces around them; a row of empty cells is left out.
        """
        if not any(cells):
            return
        if self.header:
            self.rows.append((row, cells))
        else:
            self.header, self.header_row = cells, row


def too_many_rows(file: str) -> Problem:
    """Make the problem of a sheet that goes on for ever.

    Parameters
    ----------
    file : str
        Name of the sheet.

    Returns
    -------
    Problem
        At the last row that is read.
    """
    allowed = f"at most {MAX_ROWS} rows are read; delete the empty rows below the last run"
    return Problem(file, MAX_ROWS, None, None, allowed, "sheet.too-many-rows")


def read_table(path: Path, file: str) -> tuple[Table | None, list[Problem]]:
    """Read a run sheet; whether it is a workbook is seen from its content.

    Parameters
    ----------
    path : Path
    file : str
        Its name, for problems.

    Returns
    -------
    table : Table or None
        None when nothing can be read.
    problems : list of Problem
    """
    data = read_bytes(path, file, "sheet", MAX_BYTES)
    if isinstance(data, Problem):
        return None, [data]
    if data.startswith(_WORKBOOK):
        # openpyxl is slow to import, and few sheets need it
        from rftfit.campaign.workbook import read_workbook

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
