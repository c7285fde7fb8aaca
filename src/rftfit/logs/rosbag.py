"""ROS 1 and ROS 2 bags: wrenches, joint states, and messages of other types."""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rftfit.logs.base import Log, LogError, Reader, added, ns_to_s, text_option

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import BinaryIO

    from rftfit.conventions import FloatArray


# --- Where the numbers lie in a ROS message: all messages of one layout become columns at once.


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

    `numbers`: Field to (place in bytes, numpy type).
    `stamps`: Field to place of its seconds, which its nanoseconds follow.
    `lengths`: Place and value of every length word: where these are equal, so are the places.
    `size`: Bytes of the message.
    """

    numbers: dict[str, tuple[int, str]] = field(default_factory=dict)
    stamps: dict[str, int] = field(default_factory=dict)
    lengths: list[tuple[int, int]] = field(default_factory=list)
    size: int = 0

    def fits(self, raw: np.ndarray) -> np.ndarray:
        """Tell which messages have this layout.

        `raw`: shape (n, size). Returns shape (n,).
        """
        good = np.ones(len(raw), dtype=bool)
        for place, length in self.lengths:
            good &= _words(raw, place, "<u4") == length
        return good

    def columns(self, raw: np.ndarray) -> tuple[dict[str, FloatArray], dict[str, np.ndarray]]:
        """Cut messages into columns.

        `raw`: shape (n, size). Returns `numbers` of shape (n,). Returns `stamps` of shape (n,):
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

    `message`: As recorded. `kind`: Its type, for example ``geometry_msgs/msg/WrenchStamped``.
    `definitions`: Type to its fields, as ``rosbags`` keeps them. `cdr`: Written by ROS 2, where
    numbers are aligned after four bytes of header; ROS 1 packs them.
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

    `name`: Field, for example ``wrench.force.x``. `kind`: Type of the message. `definitions`: Type
    to its fields. Returns empty where none is laid down.
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


# --- Messages of a ROS 1 bag that its index does not lead to: read record by record up to the cut.


_CHUNK, _CONNECTION, _MESSAGE = 5, 7, 2


class Recovered(NamedTuple):
    """What a bag without a usable index still holds.

    `topics`: Connection to topic, type and message definition.
    `messages`: Connection, time of recording (ns), message; in the order of the file.
    `cut`: The file ends within a message or a compressed block.
    """

    topics: dict[int, tuple[str, str, str]]
    messages: list[tuple[int, int, bytes]]
    cut: bool


def recover(path: Path) -> Recovered:
    """Read the complete messages of a bag from its start to where it breaks off."""
    found = Recovered({}, [], False)
    with path.open("rb") as file:
        file.readline()
        size = path.stat().st_size
        cut = _records(file, size, found, inside=False)
    return found._replace(cut=cut)


def _records(source: BinaryIO, size: int, found: Recovered, inside: bool) -> bool:
    """Note the records of a bag or of a block of it; tells whether it breaks off."""
    from rosbags.rosbag1.reader import Header, ReaderError, normalize, read_uint32

    while source.tell() < size:
        try:
            header = Header.read(source)
            kind = header.get_uint8("op")
            length = read_uint32(source)
        except (ReaderError, UnicodeDecodeError):
            return True
        end = source.tell() + length
        if kind == _CONNECTION and end <= size:
            try:
                number = header.get_uint32("conn")
                topic = normalize(header.get_string("topic"))
                more = Header.read(BytesIO(length.to_bytes(4, "little") + source.read(length)))
                found.topics[number] = (
                    topic, more.get_string("type"), more.get_string("message_definition"),
                )  # fmt: skip
            except (ReaderError, UnicodeDecodeError, IndexError):
                return True
        elif kind == _MESSAGE and inside and end <= size:
            try:
                number, time = header.get_uint32("conn"), header.get_time("time")
            except ReaderError:
                return True
            found.messages.append((number, time, source.read(length)))
        elif kind == _CHUNK and not inside and _chunk(source, header, length, found):
            return True
        if end > size:
            return True
        source.seek(end)
    return False


def _chunk(source: BinaryIO, header: dict[str, bytes], length: int, found: Recovered) -> bool:
    """Read a block; of a compressed one nothing comes back unless it is whole."""
    from rosbags.rosbag1.reader import decompressors

    content = source.read(length)
    compression = header.get("compression", b"none").decode("ascii", "replace")
    whole = len(content) == length
    if compression != "none":
        try:
            content = decompressors[compression](content)
        except (OSError, ValueError, RuntimeError, EOFError, LookupError):
            return True
    return _records(BytesIO(content), len(content), found, inside=True) or not whole


# --- ROS bags: wrenches, joint states, and messages of a transducer's own type.


ROS1, MCAP, SQLITE = b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\x00"

CUT = "cut in mid-message"
MISFIT = "message does not fit its type"
LOST = "lost packets (gap in header.seq)"

