"""Packed blocks of ROS bags, unpacked with a limit: a few bytes can unpack to any size."""

from __future__ import annotations

import sys
from functools import cache
from types import SimpleNamespace
from typing import Any, Self

from rftfit.logs.base import MOST_UNPACKED

MOST_OF_BLOCK = 64 << 20
"""Bytes of a block when unpacked; recorders write blocks of 1 to 5 MB."""


_STEP = 1 << 20


def unpack_bz2(packed: bytes) -> bytes:
    """Unpack a block of a ROS 1 bag."""
    from bz2 import BZ2Decompressor

    return _limited(BZ2Decompressor(), packed)


def unpack_lz4(packed: bytes) -> bytes:
    """Unpack a block of a ROS 1 bag or of an MCAP file."""
    from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

    return _limited(LZ4FrameDecompressor(), packed)


def unpack_zstd(packed: bytes) -> bytes:
    """Unpack a block of an MCAP file, or a message."""
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return _limited(zstd.ZstdDecompressor(), packed)


def _limited(decompressor: Any, packed: bytes) -> bytes:
    # part by part: the library takes several times of what it gives at once
    parts = [bytes(decompressor.decompress(packed, max_length=_STEP))]
    size = len(parts[0])
    while parts[-1] and not decompressor.eof:
        parts.append(bytes(decompressor.decompress(b"", max_length=_STEP)))
        size += len(parts[-1])
        if size > MOST_OF_BLOCK:
            parts.clear()  # the error's frames hold them
            raise ValueError(
                f"a block of {len(packed)} bytes unpacks to more than {MOST_OF_BLOCK >> 20} MB"
            )
    if not decompressor.eof:
        raise EOFError("a packed block is cut")
    return b"".join(parts)


class LimitedFile:
    """A packed file that is read up to `MOST_UNPACKED` bytes."""

    def __init__(self, file: Any) -> None:
        self.file = file
        self.unpacked = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def read(self, size: int = -1) -> bytes:
        """Read some bytes."""
        content = bytes(self.file.read(size))
        self.unpacked += len(content)
        if self.unpacked > MOST_UNPACKED:
            raise ValueError(f"the file unpacks to more than {MOST_UNPACKED >> 20} MB")
        return content


@cache
def limit_blocks() -> None:
    """Let the library of bags unpack with the limit, for good."""
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
