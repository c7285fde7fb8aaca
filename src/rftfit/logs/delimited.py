"""Any delimited text, described in a few lines of the config, and what an unknown text looks like."""

from __future__ import annotations

import codecs
import re
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rftfit.logs.base import HEAD_BYTES
from rftfit.logs.text import (
    Kind,
    Layout,
    Line,
    Plan,
    TextReader,
    cells_of,
    decoded,
    lines_of,
    readable,
)
from rftfit.logs.units import known_unit, split_unit, unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from rftfit.campaign.config import TextFormat


# --- What an unknown text file looks like: cells, decimal mark, header rows.


_NUMBERS = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
_WORDS = {"\t": "tab", " ": "blank", "|": "bar"}
_BRACKETED = re.compile(r"\s*[\[(][^\[\]()]*[\])]\s*")
_LOOKED_AT = 200
_FEWEST_ROWS = 2


@dataclass(frozen=True)
class Look:
    """How a text file seems to be written.

    `delimiter`: The character itself.
    `skip_lines`: Lines in front of the row of names, or of the data where there is none.
    `names`, `units`: Whether there is a row of names, and one of units.
    `width`: Cells in a row.
    `first`: Index of the first data line.
    """

    delimiter: str
    decimal: str
    skip_lines: int
    names: bool
    units: bool
    width: int
    first: int

    def as_format(self) -> dict[str, Any]:
        """Return it as the keys of `text` in the config that differ from their defaults."""
        found: dict[str, Any] = {
            "delimiter": _WORDS.get(self.delimiter, self.delimiter),
            "decimal": self.decimal,
            "skip_lines": self.skip_lines,
            "names": self.names,
            "units": self.units,
        }
        usual = {"decimal": ".", "skip_lines": 0, "names": True, "units": False}
        return {key: value for key, value in found.items() if usual.get(key) != value}


def encoding_of(head: bytes) -> str:
    """Name the encoding of a file, for people.

    `head`: As on the disk. Returns ``binary`` for what is no text.
    """
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "UTF-16"
    if b"\x00" in head:
        return "binary"
    if head.startswith(b"\xef\xbb\xbf"):
        return "UTF-8 with a byte order mark"
    if head.isascii():
        return "ASCII"
    try:
        # a head that is not the whole file may end within a character
        codecs.getincrementaldecoder("utf-8")().decode(head, final=len(head) < HEAD_BYTES)
    except UnicodeDecodeError:
        return "8 bits a character, not UTF-8; read as Windows-1252"
    return "UTF-8"


def look(head: bytes) -> Look | None:
    """Find out how a text file is written.

    `head`: As on the disk. Returns none where no way of reading gives at least two rows of at
    least two cells, of which at least half are numbers.
    """
    lines = [line for line in lines_of(readable(head), _LOOKED_AT) if line.whole]
    best: tuple[float, Look] | None = None
    for delimiter in (",", ";", "\t", "|", " "):
        for decimal in (".", ","):
            if decimal != delimiter:
                found = _try(lines, delimiter, decimal)
                if found and (best is None or found[0] > best[0]):
                    best = found
    return best[1] if best else None


def _try(lines: Sequence[Line], delimiter: str, decimal: str) -> tuple[float, Look] | None:
    table = [cells_of(line.text, delimiter, quote=delimiter != " ") or [] for line in lines]
    shares = [_share(cells, decimal) for cells in table]
    widths = [len(cells) for cells, share in zip(table, shares, strict=True) if share >= 0.5]
    if not widths:
        return None
    width = max(set(widths), key=lambda number: (widths.count(number), number))
    good = [
        place
        for place, (cells, share) in enumerate(zip(table, shares, strict=True))
        if len(cells) == width and share >= 0.5
    ]
    # settings in the header may look like a row: the data begin where rows follow one another
    first = next((p for p in good if p + 1 in set(good) or p == len(table) - 1), good[0])
    rows = [place for place in good if place >= first]
    if width < 2 or len(rows) < _FEWEST_ROWS:
        return None
    above = [place for place in range(first) if any(cell.strip() for cell in table[place])]
    units = bool(above) and is_units_row(table[above[-1]], width)
    names_at = above[-2:-1] if units else above[-1:]
    names = bool(names_at) and _is_names(table[names_at[0]], width, decimal)
    if units and not names:
        units = False
    skip = names_at[0] if names else first
    score = sum(shares[place] for place in rows) / (len(table) - first) + 0.01 * min(width, 20)
    return score, Look(delimiter, decimal, skip, names, units, width, first)


def _share(cells: Sequence[str], decimal: str) -> float:
    """Share of the cells that are numbers."""
    numbers = sum(bool(_NUMBERS[decimal].fullmatch(cell.strip())) for cell in cells)
    return numbers / len(cells) if len(cells) > 1 else 0.0


def _is_names(cells: Sequence[str], width: int, decimal: str) -> bool:
    filled = [cell for cell in cells if cell.strip()]
    return bool(filled) and abs(len(cells) - width) <= 1 and _share([*filled, ""], decimal) < 0.5


def is_units_row(cells: Sequence[str], width: int) -> bool:
    """Tell whether a row holds units: each in brackets, or each one that is known.

    `width`: Cells in a row of data.
    """
    filled = [cell for cell in cells if cell.strip()]
    if not filled or not width - 1 <= len(cells) <= width + 1:
        return False
    return all(_BRACKETED.fullmatch(cell) for cell in filled) or (
        all(known_unit(cell) for cell in filled) and len(filled) * 2 > width
    )


