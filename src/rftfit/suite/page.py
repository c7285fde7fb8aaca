"""The page of verdicts on the examples: its sentences, tables and figure; how a verdict is written in cells.

`describe` yields the blocks of the page, which `write_page` writes as html, and the documentation as Markdown. Verdicts are
a table with the columns of `rftfit.suite.verdicts.RowVerdict`, a row for each published number: both numbers with their
intervals, and a verdict, inside, outside or not comparable, with its reason.
"""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from rftfit.figures.style import content
from rftfit.figures.verdicts import draw_verdicts, numbers_with_unit
from rftfit.store import write_text
from rftfit.store.text import count, table
from rftfit.suite.cells import parse_cell
from rftfit.suite.declared import DOMAINS, Example, parse_key
from rftfit.suite.verdicts import FILE, INSIDE, NOT_COMPARABLE, OUTSIDE, count_verdicts

PAGE = "verdicts.html"
"""File of the page in the folder of an example."""

TITLE = "Published answers beside ours"


class PageBlock(NamedTuple):
    """A part of the page: a heading, a paragraph, a table, or, if all fields are empty, the figure.

    `text`: Of a heading or paragraph, in Markdown. `level`: Level of a heading, else 0. `header`, `rows`: Cells of a table.
    """

    text: str = ""
    level: int = 0
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()


def describe(
    examples: Sequence[Example], verdicts: pd.DataFrame, is_public: bool
) -> Iterator[PageBlock]:
    """Yield the blocks of the page, the shortest answer first.

    `verdicts`: On all `examples`. `is_public`: True for the documentation, whose page has no tables of single rows: some
    numbers may not be shown there, by their licence, and all others are in a separate file (`tabulate_compared`).
    """
    counts = count_verdicts(verdicts)
    compared = counts[INSIDE] + counts[OUTSIDE]
    yield PageBlock(TITLE, 1)
    sentences = [
        "Measured data, or logs simulated from published numbers, went through this program, and its answers are compared with the published ones.",
        f"**Of {compared} published numbers, {counts[INSIDE]} lie inside the errors and {counts[OUTSIDE]} outside.**",
    ]
    if counts[NOT_COMPARABLE]:
        sentences.append(f"{counts[NOT_COMPARABLE]} more are not compared; the reasons are below.")
    yield PageBlock(" ".join([*sentences, "Nothing that does not fit was left out."]))
    head = ("domain", "example", "compared", "inside", "outside", "not comparable")
    yield PageBlock("", 0, head, _count_by_domain(verdicts))
    yield PageBlock(
        "How wide our intervals are, over the size of the published number (median of the rows of a quantity):"
    )
    yield PageBlock(
        "", 0, ("quantity", "example", "compared", "inside", "width"), _list_widths(verdicts)
    )
    data = (
        f"{example.name}: {example.settings.title[0].lower()}{example.settings.title[1:]}"
        for example in examples
    )
    yield PageBlock(f"{'; '.join(data)}.")
    yield from _describe_reservations(examples, verdicts[verdicts["verdict"] == INSIDE])
    in_view = [
        f"{example.name} ({example.settings.in_view})"
        for example in examples
        if example.settings.in_view
    ]
    if in_view:
        yield PageBlock(
            f"No blind test, since something was chosen with the answers in view: {'; '.join(in_view)}."
        )
    yield PageBlock()
    is_judged = any(
        quantity.judged for example in examples for quantity in example.settings.quantities.values()
    )
    yield PageBlock(f"*{_describe_figure(verdicts)}*")
    tolerance = " Statements of a paper have a tolerance in place of an error: what its printed digits and words allow."
    share = counts[OUTSIDE] / max(compared, 1)
    yield PageBlock(
        "**Inside** means that the published number lies in our 95 % interval, or that the difference is less than the root of the "
        "sum of squares of our half interval on that side and of the published error, where one is stated. Outside are "
        f"{100 * share:.0f} % of the rows; 5 % would be by chance if rows were independent, which those of one rig or bed are not."
        f"{tolerance if is_judged else ''}"
    )
    yield PageBlock("What does not fit", 2)
    yield from _describe_outside(examples, verdicts[verdicts["verdict"] == OUTSIDE], is_public)
    yield PageBlock("What is not compared", 2)
    yield _describe_not_compared(verdicts[verdicts["verdict"] == NOT_COMPARABLE])
    yield PageBlock("Where the data come from", 2)
    for example in examples:
        yield from _describe_example(example)
    if is_public:
        return
    yield PageBlock("Every row that was compared", 2)
    compared_rows = tabulate_compared(examples, verdicts)
    for name, rows_of_example in compared_rows.groupby("example", sort=False):
        yield PageBlock(str(name), 3)
        cells = rows_of_example.drop(columns="example")
        yield PageBlock("", 0, tuple(map(str, cells)), cells.to_numpy().tolist())


