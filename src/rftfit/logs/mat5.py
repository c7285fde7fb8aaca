"""MATLAB files of version 5 (``save -v6``, ``-v7``): every size that they state is checked against the bytes that are there.

The usual library believes what a file says of itself, and damaged ones end the whole program.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rftfit.logs.base import MOST_UNPACKED, check_unpacked

MOST_MATRICES = 500_000
"""Most arrays in one file: a cell that takes a few bytes there takes hundreds in memory."""

DEEPEST = 30
"""Most structs and cells inside one another."""

_HEAD = 128
_PEEK = 4096
"""Bytes of a packed variable that are unpacked to learn its sizes."""
_TYPES = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_MATRIX, _PACKED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMBERS = range(6, 16)
_COMPLEX = 1 << 11


class NoArray(NamedTuple):
    """Something of MATLAB that is no array of numbers, in words."""

    what: str


def read_mat5(path: Path) -> Iterator[tuple[str, Any]]:
    """Read the variables of a file: arrays, structs as arrays of records, cells as arrays of objects, `NoArray`.

    Raises
    ------
    LogError
        If a content takes more than `MOST_UNPACKED` bytes.
    ValueError
        If the file does not hold what it states.
    """
    with path.open("rb") as file:
        order = "<" if file.read(_HEAD)[_HEAD - 2 :] == b"IM" else ">"
        matrices = _Matrices(path, order)
        while tag := file.read(8):
            kind, size = _words(tag, order)
            if kind not in (_MATRIX, _PACKED):
                file.seek(size, 1)
                continue
            content = file.read(size)
            if len(content) < size:
                raise ValueError(f"a variable of {size} bytes has {len(content)}")
            if kind == _PACKED:
                kind, inside = next(matrices.elements(matrices.unpack(content)))
                if kind != _MATRIX:
                    continue
            else:
                inside = memoryview(content)
            name, value = matrices.read(inside)
            if name:
                yield name, value


def _words(content: bytes | memoryview, order: str) -> tuple[int, int]:
    if len(content) < 8:
        raise ValueError("the file ends in mid-element")
    first, second = np.frombuffer(content[:8], f"{order}u4").tolist()
    return first, second


class _Matrices:
    """Reads matrices, and counts what all of one file take."""

    def __init__(self, path: Path, order: str) -> None:
        self._path, self._order = path, order
        self._unpacked = self._stated = self._count = 0

    def unpack(self, packed: bytes) -> memoryview:
        """Unpack a variable, up to what a log may have, and not before its stated sizes are looked at."""
        head = memoryview(zlib.decompressobj().decompress(packed, _PEEK))
        elements = self.elements(head[8:])
        if int(self._next_numbers(elements)[0]) & 0xFF != _OPAQUE:
            check_unpacked(self._path, 8 * math.prod(self._sizes(elements)))
        unpacked = zlib.decompressobj().decompress(packed, MOST_UNPACKED - self._unpacked + 1)
        self._unpacked += len(unpacked)
        check_unpacked(self._path, self._unpacked)
        return memoryview(unpacked)

    def elements(self, content: memoryview) -> Iterator[tuple[int, memoryview]]:
        """Cut a content into elements: the kind and the bytes of each."""
        place = 0
        while place < len(content):
            kind, size = _words(content[place:], self._order)
            begin, step = place + 8, 8 + size + -size % 8
            if kind >> 16:
                # a small one: its size stands beside its kind, its bytes where others have their size
                kind, size, begin, step = kind & 0xFFFF, kind >> 16, place + 4, 8
            if begin + size > len(content) or (step == 8 and size > 4):
                raise ValueError(
                    f"an element of {size} bytes where {len(content) - begin} are left"
                )
            yield kind, content[begin : begin + size]
            place += step

    def read(self, content: memoryview, depth: int = 0) -> tuple[str, Any]:
        """Read a matrix: its name and its value."""
        self._count += 1
        if depth > DEEPEST or self._count > MOST_MATRICES:
            raise ValueError(f"more than {MOST_MATRICES} arrays, or {DEEPEST} inside one another")
        if not content:
            return "", np.empty((0, 0))
        elements = self.elements(content)
        flags = int(self._next_numbers(elements)[0])
        sort = flags & 0xFF
        if sort == _OPAQUE:
            return self._next_text(elements), NoArray("an object: a MATLAB table or timeseries")
        sizes = self._sizes(elements)
        count, name = math.prod(sizes), self._next_text(elements)
        if sort in (_OBJECT, _SPARSE, _FUNCTION):
            what = {_OBJECT: "an object", _SPARSE: "a sparse matrix", _FUNCTION: "a function"}
            return name, NoArray(what[sort])
        if sort == _CHAR:
            return name, np.array([""])
        if sort == _CELL:
            cells = self._children(elements, count, len(content), depth)
            return name, cells.reshape(sizes, order="F")
        if sort == _STRUCT:
            return name, self._struct(elements, sizes, len(content), depth)
        if sort not in _NUMBERS:
            raise ValueError(f"an array of the unknown class {sort}")
        self._stated += 8 * count
        check_unpacked(self._path, self._stated)
        values = self._next_numbers(elements)
        if values.size != count:
            raise ValueError(f"an array of the sizes {sizes} with {values.size} values")
        if flags & _COMPLEX:
            return name, NoArray("complex numbers")
        return name, values.reshape(sizes, order="F")

    def _struct(
        self, elements: Iterator[tuple[int, memoryview]], sizes: list[int], room: int, depth: int
    ) -> np.ndarray:
        length = max(1, int(self._next_numbers(elements)[0]))
        _, written = next(elements)
        names = [
            bytes(written[place : place + length]).partition(b"\0")[0].decode("utf-8", "replace")
            for place in range(0, len(written), length)
        ]
        values = self._children(elements, math.prod(sizes) * len(names), room, depth)
        records = np.empty(math.prod(sizes), dtype=[(name, object) for name in names])
        for place, name in enumerate(names):
            records[name] = values[place :: len(names)]
        return records.reshape(sizes, order="F")

    def _children(
        self, elements: Iterator[tuple[int, memoryview]], count: int, room: int, depth: int
    ) -> np.ndarray:
        if 8 * count > room:
            raise ValueError(f"{count} arrays in {room} bytes")
        values = np.empty(count, dtype=object)
        for place in range(count):
            kind, content = next(elements)
            if kind != _MATRIX:
                raise ValueError(f"an element of the kind {kind} in place of an array")
            values[place] = self.read(content, depth + 1)[1]
        return values

    def _sizes(self, elements: Iterator[tuple[int, memoryview]]) -> list[int]:
        sizes: list[int] = self._next_numbers(elements).tolist()
        if min(sizes, default=-1) < 0:
            raise ValueError(f"an array of the sizes {sizes}")
        return sizes

    def _next_numbers(self, elements: Iterator[tuple[int, memoryview]]) -> np.ndarray:
        kind, content = next(elements, (0, memoryview(b"")))
        if kind not in _TYPES:
            raise ValueError(f"an element of the unknown kind {kind}")
        numbers = np.frombuffer(content, self._order + _TYPES[kind])
        return numbers.astype(numbers.dtype.newbyteorder("="), copy=False)

    def _next_text(self, elements: Iterator[tuple[int, memoryview]]) -> str:
        _, content = next(elements, (0, memoryview(b"")))
        return bytes(content).decode("utf-8", "replace")
