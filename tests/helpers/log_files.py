"""Small logs in the dialects of other programs, random and damaged bytes, and how a reader refuses them."""

from __future__ import annotations

import bz2
import contextlib
import csv
import datetime as dt
import io
import random
import re
import shutil
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import dateutil.parser
import numpy as np
import pandas as pd
import pytest
from makers import data_of

import rftfit
from rftfit.logs.base import LogError
from rftfit.logs.inspect import recognised
from rftfit.logs.registry import dialect

# --- Problems in short, to be compared as a whole: one line for each ----------------------------------------------


def told(problems):
    """Code, row, column or key, what was found, and behind ~ what was meant."""
    return [" ".join(_parts(problem)) for problem in problems]


def _parts(problem):
    place = problem.place
    yield problem.code
    yield from (str(part) for part in (place.row, place.column, place.key) if part is not None)
    if problem.found is not None:
        yield repr(problem.found)
    if problem.nearest:
        yield f"~{problem.nearest}"


# --- A log that is refused: its code, its file, and the values that its error names -------------------------------


def refused(reader, path, code, *values):
    """Return the error of a log that is refused: it has this code and names the file and these values."""
    with pytest.raises(LogError) as caught:
        reader.load(path)
    assert caught.value.code == code
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    for value in values:
        assert value in text.removeprefix(f"{path}: ")
    return caught.value


def text_reader(**text):
    """Return the reader of a text that these keys of `text` in a config describe."""
    return recognised(Path("a text"), text=text).reader


# --- Small logs in the dialects of other programs, written from numbers: for tests, fuzzing, benchmarks -----------


@dataclass(frozen=True)
class Foreign:
    """A log as bytes, and what it holds.

    Attributes
    ----------
    name : str
    reader : Reader
    header : bytes
    lines : list of bytes
        Data lines with their ends.
    raw : list of str
        Names of the columns that come straight out of the cells, in the order of `cells`.
    cells : callable
        The values of those columns in one line, read in the simplest way; raises on a bad line.
    """

    name: str
    reader: Any
    header: bytes
    lines: list[bytes]
    raw: list[str]
    cells: Callable[[str], list[float]]

    @property
    def content(self):
        """The whole file."""
        return self.header + b"".join(self.lines)


def _split(separator, places, width, decimal="."):
    def cells(line):
        parts = [cell.strip(' \t"') for cell in line.split(separator)]
        if not width - 1 <= len(parts) <= width:
            raise ValueError(line)
        return [float(parts[place].replace(decimal, ".")) for place in places]

    return cells


def _quoted(line):
    parts = next(csv.reader([line]))
    if len(parts) != 10:
        raise ValueError(line)
    return [float(cell) for cell in parts[1:9]]


def _blanks(line):
    parts = line.split()
    if len(parts) != 3:
        raise ValueError(line)
    # between blanks a comma is a decimal mark
    return [float(cell.replace(",", ".")) for cell in parts]


def _numbers(rows, columns, seed=1):
    return np.random.default_rng(seed).normal(scale=5, size=(rows, columns)).round(6)


