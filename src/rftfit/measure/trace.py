"""Make the trace of one run: lab frame, one clock for both logs, depth below the surface, phases, zero removed.

`trace_run` turns a force log and a motion log into a `Trace`, in this order: forces and path in the lab frame; the
clock that gives each force sample a time of the motion log; the free surface, from which z is counted; the *stroke*
(the motion that is measured: a push, a pull, a turn of a leg); the *zero* (what the transducer reads while the whole
intruder is in air and at rest), subtracted; the phase of each sample (`PHASES`: air, approach, pause, stroke, other);
flags of doubts.

Arrays of shape (n,) have an element for each sample of the force log, and forces are z, then x, N, shape (2, n): of the
medium on the intruder, with the force on its rod. x, z: cm, z upward from the surface. Masks are bool, shape (n,).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from rftfit.campaign.config import Config
from rftfit.campaign.sheet import Run
from rftfit.campaign.spikes import find_plateau, find_steps, may_step
from rftfit.conventions import BoolArray, FloatArray, IndexArray
from rftfit.logs.base import Log, LogError
from rftfit.logs.quantities import epoch_unit
from rftfit.measure import lab_frame
from rftfit.measure.clocks import LONGEST_RAMP_S, ClockFit
from rftfit.measure.flags import (
    ON_ARRIVAL,
    REPEATED,
    SET_BACK,
    Refused,
    Remark,
    dropped_rows,
    remark,
)
from rftfit.measure.ledger import RowStatus, StatusArray
from rftfit.measure.read import same_table
from rftfit.measure.readings import AWAY_S, USUAL_STEPS, find_holds, gaps, rows_within
from rftfit.measure.samples import PHASES
from rftfit.measure.session_clocks import SessionClocks, find_clock, flags_of_clock
from rftfit.measure.strokes import IntruderPath, find_stroke
from rftfit.measure.surface import Compliance, Surface, place_surface
from rftfit.store.chosen import chosen
from rftfit.table.parse import BLANK, OF_CELLS, OTHER_SOURCE
from rftfit.table.stamps import DAY_S


def trace_run(
    config: Config,
    run: Run,
    force_log: Log,
    motion_log: Log,
    zero_log: Log | LogError | None,
    compliance: Compliance | None,
    clocks: SessionClocks | None,
) -> Trace:
    """Turn the logs of a run into its trace; raise `Refused` or ValueError if this is not possible.

    `force_log`, `motion_log`: Cleaned logs with the columns time, F1, F2, F3 and time, x, z, angle.
    `zero_log`: Log recorded without load, if the run has one.
    `compliance`: Yield of the machine under load; None: it does not yield.
    `clocks`: Clocks of the sessions, where the config asks to estimate them from forces; None: the clock of the run
    comes from its own two logs.
    """
    readings = lab_frame.force_in_lab_frame(force_log, config.transducer)
    path = lab_frame.path_in_lab_frame(motion_log, run, config.arm)
    spans = path.spans(config.arm)
    clock = find_clock(config.clock, run, readings, path, spans, clocks)
    time = clock.motion_time(readings.time)
    moving = _mark_motion(time, spans)
    # near the ends of a motion the arm is slow, and a constant force is no end of the amplifier
    at_full_speed = _mark_motion(time, spans, -LONGEST_RAMP_S)
    readings, amplifier_flags = _mark_end_of_amplifier(run, readings, at_full_speed)
    good = ~readings.saturated
    # from here on z is counted from the surface, also where the force shows it
    path, surface = place_surface(
        config, run, path, time[good], readings.force[0, good], clock.se_s or 0.0
    )
    start, end = find_stroke(path, spans, run, config.arm)
    in_stroke = (time >= start) & (time <= end)
    if not in_stroke.any():
        raise Refused("no-force-in-stroke")
    x, z, angle = path.pose_at(time)
    # height of the reference point at which the whole intruder is in air
    clear_cm = lab_frame.height_needed(
        config.intruders[run.intruder], angle, config.fit.air_clearance_cm
    )
    in_air = z >= clear_cm
    why = _row_status(time, path, readings.saturated, config.clock.max_gap_s)
    at_rest = in_air & ~moving & ~in_stroke & (why == RowStatus.GOOD)
    step_flags, has_other_zero = _find_steps(readings, in_stroke, in_air)
    if has_other_zero.any():
        why[at_rest & has_other_zero] = RowStatus.OTHER_ZERO
        at_rest = _rest_of_zero(readings.time, at_rest, in_air & ~in_stroke, has_other_zero)
    # the zero: of its own log, of the config, or of the rests in air of this run
    middle_s = float(readings.time[in_stroke].mean())
    zero_log_flags: list[Remark] = []
    if isinstance(zero_log, Log):
        zero, zero_log_flags = _zero_of_log(config, zero_log, force_log, middle_s)
    elif config.zero.method == "stated":
        zero = lab_frame.stated_zero(config.zero, config.transducer)
    else:
        drift, least_cm = config.transducer.drift_N_per_min, float(clear_cm.min())
        zero = lab_frame.find_zero(
            readings.time, readings.force, at_rest, middle_s, drift, least_cm
        )
    # a slow noise of the zero between rest and stroke does not show in the rest
    zero = replace(zero, variance=zero.variance + config.transducer.slow_noise_N**2)
    force = readings.force - zero.force
    if compliance is not None:
        # under load the machine yields, so the intruder stays higher than the motion log says
        travel, is_measured = compliance.travel_at(force[0])
        z = z + travel
        why[~is_measured & (why == RowStatus.GOOD)] = RowStatus.YIELDED
    # a log whose zero comes from another log or from the config need not hold a rest in air
    rests_in_air = config.zero.method == "air" and zero_log is None
    phase = np.full(time.size, _OTHER)
    phase[in_air & ~moving & rests_in_air] = _AIR
    phase[~in_air & ~moving & (np.abs(z) < _CHOSEN.pause_cm)] = _PAUSE
    phase[moving & (time < start)] = _APPROACH
    phase[in_stroke] = _STROKE
    hold_s, hold_flags = _position_in_steps(path, start, end)
    flags = [
        *flags_of_clock(run, clocks),
        *hold_flags,
        *amplifier_flags,
        *step_flags,
        *zero_log_flags,
        *_flag_lost_rows(force_log, motion_log, whole_lines=same_table(config, run)),
        *_flag_doubts(config, run, readings, zero, in_stroke, max(end - time[-1], time[0] - start)),
    ]
    # a log that begins in air should also end after the stroke
    if rests_in_air and (start <= path.time[1] or end >= path.time[-2]):
        flags.append(remark("motion-log-cut"))
    return Trace(
        run,
        readings.time,
        phase=phase,
        x=x,
        z=z,
        angle=angle,
        force=force,
        why=why,
        zero=zero,
        clock=clock,
        flags=tuple(flags),
        rows=(force_log.rows, motion_log.rows),
        surface=surface,
        channels=lab_frame.channel_facts(readings.channels, in_stroke),
        hold_s=hold_s,
    )


@dataclass(frozen=True)
class Trace:
    """One run in the lab frame, on the force log's clock; arrays of shape (n,).

    `time`: s.
    `phase`: Index into `PHASES`.
    `x`, `z`: Reference point of the intruder (centre of a plate, axle of a leg), cm; z 0 at the free surface.
    `angle`: Beta of a plate or theta of a leg, rad.
    `force`: z and x, N, shape (2, n), with `zero` removed.
    `why`: `RowStatus` of each sample: GOOD, or why it must not be used.
    `clock`: Offset and drift that turned `time` into times of the motion log.
    `flags`: Doubts that do not stop the run.
    `rows`: Numbers of data lines of force and motion log, for the ledger.
    `surface`: Free surface, if it was found from the force; None where it is given.
    `channels`: Columns of the table of runs about F1, F2 and F3, from `channel_facts`.
    `hold_s`: Time for which the motion log repeats a position while the arm moves, s; 0 where its steps are small.
    """

    run: Run
    time: FloatArray
    phase: IndexArray
    x: FloatArray
    z: FloatArray
    angle: FloatArray
    force: FloatArray
    why: StatusArray
    zero: lab_frame.Zero
    clock: ClockFit
    flags: tuple[Remark, ...]
    rows: tuple[int, int]
    surface: Surface | None = None
    channels: dict[str, object] = field(default_factory=dict)
    hold_s: float = 0.0

    @property
    def note(self) -> tuple[Remark, ...]:
        """Corrections that change no number but should be known: whole hours between the clocks."""
        hours = self.clock.whole_hours
        return (remark("clock-hours", hours=hours),) if hours else ()

    @property
    def step_s(self) -> float:
        """Mean step between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


