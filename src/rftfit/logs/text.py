"""Reads text logs: a file as blocks of whole lines, blocks to columns of numbers, and the base of all such readers.

The way of a file: `TextFile` gives its head (first 64 kB) and blocks of whole lines -> a reader makes a `ReadingPlan`
of the head (`TextReader.plan`): the `Layout` says how a line is split and what each column holds -> columns that nobody
asked for are left out (`narrow`) -> each block is parsed to rows and becomes a `Log` (`logs_of`). Columns have indices
from 0.
"""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from io import BufferedReader
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rftfit.logs import base
from rftfit.logs.labels import LabelledReader, changed_header
from rftfit.logs.sources import check_where
from rftfit.table.parse import OTHER_SOURCE, REGROUPED, Kind, Layout, ParsedRows, parse
from rftfit.table.text import utf16_of, without_byte_order_mark

BLOCK_BYTES = 1 << 22
"""Bytes that are read at a time."""
MAX_LINE: int = base.BOUNDS.line_bytes
"""Longest line, bytes."""
MAX_BYTES: int = base.BOUNDS.file_bytes
"""Largest file, bytes."""
GZIP = b"\x1f\x8b"
"""First bytes of a file that is packed by gzip."""


# --- A file as blocks of whole lines


class Block(NamedTuple):
    """Whole lines of a file (`body`); in the last block also the text behind the last line end.

    `last_line`: This text, empty in other blocks. `before`: The end of the lines before it, by which `parse` judges it.
    """

    body: bytes
    last_line: bytes
    before: bytes = b""


_BEFORE_BYTES = 4096
"""Most bytes of `Block.before`."""


class TextFile:
    """A text file that is read once, in blocks, so that memory stays bounded.

    UTF-16 becomes UTF-8 and a byte order mark is left out; other encodings stay as they are, since
    numbers look the same in all of them. `head`: The first 64 kB. Raises `LogError` for an empty file.
    """

    def __init__(self, path: Path) -> None:
        self._chunks = _chunks(path)
        self._first_chunk = next(self._chunks, b"")
        self.head = self._first_chunk[: base.HEAD_BYTES]
        if not self._first_chunk or self._first_chunk.isspace():
            raise base.LogError("empty", f"{path}: the file is empty")

    def blocks(self, start: int) -> Iterator[Block]:
        """Yield the file in blocks, without its first `start` bytes, which must lie in `head`; possible once.

        Lines end with a line feed, a carriage return or both.
        """
        # `carry`: a line whose end is not read yet; `before`: as in `Block`
        carry = before = b""
        first_chunk, self._first_chunk = self._first_chunk[start:], b""
        for chunk in chain([first_chunk], self._chunks):
            if carry.endswith(b"\r"):
                # a \r at the end may be half of \r\n: it moves to the next chunk
                chunk = carry[-1:] + chunk  # noqa: PLW2901
                carry = carry[:-1]
            stop = _behind_last_line(chunk, len(chunk) - chunk.endswith(b"\r"))
            if stop:
                # copies a block at most once, and not at all where the file is one block
                is_whole = not carry and stop == len(chunk)
                body = chunk if is_whole else b"".join((carry, memoryview(chunk)[:stop]))
                before = (before + body[-_BEFORE_BYTES:])[-_BEFORE_BYTES:]
                yield Block(body, b"")
                carry = chunk[stop:]
            else:
                carry += chunk
            if len(carry) > MAX_LINE:
                # no table has such lines: only its start is kept, and the zero byte prevents that it parses as a row
                carry = carry[:64].replace(b"\r", b"") + b"\x00"
        if carry:
            stop = _behind_last_line(carry, len(carry))
            yield Block(carry[:stop], carry[stop:], (before + carry[:stop])[-_BEFORE_BYTES:])


def _behind_last_line(content: bytes, stop: int) -> int:
    """Return the offset behind the last line end before `stop`; 0 where there is none."""
    return max(content.rfind(b"\n", 0, stop), content.rfind(b"\r", 0, stop)) + 1


def opened(path: Path) -> BufferedReader | gzip.GzipFile:
    """Open a file to be read, unpacked if it is packed by gzip."""
    handle = path.open("rb")
    if not handle.peek(len(GZIP)).startswith(GZIP):
        return handle
    handle.close()
    return gzip.open(path)


@contextmanager
def unpacking_errors(path: Path) -> Iterator[None]:
    """Turn errors of unpacking in the block into a `LogError`."""
    try:
        yield
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        problem = f"damaged or cut short as packed by gzip ({error})"
        raise base.LogError("damaged", f"{path}: {problem}; unpack what there is of it") from error


