"""Reads one topic of a ROS 1 or ROS 2 bag: wrenches, joint states, and messages of other types.

A *bag* is a recording of messages; each *topic* carries messages of one type, as packed numbers and texts, and a
*connection* is one sender on it. The way: refuse parts of the file that are too large -> messages of one topic as bytes
(`Topic`) -> offsets of the fields in a message, by the definition of its type (`MessageLayout`) -> a column a field.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from rftfit.logs.base import (
    BOUNDS,
    Log,
    LogError,
    PacketCount,
    Reader,
    library_errors,
    needed_package,
    on_one_line,
    refuse_large_file,
)
from rftfit.logs.blocks import MOST_OF_BLOCK, limit_blocks
from rftfit.logs.rostopic import COUNT, LOST, RECEIVED, STAMP, UNITS
from rftfit.logs.sources import check_where, refuse_several_sources
from rftfit.table.parse import OTHER_SOURCE, add_counts, are_allowed
from rftfit.table.stamps import ns_to_s

# first bytes of the kinds of bags; FOLDER is that of the metadata.yaml of a folder of bags
ROS1, MCAP, SQLITE = b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\x00"
FOLDER = b"rosbag2_bagfile_information"
_ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of a message that is packed by zstd."""

# reasons of the ledger for a message that is left out
CUT = "cut in mid-message"
MISFIT = "message does not fit its type"
MOST_OF_MESSAGES: int = BOUNDS.messages_bytes
"""Most bytes of the messages of a topic."""
MOST_OF_MESSAGE: int = BOUNDS.message_bytes
"""Most bytes of one message."""

# types of topics that every recording has, none of which is the topic of a transducer
_COMMON_TYPES = frozenset(
    ["Log", "ParameterEvent", "String", "Diagnostics", "DiagnosticArray", "TFMessage", "Clock"]
)


class Topic(NamedTuple):
    """All messages of one topic.

    `kind`: Type of the messages, such as ``geometry_msgs/msg/Wrench``. `definitions`: For all types in the bag, the
    type to its constants and its fields, as the library has them: a field is its name, and its sort with details
    (`MessageLayout`). `recorded`: Time of recording, ns since 1970, and bytes of each message. `cdr`: Whether messages
    have the encoding of ROS 2. `cut`: Whether the bag breaks off within a message.
    """

    name: str
    kind: str
    definitions: Mapping[str, Any]
    recorded: list[tuple[int, bytes]]
    cdr: bool
    cut: bool


class RosBagReader(Reader):
    """Bags of ROS 1 (.bag) and ROS 2 (.mcap, .db3, or the metadata.yaml of a folder of them).

    Option `topic`: its name; without it, the only topic that may be of a transducer is read.
    """

    name = "ros-bag"
    description = (
        "ROS 1 or ROS 2 bag (.bag, .mcap, .db3, folder) of wrench, joint or a transducer's messages"
    )
    takes = ("topic",)
    selects = True
    evidence = (
        "the first bytes of a ROS 1 bag, an MCAP file, a rosbag2 database or its metadata.yaml"
    )

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        if head.startswith(SQLITE):
            return b"serialization_format" in head
        return head.startswith((ROS1, MCAP, FOLDER))

    def load(self, path: Path) -> Log:
        """Read one topic of a bag.

        ``time`` is the message's own stamp, or the time of recording (``received``) where it has
        none; the other columns have the names that ``rostopic echo -p`` gives them.
        """
        with needed_package(path, "ROS bags", "rosbags", "ros"):
            import rosbags.typesys  # noqa: F401
        limit_blocks()
        with library_errors(path, "this bag cannot be read"):
            refuse_large_file(path)
            with path.open("rb") as file:
                head = file.read(32)
            topic_name = self.options.get("topic", "")
            ros1 = head.startswith(ROS1)
            topic = _read_ros1(path, topic_name) if ros1 else _read_ros2(path, topic_name, head)
            return _log_of_topic(path, topic, self.where)


