"""Text in a csv that a spreadsheet would take for a formula, and how it is kept from that.

A spreadsheet calculates a cell that begins with one of ``= + - @`` (or their wide forms), a tab or a
line end, also when it comes from a csv in quotes; a formula can start programs and send data. Such
text gets an apostrophe in front, which spreadsheets show as text; reading takes it away again. So
that this is exact, text that already has apostrophes in front of such a sign gets one more. Numbers
stay as they are. Line ends within a text become line feeds: a lone carriage return would end the row.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

_SIGNS = "=+\\-@\t\r\n\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH PLUS SIGN}\N{FULLWIDTH HYPHEN-MINUS}\N{FULLWIDTH COMMERCIAL AT}"
_DANGEROUS = re.compile(f"'*[{_SIGNS}]")
_GUARDED = re.compile(f"'+[{_SIGNS}]")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")


def guarded(text: str) -> str:
    """Return text as it is written into a csv.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
        The same, or with an apostrophe in front.
    """
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if _DANGEROUS.match(text) and not _NUMBER.fullmatch(text):
        return f"'{text}"
    return text


def unguarded(text: str) -> str:
    """Return what was written by `guarded`.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
    """
    return text[1:] if _GUARDED.match(text) else text


def guard_table(table: pd.DataFrame) -> pd.DataFrame:
    """Guard every text of a table.

    Parameters
    ----------
    table : pandas.DataFrame

    Returns
    -------
    pandas.DataFrame
        The same object where nothing needs it.
    """
    return _mapped(table, guarded)


def unguard_table(table: pd.DataFrame) -> pd.DataFrame:
    """Take back what `guard_table` did.

    Parameters
    ----------
    table : pandas.DataFrame

    Returns
    -------
    pandas.DataFrame
        The same object where nothing needs it.
    """
    return _mapped(table, unguarded)


def _mapped(table: pd.DataFrame, change: Callable[[str], str]) -> pd.DataFrame:
    import pandas as pd

    changed: dict[str, pd.Series] = {}
    for place, name in enumerate(table.columns):
        column = table.iloc[:, place]
        if pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column):
            continue
        # few different texts stand in many rows
        texts = [value for value in column.unique() if isinstance(value, str)]
        others = {text: new for text in texts if (new := change(text)) != text}
        if others:
            values = [
                others.get(value, value) if isinstance(value, str) else value for value in column
            ]
            kind = object if isinstance(column.dtype, pd.CategoricalDtype) else column.dtype
            changed[str(name)] = pd.Series(values, table.index, dtype=kind)
    return table.assign(**changed) if changed else table