def _count_by_domain(verdicts: pd.DataFrame) -> list[tuple[str, ...]]:
    """Return rows of cells with counts of verdicts, one for each domain and example, in the order of `DOMAINS`.

    Cells: domain, example, rows compared, then one count for each verdict. A domain is a kind of compared numbers, as legs.
    """
    rows = []
    for domain in DOMAINS:
        verdicts_of_domain = verdicts[verdicts["domain"] == domain]
        for example, group in verdicts_of_domain.groupby("example", sort=False):
            counts = count_verdicts(group)
            numbers = (counts[INSIDE] + counts[OUTSIDE], *counts.values())
            rows.append((domain, str(example), *map(str, numbers)))
    return rows


def _list_widths(verdicts: pd.DataFrame) -> list[tuple[str, ...]]:
    """Return rows of cells on the width of our intervals, one for each quantity of an example that has some.

    Cells: quantity, example, rows compared, rows inside, median width. The width is that of the whole interval in percent of
    the published number: verdicts inside by a wide interval prove little.
    """
    compared = verdicts[verdicts["verdict"].isin((INSIDE, OUTSIDE))].dropna(subset=["lo", "hi"])
    published = pd.to_numeric(compared["published"], errors="coerce").abs()
    compared = compared.assign(width=100 * (compared["hi"] - compared["lo"]) / published)
    groups = compared.groupby(["title", "example"], sort=False)
    return [
        (
            *map(str, names),
            str(len(group)),
            str(count_verdicts(group)[INSIDE]),
            f"{group['width'].median():.0f} %",
        )
        for names, group in groups
    ]


def _describe_reservations(
    examples: Sequence[Example], inside: pd.DataFrame
) -> Iterator[PageBlock]:
    """Yield a paragraph for each remark that limits what verdicts `inside` prove, with the number of its rows."""
    for code, sentence in _remark_sentences(examples).items():
        if rows := int((inside["reason_code"] == code).sum()):
            yield PageBlock(f"Inside, but with a reservation, {count(rows, 'row')}: {sentence}.")


def _remark_sentences(examples: Sequence[Example]) -> dict[str, str]:
    """Return the sentences of the examples' remarks on rows that are compared, by their code."""
    return {
        remark.code: remark.sentence
        for example in examples
        for remark in example.settings.remarks
        if remark.comparable
    }


def _describe_figure(verdicts: pd.DataFrame) -> str:
    """Describe what the figure shows, and the rows that it leaves out: it draws numbers with a unit alone."""
    numbers = numbers_with_unit(verdicts)
    across = (
        ", and the published error"
        if (numbers["published_hi"] > numbers["published_lo"]).any()
        else ""
    )
    text = (
        f"Each point: a published number (across) and ours (up). Bars: our interval{across}; a bar that crosses the dashed line holds "
        "the published number."
    )
    compared = verdicts[verdicts["verdict"] != NOT_COMPARABLE]
    left_out = compared.drop(numbers.index)
    if left_out.empty:
        return text
    outside = count_verdicts(left_out)[OUTSIDE]
    return f"{text} {len(left_out)} statements without a common unit, as counts of media, are not drawn: {outside} of them lie outside."


HEADER = ("what", "published (error or tolerance)", "ours (95 % interval)", "unit", "verdict")
"""Header of a table of verdicts: what is compared, both numbers, and the outcome."""


