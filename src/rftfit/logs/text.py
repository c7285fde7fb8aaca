"""Text logs: blocks of whole lines, cells to numbers, and what all text readers share."""

from __future__ import annotations

import codecs
import csv
import re
from abc import abstractmethod
from codecs import BOM_UTF8
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.logs.base import HEAD_BYTES, Log, LogError, Reader, added, in_order, join

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import PacketCount


# --- Numbers whose digits a spreadsheet has regrouped, so that they read as other numbers.


GROUPED = "digits regrouped in this column: 10,114 may have been 1,0114"

_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_DIGITS = bytes.maketrans(b"123456789", b"0" * 9)
_TWICE = b"0,000,000"


def regrouped(layout: Layout, bodies: Iterable[bytes]) -> frozenset[int]:
    """Find columns in which a spreadsheet has regrouped digits: two decimal commas in one number.

    Where 1,000,292 stands for 100,0292, the same column has 10,114 for 1,0114: a number like any
    other, but another one. So a single such cell casts doubt on its whole column.

    `layout`: With a decimal comma; otherwise there is nothing to find. `bodies`: All lines of the
    file. Returns places of columns.
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
    """Tell whether a number may owe its comma to regrouping."""
    return bool(_GROUPED.fullmatch(cell.strip(" \t")))


# --- A text file as blocks of whole lines, so that memory stays bounded however long the file is.


BLOCK_BYTES = 1 << 22
MAX_LINE = 1 << 16

_WIDE = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_LINE_END = re.compile(rb"\r\n|\n|\r")


class Block(NamedTuple):
    """Some lines of a file.

    `body`: Whole lines, each with its end.
    `rest`: What stands behind the last line end of the file: the line its writer was stopped in.
        Empty in all blocks but the last.
    """

    body: bytes
    rest: bytes


class TextFile:
    """A text file that is read once, from its beginning to its end.

    UTF-16 is turned into UTF-8 and a byte order mark is left out; all other encodings stay as they
    are, since numbers look the same in all of them.

    `head`: The first 64 kB, or all of a shorter file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._chunks = _chunks(path)
        self._first = bytes(next(self._chunks, b""))
        self.head = self._first[:HEAD_BYTES]
        if not self._first or self._first.isspace():
            raise LogError("empty", f"{path}: the file is empty")

    def blocks(self, start: int) -> Iterator[Block]:
        """Read on from a place in the head.

        `start`: Bytes of the head to pass over. Yields at least one.
        """
        carry = b""
        first, self._first = self._first[start:], b""
        for chunk in chain([first], self._chunks):
            if carry.endswith(b"\r"):
                # a \r there may be half of \r\n: it is seen together with what follows
                chunk = carry[-1:] + chunk  # noqa: PLW2901
                carry = carry[:-1]
            place = _behind_last_line(chunk, len(chunk) - chunk.endswith(b"\r"))
            if place:
                # one copy, however long the block
                yield Block(b"".join((carry, memoryview(chunk)[:place])), b"")
                carry = bytes(chunk[place:])
            else:
                carry += chunk
            if len(carry) > MAX_LINE:
                # no table has such lines; the mark keeps what is left of it from being a row
                carry = carry[:64].replace(b"\r", b"") + b"\x00"
        place = _behind_last_line(carry, len(carry))
        yield Block(carry[:place], carry[place:])


def _behind_last_line(text: bytes | bytearray, stop: int) -> int:
    return max(text.rfind(b"\n", 0, stop), text.rfind(b"\r", 0, stop)) + 1


def _chunks(path: Path) -> Iterator[bytes | bytearray]:
    """Pieces of a file; each is good until the next one is asked for."""
    try:
        with path.open("rb") as handle:
            first = handle.read(BLOCK_BYTES)
            wide = _WIDE.get(first[:2])
            if wide is None:
                yield first.removeprefix(codecs.BOM_UTF8)
                if len(first) < BLOCK_BYTES:
                    return
                # one buffer for all that follows: fresh memory costs as much as reading
                buffer = bytearray(BLOCK_BYTES)
                while size := handle.readinto(buffer):
                    yield buffer if size == len(buffer) else buffer[:size]
                return
            decoder = codecs.getincrementaldecoder(wide)("replace")
            yield decoder.decode(first[2:]).encode()
            while chunk := handle.read(BLOCK_BYTES):
                yield decoder.decode(chunk).encode()
    except FileNotFoundError:
        raise LogError("missing", f"{path}: log missing") from None
    except OSError as error:
        raise LogError("unreadable", f"{path}: cannot be read: {error.strerror}") from error


