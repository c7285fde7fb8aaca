"""The one parser of text logs: blocks of whole lines, cells to numbers, the base of its readers."""

from __future__ import annotations

import codecs
import csv
import gzip
import math
import re
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain, islice
from pathlib import Path
from typing import Any, BinaryIO, Literal, NamedTuple, cast

import numpy as np

from rftfit.logs import base
from rftfit.logs.beside import HeaderChange, LabelledReader, changed_header
from rftfit.logs.sources import OTHER_SOURCE, is_meant
from rftfit.logs.stamps import seconds_of, seconds_of_column

CUT = "cut in mid-row"
CELLS = "wrong number of cells"
NUMBER = "not a number"
NO_TIME = "not a time"
GROUPED = "digits regrouped in this column: 10,114 may have been 1,0114"
"""Why a line is left out."""

OF_CELLS = frozenset({NUMBER, NO_TIME, base.FINITE, base.BLANK, GROUPED})
"""Reasons that lie in a cell: whoever does not read its column keeps the line."""

BLOCK_BYTES = 1 << 22
MAX_LINE = 1 << 16
MAX_BYTES = 1 << 36
GZIP = b"\x1f\x8b"

_FEED, _RETURN, _TAB, _BLANK, _COMMA, _ZERO, _NINE = b"\n\r\t ,09"


# --- A file as blocks of whole lines


_UTF16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_LOOKED_AT = 1000
_LINE_END = re.compile(rb"\r\n|\n|\r")


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
                # one copy, however long the block
                body = b"".join((carry, memoryview(chunk)[:stop]))
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
    with path.open("rb") as handle:
        packed = handle.read(2) == GZIP
    return cast("BinaryIO", gzip.open(path)) if packed else path.open("rb")


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
        chunk = handle.read(BLOCK_BYTES)
        if len(chunk) == BLOCK_BYTES:
            base.refuse_large_file(path, MAX_BYTES)
        utf16 = utf16_of(chunk)
        decoder = codecs.getincrementaldecoder(utf16)("replace") if utf16 else None
        chunk = _without_mark(chunk)
        while chunk:
            yield decoder.decode(chunk).encode() if decoder else chunk
            chunk = handle.read(BLOCK_BYTES)


def utf16_of(head: bytes) -> str:
    """Name the encoding of a file in UTF-16, with a byte order mark or without; empty of any other."""
    if head[:2] in _UTF16:
        return _UTF16[head[:2]]
    sample = head[:_LOOKED_AT]
    for high, encoding in enumerate(("utf-16-be", "utf-16-le")):
        # the high bytes of most letters are 0, the low ones never are
        zeros, end = sample[high::2].count(0), any(e.encode(encoding) in sample for e in "\r\n")
        if zeros * 4 > len(sample) and not sample[1 - high :: 2].count(0) and end:
            return encoding
    return ""


def _without_mark(head: bytes) -> bytes:
    return head[2:] if head[:2] in _UTF16 else head.removeprefix(codecs.BOM_UTF8)


def as_utf8(head: bytes) -> bytes:
    """Return the beginning of a file as `TextFile` shows it."""
    utf16, head = utf16_of(head), _without_mark(head)
    return head.decode(utf16, "ignore").encode() if utf16 else head


def text_head(head: bytes) -> bytes:
    """Return the same, or nothing of a binary file; of a damaged text the lines before its first zero byte."""
    lines = head
    if b"\x00" in head and not utf16_of(head):
        lines, _, _ = head[: head.index(b"\x00")].rpartition(b"\n")
        if lines.count(b"\n") < _TEXT_LINES:
            return b""
        lines += b"\n"
    text = as_utf8(lines)
    controls = len(text) - len(text.translate(None, _CONTROLS))
    return b"" if controls * _FEW_CONTROLS > len(text) else text


_TEXT_LINES = 10
"""A binary file has fewer lines before its first zero byte."""
_CONTROLS = bytes({*range(32)} - set(b"\t\n\v\f\r\x1a\x1b")) + b"\x7f"
_FEW_CONTROLS = 50
"""One in so many bytes of a text, though damaged, may be a control character; of a binary file one in ten is."""


class Line(NamedTuple):
    """One line of the head: its text, where the next one begins, whether it has a line end."""

    text: str
    stop: int
    whole: bool


