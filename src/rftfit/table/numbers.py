"""Numbers as the cells of a table spell them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
"""A number with a decimal point."""
NO_VALUE = ("", " ", "-", "--", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")
"""Texts that stand for no value in the tables of other programs."""
_MINUS_SIGNS = "\u2212\u2013\ufe63\uff0d"
MINUS = re.compile(rb"(?:%b)(?=[\d.,])" % "|".join(_MINUS_SIGNS).encode())
"""A minus of typesetting in UTF-8: mathematical sign, dash, small or wide sign."""

_ODD_NUMBER = re.compile(
    r"""(?:="(?P<text>[^"]*)" | (?P<behind>\d[\d.,]*)- | \((?P<inside>\d[\d.,]*)\)
    | (?P<mantissa>[+-]?\d[\d.,]*)[dD](?P<exponent>[+-]?\d{1,3}))""",
    re.VERBOSE,
)
"""Odd spellings of a number: ="007" of Excel, 12- with the minus behind, (12) of accountants, 1.2D3 of Fortran."""
_MAY_BE_ODD = re.compile(r'[-)"]$|[dD]')
"""Fast test that rules out most cells."""


def plain_number(cell: str) -> str:
    """Return a number as programs spell it: minus in front, exponent behind an E; other cells come back unchanged."""
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
"""Mark between thousands, to the pattern of a number that has it: 1,442 or 1,442.21."""
NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
"""A number with one comma."""
_WITH_UNIT = re.compile(r"(?P<number>.*\d[.,)-]?)\s*(?P<unit>[^\W\d_].*|[°%].*)")


def number_of(cell: str, decimal: str = ".") -> float:
    """Read a number in any spelling; NaN where the cell holds none, or a mark that may be decimal or between thousands.

    `decimal`: Decimal mark of the table, a point or a comma; the other one may stand between thousands.
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


def cut_unit(cell: str) -> tuple[str, str]:
    """Split ``12.3 N`` into the number and a text that may be its unit; the text is empty where there is none."""
    parts = _WITH_UNIT.fullmatch(cell)
    return (parts["number"], parts["unit"]) if parts else (cell, "")


def has_decimal_commas(cells: Iterable[str]) -> bool:
    """Return whether numbers of a table have decimal commas: none has a point, and a comma cannot mark thousands."""
    cells = [*cells]
    if not any("," in cell for cell in cells):
        return False
    numbers = [plain for cell in cells if (plain := plain_number(cell))[-1:].isdigit()]
    commas = [number for number in numbers if COMMA.fullmatch(number)]
    may_be_thousands = all(map(IN_THOUSANDS[","].fullmatch, commas))
    points = (number for number in numbers if "." in number and PLAIN_NUMBER.fullmatch(number))
    return bool(commas) and not may_be_thousands and not any(points)
