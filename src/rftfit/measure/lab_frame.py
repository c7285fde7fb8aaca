"""Turn the logs of a run into the lab frame: axes, signs and range of the transducer, its zero; path of the intruder.

Lab frame: z upward, 0 at the free surface; x forward, 0 in the middle of the container. The *channels* of the
transducer are F1, F2, F3; ``transducer.axes`` of the config says which of them lies along which axis of its mount. The
*zero* is what the transducer reads without load: `find_zero` takes it from the rests in air of the run itself,
`zero_of_log` from another log, `stated_zero` from the config. A plate has the angle beta, a leg theta, both rad.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rftfit.campaign.config import AnyPlate, Arm, Config, Leg, Transducer, ZeroSettings
from rftfit.campaign.sheet import Run
from rftfit.conventions import BoolArray, FloatArray
from rftfit.logs.base import Log
from rftfit.measure.flags import REPEATED, Refused
from rftfit.measure.levels import find_equal_stretches, find_stretches, median
from rftfit.measure.log_columns import ANGLE_TO_RAD, unit_factor
from rftfit.measure.slopes import GIVEN_DOF, weighted_sum_variance
from rftfit.measure.strokes import IntruderPath
from rftfit.store.chosen import chosen
from rftfit.table.units import FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S

CHANNELS = ("F1", "F2", "F3")
CHANNEL_FACTS = ("low_N", "high_N", "held_N", "held", "noise_N")
"""Columns of each channel in the table of runs, as ``F1_low_N``.

Lowest and highest reading of the stroke; the reading that stays equal for longest, and for which fraction of the
stroke; and the standard deviation of the noise outside the stroke.
"""

NEAR_FULL_RANGE = 0.995
"""Fraction of the range of the transducer at which a reading counts as saturated."""


@dataclass(frozen=True)
class ForceReadings:
    """A force log in the lab frame, its zero not yet removed; arrays of shape (n,).

    `time`: On the clock of the force log, s.
    `force`: Force on the intruder and its rod, z and x, N, shape (2, n).
    `arm_moving`: The sync line, 1 while the arm moves, else 0; None if the log has none.
    `saturated`: True where a channel is at the end of its range.
    `channels`: Readings of F1 to F3, N, shape (3, n).
    """

    time: FloatArray
    force: FloatArray
    arm_moving: FloatArray | None
    saturated: BoolArray
    channels: FloatArray


def sensor_to_lab(transducer: Transducer) -> FloatArray:
    """Matrix (2, 3) that turns the channels (F1, F2, F3) into force_x and force_z of the lab.

    The signed axes of the transducer, such as ``-F2``, say which channel lies along which axis of its mount; the mount
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
    """Channel of the transducer along an `axis` of its mount, x, y or z; None if the config states a constant for it.

    A channel that was not recorded is stated as the constant 0, so its force was not measured.
    """
    name: Any = getattr(config.transducer.axes, axis)[1:]
    stated = config.force_log.columns.get(name)
    return None if stated is not None and stated.constant is not None else name


def is_symmetric(run: Run) -> bool:
    """Return True if symmetry excludes a horizontal force: a level or upright plate on a vertical path."""
    return run.kind == "plate" and run.beta_deg % 90 == 0 and abs(run.gamma_deg) == 90


def measures_force_x(config: Config, run: Run) -> bool:
    """Return True if the force along x was measured: the run has it, and its channel is no stated constant."""
    return not run.lacks_force_x and measured_channel(config, "x") is not None


def lacks_force_x(config: Config, run: Run) -> bool:
    """Return True if the force along x is unknown: it was not measured, and symmetry does not make it 0."""
    return not measures_force_x(config, run) and not is_symmetric(run)