def decode_first_lines(head: bytes, most: int = 400, encoding: str = "") -> list[Line]:
    """Return the first lines of a file; without an encoding UTF-8, or Windows-1252 if it is none."""
    return list(islice(each_line(head, encoding), most))


def each_line(head: bytes, encoding: str = "") -> Iterator[Line]:
    """Yield the lines of the beginning of a file."""
    start = 0
    while start < len(head):
        end = _LINE_END.search(head, start)
        stop = end.end() if end else len(head)
        raw = head[start : end.start() if end else stop]
        yield Line(decoded(raw, encoding), stop, end is not None)
        start = stop


def decoded(raw: bytes, encoding: str = "") -> str:
    """Decode names and units; by default UTF-8, or else what Windows programs write."""
    if encoding:
        return raw.decode(encoding, "replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


# --- Lines to columns: fast where a block is clean, line by line where it is not


Kind = Literal["number", "integer", "stamp", "same", "label", "skip"]

_TYPES: dict[str, Any] = {
    "number": float,
    "integer": np.int64,
    "stamp": float,
    "same": bool,
    "label": object,
}
PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
"""A number with a decimal point."""
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
NO_VALUE = ("", " ", "-", "--", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")
"""What a cell without a value holds in the tables of other programs."""
_INTEGER = re.compile(r"-?\d{1,19}")
_EMPTY_LINES = re.compile(rb"[ \t]*(?:\r\n|\n|\r)[\s]*")
_LINES_BY_HAND = 64
_ONE_PIECE = 1 << 24


@dataclass(frozen=True)
class Layout:
    """How the cells of a line are told apart, and what each holds.

    `names`: Of the columns, each once.
    `kinds`: By default all numbers. Integers are exact within 64 bits; of a cell that should always
        be the `same`, whether it is; labels are words; skipped cells may hold anything.
    `delimiter`: One character; a blank stands for any number of blanks and tabs.
    `decimal`: ``.`` or ``,``.
    `quote`: Whether cells may stand in double quotes.
    `comment`: Lines that begin with this are no data lines; empty: there are none.
    `optional`: How many of the last columns, all skipped ones, a line may leave out.
    `same`: What the cells of kind "same" should hold.
    `regrouped`: Places of columns whose digits a spreadsheet has regrouped.
    `dates`: Order of day, month and year in dates (``dmy``); empty: as each shows it.
    `no_value`: Cells that say that there is no value; the others of the row count all the same.
    `void`: Numbers that say so too.
    `mixed`: Places of columns of numbers with words among them; a word there is no value.
    `rewrites`: What to put in place of what in each line, before it is parted into cells.
    `where`: Places of columns, and the words that a row of the wanted source holds there.
    """

    names: tuple[str, ...]
    kinds: tuple[Kind, ...] = ()
    delimiter: str = ","
    decimal: str = "."
    quote: bool = False
    comment: str = ""
    optional: int = 0
    same: str = ""
    regrouped: frozenset[int] = frozenset()
    dates: str = ""
    no_value: tuple[str, ...] = ()
    void: tuple[float, ...] = ()
    mixed: frozenset[int] = frozenset()
    rewrites: tuple[tuple[re.Pattern[bytes], bytes], ...] = ()
    where: tuple[tuple[int, tuple[str, ...]], ...] = ()

    def __post_init__(self) -> None:
        if not self.kinds:
            object.__setattr__(self, "kinds", ("number",) * len(self.names))

    @property
    def places_to_read(self) -> list[int]:
        """Places of the columns that are read."""
        return [place for place, kind in enumerate(self.kinds) if kind != "skip"]

    def is_data(self, line: bytes) -> bool:
        """Tell a data line from a blank one and from a comment."""
        text = line.strip()
        return bool(text) and not (self.comment and text.startswith(self.comment.encode()))


@dataclass(frozen=True)
class ParsedRows:
    """What some lines hold.

    `columns`: Of the good rows; float64, int64, bool, or words. `index`: Of each good row, which data line
    it is, from 0: a bad line keeps its place. `rows`: Data lines; the good ones and `dropped` (by
    reason) add up to it. `blank`: Column to the good rows in which it has no value, and NaN here; only
    columns with such a row. `word_lines`: Data lines of as many cells as there are columns, none of them a number.
    """

    columns: dict[str, np.ndarray]
    index: np.ndarray
    rows: int
    dropped: dict[str, int]
    not_finite: dict[str, int] = field(default_factory=dict)
    blank: Mapping[str, np.ndarray] = field(default_factory=dict)
    word_lines: tuple[tuple[int, list[str]], ...] = ()

    def take(self, keep: np.ndarray, reason: str) -> ParsedRows:
        """Leave out the rows where `keep` is False."""
        lost = int(keep.size - np.count_nonzero(keep))
        if not lost:
            return self
        columns = {name: values[keep] for name, values in self.columns.items()}
        blank = {name: rows[keep] for name, rows in self.blank.items()}
        dropped = base.add_counts(self.dropped, {reason: lost})
        return replace(self, columns=columns, index=self.index[keep], dropped=dropped, blank=blank)


def parse(
    layout: Layout,
    body: bytes,
    last_line: bytes = b"",
    before: bytes = b"",
    *,
    keep_blanks: bool = False,
) -> ParsedRows:
    """Parse whole lines.

    `last_line`: A last line without an end. Whoever wrote it may have been stopped in it: unless it is as
    whole as the lines `before` it, it is counted and left out. `keep_blanks`: Keep rows with cells that
    have no value; these cells are NaN.
    """
    body, last_line = (rewritten(text, layout.rewrites) for text in (body, last_line))
    if layout.is_data(last_line) and _is_whole(
        layout, rewritten(before, layout.rewrites), last_line
    ):
        body, last_line = body + last_line + b"\n", b""
    n_other_rows = 0
    if layout.where:
        body, n_other_rows = _of_one_source(layout, body)
    parts = _parse(layout, body)
    if layout.is_data(last_line):
        parts.append(replace(_by_hand(layout, b""), rows=1, dropped={CUT: 1}))
    rows = _together(parts)
    if layout.void:
        rows = _without_voids(layout, rows)
    if n_other_rows:
        dropped = base.add_counts(rows.dropped, {OTHER_SOURCE: n_other_rows})
        rows = replace(rows, rows=rows.rows + n_other_rows, dropped=dropped)
    if rows.blank and not keep_blanks:
        rows = rows.take(~np.logical_or.reduce([*rows.blank.values()]), base.BLANK)
    keep, bad = base.finite_rows(base.filled_columns(rows.columns, rows.blank))
    return replace(rows, not_finite=bad).take(keep, base.FINITE)


def _without_voids(layout: Layout, rows: ParsedRows) -> ParsedRows:
    """Put no value in place of the numbers that say so."""
    columns, blank = dict(rows.columns), dict(rows.blank)
    for name, kind in zip(layout.names, layout.kinds, strict=True):
        if kind != "number" or name not in columns:
            continue
        is_void = np.isin(columns[name], layout.void)
        if is_void.any():
            columns[name] = np.where(is_void, np.nan, columns[name])
            blank[name] = blank.get(name, False) | is_void
    return replace(rows, columns=columns, blank=blank)


def _of_one_source(layout: Layout, body: bytes) -> tuple[bytes, int]:
    """Leave out the lines of other sources, and count them."""
    lines = [line for line in body.splitlines(keepends=True) if layout.is_data(line)]
    kept = np.ones(len(lines), dtype=bool)
    for place, words in layout.where:
        cells = (
            cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or ()
            for line in lines
        )
        labels = [_decoded_cell(row[place]) if place < len(row) else "" for row in cells]
        kept &= is_meant(labels, words)
    return b"".join(line for line, is_kept in zip(lines, kept, strict=True) if is_kept), int(
        np.count_nonzero(~kept)
    )


def _decoded_cell(cell: str) -> str:
    return cell if cell.isascii() else decoded(cell.encode("latin-1"))


_PARTS = re.compile(
    r"[+-]?(?P<digits>\d+)(?:[.,](?P<decimals>\d*))?(?:[eE](?P<exponent>[+-]?\d+))?"
)
_FEWEST_BEFORE = 3


def _is_whole(layout: Layout, before: bytes, last_line: bytes) -> bool:
    """Tell whether a last line without an end has all of its cells, by the lines before it.

    All cells but the last end at a delimiter. A number written in a fixed form has the digits of this form.
    Of other numbers one that was cut cannot be told from a shorter one: it counts where it is no farther
    from the one before than these are from one another, so that a cut would change it by no more.
    """
    cells = cells_of(last_line.decode("latin-1"), layout.delimiter, quote=layout.quote)
    if cells is None or len(cells) != len(layout.names):
        return False
    last, text = len(cells) - 1, cells[-1].strip()
    kind = layout.kinds[last]
    if kind == "skip" or (layout.quote and last_line.rstrip().endswith(b'"')):
        return True
    rows = (
        cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or []
        for line in before.splitlines()[1:]
    )
    column = [row[last].strip() for row in rows if len(row) == len(cells)]
    if kind not in ("number", "integer"):
        return text in column or (kind == "stamp" and {*map(len, column)} == {len(text)})
    numbers = [number for cell in column if cell and (number := _PARTS.fullmatch(cell))]
    number = _PARTS.fullmatch(text)
    if len(numbers) < _FEWEST_BEFORE or number is None or not text:
        return False
    exponents = {len(match["exponent"] or "") for match in numbers}
    if exponents != {len(number["exponent"] or "")}:
        return False
    decimals = [len(match["decimals"] or "") for match in numbers]
    places = len(number["decimals"] or "")
    if max(decimals) == min(decimals) > 0 or exponents != {0}:
        return places >= max(decimals)
    if places < min(decimals) or not text[-1].isdigit():
        return False
    if max(decimals) == 0 and len(number["digits"]) < max(
        len(match["digits"]) for match in numbers[-_FEWEST_BEFORE:]
    ):
        return False
    values = np.array([float(match[0].replace(",", ".")) for match in numbers])
    step = abs(float(text.replace(",", ".")) - values[-1])
    return bool(step <= np.abs(np.diff(values)).max())


def rewritten(body: bytes, rewrites: Iterable[tuple[re.Pattern[bytes], bytes]]) -> bytes:
    """Put cells in place of what stands for them."""
    for pattern, replacement in rewrites:
        body = pattern.sub(replacement, body)
    return body


def _parse(layout: Layout, body: bytes) -> list[ParsedRows]:
    """Parse a block; in parts where it has a bad line."""
    if b"\xe2" in body or b"\xef" in body:
        body = _MINUS.sub(b"-", body)
    if not layout.regrouped:
        fast = _fast(layout, body)
        if fast is not None:
            return [fast]
        plain = _without_thousands(layout, _with_plain_numbers(layout, body))
        if plain != body:
            return _parse_halves(layout, plain)
    return _parse_halves(layout, body, is_bad=True)


def _parse_halves(layout: Layout, body: bytes, *, is_bad: bool = False) -> list[ParsedRows]:
    """Parse a block, or its halves where it has a bad line; `is_bad`: it is known to have one."""
    if not (layout.regrouped or is_bad):
        fast = _fast(layout, body)
        if fast is not None:
            return [fast]
    if count_lines(body) > _LINES_BY_HAND:
        middle = len(body) // 2
        # never between \r and \n
        place = body.rfind(b"\n", 0, middle) + 1 or body.rfind(b"\r", 0, middle) + 1
        if 0 < place < len(body) and body[place : place + 1] != b"\n":
            return [*_parse_halves(layout, body[:place]), *_parse_halves(layout, body[place:])]
    return [_by_hand(layout, body)]


_MINUS_SIGNS = "\u2212\u2013\ufe63\uff0d"
_MINUS = re.compile(rb"(?:%b)(?=[\d.,])" % "|".join(_MINUS_SIGNS).encode())
"""A minus as typesetting writes it: the mathematical sign, the dash, the small and the wide one."""


_ODD_NUMBER = re.compile(
    r"""(?:="(?P<text>[^"]*)" | (?P<behind>\d[\d.,]*)- | \((?P<inside>\d[\d.,]*)\)
    | (?P<mantissa>[+-]?\d[\d.,]*)[dD](?P<exponent>[+-]?\d{1,3}))""",
    re.VERBOSE,
)
"""A number as Excel keeps it from being changed, with the minus behind it, as accountants write it, of Fortran."""
_MAY_BE_ODD = re.compile(r'[-)"]$|[dD]')


def plain_number(cell: str) -> str:
    """Write a number as programs do: its minus in front, its exponent behind an E, nothing around it."""
    if not cell.isascii():
        cell = _MINUS.sub(b"-", cell.encode()).decode()
    if not _MAY_BE_ODD.search(cell) or not (odd := _ODD_NUMBER.fullmatch(cell)):
        return cell
    if odd["text"] is not None:
        return odd["text"]
    if odd["mantissa"]:
        return f"{odd['mantissa']}E{odd['exponent']}"
    return f"-{odd['behind'] or odd['inside']}"


@lru_cache
def _odd_cells(delimiter: str) -> re.Pattern[bytes]:
    """Find whole cells that may be numbers in another spelling."""
    edge = rb"[\s\"%b]" % re.escape(delimiter.encode())
    number = rb"\d[\d%b]*" % b".,".replace(delimiter.encode(), b"")
    return re.compile(
        rb'="[^"\r\n]*"|(?:(?<=%b)|^)(?:%b-|\(%b\)|[+-]?%b[dD][+-]?\d{1,3})(?=%b|$)'
        % (edge, number, number, number, edge),
        re.MULTILINE,
    )


def _with_plain_numbers(layout: Layout, body: bytes) -> bytes:
    """Write the numbers of a block as programs do."""
    return _odd_cells(layout.delimiter).sub(
        lambda cell: plain_number(cell[0].decode("ascii", "replace")).encode(), body
    )


def _without_thousands(layout: Layout, body: bytes) -> bytes:
    """Take the separators of thousands out of the numbers of a block that leave no doubt.

    1,442.21 has both marks. In 1 442.21 and 1'442 the separator may be a damaged digit or decimal mark:
    there the other numbers of the column decide.
    """
    group, point = (b",", b".") if layout.decimal == "." else (b".", b",")
    delimiter = layout.delimiter.encode()
    if group in body and point in body:
        marked = _grouped(re.escape(group), point, delimiter, b"")
        body = marked.sub(lambda number: number[0].replace(group, b""), body)
    spaced = [*_grouped(_SPACE, point, delimiter, b"?").finditer(body)]
    if group != delimiter:
        # 10.204 beside a decimal comma
        spaced += _grouped(re.escape(group), point, delimiter, b"?").finditer(body)
        spaced.sort(key=re.Match.start)
    if not spaced:
        return body
    numbers_of: dict[int, list[re.Match[bytes]]] = {}
    for number in spaced:
        numbers_of.setdefault(_column_of(layout, body, number.start()), []).append(number)
    lines = islice(filter(layout.is_data, body.splitlines()), _LINES_OF_EVIDENCE)
    rows = [
        cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or []
        for line in lines
    ]
    doubtful: set[re.Match[bytes]] = set()
    for place, numbers in numbers_of.items():
        column = [cells[place].strip(" \t") for cells in rows if place < len(cells)]
        doubtful |= _doubtful_thousands(numbers, column, point)
        between = group.decode()
        if any(between in cell and not IN_THOUSANDS[between].fullmatch(cell) for cell in column):
            # a decimal mark, whatever the config says
            doubtful |= {number for number in numbers if group in number[0]}
    pieces: list[bytes] = []
    stop = 0
    for number in spaced:
        if number in doubtful:
            continue
        whole, mark, decimals = number[0].partition(point)
        whole = re.sub(_SPACE, b"", whole).replace(group, b"")
        pieces += [body[stop : number.start()], whole, mark, decimals]
        stop = number.end()
    return b"".join([*pieces, body[stop:]])


_LINES_OF_EVIDENCE = 1000
IN_THOUSANDS = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:\{mark}\d{{3}})+(?:[.,]\d*)?") for mark in ",."
}
"""A number with a mark between its thousands."""