def _describe_outside(
    examples: Sequence[Example], outside: pd.DataFrame, is_public: bool
) -> Iterator[PageBlock]:
    """Yield the blocks on the verdicts `outside`: reasons with their number of rows; unless `is_public`, also each row."""
    if outside.empty:
        yield PageBlock("Every number that was compared lies inside.")
        return
    remarks = _remark_sentences(examples)
    not_remarked = "row by row in the table of all rows"
    reasons = [
        (str(example), str(code), str(len(group)), remarks.get(str(code), not_remarked))
        for (example, code), group in outside.groupby(["example", "reason_code"], sort=False)
    ]
    yield PageBlock("", 0, ("example", "reason", "rows", "in words"), reasons)
    if is_public:
        return
    rows = []
    for cells, code in zip(format_rows(outside), outside["reason_code"], strict=True):
        # the verdict is the same in all rows; the sentence of a remark stands in the table above
        *cells_of_numbers, _, reason = cells
        rows.append((*cells_of_numbers, code if code in remarks else f"{code}: {reason}"))
    yield PageBlock("", 0, (*HEADER[:4], "reason"), rows)


def _describe_not_compared(not_compared: pd.DataFrame) -> PageBlock:
    """Return the block on verdicts that are `NOT_COMPARABLE`: reasons with their number of rows."""
    rows = [
        (*map(str, names), str(len(group)), str(group["reason"].iloc[0]))
        for names, group in not_compared.groupby(["domain", "example", "reason_code"], sort=False)
    ]
    if not rows:
        return PageBlock("Every published number was compared.")
    return PageBlock("", 0, ("domain", "example", "reason", "rows", "in words"), rows)


def _describe_example(example: Example) -> Iterator[PageBlock]:
    """Yield the blocks on the source of an example: title, citation, licence, README and command."""
    settings = example.settings
    yield PageBlock(f"{example.name}: {settings.title}", 3)
    licences = sorted({file.licence for file in settings.files})
    licence = f"Licence: {', '.join(licences)}." if licences else ""
    yield PageBlock(" ".join(filter(None, (settings.citation, licence, settings.note))))
    yield PageBlock(example.readme)
    yield PageBlock(f"`rftfit example {example.name}`")


def tabulate_compared(examples: Sequence[Example], verdicts: pd.DataFrame) -> pd.DataFrame:
    """Return a table of all rows that were compared, as texts: the column ``example``, those of `HEADER`, and ``reason``.

    Rows are sorted by example, in the order of `examples`.
    """
    compared = verdicts[verdicts["verdict"] != NOT_COMPARABLE]
    names = [example.name for example in examples]
    compared = compared.sort_values(
        "example", key=lambda column: column.map(names.index), kind="stable"
    )
    rows = pd.DataFrame(format_rows(compared), columns=[*HEADER, "reason"])
    rows.insert(0, "example", compared["example"].to_numpy())
    return rows


def format_rows(verdicts: pd.DataFrame) -> list[tuple[str, ...]]:
    """Format verdicts as rows of cells below `HEADER`, with the reason as a further cell."""
    return [_format_cells(row) for row in verdicts.to_dict("records")]


def _format_cells(row: Mapping[Any, Any]) -> tuple[str, ...]:
    """Format one row of the verdicts as cells below `HEADER`, with the reason as a further cell; `row`: by column."""
    published = _format_number(row["published"], row["published_lo"], row["published_hi"])
    ours = _format_number(row["ours"], row["lo"], row["hi"])
    # verdicts that were read from a file have NaN in place of an empty unit
    unit = "" if pd.isna(row["unit"]) else str(row["unit"])
    return (_describe_row(row), published, ours, unit, str(row["verdict"]), str(row["reason"]))


_NAMES_ALONE = ("medium", "run_id", "rig")
"""Names in a key that are left out, since their words need no explanation."""