def _read_ros1(path: Path, topic_name: str) -> Topic:
    """Read a topic of a ROS 1 bag, also of one without an index; `topic_name`: as in `_choose_topic`."""
    from rosbags.rosbag1 import Reader as Bag
    from rosbags.rosbag1 import ReaderError
    from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
    from rosbags.typesys.msg import normalize_msgtype

    cut = False
    _refuse_large_records(path, ROS1)
    try:
        with Bag(path) as bag:
            topics = {c.id: (c.topic, c.msgtype, c.msgdef.data) for c in bag.connections}
            topic = _choose_topic(path, topics.values(), topic_name)
            connections = [c for c in bag.connections if topics[c.id] == topic]
            messages = _collect(path, bag.messages(connections))
    except LogError:
        raise
    except (ReaderError, AssertionError, ValueError, LookupError, EOFError, OSError):
        # its index is missing or damaged; the messages are read without it
        recovered, cut = recover(path)
        topic = _choose_topic(path, recovered.topics.values(), topic_name)
        messages = [
            (time, raw)
            for connection, time, raw in recovered.messages
            if recovered.topics.get(connection) == topic
        ]
    name, kind, definition = topic
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(definition, kind))
    except TypesysError as error:
        raise LogError(
            "type",
            f"{path}: the definition of {kind} in the bag is not readable: {on_one_line(error)}",
        ) from error
    return Topic(name, normalize_msgtype(kind), store.fielddefs, messages, False, cut)


def _read_ros2(path: Path, topic_name: str, head: bytes) -> Topic:
    """Read a topic of a ROS 2 bag: an MCAP file, a database, or a folder; `head`: first bytes, which say which.

    `topic_name`: As in `_choose_topic`.
    """
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.rosbag2.reader import DirectoryReader
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    # sizes are checked before the library reads a file, since it believes them
    files = [path] if not head.startswith(FOLDER) else sorted(path.parent.iterdir())
    for file in files:
        if file.suffix == ".mcap" or head.startswith(MCAP):
            _refuse_large_records(file, MCAP)
        elif file.suffix == ".db3" or head.startswith(SQLITE):
            _refuse_large_values(path, file)
    if head.startswith(MCAP):
        bag: Any = McapReader(path)
    elif head.startswith(SQLITE):
        bag = Sqlite3Reader(path)
    elif head.startswith(FOLDER):
        bag = DirectoryReader(path.parent)
    else:
        raise LogError("not_a_bag", f"{path}: the file does not begin as a ROS bag does")
    try:
        bag.open()
        topics = [(c.topic, c.msgtype) for c in bag.connections]
        name, kind = topic = _choose_topic(path, topics, topic_name)
        connections = [c for c in bag.connections if (c.topic, c.msgtype) == topic]
        # a database states the sizes of the messages of the topic, now that its name is known
        for storage in getattr(bag, "storages", [bag]):
            if isinstance(storage, Sqlite3Reader):
                _refuse_large_values(path, Path(str(storage.path)), name)
        messages = _collect(path, bag.messages(connections, None, None))
        if messages and messages[0][1].startswith(_ZSTD):
            text = "its messages are compressed, and only the folder's metadata.yaml says how"
            raise LogError(
                "compressed", f"{path}: {text}: name the folder, not the file", len(messages)
            )
        definition = connections[0].msgdef
    except LogError:
        raise
    except Exception as error:  # each storage library has its own errors for a damaged file
        raise LogError(
            "damaged",
            f"{path}: the bag is damaged or was not closed ({on_one_line(error)}); `ros2 bag reindex` or "
            "`mcap recover` may repair it",
        ) from error
    finally:
        # closing fails for a bag that could not be opened
        with suppress(Exception):
            bag.close()
    # types of ROS itself are known; others have to be defined in the bag
    store = get_typestore(Stores.LATEST)
    if kind not in store.fielddefs:
        if definition.format == MessageDefinitionFormat.MSG:
            store.register(get_types_from_msg(definition.data, kind))
        elif definition.format == MessageDefinitionFormat.IDL:
            store.register(get_types_from_idl(definition.data))
        else:
            raise LogError(
                "type",
                f"{path}: the bag does not bring the definition of {kind}, and it is no type of ROS "
                "itself: record it as MCAP, which does, or convert it",
                len(messages),
            )
    return Topic(name, kind, store.fielddefs, messages, True, False)


# --- Refusal of parts that are too large, by the sizes that the file states, before a part is read


