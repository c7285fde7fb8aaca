"""The logs of a medium as traces in the lab frame: one clock, zero removed, every row accounted for."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config, Transducer
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.logs.base import Log, LogError
from rftfit.logs.text import OF_CELLS
from rftfit.measure.alignment import Alignment, estimate_clocks, new_readings
from rftfit.measure.clocks import HOUR_S, ClockFit, align, moving_spans, whole_spans
from rftfit.measure.flags import (
    FLAGS,
    REASON,
    REPEATED,
    Refused,
    Remark,
    dropped_rows,
    flag_columns,
    quoted,
    reason_columns,
    remark,
    say,
)
from rftfit.measure.ledger import DROPPED, LOST, USED, Ledger, RowStatus
from rftfit.measure.pairs import (
    ANGLE_TO_RAD,
    FORCE_TO_N,
    LENGTH_TO_CM,
    TIME_TO_S,
    Pair,
    factor,
    gaps,
    load_pairs,
    readers,
    same_table,
)
from rftfit.measure.slopes import GIVEN_DOF
from rftfit.measure.strokes import IntruderPath, find_stroke, join_runs
from rftfit.measure.surface import Compliance, Surface, compliance_of, find_surface
from rftfit.measure.zero import Zero, find_zero, height_needed, zero_of_log

PHASES = ("air", "approach", "pause", "stroke", "other")
_AIR, _APPROACH, _PAUSE, _STROKE, _OTHER = range(len(PHASES))
_STATUS_OF_PHASE = np.array(
    [RowStatus.GOOD, RowStatus.APPROACH, RowStatus.PAUSE, RowStatus.GOOD, RowStatus.ELSEWHERE],
    dtype=np.int8,
)
_MOST_REPEATED = 1 / 3
_CHANNELS = ("F1", "F2", "F3")
_NEAR_FULL_RANGE = 0.995
_NEAR_SURFACE_CM = 0.3
_FLAT_DEG = 3.0
_PAUSE_CM = 0.2
_RAMP_S = 0.1
_FEWEST_QUIET = 50

SAMPLE_COLUMNS = (
    "time_s", "phase", "x_cm", "depth_cm", "angle_deg", "force_z_N", "force_x_N", "why"
)  # fmt: skip
"""Columns of the table of samples, beside the run."""

RUN_COLUMNS: dict[str, object] = {
    **dict.fromkeys(("run_id", "kind", "status", *REASON, *FLAGS, "note",
         "readings"), ""),
    **dict.fromkeys(("rows_force", "rows_motion"), 0),
    **dict.fromkeys(
        ("sample_step_s", "clock_offset_s", "clock_residual_s", "clock_se_s", "zero_var_z_N2",
         "zero_var_x_N2", "zero_dof", "zero_trend_z_N", "zero_trend_x_N", "clock_hours", "clock_rest_s", "clock_drift",
         "clock_drift_se", "clock_explained", "surface_z_mm", "surface_se_mm",
         "surface_growth_N_per_cm",
         *(f"{channel}_{fact}" for channel in _CHANNELS for fact in ("low_N", "high_N", "held_N", "held", "noise_N"))),
        np.nan,
    ),
}  # fmt: skip
"""Columns of the table of runs, and what stands where nothing is known."""


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


@dataclass(frozen=True)
class Trace:
    """One run in the lab frame, on the force log's clock; arrays of shape (n,).

    `time` in s; `x`, `z` of the intruder's reference point in cm; `angle` (beta or theta) in rad;
    `force` (2, n) as z, x in N, its zero removed; `zero_variance` (2,) in N^2, `zero_trend` (2,) in N:
    of `Zero`. `phase` is an index into
    `PHASES`, `why` a `RowStatus`, `rows` the data lines of force and motion log. `flags` do not stop the
    run; `alignment` and `surface` are there where they were looked for; `channels`: `_channel_facts`.
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
    zero_trend: tuple[float, float]
    clock: ClockFit
    flags: tuple[Remark, ...]
    rows: tuple[int, int]
    alignment: Alignment | None = None
    surface: Surface | None = None
    channels: dict[str, object] = field(default_factory=dict)

    @property
    def note(self) -> tuple[Remark, ...]:
        """What was put right and touches no number, but should be known."""
        hours = self.clock.whole_hours
        return (remark("clock-hours", hours=hours),) if hours else ()

    @property
    def step_s(self) -> float:
        """Mean step between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


class RunRefused(ValueError):
    """A run that gives no trace, and the reasons."""

    def __init__(self, reasons: Sequence[Remark]) -> None:
        super().__init__(say(reasons))
        self.reasons = reasons


def ingest_medium(campaign: Campaign, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Read all logs of a medium, keeping what is wrong with the bad ones.

    Returns a row per force sample; a row per run: status, reason, flags, clock and zero; the rows of
    all logs but the good ones of the strokes.
    """
    traces, rows, ledger = ingest_traces(campaign, medium)
    return samples_of(traces), pd.DataFrame(rows, columns=list(RUN_COLUMNS)), ledger


