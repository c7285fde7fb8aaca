"""One run from its two logs to a trace in the lab frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.logs.base import Log, LogError
from rftfit.measure.clean import gaps
from rftfit.measure.frame import sensor_to_lab
from rftfit.measure.ledger import DROPPED, LOST, USED, Ledger
from rftfit.measure.motion import Motion, StrokeError
from rftfit.measure.placing import REPEATED, find_clock, place_surface, stroke_of, without_repeats
from rftfit.measure.rows import Why
from rftfit.measure.units import ANGLE_TO_RAD, FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S, factor
from rftfit.measure.zero import find_zero, height_needed

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.campaign.runs import Run
    from rftfit.conventions import FloatArray
    from rftfit.measure.alignment import Alignment
    from rftfit.measure.clock import ClockFit
    from rftfit.measure.compliance import Compliance
    from rftfit.measure.pair import Pair
    from rftfit.measure.surface import Surface

PHASES = ("air", "approach", "pause", "stroke", "other")
_WHY_OF_PHASE = np.array(
    [Why.GOOD, Why.APPROACH, Why.PAUSE, Why.GOOD, Why.ELSEWHERE], dtype=np.int8
)
_NEAR_FULL_RANGE = 0.995


@dataclass(frozen=True)
class Trace:
    """One run in the lab frame, on the force log's clock; arrays of shape (n,).

    Parameters
    ----------
    run : Run
    time : numpy.ndarray
        s.
    phase : numpy.ndarray of int
        Index into `PHASES`.
    x, z : numpy.ndarray
        Reference point of the intruder, cm.
    angle : numpy.ndarray
        beta or theta, rad.
    force : numpy.ndarray, shape (2, n)
        z, x; N; zero removed.
    why : numpy.ndarray of int8
        `Why` a row must not be used; GOOD where it may.
    zero_variance : numpy.ndarray, shape (2,)
        N^2.
    zero_dof : float
    clock : ClockFit
    flags : tuple of str
        Remarks that do not stop the run.
    rows : tuple of int
        Data lines of force and motion log.
    alignment : Alignment or None
        What the clocks were estimated from, where they were.
    surface : Surface or None
        The free surface as found, where it was looked for.
    """

    run: Run
    time: FloatArray
    phase: np.ndarray
    x: FloatArray
    z: FloatArray
    angle: FloatArray
    force: FloatArray
    why: np.ndarray
    zero_variance: FloatArray
    zero_dof: float
    clock: ClockFit
    flags: tuple[str, ...]
    rows: tuple[int, int]
    alignment: Alignment | None = None
    surface: Surface | None = None

    @property
    def note(self) -> str:
        """What was put right and touches no number, but should be known."""
        hours = self.clock.whole_hours
        return (
            f"clocks {hours:+d} h apart (time zone or daylight saving), put right" if hours else ""
        )

    @property
    def step_s(self) -> float:
        """Mean step between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


class RunRefused(ValueError):
    """A run that gives no trace; the text is the reason in ledger, table and report."""


def ingest_run(
    config: Config, run: Run, pair: Pair, ledger: Ledger, compliance: Compliance | None = None
) -> Trace:
    """Bring the two logs of a run together and into the lab frame.

    Rows that go no further are put into the ledger here; the good ones of the stroke are left to
    the stages that use them.

    Parameters
    ----------
    config : Config
    run : Run
    pair : Pair
        Its logs as read.
    ledger : Ledger
        Is added to.
    compliance : Compliance, optional
        How far the machine yields under load.

    Returns
    -------
    Trace

    Raises
    ------
    RunRefused
        If the run cannot be used; all rows of both files are then in the ledger.
    """
    problems = [f"excluded: {run.reason}"] if run.excluded else pair.problems
    if not problems:
        assert isinstance(pair.force, Log)
        assert isinstance(pair.motion, Log)
        force_log = without_repeats(config, pair.force)
        try:
            trace = _make_trace(config, run, force_log, pair.motion, compliance)
        except ValueError as error:
            problems = [str(error)]
        else:
            _account(ledger, run, force_log, pair.motion, trace)
            return trace
    reason = "; ".join(problems)
    _account_refused(ledger, run, run.force_log, pair.force, reason)
    _account_refused(ledger, run, run.motion_log, pair.motion, reason)
    raise RunRefused(reason)