def netft(rows, *, lost=0):
    """ATI Net F/T; `lost` packets are missing after every tenth row."""
    head = (
        "Start Time: 1/2/26 3:04 PM\r\nRDT Sample Rate: 125\r\n"
        '"PLEASE NOTE: read when the program starts."\r\nForce Units: N\r\n'
        "Counts per Unit Force: 1000000.0\r\nTorque Units: Nm\r\n"
        "Counts per Unit Torque: 1000000.0\r\n"
        "Status (hex), RDT Sequence, F/T Sequence, Fx, Fy, Fz, Tx, Ty, Tz, Time\r\n"
    )
    lines = []
    for row, values in enumerate(_numbers(rows, 6)):
        number = 26049 + row + lost * (row // 10)
        cells = ["0x0", str(number), str(8 * number), *map(repr, values.tolist())]
        lines.append(",".join(f'"{cell}"' for cell in [*cells, "Jan 2, 2026 3:04:05 PM"]) + "\r\n")
    names = ["RDT Sequence", "F/T Sequence", "Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
    return _foreign("ati-netft", head, lines, names, _quoted)


def daq(rows):
    """ATI through NI DAQ at 150 Hz."""
    head = (
        "First line indicates sampling freq [Hz], samples per channel, QTimer [ms] ,,,\n"
        "Fx, Fy, Fz, Mz, My, Mz \n150,75,500,23.72,835,0\n"
    )
    lines = [",".join(map(repr, values.tolist())) + "\n" for values in _numbers(rows, 6)]
    names = ["Fx", "Fy", "Fz", "Mz", "My", "Mz_2"]
    return _foreign("ati-daq", head, lines, names, _split(",", range(6), 6))


def rostopic(rows):
    """One wrench topic at 125 Hz."""
    forces = [f"field.wrench.{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id," + ",".join(forces)
    lines = []
    for row, values in enumerate(_numbers(rows, 6)):
        stamp = 1_700_000_000_123_456_789 + 8_000_000 * row
        cells = [str(stamp + 400_000), str(500 + row), str(stamp), "", *map(repr, values.tolist())]
        lines.append(",".join(cells) + "\n")
    names = ["header.seq", *(name.removeprefix("field.") for name in forces)]
    return _foreign("rostopic", head + "\n", lines, names, _split(",", [1, *range(4, 10)], 10))


def lvm(rows, *, segments=1, comment=True):
    """LabVIEW with decimal commas and no X column."""
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
        "Decimal_Separator\t,\nMulti_Headings\tYes\nX_Columns\tNo\nTime_Pref\tAbsolute\n"
        "Date\t2026/01/02\nTime\t03:04:05,25\n***End_of_Header***\t\n\t\n"
    )
    lines: list[str] = []
    for segment in range(segments):
        segment_head = (
            f"Channels\t2\t\t\nSamples\t{rows}\t{rows}\t\nDate\t2026/01/02\t2026/01/02\t\n"
            f"Time\t03:04:{5 + 10 * segment:02d},25\t03:04:{5 + 10 * segment:02d},25\t\n"
            "Y_Unit_Label\tNewtons\tmm\t\nX_Dimension\tTime\tTime\t\n"
            "X0\t0,0000E+0\t0,0000E+0\t\nDelta_X\t1,000000E-2\t1,000000E-2\t\n"
            "***End_of_Header***\t\t\t\nX_Value\tForce z\tz\tComment\n"
        )
        body = []
        for row, values in enumerate(_numbers(rows, 2, seed=segment)):
            end = "\tstart" if comment and row == 0 else ""
            body.append(f"\t{values[0]:.6f}\t{values[1]:.6f}{end}\n".replace(".", ","))
        if segment == 0:
            head += segment_head
        else:
            body[0] = segment_head + body[0]
        lines += body

    def cells(line):
        parts = line.split("\t")
        if not 3 <= len(parts) <= 4:
            raise ValueError(line)
        return [float(cell.strip().replace(",", ".")) for cell in parts[1:3]]

    return _foreign("lvm", head, lines, ["Force z", "z"], cells)


def instron(rows):
    """Semicolons, decimal commas, units in brackets."""
    head = "Time;Displacement;Force\r\n(s);(mm);(kN)\r\n"
    lines = [
        f"{0.02 * row:.2f};{values[0]:.4f};{values[1]:.4f}\r\n".replace(".", ",")
        for row, values in enumerate(_numbers(rows, 2))
    ]
    names = ["Time", "Displacement", "Force"]
    return _foreign("instron", head, lines, names, _split(";", range(3), 3, ","))


def delimited(rows):
    """Blanks between cells, a comment and a row of names."""
    head = "# made by hand\ntime_s  x_mm z_mm\n"
    lines = [
        f" {0.02 * row:.2f}\t{values[0]:.4f}   {values[1]:.4f}\n"
        for row, values in enumerate(_numbers(rows, 2))
    ]
    foreign = _foreign("delimited", head, lines, ["time", "x", "z"], _blanks)
    reader = text_reader(delimiter="blank", comment="#")
    return Foreign(foreign.name, reader, foreign.header, foreign.lines, foreign.raw, foreign.cells)


def dated(rows):
    """Commas between cells, the time as a date of ISO 8601."""
    head = "Time,Fz [N]\n"
    start = dt.datetime(2026, 1, 2, 23, 59, 59, tzinfo=dt.UTC)
    times = [start + dt.timedelta(milliseconds=10 * row) for row in range(rows)]
    lines = [
        f"{time:%Y-%m-%dT%H:%M:%S.%f}Z,{values[0]:.4f}\n"
        for time, values in zip(times, _numbers(rows, 1), strict=True)
    ]

    def cells(line):
        stamp, force, *rest = (cell.strip(' \t"') for cell in next(csv.reader([line])))
        # a comma behind the last cell adds none
        if any(rest):
            raise ValueError(line)
        # what is left of a file may have numbers for times
        with contextlib.suppress(ValueError):
            return [float(stamp), float(force)]
        # years of two digits, months of one, any marks between them, and more blanks are as clear
        whole, fraction, zone = re.findall(
            r"^(.*?:.*?:\s*\d+)(?:[.,](\d*))?(Z?|[+-][\d:]+)$", stamp
        )[0]
        time = dateutil.parser.parse(whole + zone, yearfirst=True)
        time = time if time.tzinfo else time.replace(tzinfo=dt.UTC)
        return [int(time.timestamp()) + float(f"0.{fraction}"), float(force)]

    foreign = _foreign("delimited", head, lines, ["Time", "Fz"], cells)
    reader = text_reader()
    return Foreign("dated", reader, foreign.header, foreign.lines, foreign.raw, foreign.cells)


def rig(rows):
    """The rig's own force log."""
    head = "# a comment\ntime_s,arm_moving,F1_N,F2_N,F3_N\n"
    lines = [
        ",".join([f"{0.01 * row:.2f}", str(row % 2), *map(repr, values.tolist())]) + "\n"
        for row, values in enumerate(_numbers(rows, 3))
    ]
    names = ["time", "arm_moving", "F1", "F2", "F3"]
    return _foreign("rig", head, lines, names, _split(",", range(5), 5))


def _foreign(name, head, lines, raw, cells):
    return Foreign(name, dialect(name), head.encode(), [x.encode() for x in lines], raw, cells)


TEXTS: dict[str, Callable[[int], Foreign]] = {
    "rig": rig,
    "ati-netft": netft,
    "ati-daq": daq,
    "rostopic": rostopic,
    "lvm": lvm,
    "instron": instron,
    "delimited": delimited,
    "dated": dated,
}
"""Every dialect of text, and text with dates."""


# --- Small logs that libraries of other people read, written from numbers: for tests and fuzzing ------------------

WRENCH = "geometry_msgs/msg/WrenchStamped"
ROS1_TYPE = "float64[3] force\nuint32 count\n"


@dataclass(frozen=True)
class Binary:
    """A kind of file: its reader, contents of small ones, and the name under which each is read.

    `beside`: Files that lie in the same folder, by name.
    """

    reader: Any
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


@cache
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


def table_of_columns():
    """Return a small log as a table whose names hold the units."""
    return pd.DataFrame(columns(30)).rename(columns=lambda name: name.replace("_", " [") + "]")


def tdms(_):
    """A file of LabVIEW with the units as properties of its channels."""
    from nptdms import ChannelObject, TdmsWriter

    file = io.BytesIO()
    with TdmsWriter(file) as writer:
        writer.write_segment(
            [
                ChannelObject("log", name.partition("_")[0], values, {"unit_string": name[-1]})
                for name, values in columns(30).items()
            ]
        )
    return Binary(dialect("tdms"), [file.getvalue()], "log.tdms", {})


def parquet(_):
    """A table of Parquet."""
    return Binary(dialect("parquet"), [table_of_columns().to_parquet()], "log.parquet", {})


def xlsx(_):
    """A workbook."""
    file = io.BytesIO()
    table_of_columns().to_excel(file, index=False)
    return Binary(dialect("xlsx"), [file.getvalue()], "log.xlsx", {})


_MAKERS: dict[str, Callable[[Path], Binary]] = {
    "ros1": ros1,
    "ros2-mcap": lambda folder: ros2(folder, "MCAP"),
    "ros2-sqlite": lambda folder: ros2(folder, "SQLITE3"),
    "ros2-folder": ros2_folder,
    "mat": mat,
    "hdf5": hdf5,
    "numpy": numpy,
    "tdms": tdms,
    "parquet": parquet,
    "xlsx": xlsx,
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


# --- Random and mutated bytes for every reader, with what must hold for each of them ------------------------------

MEMORY = 64_000_000
"""Bytes that reading a file of some kilobytes may take."""
SLOWEST_S = 10.0
MEMORY_OF_LIBRARIES = 200_000_000
"""Bytes above those before that a process may take while a library reads a file of some kilobytes."""
SLOWEST_OF_LIBRARIES_S = 5.0
_WORDS, _WORDS_OF_BINARIES = (
    tuple(word.encode("latin-1") for word in words) for words in data_of("fuzz_words").values()
)


@dataclass
class Score:
    """What was tried.

    Attributes
    ----------
    inputs, read, refused, rows : int
    slowest_s : float
    memory : int
        Largest peak of one input, bytes.
    """

    inputs: int = 0
    read: int = 0
    refused: int = 0
    rows: int = 0
    slowest_s: float = 0.0
    memory: int = 0


def fuzz(name, seconds, seed, place, most=10**9):
    """Feed one reader for some seconds, or with at most so many inputs.

    Parameters
    ----------
    name : str
        Of the dialect.
    seconds : float
    seed : int
    place : Path
        Where the inputs are written; the last one is kept when something fails.
    most : int

    Returns
    -------
    Score

    Raises
    ------
    AssertionError
        If anything but a `Log` or a `LogError` comes back, a row comes back that stands in no line,
        or time or memory run away.
    """
    luck = random.Random(seed)
    makers = [TEXTS[name](rows) for rows in (0, 1, 3, 12, 150)]
    score = Score()
    makers[2].reader.load(_written(place, makers[2].content))  # libraries loaded: not counted
    for _ in _turns(seconds, most):
        foreign = luck.choice(makers)
        content = _input(luck, foreign)
        _feed(foreign, _written(place, content), content, score)
    return score


def fuzz_binary(name, seconds, seed, folder, most=10**9):
    """As `fuzz`, of a kind of `binary_logs.BINARIES` that a library of other people reads, damaged.

    `folder`: Where the inputs are written. Memory is that of the process, since libraries take theirs past
    Python.
    """
    luck = random.Random(seed)
    binary, score = make_binary(name), Score()
    for beside, content in binary.beside.items():
        (folder / beside).write_bytes(content)
    place = folder / binary.name
    for content in binary.contents:  # libraries loaded: not counted
        binary.reader.load(_written(place, content))
    for _ in _turns(seconds, most):
        content = _binary_input(luck, binary.contents)
        judge_binary(binary.reader, _written(place, content), score)
    return score


def _turns(seconds, most):
    """Count up to `most` for so many seconds."""
    end = time.perf_counter() + seconds
    for turn in range(most):
        if time.perf_counter() >= end:
            return
        yield turn


def judge_binary(reader, place, score):
    """Read one file, and count what came of it.

    Raises
    ------
    AssertionError
        If anything but a `Log` or a `LogError` comes back, or time or memory run away.
    """
    before, start = _restart_peak(), time.process_time()
    score.inputs += 1
    try:
        log = reader.load(place)
    except LogError as error:
        score.refused += 1
        message = str(error)
    else:
        message = ""
        score.read += 1
        score.rows += log.size
    took = time.process_time() - start
    grown = _peak() - before
    score.slowest_s, score.memory = max(score.slowest_s, took), max(score.memory, grown)
    size = place.stat().st_size
    assert message.isprintable(), repr(message)
    assert took < SLOWEST_OF_LIBRARIES_S, f"{took:.1f} s for {size} bytes"
    assert grown < MEMORY_OF_LIBRARIES, f"{grown / 1e6:.0f} MB for {size} bytes"


def _restart_peak():
    """Let the kernel measure the peak of this process anew; what it takes now, bytes."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return _peak("VmRSS")


def _peak(word="VmHWM"):
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return 1024 * int(re.findall(rf"(?m)^{word}:\s+(\d+)", status)[0])


def _binary_input(luck, contents):
    content = bytearray(luck.choice(contents))
    sort = luck.randrange(10)
    if sort == 0:
        return bytes(content[:16]) + luck.randbytes(luck.choice([0, 1, 10, 300, 5000]))
    if sort == 1:
        second_content = luck.choice(contents)
        return bytes(
            content[: luck.randrange(len(content))]
            + second_content[luck.randrange(len(second_content)) :]
        )
    for _ in range(luck.choice([1, 1, 2, 5, 30])):
        _mutate(luck, content, _WORDS_OF_BINARIES)
    return bytes(content)


def _written(place, content):
    place.write_bytes(content)
    return place


def _feed(foreign, place, content, score):
    measured = score.inputs % 20 == 0
    if measured:
        tracemalloc.start()
    start = time.process_time()
    score.inputs += 1
    try:
        log = foreign.reader.load(place)
    except LogError:
        score.refused += 1
    else:
        score.read += 1
        score.rows += log.size
        check_rows(foreign, log, content)
    took = time.process_time() - start
    if measured:
        score.memory = max(score.memory, tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        # what inspect does with any file must not fail either
        with contextlib.suppress(rftfit.RftfitError):
            recognised(place)
    score.slowest_s = max(score.slowest_s, took)
    assert took < SLOWEST_S, f"{took:.1f} s for {len(content)} bytes"
    assert score.memory < MEMORY, f"{score.memory} bytes for {len(content)} bytes"


_MINUS = re.compile(b"(?:\xe2\x88\x92|\xe2\x80\x93|\xef\xb9\xa3|\xef\xbc\x8d)(?=[0-9.,])")
"""Signs of typesetting that stand for a minus before a number."""
_THOUSANDS = re.compile(rb'(?<![^\s"])[+-]?\d{1,3}(?:,\d{3})+\.\d*(?:[eE][+-]?\d+)?(?![^\s"])')
"""A number alone in quotes or between blanks, with separators of thousands and a decimal mark."""


def _with_plain_numbers(line):
    """Rewrite numbers with the minus behind, in brackets as accountants write it, with an exponent of Fortran."""
    has_commas = b";" in line or b"\t" in line
    parts = b'";' if has_commas else b'",'
    number = rb"\d[\d.,]*" if has_commas else rb"\d[\d.]*"
    begins, ends = rb"(?<![^\s%b])" % parts, rb"(?![^\s%b])" % parts
    line = re.sub(begins + rb"(%b)-" % number + ends, rb"-\1", line)
    line = re.sub(begins + rb"\((%b)\)" % number + ends, rb"-\1", line)
    exponent = rb"([+-]?%b)[dD]([+-]?\d{1,3})" % number
    return re.sub(begins + exponent + ends, rb"\1E\2", line)


def check_rows(foreign, log, content):
    """Compare with the plainest reading of each line.

    Parameters
    ----------
    foreign : Foreign
    log : Log
    content : bytes
        Of the file.

    Raises
    ------
    AssertionError
        If a row of the log stands in no line of the file.
    """
    lines = content.splitlines()
    assert log.rows <= len(lines)
    assert not any(np.isinf(values).any() for values in log.columns.values())
    if not content.startswith(foreign.header):
        return  # a damaged header may well say that other cells are meant
    if any(column not in log.columns for column in foreign.raw):
        return  # a column that holds hardly a number any more is left out, and damage to it allowed
    seen = set()
    for line in lines:
        plain = _MINUS.sub(b"-", line)
        plain = _THOUSANDS.sub(lambda number: number[0].replace(b",", b""), plain)
        plain = _with_plain_numbers(plain)
        try:
            seen.add(tuple(foreign.cells(plain.decode("latin-1"))))
        except (ValueError, IndexError, OverflowError, StopIteration):
            continue
    rows = np.stack([log.columns[column] for column in foreign.raw], axis=1)
    for row in rows[~np.isnan(rows).any(axis=1)].tolist():  # NaN stands for a cell without a number
        assert tuple(row) in seen, row


def _input(luck, foreign):
    sort = luck.randrange(10)
    if sort == 0:
        return luck.randbytes(luck.choice([0, 1, 10, 300, 5000]))
    if sort == 1:
        return foreign.header + luck.randbytes(luck.choice([1, 50, 2000]))
    content = bytearray(foreign.content)
    for _ in range(luck.choice([1, 1, 2, 5, 30])):
        _mutate(luck, content)
    return bytes(content)


def _mutate(luck, content, words=_WORDS):
    start = luck.randrange(len(content) + 1)
    end = min(len(content), start + luck.choice([1, 1, 4, 30, 400]))
    sort = luck.randrange(6)
    if sort == 0:
        del content[start:end]
    elif sort == 1:
        content[start:start] = luck.choice(words)
    elif sort == 2:
        content[start : start + 1] = luck.randbytes(1)
    elif sort == 3:
        content[start:start] = content[start:end]
    elif sort == 4:
        content[start:end] = luck.choice(words)
    elif sort == 5 and words is not _WORDS:
        # what stands at a place of fixed length stays where it is
        word = luck.choice(words)[: len(content) - start]
        content[start : start + len(word)] = word
    else:
        del content[start:]