def ingest_traces(
    campaign: Campaign, medium: str
) -> tuple[list[Trace], list[dict[str, object]], Ledger]:
    """As `ingest_medium`, with the traces and what their clocks and surfaces were estimated from."""
    ledger = Ledger()
    traces: list[Trace] = []
    rows: list[dict[str, object]] = []
    config = campaign.config
    runs = campaign.runs_of(medium)
    compliance: Compliance | InputError | None = None
    if config.rigid_contact and runs:
        try:
            compliance = find_compliance(campaign, runs[0])
        except InputError as error:
            compliance = error
    for run, pair in load_pairs(campaign, runs):
        try:
            trace = ingest_run(config, run, pair, ledger, compliance)
        except RunRefused as refusal:
            refused = {"run_id": run.run_id, "kind": run.kind, "status": "refused"}
            rows.append(RUN_COLUMNS | refused | reason_columns(refusal.reasons))
        else:
            traces.append(trace)
            rows.append(_run_row(config, run, trace))
    return traces, rows, ledger


def _run_row(config: Config, run: Run, trace: Trace) -> dict[str, object]:
    clock, step = trace.clock, trace.step_s
    row = {
        "run_id": run.run_id, "kind": run.kind, "status": "read", **flag_columns(trace.flags),
        "note": say(trace.note), "rows_force": trace.rows[0], "rows_motion": trace.rows[1],
        "sample_step_s": step, "clock_offset_s": clock.offset_s,
        "clock_residual_s": clock.residual_s, "clock_se_s": clock.offset_se(step),
        "zero_var_z_N2": trace.zero_variance[0], "zero_var_x_N2": trace.zero_variance[1],
        "zero_dof": trace.zero_dof, "zero_trend_z_N": trace.zero_trend[0],
        "zero_trend_x_N": trace.zero_trend[1],
    }  # fmt: skip
    if (found := trace.alignment) is not None:
        hours = clock.whole_hours
        # in a table of six digits hours would hide the rest
        row |= {
            "clock_hours": hours, "clock_rest_s": clock.offset_s - HOUR_S * hours,
            "clock_drift": clock.drift, "clock_drift_se": found.drift_se,
            "clock_explained": found.explained,
        }  # fmt: skip
    if (surface := trace.surface) is not None:
        row |= {
            "surface_z_mm": config.arm.surface_z_mm - 10 * surface.depth_cm,
            "surface_se_mm": 10 * surface.se_cm,
            "surface_growth_N_per_cm": surface.growth_N_per_cm,
        }
    return RUN_COLUMNS | row | trace.channels


