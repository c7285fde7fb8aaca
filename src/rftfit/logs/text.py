"""The one parser of text logs: blocks of whole lines, cells to numbers, the base of its readers."""

from __future__ import annotations

import codecs
import gzip
import os
import re
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import BinaryIO, NamedTuple, cast

import numpy as np

from rftfit.logs import base
from rftfit.logs.beside import HeaderChange, LabelledReader, changed_header
from rftfit.table.parse import REGROUPED, Kind, Layout, ParsedRows, parse
from rftfit.table.text import cells_of, utf16_of, without_byte_order_mark

BLOCK_BYTES = 1 << 22
MAX_LINE = 1 << 16
MAX_BYTES = 1 << 36
GZIP = b"\x1f\x8b"

_FEED, _RETURN, _TAB, _BLANK, _COMMA, _ZERO, _NINE = b"\n\r\t ,09"


# --- A file as blocks of whole lines


class Block(NamedTuple):
    """Whole lines of a file, and in the last block what stands behind the last line end.

    `before`: Where there is such a line, the lines before it.
    """

    body: bytes
    last_line: bytes
    before: bytes = b""


class TextFile:
    """A text file that is read once, in blocks, so that memory stays bounded.

    UTF-16 becomes UTF-8 and a byte order mark is left out; other encodings stay as they are, since
    numbers look the same in all of them. `head`: The first 64 kB.
    """

    def __init__(self, path: Path) -> None:
        self._chunks = _chunks(path)
        self._first = next(self._chunks, b"")
        self.head = self._first[: base.HEAD_BYTES]
        if not self._first or self._first.isspace():
            raise base.LogError("empty", f"{path}: the file is empty")

    def blocks(self, start: int) -> Iterator[Block]:
        """Yield what follows the first `start` bytes, which are of the head."""
        carry = before = b""
        first, self._first = self._first[start:], b""
        for chunk in chain([first], self._chunks):
            if carry.endswith(b"\r"):
                # a \r there may be half of \r\n: it is seen together with what follows
                chunk = carry[-1:] + chunk  # noqa: PLW2901
                carry = carry[:-1]
            stop = _behind_last_line(chunk, len(chunk) - chunk.endswith(b"\r"))
            if stop:
                # one copy, however long the block, and none of a file that is one block
                is_whole = not carry and stop == len(chunk)
                body = chunk if is_whole else b"".join((carry, memoryview(chunk)[:stop]))
                before = (before + body[-_BEFORE_BYTES:])[-_BEFORE_BYTES:]
                yield Block(body, b"")
                carry = chunk[stop:]
            else:
                carry += chunk
            if len(carry) > MAX_LINE:
                # no table has such lines; the NUL keeps what is left of it from being a row
                carry = carry[:64].replace(b"\r", b"") + b"\x00"
        if carry:
            stop = _behind_last_line(carry, len(carry))
            yield Block(carry[:stop], carry[stop:], (before + carry[:stop])[-_BEFORE_BYTES:])


_BEFORE_BYTES = 4096


def _behind_last_line(text: bytes, stop: int) -> int:
    return max(text.rfind(b"\n", 0, stop), text.rfind(b"\r", 0, stop)) + 1


def opened(path: Path) -> BinaryIO:
    """Open a file to be read, unpacked if it is packed by gzip."""
    handle = path.open("rb")
    if handle.peek(len(GZIP))[: len(GZIP)] != GZIP:
        return handle
    handle.close()
    return cast("BinaryIO", gzip.open(path))


@contextmanager
def unpacking_errors(path: Path) -> Iterator[None]:
    """Turn what goes wrong with a packed file into a `LogError`."""
    try:
        yield
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        text = (
            f"{path}: damaged or cut short as packed by gzip ({error}); unpack what there is of it"
        )
        raise base.LogError("damaged", text) from error


def _chunks(path: Path) -> Iterator[bytes]:
    """Pieces of a file as UTF-8, or as they are, without a byte order mark."""
    with base.file_errors(path), unpacking_errors(path), opened(path) as handle:
        if isinstance(cast("object", handle), gzip.GzipFile):
            while handle.read(BLOCK_BYTES):
                base.check_unpacked(path, handle.tell())
            handle.seek(0)
        at_once = _bytes_at_once(handle)
        chunk = handle.read(at_once)
        if len(chunk) == BLOCK_BYTES:
            base.refuse_large_file(path, MAX_BYTES)
        utf16 = utf16_of(chunk)
        decoder = codecs.getincrementaldecoder(utf16)("replace") if utf16 else None
        chunk = without_byte_order_mark(chunk)
        while chunk:
            yield decoder.decode(chunk).encode() if decoder else chunk
            chunk = handle.read(at_once)


