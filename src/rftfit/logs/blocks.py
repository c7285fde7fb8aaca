"""Packed blocks of ROS bags, unpacked with a limit: a few bytes can unpack to any size.

The library rosbags unpacks whatever it finds; `limit_blocks` puts the functions of this module in place of its own.
"""

from __future__ import annotations

import sys
from functools import cache
from types import SimpleNamespace
from typing import Any, Self

from rftfit.logs.base import BOUNDS, MOST_UNPACKED

MOST_OF_BLOCK: int = BOUNDS.block_bytes
"""Most bytes of a block when unpacked."""


def unpack_bz2(packed: bytes) -> bytes:
    """Unpack a block of a ROS 1 bag."""
    from bz2 import BZ2Decompressor

    return _unpack_limited(BZ2Decompressor(), packed)


def unpack_lz4(packed: bytes) -> bytes:
    """Unpack a block of a ROS 1 bag or of an MCAP file."""
    from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

    return _unpack_limited(LZ4FrameDecompressor(), packed)


def unpack_zstd(packed: bytes) -> bytes:
    """Unpack a block of an MCAP file, or a message."""
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return _unpack_limited(zstd.ZstdDecompressor(), packed)


def _unpack_limited(decompressor: Any, packed: bytes) -> bytes:
    """Unpack a block; raises ValueError for one with more than `MOST_OF_BLOCK` bytes, EOFError for one that is cut.

    `decompressor`: New object of a library with ``decompress(data, max_length)`` and ``eof``.
    """
    # part by part: the library needs several times the memory of what it returns in one call
    at_a_time = 1 << 20
    parts = [bytes(decompressor.decompress(packed, max_length=at_a_time))]
    size = len(parts[0])
    while parts[-1] and not decompressor.eof:
        parts.append(bytes(decompressor.decompress(b"", max_length=at_a_time)))
        size += len(parts[-1])
        if size > MOST_OF_BLOCK:
            parts.clear()  # else the traceback of the error would keep them in memory
            raise ValueError(
                f"a block of {len(packed)} bytes unpacks to more than {MOST_OF_BLOCK >> 20} MB"
            )
    if not decompressor.eof:
        raise EOFError("a packed block is cut")
    return b"".join(parts)


class LimitedFile:
    """A packed file, open to be read through a library, of which no more than `MOST_UNPACKED` bytes are unpacked."""

    def __init__(self, file: Any) -> None:
        self.file = file
        self.unpacked = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def read(self, size: int = -1) -> bytes:
        """Read at most `size` bytes, or all that are left; raises ValueError beyond the limit."""
        content = bytes(self.file.read(size))
        self.unpacked += len(content)
        if self.unpacked > MOST_UNPACKED:
            raise ValueError(f"the file unpacks to more than {MOST_UNPACKED >> 20} MB")
        return content


@cache
def limit_blocks() -> None:
    """Replace the functions by which the library rosbags unpacks, once and for the whole process."""
    from rosbags.rosbag1 import reader as ros1
    from rosbags.rosbag2 import reader as ros2
    from rosbags.rosbag2 import storage_mcap as mcap

    ros1.decompressors |= {"bz2": unpack_bz2, "lz4": unpack_lz4}
    mcap.DECOMPRESSORS |= {
        "lz4": lambda packed, _: unpack_lz4(packed),
        "zstd": lambda packed, _: unpack_zstd(packed),
    }
    library: Any = ros2
    open_packed = library.zstd.open
    library.zstd = SimpleNamespace(
        decompress=unpack_zstd,
        open=lambda *words, **options: LimitedFile(open_packed(*words, **options)),
    )