def force_in_lab_frame(log: Log, transducer: Transducer) -> ForceReadings:
    """Turn a force log into forces z and x in the lab frame; refuse it if its units are not those of the config.

    `log`: With the columns time, F1, F2, F3 and perhaps arm_moving.
    """
    name, unit = log.path.name, transducer.force_unit
    channels = np.array([log.columns[channel] for channel in CHANNELS])
    for index, channel in enumerate(CHANNELS):
        channels[index] *= unit_factor(FORCE_TO_N, log.units[channel], unit, f"{name}: {channel}")
    time = log.columns["time"] * unit_factor(TIME_TO_S, log.units["time"], "s", f"{name}: time")
    limits = np.array(transducer.range_N)[:, None]
    saturated = np.asarray((np.abs(channels) >= NEAR_FULL_RANGE * limits).any(axis=0))
    # the matrix gives x, then z
    force = (sensor_to_lab(transducer) @ channels)[::-1]
    return ForceReadings(time, force, log.columns.get("arm_moving"), saturated, channels)


def path_in_lab_frame(log: Log, run: Run, arm: Arm) -> IntruderPath:
    """Turn a motion log into the lab frame; ``surface_z_mm`` of the run replaces that of the arm.

    `log`: With the columns time, x, z, angle.
    """

    def column(quantity: str, table: dict[str, float], unit: str) -> FloatArray:
        """Return the values of a quantity in cm, rad or s; the log must have it in `unit`."""
        column_label = f"{log.path.name}: {quantity}"
        return log.columns[quantity] * unit_factor(table, log.units[quantity], unit, column_label)

    x, z = (column(quantity, LENGTH_TO_CM, arm.position_unit) for quantity in ("x", "z"))
    angle = column("angle", ANGLE_TO_RAD, "deg")
    x -= arm.middle_x_mm / 10
    return IntruderPath(column("time", TIME_TO_S, "s"), x, z - run.surface_of(arm) / 10, angle)


def logs_in_lab_frame(
    config: Config, run: Run, force_log: Log, motion_log: Log
) -> tuple[ForceReadings, IntruderPath]:
    """Turn both logs of a run into the lab frame, without repeated readings if the config asks for it.

    Returns the forces on the clock of the force log and the path on that of the motion log.
    """
    force_log = without_repeats(force_log, config.transducer)
    readings = force_in_lab_frame(force_log, config.transducer)
    return readings, path_in_lab_frame(motion_log, run, config.arm)


def without_repeats(log: Log, transducer: Transducer) -> Log:
    """Leave out the rows of a force log that only repeat a reading of a slow transducer, if the config asks for it.

    Copies of a reading would pass for further measurements and make errors too small.
    """
    if transducer.repeats == "keep":
        return log
    return log.take(new_readings(np.stack([log.columns[name] for name in CHANNELS])), REPEATED)


def new_readings(channels: FloatArray) -> BoolArray:
    """Return True for rows with a new reading, shape (n,): not all `channels`, shape (k, n), repeat the row before."""
    fresh = np.ones(channels.shape[1], dtype=bool)
    fresh[1:] = (channels[:, 1:] != channels[:, :-1]).any(axis=0)
    return fresh


def readings_digest(readings: FloatArray) -> str:
    """Return a digest of an array that is equal for copies of a run, and for nothing else."""
    return hashlib.sha256(readings.tobytes()).hexdigest()[:16]


_CHANGES_OF_NO_CHANCE: int = chosen("measure", "copies").shortest
"""Fewest changes of a channel from reading to reading that two runs never share by chance."""


def channel_facts(channels: FloatArray, in_stroke: BoolArray) -> dict[str, object]:
    """Return facts of each channel, and digests of the readings: of all channels, then of each noisy one.

    The keys are columns of the table of runs: ``readings`` (the digests; empty if no channel moves), and those of
    `CHANNEL_FACTS` for each channel, as ``F1_low_N``. The checks of the channels need them. `channels`: N, shape
    (3, n). `in_stroke`: True in the stroke, shape (n,).
    """
    moves = bool(np.ptp(channels, axis=1).any())
    # a lab that turns the forces of each log by its own angle leaves the channel across the plane equal in copies
    noisy = [
        readings
        for readings in channels
        if np.count_nonzero(np.diff(readings[np.isfinite(readings)])) >= _CHANGES_OF_NO_CHANCE
    ]
    digests = [readings_digest(readings) for readings in [channels, *noisy]] if moves else []
    facts: dict[str, object] = {"readings": " ".join(digests)}
    inside = channels.compress(in_stroke, axis=1)
    outside = channels.compress(~in_stroke, axis=1)
    for name, readings, readings_at_rest in zip(CHANNELS, inside, outside, strict=True):
        starts, lengths = find_equal_stretches(readings)
        longest = int(lengths.argmax())
        facts_of_channel = (
            readings.min(),
            readings.max(),
            readings[starts[longest]],
            lengths[longest] / readings.size,
            _noise_at_rest(readings_at_rest),
        )
        names = (f"{name}_{fact}" for fact in CHANNEL_FACTS)
        facts |= zip(names, facts_of_channel, strict=True)
    return facts


