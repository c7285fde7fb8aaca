"""Random and mutated bytes for the readers of text, with what must hold for each of them."""

import random
import time
import tracemalloc
from dataclasses import dataclass

import numpy as np
from foreign_logs import TEXTS

from rftfit.logs.base import LogError
from rftfit.logs.delimited import preview
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
    end = time.perf_counter() + seconds
    while time.perf_counter() < end and score.inputs < most:
        made = luck.choice(makers)
        content = _input(luck, made)
        _one(made, _written(place, content), content, score)
    return score


def _written(place, content):
    place.write_bytes(content)
    return place


def _one(made, place, content, score):
    measured = score.inputs % 20 == 0
    if measured:
        tracemalloc.start()
    start = time.process_time()
    score.inputs += 1
    try:
        log = made.reader.load(place)
    except LogError:
        score.refused += 1
    else:
        score.read += 1
        score.rows += log.size
        check_rows(made, log, content)
    took = time.process_time() - start
    if measured:
        score.memory = max(score.memory, tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        # what inspect does with any file must not fail either
        claimants(content[:65536])
        preview(content[:65536])
    score.slowest_s = max(score.slowest_s, took)
    assert took < SLOWEST_S, f"{took:.1f} s for {len(content)} bytes"
    assert score.memory < MEMORY, f"{score.memory} bytes for {len(content)} bytes"


def check_rows(made, log, content):
    """Compare with the plainest reading of each line.

    Parameters
    ----------
    made : Foreign
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
    if not content.startswith(made.header):
        return  # a damaged header may well say that other cells are meant
    if any(column not in log.columns for column in made.raw):
        return  # a column that holds hardly a number any more is left out, and damage to it allowed
    seen = set()
    for line in lines:
        try:
            seen.add(tuple(made.cells(line.decode("latin-1"))))
        except (ValueError, IndexError, StopIteration):
            continue
    rows = np.stack([log.columns[column] for column in made.raw], axis=1)
    for row in rows[~np.isnan(rows).any(axis=1)].tolist():  # NaN stands for a cell without a number
        assert tuple(row) in seen, row


def _input(luck, made):
    sort = luck.randrange(10)
    if sort == 0:
        return luck.randbytes(luck.choice([0, 1, 10, 300, 5000]))
    if sort == 1:
        return made.header + luck.randbytes(luck.choice([1, 50, 2000]))
    content = bytearray(made.content)
    for _ in range(luck.choice([1, 1, 2, 5, 30])):
        _mutate(luck, content)
    return bytes(content)


def _mutate(luck, content):
    at = luck.randrange(len(content) + 1)
    to = min(len(content), at + luck.choice([1, 1, 4, 30, 400]))
    sort = luck.randrange(6)
    if sort == 0:
        del content[at:to]
    elif sort == 1:
        content[at:at] = luck.choice(_WORDS)
    elif sort == 2:
        content[at : at + 1] = luck.randbytes(1)
    elif sort == 3:
        content[at:at] = content[at:to]
    elif sort == 4:
        content[at:to] = luck.choice(_WORDS)
    else:
        del content[at:]
