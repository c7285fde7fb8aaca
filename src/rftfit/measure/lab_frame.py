"""The two logs of a run in the lab frame: force (z, x) in N and its zero, path of the intruder in cm and rad."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rftfit.campaign.config import AnyPlate, Arm, Config, Leg, Transducer, ZeroSettings
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.logs.base import Log
from rftfit.measure.flags import REPEATED, Refused
from rftfit.measure.levels import median
from rftfit.measure.log_columns import ANGLE_TO_RAD, factor
from rftfit.measure.slopes import GIVEN_DOF, weighted_sum_variance
from rftfit.measure.strokes import IntruderPath
from rftfit.table.units import FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S

CHANNELS = ("F1", "F2", "F3")
CHANNEL_FACTS = ("low_N", "high_N", "held_N", "held", "noise_N")
"""Columns of each channel in the table of runs."""

NEAR_FULL_RANGE = 0.995
"""Part of the range from which on a reading is saturated."""
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
    return about_y @ mount


def measured_channel(config: Config, axis: str) -> str | None:
    """Channel of the transducer along an axis; None where the config states a constant in its place."""
    name: Any = getattr(config.transducer.axes, axis)[1:]
    stated = config.force_log.columns.get(name)
    return None if stated is not None and stated.constant is not None else name


def is_symmetric(run: Run) -> bool:
    """Whether no horizontal force acts on a run by symmetry: a level or upright plate, up or down."""
    return run.kind == "plate" and run.beta_deg % 90 == 0 and abs(run.gamma_deg) == 90


def measures_force_x(config: Config, run: Run) -> bool:
    """Whether the force along x of a run was measured: its table has it, and the config states no constant for its channel."""
    return not run.lacks_force_x and measured_channel(config, "x") is not None


def lacks_force_x(config: Config, run: Run) -> bool:
    """Whether the force along x of a run is unknown: nothing measured it, and symmetry does not make it 0."""
    return not measures_force_x(config, run) and not is_symmetric(run)


def force_in_lab_frame(log: Log, transducer: Transducer) -> ForceReadings:
    """Turn a force log into the lab frame."""
    name, unit = log.path.name, transducer.force_unit
    channels = np.array([log.columns[channel] for channel in CHANNELS])
    for index, channel in enumerate(CHANNELS):
        channels[index] *= factor(FORCE_TO_N, log.units[channel], unit, f"{name}: {channel}")
    time = log.columns["time"] * factor(TIME_TO_S, log.units["time"], "s", f"{name}: time")
    limits = np.array(transducer.range_N)[:, None]
    saturated = np.asarray((np.abs(channels) >= NEAR_FULL_RANGE * limits).any(axis=0))
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
    inside = channels.compress(in_stroke, axis=1)
    outside = channels.compress(~in_stroke, axis=1)
    for name, values, at_rest in zip(CHANNELS, inside, outside, strict=True):
        changes = np.flatnonzero(values[1:] != values[:-1]) + 1
        starts = np.concatenate([[0], changes, [values.size]])
        lengths = starts[1:] - starts[:-1]
        longest = int(lengths.argmax())
        facts_of_channel = (
            values.min(),
            values.max(),
            values[starts[longest]],
            lengths[longest] / values.size,
            _noise(at_rest),
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


# --- The zero: what the transducer reads while the whole intruder is in air


MIN_SAMPLES = 50
_FEWEST = 10
_TENTHS = 10


@dataclass(frozen=True)
class Zero:
    """Zero of the forces (z, x) of one run, to be subtracted.

    `force`, N: (2, n), a straight line in time between two stretches in air; else constant, (2, 1).
    `variance` (2,) of its error, N^2, allows for autocorrelation. `change_N` (2,): from the first stretch to the
    last; NaN if there is but one. `trend_N` (2,): what a straight line through the only stretch
    would add until the stroke; NaN if there are two or if it is not known.
    """

    force: FloatArray
    variance: FloatArray
    dof: float
    change_N: tuple[float, float] = (math.nan, math.nan)
    trend_N: tuple[float, float] = (math.nan, math.nan)

    @property
    def drift_N(self) -> float:
        """Largest change between the two stretches; NaN if there is but one."""
        return float(np.abs(self.change_N).max())


def half_extent(plate: AnyPlate, beta: float) -> tuple[float, float]:
    """Half the size along x and z, cm, of a plate held at `beta`, rad."""
    length, thickness = plate.length_cm / 2, plate.thickness_cm / 2
    cosine, sine = abs(math.cos(beta)), abs(math.sin(beta))
    return length * cosine + thickness * sine, length * sine + thickness * cosine


def height_needed(intruder: AnyPlate | Leg, angle: FloatArray, clearance: float) -> FloatArray:
    """Height of the reference point, cm, at which the whole intruder is clear of the surface.

    A leg counts as the circle around its chord, which every model leg lies within; `angle` (n,) in rad.
    """
    if isinstance(intruder, Leg):
        half_length = intruder.max_length_cm / 2
        # the tip lies at max_length x (-sin theta, -cos theta) from the axle
        return half_length * np.cos(angle) + half_length + clearance
    _, half_z = half_extent(intruder, float(angle.mean()))
    return np.full(angle.size, half_z + clearance)


def find_zero(
    time: FloatArray,
    force: FloatArray,
    at_rest: np.ndarray,
    stroke_time: float,
    drift_N_per_min: float,
    least_cm: float = 0.0,
) -> Zero:
    """Estimate the zero from the samples `at_rest` in air, at least `least_cm` above the surface.

    Refused if there are fewer of them than half a second holds, at most `MIN_SAMPLES`. `force` (2, n): z, x,
    N; `time` and `stroke_time`, the middle of the stroke, in s. Where the intruder is in air at one end
    of the run only, the zero may have moved by `drift_N_per_min` until the stroke, and nothing in the
    log would show it.
    """
    rest_rows = np.flatnonzero(at_rest)
    fewest = fewest_for_zero(time)
    breaks = np.flatnonzero(np.diff(rest_rows) > 1) + 1
    row_groups = [rows for rows in np.split(rest_rows, breaks) if rows.size >= fewest]
    if not row_groups:
        raise Refused("no-zero", least=least_cm)
    rests = [(float(time[rows].mean()), rows) for rows in row_groups]
    if rests[0][0] > stroke_time or rests[-1][0] < stroke_time:
        # a rest cut in two by a gap is one rest still: it shows nothing of the drift to the stroke
        rests = [max(rests, key=lambda rest_in_air: rest_in_air[1].size)]
    (t0, rows_before), (t1, rows_after) = rests[0], rests[-1]
    mean_before, variance, dof = _mean(force[:, rows_before])
    if len(rests) == 1:
        unseen = _unseen_drift(drift_N_per_min, abs(stroke_time - t0) / 60)
        away = time[rows_before] - t0
        trend = force[:, rows_before] @ away / float(away @ away) * (stroke_time - t0)
        return Zero(mean_before[:, None], variance + unseen, dof, trend_N=(trend[0], trend[1]))
    mean_after, last_variance, last_dof = _mean(force[:, rows_after])
    share = np.clip((time - t0) / (t1 - t0), 0, 1)
    line = mean_before[:, None] * (1 - share) + mean_after[:, None] * share
    # the larger of the two: an upper bound for any mix of the two means
    variance = np.maximum(variance, last_variance)
    change = mean_after - mean_before
    return Zero(line, variance, min(dof, last_dof), (float(change[0]), float(change[1])))


def zero_of_log(force: FloatArray, drift_N_per_min: float, age_min: float) -> Zero:
    """Take the zero of a run from another log, recorded without load.

    `force`: shape (2, n), N. Between that log and the stroke the zero may have drifted, for `age_min`.
    """
    if force.shape[1] < _FEWEST:
        raise Refused("short-zero-log", found=force.shape[1], wanted=_FEWEST)
    mean, variance, dof = _mean(force)
    return Zero(mean[:, None], variance + _unseen_drift(drift_N_per_min, age_min), dof)


def _unseen_drift(drift_N_per_min: float, minutes: float) -> float:
    """Variance of a zero, N^2, that nothing showed for so long: any drift up to the largest is equally likely."""
    return (drift_N_per_min * minutes) ** 2 / 3


def change_within(force: FloatArray) -> tuple[float, float]:
    """How far the component that moves most moves in a log without load, N, and that as a multiple of its noise.

    `force`: shape (2, n), N. Means of tenths of the log are compared; the noise is that within a tenth.
    """
    count = max(1, min(_TENTHS, force.shape[1] // _FEWEST))
    tenths = np.array_split(force, count, axis=1)
    change = np.ptp([tenth.mean(axis=1) for tenth in tenths], axis=0)
    noise = np.median([tenth.std(axis=1) for tenth in tenths], axis=0)
    most = int(change.argmax())
    return float(change[most]), float(change[most] / noise[most]) if noise[most] else math.inf


def stated_zero(stated: ZeroSettings, transducer: Transducer) -> Zero:
    """The zero that the config states, the same in every run."""
    force = (sensor_to_lab(transducer) @ np.array(stated.readings_N))[::-1]
    variance = np.full(2, (stated.sd_N or 0.0) ** 2)
    return Zero(force[:, None], variance, GIVEN_DOF)


def fewest_for_zero(time: FloatArray) -> int:
    """Count the samples in half a second of a slow transducer; `MIN_SAMPLES` at 100 Hz and faster."""
    step = median(np.diff(time)) if time.size > 1 else 0.0
    return max(_FEWEST, min(MIN_SAMPLES, round(0.5 / step))) if step > 0 else MIN_SAMPLES


def _mean(force: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    mean = force.mean(axis=1)
    count = force.shape[1]
    variance, dof = weighted_sum_variance(force - mean[:, None], np.ones(count))
    return mean, variance / count**2, dof
