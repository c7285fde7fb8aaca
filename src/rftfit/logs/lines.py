"""A text file as blocks of whole lines, so that memory stays bounded however long the file is."""

from __future__ import annotations

import codecs
import re
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from rftfit.logs.base import HEAD_BYTES, LogError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

BLOCK_BYTES = 1 << 22
MAX_LINE = 1 << 16

_WIDE = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_LINE_END = re.compile(rb"\r\n|\n|\r")


class Block(NamedTuple):
    """Some lines of a file.

    Attributes
    ----------
    body : bytes
        Whole lines, each with its end.
    rest : bytes
        What stands behind the last line end of the file: the line its writer was stopped in.
        Empty in all blocks but the last.
    """

    body: bytes
    rest: bytes


class TextFile:
    """A text file that is read once, from its beginning to its end.

    UTF-16 is turned into UTF-8 and a byte order mark is left out; all other encodings stay as they
    are, since numbers look the same in all of them.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    head : bytes
        The first 64 kB, or all of a shorter file.

    Raises
    ------
    LogError
        If the file is missing, cannot be read, or holds nothing.
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

        Parameters
        ----------
        start : int
            Bytes of the head to pass over.

        Yields
        ------
        Block
            At least one.
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

    Parameters
    ----------
    head : bytes
        As on the disk.

    Returns
    -------
    bytes
        Empty for a binary file.
    """
    wide = _WIDE.get(head[:2])
    if wide:
        return head[2:].decode(wide, "ignore").encode()
    head = head.removeprefix(codecs.BOM_UTF8)
    return b"" if b"\x00" in head else head


class Line(NamedTuple):
    """One line of the head, without its end, and where the next one begins.

    Attributes
    ----------
    text : str
    stop : int
    whole : bool
        Whether it has a line end.
    """

    text: str
    stop: int
    whole: bool


def lines_of(head: bytes, most: int = 400, encoding: str = "") -> list[Line]:
    """Return the first lines of a file.

    Parameters
    ----------
    head : bytes
    most : int
    encoding : str
        Empty: UTF-8, or Windows-1252 where it is none.

    Returns
    -------
    list of Line
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

    Parameters
    ----------
    raw : bytes
    encoding : str
        Empty to choose.

    Returns
    -------
    str
    """
    if encoding:
        return raw.decode(encoding, "replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")