_MAX_BYTES = 2 << 30
_CHATTER = (
    "Log",
    "ParameterEvent",
    "String",
    "Diagnostics",
    "DiagnosticArray",
    "TFMessage",
    "Clock",
)
"""Types of topics that every recording has and that are no transducer's."""

INSTALL = 'pip install "rftfit[ros]"'


class _Topic(NamedTuple):
    """All messages of one topic: type, the fields of all types, time of recording (ns), messages."""

    name: str
    kind: str
    definitions: Mapping[str, Any]
    received: list[int]
    messages: list[bytes]
    cdr: bool
    cut: bool


class RosBagReader(Reader):
    """Bags of ROS 1 (.bag) and ROS 2 (.mcap, .db3).

    `topic`: Which one; by default the only one that can be meant.
    """

    name = "ros-bag"
    evidence = "the first bytes of a ROS 1 bag, an MCAP file or a rosbag2 database"

    def __init__(self, topic: str = "") -> None:
        self.topic = topic

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return (
            "ROS 1 or ROS 2 bag (.bag, .mcap, .db3) with wrench, joint or a transducer's messages"
        )

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        if head.startswith(SQLITE):
            return b"serialization_format" in head
        return head.startswith((ROS1, MCAP))

    def with_options(self, options: Mapping[str, object]) -> RosBagReader:
        """Return the reader of one topic.

        `options`: ``topic``: which one, where a bag has several that could be meant.
        """
        return RosBagReader(text_option(options, "topic", self.topic, "/wrench"))

    def load(self, path: Path) -> Log:
        """Read one topic of a bag.

        Returns ``time`` is the message's own stamp, or the time of recording where it has none;
        ``received`` the time of recording; the other columns are the message's numbers by the
        names that ``rostopic echo -p`` gives them, without ``field.``.
        """
        _need_rosbags(path)
        try:
            if path.stat().st_size > _MAX_BYTES:
                raise LogError("too_large", f"{path}: larger than {_MAX_BYTES >> 30} GB; split it")
            with path.open("rb") as file:
                head = file.read(16)
            ros1 = head.startswith(ROS1)
            topic = _ros1(path, self.topic) if ros1 else _ros2(path, self.topic, head)
        except FileNotFoundError:
            raise LogError("missing", f"{path}: log missing") from None
        except OSError as error:
            raise LogError("unreadable", f"{path}: cannot be read: {error.strerror}") from error
        return _log(path, topic)


def _need_rosbags(path: Path) -> None:
    try:
        import rosbags.typesys  # noqa: F401
    except ImportError:
        raise LogError(
            "extra", f"{path}: ROS bags are read with the package rosbags; install it: {INSTALL}"
        ) from None


def _ros1(path: Path, wanted: str) -> _Topic:
    from rosbags.rosbag1 import Reader as Bag
    from rosbags.rosbag1 import ReaderError
    from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
    from rosbags.typesys.msg import normalize_msgtype

    cut = False
    try:
        with Bag(path) as bag:
            topics = {c.id: (c.topic, c.msgtype, c.msgdef.data) for c in bag.connections}
            number = _choose(path, {k: v[:2] for k, v in topics.items()}, wanted)
            chosen = [c for c in bag.connections if topics[c.id] == topics[number]]
            got = [(time, bytes(raw)) for _, time, raw in bag.messages(chosen)]
    except LogError:
        raise
    except (ReaderError, AssertionError, ValueError, LookupError, EOFError, OSError):
        # its index is missing or damaged; the messages are read without it
        found = recover(path)
        topics, cut = found.topics, found.cut
        number = _choose(path, {k: v[:2] for k, v in topics.items()}, wanted)
        same = {k for k, v in topics.items() if v == topics[number]}
        got = [(time, raw) for connection, time, raw in found.messages if connection in same]
    name, kind, definition = topics[number]
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(definition, kind))
    except TypesysError as error:
        raise LogError(
            "type", f"{path}: the definition of {kind} in the bag is not readable: {error}"
        ) from error
    times, messages = [time for time, _ in got], [raw for _, raw in got]
    return _Topic(name, normalize_msgtype(kind), store.fielddefs, times, messages, False, cut)


def _ros2(path: Path, wanted: str, head: bytes) -> _Topic:
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.rosbag2 import ReaderError
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if head.startswith(MCAP):
        bag: Any = McapReader(path)
    elif head.startswith(SQLITE):
        bag = Sqlite3Reader(path)
    else:
        raise LogError("not_a_bag", f"{path}: the file does not begin as a ROS bag does")
    try:
        bag.open()
        topics = {c.id: (c.topic, c.msgtype) for c in bag.connections}
        number = _choose(path, topics, wanted)
        chosen = [c for c in bag.connections if topics[c.id] == topics[number]]
        got = [(time, bytes(raw)) for _, time, raw in bag.messages(chosen)]
        definition = chosen[0].msgdef
    except LogError:
        raise
    except ReaderError as error:
        raise _damaged(path, error) from error
    except Exception as error:  # each storage library has its own errors for a damaged file
        raise _damaged(path, error) from error
    finally:
        # of a bag that could not be opened there may be nothing to close
        with suppress(Exception):
            bag.close()
    name, kind = topics[number]
    store = get_typestore(Stores.LATEST)
    if kind not in store.fielddefs:
        makers = {
            MessageDefinitionFormat.MSG: lambda: get_types_from_msg(definition.data, kind),
            MessageDefinitionFormat.IDL: lambda: get_types_from_idl(definition.data),
        }
        if definition.format not in makers:
            raise LogError(
                "type",
                f"{path}: the bag does not bring the definition of {kind}, and it is no type of ROS "
                "itself: record it as MCAP, which does, or convert it",
                len(got),
            )
        store.register(makers[definition.format]())
    times, messages = [time for time, _ in got], [raw for _, raw in got]
    return _Topic(name, kind, store.fielddefs, times, messages, True, False)


