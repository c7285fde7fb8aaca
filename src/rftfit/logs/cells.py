"""Lines of cells to columns of numbers: fast where a block is whole, careful where it is not.

A bad line is found by halving its block, so that a damaged line costs little and the rest of a long
file is still read by the fast parser.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.base import added
from rftfit.logs.layout import Rows, cells_of
from rftfit.logs.numbers import CELLS, CUT, FINITE, NUMBER, count_lines
from rftfit.logs.regrouped import GROUPED, is_grouped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.logs.layout import Layout


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_INTEGER = re.compile(r"-?\d{1,19}")
_FEED, _RETURN, _TAB, _BLANK = b"\n\r\t "
_EMPTY_LINES = re.compile(rb"[ \t]*(?:\r\n|\n|\r)[\s]*")
_LINES_BY_HAND = 64
_ONE_PIECE = 1 << 24


class Parser:
    """Parser of one file's lines, block after block.

    Parameters
    ----------
    layout : Layout
    grouped : frozenset of int
        Places of columns whose digits were regrouped, as `regrouped` finds them.

    Attributes
    ----------
    surprised : bool
        Whether there was a number with regrouped digits in another column than those.
    """

    def __init__(self, layout: Layout, grouped: frozenset[int] = frozenset()) -> None:
        self.layout = layout
        self._grouped = grouped.intersection(layout.wanted)
        self.surprised = False

    def parse(self, body: bytes, rest: bytes = b"") -> Rows:
        """Parse some lines.

        Parameters
        ----------
        body : bytes
            Whole lines.
        rest : bytes
            A last line without an end: whoever wrote it was stopped in it, even if the cells happen
            to add up, so it is counted and left out.

        Returns
        -------
        Rows
        """
        parts = self._parse(body)
        cut = int(self._is_data(rest))
        dropped = added(*(part.dropped for part in parts), {CUT: cut} if cut else {})
        found = _together(parts)
        found = Rows(found.columns, found.index, found.rows + cut, dropped)
        finite = np.ones(found.index.size, dtype=bool)
        for values in found.columns.values():
            if values.dtype == float:
                finite &= np.isfinite(values)
        return found.take(finite, FINITE)

    def _is_data(self, line: bytes) -> bool:
        text = line.strip()
        mark = self.layout.comment.encode()
        return bool(text) and not (mark and text.startswith(mark))

    def _parse(self, body: bytes) -> list[Rows]:
        """Parse a block, or its halves when it has a bad line."""
        if not self._grouped:
            fast = self._fast(body)
            if fast is not None:
                return [fast]
        if count_lines(body) <= _LINES_BY_HAND:
            return [self._by_hand(body)]
        middle = len(body) // 2
        # never between \r and \n
        place = body.rfind(b"\n", 0, middle) + 1 or body.rfind(b"\r", 0, middle) + 1
        if not 0 < place < len(body) or body[place : place + 1] == b"\n":
            return [self._by_hand(body)]
        return [*self._parse(body[:place]), *self._parse(body[place:])]

    def _fast(self, body: bytes) -> Rows | None:
        """Parse lines without a single bad one, or give None."""
        import pyarrow as pa
        import pyarrow.compute as pc
        import pyarrow.csv as pacsv

        layout = self.layout
        if "integer" in layout.kinds and (b"x" in body or b"X" in body):
            return None  # 0x10 would be a number to the fast parser
        if not body or body.isspace():
            return self._rows([[] for _ in layout.wanted], [], 0, {})
        if layout.delimiter == " ":
            body = _single_blanks(body)
        if body.startswith(BOM_UTF8):
            return None  # which the fast parser would pass over, in any row that begins a block
        width = len(layout.names)
        if layout.optional:
            end = body.find(b"\n")
            line = body[: end if end >= 0 else len(body)]
            width = min(width, line.count(layout.delimiter.encode()) + 1)
            if width < len(layout.names) - layout.optional:
                return None
        try:
            table = pacsv.read_csv(pa.BufferReader(body), **_options(layout, width))
        except (pa.ArrowInvalid, pa.ArrowKeyError):
            return None
        if table.num_rows != count_lines(body):
            # blank lines, or a quote that swallowed line ends
            plain = _EMPTY_LINES.sub(b"\n", body).lstrip(b"\n")
            return self._fast(plain) if len(plain) < len(body) else None
        columns = {}
        for place in layout.wanted:
            values = table.column(str(place))
            if layout.kinds[place] == "same":
                values = pc.equal(values, layout.same.encode())
            columns[layout.names[place]] = values.to_numpy()
        return Rows(columns, np.arange(table.num_rows), table.num_rows, {})

    def _by_hand(self, body: bytes) -> Rows:
        """Parse line by line and count what is wrong with the bad ones."""
        kept: list[list[Any]] = [[] for _ in self.layout.wanted]
        index: list[int] = []
        dropped: dict[str, int] = {}
        rows = 0
        for line in body.splitlines():
            if not self._is_data(line):
                continue
            found = self._row(line)
            if isinstance(found, str):
                dropped[found] = dropped.get(found, 0) + 1
            else:
                for column, value in zip(kept, found, strict=True):
                    column.append(value)
                index.append(rows)
            rows += 1
        return self._rows(kept, index, rows, dropped)

    def _rows(
        self, kept: list[list[Any]], index: list[int], rows: int, dropped: Mapping[str, int]
    ) -> Rows:
        types = {"number": float, "integer": np.int64, "same": bool}
        columns = {
            self.layout.names[place]: np.array(values, dtype=types[self.layout.kinds[place]])
            for place, values in zip(self.layout.wanted, kept, strict=True)
        }
        return Rows(columns, np.array(index, dtype=np.int64), rows, dict(dropped))

    def _row(self, line: bytes) -> list[Any] | str:
        """Values of the wanted cells, or the reason why the line is bad."""
        layout = self.layout
        cells = cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote)
        if cells is None or not (
            len(layout.names) - layout.optional <= len(cells) <= len(layout.names)
        ):
            return CELLS
        values: list[Any] = []
        for place in layout.wanted:
            cell = cells[place].strip(" \t")
            kind = layout.kinds[place]
            if kind == "same":
                values.append(cells[place] == layout.same)
            elif kind == "integer":
                if not _INTEGER.fullmatch(cell) or abs(int(cell)) >= 1 << 63:
                    return NUMBER
                values.append(int(cell))
            else:
                number = self._number(cell, place)
                if isinstance(number, str):
                    return number
                values.append(number)
        return values

    def _number(self, cell: str, place: int) -> float | str:
        if self.layout.decimal == ",":
            if place in self._grouped and is_grouped(cell):
                return GROUPED
            if cell.count(",") > 1 and is_grouped(cell):
                self.surprised = True
            if "." in cell:
                return NUMBER
            cell = cell.replace(",", ".")
        if _NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell):
            return float(cell)
        return NUMBER


def _together(parts: list[Rows]) -> Rows:
    """Put the parts of a block together."""
    if len(parts) == 1:
        return parts[0]
    offsets = np.cumsum([0, *(part.rows for part in parts)])
    index = [part.index + offset for part, offset in zip(parts, offsets[:-1], strict=True)]
    columns = {
        name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns
    }
    return Rows(columns, np.concatenate(index), int(offsets[-1]), {})


def _single_blanks(body: bytes) -> bytes:
    """Put one blank between cells, and none at either end of a line."""
    text = np.frombuffer(body, dtype=np.uint8)
    # the last blank of each run stays, if a cell follows
    blank = (text == _BLANK) | (text == _TAB)
    drop = np.ones(text.size, dtype=bool)
    follows = text[1:]
    np.logical_and(
        blank[:-1],
        blank[1:] | (follows == _FEED) | (follows == _RETURN),
        out=drop[:-1],
    )
    drop[-1] = blank[-1]
    text = text[~drop]
    if text.size:
        # and goes, if no cell is before it
        end = (text == _FEED) | (text == _RETURN)
        drop = (text == _BLANK) | (text == _TAB)
        drop[1:] &= end[:-1]
        text = text[~drop]
    return text.tobytes().replace(b"\t", b" ")


@lru_cache(64)
def _options(layout: Layout, width: int) -> dict[str, Any]:
    """Make the settings of the fast parser; making them costs as much as parsing some hundred rows."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    types = {"number": pa.float64(), "integer": pa.int64()}
    names = [str(place) for place in range(width)]
    return {
        "read_options": pacsv.ReadOptions(
            # blocks are parsed side by side already; in one piece its columns need no copy
            column_names=names,
            use_threads=False,
            block_size=_ONE_PIECE,
        ),
        "parse_options": pacsv.ParseOptions(
            delimiter=layout.delimiter, quote_char='"' if layout.quote else False
        ),
        "convert_options": pacsv.ConvertOptions(
            column_types={name: types.get(layout.kinds[int(name)], pa.binary()) for name in names},
            include_columns=[str(place) for place in layout.wanted],
            decimal_point=layout.decimal,
            null_values=[],
            check_utf8=False,
        ),
    }
