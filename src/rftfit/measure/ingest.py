"""One run from its two logs to a trace in the lab frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.logs.base import Log, LogError
from rftfit.measure.alignment import Alignment, estimate_clocks, new_readings
from rftfit.measure.clocks import ClockError, ClockFit, align, moving_spans, whole_spans
from rftfit.measure.ledger import DROPPED, LOST, USED, Ledger, Why
from rftfit.measure.pairs import (
    ANGLE_TO_RAD,
    FORCE_TO_N,
    LENGTH_TO_CM,
    TIME_TO_S,
    factor,
    gaps,
    load_pairs,
    one_table,
)
from rftfit.measure.strokes import Motion, StrokeError, find_stroke
from rftfit.measure.surface import Surface, SurfaceError, compliance_of, find_surface
from rftfit.measure.zero import find_zero, height_needed

if TYPE_CHECKING:
    from rftfit.campaign.config import Config, Transducer
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray
    from rftfit.measure.pairs import Pair
    from rftfit.measure.surface import Compliance


# --- From the sensor's own channels to the lab frame (docs/architecture.md).


def sensor_to_lab(transducer: Transducer) -> FloatArray:
    """Matrix that turns the channels (F1, F2, F3) into the lab's (force_x, force_z).

    `transducer`: Its signed axes say which channel lies along which mount axis; the mount is
    turned by ``turn_deg`` about y, from z toward x. Returns shape (2, 3).
    """
    mount = np.zeros((3, 3))
    for row, channel in enumerate((transducer.axes.x, transducer.axes.y, transducer.axes.z)):
        mount[row, int(channel[2]) - 1] = 1.0 if channel[0] == "+" else -1.0
    turn = math.radians(transducer.turn_deg)
    about_y = np.array(
        [[math.cos(turn), 0.0, math.sin(turn)], [-math.sin(turn), 0.0, math.cos(turn)]]
    )
    return np.asarray(about_y @ mount)


# --- When and where: the clocks of a run, its free surface and its stroke, in the way the config asks for.


REPEATED = "repeats the reading before (transducer slower than its logger)"
_BOTTOM_CM = 0.02
_NEAR_CM = 0.3
_FLAT_DEG = 3.0


def without_repeats(config: Config, log: Log) -> Log:
    """Leave out the rows in which a slow transducer says the same again, if the config asks for it.

    `log`: Force log. Returns what was left out is counted.
    """
    if config.transducer.repeats == "keep":
        return log
    channels = np.stack([log.columns[name] for name in ("F1", "F2", "F3")])
    return log.take(new_readings(channels), REPEATED)


def find_clock(
    config: Config,
    run: Run,
    time: FloatArray,
    line: FloatArray | None,
    lift: FloatArray,
    motion: Motion,
    usable: np.ndarray | None = None,
    spans: FloatArray | None = None,
) -> tuple[ClockFit, Alignment | None]:
    """Bring the clocks of force and motion log together.

    `config`: Its ``clock`` says how. `time`: shape (n,); Of the force log, s. `line`: shape (n,);
    Its sync line, if it has one. `lift`: shape (n,); Vertical force, zero not yet removed, N.
    `usable`: shape (n,); Which samples may be believed; all if not given. `spans`: shape (k, 2);
    From `Motion.spans`, where it was called already. Returns `alignment`: What it was estimated
    from, where it was.
    """
    method = config.clock.method
    if method == "same_clock":
        return ClockFit(0.0, 0.0, 0.0, 0.0, 0), None
    if method == "estimate":
        if run.direction != "intrusion" or run.gamma_deg != 90:
            raise ClockError(
                f"clock.method estimate: found a run in direction {run.direction} along gamma "
                f"{run.gamma_deg:g} deg; allowed: intrusion straight down, where the force grows with "
                "depth. Others need a sync line or one clock"
            )
        good = slice(None) if usable is None else usable
        alignment = estimate_clocks(
            time[good],
            lift[good],
            motion.time,
            -motion.z,
            config.clock.max_drift,
            config.clock.max_se_s,
        )
        return alignment.clock(), alignment
    if line is None:
        raise ClockError(
            "the force log has no column arm_moving; clock.method sync_line needs it, allowed "
            "without: estimate, same_clock"
        )
    spans = motion.spans(config.arm) if spans is None else spans
    seen = whole_spans(moving_spans(time, line, 0.5), float(time[0]), float(time[-1]))
    # the speed is known from the second sample to the last but one; no spans in fewer than three
    done = whole_spans(spans, *motion.time[[1, -2]]) if len(spans) else spans
    return align(seen, done, config.clock.max_residual_s), None


def place_surface(
    config: Config,
    run: Run,
    motion: Motion,
    on_motion: FloatArray,
    lift: FloatArray,
    clock_se_s: float,
) -> tuple[Motion, Surface | None]:
    """Count z from the free surface that the force shows, where the config asks for that.

    `on_motion`: shape (n,); Times of the force log's samples on the motion log's clock, s. `lift`:
    shape (n,); Vertical force, zero not yet removed, N. `clock_se_s`: Standard error of the
    clocks' offset: it moves the surface by as far as the arm went in it. Returns `motion`: With z
    = 0 at the surface. Returns `surface`: As found; its depth is counted from the zero that
    `motion` had.
    """
    if config.surface.method == "given" or run.surface_z_mm is not None:
        return motion, None
    plate = config.intruders[run.intruder]
    flat = run.kind == "plate" and abs(run.beta_deg) <= _FLAT_DEG
    if run.direction != "intrusion" or plate.shape == "leg" or not flat:
        raise StrokeError(
            "no_surface",
            "surface.method find works for flat plates pushed down, which meet the surface all at "
            f"once (beta within {_FLAT_DEG:g} deg of 0); this run needs surface_z_mm",
        )
    inside = (on_motion >= motion.time[0]) & (on_motion <= motion.time[-1])
    depth = -motion.at(on_motion[inside])[1]
    try:
        window, noise = config.surface.window_cm, config.transducer.precision_N
        toe = plate.thickness_cm / 2
        surface = find_surface(depth, lift[inside], window, noise, 0.0, toe)
        if clock_se_s > 0:
            near = np.abs(depth - surface.depth_cm) < _NEAR_CM
            speed = np.abs(np.gradient(depth, on_motion[inside]))[near].mean()
            surface = find_surface(
                depth, lift[inside], window, noise, float(speed) * clock_se_s, toe
            )
    except SurfaceError as error:
        raise StrokeError("no_surface", str(error)) from error
    if surface.se_cm > config.surface.max_se_cm:
        raise StrokeError(
            "no_surface",
            f"surface not found well enough: its standard error is {surface.se_cm:.2f} cm; allowed: "
            f"{config.surface.max_se_cm:g} cm",
        )
    return replace(motion, z=motion.z + surface.depth_cm), surface


def stroke_of(config: Config, run: Run, motion: Motion, spans: FloatArray) -> tuple[float, float]:
    """Find the stroke of a run.

    `motion`: With z = 0 at the surface. `spans`: shape (k, 2); Stretches of motion, s. Returns
    `start`, `end`: s, on the motion log's clock.
    """
    straight = run.direction == "intrusion" and run.gamma_deg == 90
    if config.arm.drive == "steady" or not straight:
        return find_stroke(motion, spans, run, config.arm)
    lowest = float(motion.z.min())
    above = np.flatnonzero(motion.z > 0)
    if lowest > -5 * _BOTTOM_CM or not above.size:
        raise StrokeError(
            "surface_not_reached",
            f"the path from {motion.z.max():+.2f} to {lowest:+.2f} cm does not cross the surface",
        )
    end = int(np.argmax(motion.z <= lowest + _BOTTOM_CM))
    before = above[above < end]
    if not before.size:
        raise StrokeError("wrong_path", "the arm log begins below the surface")
    return float(motion.time[before[-1]]), float(motion.time[end])


# --- One run from its two logs to a trace in the lab frame.


PHASES = ("air", "approach", "pause", "stroke", "other")
_WHY_OF_PHASE = np.array(
    [Why.GOOD, Why.APPROACH, Why.PAUSE, Why.GOOD, Why.ELSEWHERE], dtype=np.int8
)
_NEAR_FULL_RANGE = 0.995


@dataclass(frozen=True)
class Trace:
    """One run in the lab frame, on the force log's clock; arrays of shape (n,).

    `time`: s.
    `phase`: Index into `PHASES`.
    `x`, `z`: Reference point of the intruder, cm.
    `angle`: beta or theta, rad.
    `force`: shape (2, n); z, x; N; zero removed.
    `why`: `Why` a row must not be used; GOOD where it may.
    `zero_variance`: shape (2,); N^2.
    `flags`: Remarks that do not stop the run.
    `rows`: Data lines of force and motion log.
    `alignment`: What the clocks were estimated from, where they were.
    `surface`: The free surface as found, where it was looked for.
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

    `pair`: Its logs as read. `ledger`: Is added to. `compliance`: How far the machine yields under
    load.
    """
    # a line that holds force and motion is counted once, by what became of its force
    once = one_table(config, run) and pair.force.rows == pair.motion.rows
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
            _account(ledger, run, force_log, None if once else pair.motion, trace)
            return trace
    reason = "; ".join(problems)
    _account_refused(ledger, run, run.force_log, pair.force, reason)
    if not once:
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

    Returns `force` of shape (2, n): z, x; N; zero not removed. Returns `time` of shape (n,): s.
    Returns `line` of shape (n,): The sync line.
    """
    channels, time, line = _channels(config, log)
    return (sensor_to_lab(config.transducer) @ channels)[::-1], time, line