_AIR, _APPROACH, _PAUSE, _STROKE, _OTHER = range(len(PHASES))
# limits and shares that were chosen by hand: `measure/chosen.toml`, table `trace`, says what each decides
_CHOSEN = chosen("measure", "trace")

HELD_SE: float = _CHOSEN.held_se
"""Standard error of the clock over `Trace.hold_s`: a repeated position is late by an unknown part of that time."""


def _position_in_steps(path: IntruderPath, start: float, end: float) -> tuple[float, list[Remark]]:
    """Return the time for which a position is repeated while the arm moves, s, and its flag; 0 if steps are small.

    Positions in steps come from a coarse sensor, or from a program that reads the arm seldom: these are up to `hold_s`
    late, which shifts all depths. `start`, `end`: Of the stroke, s, on the clock of `path`.
    """
    inside = (path.time >= start) & (path.time <= end)
    # the axis along which the arm moves farther
    position = max(
        path.x[inside],
        path.z[inside],
        key=lambda coordinate: np.ptp(coordinate) if coordinate.size else 0.0,
    )
    holds = find_holds(position)
    if holds.rows < 2 or holds.step < _CHOSEN.least_step_cm:
        return 0.0, []
    hold_s = holds.rows * float(np.median(np.diff(path.time[inside])))
    step_mm = 10 * holds.step
    flag = remark("position-in-steps", rows=holds.rows, step_mm=step_mm, off_mm=step_mm / 2)
    return hold_s, [flag]