def _damaged(path: Path, error: Exception) -> LogError:
    return LogError(
        "damaged",
        f"{path}: the bag is damaged or was not closed ({error}); `ros2 bag reindex` or `mcap recover` "
        "may repair it",
    )


def _choose(path: Path, topics: dict[int, tuple[str, str]], wanted: str) -> int:
    """Find the connection of the wanted topic, or the only one that can be meant."""
    listed = ", ".join(sorted(f"{topic} ({kind})" for topic, kind in set(topics.values())))
    if not topics:
        raise LogError(
            "header_only", f"{path}: the bag holds no message; if it was cut, `rosbag reindex` it"
        )
    if wanted:
        named = [number for number, (topic, _) in topics.items() if topic == wanted]
        if not named:
            raise LogError("topic", f"{path}: no topic {wanted!r}; the bag has: {listed}")
        return named[0]
    likely = [n for n, (_, kind) in topics.items() if kind.split("/")[-1] not in _CHATTER]
    if len({topics[number] for number in likely}) != 1:
        raise LogError(
            "topic",
            f"{path}: several topics could be meant; say which in the config, options: {{topic: ...}}; "
            f"the bag has: {listed}",
        )
    return likely[0]


def _log(path: Path, topic: _Topic) -> Log:
    """Cut the messages into columns, layout by layout."""
    count = len(topic.messages)
    cut = {CUT: 1} if topic.cut else {}
    rows = count + len(cut)
    if not count:
        raise LogError("header_only", f"{path}: no message on the topic {topic.name}", rows)
    sizes = np.array([len(message) for message in topic.messages])
    numbers: dict[str, FloatArray] = {}
    stamps: dict[str, np.ndarray] = {}
    good = np.zeros(count, dtype=bool)
    for size in np.unique(sizes):
        places = np.flatnonzero(sizes == size)
        raw = np.frombuffer(b"".join(topic.messages[i] for i in places), dtype=np.uint8)
        raw = raw.reshape(places.size, int(size))
        while places.size:
            try:
                layout = layout_of(raw[0].tobytes(), topic.kind, topic.definitions, topic.cdr)
            except ValueError:
                places, raw = places[1:], raw[1:]
                continue
            fits = layout.fits(raw)
            of_numbers, of_stamps = layout.columns(raw[fits])
            for name, values in of_numbers.items():
                numbers.setdefault(name, np.full(count, np.nan))[places[fits]] = values
            for name, times in of_stamps.items():
                stamps.setdefault(name, np.zeros(count, dtype=np.int64))[places[fits]] = times
            good[places[fits]] = True
            places, raw = places[~fits], raw[~fits]
    received = np.array(topic.received, dtype=np.int64)
    if not good.any():
        raise LogError("no_good_row", f"{path}: no message on {topic.name} fits its type", rows)
    log = _with_time(path, topic, numbers, stamps, received).take(good, MISFIT)
    return replace(log, rows=rows, dropped=added(log.dropped, cut))


def _with_time(
    path: Path, topic: _Topic, numbers: dict[str, FloatArray], stamps: dict[str, np.ndarray],
    received: np.ndarray,
) -> Log:  # fmt: skip
    """Put the time first, from the message's own stamp where it has one."""
    own = next((name for name in ("header.stamp", "stamp") if name in stamps), "")
    # a transducer's type may leave its own header empty and fill the one of the wrench inside
    if not own or not stamps[own].all():
        own = next((name for name, times in stamps.items() if times.all()), "")
    time = stamps[own] if own else received
    columns = {"time": ns_to_s(time), "received": ns_to_s(received)}
    columns |= numbers
    columns |= {name: ns_to_s(times) for name, times in stamps.items() if name != own}
    units = {name: unit_of(name, topic.kind, topic.definitions) for name in columns}
    note = f"topic {topic.name} ({topic.kind}); time is {own or 'the time of recording'}"
    missing = {}
    if "header.seq" in columns and len(topic.received) > 1:
        step = np.diff(columns["header.seq"])
        lost = int((step[step > 1] - 1).sum())
        # a counter that jumps by more than was recorded was set anew
        if 0 < lost < 10 * len(topic.received):
            missing[LOST] = lost
    return Log(path, columns, units, len(topic.received), {}, missing, (note,))