def _noise_at_rest(readings: FloatArray) -> float:
    """Standard deviation of readings from sample to sample, from their second differences without the largest tenth.

    Second differences remove a drift, and the largest tenth would hold the moves of the arm. NaN for fewer than 50.
    """
    steps = np.sort(np.abs(np.diff(readings, 2)))
    if steps.size < 50:
        return math.nan
    # the smaller nine tenths of normal numbers have 0.789 times the root mean square of all;
    # the variance of a second difference is six times that of a reading
    inner = steps[: round(0.9 * steps.size)]
    return float(np.sqrt(np.mean(inner**2))) / (0.789 * math.sqrt(6))


# --- The zero: what the transducer reads while the whole intruder is in air


MIN_SAMPLES = 50
"""Samples in air that always suffice for a zero."""
_FEWEST_SAMPLES = 10
"""Fewest samples from which a mean is taken as a zero."""


@dataclass(frozen=True)
class Zero:
    """Zero of the forces (z, x) of one run, to be subtracted.

    `force`: N; a straight line in time between two stretches in air, shape (2, n), or else a constant, shape (2, 1).
    `variance`, `dof`: Variance of the error of the zero, N^2, shape (2,), which allows for autocorrelation, and its
    degrees of freedom.
    `change_N`: Change of z and x from the first stretch in air to the last; NaN if there is only one.
    `trend_N`: Change of z and x until the stroke by a straight line through the only stretch; NaN if there are two, or
    if not known. The checks compare it with those of other runs: it shows a drift.
    """

    force: FloatArray
    variance: FloatArray
    dof: float
    change_N: tuple[float, float] = (math.nan, math.nan)
    trend_N: tuple[float, float] = (math.nan, math.nan)

    @property
    def drift_N(self) -> float:
        """Largest change of a component between the two stretches; NaN if there is only one stretch."""
        return float(np.abs(self.change_N).max())


def half_extent(plate: AnyPlate, beta: float) -> tuple[float, float]:
    """Half the size along x and z, cm, of a plate held at `beta`, rad."""
    length, thickness = plate.length_cm / 2, plate.thickness_cm / 2
    cosine, sine = abs(math.cos(beta)), abs(math.sin(beta))
    return length * cosine + thickness * sine, length * sine + thickness * cosine