def samples_of(traces: list[Trace]) -> pd.DataFrame:
    """Put the samples of all runs into one long table."""
    return samples_table({
        one.run.run_id: (
            one.time, one.phase, one.x, -one.z, np.degrees(one.angle), *one.force, one.why
        )
        for one in traces
    })  # fmt: skip


def samples_table(runs: Mapping[str, Sequence[np.ndarray]]) -> pd.DataFrame:
    """Put the columns of some runs, in the order of `SAMPLE_COLUMNS`, into one long table."""
    parts = {name: dict(zip(SAMPLE_COLUMNS, run, strict=True)) for name, run in runs.items()}
    samples = join_runs(parts, SAMPLE_COLUMNS)
    codes = samples["phase"].to_numpy(int)
    samples["phase"] = pd.Categorical.from_codes(codes, categories=pd.Index(PHASES))
    return samples


def ingest_run(
    config: Config,
    run: Run,
    pair: Pair,
    ledger: Ledger,
    compliance: Compliance | InputError | None = None,
) -> Trace:
    """Align the two logs of a run and turn them into the lab frame.

    Rows that go no further are put into the ledger here; the good ones of the stroke are left to
    the stages that use them. `compliance` says how far the machine yields under load, or why that is
    not known.
    """
    # a line that holds force and motion is counted once, by what became of its force
    once = same_table(config, run) and pair.force.rows == pair.motion.rows
    reasons = [remark("excluded", why=run.reason)] if run.excluded else pair.problems
    if not reasons and isinstance(compliance, InputError):
        reasons = [quoted(compliance, "rigid-contact")]
    if not reasons:
        assert not isinstance(compliance, InputError)
        assert isinstance(pair.force, Log)
        assert isinstance(pair.motion, Log)
        force_log = without_repeats(config, pair.force)
        try:
            trace = _make_trace(config, run, force_log, pair.motion, compliance, pair.zero)
        except ValueError as error:
            reasons = [quoted(error)]
        else:
            _account(ledger, run, force_log, None if once else pair.motion, trace)
            return trace
    _account_refused(ledger, run, run.force_log, pair.force, reasons)
    if not once:
        _account_refused(ledger, run, run.motion_log, pair.motion, reasons)
    raise RunRefused(reasons)


def _make_trace(
    config: Config,
    run: Run,
    force_log: Log,
    motion_log: Log,
    compliance: Compliance | None,
    zero_log: Log | LogError | None,
) -> Trace:
    readings = read_force(config, force_log)
    motion = read_motion(config, run, motion_log)
    spans = motion.spans(config.arm)
    clock, alignment = find_clock(config, run, readings, motion, spans)
    time = clock.motion_time(readings.time)
    usable = ~readings.saturated
    motion, surface = place_surface(
        config, run, motion, time[usable], readings.force[0, usable], clock.se_s or 0.0
    )
    start, end = find_stroke(motion, spans, run, config.arm)
    in_stroke = (time >= start) & (time <= end)
    if not in_stroke.any():
        raise Refused("no-force-in-stroke")
    x, z, angle = motion.at(time)
    why = _row_status(config, motion, time, readings.saturated)
    moving = _within(time, spans)
    intruder = config.intruders[run.intruder]
    in_air = z >= height_needed(intruder, angle, config.fit.air_clearance_cm)
    drift = config.transducer.drift_N_per_min
    zero: Zero | None
    if isinstance(zero_log, Log):
        unloaded = read_force(config, zero_log).force
        zero = zero_of_log(unloaded, drift, config.zero.log_age_min)
    elif config.zero.method == "stated":
        zero = _stated_zero(config)
    else:
        resting = in_air & (why == RowStatus.GOOD) & ~in_stroke
        middle = float(readings.time[in_stroke].mean())
        zero = find_zero(readings.time, readings.force, resting, moving, middle, drift)
    if zero is None:
        raise Refused("no-zero")
    # no rest shows what moves the zero back and forth between it and the stroke
    zero = replace(zero, variance=zero.variance + config.transducer.slow_noise_N**2)
    force = readings.force - zero.force
    if compliance is not None:
        travel, known = compliance.at(force[0])
        z = z + travel
        why[~known & (why == RowStatus.GOOD)] = RowStatus.YIELDED
    phase = np.full(time.size, _OTHER)
    if zero_log is None and config.zero.method == "air":
        phase[in_air & ~moving] = _AIR
    phase[~in_air & ~moving & (np.abs(z) < _PAUSE_CM)] = _PAUSE
    phase[moving & (time < start)] = _APPROACH
    phase[in_stroke] = _STROKE

    missing = max(float(end - time[-1]), float(time[0] - start))
    flags = _damage(config, run, force_log, motion_log)
    flags += _flags(config, readings.time[in_stroke], missing, zero.drift_N)
    cut = start <= motion.time[1] or end >= motion.time[-2]
    # a log that begins in air should also end after the stroke; others hold nothing but the stroke
    if cut and config.zero.method == "air" and zero_log is None:
        flags.append(remark("motion-log-cut"))
    flags += _repeating(run, ~new_readings(readings.channels)[in_stroke])
    stuck = int(np.count_nonzero(readings.saturated & in_stroke))
    if stuck:
        flags.append(remark("stroke-saturated", count=stuck))
    return Trace(
        run, readings.time, phase, x, z, angle, force, why,
        zero.variance, zero.dof, zero.trend_N, clock, tuple(flags), (force_log.rows, motion_log.rows),
        alignment, surface, _channel_facts(readings.channels, in_stroke),
    )  # fmt: skip


