"""Lines of numbers to columns: fast where the file is whole, careful where it is not."""

from __future__ import annotations

from codecs import BOM_UTF8
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.conventions import FloatArray

CUT = "cut in mid-row"
CELLS = "wrong number of cells"
NUMBER = "not a number"
FINITE = "NaN or infinite"
_BLOCK_BYTES = 1 << 24
_FEED, _RETURN = b"\n\r"


class Parsed(NamedTuple):
    """What one body of lines holds.

    Attributes
    ----------
    values : list of numpy.ndarray, each of shape (n,)
        The columns of the good rows, in order.
    rows : int
        Data lines: those that hold anything and are no comment.
    dropped : dict of str to int
        Reason to number of lines left out; n and these add up to `rows`.
    """

    values: list[FloatArray]
    rows: int
    dropped: dict[str, int]


def parse_bodies(bodies: Sequence[bytes], width: int) -> list[Parsed]:
    """Parse comma-separated lines of `width` numbers each, many files at once.

    Starting the parser costs as much as parsing a file of a thousand rows, so whole files are
    parsed together; as soon as one of them has a bad line, each is parsed by itself.

    Parameters
    ----------
    bodies : sequence of bytes
        Everything after the header row of each file; any line ends; blank lines and ``#`` comments
        do not count.
    width : int
        Cells in a row.

    Returns
    -------
    list of Parsed
        In the order of `bodies`.
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
    """Count the lines of a body that ends with a line end.

    Parameters
    ----------
    body : bytes

    Returns
    -------
    int
    """
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
    """Tell a data line from a blank one and from a comment.

    Parameters
    ----------
    line : bytes

    Returns
    -------
    bool
    """
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
