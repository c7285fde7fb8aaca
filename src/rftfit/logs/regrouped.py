"""Numbers whose digits a spreadsheet has regrouped, so that they read as other numbers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rftfit.logs.layout import cells_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.logs.layout import Layout

GROUPED = "digits regrouped in this column: 10,114 may have been 1,0114"

_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_DIGITS = bytes.maketrans(b"123456789", b"0" * 9)
_TWICE = b"0,000,000"


def regrouped(layout: Layout, bodies: Iterable[bytes]) -> frozenset[int]:
    """Find columns in which a spreadsheet has regrouped digits: two decimal commas in one number.

    Where 1,000,292 stands for 100,0292, the same column has 10,114 for 1,0114: a number like any
    other, but another one. So a single such cell casts doubt on its whole column.

    Parameters
    ----------
    layout : Layout
        With a decimal comma; otherwise there is nothing to find.
    bodies : iterable of bytes
        All lines of the file.

    Returns
    -------
    frozenset of int
        Places of columns.
    """
    found: set[int] = set()
    if layout.decimal != "," or layout.delimiter == ",":
        return frozenset()
    for body in bodies:
        if _TWICE not in body.translate(_DIGITS):
            continue
        for line in body.splitlines():
            if _TWICE in line.translate(_DIGITS):
                cells = cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or []
                found |= {p for p, c in enumerate(cells) if c.count(",") > 1 and is_grouped(c)}
    return frozenset(found)


def is_grouped(cell: str) -> bool:
    """Tell whether a number may owe its comma to regrouping.

    Parameters
    ----------
    cell : str

    Returns
    -------
    bool
    """
    return bool(_GROUPED.fullmatch(cell.strip(" \t")))