def readings_digest(readings: FloatArray) -> str:
    """Return what is equal in copies of a run, and in nothing else."""
    return hashlib.sha256(readings.tobytes()).hexdigest()[:16]


def _channel_facts(channels: FloatArray, in_stroke: np.ndarray) -> dict[str, object]:
    """What each channel does in the stroke, its noise before and after it, and a digest of all readings."""
    moves = bool(np.ptp(channels, axis=1).any())
    facts: dict[str, object] = {"readings": readings_digest(channels) if moves else ""}
    for name, readings in zip(_CHANNELS, channels, strict=True):
        values = readings[in_stroke]
        changes = np.flatnonzero(values[1:] != values[:-1]) + 1
        starts = np.concatenate([[0], changes, [values.size]])
        lengths = starts[1:] - starts[:-1]
        longest = int(lengths.argmax())
        facts |= {
            f"{name}_low_N": values.min(), f"{name}_high_N": values.max(),
            f"{name}_held_N": values[starts[longest]],
            f"{name}_held": lengths[longest] / values.size,
            f"{name}_noise_N": _noise(readings[~in_stroke]),
        }  # fmt: skip
    return facts


def _noise(readings: FloatArray) -> float:
    """Standard deviation of readings from sample to sample, by second differences, jumps left out."""
    steps = np.sort(np.abs(np.diff(readings, 2)))
    if steps.size < _FEWEST_QUIET:
        return math.nan
    # of a normal number the smaller nine tenths have 0.789 of the root mean square of all
    inner = steps[: round(0.9 * steps.size)]
    return float(np.sqrt(np.mean(inner**2))) / (0.789 * math.sqrt(6))


def _stated_zero(config: Config) -> Zero:
    """The zero that the config states, the same in every run."""
    stated = config.zero
    force = (sensor_to_lab(config.transducer) @ np.array(stated.readings_N))[::-1]
    variance = np.full(2, (stated.sd_N or 0.0) ** 2)
    return Zero(force[:, None], variance, GIVEN_DOF, math.nan)