def _make_trace(
    config: Config, run: Run, force_log: Log, motion_log: Log, compliance: Compliance | None
) -> Trace:
    channels, force_time, line = _channels(config, force_log)
    force = (sensor_to_lab(config.transducer) @ channels)[::-1]
    motion = read_motion(config, run, motion_log)
    limits = np.array(config.transducer.range_N)[:, None]
    saturated = np.asarray((np.abs(channels) >= _NEAR_FULL_RANGE * limits).any(axis=0))
    spans = motion.spans(config.arm)
    usable = ~saturated
    clock, alignment = find_clock(config, run, force_time, line, force[0], motion, usable, spans)
    on_motion = clock.motion_time(force_time)
    motion, surface = place_surface(
        config, run, motion, on_motion[usable], force[0, usable], clock.se_s or 0.0
    )
    start, end = stroke_of(config, run, motion, spans)
    x, z, angle = motion.at(on_motion)
    why = np.full(force_time.size, Why.GOOD, dtype=np.int8)
    for gap_start, gap_end in gaps(motion.time, config.clock.max_gap_s):
        why[(on_motion > gap_start) & (on_motion < gap_end)] = Why.MOTION_GAP
    why[(on_motion < motion.time[0]) | (on_motion > motion.time[-1])] = Why.NO_MOTION
    why[saturated] = Why.SATURATED

    moving = np.zeros(force_time.size, dtype=bool)
    # a tenth of a second around each stretch belongs to its ramps
    first = np.searchsorted(on_motion, spans[:, 0] - 0.1, side="right")
    for begin, stop in zip(first, np.searchsorted(on_motion, spans[:, 1] + 0.1), strict=True):
        moving[begin:stop] = True
    intruder = config.intruders[run.intruder]
    in_air = z >= height_needed(intruder, angle, config.fit.air_clearance_cm)
    in_stroke = (on_motion >= start) & (on_motion <= end)
    if not in_stroke.any():
        raise StrokeError(
            "no_force",
            "the force log has no sample during the stroke; do the two logs belong to one run?",
        )
    zero = find_zero(
        force_time,
        force,
        in_air & (why == Why.GOOD) & ~in_stroke,
        moving,
        float(force_time[in_stroke].mean()),
        config.transducer.drift_N_per_min,
    )
    if zero is None:
        raise StrokeError(
            "no_zero", "no zero: the intruder is never at rest in air for half a second"
        )

    force = force - zero.force
    if compliance is not None:
        travel, known = compliance.at(force[0])
        z = z + travel
        why[~known & (why == Why.GOOD)] = Why.YIELDED

    phase = np.full(force_time.size, PHASES.index("other"))
    phase[in_air & ~moving] = PHASES.index("air")
    phase[~in_air & ~moving & (np.abs(z) < 0.2)] = PHASES.index("pause")
    phase[moving & (on_motion < start)] = PHASES.index("approach")
    phase[in_stroke] = PHASES.index("stroke")
    missing = max(float(end - on_motion[-1]), float(on_motion[0] - start))
    flags = _damage(force_log, motion_log)
    flags += _flags(config, force_time[in_stroke], missing, zero.drift_N)
    if start <= motion.time[1] or end >= motion.time[-2]:
        flags += ("the motion log begins or ends within the stroke",)
    stuck = int(np.count_nonzero(saturated & in_stroke))
    if stuck:
        flags += (f"transducer saturated in {stuck} samples of the stroke",)
    return Trace(
        run, force_time, phase, x, z, angle, force, why,
        zero.variance, zero.dof, clock, flags, (force_log.rows, motion_log.rows),
        alignment, surface,
    )  # fmt: skip