def _column_of(layout: Layout, body: bytes, place: int) -> int:
    """Which cell of its line stands at this place of a block."""
    start = body.rfind(b"\n", 0, place) + 1
    start = max(start, body.rfind(b"\r", start, place) + 1)
    before = body[start:place].rstrip(b'"').decode("latin-1") + "0"
    return len(cells_of(before, layout.delimiter, quote=layout.quote) or "0") - 1


def _doubtful_thousands(
    spaced: Sequence[re.Match[bytes]], column: Sequence[str], point: bytes
) -> set[re.Match[bytes]]:
    """Numbers of a column whose blanks may be something else than separators of thousands.

    All, where other numbers of the column have as many digits and no blank. Those without a decimal mark,
    where the column has decimal marks, unless it has both: whole numbers, and thousands with a mark.
    """
    mark = point.decode()
    plain = [cell.replace(mark, ".", 1) for cell in column if mark == "." or "." not in cell]
    plain = [cell.lstrip("+-") for cell in plain if PLAIN_NUMBER.fullmatch(cell)]
    digits = [len(re.split("[.eE]", cell)[0]) for cell in plain]
    wholes = [re.sub(rb"[^\d]", b"", number[0].partition(point)[0]) for number in spaced]
    if max(digits, default=0) >= min(len(whole.lstrip(b"+-")) for whole in wholes):
        return {*spaced}
    without_mark = {number for number in spaced if point not in number[0]}
    has_marks = len(without_mark) < len(spaced)
    has_wholes = not all("." in cell for cell in plain)
    is_safe = has_wholes if has_marks else not any("." in cell for cell in plain)
    return set() if is_safe else without_mark