def sensor_to_lab(transducer: Transducer) -> FloatArray:
    """Matrix (2, 3) that turns the channels (F1, F2, F3) into the lab's (force_x, force_z).

    The signed axes of the transducer say which channel lies along which axis of its mount; the mount
    is turned by ``turn_deg`` about y, from z toward x.
    """
    mount = np.zeros((3, 3))
    for row, channel in enumerate((transducer.axes.x, transducer.axes.y, transducer.axes.z)):
        mount[row, _CHANNELS.index(channel[1:])] = 1.0 if channel[0] == "+" else -1.0
    turn = math.radians(transducer.turn_deg)
    about_y = np.array(
        [[math.cos(turn), 0.0, math.sin(turn)], [-math.sin(turn), 0.0, math.cos(turn)]]
    )
    return np.asarray(about_y @ mount)


def read_force(config: Config, log: Log) -> ForceReadings:
    """Turn a force log into the lab frame."""
    name, unit = log.path.name, config.transducer.force_unit
    channels = np.stack([log.columns[channel] for channel in _CHANNELS])
    for index, channel in enumerate(_CHANNELS):
        channels[index] *= factor(FORCE_TO_N, log.units[channel], unit, f"{name}: {channel}")
    time = log.columns["time"] * factor(TIME_TO_S, log.units["time"], "s", f"{name}: time")
    limits = np.array(config.transducer.range_N)[:, None]
    saturated = np.asarray((np.abs(channels) >= _NEAR_FULL_RANGE * limits).any(axis=0))
    force = (sensor_to_lab(config.transducer) @ channels)[::-1]
    return ForceReadings(time, force, log.columns.get("arm_moving"), saturated, channels)


def read_motion(config: Config, run: Run, log: Log) -> IntruderPath:
    """Turn a motion log into the lab frame; a run's own ``surface_z_mm`` goes before the arm's."""

    def column(quantity: str, table: dict[str, float], unit: str) -> FloatArray:
        what = f"{log.path.name}: {quantity}"
        return log.columns[quantity] * factor(table, log.units[quantity], unit, what)

    unit = config.arm.position_unit
    surface_mm = config.arm.surface_z_mm if run.surface_z_mm is None else run.surface_z_mm
    x, z = (column(quantity, LENGTH_TO_CM, unit) for quantity in ("x", "z"))
    angle = column("angle", ANGLE_TO_RAD, "deg")
    x -= config.arm.middle_x_mm / 10
    return IntruderPath(column("time", TIME_TO_S, "s"), x, z - surface_mm / 10, angle)


def without_repeats(config: Config, log: Log) -> Log:
    """Leave out the rows in which a slow transducer says the same again, if the config asks for it."""
    if config.transducer.repeats == "keep":
        return log
    return log.take(new_readings(np.stack([log.columns[name] for name in _CHANNELS])), REPEATED)


def _repeating(run: Run, again: np.ndarray) -> list[Remark]:
    """Notice a logger that writes each reading of a slower transducer several times."""
    # the force of a horizontal run may be steady; of others it grows
    if run.direction == "horizontal" or again.mean() < _MOST_REPEATED:
        return []
    return [remark("readings-repeated", share=again.mean())]


def find_clock(
    config: Config, run: Run, readings: ForceReadings, motion: IntruderPath, spans: FloatArray
) -> tuple[ClockFit, Alignment | None]:
    """Align the clocks of force and motion log in the way the config asks for.

    Returns what they were estimated from, too, where they were. `spans` are those of `motion`.
    """
    method = config.clock.method
    if method == "same_clock":
        return ClockFit(0.0, 0.0, 0.0, 0.0, 0), None
    time = readings.time
    if method == "estimate":
        if run.direction != "intrusion" or run.gamma_deg != 90:
            raise Refused("no-push-to-match", direction=run.direction, gamma=run.gamma_deg)
        good, settings = ~readings.saturated, config.clock
        alignment = estimate_clocks(
            time[good], readings.force[0, good], motion.time, -motion.z,
            settings.max_drift, settings.max_se_s,
        )  # fmt: skip
        return alignment.clock, alignment
    if readings.arm_moving is None:
        raise Refused("no-sync-line")
    seen = moving_spans(time, readings.arm_moving, 0.5)
    seen = whole_spans(seen, float(time[0]), float(time[-1]))
    # the speed is known from the second sample to the last but one; no spans in fewer than three
    done = whole_spans(spans, *motion.time[[1, -2]]) if len(spans) else spans
    return align(seen, done, config.clock.max_residual_s), None