def _refuse_large_records(path: Path, head: bytes) -> None:
    """Raise `LogError` for a bag of ROS 1 or an MCAP file with a record that is larger than any recorder writes.

    `head`: First bytes of the kind of file, `ROS1` or `MCAP`.
    """
    with path.open("rb") as file:
        sizes = (
            _sizes_of_records_ros1(file) if head.startswith(ROS1) else _sizes_of_records_mcap(file)
        )
        if max(sizes, default=0) > MOST_OF_BLOCK:
            raise _too_large(path, MOST_OF_BLOCK)


def _sizes_of_records_ros1(file: BinaryIO) -> Iterator[int]:
    """Yield the bytes of each record: a line of version, then length and header, length and data, in turn."""
    file.readline()
    while len(length := file.read(4)) == 4:
        file.seek(int.from_bytes(length, "little"), os.SEEK_CUR)
        size = int.from_bytes(file.read(4), "little")
        yield size
        file.seek(size, os.SEEK_CUR)


_ATTACHMENT = 9
"""Kind of record of an MCAP file that is not read here, so that it may have any size."""


def _sizes_of_records_mcap(file: BinaryIO) -> Iterator[int]:
    """Yield the bytes of each record but attachments: a byte for its kind, eight for its length, then the data."""
    file.seek(len(MCAP))
    while len(head := file.read(9)) == 9:
        size = int.from_bytes(head[1:], "little")
        if head[0] != _ATTACHMENT:
            yield size
        # a damaged length may be larger than the operating system accepts
        file.seek(min(size, 1 << 62), os.SEEK_CUR)


_QUERIES = ("SELECT * FROM schema", "SELECT * FROM topics", "SELECT * FROM message_definitions")
_SIZES = (
    "SELECT max(length(data)), total(length(data)) FROM messages "
    "WHERE topic_id IN (SELECT id FROM topics WHERE name = ?)"
)
"""Queries for all tables but that of the messages, and for the largest message of a topic and their sum, bytes."""


def _refuse_large_values(path: Path, database: Path, topic_name: str = "") -> None:
    """Raise `LogError` for a database of ROS 2 that holds a larger value than any recorder writes.

    Checks the messages of the topic `topic_name`; without a name, all tables but that of the messages. `path`: The log,
    for messages to the user; `database`: the file, which may be one of several.
    """
    import sqlite3  # few logs need it

    uri = f"{database.absolute().as_uri()}?immutable=1"
    with closing(sqlite3.connect(uri, uri=True)) as connection:
        # for a larger value sqlite raises an error before it allocates memory
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_OF_MESSAGE)
        try:
            if not topic_name:
                for query in _QUERIES:
                    # not each version of the format has all three tables
                    with suppress(sqlite3.OperationalError):
                        for _ in connection.execute(query):
                            pass
                return
            largest, size = connection.execute(_SIZES, (topic_name,)).fetchone()
        except sqlite3.DataError as error:
            raise _too_large(path, MOST_OF_MESSAGE) from error
        except sqlite3.DatabaseError:
            return  # damaged: the reader of bags will say how
    if (largest or 0) > MOST_OF_MESSAGE:
        raise _too_large(path, MOST_OF_MESSAGE)
    if size > MOST_OF_MESSAGES:
        raise _too_many(path)


def _too_large(path: Path, most: int) -> LogError:
    """Make the error for a part of a bag with more than `most` bytes."""
    text = f"a message or another part of the bag is larger than {most >> 20} MB, which none of a force or a position is"
    return LogError("too_large", f"{path}: {text}: record the topic of the transducer alone")


def _too_many(path: Path) -> LogError:
    """Make the error for too many bytes of messages on a topic."""
    text = f"more than {MOST_OF_MESSAGES >> 20} MB of messages on the topic; cut the bag into runs"
    return LogError("too_large", f"{path}: {text}")


def _collect(path: Path, messages: Iterable[tuple[Any, int, Any]]) -> list[tuple[int, bytes]]:
    """Return time of recording, ns, and bytes of each message; raises `LogError` if they are too large or too many.

    `messages`: Connection, time of recording and bytes of each.
    """
    collected: list[tuple[int, bytes]] = []
    size = 0
    for _, recorded_ns, raw in messages:
        size += len(raw)
        if len(raw) > MOST_OF_MESSAGE:
            raise _too_large(path, MOST_OF_MESSAGE)
        if size > MOST_OF_MESSAGES:
            raise _too_many(path)
        collected.append((recorded_ns, bytes(raw)))
    return collected