def _channels(config: Config, log: Log) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Channels in N, shape (3, n); time in s; the sync line, if there is one."""
    unit = config.transducer.force_unit
    names = ("F1", "F2", "F3")
    channels = np.stack([log.columns[name] for name in names])
    for index, name in enumerate(names):
        channels[index] *= factor(FORCE_TO_N, log.units[name], unit, f"{log.path.name}: {name}")
    time = log.columns["time"] * factor(TIME_TO_S, log.units["time"], "s", f"{log.path.name}: time")
    return channels, time, log.columns.get("arm_moving")


def read_force(config: Config, log: Log) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Turn a force log into the lab frame.

    Parameters
    ----------
    config : Config
    log : Log

    Returns
    -------
    force : numpy.ndarray, shape (2, n)
        z, x; N; zero not removed.
    time : numpy.ndarray, shape (n,)
        s.
    line : numpy.ndarray, shape (n,), or None
        The sync line.

    Raises
    ------
    ValueError
        If log and config disagree on a unit.
    """
    channels, time, line = _channels(config, log)
    return (sensor_to_lab(config.transducer) @ channels)[::-1], time, line


def read_motion(config: Config, run: Run, log: Log) -> Motion:
    """Turn a motion log into the lab frame.

    Parameters
    ----------
    config : Config
    run : Run
        Its ``surface_z_mm`` goes before the arm's.
    log : Log

    Returns
    -------
    Motion

    Raises
    ------
    ValueError
        If log and config disagree on a unit.
    """
    unit = config.arm.position_unit
    name = log.path.name
    to_cm = factor(LENGTH_TO_CM, log.units["x"], unit, f"{name}: x")
    to_cm_z = factor(LENGTH_TO_CM, log.units["z"], unit, f"{name}: z")
    to_rad = factor(ANGLE_TO_RAD, log.units["angle"], "deg", f"{name}: angle")
    to_s = factor(TIME_TO_S, log.units["time"], "s", f"{name}: time")
    surface_mm = config.arm.surface_z_mm if run.surface_z_mm is None else run.surface_z_mm
    return Motion(
        log.columns["time"] * to_s,
        log.columns["x"] * to_cm,
        log.columns["z"] * to_cm_z - surface_mm / 10,
        log.columns["angle"] * to_rad,
    )


def _damage(*logs: Log) -> tuple[str, ...]:
    """Name the rows that were lost from each log, and why."""
    return tuple(
        f"{count} rows of {log.path.name}: {reason}"
        for log in logs
        for reason, count in (*log.dropped.items(), *log.missing.items())
        if reason != REPEATED
    )


def _flags(
    config: Config, stroke_time: FloatArray, missing_s: float, drift: float
) -> tuple[str, ...]:
    flags = []
    longest = config.clock.max_gap_s
    for start, end in gaps(stroke_time, longest):
        flags.append(f"gap of {end - start:.2f} s in the force log during the stroke")
    if missing_s > longest:
        flags.append(f"force log lacks {missing_s:.2f} s of the stroke")
    if math.isfinite(drift) and drift > config.transducer.max_drift_N:
        flags.append(f"zero drifted by {drift:.2f} N")
    return tuple(flags)


def _account(ledger: Ledger, run: Run, force_log: Log, motion_log: Log, trace: Trace) -> None:
    """Put everything but the stroke's own rows into the ledger."""
    for file, log in ((run.force_log, force_log), (run.motion_log, motion_log)):
        for reason, rows in log.dropped.items():
            ledger.add(run, file, DROPPED, reason, rows)
        _account_lost(ledger, run, file, log)
    path = f"path; {trace.note}" if trace.note else "path"
    ledger.add(run, run.motion_log, USED, path, motion_log.columns["time"].size)
    outside = _WHY_OF_PHASE[trace.phase]
    outside = np.where(trace.why == Why.GOOD, outside, trace.why)
    handed_on = (trace.phase == PHASES.index("stroke")) & (trace.why == Why.GOOD)
    ledger.add_rows(run, run.force_log, outside[~handed_on], "zero of the transducer")


def _account_lost(ledger: Ledger, run: Run, file: str, log: Log) -> None:
    """Put what the instrument counted and the file lacks into the ledger."""
    for reason, samples in log.missing.items():
        ledger.add(run, file, LOST, reason, samples)


def _account_refused(ledger: Ledger, run: Run, file: str, log: Log | LogError, reason: str) -> None:
    if isinstance(log, LogError):
        ledger.add(run, file, DROPPED, reason, log.rows)
        return
    for cause, rows in log.dropped.items():
        ledger.add(run, file, DROPPED, cause, rows)
    ledger.add(run, file, DROPPED, reason, log.size)
    _account_lost(ledger, run, file, log)
