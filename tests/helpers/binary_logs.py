"""Small logs that libraries of other people read, written from numbers: for tests and fuzzing."""

import bz2
import io
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rftfit.lab.dialects import WRITERS
from rftfit.lab.write import LogColumn
from rftfit.logs.base import Reader
from rftfit.logs.registry import dialect

WRENCH = "geometry_msgs/msg/WrenchStamped"
ROS1_TYPE = "float64[3] force\nuint32 count\n"


@dataclass(frozen=True)
class Binary:
    """A kind of file: its reader, contents of small ones, and the name under which each is read.

    `beside`: Files that lie in the same folder, by name.
    """

    reader: Reader
    contents: list[bytes]
    name: str
    beside: dict[str, bytes]


def columns(rows):
    """Time and two forces."""
    time_s = np.arange(rows) / 100
    return {"time_s": time_s, "F1_N": np.sin(time_s), "F2_N": 0.1 * time_s}


def write_ros1(path, definition, raw, *, packed=None, count=1):
    """A bag of ROS 1 with one message some times; gives its path."""
    from rosbags import rosbag1

    bag = rosbag1.Writer(path)
    if packed:
        bag.set_compression(packed)
    with bag:
        topic = bag.add_connection("/force", "lab/msg/Force", msgdef=definition, md5sum="0" * 32)
        for index in range(count):
            bag.write(topic, (index + 1) * 10**9, raw)
    return path


def write_packed_zeros(path, millions):
    """A bag of ROS 1 with one packed block of so many million zeros; its index is as it should be."""
    from rosbags.rosbag1 import Writer

    write_ros1(path, "uint8[] x", bytes(8), packed=Writer.CompressionFormat.BZ2)
    content = path.read_bytes()
    packer = bz2.BZ2Compressor()
    packed = b"".join(packer.compress(bytes(1_000_000)) for _ in range(millions)) + packer.flush()
    begin = content.index(b"BZh")
    length = int.from_bytes(content[begin - 4 : begin], "little")
    head = content[: begin - 4]
    place = head.rindex(b"size=") + 5
    head = head[:place] + (1_000_000 * millions).to_bytes(4, "little") + head[place + 4 :]
    place = head.index(b"index_pos=") + 10
    index = int.from_bytes(head[place : place + 8], "little") + len(packed) - length
    head = head[:place] + index.to_bytes(8, "little") + head[place + 8 :]
    tail = content[begin + length :]
    path.write_bytes(head + len(packed).to_bytes(4, "little") + packed + tail)
    return path


NOTHING = "=" * 80 + "\nMSG: lab/Nothing\n"
MANY_WITHOUT_BYTES = f"lab/Nothing[1000000000] x\nfloat64 y\n{NOTHING}"
"""Definition of a message that is a thousand million messages without bytes, and a number."""


def write_ros2(path, raws, plugin="MCAP", kind=WRENCH, topics=("/wrench",), mode="NONE"):
    """Messages on topics in turn, 10 ms apart; gives the file of the recording."""
    from rosbags import rosbag2

    bag = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin])
    if mode != "NONE":
        bag.set_compression(rosbag2.CompressionMode[mode], rosbag2.CompressionFormat.ZSTD)
    with bag:
        added = [bag.add_connection(topic, kind, typestore=ros2_store()) for topic in topics]
        for index, raw in enumerate(raws):
            bag.write(added[index % len(added)], 5 * 10**9 + index * 10**7, raw)
    return next(path.glob("*.mcap" if plugin == "MCAP" else "*.db3*"))


def ros2_store():
    """Types of ROS 2."""
    from rosbags import typesys

    store: Any = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    return store


