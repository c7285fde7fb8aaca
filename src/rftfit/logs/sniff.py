"""What an unknown text file looks like: cells, decimal mark, header rows."""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rftfit.logs.base import HEAD_BYTES
from rftfit.logs.layout import Kind, cells_of
from rftfit.logs.lines import Line, decoded, lines_of, readable
from rftfit.logs.unitwords import known_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

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

    Attributes
    ----------
    delimiter : str
        The character itself.
    decimal : str
    skip_lines : int
        Lines in front of the row of names, or of the data where there is none.
    names, units : bool
        Whether there is a row of names, and one of units.
    width : int
        Cells in a row.
    first : int
        Index of the first data line.
    """

    delimiter: str
    decimal: str
    skip_lines: int
    names: bool
    units: bool
    width: int
    first: int

    def as_format(self) -> dict[str, Any]:
        """Return it as the keys of `text` in the config that differ from their defaults.

        Returns
        -------
        dict
        """
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

    Parameters
    ----------
    head : bytes
        As on the disk.

    Returns
    -------
    str
        ``binary`` for what is no text.
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

    Parameters
    ----------
    head : bytes
        As on the disk.

    Returns
    -------
    Look or None
        None where no way of reading gives at least two rows of at least two cells, of which at
        least half are numbers.
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

    Parameters
    ----------
    cells : sequence of str
    width : int
        Cells in a row of data.

    Returns
    -------
    bool
    """
    filled = [cell for cell in cells if cell.strip()]
    if not filled or not width - 1 <= len(cells) <= width + 1:
        return False
    return all(_BRACKETED.fullmatch(cell) for cell in filled) or (
        all(known_unit(cell) for cell in filled) and len(filled) * 2 > width
    )


def kinds_of(head: bytes, start: int, width: int, delimiter: str, decimal: str) -> tuple[Kind, ...]:
    """Tell which columns hold numbers: those in which most of the first rows do.

    Parameters
    ----------
    head : bytes
    start : int
        Where the rows begin.
    width : int
    delimiter, decimal : str

    Returns
    -------
    tuple of {"number", "skip"}
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

    Parameters
    ----------
    head : bytes
    most : int

    Returns
    -------
    list of str
        Each cut to 100 characters; control characters as escapes.
    """
    text = readable(head)
    if not text:
        return [repr(decoded(head[:60]))]
    return [line.text[:100] for line in lines_of(text, most)]
