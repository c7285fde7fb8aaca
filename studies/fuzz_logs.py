"""Feed random and mutated bytes to every reader: ``make fuzz``.

No crash, no hang, memory bounded; of text no row that stands in no line of the input. Files that libraries of other
people read take part, and two bags made to take time or memory without end. The first failure stops the run and
keeps its input.
"""

from __future__ import annotations

import argparse
import bz2
import io
import random
import shutil
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from log_files import ROS1_TYPE, TEXTS, check_rows, wrench, write_ros1, write_ros2

from rftfit.lab.dialects import WRITERS
from rftfit.lab.write import LogColumn
from rftfit.logs.base import LogError, Reader
from rftfit.logs.delimited import guess_text_settings
from rftfit.logs.registry import claimants, dialect


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


MEMORY = 64_000_000
"""Bytes that reading a file of some kilobytes may take."""


SLOWEST_S = 10.0


_WORDS = (
    b"\n",
    b"\r",
    b"\r\n",
    b"\x00",
    b'"',
    b",",
    b";",
    b"\t",
    b" ",
    b"#",
    b"%",
    b"-",
    b"+",
    b"e",
    b"E9999",
    b"nan",
    b"inf",
    b"0x10",
    b"1_0",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"1,000,000",
    b".",
    b"(s);(mm)\n",
    b"***End_of_Header***\n",
    b"Channels\t2\n",
    b"Status (hex), RDT Sequence\n",
    b"%time,field.\n",
    b"Delta_X\t0\n",
    b"RDT Sample Rate: 0\n",
    b"9" * 400,
    b"\xc3",
    b"\xe2\x88\x92",
)


MEMORY_OF_LIBRARIES = 200_000_000
"""Bytes above those before that a process may take while a library reads a file of some kilobytes."""


SLOWEST_OF_LIBRARIES_S = 5.0


_WORDS_OF_BINARIES = (
    b"\x00",
    b"\x00" * 8,
    b"\xff",
    b"\xff" * 4,
    b"\xff" * 8,
    b"\x7f\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x40",
    b"\x00\x00\x00\x80",
    (10**9).to_bytes(4, "little"),
    (10**12).to_bytes(8, "little"),
    b"[1000000000]",
    b"[]",
    b"&a [*a, *a]",
    b"../../x",
    b"\n",
    b"9" * 30,
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
    return _of_status("VmRSS")


def _peak():
    return _of_status("VmHWM")


def _of_status(word):
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(f"{word}:"))


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
        claimants(content[:65536])
        guess_text_settings(content[:65536])
    score.slowest_s = max(score.slowest_s, took)
    assert took < SLOWEST_S, f"{took:.1f} s for {len(content)} bytes"
    assert score.memory < MEMORY, f"{score.memory} bytes for {len(content)} bytes"


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


HOSTILE = {
    "bag of 1e9 empty messages": lambda folder: write_ros1(
        folder / "empty.bag", MANY_WITHOUT_BYTES, bytes(8)
    ),
    "bag of bz2 zeros, 600 MB": lambda folder: write_packed_zeros(folder / "zeros.bag", 600),
}


def judge_hostile(name, folder):
    """Read a file that is made to take time or memory without end; it has to be refused."""
    score, reader = Score(), dialect("ros-bag")
    path = write_ros1(folder / "sound.bag", "float64 y", bytes(8))
    reader.load(path)  # libraries loaded: not counted
    path = HOSTILE[name](folder)
    judge_binary(reader, path, score)
    if not score.refused:
        raise AssertionError(f"{path}: it was read")
    return score


def judge(name, seconds, seed, folder):
    """Score of one reader, or of one hostile file."""
    if name in HOSTILE:
        return judge_hostile(name, folder)
    if name in BINARIES:
        return fuzz_binary(name, seconds, seed, folder)
    return fuzz(name, seconds, seed, folder / "input")


def main():
    """Run it, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    every = [*HOSTILE, *BINARIES, *sorted(TEXTS)]
    parser.add_argument("--seconds", type=float, default=600, help="for each reader")
    parser.add_argument("--seed", type=int, default=2013)
    parser.add_argument("--only", choices=every, nargs="+", help="these readers")
    chosen = parser.parse_args()
    print(f"{chosen.seconds:g} s each, seed {chosen.seed}")
    print("| reader | inputs | read | refused | rows | slowest, ms | memory, MB |")
    print("|---|---|---|---|---|---|---|")
    for name in chosen.only or every:
        folder = Path(tempfile.mkdtemp(prefix="fuzz_"))
        try:
            score = judge(name, chosen.seconds, chosen.seed, folder)
        except BaseException:
            print(f"{name}: the input that did it is kept in {folder}", file=sys.stderr)
            raise
        shutil.rmtree(folder)
        print(
            f"| {name} | {score.inputs} | {score.read} | {score.refused} | {score.rows} "
            f"| {1e3 * score.slowest_s:.0f} | {score.memory / 1e6:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