def wrench(index, frame="sensor", *, little_endian=True):
    """A message of a transducer, packed."""
    store = ros2_store()
    types = store.types
    vector = types["geometry_msgs/msg/Vector3"]
    stamp = types["builtin_interfaces/msg/Time"](100 + index // 100, index % 100 * 10**7)
    message = types[WRENCH](
        types["std_msgs/msg/Header"](stamp, frame),
        types["geometry_msgs/msg/Wrench"](
            vector(1.0 * index, -2.0, 0.5), vector(0.1, 0.2, 0.3 * index)
        ),
    )
    return store.serialize_cdr(message, WRENCH, little_endian=little_endian)


def ros1(folder):
    """Bags of ROS 1, as they are and packed."""
    from rosbags.rosbag1 import Writer

    raw = np.arange(3.0).tobytes() + (7).to_bytes(4, "little")
    packings = (None, Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4)
    bags = [
        write_ros1(folder / f"{place}.bag", ROS1_TYPE, raw, packed=packing, count=30)
        for place, packing in enumerate(packings)
    ]
    return Binary(dialect("ros-bag"), [bag.read_bytes() for bag in bags], "log.bag", {})


def ros2(folder, plugin):
    """Bags of ROS 2."""
    raws = [wrench(index) for index in range(30)]
    bag = write_ros2(folder / plugin, raws, plugin=plugin)
    return Binary(dialect("ros-bag"), [bag.read_bytes()], f"log{bag.suffix}", {})


def ros2_folder(folder):
    """The list of files of a recording, its messages packed."""
    bag = write_ros2(folder / "bag", [wrench(index) for index in range(30)], "SQLITE3", mode="FILE")
    content = (bag.parent / "metadata.yaml").read_bytes()
    beside = {
        path.name: path.read_bytes() for path in bag.parent.iterdir() if path.suffix != ".yaml"
    }
    return Binary(dialect("ros-bag"), [content], "metadata.yaml", beside)


def arrays(name, *contents):
    """Files of arrays."""
    return Binary(dialect("arrays"), [*contents], name, {})


def mat(_):
    """MATLAB files as they are, packed, and with a struct and a cell."""
    from scipy.io import savemat

    nested = {"run": {"F1": np.arange(9.0), "note": "x"}, "cells": np.array([[1.0], ["a"]], object)}
    contents = []
    for values, packed in ((columns(30), False), (columns(30), True), (nested, True)):
        file = io.BytesIO()
        savemat(file, values, do_compression=packed)
        contents.append(file.getvalue())
    return arrays("log.mat", *contents)


def hdf5(_):
    """HDF5 files, in one block and in packed blocks."""
    import h5py

    contents = []
    for layout in ({}, {"chunks": (10,), "compression": "gzip", "fletcher32": True}):
        file = io.BytesIO()
        with h5py.File(file, "w") as book:
            for name, values in columns(30).items():
                book.create_dataset(f"run/{name}", data=values, **layout).attrs["unit"] = "N"
        contents.append(file.getvalue())
    return arrays("log.h5", *contents)


def numpy(_):
    """Archives of arrays, packed or not, and one array."""
    contents = []
    for save in (np.savez, np.savez_compressed):
        file = io.BytesIO()
        save(file, **columns(30))
        contents.append(file.getvalue())
    file = io.BytesIO()
    np.save(file, np.stack([*columns(30).values()], axis=1))
    return arrays("log.npz", *contents, file.getvalue())


def of_writer(name):
    """A file as the re-enacted rig writes it in some dialect."""
    logged = [
        LogColumn(word.partition("_")[0], word.partition("_")[2], values, 6)
        for word, values in columns(30).items()
    ]
    writer = WRITERS[name]
    return Binary(dialect(name), [writer.content(logged, ["head"])], f"log{writer.suffix}", {})


_MAKERS: dict[str, Callable[[Path], Binary]] = {
    "ros1": ros1,
    "ros2-mcap": lambda folder: ros2(folder, "MCAP"),
    "ros2-sqlite": lambda folder: ros2(folder, "SQLITE3"),
    "ros2-folder": ros2_folder,
    "mat": mat,
    "hdf5": hdf5,
    "numpy": numpy,
    "tdms": lambda _: of_writer("tdms"),
    "parquet": lambda _: of_writer("parquet"),
    "xlsx": lambda _: of_writer("xlsx"),
}

BINARIES = sorted(_MAKERS)
"""Every kind of file that a library of other people reads."""


def make_binary(name):
    """Small files of a kind."""
    folder = Path(tempfile.mkdtemp(prefix="binary_logs_"))
    try:
        return _MAKERS[name](folder)
    finally:
        shutil.rmtree(folder)