def _describe_row(row: Mapping[Any, Any]) -> str:
    """Describe what a row compares: the title of its quantity and the words of its key; an ``item`` in the key says it alone."""
    key = parse_key(str(row["key"]))
    item = key.pop("item", "")
    if item:
        return item
    words = ", ".join(
        word if name in _NAMES_ALONE else f"{name} {word}" for name, word in key.items()
    )
    return f"{row['title']}: {words}"


def _format_number(value: object, lo: object, hi: object) -> str:
    """Format a number with its interval from `lo` to `hi`, if it has one; a word stays as it is, and NaN is empty.

    Verdicts that were read from a file have numbers as texts.
    """
    number, low, high = (parse_cell(str(cell)) for cell in (value, lo, hi))
    if isinstance(number, str):
        return number
    if math.isnan(number):
        return ""
    # an end without a number is NaN, with which every comparison is False
    if isinstance(low, float) and isinstance(high, float) and high > low:
        return f"{_format_short(number)} ({_format_short(low)} to {_format_short(high)})"
    return _format_short(number)


def _format_short(number: float) -> str:
    """Format a number with three digits, or with all digits before the point, without an exponent."""
    if abs(number) >= 1000:
        return f"{number:.0f}"
    # -0.0 + 0.0 is 0.0
    return f"{number + 0.0:.3g}" if abs(number) >= 1e-4 or not number else f"{number:.5f}"


def describe_verdicts(example: Example, verdicts: pd.DataFrame, folder: Path) -> str:
    """Describe the verdicts on an example for a terminal: their counts, the first rows compared, and where the files are.

    `folder`: That in which the example was run.
    """
    counts = count_verdicts(verdicts)
    compared = verdicts[verdicts["verdict"] != NOT_COMPARABLE]
    rows = [cells[:-1] for cells in format_rows(compared)]
    most = 40
    lines = [
        f"{example.settings.title}: {count(len(verdicts), 'published number')}",
        ", ".join(f"{number} {verdict}" for verdict, number in counts.items()) + ".",
        table(HEADER, rows[:most]),
    ]
    if len(rows) > most:
        lines.append(f"  and {len(rows) - most} more in the page")
    if example.settings.note:
        lines.append(example.settings.note)
    return "\n".join([*lines, f"Verdicts: {folder / FILE}; page: {folder / PAGE}"])


def write_page(path: Path, examples: Sequence[Example], verdicts: pd.DataFrame) -> None:
    """Write the page to `path` as one html file that loads no other file: style and figure are in it."""
    style = files("rftfit.page").joinpath("page.css").read_text(encoding="utf-8")
    picture = base64.b64encode(content(draw_verdicts(verdicts), "png")).decode()
    parts = []
    # a block is a table, a heading, a paragraph or, if it is empty, the figure
    for block in describe(examples, verdicts, is_public=False):
        if block.header:
            head = "".join(f"<th>{escape(cell)}</th>" for cell in block.header)
            rows = ("".join(f"<td>{escape(cell)}</td>" for cell in cells) for cells in block.rows)
            body = "".join(f"<tr>{row}</tr>" for row in rows)
            parts.append(
                f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
            )
        elif block.level:
            parts.append(f"<h{block.level}>{escape(block.text)}</h{block.level}>")
        elif block.text:
            parts += [f"<p>{_format_inline(text)}</p>" for text in block.text.split("\n\n")]
        else:
            parts.append(
                '<p><img style="background:#fff;max-width:100%" alt="published numbers against ours, by quantity" '
                f'src="data:image/png;base64,{picture}"></p>'
            )
    text = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{TITLE}</title><style>{style}</style></head><body><main>{''.join(parts)}</main></body></html>\n"
    )
    write_text(path, text)


def _format_inline(text: str) -> str:
    """Turn a paragraph of Markdown into html: bold and slanted words, code and links; anything else is plain text."""
    html = escape(" ".join(text.split()), quote=False)
    html = re.sub(r"`([^`]+)`", r"<code>\1</code>", html)
    html = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", html)
    html = re.sub(r"(?<!\w)\*(.+?)\*(?!\w)", r"<em>\1</em>", html)
    return re.sub(r"\[([^\]]+)\]\((https?:[^)\s]+)\)", r'<a href="\2">\1</a>', html)
