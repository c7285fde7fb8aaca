"""Any delimited text, described in a few lines of the config, and what an unknown text looks like."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from rftfit.campaign.config import TextFormat
from rftfit.logs.base import HEAD_BYTES
from rftfit.logs.stamps import ORDERS, PERIOD_S, RestartingClock, is_stamp, note_of, order_of
from rftfit.logs.text import (
    NO_VALUE,
    Kind,
    Layout,
    Line,
    Plan,
    TextReader,
    cells_of,
    decoded,
    each_line,
    lines_of,
    plain_minus,
    text_head,
    utf16_of,
)
from rftfit.logs.units import is_units_row, names_and_units

DELIMITER_WORDS = {"\t": "tab", " ": "blank", "|": "bar"}
"""How the config names them."""

_DELIMITERS = {word: character for character, word in DELIMITER_WORDS.items()}
_SPACED = r"\d{1,3}([ '\u2019\u00a0\u202f\u2009]\d{3})+"
"""Thousands by blanks or apostrophes; by the other mark they need the decimal one, too."""
_NUMBERS = {
    point: re.compile(
        rf"[+-]?(\d+[{point}]?\d*|\d{{1,3}}([{group}]\d{{3}})+[{point}]\d*|{_SPACED}([{point}]\d*)?|[{point}]\d+)"
        r"([eE][+-]?\d+)?"
    )
    for point, group in (".,", ",.")
}
_HEAD_LINES = 200
KIND_LINES = 40
_DEFAULTS = {"decimal": ".", "skip_lines": 0, "names": True, "units": False}


class DelimitedReader(TextReader):
    """Text as the section `text` of the config describes it; it claims no file by itself."""

    name = "delimited"
    description = "any delimited text, described by `text` in the config"
    evidence = "the section `text` of the config"

    def __init__(self, text: TextFormat | None = None) -> None:
        self._format = text

    def plan(self, head: bytes) -> Plan:
        """Find the header rows where the description says they are."""
        text = self._format
        if text is None:
            raise ValueError("the dialect delimited needs `text` in the config: the format")
        delimiter = _DELIMITERS.get(text.delimiter, text.delimiter)
        every = each_line(head, text.encoding)
        skipped = list(islice(every, text.skip_lines))
        lines = [*islice((one for one in every if _counts(one, text.comment)), KIND_LINES + 2)]
        start = skipped[-1].stop if skipped else 0
        where = f"names below the first {text.skip_lines} lines (skip_lines)"
        header: list[list[str]] = []
        below_names = "units below the row of names (units: true)"
        for wanted, what in ((text.names, where), (text.units, below_names)):
            if wanted and not (lines and lines[0].whole):
                raise ValueError(f"no row of {what}")
            start = lines[0].stop if wanted else start
            header.append(_cells(lines.pop(0), delimiter) if wanted else [])
        given, below = header
        rows = [_cells(line, delimiter) for line in lines[:KIND_LINES] if line.whole]
        given = without_mark(given, rows)
        width = _width(rows, len(given), len(given) - bool(given and not given[-1].strip()))
        names, units = names_and_units([*given, *[""] * (width - len(given))][:width], below)
        rate = text.rate_Hz

        def further() -> Iterator[list[str]]:
            for line in each_line(head[lines[-1].stop :] if lines else b"", text.encoding):
                if line.whole and _counts(line, text.comment):
                    yield _cells(line, delimiter)

        seen = looked_at(rows, names, text.decimal, ORDERS.get(text.dates, ""), further)
        notes = [f"time is the row number / {rate:g} Hz (the config)"] if rate else []
        clocks: dict[str, RestartingClock] = {}
        for name, stamp in seen.stamps.items():
            found = note_of(stamp, seen.dates)
            notes += [found.replace("time", name, 1)] if found else []
            if found in PERIOD_S:
                clocks[name] = RestartingClock(PERIOD_S[found])
        stated = dict(zip(names, units, strict=True)) | dict.fromkeys(seen.stamps, "s")

        def derive(columns: dict[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
            for name in clocks.keys() & columns:
                columns[name] = clocks[name].follow(columns[name])
            return {**columns, "time": index / rate} if rate else columns

        layout = Layout(names, seen.kinds, delimiter, text.decimal, delimiter != " ", text.comment)
        layout = replace(layout, dates=seen.dates, no_value=NO_VALUE, mixed=seen.mixed)
        if rate:
            seen.unread.pop("time", None)
        derived = derive if rate or clocks else None
        return Plan(layout, stated, start, derived, notes=tuple(notes), unread=seen.unread)


def _counts(line: Line, comment: str) -> bool:
    text = line.text.strip()
    return bool(text) and not (comment and text.startswith(comment))


def _cells(line: Line, delimiter: str) -> list[str]:
    return cells_of(line.text, delimiter) or line.text.split(delimiter)


def _width(rows: Sequence[list[str]], most: int, least: int) -> int:
    """Cells of a row: as many as there are names, but for a delimiter at the end of either."""
    if not rows:
        return max(most, 1)
    widths = [len(cells) for cells in rows]
    usual = _most_frequent(widths)
    if not most or usual == most or most in widths:
        return most or usual
    blank = all(not cells[-1].strip() for cells in rows if len(cells) == most + 1)
    if usual == least or (usual == most + 1 and blank):
        return usual
    raise ValueError(f"{most} names, but {usual} cells in most rows")


def _most_frequent(widths: Sequence[int]) -> int:
    return max(set(widths), key=lambda number: (widths.count(number), number))


_OFTEN = 10
"""A column with NaN in one of so many of the first rows is one with rows that have no value."""


class Seen(NamedTuple):
    """What the first rows show of the columns.

    `stamps`: Columns of times as text, and the first of them. `dates`: Their order. `unread`: Columns
    that hold neither numbers nor times, with their first cell and why they are not read. `mixed`: Places
    of columns of numbers in which words or no values at all were seen.
    """

    kinds: tuple[Kind, ...]
    stamps: dict[str, str]
    dates: str
    unread: dict[str, str]
    mixed: frozenset[int] = frozenset()


def looked_at(
    rows: Iterable[Sequence[str]],
    names: Sequence[str],
    decimal: str = ".",
    dates: str = "",
    further: Callable[[], Iterable[Sequence[str]]] = tuple,
) -> Seen:
    """Tell which columns hold numbers, or times as text, by their cells that have a value.

    A column with words is one of numbers if any cell is a number: its words are no values. `further`
    gives the rows below, which are looked at for the columns without a number in the first ones.
    """
    table = _of_width(rows, len(names))
    columns = [*zip(*table, strict=True)] or [()] * len(names)
    plain = _NUMBERS[decimal].fullmatch
    numbers = [sum(bool(plain(plain_minus(cell))) for cell in column) for column in columns]
    without = {
        place
        for place, column in enumerate(columns)
        if not numbers[place] and not any(map(is_stamp, column))
    }
    if without and len(without) < len(names):
        below = [*zip(*_of_width(further(), len(names)), strict=True)]
        for place in without if below else ():
            columns[place] = (*columns[place], *below[place])
            numbers[place] = sum(bool(plain(plain_minus(cell))) for cell in below[place])
    kinds: list[Kind] = []
    first_stamps: dict[str, str] = {}
    unread: dict[str, str] = {}
    mixed: set[int] = set()
    for place, (name, column) in enumerate(zip(names, columns, strict=True)):
        filled = [cell for cell in column if cell not in NO_VALUE]
        stamps = list(filter(is_stamp, filled))
        timed = len(stamps) * 2 > len(filled)
        if not column or numbers[place] * 2 > len(filled) or (numbers[place] and not timed):
            kinds.append("number")
            if not column:
                continue
            without_number = sum(cell.casefold() == "nan" for cell in filled)
            if numbers[place] * 2 <= len(filled) or without_number * _OFTEN >= len(column):
                mixed.add(place)
            continue
        if not filled and not name.startswith("column "):
            # they may begin below
            kinds.append("number")
            mixed.add(place)
            continue
        order = dates or order_of(stamps)
        if timed and order:
            kinds.append("stamp")
            first_stamps[name], dates = stamps[0], order
            continue
        kinds.append("skip")
        why = "day or month first? `dates` says it" if timed else "no number and no time"
        if filled:
            unread[name] = f"{filled[0]!r} ({why})"
    if any(kind == "number" and place not in mixed for place, kind in enumerate(kinds)):
        return Seen(tuple(kinds), first_stamps, dates, unread, frozenset(mixed))
    # where no column holds numbers, none is left out: each row then says what is wrong with it
    return Seen(tuple[Kind, ...](["number"] * len(names)), {}, "", {})


def _of_width(rows: Iterable[Sequence[str]], width: int) -> list[list[str]]:
    """Cells without the blanks around them, of the rows that have one for each column."""
    return [[cell.strip() for cell in cells] for cells in rows if len(cells) == width]


_MARK = re.compile(r"\s*(#+|%+|//+)\s*")
"""What stands before a line of comment: `#` of gnuplot, NumPy and LAMMPS, `%` of MATLAB and TeX."""


def without_mark(names: list[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Take the mark of a comment off a row of names; a column may be called ``#`` all the same."""
    mark = _MARK.match(names[0]) if names else None
    if mark is None:
        return names
    rest = names[0][mark.end() :].strip()
    if rest:
        return [rest, *names[1:]]
    widths = [len(cells) for cells in rows]
    return names if not widths or _most_frequent(widths) >= len(names) else names[1:]


