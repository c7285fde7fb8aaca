"""How the page prints numbers, names and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from rftfit.figures.labels import format_interval, percent
from rftfit.figures.style import format_number


def share(x: float | None) -> str:
    """Print a ratio as a percentage."""
    return percent(None if x is None else 100 * x)


# A table is a list of columns, each with its heading and how it prints a row, and the rows. The
# template prints them all alike.

Row = Mapping[str, Any]


class Note(NamedTuple):
    """Small print that leads somewhere by a click."""

    text: str
    link: str


@dataclass(frozen=True)
class Cell:
    """What stands in one place of a table.

    `notes`: Small print below; empty ones are left out.
    `css_classes`: Classes of the style sheet. `link`: Where a click leads.
    """

    text: str
    notes: Sequence[str | Note] = ()
    css_classes: str = ""
    link: str = ""


@dataclass(frozen=True)
class PageColumn:
    """One column.

    `heading`: With its unit.
    `cell`: What it shows of a row.
    `css_classes`: Classes of the style sheet: ``num`` for numbers, ``why`` for reasons.
    """

    heading: str
    cell: Callable[[Row], Cell]
    css_classes: str = ""


@dataclass(frozen=True)
class PageTable:
    """One table of the page; the first column names the row, which becomes a card on a narrow screen.

    `label`: For those who hear the page.
    `tall`: Whether it scrolls within its own frame.
    """

    label: str
    columns: Sequence[PageColumn]
    rows: Sequence[Row]
    tall: bool = False


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows of a table of the results."""
    return [{str(name): cell for name, cell in row.items()} for row in table.to_dict("records")]


def texts(
    heading: str, name: str | Callable[[Row], str], note: str = "", css_classes: str = ""
) -> PageColumn:
    """Column of text: a column of the results, or what a function makes of a row; `note` is printed small."""

    def cell(row: Row) -> Cell:
        text = name(row) if callable(name) else row[name]
        # what is marked up stays so
        return Cell(text if isinstance(text, str) else str(text), _note(row, note))

    return PageColumn(heading, cell, css_classes)


Show = Callable[[float | None], str]


def numbers(
    heading: str,
    name: str,
    digits: int = 4,
    ends: str = "",
    note: str = "",
    show: Show | None = None,
    ends_of_model: str = "",
) -> PageColumn:
    """Column of numbers: a column of the results, with its interval.

    `ends`: Columns of the results with the ends of the interval, braces in place of ``lo`` and ``hi``.
    `note`: Another that is printed small. `show`: Prints the number, instead of `digits` after the
    point. `ends_of_model`: As `ends`, of the interval with the model's own error.
    """

    def cell(row: Row) -> Cell:
        text = show(row.get(name)) if show else format_number(row.get(name), digits)
        lo, hi = (row.get(ends.format(end)) if ends else None for end in ("lo", "hi"))
        of_model = span_of_model(row, ends_of_model, digits) if ends_of_model else ""
        return Cell(text, (format_interval(lo, hi, digits), of_model, *_note(row, note)))

    return PageColumn(heading, cell, "num")


def span_of_model(row: Row, ends: str, digits: int) -> str:
    """Small print of an interval with the model's own error; `ends` as of `numbers`."""
    lo, hi = (row.get(ends.format(end)) for end in ("lo", "hi"))
    interval_text = format_interval(lo, hi, digits)
    return f"model {interval_text}" if interval_text else ""


def _note(row: Row, name: str) -> tuple[str, ...]:
    return (str(row[name]),) if name else ()