def _mark_motion(time: FloatArray, spans: FloatArray, ramp_s: float = LONGEST_RAMP_S) -> BoolArray:
    """Return True for samples in a stretch of motion, made longer by `ramp_s` at both ends (shorter if negative).

    By default that is the longest time in which the arm speeds up or slows down: what lies outside is surely at rest.

    `time`: s, shape (n,), increasing. `spans`: Start and end of each stretch, s, shape (k, 2).
    """
    moving = np.zeros(time.size, dtype=bool)
    first_rows = np.searchsorted(time, spans[:, 0] - ramp_s, side="right")
    stop_rows = np.searchsorted(time, spans[:, 1] + ramp_s)
    for first, stop in zip(first_rows, stop_rows, strict=True):
        moving[first:stop] = True
    return moving


def _row_status(
    time: FloatArray, path: IntruderPath, saturated: BoolArray, max_gap_s: float
) -> StatusArray:
    """Return the `RowStatus` of each force sample: good, in a gap of the motion log, outside of that, or saturated.

    In a gap or outside no position is known, and a saturated reading is no force. Of several reasons the last one
    counts.

    `time`: Times of the samples on the clock of `path`, s. `saturated`: Mask. `max_gap_s`: Longest step of the motion
    log over which a position is interpolated.
    """
    why = np.full(time.size, RowStatus.GOOD, dtype=np.int8)
    for start, end in gaps(path.time, max_gap_s):
        why[(time > start) & (time < end)] = RowStatus.MOTION_GAP
    why[(time < path.time[0]) | (time > path.time[-1])] = RowStatus.NO_MOTION
    why[saturated] = RowStatus.SATURATED
    return why


# --- The zero by another log, recorded without load


def _zero_of_log(
    config: Config, zero_log: Log, force_log: Log, stroke_s: float
) -> tuple[lab_frame.Zero, list[Remark]]:
    """Return the zero of a run from its zero log, and flags if that log is old or its force changes.

    The error of the zero grows with the age of the log, by the drift of the transducer. Raises `Refused` where the log
    is too short. `stroke_s`: Middle of the stroke on the clock of the force log, s.
    """
    unloaded = lab_frame.force_in_lab_frame(zero_log, config.transducer)
    # minutes and words for the flag, or None
    age = _age_of_zero(zero_log, unloaded.time, force_log, stroke_s)
    most_min, file = config.zero.log_age_min, zero_log.path.name
    # of an unknown age the largest allowed one is assumed
    minutes = most_min if age is None else age["minutes"]
    zero = lab_frame.zero_of_log(unloaded.force, config.transducer.drift_N_per_min, minutes)
    flags = []
    if age is not None and minutes > most_min:
        flags.append(remark("zero-log-old", file=file, most=most_min, **age))
    change, times_noise = lab_frame.change_within(unloaded.force)
    if change > config.transducer.max_drift_N and times_noise > chosen("measure", "zero").moves:
        flags.append(remark("zero-log-moves", file=file, newtons=change, times=times_noise))
    return zero, flags


