"""Text of a table: its encoding (UTF-8, UTF-16, Windows-1252), text or binary, its lines, and the cells of a line.

`head` stands for the first bytes of a file, from which all is guessed: logs are too large to be read twice.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import NamedTuple

_UTF16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
"""Byte order mark, the first two bytes of a file in UTF-16, to the encoding."""
_SAMPLE_BYTES = 1000
"""Number of first bytes of a file by which its encoding is guessed."""


def utf16_of(head: bytes) -> str:
    """Return the encoding of a file in UTF-16, as a name of Python, with a byte order mark or without; else empty."""
    if head[:2] in _UTF16:
        return _UTF16[head[:2]]
    sample = head[:_SAMPLE_BYTES]
    first_bytes, second_bytes = sample[::2], sample[1::2]
    for encoding, high_bytes, low_bytes in (
        ("utf-16-be", first_bytes, second_bytes),
        ("utf-16-le", second_bytes, first_bytes),
    ):
        # two bytes a letter: in UTF-16 the high bytes of most letters are 0, and no low byte is
        most_are_zero = high_bytes.count(0) * 4 > len(sample) and 0 not in low_bytes
        if most_are_zero and any(line_end.encode(encoding) in sample for line_end in "\r\n"):
            return encoding
    return ""


def without_byte_order_mark(head: bytes) -> bytes:
    """Return the first bytes of a file without its byte order mark."""
    return head[2:] if head[:2] in _UTF16 else head.removeprefix(codecs.BOM_UTF8)


def as_utf8(head: bytes) -> bytes:
    """Return the first bytes of a file without a byte order mark; UTF-16 becomes UTF-8, other bytes stay as they are.

    A letter in UTF-16 that the end of `head` cuts in half is left out.
    """
    utf16, head = utf16_of(head), without_byte_order_mark(head)
    return head.decode(utf16, "ignore").encode() if utf16 else head


_CONTROLS = bytes({*range(32)} - set(b"\t\n\v\f\r\x1a\x1b")) + b"\x7f"
"""Control characters that no text has."""


def text_head(head: bytes) -> bytes:
    """Return the first bytes of a text as `as_utf8` does, but nothing for a binary file, so that no reader tries it.

    Zero bytes and control characters show a binary file. A text may have some where a disk was full or a line was
    disturbed; such a damaged text keeps the lines before its first zero byte.
    """
    if b"\x00" in head and not utf16_of(head):
        whole_lines, _, _ = head.partition(b"\x00")[0].rpartition(b"\n")
        # a binary file has fewer lines before its first zero byte
        if whole_lines.count(b"\n") < 10:
            return b""
        head = whole_lines + b"\n"
    text = as_utf8(head)
    controls = len(text) - len(text.translate(None, _CONTROLS))
    # one in fifty bytes of a damaged text may be a control character; in a binary file one in ten is
    return b"" if controls * 50 > len(text) else text


_WEB_PAGE = re.compile(rb"\s*<(?:!doctype\s+html|html|table|meta)\b", re.IGNORECASE)
"""First tag of a page of HTML, or of a table of such a page alone."""


def is_web_page(head: bytes) -> bool:
    """Return whether a file is a page of HTML, which some programs name .xls."""
    return bool(_WEB_PAGE.match(as_utf8(head[:_SAMPLE_BYTES])))


class Line(NamedTuple):
    """One line among the first bytes of a file.

    `text`: The line, decoded, without its line end. `stop`: Offset in bytes at which the next line begins.
    `whole`: Whether the line has a line end; the last line may have been cut with the first bytes.
    """

    text: str
    stop: int
    whole: bool


def decode_first_lines(head: bytes, most: int = 400) -> list[Line]:
    """Return at most `most` first lines of a file, in UTF-8, or Windows-1252 where it is not UTF-8."""
    return list(islice(each_line(head), most))


_LINE_END = re.compile(rb"\r\n|\n|\r")


def each_line(head: bytes, encoding: str = "") -> Iterator[Line]:
    r"""Yield the lines of the first bytes of a file, which end with \r\n, \n or \r.

    `encoding`: As in `decoded`, line by line: one line that is not UTF-8 does not change how the others are read.
    """
    start = 0
    while start < len(head):
        end = _LINE_END.search(head, start)
        stop = end.end() if end else len(head)
        raw = head[start : end.start() if end else stop]
        yield Line(decoded(raw, encoding), stop, end is not None)
        start = stop


def decoded(raw: bytes, encoding: str = "") -> str:
    """Decode bytes; `encoding` empty: UTF-8, or Windows-1252 where they are not UTF-8. Never raises an error.

    Bytes that the encoding does not have become the sign for an unknown letter.
    """
    if encoding:
        return raw.decode(encoding, "replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def cells_of(line: str, delimiter: str, *, quote: bool = True) -> list[str] | None:
    """Split a line into its cells; None where the quotes do not match.

    `delimiter`: One character; a blank stands for any number of blanks and tabs, and cells are then never in quotes.
    `quote`: Whether cells may be in double quotes, which are taken off; False leaves them in the cells.
    """
    if delimiter == " ":
        return _split_at_blanks(line)
    if not quote or '"' not in line:
        return line.split(delimiter)
    try:
        return next(records_of([line], delimiter), [])
    except csv.Error:
        return None


def records_of(lines: Iterable[str], delimiter: str) -> Iterator[list[str]]:
    """Yield the cells of each row of a table; a cell in quotes may hold line ends, so that a row has several lines.

    `delimiter`: As in `cells_of`. Raises csv.Error where quotes do not match.
    """
    if delimiter == " ":
        return map(_split_at_blanks, lines)
    return csv.reader(lines, delimiter=delimiter, strict=True)


def _split_at_blanks(line: str) -> list[str]:
    """Split a line at runs of blanks and tabs."""
    return re.findall(r"[^ \t]+", line.rstrip("\r\n"))


def unique_names(names: list[str]) -> tuple[str, ...]:
    """Make the names of columns unique, as columns are found by name: the second ``Mz`` becomes ``Mz_2``.

    A blank name becomes ``column 3`` (counted from 1), and runs of blanks within a name one blank.
    """
    distinct_names: list[str] = []
    for column, name in enumerate(names, start=1):
        base = " ".join(name.split()) or f"column {column}"
        candidate, repeat = base, 2
        while candidate in distinct_names:
            candidate, repeat = f"{base}_{repeat}", repeat + 1
        distinct_names.append(candidate)
    return tuple(distinct_names)