def readable(head: bytes) -> bytes:
    """Return the beginning of a file as `TextFile` would show it.

    `head`: As on the disk. Returns empty for a binary file.
    """
    wide = _WIDE.get(head[:2])
    if wide:
        return head[2:].decode(wide, "ignore").encode()
    head = head.removeprefix(codecs.BOM_UTF8)
    return b"" if b"\x00" in head else head


class Line(NamedTuple):
    """One line of the head, without its end, and where the next one begins.

    `whole`: Whether it has a line end.
    """

    text: str
    stop: int
    whole: bool


def lines_of(head: bytes, most: int = 400, encoding: str = "") -> list[Line]:
    """Return the first lines of a file.

    `encoding`: Empty: UTF-8, or Windows-1252 where it is none.
    """
    lines: list[Line] = []
    start = 0
    while start < len(head) and len(lines) < most:
        end = _LINE_END.search(head, start)
        stop = end.end() if end else len(head)
        raw = head[start : end.start() if end else stop]
        lines.append(Line(decoded(raw, encoding), stop, end is not None))
        start = stop
    return lines


def decoded(raw: bytes, encoding: str = "") -> str:
    """Decode names and units: UTF-8, or else what Windows programs write.

    `encoding`: Empty to choose.
    """
    if encoding:
        return raw.decode(encoding, "replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


# --- How the cells of a text are told apart, and what some of its lines hold.


Kind = Literal["number", "integer", "same", "skip"]


@dataclass(frozen=True)
class Layout:
    """How the cells of a line are told apart, and what each holds.

    `names`: Of the columns, each once.
    `kinds`: Integers are exact within 64 bits; of a cell that should always be the `same`, whether
        it is; skipped cells may hold anything.
    `delimiter`: One character; a blank stands for any number of blanks and tabs.
    `decimal`: ``.`` or ``,``.
    `quote`: Whether cells may stand in double quotes.
    `comment`: Lines that begin with this are no data lines; empty: there are none.
    `optional`: How many of the last columns, all skipped ones, a line may leave out.
    `same`: What the cells of kind "same" should hold.
    """

    names: tuple[str, ...]
    kinds: tuple[Kind, ...]
    delimiter: str = ","
    decimal: str = "."
    quote: bool = False
    comment: str = ""
    optional: int = 0
    same: str = ""

    @property
    def wanted(self) -> list[int]:
        """Places of the columns that are read."""
        return [place for place, kind in enumerate(self.kinds) if kind != "skip"]


@dataclass(frozen=True)
class Rows:
    """What some lines hold.

    `columns`: Of the good rows; float64, int64 or bool.
    `index`: shape (n,); Which data line of these lines each good row is, from 0: a bad line keeps
        its place.
    `rows`: Data lines.
    `dropped`: Reason to number of lines left out; with n they add up to `rows`.
    """

    columns: dict[str, np.ndarray]
    index: np.ndarray
    rows: int
    dropped: dict[str, int]

    def take(self, keep: np.ndarray, reason: str) -> Rows:
        """Leave out the rows where `keep` is False.

        `keep`: shape (n,).
        """
        lost = int(keep.size - np.count_nonzero(keep))
        if not lost:
            return self
        columns = {name: values[keep] for name, values in self.columns.items()}
        dropped = added(self.dropped, {reason: lost})
        return Rows(columns, self.index[keep], self.rows, dropped)


def cells_of(line: str, delimiter: str, *, quote: bool) -> list[str] | None:
    """Split a line into its cells.

    `delimiter`: A blank stands for any number of blanks and tabs. `quote`: Whether cells may stand
    in double quotes. Returns none where the quotes do not match.
    """
    if delimiter == " ":
        return [cell for cell in line.replace("\t", " ").split(" ") if cell]
    if not quote or '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True), [])
    except csv.Error:
        return None


# --- Lines of numbers to columns: fast where the file is whole, careful where it is not.


CUT = "cut in mid-row"
CELLS = "wrong number of cells"
NUMBER = "not a number"
FINITE = "NaN or infinite"
_BLOCK_BYTES = 1 << 24
_FEED, _RETURN = b"\n\r"


class Parsed(NamedTuple):
    """What one body of lines holds.

    `values`: shape (n,); The columns of the good rows, in order.
    `rows`: Data lines: those that hold anything and are no comment.
    `dropped`: Reason to number of lines left out; n and these add up to `rows`.
    """

    values: list[FloatArray]
    rows: int
    dropped: dict[str, int]


def parse_bodies(bodies: Sequence[bytes], width: int) -> list[Parsed]:
    """Parse comma-separated lines of `width` numbers each, many files at once.

    Starting the parser costs as much as parsing a file of a thousand rows, so whole files are
    parsed together; as soon as one of them has a bad line, each is parsed by itself.

    `bodies`: Everything after the header row of each file; any line ends; blank lines and ``#``
    comments do not count. `width`: Cells in a row. Returns in the order of `bodies`.
    """
    if len(bodies) > 1 and all(map(_is_plain, bodies)):
        together = _parse_whole(b"".join(bodies), width)
        ends = np.cumsum([count_lines(body) for body in bodies])
        # fewer rows than lines: some are blank
        if together is not None and together[0].size == ends[-1]:
            spans = [slice(a, b) for a, b in pairwise([0, *ends.tolist()])]
            return [_finite([column[span] for column in together], {}) for span in spans]
    return [_parse_body(body, width) for body in bodies]


def _is_plain(body: bytes) -> bool:
    """Tell whether every line feed ends a line, and no line is a comment."""
    return body[-1:] == b"\n" and b"\r" not in body and b"#" not in body


def count_lines(body: bytes) -> int:
    """Count the lines of a body that ends with a line end."""
    # several times faster than bytes.count where lines are short
    text = np.frombuffer(body, dtype=np.uint8)
    feeds = text == _FEED
    lines = int(np.count_nonzero(feeds))
    if b"\r" in body:
        returns = text == _RETURN
        lines += int(np.count_nonzero(returns)) - int(np.count_nonzero(returns[:-1] & feeds[1:]))
    return lines


def _parse_body(body: bytes, width: int) -> Parsed:
    dropped: dict[str, int] = {}
    if body.strip() and not body.endswith((b"\n", b"\r")):
        # whoever wrote the last row was stopped in it, even if the cells happen to add up
        cut = max(body.rfind(b"\n"), body.rfind(b"\r")) + 1
        if is_data(body[cut:]):
            dropped[CUT] = 1
        body = body[:cut]
    parsed = _parse_whole(body, width)
    return _finite(_parse_lines(body, width, dropped) if parsed is None else parsed, dropped)


def _finite(values: list[FloatArray], dropped: dict[str, int]) -> Parsed:
    """Leave out rows with NaN or infinity."""
    rows = values[0].size + sum(dropped.values())
    with np.errstate(invalid="ignore", over="ignore"):
        total = sum(values[1:], start=values[0])
    # where that is finite, so are its parts
    if not np.isfinite(total).all():
        finite = np.isfinite(values).all(axis=0)
        if not finite.all():
            dropped[FINITE] = int(np.count_nonzero(~finite))
            values = [column[finite] for column in values]
    return Parsed(values, rows, dropped)


def is_data(line: bytes) -> bool:
    """Tell a data line from a blank one and from a comment."""
    text = line.strip()
    return bool(text) and not text.startswith(b"#")


def _parse_whole(body: bytes, width: int) -> list[FloatArray] | None:
    """Parse a body without a single bad line, or give None."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    if not body or body.isspace():
        return [np.empty(0)] * width
    if body.startswith(BOM_UTF8):
        return None  # which the fast parser would pass over, in any row that begins a body
    try:
        table = pacsv.read_csv(pa.BufferReader(body), **_options(width))
    except pa.ArrowInvalid:
        return None
    return [column.to_numpy() for column in table.columns]


@cache
def _options(width: int) -> dict[str, Any]:
    """Make the fast parser's settings once; making them costs as much as parsing a few hundred rows."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    names = [str(index) for index in range(width)]
    return {
        # one thread: these files are small and the jobs run side by side
        "read_options": pacsv.ReadOptions(
            column_names=names, use_threads=False, block_size=_BLOCK_BYTES
        ),
        # a quote is no part of a number, here as little as line by line
        "parse_options": pacsv.ParseOptions(quote_char=False),
        "convert_options": pacsv.ConvertOptions(
            column_types=dict.fromkeys(names, pa.float64()), null_values=[]
        ),
    }


def _parse_lines(body: bytes, width: int, dropped: dict[str, int]) -> list[FloatArray]:
    """Parse line by line and count what is wrong with the bad ones."""
    good: list[list[float]] = []
    for line in body.splitlines():
        if not is_data(line):
            continue
        cells = line.split(b",")
        if len(cells) != width:
            dropped[CELLS] = dropped.get(CELLS, 0) + 1
            continue
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = []
        # Python would take 1_0 for 10
        if not row or b"_" in line:
            dropped[NUMBER] = dropped.get(NUMBER, 0) + 1
        else:
            good.append(row)
    return list(np.array(good, dtype=float).reshape(-1, width).T)


# --- Lines of cells to columns of numbers: fast where a block is whole, careful where it is not.


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_INTEGER = re.compile(r"-?\d{1,19}")
_CELLS_FEED, _CELLS_RETURN, _TAB, _BLANK = b"\n\r\t "
_EMPTY_LINES = re.compile(rb"[ \t]*(?:\r\n|\n|\r)[\s]*")
_LINES_BY_HAND = 64
_ONE_PIECE = 1 << 24


class Parser:
    """Parser of one file's lines, block after block.

    `grouped`: Places of columns whose digits were regrouped, as `regrouped` finds them.
    `surprised`: Whether there was a number with regrouped digits in another column than those.
    """

    def __init__(self, layout: Layout, grouped: frozenset[int] = frozenset()) -> None:
        self.layout = layout
        self._grouped = grouped.intersection(layout.wanted)
        self.surprised = False

    def parse(self, body: bytes, rest: bytes = b"") -> Rows:
        """Parse some lines.

        `body`: Whole lines. `rest`: A last line without an end: whoever wrote it was stopped in
        it, even if the cells happen to add up, so it is counted and left out.
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
            table = pacsv.read_csv(pa.BufferReader(body), **_cells_options(layout, width))
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
        blank[:-1], blank[1:] | (follows == _CELLS_FEED) | (follows == _CELLS_RETURN), out=drop[:-1]
    )
    drop[-1] = blank[-1]
    text = text[~drop]
    if text.size:
        # and goes, if no cell is before it
        end = (text == _CELLS_FEED) | (text == _CELLS_RETURN)
        drop = (text == _BLANK) | (text == _TAB)
        drop[1:] &= end[:-1]
        text = text[~drop]
    return text.tobytes().replace(b"\t", b" ")


@lru_cache(64)
def _cells_options(layout: Layout, width: int) -> dict[str, Any]:
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


# --- What readers of text have in common: a header that tells the layout, then rows, block after block.


Derive = Callable[["dict[str, np.ndarray]", "np.ndarray"], "dict[str, np.ndarray]"]

_REGROUPED = (
    "{}: numbers with two decimal commas: a spreadsheet has regrouped the digits of this column, so "
    "most of its rows cannot be told; export it again with decimal points, or do not name the column"
)


@dataclass(frozen=True)
class Plan:
    """How one file is to be read, as its header says.

    `units`: Of the columns that come out, as far as the file states them.
    `start`: Where in the head the rows begin.
    `derive`: Makes the columns that come out, ``time`` in s among them, of those of a block and of
        the place of each row among the data lines of the file.
    `packets`: Counts what was lost, for `missing`.
    `lost`: What to call that.
    `keep`: Columns that are read even where nobody asks for them.
    `drop`: Columns that are read and not handed on.
    `same`: Name of the column of kind "same", and the reason why a row where it is not goes; or
        empty.
    """

    layout: Layout
    units: dict[str, str]
    start: int
    derive: Derive | None = None
    packets: PacketCount | None = None
    lost: str = ""
    keep: frozenset[str] = frozenset()
    drop: frozenset[str] = frozenset()
    same: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())


class _RegroupedError(Exception):
    """Digits were regrouped: all of the file has to be seen before any row can be trusted."""


class TextReader(Reader):
    """Base of the dialects of text: a `plan` for each file is all they need."""

    @abstractmethod
    def plan(self, head: bytes) -> Plan:
        """Find out how a file is to be read.

        Parameters
        ----------
        head : bytes
            The first 64 kB.

        Returns
        -------
        Plan

        Raises
        ------
        ValueError
            If it cannot be read that way; the message says what was found and what is allowed.
        """

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in blocks of some megabytes.

        Parameters
        ----------
        path : Path

        Yields
        ------
        Log

        Raises
        ------
        LogError
            If the file cannot be used at all.
        """
        yield from self._blocks(path, twice=True)

    def load(self, path: Path) -> Log:
        """Read a file.

        Parameters
        ----------
        path : Path

        Returns
        -------
        Log

        Raises
        ------
        LogError
            If the file cannot be used at all.
        """
        try:
            return join(self._blocks(path, twice=False))
        except _RegroupedError:
            return join(self._blocks(path, twice=True))

    def _blocks(self, path: Path, *, twice: bool) -> Iterator[Log]:
        """Read block after block; `twice`: look through the whole file for regrouped digits first."""
        file = TextFile(path)
        try:
            plan = self.plan(file.head)
        except LogError as error:
            raise LogError(error.code, f"{path}: {error}", error.rows) from None
        except ValueError as error:
            raise LogError("header", f"{path}: {error}") from None
        layout = self._narrowed(plan)
        doubtful: frozenset[int] = frozenset()
        if twice and layout.decimal == ",":
            doubtful = regrouped(layout, (b for b, _ in TextFile(path).blocks(plan.start)))
        parser = Parser(layout, doubtful)
        notes = tuple(_REGROUPED.format(layout.names[place]) for place in sorted(doubtful))
        plan = replace(plan, notes=plan.notes + notes)
        first = 0
        blocks = file.blocks(plan.start)
        for rows in in_order(lambda block: parser.parse(block.body, block.rest), blocks):
            if parser.surprised and not twice:
                raise _RegroupedError
            if rows.rows:
                yield _log(path, plan, rows, first)
            first += rows.rows
        if first == 0:
            raise LogError("header_only", f"{path}: a header and no data")

    def _narrowed(self, plan: Plan) -> Layout:
        layout = plan.layout
        if self.asked is None:
            return layout
        kept = self.asked | plan.keep
        kinds = tuple(
            kind if name in kept else "skip"
            for name, kind in zip(layout.names, layout.kinds, strict=True)
        )
        narrow = replace(layout, kinds=kinds)
        # of a file that lacks one of them, all: whoever asked finds out which columns there are
        absent = self.asked.difference(layout.names, QUANTITIES)
        return layout if absent or not narrow.wanted else narrow


def _log(path: Path, plan: Plan, rows: Rows, first: int) -> Log:
    before = plan.packets.missing if plan.packets else 0
    index = rows.index + first if first else rows.index
    columns = plan.derive(rows.columns, index) if plan.derive else rows.columns
    missing = {}
    if plan.packets:
        lost = plan.packets.missing - before
        missing = {plan.lost: lost} if lost > 0 else {}
    good = replace(rows, columns=columns)
    if plan.same:
        name, reason = plan.same
        good = good.take(columns[name].astype(bool), reason)
    out = {
        name: c.astype(float, copy=False)
        for name, c in good.columns.items()
        if name not in plan.drop
    }
    derived = {"time": "s"} if plan.derive else {}
    units = {name: derived.get(name) or plan.units.get(name, "") for name in out}
    return Log(path, out, units, rows.rows, good.dropped, missing, plan.notes)


def rate_option(options: Mapping[str, object], name: str) -> float | None:
    """Check the options of a dialect that can be told its rate.

    `name`: Of the dialect. Returns hz.
    """
    others = sorted(set(options) - {"rate_Hz"})
    if others:
        raise ValueError(f"the dialect {name} has the option rate_Hz only, found {others[0]}")
    rate = options.get("rate_Hz")
    if rate is None:
        return None
    if isinstance(rate, bool) or not isinstance(rate, int | float) or not 0 < rate < 1e9:
        raise ValueError(f"rate_Hz: found {rate!r}; allowed: a number above 0, in Hz")
    return float(rate)
