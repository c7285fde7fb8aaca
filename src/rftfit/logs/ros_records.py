"""Messages of a ROS 1 bag that its index does not lead to: read record by record up to the cut."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path
    from typing import BinaryIO

_CHUNK, _CONNECTION, _MESSAGE = 5, 7, 2


class Recovered(NamedTuple):
    """What a bag without a usable index still holds.

    Attributes
    ----------
    topics : dict of int to tuple of str
        Connection to topic, type and message definition.
    messages : list of tuple
        Connection, time of recording (ns), message; in the order of the file.
    cut : bool
        The file ends within a message or a compressed block.
    """

    topics: dict[int, tuple[str, str, str]]
    messages: list[tuple[int, int, bytes]]
    cut: bool


def recover(path: Path) -> Recovered:
    """Read the complete messages of a bag from its start to where it breaks off.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Recovered

    Raises
    ------
    OSError
        If the file cannot be read.
    """
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
