"""What can be said of a log on its own: columns, clock, resolution, damage, what it lacks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.logs.base import Log, added
from rftfit.logs.quantities import MEANING, guess, guesses

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.conventions import FloatArray

GAP_STEPS = 5.0
"""A step longer than this many median steps is shown as a gap."""

_MOST_GAPS = 10_000


@dataclass(frozen=True)
class Column:
    """One column of a log.

    Attributes
    ----------
    name, quantity, unit : str
    lowest, highest : float
        NaN if there is no usable row.
    resolution : float
        Smallest step between two distinct values; NaN if there are not two.
    """

    name: str
    quantity: str
    unit: str
    lowest: float
    highest: float
    resolution: float


@dataclass(frozen=True)
class Clock:
    """The time column of a log, in its own unit.

    Attributes
    ----------
    duration : float
        From the first to the last usable row.
    step, jitter : float
        Median step between rows that go forward, and the median departure from it; NaN if there
        are fewer than two rows. Of a file that is read in blocks: those of the first block.
    gaps : tuple of (float, float)
        Start and length of every step longer than `GAP_STEPS` median steps.
    repeated, backwards : int
        Rows whose time is that of the row before, or earlier.
    """

    duration: float
    step: float
    jitter: float
    gaps: tuple[tuple[float, float], ...]
    repeated: int
    backwards: int

    @property
    def rate(self) -> float:
        """Rows per unit of time."""
        return 1 / self.step if self.step > 0 else float("nan")


@dataclass
class ClockMeter:
    """The clock of a log that comes in blocks.

    Attributes
    ----------
    step, jitter : float
    gaps : list of (float, float)
        The first ten thousand.
    repeated, backwards : int
    """

    step: float = float("nan")
    jitter: float = float("nan")
    gaps: list[tuple[float, float]] = field(default_factory=list)
    repeated: int = 0
    backwards: int = 0
    _low: float = float("inf")
    _high: float = float("-inf")
    _last: float | None = None

    def add(self, time: FloatArray) -> None:
        """Go on with the next rows.

        Parameters
        ----------
        time : numpy.ndarray, shape (n,)
        """
        if time.size == 0:
            return
        steps = np.diff(time) if self._last is None else np.diff(time, prepend=self._last)
        starts = time[:-1] if self._last is None else np.concatenate([[self._last], time[:-1]])
        forward = steps[steps > 0]
        if forward.size and not self.step > 0:
            self.step = float(np.median(forward))
            self.jitter = float(np.median(np.abs(forward - self.step)))
        if self.step > 0:
            late = np.flatnonzero(steps > GAP_STEPS * self.step)[: _MOST_GAPS - len(self.gaps)]
            self.gaps += [(float(starts[i]), float(steps[i])) for i in late]
        self.repeated += int(np.count_nonzero(steps == 0))
        self.backwards += int(np.count_nonzero(steps < 0))
        self._low, self._high = min(self._low, time.min()), max(self._high, time.max())
        self._last = float(time[-1])

    def clock(self) -> Clock:
        """Return what was seen so far.

        Returns
        -------
        Clock
        """
        duration = float(self._high - self._low) if self._last is not None else 0.0
        return Clock(
            duration, self.step, self.jitter, tuple(self.gaps), self.repeated, self.backwards
        )


@dataclass(frozen=True)
class Survey:
    """Everything that one pass over a log tells.

    Attributes
    ----------
    first : Log
        The first block.
    columns : list of Column
    clock : Clock or None
        None where no column is the time.
    time_unit : str
    quantities : dict of str to str
        Guessed: quantity to column.
    rows, used : int
        Data lines, and those that can be read.
    dropped, missing : dict of str to int
    notes : tuple of str
    moving : int
        Number of values, at most two, that the sync line takes; 0 where there is none.
    """

    first: Log
    columns: list[Column]
    clock: Clock | None
    time_unit: str
    quantities: dict[str, str]
    rows: int
    used: int
    dropped: dict[str, int]
    missing: dict[str, int]
    notes: tuple[str, ...]
    moving: int


def survey(blocks: Iterable[Log]) -> Survey:
    """Look at a log, block by block, so that memory stays bounded.

    Parameters
    ----------
    blocks : iterable of Log
        At least one.

    Returns
    -------
    Survey
    """
    meter = ClockMeter()
    first: Log | None = None
    columns: list[Column] = []
    rows = used = 0
    dropped: dict[str, int] = {}
    missing: dict[str, int] = {}
    lines: set[float] = set()
    for log in blocks:
        found = columns_of(log)
        if first is None:
            quantities = guesses(log)
            first, columns = log, _named(found, quantities)
        else:
            columns = [_both(*pair) for pair in zip(columns, found, strict=True)]
        if "time" in quantities:
            meter.add(log.columns[quantities["time"]])
        if "arm_moving" in quantities and len(lines) < 2:
            lines.update(np.unique(log.columns[quantities["arm_moving"]])[:2].tolist())
        rows, used = rows + log.rows, used + log.size
        dropped, missing = added(dropped, log.dropped), added(missing, log.missing)
    assert first is not None
    unit = first.units.get(quantities.get("time", ""), "")
    clock = meter.clock() if "time" in quantities else None
    return Survey(
        first, columns, clock, unit, quantities, rows, used, dropped, missing, first.notes, len(lines)
    )  # fmt: skip


def columns_of(log: Log) -> list[Column]:
    """Describe every column.

    Parameters
    ----------
    log : Log

    Returns
    -------
    list of Column
        In the order of the file.
    """
    return [_column(name, values, log.units.get(name, "")) for name, values in log.columns.items()]


def _column(name: str, values: FloatArray, unit: str) -> Column:
    quantity = MEANING.get(guess(name, unit), "-")
    if values.size == 0:
        return Column(name, quantity, unit, np.nan, np.nan, np.nan)
    steps = np.diff(np.unique(values))
    resolution = float(steps.min()) if steps.size else np.nan
    return Column(name, quantity, unit, float(values.min()), float(values.max()), resolution)


def _named(columns: list[Column], quantities: dict[str, str]) -> list[Column]:
    """Say of each column what it was guessed to be in the end."""
    meant = {column: MEANING[quantity] for quantity, column in quantities.items()}
    return [replace(column, quantity=meant.get(column.name, "-")) for column in columns]


def _both(one: Column, other: Column) -> Column:
    return Column(
        one.name,
        one.quantity,
        one.unit,
        float(np.fmin(one.lowest, other.lowest)),
        float(np.fmax(one.highest, other.highest)),
        float(np.fmin(one.resolution, other.resolution)),
    )


def clock_of(log: Log) -> Clock:
    """Describe the clock.

    Parameters
    ----------
    log : Log
        With a column ``time``.

    Returns
    -------
    Clock
    """
    meter = ClockMeter()
    meter.add(log.columns["time"])
    return meter.clock()
