"""Parses lines of a table to columns: fast by Arrow where a block is clean, line by line where it is not."""

from __future__ import annotations

import codecs
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import islice
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from rftfit.table.numbers import IN_THOUSANDS, MINUS, NOT_FINITE, PLAIN_NUMBER, plain_number
from rftfit.table.stamps import seconds_of, seconds_of_column
from rftfit.table.text import cells_of, decoded

_FEED, _RETURN, _TAB, _BLANK = b"\n\r\t "

# reasons why a row is left out
FINITE = "NaN or infinite"
BLANK = "no value in a cell"


def add_counts(*counts: Mapping[str, int]) -> dict[str, int]:
    """Add up counts by reason."""
    total: Counter[str] = Counter()
    for count in counts:
        total.update(count)
    return dict(total)


def finite_rows(
    columns: Mapping[str, np.ndarray], blank: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, int]]:
    """Return which rows have only finite numbers, bool of shape (n,), and column to its count of others.

    `blank`: Column to the rows in which it has no value: NaN there is allowed, any other NaN is one of the file.
    """
    keep = np.ones(next(iter(columns.values())).size, dtype=bool)
    bad = {}
    for name, values in columns.items():
        if values.dtype == float:
            finite = np.isfinite(values)
            if name in blank:
                finite |= blank[name]
            if not_finite := int(finite.size - np.count_nonzero(finite)):
                bad[name] = not_finite
                keep &= finite
    return keep, bad


OTHER_SOURCE = "of another source (`where` in the config)"


