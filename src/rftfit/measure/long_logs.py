"""Read logs with more rows than a fit can use: part by part, and as means of neighbouring readings; memory they need.

A log of hours at a high rate does not fit into memory. `read_long_log` keeps at most `MOST_ROWS` rows of it, each the
mean of 1, 2, 4, ... neighbours. `memory_need` estimates from the sizes of files what a stage needs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rftfit.conventions import FloatArray, IndexArray
from rftfit.logs.base import Log, LogError, Reader, join_blocks
from rftfit.measure.flags import AVERAGED
from rftfit.table.parse import add_counts

MOST_ROWS = 1 << 20
"""Most rows of a log of which each reading is kept; of a longer log at most this number of means, and at least half."""
LEAST_BYTES = 8 * MOST_ROWS
"""Size of the smallest text with `MOST_ROWS` rows: four cells of one digit, and the separators between them."""

Treat = Callable[[Log], Log]


@dataclass(frozen=True)
class LongLog:
    """A log that may have more than `MOST_ROWS` rows by the size of its file, which is not read yet."""

    reader: Reader
    path: Path


class RowTreatment(NamedTuple):
    """Three steps by which the rows of a log are treated, each a function from a log to a log.

    `convert`: Turns columns of the file into quantities, row by row.
    `clean`: Leaves out rows that neighbouring rows show to be wrong.
    `drop_repeats`: Leaves out rows that repeat a reading, before means are taken: a reading counts once in a mean.
    `limits`: Size of each quantity at which it is saturated; empty for positions.
    """

    convert: Treat
    clean: Treat
    drop_repeats: Treat
    limits: Mapping[str, float]


def may_be_long(path: Path) -> bool:
    """Return True if a file is so large that it must be read part by part."""
    return _file_size(path) > LEAST_BYTES


@dataclass(frozen=True)
class MemoryNeed:
    """Memory that a stage needs to read some logs, or their samples.

    `megabytes`: Largest need of memory.
    `long_logs`: Files that may have more than `MOST_ROWS` rows, with their sizes in bytes.
    """

    megabytes: int
    long_logs: Mapping[str, int]


# memory of a stage that reads logs or samples; `make largelogs` measures that it needs no more
_START_MB = 350
"""Of the program alone."""
_PART_MB = 400
"""Of the part of a long log that is being read."""
_ROW_BYTES = 300
"""Of a row that is kept."""
_ROW_BYTES_IN_FILE = 20
"""Fewest bytes of a row in a usual log; where rows are longer, the estimate of memory is too large."""


def memory_need(raw: Path, names: Iterable[str]) -> MemoryNeed:
    """Estimate how much memory some logs need, from their sizes; `names`: files below the folder `raw`."""
    sizes = {name: size for name in names if (size := _file_size(raw / name))}
    long_logs = {name: size for name, size in sizes.items() if size > LEAST_BYTES}
    rows = sum(min(MOST_ROWS, size / _ROW_BYTES_IN_FILE) for size in sizes.values())
    part_MB = _PART_MB if long_logs else 0
    return MemoryNeed(math.ceil(_START_MB + part_MB + rows * _ROW_BYTES / 1e6), long_logs)


def _file_size(path: Path) -> int:
    """Size of a file in bytes; 0 if it cannot be read."""
    try:
        return path.stat().st_size
    except OSError:
        return 0


def read_long_log(log: LongLog, treatment: RowTreatment) -> Log:
    """Read a log, keeping at most `MOST_ROWS` rows: the rows of the file, or means of 2, 4, 8, ... neighbours.

    Blocks of about `MOST_ROWS` rows are cleaned, and then the means once more, to find wrong rows at the edge between
    two blocks. Rows that went into means are counted under `AVERAGED`. A file of fewer than `MOST_ROWS` rows gives the
    same log as when it is read as a whole. The `rows` of a raised `LogError` are the data lines of the whole file.
    """
    # the parts so far, in which each row is the mean of `count` rows of the file
    means: list[Log] = []
    count = 1
    parts = _read_parts(log)
    for part in parts:
        if not means and part.rows < MOST_ROWS:
            # the first part is already the whole file
            return treatment.clean(treatment.convert(part))
        try:
            converted = treatment.convert(part)
            if converted.size:
                converted = treatment.drop_repeats(treatment.clean(converted))
        except LogError as error:
            error.rows = sum(mean.rows for mean in [*means, part]) + sum(
                rest.rows for rest in parts
            )
            raise
        means.append(average(converted, count, treatment.limits))
        # too many means: each two neighbours become their mean
        while sum(mean.size for mean in means) > MOST_ROWS:
            count *= 2
            means = [average(mean, 2, treatment.limits) for mean in means]
    return treatment.clean(_join_means(means))


def _read_parts(log: LongLog) -> Iterator[Log]:
    """Yield the log in parts of `MOST_ROWS` rows, or a little more; the last may be shorter.

    A reader yields blocks of the size that suits its format; several of them make a part.
    """
    blocks: list[Log] = []
    rows = 0

    def join() -> Log:
        """Join the blocks that were read since the last part."""
        part = join_blocks(blocks)
        return part.without_blank_columns() if log.reader.keeps_blanks else part

    for block in log.reader.stream(log.path):
        blocks.append(block)
        rows += block.rows
        if rows >= MOST_ROWS:
            yield join()
            blocks, rows = [], 0
    if blocks:
        yield join()


def average(log: Log, count: int, limits: Mapping[str, float]) -> Log:
    """Replace every `count` rows by their mean; the last mean may be of fewer rows.

    `limits`: Size of each quantity at which it is saturated: a saturated reading replaces the mean of its rows, which
    would hide it.
    """
    if count == 1 or log.size < 2:
        return log
    starts = np.arange(0, log.size, count)
    lengths = np.diff(np.append(starts, log.size))
    columns = {}
    for name, readings in log.columns.items():
        columns[name] = np.add.reduceat(readings, starts) / lengths
        if name in limits:
            columns[name] = _restore_saturated(columns[name], readings, starts, limits[name])
    dropped = add_counts(log.dropped, {AVERAGED: log.size - starts.size})
    return replace(log, columns=columns, dropped=dropped, labels={})


def _restore_saturated(
    means: FloatArray, readings: FloatArray, starts: IndexArray, limit: float
) -> FloatArray:
    """Replace the means of rows that hold a saturated reading by that reading.

    `means`: Of one quantity, shape (k,). `readings`: Shape (n,). `starts`: First row of each mean, shape (k,). `limit`:
    Size of a reading from which it is saturated.
    """
    highest, lowest = (np.maximum.reduceat(readings, starts), np.minimum.reduceat(readings, starts))
    return np.where(highest >= limit, highest, np.where(lowest <= -limit, lowest, means))


def _join_means(parts: list[Log]) -> Log:
    """Join parts of a log, with the times of rows that were left out of each, which `join_blocks` does not keep."""
    stretches: dict[str, tuple[tuple[float, float], ...]] = {}
    for part in parts:
        for reason, when in part.stretches.items():
            stretches[reason] = (*stretches.get(reason, ()), *when)
    return replace(join_blocks(parts), stretches=stretches)