def _chunks(path: Path) -> Iterator[bytes]:
    """Yield pieces of a file, unpacked, without a byte order mark; UTF-16 becomes UTF-8."""
    with base.file_errors(path), unpacking_errors(path), opened(path) as handle:
        if isinstance(handle, gzip.GzipFile):
            # a first pass, which keeps nothing: a small file may unpack to any size
            while handle.read(BLOCK_BYTES):
                base.check_unpacked(path, handle.tell())
            handle.seek(0)
        chunk = handle.read(BLOCK_BYTES)
        if len(chunk) == BLOCK_BYTES:
            base.refuse_large_file(path, MAX_BYTES)
        utf16 = utf16_of(chunk)
        decoder = codecs.getincrementaldecoder(utf16)("replace") if utf16 else None
        chunk = without_byte_order_mark(chunk)
        while chunk:
            yield decoder.decode(chunk).encode() if decoder else chunk
            chunk = handle.read(BLOCK_BYTES)


# --- Numbers whose digits a spreadsheet has regrouped, so that they read as other numbers


_TWO_COMMAS = re.compile(rb",\d{3},\d{3}")


def regrouped_columns(path: Path, layout: Layout, start: int) -> frozenset[int]:
    """Return the indices of columns to be read with two decimal commas in one number, behind the first `start` bytes.

    A spreadsheet that writes 1,000,292 for 100,0292 also writes 10,114 for 1,0114, which is a valid number and wrong.
    So a single cell with two commas makes its whole column doubtful.
    """
    regrouped: set[int] = set()
    if layout.decimal != "," or layout.delimiter == ",":
        return frozenset()
    for body, _, _ in TextFile(path).blocks(start):
        for line in filter(_TWO_COMMAS.search, body.splitlines()):
            regrouped |= {
                column
                for column, cell in enumerate(layout.split(line))
                if cell.count(",") > 1 and REGROUPED.fullmatch(cell.strip(" \t"))
            }
    return frozenset(regrouped.intersection(layout.columns_to_read))


# --- Base of the readers of text: a header that states the layout, then rows


Derive = Callable[["dict[str, np.ndarray]", "np.ndarray"], "dict[str, np.ndarray]"]
"""Type of `ReadingPlan.derive`."""

_REGROUPED = (
    "{}: numbers with two decimal commas: a spreadsheet has regrouped the digits of this column, so "
    "most of its rows cannot be told; export it again with decimal points, or do not name the column"
)


@dataclass(frozen=True)
class ReadingPlan:
    """Plan for reading one file, made from its header.

    `layout`: How a line is split into cells, and the names and kinds of the columns.
    `units`: Column of the log to its unit, where the file states one.
    `start`: Offset in the file, unpacked and as UTF-8, at which the rows begin, bytes.
    `derive`: Function that makes the columns of the log, ``time`` in s among them, from the columns of a block and
        from the number of each row among the data lines of the file, from 0; None: the log has the columns of the file.
    `packets`: Counter of lost packets, which `derive` feeds, for instruments that number them; None for others.
    `keep`: Columns that are always parsed, because `derive` needs them.
    `not_good`: Reason to drop a row in which a column of true and false, which `derive` has made, is false; such
        columns are not part of the log.
    `notes`: Sentences for `Log.notes`.
    `refusal`: Why the file cannot be used, although its rows can be counted; empty: it can.
    `unread`: Column without numbers in the first rows, to the reason why it is not read.
    `labels`: Columns of words or of few whole numbers, not asked for, which may say where a row is from.
    `header`: Each name in the header to its unit, for comparison with a header that is repeated further below.
    `clock_times`: Columns of times of day without a date.
    """

    layout: Layout
    units: Mapping[str, str]
    start: int
    derive: Derive | None = None
    packets: base.PacketCount | None = None
    keep: frozenset[str] = frozenset()
    not_good: str = ""
    notes: tuple[str, ...] = ()
    refusal: str = ""
    unread: Mapping[str, str] = field(default_factory=dict)
    labels: frozenset[str] = frozenset()
    header: Mapping[str, str] = field(default_factory=dict)
    clock_times: frozenset[str] = frozenset()