def kinds_of(head: bytes, start: int, width: int, delimiter: str, decimal: str) -> tuple[Kind, ...]:
    """Tell which columns hold numbers: those in which most of the first rows do.

    `start`: Where the rows begin.
    """
    table = []
    for line in lines_of(head[start:], 40):
        cells = cells_of(line.text, delimiter, quote=delimiter != " ") or []
        if len(cells) == width and line.whole:
            table.append(cells)
    unknown: list[Kind] = ["number"] * width
    if not table:
        return tuple(unknown)
    columns = zip(*table, strict=True)
    number = _NUMBERS[decimal]
    shares = [sum(bool(number.fullmatch(cell.strip())) for cell in column) for column in columns]
    kinds: list[Kind] = ["number" if share * 2 > len(table) else "skip" for share in shares]
    # where no column holds numbers, none is left out: each row then says what is wrong with it
    return tuple(kinds) if "number" in kinds else tuple(unknown)


def first_lines(head: bytes, most: int = 5) -> list[str]:
    """Return the first lines of a file, to be shown.

    Returns each cut to 100 characters; control characters as escapes.
    """
    text = readable(head)
    if not text:
        return [repr(decoded(head[:60]))]
    return [line.text[:100] for line in lines_of(text, most)]


# --- Any delimited text, described in a few lines of the config.


_CHARACTERS = {"tab": "\t", "blank": " ", "bar": "|"}


class DelimitedReader(TextReader):
    """Text as the section `text` of the config describes it; it claims no file by itself."""

    name = "delimited"
    evidence = "the section `text` of the config"

    def __init__(self) -> None:
        self._format: TextFormat | None = None

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "any delimited text, described by `text` in the config"

    def detect(self, head: bytes) -> bool:  # noqa: ARG002  # a description decides, not the file
        """Tell that no file is of this dialect by itself.

        Returns false.
        """
        return False

    def described(self, text: TextFormat) -> DelimitedReader:
        """Return a reader of the format that is described."""
        reader = copy(self)
        reader._format = text
        return reader

    def plan(self, head: bytes) -> Plan:
        """Find the header rows where the description says they are."""
        text = self._format
        if text is None:
            raise ValueError("the dialect delimited needs `text` in the config: the format")
        delimiter = _CHARACTERS.get(text.delimiter, text.delimiter)
        lines = [
            line
            for place, line in enumerate(lines_of(head, text.skip_lines + 400, text.encoding))
            if place >= text.skip_lines and _counts(line, text.comment)
        ]
        start = _start(head, text.skip_lines)
        names: tuple[str, ...] = ()
        units: list[str] = []
        given: list[str] = []
        if text.names:
            if not lines or not lines[0].whole:
                raise ValueError(
                    f"no row of names below the first {text.skip_lines} lines (skip_lines)"
                )
            first = lines.pop(0)
            given = _cells(first, delimiter)
            split = [split_unit(cell) for cell in given]
            names, units = unique([name for name, _ in split]), [unit for _, unit in split]
            start = first.stop
        if text.units:
            if not lines or not lines[0].whole:
                raise ValueError("no row of units below the row of names (units: true)")
            second = lines.pop(0)
            units = [unit_word(cell) for cell in _cells(second, delimiter)]
            start = second.stop
        rows = [_cells(line, delimiter) for line in lines[:40] if line.whole]
        width = _width(rows, len(names), len(names) - bool(given and not given[-1].strip()))
        names = unique([*names, *[""] * (width - len(names))][:width])
        units = [*units, *[""] * width][:width]
        rate = text.rate_Hz
        at = start

        def derive(columns: dict[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
            return {**columns, "time": index / rate} if rate else columns

        return Plan(
            Layout(
                names,
                kinds_of(head, at, width, delimiter, text.decimal),
                delimiter,
                text.decimal,
                quote=delimiter != " ",
                comment=text.comment,
            ),
            dict(zip(names, units, strict=True)),
            start,
            derive if rate else None,
            notes=(f"time is the row number / {rate:g} Hz (the config)",) if rate else (),
        )


def _counts(line: Line, comment: str) -> bool:
    text = line.text.strip()
    return bool(text) and not (comment and text.startswith(comment))


def _start(head: bytes, skip: int) -> int:
    lines = lines_of(head, skip) if skip else []
    return lines[-1].stop if lines else 0


def _cells(line: Line, delimiter: str) -> list[str]:
    return cells_of(line.text, delimiter, quote=delimiter != " ") or line.text.split(delimiter)


def _width(rows: Sequence[list[str]], most: int, least: int) -> int:
    """Cells of a row: as many as there are names, but for a delimiter at the end of either."""
    if not rows:
        return max(most, 1)
    widths = [len(cells) for cells in rows]
    usual = max(set(widths), key=lambda number: (widths.count(number), number))
    if not most or usual == most or most in widths:
        return most or usual
    blank = all(not cells[-1].strip() for cells in rows if len(cells) == most + 1)
    if usual == least or (usual == most + 1 and blank):
        return usual
    raise ValueError(f"{most} names, but {usual} cells in most rows")