_SPACE = rb"(?:[ '\xa0\x92]|\xc2\xa0|\xe2\x80[\x89\xaf\x99])"
"""Blanks, narrow ones and apostrophes, in UTF-8 and as Windows writes them."""


@lru_cache
def _grouped(group: bytes, point: bytes, delimiter: bytes, whole: bytes) -> re.Pattern[bytes]:
    """Find grouped numbers; `whole`: ``?`` where one needs no decimal mark."""
    number = rb"[+-]?\d{1,3}(?:%b\d{3})+(?:%b\d*)%b(?:[eE][+-]?\d+)?" % (
        group,
        re.escape(point),
        whole,
    )
    if group == delimiter:  # such a number stands in quotes
        return re.compile(rb'(?<=")%b(?=")' % number)
    end = rb'[^"\s%b]' % re.escape(delimiter)
    return re.compile(rb"(?<!%b)%b(?!%b)" % (end, number, end))


def _together(parts: list[ParsedRows]) -> ParsedRows:
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(rows.rows for rows in parts)])
    index = [rows.index + start for rows, start in zip(parts, starts[:-1], strict=True)]
    names = parts[0].columns
    columns = {name: np.concatenate([rows.columns[name] for rows in parts]) for name in names}
    dropped = base.add_counts(*(rows.dropped for rows in parts))
    blank = {
        name: np.concatenate(
            [rows.blank.get(name, np.zeros(rows.index.size, bool)) for rows in parts]
        )
        for name in names
        if any(name in rows.blank for rows in parts)
    }
    word_lines = tuple(
        (line + int(start), cells)
        for rows, start in zip(parts, starts[:-1], strict=True)
        for line, cells in rows.word_lines
    )
    return ParsedRows(
        columns, np.concatenate(index), int(starts[-1]), dropped, blank=blank, word_lines=word_lines
    )


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