def read_motion(config: Config, run: Run, log: Log) -> Motion:
    """Turn a motion log into the lab frame.

    `run`: Its ``surface_z_mm`` goes before the arm's.
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


def _damage(force: Log, motion: Log) -> tuple[str, ...]:
    """Name the rows that were lost from each log, and why."""
    parts = (" (force)", " (motion)") if force.path == motion.path else ("", "")
    names = force.path.name + parts[0], motion.path.name + parts[1]
    return tuple(
        f"{count} rows of {name}: {reason}"
        for log, name in zip((force, motion), names, strict=True)
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


def _account(ledger: Ledger, run: Run, force: Log, motion: Log | None, trace: Trace) -> None:
    """Put everything but the stroke's own rows into the ledger; no motion log: of one table."""
    _account_left_out(ledger, run, run.force_log, force)
    if motion is not None:
        _account_left_out(ledger, run, run.motion_log, motion)
        path = f"path; {trace.note}" if trace.note else "path"
        ledger.add(run, run.motion_log, USED, path, motion.size)
    outside = _WHY_OF_PHASE[trace.phase]
    outside = np.where(trace.why == Why.GOOD, outside, trace.why)
    handed_on = (trace.phase == PHASES.index("stroke")) & (trace.why == Why.GOOD)
    ledger.add_rows(run, run.force_log, outside[~handed_on], "zero of the transducer")


