"""The two logs of a run in the lab frame: force (z, x) in N, path of the intruder in cm and rad."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rftfit.campaign.config import Arm, Config, Transducer
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.logs.base import Log
from rftfit.measure.flags import REPEATED
from rftfit.measure.pairs import ANGLE_TO_RAD, FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S, factor
from rftfit.measure.strokes import IntruderPath

CHANNELS = ("F1", "F2", "F3")
CHANNEL_FACTS = ("low_N", "high_N", "held_N", "held", "noise_N")
"""Columns of each channel in the table of runs."""

_NEAR_FULL_RANGE = 0.995
_FEWEST_QUIET = 50


@dataclass(frozen=True)
class ForceReadings:
    """A force log in the lab frame, its zero not yet removed; arrays of shape (n,).

    `time` (s) is on the force log's clock, `force` (2, n) holds z, x in N, `channels` (3, n) what the
    sensor reads on F1 to F3 in N; `arm_moving` is the sync line, if the log has one, and `saturated`
    where a channel is at the end of its range.
    """

    time: FloatArray
    force: FloatArray
    arm_moving: FloatArray | None
    saturated: np.ndarray
    channels: FloatArray


def sensor_to_lab(transducer: Transducer) -> FloatArray:
    """Matrix (2, 3) that turns the channels (F1, F2, F3) into the lab's (force_x, force_z).

    The signed axes of the transducer say which channel lies along which axis of its mount; the mount
    is turned by ``turn_deg`` about y, from z toward x.
    """
    mount = np.zeros((3, 3))
    for row, channel in enumerate((transducer.axes.x, transducer.axes.y, transducer.axes.z)):
        mount[row, CHANNELS.index(channel[1:])] = 1.0 if channel[0] == "+" else -1.0
    turn = math.radians(transducer.turn_deg)
    about_y = np.array(
        [[math.cos(turn), 0.0, math.sin(turn)], [-math.sin(turn), 0.0, math.cos(turn)]]
    )
    return np.asarray(about_y @ mount)


def measured_channel(config: Config, axis: str) -> str | None:
    """Channel of the transducer along an axis; None where the config states a constant in its place."""
    name: Any = getattr(config.transducer.axes, axis)[1:]
    stated = config.force_log.columns.get(name)
    return None if stated is not None and stated.constant is not None else name


def is_symmetric(run: Run) -> bool:
    """Whether no horizontal force acts on a run by symmetry: a level or upright plate, up or down."""
    return run.kind == "plate" and run.beta_deg % 90 == 0 and abs(run.gamma_deg) == 90


def lacks_force_x(config: Config, run: Run) -> bool:
    """Whether a run has no force along x since its table has none, or the config states a constant for its channel."""
    lacks = run.lacks_force_x or measured_channel(config, "x") is None
    return lacks and not is_symmetric(run)


def force_in_lab_frame(log: Log, transducer: Transducer) -> ForceReadings:
    """Turn a force log into the lab frame."""
    name, unit = log.path.name, transducer.force_unit
    channels = np.stack([log.columns[channel] for channel in CHANNELS])
    for index, channel in enumerate(CHANNELS):
        channels[index] *= factor(FORCE_TO_N, log.units[channel], unit, f"{name}: {channel}")
    time = log.columns["time"] * factor(TIME_TO_S, log.units["time"], "s", f"{name}: time")
    limits = np.array(transducer.range_N)[:, None]
    saturated = np.asarray((np.abs(channels) >= _NEAR_FULL_RANGE * limits).any(axis=0))
    force = (sensor_to_lab(transducer) @ channels)[::-1]
    return ForceReadings(time, force, log.columns.get("arm_moving"), saturated, channels)


def path_in_lab_frame(log: Log, run: Run, arm: Arm) -> IntruderPath:
    """Turn a motion log into the lab frame; a run's own ``surface_z_mm`` goes before the arm's."""

    def column(quantity: str, table: dict[str, float], unit: str) -> FloatArray:
        column_label = f"{log.path.name}: {quantity}"
        return log.columns[quantity] * factor(table, log.units[quantity], unit, column_label)

    surface_mm = arm.surface_z_mm if run.surface_z_mm is None else run.surface_z_mm
    x, z = (column(quantity, LENGTH_TO_CM, arm.position_unit) for quantity in ("x", "z"))
    angle = column("angle", ANGLE_TO_RAD, "deg")
    x -= arm.middle_x_mm / 10
    return IntruderPath(column("time", TIME_TO_S, "s"), x, z - surface_mm / 10, angle)


def without_repeats(log: Log, transducer: Transducer) -> Log:
    """Leave out the rows in which a slow transducer says the same again, if the config asks for it."""
    if transducer.repeats == "keep":
        return log
    return log.take(new_readings(np.stack([log.columns[name] for name in CHANNELS])), REPEATED)


def new_readings(channels: FloatArray) -> np.ndarray:
    """Tell readings from rows in which a transducer slower than its logger repeats all k channels."""
    fresh = np.ones(channels.shape[1], dtype=bool)
    fresh[1:] = (channels[:, 1:] != channels[:, :-1]).any(axis=0)
    return fresh


def readings_digest(readings: FloatArray) -> str:
    """Return what is equal in copies of a run, and in nothing else."""
    return hashlib.sha256(readings.tobytes()).hexdigest()[:16]


def channel_facts(channels: FloatArray, in_stroke: np.ndarray) -> dict[str, object]:
    """What each channel does in the stroke, its noise before and after it, and a digest of all readings."""
    moves = bool(np.ptp(channels, axis=1).any())
    facts: dict[str, object] = {"readings": readings_digest(channels) if moves else ""}
    for name, readings in zip(CHANNELS, channels, strict=True):
        values = readings[in_stroke]
        changes = np.flatnonzero(values[1:] != values[:-1]) + 1
        starts = np.concatenate([[0], changes, [values.size]])
        lengths = starts[1:] - starts[:-1]
        longest = int(lengths.argmax())
        facts_of_channel = (
            values.min(),
            values.max(),
            values[starts[longest]],
            lengths[longest] / values.size,
            _noise(readings[~in_stroke]),
        )
        facts |= {
            f"{name}_{fact}": value
            for fact, value in zip(CHANNEL_FACTS, facts_of_channel, strict=True)
        }
    return facts


def _noise(readings: FloatArray) -> float:
    """Standard deviation of readings from sample to sample, by second differences, jumps left out."""
    steps = np.sort(np.abs(np.diff(readings, 2)))
    if steps.size < _FEWEST_QUIET:
        return math.nan
    # of a normal number the smaller nine tenths have 0.789 of the root mean square of all
    inner = steps[: round(0.9 * steps.size)]
    return float(np.sqrt(np.mean(inner**2))) / (0.789 * math.sqrt(6))