def _age_of_zero(
    zero_log: Log, zero_time: FloatArray, force_log: Log, stroke_s: float
) -> dict[str, Any] | None:
    """Age of the zero of a run, from the middle of its zero log to that of the stroke; None if the logs do not show it.

    Keys: ``minutes``, and ``logged`` and ``pushed``, both times as text, for the sentence ``zero-log-old``. Two clocks
    can be compared where both logs state a date (s since 1970) or both a time of day.

    `zero_time`: Times of the zero log, s, shape (m,). `stroke_s`: Middle of the stroke, s.
    """
    logged_s = float(zero_time.mean())
    between_s = abs(stroke_s - logged_s)
    if epoch_unit(logged_s) == epoch_unit(stroke_s) == "s":
        form = "%Y-%m-%d %H:%M"
    elif "time" in zero_log.clock_times & force_log.clock_times:
        # midnight may lie between the two
        form = "%H:%M"
        between_s = min(between_s % DAY_S, -between_s % DAY_S)
    else:
        return None
    logged, pushed = (
        datetime.fromtimestamp(seconds, UTC).strftime(form) for seconds in (logged_s, stroke_s)
    )
    return {"minutes": between_s / 60, "logged": logged, "pushed": pushed}


# --- Steps and ends of channels


def _mark_end_of_amplifier(
    run: Run, readings: lab_frame.ForceReadings, moving: BoolArray
) -> tuple[lab_frame.ForceReadings, list[Remark]]:
    """Mark readings of a push that stay constant at the end of amplifier or logger as saturated, and flag them.

    The amplifier may end below the range of the transducer: then no single reading looks saturated, but the force,
    which must grow as the intruder goes deeper, stops growing at once. Returns the readings with the new mask, and the
    flags.

    `moving`: True where the arm moves at full speed, shape (n,).
    """
    if run.direction != "intrusion" or run.kind not in ("plate", "leg"):
        # on a level path, in a pull and in air a force may stay constant
        return readings, []
    saturated = readings.saturated.copy()
    flags = []
    rows = np.flatnonzero(moving & ~saturated)
    for name, channel in zip(lab_frame.CHANNELS, readings.channels[:, rows], strict=True):
        if not channel.size:
            continue
        # `find_plateau` wants a force that grows upward
        sign = 1.0 if channel.max() >= -channel.min() else -1.0
        if not (is_at_end := find_plateau(sign * channel)).any():
            continue
        rows_at_end = rows[is_at_end]
        saturated[rows_at_end] = True
        flags.append(
            remark(
                "end-of-amplifier",
                channel=name,
                newtons=float(channel[is_at_end].mean()),
                count=rows_at_end.size,
                when=f"{readings.time[rows_at_end[0]]:.2f} s",
            )
        )
    return (replace(readings, saturated=saturated), flags) if flags else (readings, flags)


def _find_steps(
    readings: lab_frame.ForceReadings, in_stroke: BoolArray, in_air: BoolArray
) -> tuple[list[Remark], BoolArray]:
    """Flag lasting steps of the force, and mark the rows of the force log whose zero is not that of the stroke.

    Somebody who presses tare makes such a step from one reading to the next. One in the stroke is a flag. Before a step
    in air ahead of the stroke the rows have another zero; behind the stroke, the rows from the step on have one.

    `in_stroke`, `in_air`: Masks. Returns flags, and a mask of the rows with another zero, shape (n,).
    """
    time = readings.time
    has_other_zero = np.zeros(time.size, dtype=bool)
    flags: list[Remark] = []
    stepping_channels = may_step(readings.channels)
    if not stepping_channels.size:
        return flags, has_other_zero
    rows = rows_within(time, AWAY_S)
    step_s = (time[-1] - time[0]) / (time.size - 1)
    stroke_start = int(np.argmax(in_stroke))
    for number in stepping_channels:
        for step in find_steps(readings.channels[number], rows):
            row, both_sides = step.row, slice(step.row - 1, step.row + 1)
            # over a gap a force may change by any amount
            if time[row] - time[row - 1] > USUAL_STEPS * step_s:
                continue
            facts: dict[str, Any] = {
                "channel": lab_frame.CHANNELS[number],
                "newtons": step.size,
                "when": f"{time[row]:.2f} s",
            }
            if in_stroke[both_sides].all():
                if not readings.saturated[both_sides].any():
                    flags.append(remark("force-steps", **facts))
            elif in_air[both_sides].all():
                side, first, stop = "before it", 0, row
                if row > stroke_start:
                    side, first, stop = "from it on", row, time.size
                has_other_zero[first:stop] = True
                flags.append(remark("zero-steps", count=stop - first, side=side, **facts))
    return flags, has_other_zero


