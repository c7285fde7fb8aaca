"""Logs of more rows than a fit can use: read part by part, and kept as means of neighbouring readings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.logs.base import Log, LogError, Reader, join_blocks
from rftfit.measure.flags import AVERAGED
from rftfit.table.parse import add_counts

MOST_ROWS = 1 << 20
"""Rows of a log up to which each reading is kept; of a longer one so many means are kept, or up to half as many."""
LEAST_BYTES = 8 * MOST_ROWS
"""Size of the smallest text of so many rows: four cells of one digit, and what parts them."""

# Of a stage that reads logs or samples: `make largelogs` measures that it takes no more.
_START_MB = 350
_PART_MB = 400
_ROW_BYTES = 300
_ROW_BYTES_IN_FILE = 20
"""Fewest bytes of a row in a usual log; where rows are longer, the need comes out too large."""

Treat = Callable[[Log], Log]


@dataclass(frozen=True)
class LongLog:
    """A log that may have more than `MOST_ROWS` rows, by its size; nothing of it is read yet."""

    reader: Reader
    path: Path


class RowTreatment(NamedTuple):
    """What is done with the rows of a log.

    `convert`: Turns columns of the file into quantities, row by row. `clean`: Leaves out rows by what is beside them.
    `renew`: Leaves the rows that are new readings, of which means may be taken. `limits`: Size of each quantity from
    which on it is saturated.
    """

    convert: Treat
    clean: Treat
    renew: Treat
    limits: Mapping[str, float]


def may_be_long(path: Path) -> bool:
    """Whether a file is so large that it is read part by part."""
    return _size(path) > LEAST_BYTES


@dataclass(frozen=True)
class MemoryNeed:
    """What the stages that read some logs, or the samples of them, need.

    `megabytes`: Of memory, at most. `long_logs`: Files that may have more than `MOST_ROWS` rows, and their size in bytes.
    """

    megabytes: int
    long_logs: Mapping[str, int]


def memory_need(raw: Path, names: Iterable[str]) -> MemoryNeed:
    """Tell from the sizes of some logs, by their names below the folder `raw`, how much memory they need."""
    sizes = {name: size for name in names if (size := _size(raw / name))}
    long_logs = {name: size for name, size in sizes.items() if size > LEAST_BYTES}
    rows = sum(min(MOST_ROWS, size / _ROW_BYTES_IN_FILE) for size in sizes.values())
    part_MB = _PART_MB if long_logs else 0
    return MemoryNeed(math.ceil(_START_MB + part_MB + rows * _ROW_BYTES / 1e6), long_logs)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def read_long_log(log: LongLog, treatment: RowTreatment) -> Log:
    """Read a log, keeping at most `MOST_ROWS` rows: those of the file, or means of 2, 4, 8, ... neighbours.

    Parameters
    ----------
    log : LongLog
        What is to be read.
    treatment : RowTreatment
        Rows are cleaned in parts of about `MOST_ROWS`, and the means once more, so that what lies at the edge of two
        parts is seen.

    Returns
    -------
    Log
        With the rows that went into means counted under `AVERAGED`. A file of fewer than `MOST_ROWS` rows gives what
        it gives when it is read as a whole.

    Raises
    ------
    LogError
        With the data lines of the whole file, if it cannot be used.
    """
    means: list[Log] = []
    count = 1
    parts = _parts(log)
    for part in parts:
        if not means and part.rows < MOST_ROWS:
            # the part is the file
            return treatment.clean(treatment.convert(part))
        try:
            converted = treatment.convert(part)
            if converted.size:
                converted = treatment.renew(treatment.clean(converted))
        except LogError as error:
            error.rows = sum(mean.rows for mean in [*means, part]) + sum(
                rest.rows for rest in parts
            )
            raise
        means.append(average(converted, count, treatment.limits))
        while sum(mean.size for mean in means) > MOST_ROWS:
            count *= 2
            means = [average(mean, 2, treatment.limits) for mean in means]
    return treatment.clean(_join(means))


def _parts(log: LongLog) -> Iterator[Log]:
    """Yield the log in parts of `MOST_ROWS` rows, or a little more; the last may be shorter."""
    blocks: list[Log] = []
    rows = 0

    def part() -> Log:
        whole = join_blocks(blocks)
        return whole.without_blank_columns() if log.reader.keeps_blanks else whole

    for block in log.reader.stream(log.path):
        blocks.append(block)
        rows += block.rows
        if rows >= MOST_ROWS:
            yield part()
            blocks, rows = [], 0
    if blocks:
        yield part()


def average(log: Log, count: int, limits: Mapping[str, float]) -> Log:
    """Put the mean in place of each `count` rows, the last of which may be fewer.

    `limits`: Size of each quantity from which on it is saturated: of such readings the largest stands for all.
    """
    if count == 1 or log.size < 2:
        return log
    starts = np.arange(0, log.size, count)
    lengths = np.diff(np.append(starts, log.size))
    columns = {}
    for name, readings in log.columns.items():
        columns[name] = np.add.reduceat(readings, starts) / lengths
        if name in limits:
            columns[name] = _with_saturated(columns[name], readings, starts, limits[name])
    dropped = add_counts(log.dropped, {AVERAGED: log.size - starts.size})
    return replace(log, columns=columns, dropped=dropped, labels={})


def _with_saturated(
    means: FloatArray, readings: FloatArray, starts: np.ndarray, limit: float
) -> FloatArray:
    highest, lowest = (np.maximum.reduceat(readings, starts), np.minimum.reduceat(readings, starts))
    return np.where(highest >= limit, highest, np.where(lowest <= -limit, lowest, means))


def _join(parts: list[Log]) -> Log:
    stretches: dict[str, tuple[tuple[float, float], ...]] = {}
    for part in parts:
        for reason, when in part.stretches.items():
            stretches[reason] = (*stretches.get(reason, ()), *when)
    return replace(join_blocks(parts), stretches=stretches)