# --- What an unknown text looks like


def preview(head: bytes) -> dict[str, Any] | None:
    """Find out how a text file seems to be written: the keys of `text` in the config, but for defaults.

    None where no way of reading gives at least two rows of at least two cells, of which at least half
    are numbers.
    """
    lines = [line for line in lines_of(text_head(head), _HEAD_LINES) if line.whole]
    marks = [(d, m) for d in (",", ";", "\t", "|", " ") for m in (".", ",") if d != m]
    found = [scored for mark in marks if (scored := _try(lines, *mark)) is not None]
    if not found:
        return None
    _, text = max(found, key=lambda scored: scored[0])
    return {key: value for key, value in text.items() if _DEFAULTS.get(key) != value}


def _try(
    lines: Sequence[Line], delimiter: str, decimal: str
) -> tuple[float, dict[str, Any]] | None:
    """Read the lines in one way; the score tells how well that goes."""
    table = [cells_of(line.text, delimiter) or [] for line in lines]
    shares = [_share(cells, decimal) for cells in table]
    widths = [len(cells) for cells, share in zip(table, shares, strict=True) if share >= 0.5]
    if not widths:
        return None
    width = _most_frequent(widths)
    good = [
        place
        for place, (cells, share) in enumerate(zip(table, shares, strict=True))
        if len(cells) == width and share >= 0.5
    ]
    # settings in the header may look like a row: the data begin where rows follow one another
    first = next((p for p in good if p + 1 in set(good) or p == len(table) - 1), good[0])
    rows = [place for place in good if place >= first]
    if width < 2 or len(rows) < 2:
        return None
    above = [place for place in range(first) if any(cell.strip() for cell in table[place])]
    units = bool(above) and is_units_row(table[above[-1]], width)
    names_at = above[-2:-1] if units else above[-1:]
    names = bool(names_at) and _is_names(table[names_at[0]], width, decimal)
    text = {
        "delimiter": DELIMITER_WORDS.get(delimiter, delimiter),
        "decimal": decimal,
        "skip_lines": names_at[0] if names else first,
        "names": names,
        "units": units and names,
    }
    score = sum(shares[place] for place in rows) / (len(table) - first) + 0.01 * min(width, 20)
    return score, text