def _choose_topic(
    path: Path, topics: Collection[tuple[str, ...]], topic_name: str
) -> tuple[str, ...]:
    """Return the topic `topic_name`, or, where it is empty, the only one that may be of a transducer.

    `topics`: Name and type of the topic of each connection, in ROS 1 also the definition of the type; one of these is
    returned. Raises `LogError` where there is none, or several could be meant.
    """
    listed = ", ".join(sorted({f"{name} ({kind})" for name, kind, *_ in topics}))
    if not topics:
        raise LogError(
            "header_only", f"{path}: the bag holds no message; if it was cut, `rosbag reindex` it"
        )
    if topic_name:
        candidates = [topic for topic in topics if topic[0] == topic_name]
        if not candidates:
            raise LogError("topic", f"{path}: no topic {topic_name!r}; the bag has: {listed}")
        return candidates[0]
    candidates = [topic for topic in topics if topic[1].split("/")[-1] not in _COMMON_TYPES]
    if len({(name, kind) for name, kind, *_ in candidates}) != 1:
        raise LogError(
            "topic",
            f"{path}: several topics could be meant; say which in the config, options: {{topic: ...}}; "
            f"the bag has: {listed}",
        )
    return candidates[0]


def _log_of_topic(path: Path, topic: Topic, where: Mapping[str, tuple[str, ...]]) -> Log:
    """Make a log of the messages of a topic, each a data line; `where`: as in `Reader`.

    Messages of one size mostly have one layout: all messages that fit the layout of the first one are converted at
    once, then those that are left.
    """
    messages = [message for _, message in topic.recorded]
    count = len(messages)
    cut = {CUT: 1} if topic.cut else {}
    rows = count + len(cut)
    if not count:
        raise LogError("header_only", f"{path}: no message on the topic {topic.name}", rows)
    sizes = np.array([len(message) for message in messages])
    # of all messages, shape (count,): fields to numbers, whether the message fits its type, and fields to texts
    columns: dict[str, np.ndarray] = {}
    good = np.zeros(count, dtype=bool)
    labels: dict[str, np.ndarray] = {}
    for size in np.unique(sizes):
        # messages that are left, and their bytes, shape (messages, size)
        left = np.flatnonzero(sizes == size)
        raw = np.frombuffer(b"".join(messages[i] for i in left), dtype=np.uint8)
        raw = raw.reshape(left.size, int(size))
        while left.size:
            try:
                layout = MessageLayout(raw[0].tobytes(), topic)
            except ValueError:
                left, raw = left[1:], raw[1:]  # this message is not good
                continue
            fits = layout.fits(raw)
            for name, values in layout.columns(raw[fits]).items():
                blank = np.nan if values.dtype == float else 0  # a stamp that was never set is 0
                column = columns.setdefault(name, np.full(count, blank, values.dtype))
                column[left[fits]] = values
            for name, texts in layout.labels(raw[fits]).items():
                labels.setdefault(name, np.full(count, "", dtype=object))[left[fits]] = texts
            good[left[fits]] = True
            left, raw = left[~fits], raw[~fits]
    received = np.array([time for time, _ in topic.recorded], dtype=np.int64)
    if not good.any():
        raise LogError("no_good_row", f"{path}: no message on {topic.name} fits its type", rows)
    log = _with_time(path, topic, columns, received).take(good, MISFIT)
    labels = {name: texts[good] for name, texts in labels.items()}
    log = log.take(_is_of_source(log, labels, where), OTHER_SOURCE)
    return replace(log, rows=rows, dropped=add_counts(log.dropped, cut))


def _is_of_source(
    log: Log, labels: Mapping[str, np.ndarray], where: Mapping[str, tuple[str, ...]]
) -> np.ndarray:
    """Return which messages are of the source that the config names, as one of two sensors: bool of shape (n,).

    Raises `LogError` for messages of several sources where the config does not choose. `labels`: Field, to its texts,
    shape (n,). `where`: As in `Reader`.
    """
    check_where(log.path, where, labels, "text of a message")
    is_of_source = np.ones(log.size, dtype=bool)
    for name, allowed in where.items():
        is_of_source &= are_allowed(labels[name].tolist(), allowed)
    labels_left = {name: texts[is_of_source].tolist() for name, texts in labels.items()}
    times = ("time", RECEIVED)
    readings = [values[is_of_source] for name, values in log.columns.items() if name not in times]
    refuse_several_sources(log.path, labels_left, where, readings)
    return is_of_source


