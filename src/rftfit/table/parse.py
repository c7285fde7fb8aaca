"""Parses lines of a table to columns, and counts bad rows by reason: fast by Arrow, line by line where a line is bad.

A *block* is some whole lines of a file, in bytes (`body`); a file is parsed block by block. A `Layout` states how its
lines are split into cells and what each column holds; it is guessed by `rftfit.logs.delimited` or stated by a dialect.
The result is `ParsedRows`: columns of the good rows, and counts of the bad ones by the reasons below.
"""

from __future__ import annotations

import codecs
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import compress, islice
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from rftfit.table.numbers import IN_THOUSANDS, MINUS, NOT_FINITE, PLAIN_NUMBER, plain_number
from rftfit.table.stamps import seconds_of, seconds_of_column
from rftfit.table.text import cells_of, decoded

_FEED, _RETURN, _TAB, _BLANK = b"\n\r\t "

# --- Reasons why a row is left out: sentences of the ledger, under which the rows are counted


NAN_OR_INFINITE = "NaN or infinite"
BLANK = "no value in a cell"
OTHER_SOURCE = "of another source (`where` in the config)"
CUT = "cut in mid-row"
WRONG_CELLS = "wrong number of cells"
NO_NUMBER = "not a number"
NO_TIME = "not a time"
GROUPED = "digits regrouped in this column: 10,114 may have been 1,0114"

OF_CELLS = frozenset({NO_NUMBER, NO_TIME, NAN_OR_INFINITE, BLANK, GROUPED})
"""Reasons that lie in one cell: a reader that does not need its column keeps the line."""


def add_counts(*counts: Mapping[str, int]) -> dict[str, int]:
    """Add up counts of rows by reason: one dict with the sum of each reason."""
    total: Counter[str] = Counter()
    for count in counts:
        total.update(count)
    return dict(total)


def finite_rows(
    columns: Mapping[str, np.ndarray], blank: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, int]]:
    """Find the rows that have only finite numbers, as no other row can be used.

    `columns`: Name to values, shape (n,), of which those of type float count. `blank`: Column to the rows in which it
    has no value, bool of shape (n,): NaN is allowed there. Returns which rows are good, bool of shape (n,), and column
    to its number of cells that are not finite, only of columns with such cells.
    """
    is_good = np.ones(next(iter(columns.values())).size, dtype=bool)
    not_finite = {}
    for name, values in columns.items():
        if values.dtype == float:
            finite = np.isfinite(values)
            if name in blank:
                finite |= blank[name]
            if count := int(finite.size - np.count_nonzero(finite)):
                not_finite[name] = count
                is_good &= finite
    return is_good, not_finite


