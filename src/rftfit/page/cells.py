"""Cells, columns and tables of the page, and how they print numbers and names.

A `PageTable` is a list of columns and a list of rows; a row is a dict, mostly a row of a table of results, and each
column has a heading and a function that makes its cell of a row. One macro of the template prints all tables. `texts`
and `numbers` make the usual columns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from rftfit.figures.labels import format_interval, percent
from rftfit.figures.style import format_number

ALPHA_DIGITS = 4
"""Digits after the point of alpha, zeta and chi in the tables of the page."""


def share(ratio: float | None) -> str:
    """Write a ratio as a percentage with its sign, 0.12 as "+12 %"; "no value" for None or NaN."""
    return percent(None if ratio is None else 100 * ratio)


Row = Mapping[str, Any]
"""Row of a table: column of the results, or another name, to its content."""


class Note(NamedTuple):
    """Small print of a cell that leads to another place of the page; `link`: its address, such as ``#legs``."""

    text: str
    link: str


@dataclass(frozen=True)
class Cell:
    """The content of one cell of a table. Texts are escaped by the template, unless they are `markupsafe.Markup`.

    `notes`: Small print below the text; empty ones are not printed.
    `css_classes`: Classes of the style sheet, with spaces between. `link`: Address to which a click leads; empty: none.
    """

    text: str
    notes: Sequence[str | Note] = ()
    css_classes: str = ""
    link: str = ""


@dataclass(frozen=True)
class PageColumn:
    """One column of a table.

    `heading`: Heading, with the unit.
    `cell`: Function that makes the cell of a row.
    `css_classes`: Classes of the style sheet: ``num`` for numbers, ``why`` for reasons.
    """

    heading: str
    cell: Callable[[Row], Cell]
    css_classes: str = ""


@dataclass(frozen=True)
class PageTable:
    """One table of the page; the first column names the row, which becomes a card on a narrow screen.

    `label`: Name of the table for screen readers.
    `tall`: True for a long table, which scrolls within a frame.
    """

    label: str
    columns: Sequence[PageColumn]
    rows: Sequence[Row]
    tall: bool = False


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table of results as dicts, which may be changed."""
    rows: Any = table.to_dict("records")
    return list(rows)


def texts(
    heading: str, name: str | Callable[[Row], str], note: str = "", css_classes: str = ""
) -> PageColumn:
    """Make a column of text.

    `name`: Column of the results, or function of a row that returns the text. `note`: Another column of the results,
    printed small below; empty: none. `css_classes`: As of `PageColumn`.
    """

    def cell(row: Row) -> Cell:
        content = name(row) if callable(name) else row[name]
        # str() would lose that a text is Markup, which must not be escaped
        return Cell(content if isinstance(content, str) else str(content), _notes_of(row, note))

    return PageColumn(heading, cell, css_classes)


def numbers(
    heading: str,
    name: str,
    digits: int = ALPHA_DIGITS,
    ends: str = "",
    note: str = "",
    show: Callable[[float | None], str] | None = None,
    ends_of_model: str = "",
) -> PageColumn:
    """Make a column of numbers with their intervals in small print.

    `name`: Column of the results; "no value" where it is missing or NaN. `digits`: After the point. `ends`: Names of
    the columns with the ends of the interval, braces in place of ``lo`` and ``hi``, such as ``zeta_{}``; empty: no
    interval. `note`: Another column, printed small below. `show`: Function that prints the number; default: with
    `digits`. `ends_of_model`: As `ends`, for the interval with the model's own error.
    """

    def cell(row: Row) -> Cell:
        number = show(row.get(name)) if show else format_number(row.get(name), digits)
        interval = _format_interval_of(row, ends, digits)
        model_interval = _format_interval_of(row, ends_of_model, digits)
        wider = f"model {model_interval}" if model_interval else ""
        return Cell(number, (interval, wider, *_notes_of(row, note)))

    return PageColumn(heading, cell, "num")


def _format_interval_of(row: Row, ends: str, digits: int) -> str:
    """Write an interval of a row; empty where it has none, or where `ends`, as for `numbers`, names no columns."""
    low, high = (row.get(ends.format(end)) for end in ("lo", "hi"))
    return format_interval(low, high, digits)


def _notes_of(row: Row, name: str) -> tuple[str, ...]:
    """Return the notes of a cell: the text of the column `name`, or no note where it is empty."""
    return (str(row[name]),) if name else ()