def _with_time(
    path: Path, topic: Topic, fields: dict[str, np.ndarray], received: np.ndarray
) -> Log:
    """Make a log with the time as its first column: the stamp in the message, else the time of recording.

    `fields`: Field, to values, shape (n,); stamps are int64, ns. `received`: Times of recording, ns, shape (n,). In the
    log all times are in s. Messages that the counter in their header shows as lost are counted.
    """
    stamps = {name: values for name, values in fields.items() if values.dtype == np.int64}
    stamp_name = next((name for name in (STAMP, "stamp") if name in stamps), "")
    # a driver may leave the outer header empty and fill that of the wrench inside
    if not stamp_name or not stamps[stamp_name].all():
        stamp_name = next((name for name, times in stamps.items() if times.all()), "")
    time = stamps[stamp_name] if stamp_name else received
    columns = {"time": ns_to_s(time), RECEIVED: ns_to_s(received)}
    columns |= {name: values for name, values in fields.items() if name not in stamps}
    columns |= {name: ns_to_s(times) for name, times in stamps.items() if name != stamp_name}
    units = {name: unit_of(name, topic) for name in columns}
    note = f"topic {topic.name} ({topic.kind}); time is {stamp_name or 'the time of recording'}"
    missing = {}
    if COUNT in columns:
        packets = PacketCount(LOST)
        # a message that does not fit its type was received all the same: it is not counted as lost
        is_counted = np.isfinite(columns[COUNT])
        packets.follow(columns[COUNT][is_counted], np.flatnonzero(is_counted))
        # with many more lost than recorded, the counter was reset
        if 0 < packets.missing < 10 * received.size:
            missing[LOST] = packets.missing
    return Log(path, columns, units, received.size, {}, missing, (note,))


# --- Messages of a ROS 1 bag without a usable index: read record by record up to the cut


_CHUNK, _CONNECTION, _MESSAGE = 5, 7, 2
"""Kinds of records, as `op` in their header states them."""


class Recovered(NamedTuple):
    """Topics and messages of a bag without a usable index, in the order of the file.

    `topics`: Number of a connection, to its topic, type and message definition. `messages`: Number of the connection,
    time of recording (ns), bytes.
    """

    topics: dict[int, tuple[str, str, str]]
    messages: list[tuple[int, int, bytes]]


def recover(path: Path) -> tuple[Recovered, bool]:
    """Read the complete messages of a bag; also return whether it breaks off within a message or a packed block."""
    recovered = Recovered({}, [])
    with path.open("rb") as file:
        file.readline()  # the version
        return recovered, _read_records(file, path.stat().st_size, recovered, inside=False)


def _read_records(source: BinaryIO, size: int, recovered: Recovered, inside: bool) -> bool:
    """Add the records of a bag, or of one block of it (`inside`), to `recovered`; return whether it breaks off.

    `source`, `size`: Open file or block, and its bytes. A record is a header and as many bytes of data as it states;
    messages stand in blocks, which are records, too.
    """
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
            # its data is another header, with the type of the messages
            try:
                number = header.get_uint32("conn")
                topic = normalize(header.get_string("topic"))
                connection_header = Header.read(
                    BytesIO(length.to_bytes(4, "little") + source.read(length))
                )
                recovered.topics[number] = (
                    topic,
                    connection_header.get_string("type"),
                    connection_header.get_string("message_definition"),
                )
            except (ReaderError, UnicodeDecodeError, IndexError):
                return True
        elif kind == _MESSAGE and inside and end <= size:
            try:
                number, time = header.get_uint32("conn"), header.get_time("time")
            except ReaderError:
                return True
            recovered.messages.append((number, time, source.read(length)))
        elif kind == _CHUNK and not inside and _read_chunk(source, header, length, recovered):
            return True
        if end > size:
            return True
        source.seek(end)
    return False