def _rest_of_zero(
    time: FloatArray, at_rest: BoolArray, in_air: BoolArray, has_other_zero: BoolArray
) -> BoolArray:
    """Mark the rows that show the zero of the stroke: at rest, or also moving in air where the rest is too short.

    All arguments but `time` (s) are masks, shape (n,); rows with another zero are left out in both cases.
    """
    has_rest = np.count_nonzero(at_rest & ~has_other_zero) >= lab_frame.fewest_for_zero(time)
    return np.asarray((at_rest if has_rest else in_air) & ~has_other_zero)


# --- Flags of a trace: doubts that do not stop the run.


_NO_LOSS = (REPEATED, BLANK, OTHER_SOURCE)
"""Reasons to leave out rows that are no loss: such rows hold no new reading, or none that the config asks for."""


def _flag_lost_rows(force: Log, motion: Log, *, whole_lines: bool) -> list[Remark]:
    """Flag the rows that were left out of each log or that it lacks, by reason, and corrections of its times.

    `whole_lines`: True if a line of the file holds both force and motion: a line that is lost to both is named once.
    """
    flags = []
    for log, other, kind in ((force, motion, "force"), (motion, force, "motion")):
        suffix = f" ({kind})" if force.path == motion.path else ""
        counts_of_other = other.dropped | other.missing
        for reason, count in (log.dropped | log.missing).items():
            if reason in _NO_LOSS:
                continue
            # a lost line of one table is lost to both logs, so it is named once; a lost cell is not
            of_both = (
                whole_lines and reason not in OF_CELLS and counts_of_other.get(reason) == count
            )
            file = log.path.name + ("" if of_both else suffix)
            facts: dict[str, Any] = {"count": count, "file": file, "why": reason}
            if when := log.stretches.get(reason):
                facts["when"] = _format_stretches(when)
            flags.append(remark(dropped_rows(reason).code, **facts))
    for log in (force, motion):
        if when := log.stretches.get(SET_BACK):
            at = f"{when[0][0]:.2f} s"
            flags.append(remark("clock-set-back", file=log.path.name, when=at))
        if ON_ARRIVAL in log.stretches:
            flags.append(remark("stamps-of-arrival", file=log.path.name))
    return list(dict.fromkeys(flags))


def _flag_gaps(stroke_time: FloatArray, max_gap_s: float) -> Iterator[Remark]:
    """Flag gaps in the force log during the stroke that are longer than `max_gap_s`; `stroke_time`: s, shape (n,)."""
    seconds = np.diff(gaps(stroke_time, max_gap_s), axis=1)
    if seconds.size == 1:
        yield remark("gap", seconds=seconds[0, 0])
    elif seconds.size:
        yield remark("gaps", count=seconds.size, seconds=seconds.sum(), longest=seconds.max())


def _format_stretches(stretches: Sequence[tuple[float, float]]) -> str:
    """Format start and end, s, of the first three stretches of a log, and the number of further ones."""
    listed = ", ".join(f"{start:.2f} to {stop:.2f} s" for start, stop in stretches[:3])
    remainder = len(stretches) - 3
    return listed + (f" and {remainder} stretches more" if remainder > 0 else "")


def _flag_doubts(
    config: Config,
    run: Run,
    readings: lab_frame.ForceReadings,
    zero: lab_frame.Zero,
    stroke: BoolArray,
    lost_s: float,
) -> Iterator[Remark]:
    """Flag doubts about the readings of a stroke: gaps, a log that is short, a drifting zero, repeats, saturation.

    `stroke`: True for the samples of the stroke. `lost_s`: Time of the stroke that the force log lacks, s.
    """
    yield from _flag_gaps(readings.time[stroke], config.clock.max_gap_s)
    if lost_s > config.clock.max_gap_s:
        yield remark("force-log-short", seconds=lost_s)
    if zero.drift_N > config.transducer.max_drift_N:
        yield remark("zero-drifted", newtons=zero.drift_N)
    # a logger that writes each reading of a slower transducer several times
    in_range = stroke & ~readings.saturated
    share = (~lab_frame.new_readings(readings.channels)[in_range]).mean() if in_range.any() else 0.0
    # the force of a horizontal run may be steady; of others it grows
    if run.direction != "horizontal" and share >= 1 / 3:
        yield remark("readings-repeated", share=share)
    if count := int(np.count_nonzero(readings.saturated & stroke)):
        yield remark("stroke-saturated", count=count)