def _bytes_at_once(handle: BinaryIO) -> int:
    """Bytes to read at a time: room for a block costs more than reading a small file, so one is read in its own size."""
    if isinstance(cast("object", handle), gzip.GzipFile):
        return BLOCK_BYTES
    size = os.fstat(handle.fileno()).st_size
    # one more, so that the end is seen; a size of 0 says nothing
    return min(size + 1, BLOCK_BYTES) if size else BLOCK_BYTES


# --- Lines to columns: fast where a block is clean, line by line where it is not


# --- Numbers whose digits a spreadsheet has regrouped, so that they read as other numbers


_TWO_COMMAS = re.compile(rb",\d{3},\d{3}")


def regrouped_columns(path: Path, layout: Layout, start: int) -> frozenset[int]:
    """Find the wanted columns with two decimal commas in one number, anywhere in the file.

    Where 1,000,292 stands for 100,0292, the same column has 10,114 for 1,0114: a number like any
    other, but another one. So a single such cell casts doubt on its whole column.
    """
    regrouped_places: set[int] = set()
    if layout.decimal != "," or layout.delimiter == ",":
        return frozenset()
    for body, _, _ in TextFile(path).blocks(start):
        for line in filter(_TWO_COMMAS.search, body.splitlines() if _has_triple(body) else ()):
            cells = cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or []
            regrouped_places |= {
                place
                for place, cell in enumerate(cells)
                if cell.count(",") > 1 and REGROUPED.fullmatch(cell.strip(" \t"))
            }
    return frozenset(regrouped_places.intersection(layout.places_to_read))


def _has_triple(text: bytes) -> bool:
    """Look for three digits between two commas, faster than a regular expression."""
    codes = np.frombuffer(text, dtype=np.uint8)
    comma = codes == _COMMA
    starts = np.flatnonzero(comma[:-4] & comma[4:])
    between = codes[starts[:, None] + [1, 2, 3]]
    return bool(((between >= _ZERO) & (between <= _NINE)).all(axis=1).any())


# --- What readers of text have in common: a header that tells the layout, then rows


Derive = Callable[["dict[str, np.ndarray]", "np.ndarray"], "dict[str, np.ndarray]"]

_REGROUPED = (
    "{}: numbers with two decimal commas: a spreadsheet has regrouped the digits of this column, so "
    "most of its rows cannot be told; export it again with decimal points, or do not name the column"
)


@dataclass(frozen=True)
class ReadingPlan:
    """How one file is to be read, as its header says.

    `units`: Of the columns that come out, as far as the file states them.
    `start`: Where in the head the rows begin.
    `derive`: Makes the columns that come out, ``time`` in s among them, of those of a block and of
        the place of each row among the data lines of the file.
    `packets`: Counts the packets that were lost.
    `keep`: Columns that are read even where nobody asks for them.
    `not_same`: Why a row goes where a column of kind "same" is not; such columns are not handed on.
    `refusal`: Why the file cannot be used, although its rows can be counted.
    `unread`: Columns without numbers in the first rows, and why they are not read.
    `labels`: Columns of words or of few whole numbers, which may tell rows apart where nobody asks for them.
    `header`: Names and units as the header gives them, to be compared with one that stands further below.
    `clock_times`: Columns of times of day without a date.
    """

    layout: Layout
    units: Mapping[str, str]
    start: int
    derive: Derive | None = None
    packets: base.PacketCount | None = None
    keep: frozenset[str] = frozenset()
    not_same: str = ""
    notes: tuple[str, ...] = ()
    refusal: str = ""
    unread: Mapping[str, str] = field(default_factory=dict)
    labels: frozenset[str] = frozenset()
    header: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    clock_times: frozenset[str] = frozenset()