def height_needed(intruder: AnyPlate | Leg, angle: FloatArray, clearance: float) -> FloatArray:
    """Height of the reference point, cm, shape (n,), at which the whole intruder is `clearance` cm above the surface.

    A leg counts as the circle whose diameter is its chord: every model leg lies within it. `angle`: Beta of a plate or
    theta of a leg, rad, shape (n,).
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
    at_rest: BoolArray,
    stroke_time: float,
    drift_N_per_min: float,
    least_cm: float = 0.0,
) -> Zero:
    """Estimate the zero from the rests in air: a line in time between rests before and behind the stroke, else a mean.

    Refused if no stretch in air has the samples of half a second (`fewest_for_zero`). Where the intruder is in air at
    one end of the run only, the zero may drift until the stroke without a trace in the log: its variance includes this.

    `force`: z and x, N, shape (2, n).
    `at_rest`: True for the samples that count, shape (n,).
    `stroke_time`: Middle of the stroke, s.
    `drift_N_per_min`: Largest drift of the zero.
    `least_cm`: Height above the surface that the samples in air have, for the message alone.
    """
    fewest = fewest_for_zero(time)
    row_groups = [
        np.arange(start, stop)
        for start, stop in find_stretches(at_rest).T
        if stop - start >= fewest
    ]
    if not row_groups:
        raise Refused("no-zero", least=least_cm)
    first, last = row_groups[0], row_groups[-1]
    if time[first].mean() > stroke_time or time[last].mean() < stroke_time:
        # all rests lie on one side of the stroke: they do not show the drift until the stroke
        first = last = max(row_groups, key=len)
    t0, t1 = float(time[first].mean()), float(time[last].mean())
    mean_before, variance, dof = _mean_with_variance(force[:, first])
    if first is last:
        # a constant; its change until the stroke is unknown, so it widens the error
        unseen = _unseen_drift(drift_N_per_min, abs(stroke_time - t0) / 60)
        since_middle = time[first] - t0
        slope = force[:, first] @ since_middle / float(since_middle @ since_middle)
        trend = slope * (stroke_time - t0)
        return Zero(mean_before[:, None], variance + unseen, dof, trend_N=(trend[0], trend[1]))
    mean_after, last_variance, last_dof = _mean_with_variance(force[:, last])
    share = np.clip((time - t0) / (t1 - t0), 0, 1)
    line = mean_before[:, None] * (1 - share) + mean_after[:, None] * share
    # the larger variance is an upper bound for any mix of the two means
    variance = np.maximum(variance, last_variance)
    change = mean_after - mean_before
    return Zero(line, variance, min(dof, last_dof), (float(change[0]), float(change[1])))


def zero_of_log(force: FloatArray, drift_N_per_min: float, age_min: float) -> Zero:
    """Estimate the zero of a run from another log, recorded without load; refuse a log that is too short.

    `force`: Forces of that log, N, shape (2, n).
    `age_min`: Time between that log and the stroke, in which the zero may have drifted, minutes.
    """
    if force.shape[1] < _FEWEST_SAMPLES:
        raise Refused("short-zero-log", found=force.shape[1], wanted=_FEWEST_SAMPLES)
    mean, variance, dof = _mean_with_variance(force)
    return Zero(mean[:, None], variance + _unseen_drift(drift_N_per_min, age_min), dof)


def _unseen_drift(drift_N_per_min: float, minutes: float) -> float:
    """Variance of a zero, N^2, that was not seen for some minutes: any drift up to the largest is equally likely.

    A uniform distribution from -d to d has the variance d^2 / 3.
    """
    return (drift_N_per_min * minutes) ** 2 / 3


def change_within(force: FloatArray) -> tuple[float, float]:
    """Return the change of the zero within a log without load, N, and this change divided by the noise.

    A large change shows that the log holds a push, and is no zero.

    The change is the range of the means of ten parts of the log, for the component with the larger range; the noise is
    the standard deviation within a part. `force`: N, shape (2, n).
    """
    count = max(1, min(10, force.shape[1] // _FEWEST_SAMPLES))
    tenths = np.array_split(force, count, axis=1)
    changes = np.ptp([tenth.mean(axis=1) for tenth in tenths], axis=0)
    component = int(changes.argmax())
    change = float(changes[component])
    noise = float(np.median([tenth[component].std() for tenth in tenths]))
    return change, change / noise if noise else math.inf


def stated_zero(stated: ZeroSettings, transducer: Transducer) -> Zero:
    """Return the zero that the config states, the same in every run."""
    force = (sensor_to_lab(transducer) @ np.array(stated.readings_N))[::-1]
    variance = np.full(2, (stated.sd_N or 0.0) ** 2)
    return Zero(force[:, None], variance, GIVEN_DOF)


def fewest_for_zero(time: FloatArray) -> int:
    """Fewest samples of a stretch in air from which a zero is taken: those of half a second, from 10 to `MIN_SAMPLES`.

    `time`: s, shape (n,).
    """
    step = median(np.diff(time)) if time.size > 1 else 0.0
    return max(_FEWEST_SAMPLES, min(MIN_SAMPLES, round(0.5 / step))) if step > 0 else MIN_SAMPLES


def _mean_with_variance(force: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return mean, its variance, shape (2,) each, and degrees of freedom; allows for autocorrelation.

    `force`: N, shape (2, n).
    """
    mean = force.mean(axis=1)
    count = force.shape[1]
    variance, dof = weighted_sum_variance(force - mean[:, None], np.ones(count))
    return mean, variance / count**2, dof
