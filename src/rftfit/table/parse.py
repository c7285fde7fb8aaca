"""Lines of a table to columns: fast where a block is clean, line by line where it is not."""

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

FINITE = "NaN or infinite"

BLANK = "no value in a cell"
"""Why a row is left out."""


def add_counts(*counts: Mapping[str, int]) -> dict[str, int]:
    """Add up counts by reason."""
    total: Counter[str] = Counter()
    for count in counts:
        total.update(count)
    return dict(total)


def finite_rows(
    columns: Mapping[str, np.ndarray], blank: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, int]]:
    """Tell in which rows all numbers are finite, and how many are not in each column where one is not.

    `blank`: Column to the rows in which it has no value, and NaN here: what else is NaN is NaN in the file.
    """
    keep = np.ones(next(iter(columns.values())).size, dtype=bool)
    bad = {}
    for name, values in columns.items():
        if values.dtype == float:
            finite = np.isfinite(values)
            if name in blank:
                finite |= blank[name]
            if lost := int(finite.size - np.count_nonzero(finite)):
                bad[name] = lost
                keep &= finite
    return keep, bad


OTHER_SOURCE = "of another source (`where` in the config)"


def is_meant(labels: Sequence[object], allowed: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Tell the rows whose label is one of those that are allowed; numbers are compared as numbers."""
    words = {*allowed}
    numbers = {number for word in allowed if (number := _number(word)) is not None}

    def meant(label: object) -> bool:
        text = str(label).strip()
        return text in words or (bool(numbers) and _number(text) in numbers)

    meant_by_label: dict[object, bool] = {}
    return np.array(
        [meant_by_label.setdefault(label, meant(label)) for label in labels], dtype=bool
    )


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


CUT = "cut in mid-row"

CELLS = "wrong number of cells"

NUMBER = "not a number"

NO_TIME = "not a time"

GROUPED = "digits regrouped in this column: 10,114 may have been 1,0114"
"""Why a line is left out."""

OF_CELLS = frozenset({NUMBER, NO_TIME, FINITE, BLANK, GROUPED})
"""Reasons that lie in a cell: whoever does not read its column keeps the line."""

Kind = Literal["number", "integer", "stamp", "same", "label", "word", "skip"]

_TYPES: dict[str, Any] = {
    "number": float,
    "integer": np.int64,
    "stamp": float,
    "same": bool,
    "label": object,
}


_INTEGER = re.compile(r"-?\d{1,19}")

_EMPTY_LINES = re.compile(rb"[ \t]*(?:\r\n|\n|\r)[\s]*")

_LINES_BY_HAND = 64

_ONE_PIECE = 1 << 24


@dataclass(frozen=True)
class Layout:
    """How the cells of a line are told apart, and what each holds.

    `names`: Of the columns, each once.
    `kinds`: By default all numbers. Integers are exact within 64 bits; of a cell that should always
        be the `same`, whether it is; labels are words; skipped cells may hold anything. For `read_cells_of` alone:
        words are texts of which there are few.
    `delimiter`: One character; a blank stands for any number of blanks and tabs.
    `decimal`: ``.`` or ``,``. `other_decimal`: Places of columns whose numbers have the other mark.
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
    """Parse whole lines.

    `last_line`: A last line without an end. Whoever wrote it may have been stopped in it: unless it is as
    whole as the lines `before` it, it is counted and left out. `keep_blanks`: Keep rows with cells that
    have no value; these cells are NaN.
    """
    body, last_line = (rewritten(text, layout.rewrites) for text in (body, last_line))
    if layout.is_data(last_line) and _is_complete_line(
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
        dropped = add_counts(rows.dropped, {OTHER_SOURCE: n_other_rows})
        rows = replace(rows, rows=rows.rows + n_other_rows, dropped=dropped)
    if rows.blank and not keep_blanks:
        rows = rows.take(~np.logical_or.reduce([*rows.blank.values()]), BLANK)
    keep, bad = finite_rows(rows.columns, rows.blank)
    return replace(rows, not_finite=bad).take(keep, FINITE) if bad else rows


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
    return decoded(cell.encode("latin-1"))


_PARTS = re.compile(
    r"[+-]?(?P<digits>\d+)(?:[.,](?P<decimals>\d*))?(?:[eE](?P<exponent>[+-]?\d+))?"
)

_FEWEST_BEFORE = 3


def _is_complete_line(layout: Layout, before: bytes, last_line: bytes) -> bool:
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
    if not body.isascii():
        body = MINUS.sub(b"-", body)
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


def _fast(layout: Layout, body: bytes) -> ParsedRows | None:
    """Parse lines without a single bad one, or give None."""
    import pyarrow as pa

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
    table = read_cells_of(layout, body, width)
    if table is None:
        return None
    if table.num_rows != count_lines(body):
        # blank lines, or a quote that swallowed line ends
        dense = _EMPTY_LINES.sub(b"\n", body).lstrip(b"\n")
        return _fast(layout, dense) if len(dense) < len(body) else None
    try:
        return _rows_of_table(layout, table)
    except pa.ArrowInvalid:
        return None


def read_cells_of(layout: Layout, body: bytes, width: int) -> Any | None:
    """Read lines of so many cells into an Arrow table, its columns by place; None where a cell is not of its kind."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    try:
        return pacsv.read_csv(pa.BufferReader(body), **_options(layout, width))
    except (pa.ArrowInvalid, pa.ArrowKeyError):
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
    types["word"] = pa.dictionary(pa.int32(), pa.string())
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