def are_allowed(labels: Sequence[object], allowed: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Return which of the labels of n rows are `allowed`, bool of shape (n,); as numbers, 2 and 2.0 are equal.

    A log may hold several sources, told apart by a label in each row; the config states which of them counts.
    """
    numbers = {*map(_number_or_none, allowed)} - {None}

    def is_allowed(label: str) -> bool:
        """Return whether a stripped label is allowed, as a text or as a number."""
        return label in allowed or _number_or_none(label) in numbers

    # few different labels stand in many rows
    allowed_by_label = {label: is_allowed(str(label).strip()) for label in {*labels}}
    return np.array([allowed_by_label[label] for label in labels], dtype=bool)


def _number_or_none(label: str) -> float | None:
    """Return a label as a number; None where it is none."""
    try:
        return float(label)
    except ValueError:
        return None


# --- How a line is split into cells, and what comes of many lines


Kind = Literal["number", "integer", "stamp", "label", "word", "skip"]
"""What the cells of a column hold: a number, read as float; an integer, exact within 64 bits; a stamp, a time as text,
read in s by `rftfit.table.stamps`; a label, any text; a word, a text of which few differ, for `read_cells_of` alone; a
cell that is skipped, whatever it holds."""


@dataclass(frozen=True)
class Layout:
    """How to split a line into cells, and what each cell holds. Indices of columns count from 0.

    `names`: Unique names of the columns.
    `kinds`: Kind of each column; by default all are numbers.
    `delimiter`: One character; a blank stands for any number of blanks and tabs.
    `decimal`: Decimal mark, ``.`` or ``,``. `other_decimal`: Indices of columns whose numbers have the other mark.
    `quote`: Whether cells may be in double quotes.
    `comment`: Beginning of lines that are no data lines; empty: there are none.
    `optional`: Number of columns at the end, all skipped ones, that a line may lack.
    `regrouped`: Indices of columns whose digits a spreadsheet has regrouped (see `REGROUPED`).
    `dates`: Order of day, month and year in dates (``dmy``); empty: each date must show the order.
    `no_value`: Texts of cells without a value; the other cells of such a row are still read.
    `void`: Numbers that stand for no value, such as -999.
    `mixed`: Indices of columns of numbers with words among them; a word there is no value.
    `rewrites`: Patterns and their replacements in each line, before it is split into cells, for lines with words
        around their cells.
    `where`: Pairs of the index of a column and of labels: a row is read if its cell there is one of these labels.
    """

    names: tuple[str, ...]
    kinds: tuple[Kind, ...] = ()
    delimiter: str = ","
    decimal: str = "."
    quote: bool = False
    comment: str = ""
    optional: int = 0
    regrouped: frozenset[int] = frozenset()
    dates: str = ""
    no_value: tuple[str, ...] = ()
    void: tuple[float, ...] = ()
    mixed: frozenset[int] = frozenset()
    rewrites: tuple[tuple[re.Pattern[bytes], bytes], ...] = ()
    where: tuple[tuple[int, tuple[str, ...]], ...] = ()
    other_decimal: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        if not self.kinds:
            object.__setattr__(self, "kinds", ("number",) * len(self.names))

    @property
    def columns_to_read(self) -> list[int]:
        """Indices of the columns that are read: all but the skipped ones."""
        return [column for column, kind in enumerate(self.kinds) if kind != "skip"]

    def decimal_of(self, column: int) -> str:
        """Return the decimal mark of a column, by its index."""
        if column in self.other_decimal:
            return "," if self.decimal == "." else "."
        return self.decimal

    def split(self, line: bytes) -> list[str]:
        """Return the cells of a line as Latin-1, which any bytes can be read as; no cell if quotes do not match.

        Numbers are the same in Latin-1; a cell of words gets its true letters by `_decoded_cell`.
        """
        return cells_of(line.decode("latin-1"), self.delimiter, quote=self.quote) or []

    def is_data(self, line: bytes) -> bool:
        """Return whether a line is neither blank nor a comment."""
        text = line.strip()
        return bool(text) and not (self.comment and text.startswith(self.comment.encode()))


@dataclass(frozen=True)
class ParsedRows:
    """Columns of the n good rows of some lines, and counts of the bad ones. A data line is no blank line or comment.

    `columns`: Name of each column that is read to its values, shape (n,): float64, int64, or texts.
    `line_numbers`: Number of the data line of each good row, from 0, shape (n,); bad lines are counted, too, but not
        those of another source.
    `rows`: Number of data lines, which is n plus all counts in `dropped`.
    `dropped`: Reason to the number of rows that are left out for it.
    `not_finite`: Column to the number of its cells that are NaN or infinite.
    `blank`: Column to the good rows in which it has no value, bool of shape (n,), and NaN in `columns`; only of
        columns with such a row.
    `word_lines`: Number and cells of the data lines with as many cells as there are columns and no number, such as a
        header that is repeated where a log was started again.
    """

    columns: dict[str, np.ndarray]
    line_numbers: np.ndarray
    rows: int
    dropped: dict[str, int]
    not_finite: dict[str, int] = field(default_factory=dict)
    blank: Mapping[str, np.ndarray] = field(default_factory=dict)
    word_lines: tuple[tuple[int, list[str]], ...] = ()

    def take(self, keep: np.ndarray, reason: str) -> ParsedRows:
        """Return the rows where `keep`, bool of shape (n,), is True; the others are counted under `reason`."""
        lost = int(keep.size - np.count_nonzero(keep))
        if not lost:
            return self
        return replace(
            self,
            columns={name: values[keep] for name, values in self.columns.items()},
            line_numbers=self.line_numbers[keep],
            dropped=add_counts(self.dropped, {reason: lost}),
            blank={name: is_blank[keep] for name, is_blank in self.blank.items()},
        )


def parse(
    layout: Layout,
    body: bytes,
    last_line: bytes = b"",
    before: bytes = b"",
    *,
    keep_blanks: bool = False,
) -> ParsedRows:
    """Parse a block of whole lines, and for the last block of a file the text behind its last line end.

    `last_line`: This text: the program that wrote it may have been stopped within the line. Unless it is as complete
    as the lines `before` it, it is left out and counted as `CUT`. `before`: Some bytes of the file before `last_line`.
    `keep_blanks`: True: rows with cells without a value are kept, with NaN there; False: they are left out as `BLANK`.
    """
    body, last_line, before = (
        rewritten(part, layout.rewrites) for part in (body, last_line, before)
    )
    if layout.is_data(last_line) and _is_complete_line(layout, before, last_line):
        body, last_line = body + last_line + b"\n", b""
    n_other_rows = 0
    if layout.where:
        body, n_other_rows = _lines_of_source(layout, body)
    parts = _parse_block(layout, body)
    if layout.is_data(last_line):
        parts.append(replace(_parse_by_hand(layout, b""), rows=1, dropped={CUT: 1}))
    rows = _join_parts(parts)
    if layout.void:
        rows = _without_voids(layout, rows)
    if n_other_rows:
        dropped = add_counts(rows.dropped, {OTHER_SOURCE: n_other_rows})
        rows = replace(rows, rows=rows.rows + n_other_rows, dropped=dropped)
    if rows.blank and not keep_blanks:
        rows = rows.take(~np.logical_or.reduce([*rows.blank.values()]), BLANK)
    is_good, not_finite = finite_rows(rows.columns, rows.blank)
    return replace(rows, not_finite=not_finite).take(is_good, NAN_OR_INFINITE)


def _without_voids(layout: Layout, rows: ParsedRows) -> ParsedRows:
    """Return the rows with NaN, marked as blank, in place of the numbers that stand for no value (`Layout.void`)."""
    columns, blank = dict(rows.columns), dict(rows.blank)
    for name, kind in zip(layout.names, layout.kinds, strict=True):
        if kind != "number" or name not in columns:
            continue
        is_void = np.isin(columns[name], layout.void)
        if is_void.any():
            columns[name] = np.where(is_void, np.nan, columns[name])
            blank[name] = blank.get(name, False) | is_void
    return replace(rows, columns=columns, blank=blank)


def _lines_of_source(layout: Layout, body: bytes) -> tuple[bytes, int]:
    """Return the data lines of the wanted source (`Layout.where`) as a block, and the number of the other data lines."""
    lines = [line for line in body.splitlines(keepends=True) if layout.is_data(line)]
    is_wanted = np.ones(len(lines), dtype=bool)
    for column, allowed in layout.where:
        table = map(layout.split, lines)
        labels = [_decoded_cell(cells[column]) if column < len(cells) else "" for cells in table]
        is_wanted &= are_allowed(labels, allowed)
    return b"".join(compress(lines, is_wanted)), int(np.count_nonzero(~is_wanted))


def _decoded_cell(cell: str) -> str:
    """Return a cell, which was split as Latin-1, in its true encoding."""
    return decoded(cell.encode("latin-1"))


_NUMBER_PARTS = re.compile(
    r"[+-]?(?P<digits>\d+)(?:[.,](?P<decimals>\d*))?(?:[eE](?P<exponent>[+-]?\d+))?"
)
"""A number with its digits before the decimal mark, its decimals and its exponent."""

_FEWEST_BEFORE = 3
"""Fewest numbers before a last number by which it is judged to be complete."""


def _is_complete_line(layout: Layout, before: bytes, last_line: bytes) -> bool:
    """Return whether a last line without a line end is complete, judged by the lines `before` it.

    Each cell but the last ends at a delimiter, so only the last one may be cut. A number in a fixed format is complete
    if it has all digits of the format. Any other number may be cut without a trace: it is accepted if its step from
    the number before is no larger than the steps between those, so that a cut would change it by no more than that.
    """
    cells = layout.split(last_line)
    if len(cells) != len(layout.names):
        return False
    kind, last_cell = layout.kinds[-1], cells[-1].strip()
    if kind == "skip" or (layout.quote and last_line.rstrip().endswith(b'"')):
        return True
    # the first of the lines before may itself be cut, as `before` has a fixed number of bytes
    rows = map(layout.split, before.splitlines()[1:])
    column = [row[-1].strip() for row in rows if len(row) == len(cells)]
    if kind not in ("number", "integer"):
        return last_cell in column or (kind == "stamp" and {*map(len, column)} == {len(last_cell)})
    numbers = [number for cell in column if cell and (number := _NUMBER_PARTS.fullmatch(cell))]
    number = _NUMBER_PARTS.fullmatch(last_cell)
    if len(numbers) < _FEWEST_BEFORE or number is None:
        return False
    exponent_lengths = {len(match["exponent"] or "") for match in numbers}
    # the exponent must have as many digits as in every line before, 0 where there is none
    if exponent_lengths != {len(number["exponent"] or "")}:
        return False
    decimals = [len(match["decimals"] or "") for match in numbers]
    last_decimals = len(number["decimals"] or "")
    # a fixed format: always as many decimals, or an exponent
    if max(decimals) == min(decimals) > 0 or exponent_lengths != {0}:
        return last_decimals >= max(decimals)
    if last_decimals < min(decimals) or not last_cell[-1].isdigit():
        return False
    digits_before = [len(match["digits"]) for match in numbers[-_FEWEST_BEFORE:]]
    # a whole number with fewer digits than those just before
    if max(decimals) == 0 and len(number["digits"]) < max(digits_before):
        return False
    values = np.array([float(match[0].replace(",", ".")) for match in numbers])
    step = abs(float(last_cell.replace(",", ".")) - values[-1])
    return bool(step <= np.abs(np.diff(values)).max())


def rewritten(body: bytes, rewrites: Iterable[tuple[re.Pattern[bytes], bytes]]) -> bytes:
    """Return a block with each pattern replaced (`Layout.rewrites`), so that only cells and delimiters are left."""
    for pattern, replacement in rewrites:
        body = pattern.sub(replacement, body)
    return body


def _parse_block(layout: Layout, body: bytes) -> list[ParsedRows]:
    """Parse a block by Arrow as a whole; in parts, returned in their order, where it has a bad line or an odd number.

    Arrow refuses a whole block for one line that it cannot read: spellings of numbers that leave no doubt are changed
    first, then halves are parsed, so that only lines near a bad one are parsed one by one, which takes long.
    """
    if not body.isascii():
        body = MINUS.sub(b"-", body)
    if layout.regrouped:
        # Arrow would read a regrouped number as another one
        return [_parse_by_hand(layout, body)]
    rows = _parse_fast(layout, body)
    if rows is not None:
        return [rows]
    plain = _without_thousands(layout, _with_plain_numbers(layout, body))
    # unchanged: Arrow would refuse the whole block again
    return _parse_halves(layout, body) if plain == body else _parse_part(layout, plain)


def _parse_part(layout: Layout, body: bytes) -> list[ParsedRows]:
    """Parse a part of a block, whole lines, by Arrow, or its halves where it has a bad line."""
    rows = _parse_fast(layout, body)
    return _parse_halves(layout, body) if rows is None else [rows]


def _parse_halves(layout: Layout, body: bytes) -> list[ParsedRows]:
    """Parse the halves of a part with a bad line, each by `_parse_part`; few lines are parsed one by one."""
    if count_lines(body) > 64:
        middle = len(body) // 2
        # the second half starts behind the last line end before the middle, but never between \r and \n
        start = body.rfind(b"\n", 0, middle) + 1 or body.rfind(b"\r", 0, middle) + 1
        if 0 < start < len(body) and body[start : start + 1] != b"\n":
            return [*_parse_part(layout, body[:start]), *_parse_part(layout, body[start:])]
    return [_parse_by_hand(layout, body)]


@lru_cache
def _odd_cell_pattern(delimiter: str) -> re.Pattern[bytes]:
    """Return the pattern of whole cells that may be numbers in an odd spelling: ="007", 12-, (12) and 1.2D3.

    It finds them in a block, before this is split into cells: behind a delimiter, blank, quote or line start.
    """
    edge = rb"[\s\"%b]" % re.escape(delimiter.encode())
    # a comma that separates cells is no part of a number
    number = rb"\d[\d%b]*" % b".,".replace(delimiter.encode(), b"")
    return re.compile(
        rb'="[^"\r\n]*"|(?:(?<=%b)|^)(?:%b-|\(%b\)|[+-]?%b[dD][+-]?\d{1,3})(?=%b|$)'
        % (edge, number, number, number, edge),
        re.MULTILINE,
    )


def _with_plain_numbers(layout: Layout, body: bytes) -> bytes:
    """Return a block with its numbers in the spelling of programs (`plain_number`)."""
    return _odd_cell_pattern(layout.delimiter).sub(
        lambda cell: plain_number(cell[0].decode("ascii", "replace")).encode(), body
    )


_SPACE = rb"(?:[ '\xa0\x92]|\xc2\xa0|\xe2\x80[\x89\xaf\x99])"
"""Blanks, narrow blanks and apostrophes, in UTF-8 and Windows-1252."""


def _without_thousands(layout: Layout, body: bytes) -> bytes:
    """Return a block without separators of thousands, where they leave no doubt; neither Arrow nor float reads them.

    1,442.21 has both marks and leaves none. In 1 442.21 and 1'442 the separator may be a damaged digit or decimal
    mark: there the other numbers of the column decide (`_doubtful_in_block`).
    """
    separator, decimal = (b",", b".") if layout.decimal == "." else (b".", b",")
    delimiter = layout.delimiter.encode()
    if separator in body and decimal in body:
        with_both = _grouped_pattern(re.escape(separator), decimal, delimiter, b"")
        body = with_both.sub(lambda number: number[0].replace(separator, b""), body)
    grouped = [*_grouped_pattern(_SPACE, decimal, delimiter, b"?").finditer(body)]
    if separator != delimiter:
        # 10.204 where the decimal mark is a comma
        grouped += _grouped_pattern(re.escape(separator), decimal, delimiter, b"?").finditer(body)
        grouped.sort(key=re.Match.start)
    doubtful = _doubtful_in_block(layout, body, grouped, separator.decode()) if grouped else set()
    # the block, in pieces: numbers without their separators, and what stands between them
    pieces: list[bytes] = []
    stop = 0
    for number in grouped:
        if number in doubtful:
            continue
        whole, mark, decimals = number[0].partition(decimal)
        whole = re.sub(_SPACE, b"", whole).replace(separator, b"")
        pieces += [body[stop : number.start()], whole, mark, decimals]
        stop = number.end()
    return b"".join([*pieces, body[stop:]])


def _doubtful_in_block(
    layout: Layout, body: bytes, grouped: Sequence[re.Match[bytes]], separator: str
) -> set[re.Match[bytes]]:
    """Return those of the numbers with separators for which other numbers of their columns leave a doubt.

    `grouped`: Matches of all numbers with separators in `body`. `separator`: Comma or point, whichever is not the
    decimal mark.
    """
    numbers_by_column: dict[int, list[re.Match[bytes]]] = {}
    for number in grouped:
        numbers_by_column.setdefault(_column_of(layout, body, number.start()), []).append(number)
    # the numbers of the first lines decide
    lines = islice(filter(layout.is_data, body.splitlines()), 1000)
    rows = [*map(layout.split, lines)]
    doubtful: set[re.Match[bytes]] = set()
    for column, numbers in numbers_by_column.items():
        column_cells = [cells[column].strip(" \t") for cells in rows if column < len(cells)]
        doubtful |= _doubtful_thousands(numbers, column_cells, layout.decimal)
        marked = [cell for cell in column_cells if separator in cell]
        if not all(map(IN_THOUSANDS[separator].fullmatch, marked)):
            # the separator is the decimal mark, whatever the config states
            doubtful |= {number for number in numbers if separator.encode() in number[0]}
    return doubtful


def _column_of(layout: Layout, body: bytes, offset: int) -> int:
    """Return the column, from 0, of the cell that begins at an offset, in bytes, of a block."""
    line_start = body.rfind(b"\n", 0, offset) + 1
    line_start = max(line_start, body.rfind(b"\r", line_start, offset) + 1)
    # the 0 stands for the cell itself, which a delimiter at the end would otherwise not open
    cells_before = layout.split(body[line_start:offset].rstrip(b'"') + b"0")
    return max(len(cells_before) - 1, 0)


def _doubtful_thousands(
    grouped: Sequence[re.Match[bytes]], column_cells: Sequence[str], decimal: str
) -> set[re.Match[bytes]]:
    """Return the numbers of a column whose separators may not stand between thousands.

    All are doubtful if another number in the column has as many digits before its decimal mark and no separator: a
    program that writes separators writes them in each large number. Those without a decimal mark are doubtful if the
    column has decimal marks, unless it has both whole numbers, and grouped numbers with a mark. `grouped`: Numbers of
    the column with separators. `column_cells`: All its cells. `decimal`: Decimal mark.
    """
    mark = decimal.encode()
    plain = [
        cell.replace(decimal, ".", 1) for cell in column_cells if decimal == "." or "." not in cell
    ]
    plain = [cell.lstrip("+-") for cell in plain if PLAIN_NUMBER.fullmatch(cell)]
    digits = [len(re.split("[.eE]", cell)[0]) for cell in plain]
    grouped_digits = [len(re.sub(rb"\D", b"", n[0].partition(mark)[0])) for n in grouped]
    if max(digits, default=0) >= min(grouped_digits):
        return {*grouped}
    without_mark = {number for number in grouped if mark not in number[0]}
    has_marks = len(without_mark) < len(grouped)
    has_wholes = not all("." in cell for cell in plain)
    is_safe = has_wholes if has_marks else not any("." in cell for cell in plain)
    # numbers with both a separator and a decimal mark are clear in any case
    return set() if is_safe else without_mark


@lru_cache
def _grouped_pattern(
    separator: bytes, decimal: bytes, delimiter: bytes, repeat: bytes
) -> re.Pattern[bytes]:
    """Return the pattern of whole cells that are numbers with a separator, itself a pattern, between thousands.

    `decimal`: Decimal mark. `repeat`: How often it stands in a number: ``?`` once or not, empty once. `delimiter`:
    Between cells; where it is the separator, too, such a number must stand in quotes.
    """
    number = rb"[+-]?\d{1,3}(?:%b\d{3})+(?:%b\d*)%b(?:[eE][+-]?\d+)?" % (
        separator,
        re.escape(decimal),
        repeat,
    )
    if separator == delimiter:  # such a number stands in quotes
        return re.compile(rb'(?<=")%b(?=")' % number)
    end = rb'[^"\s%b]' % re.escape(delimiter)
    return re.compile(rb"(?<!%b)%b(?!%b)" % (end, number, end))


def _join_parts(parts: list[ParsedRows]) -> ParsedRows:
    """Join the parts of a block in their order, with line numbers that go on from part to part."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(rows.rows for rows in parts)])
    line_numbers = [
        rows.line_numbers + start for rows, start in zip(parts, starts[:-1], strict=True)
    ]
    names = parts[0].columns
    columns = {name: np.concatenate([rows.columns[name] for rows in parts]) for name in names}
    dropped = add_counts(*(rows.dropped for rows in parts))
    blank = {
        name: np.concatenate(
            [rows.blank.get(name, np.zeros(rows.line_numbers.size, bool)) for rows in parts]
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
        columns,
        np.concatenate(line_numbers),
        int(starts[-1]),
        dropped,
        blank=blank,
        word_lines=word_lines,
    )


def count_lines(body: bytes) -> int:
    r"""Count the lines of a block that ends with a line end; line ends are \n, \r and \r\n."""
    # several times faster than bytes.count where lines are short
    letters = np.frombuffer(body, dtype=np.uint8)
    feeds = letters == _FEED
    lines = int(np.count_nonzero(feeds))
    if b"\r" in body:
        returns = letters == _RETURN
        # \r\n is one line end
        lines += int(np.count_nonzero(returns)) - int(np.count_nonzero(returns[:-1] & feeds[1:]))
    return lines


_EMPTY_LINES = re.compile(rb"[ \t]*(?:\r\n|\n|\r)[\s]*")
"""A line end with the blank lines around it."""


def _parse_fast(layout: Layout, body: bytes) -> ParsedRows | None:
    """Parse whole lines by Arrow; None where a line is bad, or Arrow may read it otherwise than `_parse_line`.

    Fast and slow parsing must agree on every line: the result would otherwise depend on how a file is cut into blocks.
    """
    if "integer" in layout.kinds and (b"x" in body or b"X" in body):
        return None  # Arrow would read 0x10 as a number
    if not body or body.isspace():
        return _parse_by_hand(layout, b"")
    if layout.delimiter == " ":
        body = _single_blanks(body)
    if body.startswith(codecs.BOM_UTF8):
        return None  # Arrow would skip the mark at the start of any block, not only of the file
    width = len(layout.names)
    if layout.optional:
        # the first line decides how many cells all have; Arrow refuses the block if another differs
        line = body.partition(b"\n")[0]
        width = min(width, line.count(layout.delimiter.encode()) + 1)
        if width < len(layout.names) - layout.optional:
            return None
    table = read_cells_of(layout, body, width)
    if table is None:
        return None
    if table.num_rows != count_lines(body):
        # blank lines, or a quote that swallowed line ends
        dense = _EMPTY_LINES.sub(b"\n", body).lstrip(b"\n")
        return _parse_fast(layout, dense) if len(dense) < len(body) else None
    return _rows_of_table(layout, table)


def read_cells_of(layout: Layout, body: bytes, width: int) -> Any | None:
    """Read lines of `width` cells into an Arrow table; None where a cell does not fit its kind, or a line its width.

    Columns of the table have the index of the column as their name: ``0``, ``1``... Skipped columns are left out. Cells
    without a value are null.
    """
    import pyarrow as pa
    import pyarrow.csv as pacsv

    try:
        return pacsv.read_csv(pa.BufferReader(body), **_arrow_options(layout, width))
    except (pa.ArrowInvalid, pa.ArrowKeyError):
        return None


def _rows_of_table(layout: Layout, table: Any) -> ParsedRows | None:
    """Convert a table of `read_cells_of` to the columns of `ParsedRows`, all its rows being good.

    None where a cell cannot be converted, or an integer has no value: the lines are then parsed by hand.
    """
    import pyarrow as pa

    columns: dict[str, np.ndarray] = {}
    blank: dict[str, np.ndarray] = {}
    for column in layout.columns_to_read:
        name = layout.names[column]
        try:
            values, cells = _convert_cells(layout, column, table.column(str(column)))
        except pa.ArrowInvalid:  # text that is not UTF-8
            return None
        if values is None or (cells.null_count and layout.kinds[column] == "integer"):
            return None
        if cells.null_count and layout.kinds[column] in ("number", "stamp"):
            blank[name] = np.asarray(cells.is_null())
        columns[name] = values
    return ParsedRows(columns, np.arange(table.num_rows), table.num_rows, {}, blank=blank)


def _convert_cells(layout: Layout, column: int, chunks: Any) -> tuple[np.ndarray | None, Any]:
    """Convert a column as Arrow has read it, `chunks`, by its kind.

    Returns the values of its n cells, shape (n,), or None where a time cannot be read; and the Arrow column in which
    cells without a value are null, by which the caller marks them as blank. `column`: Index of the column.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = layout.kinds[column]
    cells = chunks.chunk(0) if chunks.num_chunks == 1 else chunks.combine_chunks()
    if kind == "label":
        return _labels_of(cells), cells
    if column in layout.mixed:
        cells = numbers_among_words(cells, layout.decimal_of(column))
    elif kind == "stamp":
        is_blank = pc.is_in(pc.utf8_trim(cells, " \t"), pa.array(layout.no_value, pa.string()))
        cells = pc.if_else(is_blank, pa.scalar(None, pa.string()), cells)
        return seconds_of_column(cells, layout.dates), cells
    return cells.to_numpy(zero_copy_only=False), cells


def _labels_of(cells: Any) -> np.ndarray:
    """Return the stripped texts of an Arrow column of bytes, shape (n,); empty where a cell is null."""
    encoded = cells.dictionary_encode()
    # few different labels stand in many rows: each is decoded once
    labels = [decoded(label or b"").strip() for label in encoded.dictionary.to_pylist()]
    with_blank: np.ndarray = np.array([*labels, ""], dtype=object)
    codes = encoded.indices.fill_null(len(labels)).to_numpy(zero_copy_only=False)
    return np.asarray(with_blank[codes])


def numbers_among_words(cells: Any, decimal: str = ".") -> Any:
    """Read the numbers of an Arrow column of text or bytes as float64; any other cell becomes null.

    `decimal`: Decimal mark of the column, a point or a comma.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = pc.utf8_trim(cells.cast(pa.string()), " \t")
    pattern = PLAIN_NUMBER.pattern if decimal == "." else PLAIN_NUMBER.pattern.replace(r"\.", ",")
    is_number = pc.match_substring_regex(cells, f"^(?:{pattern})$")
    numbers = pc.if_else(is_number, cells, pa.scalar(None, pa.string()))
    # the cast does not accept a plus sign
    numbers = pc.replace_substring(pc.utf8_ltrim(numbers, "+"), ",", ".")
    return numbers.cast(pa.float64())


@lru_cache(64)
def _arrow_options(layout: Layout, width: int) -> dict[str, Any]:
    """Return the settings of Arrow's parser for lines of `width` cells, as arguments of `pyarrow.csv.read_csv`.

    Cached, as making them takes as long as parsing some hundred rows.
    """
    import pyarrow as pa
    import pyarrow.csv as pacsv

    types = {"number": pa.float64(), "integer": pa.int64(), "stamp": pa.string()}
    types["word"] = pa.dictionary(pa.int32(), pa.string())
    column_types = {
        # of other columns, and of numbers among words, the bytes
        str(column): pa.binary() if column in layout.mixed else types.get(kind, pa.binary())
        for column, kind in enumerate(layout.kinds[:width])
    }
    return {
        "read_options": pacsv.ReadOptions(
            # threads already parse several blocks at once; a block in one piece needs no copy of its columns,
            # and blocks of a log are smaller than this
            column_names=[*column_types],
            use_threads=False,
            block_size=1 << 24,
        ),
        "parse_options": pacsv.ParseOptions(
            delimiter=layout.delimiter, quote_char='"' if layout.quote else False
        ),
        "convert_options": pacsv.ConvertOptions(
            column_types=column_types,
            include_columns=[*map(str, layout.columns_to_read)],
            decimal_point=layout.decimal,
            null_values=list(layout.no_value),
            check_utf8=False,
        ),
    }


def _single_blanks(body: bytes) -> bytes:
    """Return lines with a single blank between cells, and none at either end of a line, as Arrow needs them.

    Blanks and tabs are dropped by masks over all bytes at once.
    """
    letters = np.frombuffer(body.replace(b"\t", b" "), dtype=np.uint8)
    # the last blank of each run stays, if a cell follows
    is_blank = letters == _BLANK
    is_dropped = is_blank.copy()
    is_dropped[:-1] &= (is_blank | _is_line_end(letters))[1:]
    letters = letters[~is_dropped]
    # a blank at the start of a line is dropped
    is_dropped = letters == _BLANK
    is_dropped[1:] &= _is_line_end(letters)[:-1]
    letters = letters[~is_dropped]
    single_blanks: bytes = letters.tobytes()
    return single_blanks


def _is_line_end(letters: np.ndarray) -> np.ndarray:
    """Return where a text has a character of a line end; `letters`: its bytes, uint8 of shape (k,)."""
    return np.asarray((letters == _FEED) | (letters == _RETURN))


_NUMPY_TYPES: dict[str, Any] = {
    "number": float,
    "integer": np.int64,
    "stamp": float,
    "label": object,
}
"""Type of the values of a column, by its kind."""


def _parse_by_hand(layout: Layout, body: bytes) -> ParsedRows:
    """Parse line by line, and count the bad lines by reason; slow, for blocks that Arrow refuses."""
    values_by_column: dict[int, list[Any]] = {column: [] for column in layout.columns_to_read}
    line_numbers: list[int] = []
    dropped: dict[str, int] = {}
    word_lines: list[tuple[int, list[str]]] = []
    rows = 0
    for line in filter(layout.is_data, body.splitlines()):
        row_or_reason = _parse_line(layout, line)
        if isinstance(row_or_reason, str):
            dropped[row_or_reason] = dropped.get(row_or_reason, 0) + 1
            if row_or_reason == NO_NUMBER and (words := _only_words(layout, line)):
                word_lines.append((rows, words))
        else:
            for values, value in zip(values_by_column.values(), row_or_reason, strict=True):
                values.append(value)
            line_numbers.append(rows)
        rows += 1
    columns = {}
    blank = {}
    for column, values in values_by_column.items():
        name = layout.names[column]
        if None in values:
            blank[name] = np.array([value is None for value in values])
        # None becomes NaN
        columns[name] = np.array(values, dtype=_NUMPY_TYPES[layout.kinds[column]])
    return ParsedRows(
        columns,
        np.array(line_numbers, dtype=np.int64),
        rows,
        dropped,
        blank=blank,
        word_lines=tuple(word_lines),
    )


def _only_words(layout: Layout, line: bytes) -> list[str]:
    """Return the cells of a line without any number, such as a repeated header; no cells for another line."""
    cells = cells_of(decoded(line), layout.delimiter, quote=layout.quote) or []
    if any(PLAIN_NUMBER.fullmatch(cell.strip().replace(",", ".")) for cell in cells):
        return []
    return cells


REGROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
"""A number with a comma before each three digits, as a spreadsheet regroups them: where the decimal mark is a comma, it
may have been another number."""

_INTEGER = re.compile(r"-?\d{1,19}")


def _parse_line(layout: Layout, line: bytes) -> list[Any] | str:
    """Parse one line: return the value of each column to be read, None for a cell without a value.

    A bad line gives the reason, a text, in place of the list. What this function accepts decides: `_parse_fast` may
    only be stricter.
    """
    cells = layout.split(line)
    most = len(layout.names)
    if not most - layout.optional <= len(cells) <= most:
        return WRONG_CELLS
    values: list[Any] = []
    for column in layout.columns_to_read:
        cell, kind = cells[column].strip(" \t"), layout.kinds[column]
        if kind == "label":
            values.append(_decoded_cell(cells[column]).strip())
        elif kind == "integer":
            if not _INTEGER.fullmatch(cell) or abs(int(cell)) >= 1 << 63:
                return NO_NUMBER
            values.append(int(cell))
        elif cell in layout.no_value:
            values.append(None)
        elif kind == "stamp":
            values.append(seconds_of(cell, layout.dates))
            if math.isnan(values[-1]):
                return NO_TIME
        else:
            if layout.decimal_of(column) == ",":
                if column in layout.regrouped and REGROUPED.fullmatch(cell):
                    return GROUPED
                cell = "." if "." in cell else cell.replace(",", ".")
            if PLAIN_NUMBER.fullmatch(cell):
                values.append(float(cell))
            elif column in layout.mixed:
                values.append(None)
            elif NOT_FINITE.fullmatch(cell):
                values.append(float(cell))
            else:
                return NO_NUMBER
    return values
