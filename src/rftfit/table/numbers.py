"""Numbers as the cells of a table spell them."""

from __future__ import annotations

import re

PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
"""A number with a decimal point."""
NO_VALUE = ("", " ", "-", "--", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")
"""What a cell without a value holds in the tables of other programs."""
_MINUS_SIGNS = "\u2212\u2013\ufe63\uff0d"
MINUS = re.compile(rb"(?:%b)(?=[\d.,])" % "|".join(_MINUS_SIGNS).encode())
"""A minus as typesetting writes it: the mathematical sign, the dash, the small and the wide one."""


_ODD_NUMBER = re.compile(
    r"""(?:="(?P<text>[^"]*)" | (?P<behind>\d[\d.,]*)- | \((?P<inside>\d[\d.,]*)\)
    | (?P<mantissa>[+-]?\d[\d.,]*)[dD](?P<exponent>[+-]?\d{1,3}))""",
    re.VERBOSE,
)
"""A number as Excel keeps it from being changed, with the minus behind it, as accountants write it, of Fortran."""
_MAY_BE_ODD = re.compile(r'[-)"]$|[dD]')


def plain_number(cell: str) -> str:
    """Write a number as programs do: its minus in front, its exponent behind an E, nothing around it."""
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
"""A number with a mark between its thousands."""