class TableReader(LabelledReader):
    """Base of the readers of tables whose cells are text, from text files or workbooks."""

    def narrow(self, path: Path, plan: ReadingPlan) -> ReadingPlan:
        """Return the plan without the columns that nobody asked for: damage in them then does no harm.

        Raises `LogError` if a column asked for holds no numbers, or one of `where` is not there.
        """
        layout = plan.layout
        if self.where:
            check_where(path, self.where, layout.names)
        self.check_asked(path, plan.unread, layout.names)
        names_to_read = plan.keep.union(self.choose_columns(layout.names))
        labels = plan.labels.difference(self.where)
        return replace(plan, layout=_narrowed(layout, names_to_read, labels))

    def logs_of(self, path: Path, plan: ReadingPlan, blocks: Iterable[Block]) -> Iterator[base.Log]:
        """Parse the rows of a table, block by block, each to a log; raises `LogError` if there is no row."""
        has_rows, rows_before = False, 0

        def parse_block(block: Block) -> ParsedRows:
            """Parse a block, in a thread of its own."""
            return parse(plan.layout, *block, keep_blanks=self.keeps_blanks)

        for rows in base.parallel_map(parse_block, blocks):
            _refuse_changed_header(path, plan, rows, rows_before)
            if rows.rows:
                has_rows = True
                yield _log_of_rows(path, plan, rows, rows_before)
            # as within a block, rows of other sources have no number
            rows_before += rows.rows - rows.dropped.get(OTHER_SOURCE, 0)
        if not has_rows:
            raise base.LogError("header_only", f"{path}: a header and no data")


class TextReader(TableReader, ABC):
    """Base of the dialects of text; a dialect has to define only `plan`."""

    @abstractmethod
    def plan(self, head: bytes) -> ReadingPlan:
        """Find out from the first 64 kB of a file how to read it.

        Raises ValueError if it cannot be read that way; the message says what was found and what is
        allowed.
        """

    def stream(self, path: Path) -> Iterator[base.Log]:
        """Read a file in blocks of some megabytes, as the plan for its head says."""
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
            notes = [_REGROUPED.format(plan.layout.names[column]) for column in sorted(regrouped)]
            layout = replace(plan.layout, regrouped=regrouped)
            plan = replace(plan, layout=layout, notes=(*plan.notes, *notes))
        yield from self.logs_of(path, plan, blocks)


def _refuse_changed_header(
    path: Path, plan: ReadingPlan, rows: ParsedRows, rows_before: int
) -> None:
    """Raise `LogError` if a repeated header gives a column to be read another name or unit, as in joined files.

    `rows`, `rows_before`: Parsed rows of a block, and the number of data lines of the file above it.
    """
    layout = plan.layout
    readings = [column for column in layout.columns_to_read if layout.kinds[column] != "label"]
    for line, cells in rows.word_lines if plan.header else ():
        if changes := changed_header(cells, plan.header, readings):
            repeated = f"the header stands again in data line {rows_before + line + 1}"
            raise base.LogError(
                "header_changes",
                f"{path}: {repeated} and says something else: {'; '.join(changes)}; "
                "allowed: the same columns and units in the whole log: cut the file there",
                rows.rows,
            )


def _narrowed(layout: Layout, names_to_read: frozenset[str], labels: frozenset[str]) -> Layout:
    """Return a layout that skips all columns but `names_to_read` and `labels`; unchanged if no reading were left.

    `labels`: Columns that are kept as texts, to tell sources apart.
    """

    def kind_of(name: str, kind: Kind) -> Kind:
        """Return the kind of a column in the new layout: a column of words may be a label, but is no reading."""
        if name in names_to_read and not (kind == "skip" and name in labels):
            return kind
        return "label" if name in labels else "skip"

    kinds = tuple(map(kind_of, layout.names, layout.kinds))
    if {*kinds} <= {"label", "skip"}:
        return layout
    return replace(layout, kinds=kinds)


def _log_of_rows(path: Path, plan: ReadingPlan, rows: ParsedRows, rows_before: int) -> base.Log:
    """Make a log of the parsed rows of a block; `rows_before`: number of data lines of the file above the block.

    Columns of true and false become dropped rows, columns of words the labels of the log.
    """
    missing_before = plan.packets.missing if plan.packets else 0
    if plan.derive:
        # the counter of packets counts those of this block, too
        derived = plan.derive(rows.columns, rows.line_numbers + rows_before)
        rows = replace(rows, columns=derived)
    missing = {}
    if plan.packets and plan.packets.missing > missing_before:
        missing = {plan.packets.reason: plan.packets.missing - missing_before}
    for name in [name for name, values in rows.columns.items() if values.dtype == bool]:
        rows = rows.take(rows.columns[name], plan.not_good)
    numbers = {
        name: values.astype(float, copy=False)
        for name, values in rows.columns.items()
        if values.dtype not in (bool, object)
    }
    units = {"time": "s", **plan.units} if plan.derive else plan.units
    return base.Log(
        path,
        numbers,
        {name: units.get(name, "") for name in numbers},
        rows.rows,
        rows.dropped,
        missing,
        plan.notes,
        not_finite=rows.not_finite,
        unread=plan.unread,
        names_in_file=plan.layout.names,
        labels={name: values for name, values in rows.columns.items() if values.dtype == object},
        clock_times=plan.clock_times,
    )