def place_surface(
    config: Config,
    run: Run,
    motion: IntruderPath,
    time: FloatArray,
    lift: FloatArray,
    clock_se_s: float,
) -> tuple[IntruderPath, Surface | None]:
    """Count z from the free surface that the force shows, where the config asks for that.

    `time` (s, on the motion log's clock) and `lift` (N, zero not yet removed) are of the force log;
    `clock_se_s` moves the surface by as far as the arm went in it. The surface as found is counted from
    the zero that `motion` had.
    """
    if config.surface.method == "given" or run.surface_z_mm is not None:
        return motion, None
    plate = config.intruders[run.intruder]
    flat = run.kind == "plate" and abs(run.beta_deg) <= _FLAT_DEG
    if run.direction != "intrusion" or plate.shape == "leg" or not flat:
        raise Refused("surface-not-stated", most=_FLAT_DEG)
    time, depth, lift = _common(motion, time, lift)
    window, noise = config.surface.window_cm, config.transducer.precision_N
    toe = plate.thickness_cm / 2
    surface = find_surface(depth, lift, window, noise, 0.0, toe)
    if clock_se_s > 0:
        near = np.abs(depth - surface.depth_cm) < _NEAR_SURFACE_CM
        speed = float(np.abs(np.gradient(depth, time))[near].mean())
        surface = find_surface(depth, lift, window, noise, speed * clock_se_s, toe)
    if surface.se_cm > config.surface.max_se_cm:
        raise Refused("surface-uncertain", se=surface.se_cm, most=config.surface.max_se_cm)
    return replace(motion, z=motion.z + surface.depth_cm), surface


def find_compliance(campaign: Campaign, like: Run) -> Compliance:
    """Find the compliance of the machine from the push against something rigid that the config names.

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
        raise InputError(f"rigid_contact: {say(pair.problems)}")
    try:
        readings = read_force(config, without_repeats(config, pair.force))
        motion = read_motion(config, run, pair.motion)
        clock, _ = find_clock(config, run, readings, motion, motion.spans(config.arm))
        _, depth, lift = _common(motion, clock.motion_time(readings.time), readings.force[0])
        return compliance_of(depth, lift, config.transducer.precision_N)
    except ValueError as error:
        raise InputError(f"rigid_contact, {named.force_log}: {error}") from error


def _common(
    motion: IntruderPath, time: FloatArray, lift: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time, depth and lift of the force readings that were made while the motion was logged."""
    inside = (time >= motion.time[0]) & (time <= motion.time[-1])
    return time[inside], -motion.at(time[inside])[1], lift[inside]


def _row_status(
    config: Config, motion: IntruderPath, time: FloatArray, saturated: np.ndarray
) -> np.ndarray:
    """`RowStatus` of each force sample, by what the two logs themselves show."""
    why = np.full(time.size, RowStatus.GOOD, dtype=np.int8)
    for start, end in gaps(motion.time, config.clock.max_gap_s):
        why[(time > start) & (time < end)] = RowStatus.MOTION_GAP
    why[(time < motion.time[0]) | (time > motion.time[-1])] = RowStatus.NO_MOTION
    why[saturated] = RowStatus.SATURATED
    return why


def _within(time: FloatArray, spans: FloatArray) -> np.ndarray:
    """Tell which samples lie in a stretch of motion or in its ramps."""
    moving = np.zeros(time.size, dtype=bool)
    first = np.searchsorted(time, spans[:, 0] - _RAMP_S, side="right")
    for begin, stop in zip(first, np.searchsorted(time, spans[:, 1] + _RAMP_S), strict=True):
        moving[begin:stop] = True
    return moving