class TableReader(LabelledReader):
    """Base of the readers of cells that are text, whatever file these are from."""

    def narrow(self, path: Path, plan: ReadingPlan) -> ReadingPlan:
        """Leave out the columns that nobody asked for."""
        self.check_asked(path, plan.unread, plan.layout.names)
        names_to_read = plan.keep.union(self.choose_columns(plan.layout.names))
        return replace(
            plan, layout=narrowed(plan.layout, names_to_read, plan.labels.difference(self.where))
        )

    def logs_of(self, path: Path, plan: ReadingPlan, blocks: Iterable[Block]) -> Iterator[base.Log]:
        """Parse the rows of a table, block by block."""
        first = 0

        def parsed(block: Block) -> ParsedRows:
            return parse(plan.layout, *block, keep_blanks=self.keeps_blanks)

        for rows in base.parallel_map(parsed, blocks):
            _refuse_changed_header(path, plan, rows, first)
            if rows.rows:
                yield _log(path, plan, rows, first)
            first += rows.rows
        if first == 0:
            raise base.LogError("header_only", f"{path}: a header and no data")


class TextReader(TableReader, ABC):
    """Base of the dialects of text: a `plan` for each file is all they need."""

    @abstractmethod
    def plan(self, head: bytes) -> ReadingPlan:
        """Find out from the first 64 kB of a file how it is to be read.

        Raises ValueError if it cannot be read that way; the message says what was found and what is
        allowed.
        """

    def stream(self, path: Path) -> Iterator[base.Log]:
        """Read a file in blocks of some megabytes."""
        file = TextFile(path)
        try:
            plan = self.plan(file.head)
        except base.LogError as error:
            raise base.LogError(error.code, f"{path}: {error}", error.rows) from None
        except ValueError as error:
            raise base.LogError("header", f"{path}: {error}") from None
        blocks = file.blocks(plan.start)
        if plan.refusal:
            lines = chain.from_iterable(chain(b.body.splitlines(), [b.last_line]) for b in blocks)
            count = sum(map(plan.layout.is_data, lines))
            raise base.LogError("header", f"{path}: {plan.refusal}", count)
        plan = self.narrow(path, plan)
        if regrouped := regrouped_columns(path, plan.layout, plan.start):
            notes = [_REGROUPED.format(plan.layout.names[place]) for place in sorted(regrouped)]
            layout = replace(plan.layout, regrouped=regrouped)
            plan = replace(plan, layout=layout, notes=(*plan.notes, *notes))
        yield from self.logs_of(path, plan, blocks)


def _refuse_changed_header(path: Path, plan: ReadingPlan, rows: ParsedRows, first: int) -> None:
    """Refuse a file in which the header stands again and says something else of a column that is read."""
    (names, units), layout = plan.header, plan.layout
    wanted = [place for place in layout.places_to_read if layout.kinds[place] != "label"]
    for line, cells in rows.word_lines if names else ():
        if changes := changed_header(cells, names, units, wanted):
            raise base.LogError(
                "header_changes", HeaderChange(first + line + 1, changes).sentence(path), rows.rows
            )


@lru_cache
def narrowed(layout: Layout, names_to_read: frozenset[str], labels: frozenset[str]) -> Layout:
    """Skip all other columns but `labels`, if any of these hold something that can be read."""

    def kind_of(name: str, kind: Kind) -> Kind:
        if name in names_to_read and not (kind == "skip" and name in labels):
            return kind
        return "label" if name in labels else "skip"

    kinds = tuple(map(kind_of, layout.names, layout.kinds))
    if {*kinds} <= {"label", "skip"}:
        return layout
    return replace(layout, kinds=kinds)


def _log(path: Path, plan: ReadingPlan, rows: ParsedRows, first: int) -> base.Log:
    """Make a log of a block; `first`: data lines of the file above it."""
    before = plan.packets.missing if plan.packets else 0
    columns = rows.columns
    if plan.derive:
        columns = plan.derive(columns, rows.index + first if first else rows.index)
    missing = {}
    if plan.packets and plan.packets.missing > before:
        missing = {plan.packets.reason: plan.packets.missing - before}
    labels = [name for name, words in columns.items() if words.dtype == object]
    same = [name for name, values in columns.items() if values.dtype == bool]
    good = replace(rows, columns=columns) if plan.derive else rows
    for name in same:
        good = good.take(good.columns[name], plan.not_same)
    log_columns = {
        name: values.astype(float, copy=False)
        for name, values in good.columns.items()
        if name not in same and name not in labels
    }
    derived = {"time": "s"} if plan.derive and "time" not in plan.units else {}
    units = {name: derived.get(name) or plan.units.get(name, "") for name in log_columns}
    return base.Log(
        path,
        log_columns,
        units,
        rows.rows,
        good.dropped,
        missing,
        plan.notes,
        rows.not_finite,
        plan.unread,
        plan.layout.names,
        {name: good.columns[name] for name in labels},
        clock_times=plan.clock_times,
    )