def _share(cells: Sequence[str], decimal: str) -> float:
    """Share of the cells that are numbers or times."""
    plain = [cell.strip() for cell in cells]
    if len(plain) > 1 and not plain[-1]:  # a delimiter at the end of a line
        plain.pop()
    numbers = sum(bool(_NUMBERS[decimal].fullmatch(cell)) or is_stamp(cell) for cell in plain)
    return numbers / len(plain) if len(cells) > 1 else 0.0


def _is_names(cells: Sequence[str], width: int, decimal: str) -> bool:
    filled = [cell for cell in cells if cell.strip()]
    return bool(filled) and abs(len(cells) - width) <= 1 and _share([*filled, ""], decimal) < 0.5


def encoding_of(head: bytes) -> str:
    """Name the encoding of a file, for people; ``binary`` for what is no text."""
    if utf16_of(head):
        return "UTF-16"
    if head and not text_head(head):
        return "binary"
    if head.startswith(codecs.BOM_UTF8):
        return "UTF-8 with a byte order mark"
    if head.isascii():
        return "ASCII"
    try:
        # a head that is not the whole file may end within a character
        codecs.getincrementaldecoder("utf-8")().decode(head, final=len(head) < HEAD_BYTES)
    except UnicodeDecodeError:
        return "8 bits a character, not UTF-8; read as Windows-1252"
    return "UTF-8"


def first_lines(head: bytes, most: int = 5) -> list[str]:
    """Return the first lines of a file, to be shown; each cut to 100 characters."""
    text = text_head(head)
    if not text:
        return [repr(decoded(head[:60]))]
    return [line.text[:100] for line in lines_of(text, most)]