def _read_chunk(
    source: BinaryIO, header: dict[str, bytes], length: int, recovered: Recovered
) -> bool:
    """Add the records of a block to `recovered`; return whether it breaks off. A cut packed block gives no record.

    `source`: The bag, open at the data of the block. `header`, `length`: Header of the block, and bytes of its data.
    """
    from rosbags.rosbag1.reader import decompressors

    content = source.read(length)
    compression = header.get("compression", b"none").decode("ascii", "replace")
    whole = len(content) == length
    if compression != "none":
        try:
            content = decompressors[compression](content)
        except (OSError, ValueError, RuntimeError, EOFError, LookupError):
            return True
    return _read_records(BytesIO(content), len(content), recovered, inside=True) or not whole


# --- Offsets of the numbers in a message: all messages of one layout become columns at once


# number type of ROS, to the type of numpy without its order of bytes
_TYPES = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "octet": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
_NUMBER_OR_TEXT, _MESSAGE_TYPE, _ARRAY, _SEQUENCE = 1, 2, 3, 4
"""Sorts of fields in the definitions of the library; an array has a fixed length, a sequence states its length."""
# types of two numbers, seconds and nanoseconds
_STAMPS = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")


class MessageLayout:
    """Offsets, in bytes, of the numbers in a message, found by walking through the definition of its type.

    `numbers`: Field, to (offset, numpy type). `stamps`: Field, to the offset of its seconds, which its nanoseconds
    follow. `texts`: Field, to (offset, length). `lengths`: Offset and value of each word that states a length: messages
    in which these are equal have the same layout. Fields are named by their path: ``wrench.force.x``. Raises
    ValueError if the message does not fit its type.
    """

    def __init__(self, message: bytes, topic: Topic) -> None:
        self.numbers: dict[str, tuple[int, str]] = {}
        self.stamps: dict[str, int] = {}
        self.texts: dict[str, tuple[int, int]] = {}
        self.lengths: list[tuple[int, int]] = []
        self._message = message
        self._fields = 0  # walked through so far
        self._definitions = topic.definitions
        self._cdr = topic.cdr  # ROS 2 aligns numbers after four bytes of header; ROS 1 packs them
        self._order = ">" if topic.cdr and message[1:2] == b"\x00" else "<"
        try:
            end = self._walk_fields(4 if topic.cdr else 0, topic.kind, "")
        # the message is too short; its type is not defined in the bag; or the type contains itself
        except (struct.error, KeyError, RecursionError):
            end = len(message) + 1
        # ROS 2 may pad a message to a multiple of four bytes
        if not len(message) - (3 if topic.cdr else 0) <= end <= len(message):
            raise ValueError(
                f"a message of {len(message)} bytes does not fit the type {topic.kind}"
            )

    def fits(self, raw: np.ndarray) -> np.ndarray:
        """Return which messages, the rows of `raw` (bytes, shape (n, size)), have this layout."""
        fits = np.ones(len(raw), dtype=bool)
        for offset, length in self.lengths:
            fits &= _numbers_at(raw, offset, f"{self._order}u4") == length
        if self._cdr:
            # byte 1 of the header states the order of bytes
            fits &= (raw[:, 1] == 0) == (self._order == ">")
        return fits

    def columns(self, raw: np.ndarray) -> dict[str, np.ndarray]:
        """Return field, to values, shape (n,), of the messages `raw`: numbers as float64, stamps as int64, ns."""
        columns = {
            name: _numbers_at(raw, offset, number_type).astype(float)
            for name, (offset, number_type) in self.numbers.items()
        }
        for name, offset in self.stamps.items():
            seconds, nanoseconds = (
                _numbers_at(raw, start, f"{self._order}u4").astype(np.int64)
                for start in (offset, offset + 4)
            )
            columns[name] = seconds * 10**9 + nanoseconds
        return columns

    def labels(self, raw: np.ndarray) -> dict[str, list[str]]:
        """Return field, to texts of the messages `raw`: one for each message, or a single one if all are alike."""
        return {
            name: _texts(raw[:, offset : offset + length])
            for name, (offset, length) in self.texts.items()
        }

    def _walk_fields(self, offset: int, kind: str, path: str | None) -> int:
        """Store the offsets of the fields of a message that begins at `offset`; return the offset behind it.

        `kind`: Its type. `path`: Names of the fields that lead to it, empty for the whole; None: nothing is stored.
        """
        for name, (node, detail) in self._definitions[kind][1]:
            field_path = None if path is None else f"{path}.{name}" if path else name
            offset = self._walk_field(offset, node, detail, field_path)
        return offset

    def _walk_field(self, offset: int, node: int, detail: Any, path: str | None) -> int:
        """Store the offset of one field and return the offset behind it; raises struct.error if it does not fit.

        `node`: Its sort. `detail`: Its type; of a list, the sort and type of an element, and the number of elements.
        `path`: As in `_walk_fields`, with the name of the field.
        """
        self._fields += 1
        if self._fields > BOUNDS.message_fields:
            raise struct.error
        if node == _NUMBER_OR_TEXT:
            return self._number_or_text(offset, detail[0], path)
        if node == _MESSAGE_TYPE:
            if detail not in _STAMPS:
                return self._walk_fields(offset, str(detail), path)
            offset = self._aligned(offset, 4)
            if path is not None:
                self.stamps[path] = offset
            return offset + 8
        (element_node, element_detail), count = detail[0], int(detail[1])
        if node == _SEQUENCE:
            offset, count = self._read_length(offset)
        if node == _ARRAY and count > len(self._message) - offset:
            # each element takes a byte or more
            raise struct.error
        if count > BOUNDS.columns:
            # so long a list is no reading, but a picture or scan
            path = None
            if element_node == _NUMBER_OR_TEXT and element_detail[0] in _TYPES:
                width = np.dtype(_TYPES[element_detail[0]]).itemsize
                return self._aligned(offset, width) + count * width
        for index in range(count):
            element_path = None if path is None else f"{path}{index}"
            end = self._walk_field(offset, element_node, element_detail, element_path)
            if not offset < end <= len(self._message):
                # an element without bytes, of which there may be any number, or one beyond the end
                raise struct.error
            offset = end
        return offset

    def _number_or_text(self, offset: int, kind: str, path: str | None) -> int:
        """Store the offset of a number or text and return the offset behind it; arguments as in `_walk_field`."""
        if kind not in _TYPES:
            offset, length = self._read_length(offset)
            if path is not None and length <= BOUNDS.label_bytes:
                self.texts[path] = offset, length
            return offset + length
        width = np.dtype(_TYPES[kind]).itemsize
        offset = self._aligned(offset, width)
        if path is not None:
            self.numbers[path] = (offset, self._order + _TYPES[kind])
        return offset + width

    def _read_length(self, offset: int) -> tuple[int, int]:
        """Read a length word; return the offset behind it, and the length."""
        offset = self._aligned(offset, 4)
        (length,) = struct.unpack_from(f"{self._order}I", self._message, offset)
        if offset + 4 + length > len(self._message):
            raise struct.error
        self.lengths.append((offset, length))
        return offset + 4, int(length)

    def _aligned(self, offset: int, width: int) -> int:
        """Return the offset of a number of `width` bytes: in ROS 2 a multiple of the width behind the header."""
        return offset + (4 - offset) % width if self._cdr else offset