def _damage(config: Config, run: Run, force: Log, motion: Log) -> list[Remark]:
    """Flag the rows that were lost from each log, and why."""
    lost = [
        {reason: count for reason, count in (*log.dropped.items(), *log.missing.items())
         if reason != REPEATED}
        for log in (force, motion)
    ]  # fmt: skip
    parts = (" (force)", " (motion)") if force.path == motion.path else ("", "")
    flags = []
    for own, other, log, part in zip(lost, lost[::-1], (force, motion), parts, strict=True):
        for reason, count in own.items():
            # of one table a line, unlike a cell, is lost to both logs
            whole = same_table(config, run) and reason not in OF_CELLS
            both = whole and other.get(reason) == count
            file = log.path.name + ("" if both else part)
            code = dropped_rows(reason).code
            flags.append(remark(code, count=count, file=file, why=reason))
    return list(dict.fromkeys(flags))


def _flags(config: Config, stroke_time: FloatArray, missing_s: float, drift: float) -> list[Remark]:
    longest = config.clock.max_gap_s
    flags = []
    missed = np.diff(gaps(stroke_time, longest), axis=1)
    if missed.size == 1:
        flags.append(remark("gap", seconds=missed[0, 0]))
    elif missed.size:
        flags.append(remark("gaps", count=missed.size, seconds=missed.sum(), longest=missed.max()))
    if missing_s > longest:
        flags.append(remark("force-log-short", seconds=missing_s))
    if math.isfinite(drift) and drift > config.transducer.max_drift_N:
        flags.append(remark("zero-drifted", newtons=drift))
    return flags


def _account(ledger: Ledger, run: Run, force: Log, motion: Log | None, trace: Trace) -> None:
    """Put everything but the stroke's own rows into the ledger; no motion log: of one table."""
    _account_left_out(ledger, run, run.force_log, force)
    if motion is not None:
        _account_left_out(ledger, run, run.motion_log, motion)
        ledger.add(run, run.motion_log, USED, motion.size, remark("path"), *trace.note)
    good = trace.why == RowStatus.GOOD
    outside = np.where(good, _STATUS_OF_PHASE[trace.phase], trace.why)
    handed_on = (trace.phase == _STROKE) & good
    ledger.add_rows(run, outside[~handed_on], "zero")


def _account_left_out(ledger: Ledger, run: Run, file: str, log: Log) -> None:
    """Put damaged lines into the ledger, and what the instrument counted and the file lacks."""
    for fate, counts in ((DROPPED, log.dropped), (LOST, log.missing)):
        for reason, rows in counts.items():
            ledger.add(run, file, fate, rows, dropped_rows(reason))


def _account_refused(
    ledger: Ledger, run: Run, file: str, log: Log | LogError, reasons: Sequence[Remark]
) -> None:
    rows = log.rows if isinstance(log, LogError) else log.size
    ledger.add(run, file, DROPPED, rows, *reasons)
    if isinstance(log, Log):
        _account_left_out(ledger, run, file, log)


def account_unclaimed(campaign: Campaign) -> Ledger:
    """Account for in-air runs that no leg names: they belong to no medium and no stage reads them."""
    ledger = Ledger()
    for run in campaign.unclaimed:
        files = [run.force_log, run.motion_log]
        counts = []
        for file, reader in zip(files, readers(campaign), strict=True):
            try:
                counts.append(sum(log.rows for log in reader.stream(campaign.raw / file)))
            except LogError as error:
                counts.append(error.rows)
        if same_table(campaign.config, run) and counts[0] == counts[1]:
            counts.pop()
        for file, rows in zip(files, counts, strict=False):
            ledger.add(run, file, DROPPED, rows, remark("unclaimed"))
    return ledger