def _account_left_out(ledger: Ledger, run: Run, file: str, log: Log) -> None:
    """Put damaged lines into the ledger, and what the instrument counted and the file lacks."""
    for fate, counts in ((DROPPED, log.dropped), (LOST, log.missing)):
        for reason, rows in counts.items():
            ledger.add(run, file, fate, reason, rows)


def _account_refused(ledger: Ledger, run: Run, file: str, log: Log | LogError, reason: str) -> None:
    ledger.add(run, file, DROPPED, reason, log.rows if isinstance(log, LogError) else log.size)
    if isinstance(log, Log):
        _account_left_out(ledger, run, file, log)


# --- The campaign's push against something rigid, read and turned into a curve.


def find_compliance(campaign: Campaign, like: Run) -> Compliance:
    """Read the push against something rigid that the config names.

    `like`: Any run of the campaign: what its logs look like, the rigid push's do too.
    """
    config = campaign.config
    named = config.rigid_contact
    assert named is not None
    run = replace(
        like, run_id="rigid contact", direction="intrusion", force_log=named.force_log,
        motion_log=named.motion_log, surface_z_mm=None, gamma_deg=90.0,
    )  # fmt: skip
    (_, pair), *_ = load_pairs(campaign, [run])
    if not isinstance(pair.force, Log) or not isinstance(pair.motion, Log):
        raise InputError(f"rigid_contact: {'; '.join(pair.problems)}")
    try:
        lift, time, line = read_force(config, without_repeats(config, pair.force))
        motion = read_motion(config, run, pair.motion)
        clock, _ = find_clock(config, run, time, line, lift[0], motion)
        on_motion = clock.motion_time(time)
        inside = (on_motion >= motion.time[0]) & (on_motion <= motion.time[-1])
        depth = -motion.at(on_motion[inside])[1]
        return compliance_of(depth, lift[0][inside], config.transducer.precision_N)
    except ValueError as error:
        raise InputError(f"rigid_contact, {named.force_log}: {error}") from error