def _fast(layout: Layout, body: bytes) -> ParsedRows | None:
    """Parse lines without a single bad one, or give None."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    if "integer" in layout.kinds and (b"x" in body or b"X" in body):
        return None  # 0x10 would be a number to the fast parser
    if not body or body.isspace():
        return _by_hand(layout, b"")
    if layout.delimiter == " ":
        body = _single_blanks(body)
    if body.startswith(codecs.BOM_UTF8):
        return None  # which the fast parser would pass over, in any row that begins a block
    width = len(layout.names)
    if layout.optional:
        line = body.partition(b"\n")[0]
        width = min(width, line.count(layout.delimiter.encode()) + 1)
        if width < len(layout.names) - layout.optional:
            return None
    try:
        table = pacsv.read_csv(pa.BufferReader(body), **_options(layout, width))
    except (pa.ArrowInvalid, pa.ArrowKeyError):
        return None
    if table.num_rows != count_lines(body):
        # blank lines, or a quote that swallowed line ends
        dense = _EMPTY_LINES.sub(b"\n", body).lstrip(b"\n")
        return _fast(layout, dense) if len(dense) < len(body) else None
    try:
        return _rows_of_table(layout, table)
    except pa.ArrowInvalid:
        return None


def _rows_of_table(layout: Layout, table: Any) -> ParsedRows | None:
    """Turn the cells of an Arrow table into values, or give None; Arrow's own error where its text is none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    columns = {}
    blank = {}
    for place in layout.places_to_read:
        column = table.column(str(place))
        cells = column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()
        if layout.kinds[place] == "same":
            columns[layout.names[place]] = pc.equal(cells, layout.same.encode()).to_numpy(
                zero_copy_only=False
            )
            continue
        if layout.kinds[place] == "label":
            columns[layout.names[place]] = _words_of(cells)
            continue
        if place in layout.mixed:
            cells = numbers_among_words(cells, layout.decimal)
        elif layout.kinds[place] == "stamp" and layout.no_value:
            values_without = pc.is_in(pc.utf8_trim(cells, " \t"), pa.array(layout.no_value))
            cells = pc.if_else(values_without, pa.scalar(None, pa.string()), cells)
        missing = np.asarray(cells.is_null()) if cells.null_count else None
        if layout.kinds[place] == "stamp":
            filled = cells.drop_null()
            values = seconds_of_column(filled, layout.dates) if len(filled) else np.empty(0)
            if values is None:
                return None
            if missing is not None:
                times = np.full(missing.size, np.nan)
                times[~missing] = values
                values = times
        elif missing is not None and layout.kinds[place] == "integer":
            return None
        else:
            values = cells.to_numpy(zero_copy_only=False)
        if missing is not None:
            blank[layout.names[place]] = missing
        columns[layout.names[place]] = values
    return ParsedRows(columns, np.arange(table.num_rows), table.num_rows, {}, blank=blank)


