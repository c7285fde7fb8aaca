"""Where the numbers lie in a ROS message: all messages of one layout become columns at once.

A message is a packed row of little-endian numbers with texts and lists in between. As long as these
are equally long in two messages, each number lies at the same place, so a whole recording is cut
into columns without unpacking a single message.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.conventions import FloatArray

LONGEST_LIST = 64
"""Lists longer than this are pictures or scans, not quantities of a run."""

_TYPES = {
    "bool": "u1", "byte": "u1", "char": "u1", "octet": "u1", "int8": "i1", "uint8": "u1",
    "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4", "int64": "<i8",
    "uint64": "<u8", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
_STAMPS = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_NANOSECONDS = 10**9
_UNITS = {
    "force": ("geometry_msgs/msg/Wrench", "N"),
    "torque": ("geometry_msgs/msg/Wrench", "N m"),
    "position": ("geometry_msgs/msg/Pose", "m"),
    "translation": ("geometry_msgs/msg/Transform", "m"),
}


@dataclass(frozen=True)
class Layout:
    """Places of the numbers in messages of one length.

    Parameters
    ----------
    numbers : dict of str to tuple
        Field to (place in bytes, numpy type).
    stamps : dict of str to int
        Field to place of its seconds, which its nanoseconds follow.
    lengths : list of tuple of int
        Place and value of every length word: where these are equal, so are the places.
    size : int
        Bytes of the message.
    """

    numbers: dict[str, tuple[int, str]] = field(default_factory=dict)
    stamps: dict[str, int] = field(default_factory=dict)
    lengths: list[tuple[int, int]] = field(default_factory=list)
    size: int = 0

    def fits(self, raw: np.ndarray) -> np.ndarray:
        """Tell which messages have this layout.

        Parameters
        ----------
        raw : numpy.ndarray of uint8, shape (n, size)

        Returns
        -------
        numpy.ndarray of bool, shape (n,)
        """
        good = np.ones(len(raw), dtype=bool)
        for place, length in self.lengths:
            good &= _words(raw, place, "<u4") == length
        return good

    def columns(self, raw: np.ndarray) -> tuple[dict[str, FloatArray], dict[str, np.ndarray]]:
        """Cut messages into columns.

        Parameters
        ----------
        raw : numpy.ndarray of uint8, shape (n, size)

        Returns
        -------
        numbers : dict of str to numpy.ndarray of float, shape (n,)
        stamps : dict of str to numpy.ndarray of int64, shape (n,)
            ns.
        """
        numbers = {
            name: _words(raw, place, kind).astype(float)
            for name, (place, kind) in self.numbers.items()
        }
        stamps = {
            name: _words(raw, place, "<u4").astype(np.int64) * _NANOSECONDS
            + _words(raw, place + 4, "<u4")
            for name, place in self.stamps.items()
        }
        return numbers, stamps


def layout_of(message: bytes, kind: str, definitions: Mapping[str, Any], cdr: bool) -> Layout:
    """Find the layout of a message by walking through its definition.

    Parameters
    ----------
    message : bytes
        As recorded.
    kind : str
        Its type, for example ``geometry_msgs/msg/WrenchStamped``.
    definitions : mapping
        Type to its fields, as ``rosbags`` keeps them.
    cdr : bool
        Written by ROS 2, where numbers are aligned after four bytes of header; ROS 1 packs them.

    Returns
    -------
    Layout

    Raises
    ------
    ValueError
        If the message is shorter than its definition says, or big-endian.
    """
    if cdr and message[1:2] != b"\x01":
        raise ValueError("a message with the most significant byte first")
    walk = _Walk(message, definitions, cdr)
    try:
        end = walk.message_at(4 if cdr else 0, kind, "", Layout(lengths=walk.lengths))
    except (struct.error, KeyError):  # too short; or of a type that the bag does not define
        end = len(message) + 1
    # ROS 2 may fill up to four bytes
    if not len(message) - (3 if cdr else 0) <= end <= len(message):
        raise ValueError(f"a message of {len(message)} bytes does not fit the type {kind}")
    assert walk.layout is not None
    return Layout(walk.layout.numbers, walk.layout.stamps, walk.lengths, len(message))


def _words(raw: np.ndarray, place: int, kind: str) -> np.ndarray:
    width = np.dtype(kind).itemsize
    return np.ascontiguousarray(raw[:, place : place + width]).view(kind)[:, 0]


class _Walk:
    """A walk through one message, noting where its fields lie."""

    def __init__(self, message: bytes, definitions: Mapping[str, Any], cdr: bool) -> None:
        self.message = message
        self.definitions = definitions
        self.cdr = cdr
        self.lengths: list[tuple[int, int]] = []
        self.layout: Layout | None = None

    def message_at(self, place: int, kind: str, path: str, into: Layout) -> int:
        """Note the fields of a message; returns the place after it."""
        if self.layout is None:
            self.layout = into
        for name, (node, detail) in self.definitions[kind][1]:
            own = f"{path}.{name}" if path else name
            place = self._field(place, node, detail, own, into)
        return place

    def _field(self, place: int, node: int, detail: Any, path: str, into: Layout) -> int:
        # 1 a number or text, 2 a message, 3 a list of known length, 4 one that brings its length
        if node == 1:
            return self._base(place, detail[0], path, into)
        if node == 2:
            if detail in _STAMPS:
                place = self._aligned(place, 4)
                into.stamps[path] = place
                return place + 8
            return self.message_at(place, str(detail), path, into)
        (inner, what), count = detail[0], int(detail[1])
        if node == 4:
            place, count = self._length(place)
        if count > LONGEST_LIST:
            into = Layout()
            if inner == 1 and what[0] in _TYPES:
                width = np.dtype(_TYPES[what[0]]).itemsize
                return self._aligned(place, width) + count * width
        for index in range(count):
            place = self._field(place, inner, what, f"{path}{index}", into)
        return place

    def _base(self, place: int, kind: str, path: str, into: Layout) -> int:
        if kind in _TYPES:
            width = np.dtype(_TYPES[kind]).itemsize
            place = self._aligned(place, width)
            into.numbers[path] = (place, _TYPES[kind])
            return place + width
        place, length = self._length(place)
        return place + length

    def _length(self, place: int) -> tuple[int, int]:
        place = self._aligned(place, 4)
        (length,) = struct.unpack_from("<I", self.message, place)
        if place + 4 + length > len(self.message):
            raise struct.error
        self.lengths.append((place, length))
        return place + 4, int(length)

    def _aligned(self, place: int, width: int) -> int:
        return place + (4 - place) % width if self.cdr else place


def unit_of(name: str, kind: str, definitions: Mapping[str, Any]) -> str:
    """Return the unit that ROS itself lays down for the type that a field is part of.

    Parameters
    ----------
    name : str
        Field, for example ``wrench.force.x``.
    kind : str
        Type of the message.
    definitions : mapping
        Type to its fields.

    Returns
    -------
    str
        Empty where none is laid down.
    """
    parts = name.split(".")
    if name in ("time", "received") or parts[-1] == "stamp":
        return "s"
    if len(parts) < 2 or parts[-2] not in _UNITS:
        return ""
    wanted, unit = _UNITS[parts[-2]]
    inside = kind
    for part in parts[:-2]:
        node, detail = dict(definitions.get(inside, ([], []))[1]).get(part, (0, ""))
        inside = detail if node == 2 else ""
    return unit if inside == wanted else ""
