"""Numbers as cells of a table spell them: odd spellings, decimal commas, separators of thousands, a unit behind.

Whole columns of logs are read by `rftfit.table.parse`, which uses the patterns of this module; `number_of` reads one
cell, as of a run sheet.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
"""A number with a decimal point or without: 12, -1.5, .5, 1e-3."""
NO_VALUE = ("", " ", "-", "--", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")
"""Texts that stand for no value in the tables of other programs."""
_MINUS_SIGNS = "\u2212\u2013\ufe63\uff0d"
MINUS = re.compile(rb"(?:%b)(?=[\d.,])" % "|".join(_MINUS_SIGNS).encode())
"""A minus of typesetting in UTF-8 before a number: mathematical sign, dash, small or wide sign."""

_ODD_NUMBER = re.compile(
    r"""(?:="(?P<text>[^"]*)" | (?P<behind>\d[\d.,]*)- | \((?P<inside>\d[\d.,]*)\)
    | (?P<mantissa>[+-]?\d[\d.,]*)[dD](?P<exponent>[+-]?\d{1,3}))""",
    re.VERBOSE,
)
"""Odd spellings of a number, a group for each: ="007" of Excel, whose `text` is in quotes; 12- with the minus `behind`;
(12) of accountants, which means -12; 1.2D3 of Fortran."""
_MAY_BE_ODD = re.compile(r'[-)"]$|[dD]')
"""Fast test that rules out most cells: the end of the first three spellings, or the D of the last."""


def plain_number(cell: str) -> str:
    """Return a number as programs spell it: minus in front, exponent behind an E; other cells come back unchanged.

    Decimal marks and separators of thousands stay as they are.
    """
    if not cell.isascii():
        cell = MINUS.sub(b"-", cell.encode()).decode()
    if not _MAY_BE_ODD.search(cell) or not (odd := _ODD_NUMBER.fullmatch(cell)):
        return cell
    if odd["text"] is not None:
        return odd["text"]
    if odd["mantissa"]:
        return f"{odd['mantissa']}E{odd['exponent']}"
    return f"-{odd['behind'] or odd['inside']}"


IN_THOUSANDS = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:\{mark}\d{{3}})+(?:[.,]\d*)?") for mark in ",."
}
"""Comma or point between thousands, to the pattern of a number that has it: 1,442 or 1,442.21."""
NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
"""A number that programs write, but that cannot be used."""


def number_of(cell: str, decimal: str = ".") -> float:
    """Read a number in any spelling; NaN where the cell holds none, or one that may be read in two ways.

    `decimal`: Decimal mark of the table, a point or a comma. The other mark is taken out as a separator of thousands
    only where both stand in the number: 1,442.21 is clear, but 1,442 may be 1442 or 1.442.
    """
    plain = plain_number(cell.strip())
    separator = "," if decimal == "." else "."
    if separator in plain and decimal in plain and IN_THOUSANDS[separator].fullmatch(plain):
        plain = plain.replace(separator, "")
    if decimal == "," and "." not in plain:
        plain = plain.replace(",", ".")
    # float() would also accept 1_0 as 10, and digits of every script
    is_number = plain.isascii() and (PLAIN_NUMBER.fullmatch(plain) or NOT_FINITE.fullmatch(plain))
    return float(plain) if is_number else math.nan


_WITH_UNIT = re.compile(r"(?P<number>.*\d[.,)-]?)\s*(?P<unit>[^\W\d_].*|[°%].*)")
"""A cell up to its last digit, and behind this a text that begins with a letter, ° or %."""


def cut_unit(cell: str) -> tuple[str, str]:
    """Split ``12.3 N`` into its number and a text that may be a unit, ("12.3", "N"); the text is empty without one."""
    parts = _WITH_UNIT.fullmatch(cell)
    return (parts["number"], parts["unit"]) if parts else (cell, "")


COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
"""A number with one comma."""


def has_decimal_commas(cells: Iterable[str]) -> bool:
    """Return whether the cells of a table have decimal commas: no number has a point, and no comma marks thousands.

    False where each number with a comma fits the pattern of thousands, as 1,442 does.
    """
    cells = [*cells]
    if not any("," in cell for cell in cells):
        return False
    # a number ends with a digit
    numbers = [plain for plain in map(plain_number, cells) if plain[-1:].isdigit()]
    commas = [number for number in numbers if COMMA.fullmatch(number)]
    may_be_thousands = all(map(IN_THOUSANDS[","].fullmatch, commas))
    points = (number for number in numbers if "." in number and PLAIN_NUMBER.fullmatch(number))
    return bool(commas) and not may_be_thousands and not any(points)
