"""Random and mutated bytes for every reader, with what must hold for each of them."""

import random
import re
import time
import tracemalloc
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from binary_logs import make_binary
from foreign_logs import TEXTS

from rftfit.logs.base import LogError
from rftfit.logs.delimited import guess_text_settings
from rftfit.logs.registry import claimants

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
        except (ValueError, IndexError, StopIteration):
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
