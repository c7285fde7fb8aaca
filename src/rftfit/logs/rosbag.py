"""ROS bags: wrenches, joint states, and messages of a transducer's own type."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rftfit.logs.base import Log, LogError, Reader, added, text_option
from rftfit.logs.ros_layout import layout_of, unit_of
from rftfit.logs.timing import ns_to_s

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from rftfit.conventions import FloatArray

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

    Parameters
    ----------
    topic : str, optional
        Which one; by default the only one that can be meant.
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
        """Tell from the first 64 kB of a file whether it is of this dialect.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        bool
        """
        if head.startswith(SQLITE):
            return b"serialization_format" in head
        return head.startswith((ROS1, MCAP))

    def with_options(self, options: Mapping[str, object]) -> RosBagReader:
        """Return the reader of one topic.

        Parameters
        ----------
        options : mapping
            ``topic``: which one, where a bag has several that could be meant.

        Returns
        -------
        RosBagReader

        Raises
        ------
        ValueError
            If there is another option, or the topic is no text.
        """
        return RosBagReader(text_option(options, "topic", self.topic, "/wrench"))

    def load(self, path: Path) -> Log:
        """Read one topic of a bag.

        Parameters
        ----------
        path : Path

        Returns
        -------
        Log
            ``time`` is the message's own stamp, or the time of recording where it has none;
            ``received`` the time of recording; the other columns are the message's numbers by the
            names that ``rostopic echo -p`` gives them, without ``field.``.

        Raises
        ------
        LogError
            If the file is no bag, holds no message, or several topics that could be meant.
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

    from rftfit.logs.ros_records import recover

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