def _texts(fields: np.ndarray) -> list[str]:
    """Return the texts of `fields`, bytes of shape (n, length); a single one where all are alike, which is fast."""
    if not (fields != fields[:1]).any():
        fields = fields[:1]
    return [bytes(field).rstrip(b"\0").decode("utf-8", "replace") for field in fields]


def _numbers_at(raw: np.ndarray, offset: int, number_type: str) -> np.ndarray:
    """Return the number at an offset, in bytes, of each message, shape (n,); `number_type`: its numpy type."""
    width = np.dtype(number_type).itemsize
    return np.ascontiguousarray(raw[:, offset : offset + width]).view(number_type)[:, 0]


def unit_of(name: str, topic: Topic) -> str:
    """Return the unit of a field, as ROS defines it for the message type that the field is part of; empty: none.

    `name`: Path of the field, such as ``wrench.force.x``: the type of the message at ``wrench`` says what force is.
    """
    parts = name.split(".")
    if name in ("time", RECEIVED) or parts[-1] == "stamp":
        return "s"
    if len(parts) < 2 or parts[-2] not in UNITS:
        return ""
    parent_type, unit = UNITS[parts[-2]]
    # the type of the message that the vector is part of: from the whole message inward
    inside = topic.kind
    for field in parts[:-2]:
        node, detail = dict(topic.definitions.get(inside, ([], []))[1]).get(field, (0, ""))
        inside = detail if node == _MESSAGE_TYPE else ""
    return unit if inside == parent_type else ""