def _words_of(cells: Any) -> np.ndarray:
    """Texts of an Arrow column of bytes, shape (n,), without the blanks around them."""
    encoded = cells.dictionary_encode()
    words = [decoded(word or b"").strip() for word in encoded.dictionary.to_pylist()]
    texts: np.ndarray = np.array([*words, ""], dtype=object)
    places = encoded.indices.fill_null(len(words)).to_numpy(zero_copy_only=False)
    return np.asarray(texts[places])


def numbers_among_words(cells: Any, decimal: str = ".") -> Any:
    """Read the numbers of an Arrow column of text; all else is no value."""
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = pc.utf8_trim(cells.cast(pa.string()), " \t")
    pattern = PLAIN_NUMBER.pattern if decimal == "." else PLAIN_NUMBER.pattern.replace(r"\.", ",")
    is_number = pc.match_substring_regex(cells, f"^(?:{pattern})$")
    numbers = pc.if_else(is_number, cells, pa.scalar(None, pa.string()))
    # the cast knows no plus sign
    numbers = pc.replace_substring(pc.utf8_ltrim(numbers, "+"), ",", ".")
    return numbers.cast(pa.float64())


@lru_cache(64)
def _options(layout: Layout, width: int) -> dict[str, Any]:
    """Make the settings of the fast parser; making them costs as much as parsing some hundred rows."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    types = {"number": pa.float64(), "integer": pa.int64(), "stamp": pa.string()}
    names = [str(place) for place in range(width)]
    column_types = {name: types.get(layout.kinds[int(name)], pa.binary()) for name in names}
    column_types |= {str(place): pa.binary() for place in layout.mixed}
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
            column_types=column_types,
            include_columns=[str(place) for place in layout.places_to_read],
            decimal_point=layout.decimal,
            null_values=list(layout.no_value),
            check_utf8=False,
        ),
    }


def _single_blanks(body: bytes) -> bytes:
    """Put one blank between cells, and none at either end of a line."""
    text = np.frombuffer(body, dtype=np.uint8)
    # the last blank of each run stays, if a cell follows
    blank = (text == _BLANK) | (text == _TAB)
    drop = np.ones(text.size, dtype=bool)
    follows = text[1:]
    np.logical_and(blank[:-1], blank[1:] | (follows == _FEED) | (follows == _RETURN), out=drop[:-1])
    drop[-1] = blank[-1]
    text = text[~drop]
    if text.size:
        # and goes, if no cell is before it
        end = (text == _FEED) | (text == _RETURN)
        drop = (text == _BLANK) | (text == _TAB)
        drop[1:] &= end[:-1]
        text = text[~drop]
    return text.tobytes().replace(b"\t", b" ")


def _by_hand(layout: Layout, body: bytes) -> ParsedRows:
    """Parse line by line and count what is wrong with the bad ones."""
    values: list[list[Any]] = [[] for _ in layout.places_to_read]
    index: list[int] = []
    dropped: dict[str, int] = {}
    word_lines: list[tuple[int, list[str]]] = []
    rows = 0
    for line in filter(layout.is_data, body.splitlines()):
        row_or_reason = _row(layout, line)
        if isinstance(row_or_reason, str):
            dropped[row_or_reason] = dropped.get(row_or_reason, 0) + 1
            if row_or_reason == NUMBER and (words := _only_words(layout, line)):
                word_lines.append((rows, words))
        else:
            for column, value in zip(values, row_or_reason, strict=True):
                column.append(value)
            index.append(rows)
        rows += 1
    columns = {}
    blank = {}
    for place, column in zip(layout.places_to_read, values, strict=True):
        name = layout.names[place]
        if None in column:
            blank[name] = np.array([value is None for value in column])
        columns[name] = np.array(column, dtype=_TYPES[layout.kinds[place]])  # NaN of None
    return ParsedRows(
        columns,
        np.array(index, dtype=np.int64),
        rows,
        dropped,
        blank=blank,
        word_lines=tuple(word_lines),
    )


def _only_words(layout: Layout, line: bytes) -> list[str]:
    """Cells of a line without a single number, as of a header that stands there again; empty of another."""
    cells = cells_of(decoded(line), layout.delimiter, quote=layout.quote) or []
    if any(PLAIN_NUMBER.fullmatch(cell.strip().replace(",", ".")) for cell in cells):
        return []
    return cells


def _row(layout: Layout, line: bytes) -> list[Any] | str:
    """Values of the wanted cells, None of one without a value, or the reason why the line is bad."""
    cells = cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote)
    most = len(layout.names)
    if cells is None or not most - layout.optional <= len(cells) <= most:
        return CELLS
    values: list[Any] = []
    for place in layout.places_to_read:
        cell, kind = cells[place].strip(" \t"), layout.kinds[place]
        if kind == "same":
            values.append(cells[place] == layout.same)
        elif kind == "label":
            values.append(_decoded_cell(cells[place]).strip())
        elif kind == "integer":
            if not _INTEGER.fullmatch(cell) or abs(int(cell)) >= 1 << 63:
                return NUMBER
            values.append(int(cell))
        elif cell in layout.no_value:
            values.append(None)
        elif kind == "stamp":
            values.append(seconds_of(cell, layout.dates))
            if math.isnan(values[-1]):
                return NO_TIME
        else:
            if layout.decimal == ",":
                if place in layout.regrouped and _GROUPED.fullmatch(cell):
                    return GROUPED
                cell = "." if "." in cell else cell.replace(",", ".")
            if PLAIN_NUMBER.fullmatch(cell):
                values.append(float(cell))
            elif place in layout.mixed:
                values.append(None)
            elif _NOT_FINITE.fullmatch(cell):
                values.append(float(cell))
            else:
                return NUMBER
    return values


def cells_of(line: str, delimiter: str, *, quote: bool = True) -> list[str] | None:
    """Split a line into its cells; none where the quotes do not match."""
    if delimiter == " ":
        return [cell for cell in line.replace("\t", " ").split(" ") if cell]
    if not quote or '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True), [])
    except csv.Error:
        return None


# --- Numbers whose digits a spreadsheet has regrouped, so that they read as other numbers


_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
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
                if cell.count(",") > 1 and _GROUPED.fullmatch(cell.strip(" \t"))
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


class TextReader(LabelledReader, ABC):
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
        self.check_asked(path, plan.unread, plan.layout.names)
        names_to_read = {*self.choose_columns(plan.layout.names), *plan.keep}
        layout = narrowed(plan.layout, names_to_read, plan.labels - {*self.where})
        if regrouped := regrouped_columns(path, layout, plan.start):
            layout = replace(layout, regrouped=regrouped)
            notes = [_REGROUPED.format(layout.names[place]) for place in sorted(regrouped)]
            plan = replace(plan, notes=(*plan.notes, *notes))
        first = 0

        def parsed(block: Block) -> ParsedRows:
            return parse(layout, *block, keep_blanks=self.keeps_blanks)

        for rows in base.parallel_map(parsed, blocks):
            _refuse_changed_header(path, plan, layout, rows, first)
            if rows.rows:
                yield _log(path, plan, rows, first)
            first += rows.rows
        if first == 0:
            raise base.LogError("header_only", f"{path}: a header and no data")


def _refuse_changed_header(
    path: Path, plan: ReadingPlan, layout: Layout, rows: ParsedRows, first: int
) -> None:
    """Refuse a file in which the header stands again and says something else of a column that is read."""
    names, units = plan.header
    wanted = [place for place in layout.places_to_read if layout.kinds[place] != "label"]
    for line, cells in rows.word_lines if names else ():
        if changes := changed_header(cells, names, units, wanted):
            raise base.LogError(
                "header_changes", HeaderChange(first + line + 1, changes).sentence(path), rows.rows
            )


def narrowed(layout: Layout, names_to_read: set[str], labels: Collection[str] = ()) -> Layout:
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
    good = replace(rows, columns=columns)
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
    )