def is_meant(labels: Sequence[object], allowed: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Return which rows have one of the `allowed` labels, bool of shape (n,); numbers are compared as numbers."""
    words = {*allowed}
    numbers = {number for word in allowed if (number := _number_or_none(word)) is not None}

    def meant(label: object) -> bool:
        """Return whether a label is allowed."""
        text = str(label).strip()
        return text in words or (bool(numbers) and _number_or_none(text) in numbers)

    # few different labels stand in many rows
    meant_by_label = {label: meant(label) for label in {*labels}}
    return np.array([meant_by_label[label] for label in labels], dtype=bool)


def _number_or_none(text: str) -> float | None:
    """Return a text as a number; None where it is none."""
    try:
        return float(text)
    except ValueError:
        return None


# further reasons, of lines that cannot be parsed
CUT = "cut in mid-row"
CELLS = "wrong number of cells"
NUMBER = "not a number"
NO_TIME = "not a time"
GROUPED = "digits regrouped in this column: 10,114 may have been 1,0114"

OF_CELLS = frozenset({NUMBER, NO_TIME, FINITE, BLANK, GROUPED})
"""Reasons that lie in one cell: a reader that does not need its column keeps the line."""

Kind = Literal["number", "integer", "stamp", "same", "label", "word", "skip"]

_NUMPY_TYPES: dict[str, Any] = {
    "number": float,
    "integer": np.int64,
    "stamp": float,
    "same": bool,
    "label": object,
}


_INTEGER = re.compile(r"-?\d{1,19}")

_EMPTY_LINES = re.compile(rb"[ \t]*(?:\r\n|\n|\r)[\s]*")


@dataclass(frozen=True)
class Layout:
    """How to split a line into cells, and what each cell holds. Places of columns count from 0.

    `names`: Unique names of the columns.
    `kinds`: Kind of each column; by default all are numbers. Integers are exact within 64 bits; of kind "same",
        the value is whether the cell equals `same`; labels are words; skipped cells may hold anything. For
        `read_cells_of` alone: words are texts, few of which differ.
    `delimiter`: One character; a blank stands for any number of blanks and tabs.
    `decimal`: ``.`` or ``,``. `other_decimal`: Places of columns whose numbers have the other mark.
    `quote`: Whether cells may be in double quotes.
    `comment`: Beginning of lines that are no data lines; empty: there are none.
    `optional`: Number of columns at the end, all skipped ones, that a line may lack.
    `same`: Content that the cells of kind "same" should have.
    `regrouped`: Places of columns whose digits a spreadsheet has regrouped.
    `dates`: Order of day, month and year in dates (``dmy``); empty: each date must show the order.
    `no_value`: Texts of cells without a value; the other cells of such a row are still read.
    `void`: Numbers that stand for no value.
    `mixed`: Places of columns of numbers with words among them; a word there is no value.
    `rewrites`: Patterns and their replacements in each line, before it is split into cells.
    `where`: Places of columns, and the words that a row of the wanted source has there.
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
    other_decimal: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        if not self.kinds:
            object.__setattr__(self, "kinds", ("number",) * len(self.names))

    @property
    def places_to_read(self) -> list[int]:
        """Places of the columns that are read."""
        return [place for place, kind in enumerate(self.kinds) if kind != "skip"]

    def decimal_of(self, place: int) -> str:
        """Decimal mark of a column."""
        if place in self.other_decimal:
            return "," if self.decimal == "." else "."
        return self.decimal

    def is_data(self, line: bytes) -> bool:
        """Return whether a line is neither blank nor a comment."""
        text = line.strip()
        return bool(text) and not (self.comment and text.startswith(self.comment.encode()))


@dataclass(frozen=True)
class ParsedRows:
    """Columns of the good rows of some lines, and counts of the bad ones.

    `columns`: Name to values of the good rows, shape (n,): float64, int64, bool, or words. `index`: Number of the
    data line of each good row, from 0, shape (n,); bad lines are counted, too. `rows`: Number of data lines, which
    is n plus all counts in `dropped` (by reason). `blank`: Column to the good rows without a value, which is NaN in
    `columns`; only for columns with such a row. `word_lines`: Number and cells of the data lines with as many cells
    as there are columns and no number.
    """

    columns: dict[str, np.ndarray]
    index: np.ndarray
    rows: int
    dropped: dict[str, int]
    not_finite: dict[str, int] = field(default_factory=dict)
    blank: Mapping[str, np.ndarray] = field(default_factory=dict)
    word_lines: tuple[tuple[int, list[str]], ...] = ()

    def take(self, keep: np.ndarray, reason: str) -> ParsedRows:
        """Return the rows where `keep` is True; the others are counted under `reason`."""
        lost = int(keep.size - np.count_nonzero(keep))
        if not lost:
            return self
        columns = {name: values[keep] for name, values in self.columns.items()}
        blank = {name: rows[keep] for name, rows in self.blank.items()}
        dropped = add_counts(self.dropped, {reason: lost})
        return replace(self, columns=columns, index=self.index[keep], dropped=dropped, blank=blank)


def parse(
    layout: Layout,
    body: bytes,
    last_line: bytes = b"",
    before: bytes = b"",
    *,
    keep_blanks: bool = False,
) -> ParsedRows:
    """Parse a block of whole lines.

    `last_line`: A last line without a line end: the program that wrote it may have been stopped within it. Unless it
    is as complete as the lines `before` it, it is counted and left out. `keep_blanks`: Keep rows with cells that
    have no value; such cells are NaN.
    """
    body, last_line = (rewritten(text, layout.rewrites) for text in (body, last_line))
    if layout.is_data(last_line) and _is_complete_line(
        layout, rewritten(before, layout.rewrites), last_line
    ):
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
    keep, bad = finite_rows(rows.columns, rows.blank)
    return replace(rows, not_finite=bad).take(keep, FINITE) if bad else rows


def _without_voids(layout: Layout, rows: ParsedRows) -> ParsedRows:
    """Return the rows with NaN, marked as blank, in place of the numbers that stand for no value."""
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
    """Return the lines of the wanted source, and the number of the other lines."""
    lines = [line for line in body.splitlines(keepends=True) if layout.is_data(line)]
    kept = np.ones(len(lines), dtype=bool)
    for place, words in layout.where:
        cells = (
            cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or ()
            for line in lines
        )
        labels = [_decoded_cell(row[place]) if place < len(row) else "" for row in cells]
        kept &= is_meant(labels, words)
    wanted = b"".join(line for line, is_kept in zip(lines, kept, strict=True) if is_kept)
    return wanted, int(np.count_nonzero(~kept))


def _decoded_cell(cell: str) -> str:
    """Return a cell, which was split as Latin-1, in its true encoding."""
    return decoded(cell.encode("latin-1"))


_NUMBER_PARTS = re.compile(
    r"[+-]?(?P<digits>\d+)(?:[.,](?P<decimals>\d*))?(?:[eE](?P<exponent>[+-]?\d+))?"
)

_FEWEST_BEFORE = 3
"""Fewest numbers before a last number by which it is judged to be complete."""


def _is_complete_line(layout: Layout, before: bytes, last_line: bytes) -> bool:
    """Return whether a last line without a line end is complete, judged by the lines `before` it.

    Each cell but the last ends at a delimiter, so only the last one may be cut. A number in a fixed format is complete
    if it has all digits of the format. Any other number may be cut without a trace: it is accepted if its step from
    the number before is no larger than the steps between those, so that a cut would change it by no more than that.
    """
    cells = cells_of(last_line.decode("latin-1"), layout.delimiter, quote=layout.quote)
    if cells is None or len(cells) != len(layout.names):
        return False
    last, last_cell = len(cells) - 1, cells[-1].strip()
    kind = layout.kinds[last]
    if kind == "skip" or (layout.quote and last_line.rstrip().endswith(b'"')):
        return True
    # the first of the lines before may itself be cut, as `before` has a fixed number of bytes
    rows = (
        cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or []
        for line in before.splitlines()[1:]
    )
    column = [row[last].strip() for row in rows if len(row) == len(cells)]
    if kind not in ("number", "integer"):
        return last_cell in column or (kind == "stamp" and {*map(len, column)} == {len(last_cell)})
    numbers = [number for cell in column if cell and (number := _NUMBER_PARTS.fullmatch(cell))]
    number = _NUMBER_PARTS.fullmatch(last_cell)
    if len(numbers) < _FEWEST_BEFORE or number is None or not last_cell:
        return False
    exponents = {len(match["exponent"] or "") for match in numbers}
    if exponents != {len(number["exponent"] or "")}:
        return False
    decimals = [len(match["decimals"] or "") for match in numbers]
    digits_behind = len(number["decimals"] or "")
    # a fixed format: always as many decimals, or an exponent
    if max(decimals) == min(decimals) > 0 or exponents != {0}:
        return digits_behind >= max(decimals)
    if digits_behind < min(decimals) or not last_cell[-1].isdigit():
        return False
    if max(decimals) == 0 and len(number["digits"]) < max(
        len(match["digits"]) for match in numbers[-_FEWEST_BEFORE:]
    ):
        return False
    values = np.array([float(match[0].replace(",", ".")) for match in numbers])
    step = abs(float(last_cell.replace(",", ".")) - values[-1])
    return bool(step <= np.abs(np.diff(values)).max())


def rewritten(body: bytes, rewrites: Iterable[tuple[re.Pattern[bytes], bytes]]) -> bytes:
    """Return text with each pattern replaced, so that cells and delimiters are left."""
    for pattern, replacement in rewrites:
        body = pattern.sub(replacement, body)
    return body


def _parse_block(layout: Layout, body: bytes) -> list[ParsedRows]:
    """Parse a block by Arrow as a whole; in parts where it has a bad line or an odd number."""
    if not body.isascii():
        body = MINUS.sub(b"-", body)
    if not layout.regrouped:
        fast = _parse_fast(layout, body)
        if fast is not None:
            return [fast]
        plain = _without_thousands(layout, _with_plain_numbers(layout, body))
        if plain != body:
            return _parse_halves(layout, plain)
    return _parse_halves(layout, body, is_bad=True)


def _parse_halves(layout: Layout, body: bytes, *, is_bad: bool = False) -> list[ParsedRows]:
    """Parse a block by Arrow, or its halves where it has a bad line, down to few lines, which are parsed one by one.

    `is_bad`: The block is known to have a bad line.
    """
    if not (layout.regrouped or is_bad):
        fast = _parse_fast(layout, body)
        if fast is not None:
            return [fast]
    if count_lines(body) > 64:
        middle = len(body) // 2
        # never between \r and \n
        place = body.rfind(b"\n", 0, middle) + 1 or body.rfind(b"\r", 0, middle) + 1
        if 0 < place < len(body) and body[place : place + 1] != b"\n":
            return [*_parse_halves(layout, body[:place]), *_parse_halves(layout, body[place:])]
    return [_parse_by_hand(layout, body)]


@lru_cache
def _odd_cell_pattern(delimiter: str) -> re.Pattern[bytes]:
    """Return the pattern of whole cells that may be numbers in an odd spelling (`plain_number`)."""
    edge = rb"[\s\"%b]" % re.escape(delimiter.encode())
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


def _without_thousands(layout: Layout, body: bytes) -> bytes:
    """Return a block without separators of thousands, where they leave no doubt.

    1,442.21 has both marks and leaves none. In 1 442.21 and 1'442 the separator may be a damaged digit or decimal
    mark: there the other numbers of the column decide.
    """
    group, point = (b",", b".") if layout.decimal == "." else (b".", b",")
    delimiter = layout.delimiter.encode()
    if group in body and point in body:
        marked = _grouped_pattern(re.escape(group), point, delimiter, b"")
        body = marked.sub(lambda number: number[0].replace(group, b""), body)
    spaced = [*_grouped_pattern(_SPACE, point, delimiter, b"?").finditer(body)]
    if group != delimiter:
        # 10.204 beside a decimal comma
        spaced += _grouped_pattern(re.escape(group), point, delimiter, b"?").finditer(body)
        spaced.sort(key=re.Match.start)
    if not spaced:
        return body
    numbers_by_column: dict[int, list[re.Match[bytes]]] = {}
    for number in spaced:
        numbers_by_column.setdefault(_column_of(layout, body, number.start()), []).append(number)
    # the numbers of these lines decide on separators of thousands
    lines = islice(filter(layout.is_data, body.splitlines()), 1000)
    rows = [
        cells_of(line.decode("latin-1"), layout.delimiter, quote=layout.quote) or []
        for line in lines
    ]
    doubtful: set[re.Match[bytes]] = set()
    for place, numbers in numbers_by_column.items():
        column = [cells[place].strip(" \t") for cells in rows if place < len(cells)]
        doubtful |= _doubtful_thousands(numbers, column, point)
        between = group.decode()
        if any(between in cell and not IN_THOUSANDS[between].fullmatch(cell) for cell in column):
            # the mark is decimal, whatever the config states
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


def _column_of(layout: Layout, body: bytes, place: int) -> int:
    """Return the column, from 0, of the cell at a place (in bytes) of a block."""
    start = body.rfind(b"\n", 0, place) + 1
    start = max(start, body.rfind(b"\r", start, place) + 1)
    before = body[start:place].rstrip(b'"').decode("latin-1") + "0"
    return len(cells_of(before, layout.delimiter, quote=layout.quote) or "0") - 1


def _doubtful_thousands(
    spaced: Sequence[re.Match[bytes]], column: Sequence[str], point: bytes
) -> set[re.Match[bytes]]:
    """Return the numbers of a column whose blanks may be no separators of thousands.

    All numbers are doubtful if others in the column have as many digits and no blank. Numbers without a decimal mark
    are doubtful if the column has decimal marks, unless it has both whole numbers, and thousands with a mark.
    `spaced`: Numbers with blanks. `column`: Cells of the column. `point`: Decimal mark.
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
"""Blanks, narrow blanks and apostrophes, in UTF-8 and Windows-1252."""


@lru_cache
def _grouped_pattern(
    group: bytes, point: bytes, delimiter: bytes, whole: bytes
) -> re.Pattern[bytes]:
    """Return the pattern of numbers with a mark (`group`) between thousands; `whole` ``?``: also without decimals."""
    number = rb"[+-]?\d{1,3}(?:%b\d{3})+(?:%b\d*)%b(?:[eE][+-]?\d+)?" % (
        group,
        re.escape(point),
        whole,
    )
    if group == delimiter:  # such a number stands in quotes
        return re.compile(rb'(?<=")%b(?=")' % number)
    end = rb'[^"\s%b]' % re.escape(delimiter)
    return re.compile(rb"(?<!%b)%b(?!%b)" % (end, number, end))


def _join_parts(parts: list[ParsedRows]) -> ParsedRows:
    """Join the parts of a block."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(rows.rows for rows in parts)])
    index = [rows.index + start for rows, start in zip(parts, starts[:-1], strict=True)]
    names = parts[0].columns
    columns = {name: np.concatenate([rows.columns[name] for rows in parts]) for name in names}
    dropped = add_counts(*(rows.dropped for rows in parts))
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


def _parse_fast(layout: Layout, body: bytes) -> ParsedRows | None:
    """Parse lines by Arrow; None where a line is bad, or Arrow may read it otherwise than `_parse_line`."""
    import pyarrow as pa

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
    try:
        return _rows_of_table(layout, table)
    except pa.ArrowInvalid:
        return None


def read_cells_of(layout: Layout, body: bytes, width: int) -> Any | None:
    """Read lines of `width` cells into an Arrow table, columns named by place; None where a cell does not fit."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    try:
        return pacsv.read_csv(pa.BufferReader(body), **_arrow_options(layout, width))
    except (pa.ArrowInvalid, pa.ArrowKeyError):
        return None


def _rows_of_table(layout: Layout, table: Any) -> ParsedRows | None:
    """Convert the cells of an Arrow table to values; None where a time cannot be read, or an integer has no value.

    Raises pyarrow.ArrowInvalid for text that is not UTF-8.
    """
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
            cells = numbers_among_words(cells, layout.decimal_of(place))
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
    """Return the stripped texts of an Arrow column of bytes, shape (n,)."""
    encoded = cells.dictionary_encode()
    words = [decoded(word or b"").strip() for word in encoded.dictionary.to_pylist()]
    texts: np.ndarray = np.array([*words, ""], dtype=object)
    places = encoded.indices.fill_null(len(words)).to_numpy(zero_copy_only=False)
    return np.asarray(texts[places])


def numbers_among_words(cells: Any, decimal: str = ".") -> Any:
    """Read the numbers of an Arrow column of text; any other cell becomes null."""
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
    """Return the settings of Arrow's parser; cached, as making them takes as long as parsing some hundred rows."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    types = {"number": pa.float64(), "integer": pa.int64(), "stamp": pa.string()}
    types["word"] = pa.dictionary(pa.int32(), pa.string())
    names = [str(place) for place in range(width)]
    column_types = {name: types.get(layout.kinds[int(name)], pa.binary()) for name in names}
    column_types |= {str(place): pa.binary() for place in layout.mixed}
    return {
        "read_options": pacsv.ReadOptions(
            # threads already parse several blocks at once; a block in one piece needs no copy of its columns,
            # and blocks of a log are smaller than this
            column_names=names,
            use_threads=False,
            block_size=1 << 24,
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
    """Return lines with a single blank between cells, and none at either end of a line."""
    text = np.frombuffer(body, dtype=np.uint8)
    # the last blank of each run stays, if a cell follows
    blank = (text == _BLANK) | (text == _TAB)
    drop = np.ones(text.size, dtype=bool)
    follows = text[1:]
    np.logical_and(blank[:-1], blank[1:] | (follows == _FEED) | (follows == _RETURN), out=drop[:-1])
    drop[-1] = blank[-1]
    text = text[~drop]
    if text.size:
        # a blank at the start of a line is dropped
        end = (text == _FEED) | (text == _RETURN)
        drop = (text == _BLANK) | (text == _TAB)
        drop[1:] &= end[:-1]
        text = text[~drop]
    return text.tobytes().replace(b"\t", b" ")


def _parse_by_hand(layout: Layout, body: bytes) -> ParsedRows:
    """Parse line by line, and count the bad lines by reason."""
    values: list[list[Any]] = [[] for _ in layout.places_to_read]
    index: list[int] = []
    dropped: dict[str, int] = {}
    word_lines: list[tuple[int, list[str]]] = []
    rows = 0
    for line in filter(layout.is_data, body.splitlines()):
        row_or_reason = _parse_line(layout, line)
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
        # None becomes NaN
        columns[name] = np.array(column, dtype=_NUMPY_TYPES[layout.kinds[place]])
    return ParsedRows(
        columns,
        np.array(index, dtype=np.int64),
        rows,
        dropped,
        blank=blank,
        word_lines=tuple(word_lines),
    )


def _only_words(layout: Layout, line: bytes) -> list[str]:
    """Return the cells of a line without any number, such as a repeated header; empty for another line."""
    cells = cells_of(decoded(line), layout.delimiter, quote=layout.quote) or []
    if any(PLAIN_NUMBER.fullmatch(cell.strip().replace(",", ".")) for cell in cells):
        return []
    return cells


def _parse_line(layout: Layout, line: bytes) -> list[Any] | str:
    """Return the values of the cells to be read, None for a cell without a value, or the reason why the line is bad."""
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
            if layout.decimal_of(place) == ",":
                if place in layout.regrouped and REGROUPED.fullmatch(cell):
                    return GROUPED
                cell = "." if "." in cell else cell.replace(",", ".")
            if PLAIN_NUMBER.fullmatch(cell):
                values.append(float(cell))
            elif place in layout.mixed:
                values.append(None)
            elif NOT_FINITE.fullmatch(cell):
                values.append(float(cell))
            else:
                return NUMBER
    return values


REGROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
"""A number with a comma before each three digits, as a spreadsheet regroups them."""
