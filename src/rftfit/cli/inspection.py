"""What can be said of a log on its own: columns, clock, resolution, damage, what it lacks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.logs.base import LogError
from rftfit.logs.registry import DIALECTS, detect

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Dialect, Log

GAP_STEPS = 5.0
"""A step longer than this many median steps is shown as a gap."""

_QUANTITIES = {
    "time": "time",
    "arm_moving": "whether the arm moves (1) or rests (0)",
    "x": "horizontal position of the intruder, arm coordinates",
    "z": "vertical position of the intruder, arm coordinates",
    "angle": "angle of the plate (beta) or of the leg (theta)",
}


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
        are fewer than two rows.
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


def read_log(path: Path) -> tuple[Dialect, Log]:
    """Find the dialect of a file and read it.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dialect : Dialect
    log : Log

    Raises
    ------
    InputError
        If no reader knows the file, or it is damaged; the message lists the dialects there are.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; name one log in it")
    reader = detect(path)
    if reader is not None:
        return reader, reader.load(path)
    reasons = []
    for candidate in DIALECTS.values():
        try:
            candidate.load(path)
        except LogError as error:
            reasons.append(f"  {candidate.name} ({candidate.describe()}): {_without(error, path)}")
    known = "\n".join(reasons) or f"  {', '.join(DIALECTS)}"
    raise InputError(f"{path}: no dialect reads this file. The dialects there are:\n{known}")


def _without(error: LogError, path: Path) -> str:
    return str(error).removeprefix(f"{path}: ")


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
    quantity = _QUANTITIES.get(name, f"force, sensor channel {name}" if name[0] == "F" else name)
    if values.size == 0:
        return Column(name, quantity, unit, np.nan, np.nan, np.nan)
    steps = np.diff(np.unique(values))
    resolution = float(steps.min()) if steps.size else np.nan
    return Column(name, quantity, unit, float(values.min()), float(values.max()), resolution)


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
    time = log.columns["time"]
    steps = np.diff(time)
    forward = steps[steps > 0]
    if forward.size == 0:
        duration = float(np.ptp(time)) if time.size else 0.0
        repeated, backwards = np.count_nonzero(steps == 0), np.count_nonzero(steps < 0)
        return Clock(duration, np.nan, np.nan, (), int(repeated), int(backwards))
    step = float(np.median(forward))
    late = np.flatnonzero(steps > GAP_STEPS * step)
    return Clock(
        duration=float(time.max() - time.min()),
        step=step,
        jitter=float(np.median(np.abs(forward - step))),
        gaps=tuple((float(time[i]), float(steps[i])) for i in late),
        repeated=int(np.count_nonzero(steps == 0)),
        backwards=int(np.count_nonzero(steps < 0)),
    )


def lacking(log: Log) -> list[str]:
    """Say what the measurement chain needs beyond this file.

    Parameters
    ----------
    log : Log

    Returns
    -------
    list of str
        A sentence each; the first names the other half of the pair.
    """
    force = "F1" in log.columns
    other = "the motion log of the same run (time, x, z, angle)"
    if not force:
        other = "the force log of the same run (time, arm_moving, F1, F2, F3)"
    needs = [other, "a row of the run sheet that names both"]
    if force:
        needs.append("transducer range, axes and turn, in config.yaml")
        line = log.columns["arm_moving"]
        if line.size and np.unique(line).size == 1:
            needs.append("a change of arm_moving: without one the two clocks cannot be joined")
    else:
        needs.append("the arm z of the free surface, in config.yaml or the run sheet")
    if log.columns["time"].size < 2:
        needs.append("at least two usable rows")
    return needs
