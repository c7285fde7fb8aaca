"""The logs of a medium as traces in the lab frame: one clock, zero removed, every row accounted for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.logs.base import BLANK, Log, LogError
from rftfit.logs.sources import OTHER_SOURCE
from rftfit.logs.text import OF_CELLS
from rftfit.measure import lab_frame
from rftfit.measure.clocks import HOUR_S, ClockFit
from rftfit.measure.flags import (
    REASON,
    REPEATED,
    Refused,
    Remark,
    dropped_rows,
    quoted,
    reason_columns,
    remark,
    say,
)
from rftfit.measure.ledger import DROPPED, LOST, USED, Ledger, RowStatus
from rftfit.measure.pairs import Pair, gaps, load_pairs, readers, same_table
from rftfit.measure.readings import find_holds
from rftfit.measure.samples import PHASES, samples_table
from rftfit.measure.session_clocks import (
    SessionClocks,
    find_clock,
    find_session_clocks,
    flags_of_clock,
)
from rftfit.measure.strokes import IntruderPath, find_stroke
from rftfit.measure.surface import Compliance, Surface, find_compliance, place_surface
from rftfit.measure.zero import Zero, find_zero, height_needed, stated_zero, zero_of_log


def ingest_medium(
    campaign: Campaign, medium: str, clocks: SessionClocks | None = None
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Read all logs of a medium, keeping what is wrong with the bad ones.

    `clocks`: Of the sessions, where they are estimated; default: as the pushes of this campaign show them. Returns a
    row per force sample; a row per run: status, reason, clock and zero; the rows of all logs but
    the good ones of the strokes, and flags of the runs.
    """
    traces, rows, ledger = ingest_traces(campaign, medium, clocks)
    return samples_of(traces), pd.DataFrame(rows, columns=list(RUN_COLUMNS)), ledger


def ingest_traces(
    campaign: Campaign, medium: str, clocks: SessionClocks | None = None
) -> tuple[list[Trace], list[dict[str, object]], Ledger]:
    """As `ingest_medium`, with the traces and what their surfaces were estimated from."""
    clocks = find_session_clocks(campaign) if clocks is None else clocks
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
        outcome = _ingest_run(config, run, pair, ledger, compliance, clocks)
        if isinstance(outcome, Trace):
            traces.append(outcome)
            rows.append(_run_row(outcome, config.arm.surface_z_mm, clocks))
            ledger.flag(run, *outcome.flags)
        else:
            refused = {"run_id": run.run_id, "kind": run.kind, "status": "refused"}
            rows.append(RUN_COLUMNS | refused | reason_columns(outcome))
    return traces, rows, ledger


def _ingest_run(
    config: Config,
    run: Run,
    pair: Pair,
    ledger: Ledger,
    compliance: Compliance | InputError | None,
    clocks: SessionClocks | None,
) -> Trace | list[Remark]:
    """Align the two logs of a run and turn them into the lab frame, or say why not.

    Rows that go no further are put into the ledger here; the good ones of the stroke are left to
    the stages that use them. `compliance` says how far the machine yields under load, or why that is
    not known.
    """
    force, motion = pair.force, pair.motion
    # a line that holds force and motion is counted once, by what became of its force
    counted_once = same_table(config, run) and force.rows == motion.rows
    reasons = [remark("excluded", why=run.reason)] if run.excluded else pair.problems
    if not reasons and isinstance(compliance, InputError):
        reasons = [quoted(compliance, "rigid-contact")]
    if not reasons:
        assert not isinstance(compliance, InputError)
        assert isinstance(force, Log)
        assert isinstance(motion, Log)
        try:
            read = lab_frame.without_repeats(force, config.transducer)
            trace = _trace(config, run, read, motion, pair.zero, compliance, clocks)
        except ValueError as error:
            reasons = [quoted(error)]
        else:
            _account(ledger, run, read, None if counted_once else motion, trace)
            return trace
    _account_refused(ledger, run, run.force_log, force, reasons)
    if not counted_once:
        _account_refused(ledger, run, run.motion_log, motion, reasons)
    return reasons


@dataclass(frozen=True)
class Trace:
    """One run in the lab frame, on the force log's clock; arrays of shape (n,).

    `time` in s; `x`, `z` of the intruder's reference point in cm; `angle` (beta or theta) in rad;
    `force` (2, n) as z, x in N, its `zero` removed. `phase` is an index into `PHASES`, `why` a `RowStatus`,
    `rows` the data lines of force and motion log. `flags` do not stop the run; `surface` is there where it was
    looked for; `channels`: of `channel_facts`. `hold_s`: how long a position stays in the log while the arm moves, 0
    where that moves no depth.
    """

    run: Run
    time: FloatArray
    phase: np.ndarray
    x: FloatArray
    z: FloatArray
    angle: FloatArray
    force: FloatArray
    why: np.ndarray
    zero: Zero
    clock: ClockFit
    flags: tuple[Remark, ...]
    rows: tuple[int, int]
    surface: Surface | None = None
    channels: dict[str, object] = field(default_factory=dict)
    hold_s: float = 0.0

    @property
    def note(self) -> tuple[Remark, ...]:
        """What was put right and touches no number, but should be known."""
        hours = self.clock.whole_hours
        return (remark("clock-hours", hours=hours),) if hours else ()

    @property
    def step_s(self) -> float:
        """Mean step between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


_AIR, _APPROACH, _PAUSE, _STROKE, _OTHER = range(len(PHASES))
_PAUSE_CM = 0.2


def _trace(
    config: Config,
    run: Run,
    force_log: Log,
    motion_log: Log,
    zero_log: Log | LogError | None,
    compliance: Compliance | None,
    clocks: SessionClocks | None,
) -> Trace:
    readings = lab_frame.force_in_lab_frame(force_log, config.transducer)
    path = lab_frame.path_in_lab_frame(motion_log, run, config.arm)
    spans = path.spans(config.arm)
    clock = find_clock(config.clock, run, readings, path, spans, clocks)
    time = clock.motion_time(readings.time)
    good = ~readings.saturated
    path, surface = place_surface(
        config, run, path, time[good], readings.force[0, good], clock.se_s or 0.0
    )
    start, end = find_stroke(path, spans, run, config.arm)
    in_stroke = (time >= start) & (time <= end)
    if not in_stroke.any():
        raise Refused("no-force-in-stroke")
    x, z, angle = path.pose_at(time)
    moving = _within(time, spans)
    clear_cm = height_needed(config.intruders[run.intruder], angle, config.fit.air_clearance_cm)
    in_air = z >= clear_cm
    why = _row_status(time, path, readings.saturated, config.clock.max_gap_s)
    at_rest = in_air & ~moving & ~in_stroke & (why == RowStatus.GOOD)
    zero = _zero(config, readings, at_rest, in_stroke, zero_log, float(clear_cm.min()))
    force = readings.force - zero.force
    if compliance is not None:
        travel, is_measured = compliance.travel_at(force[0])
        z = z + travel
        why[~is_measured & (why == RowStatus.GOOD)] = RowStatus.YIELDED
    # a log whose zero is known otherwise holds nothing but the stroke, and no rest in air
    rests_in_air = config.zero.method == "air" and zero_log is None
    phase = np.full(time.size, _OTHER)
    phase[in_air & ~moving & rests_in_air] = _AIR
    phase[~in_air & ~moving & (np.abs(z) < _PAUSE_CM)] = _PAUSE
    phase[moving & (time < start)] = _APPROACH
    phase[in_stroke] = _STROKE
    hold_s, in_steps = _position_in_steps(path, start, end)
    flags = [
        *flags_of_clock(run, clocks),
        *in_steps,
        *_lost_rows(force_log, motion_log, whole_lines=same_table(config, run)),
        *_doubts(config, run, readings, zero, in_stroke, max(end - time[-1], time[0] - start)),
    ]
    # a log that begins in air should also end after the stroke
    if rests_in_air and (start <= path.time[1] or end >= path.time[-2]):
        flags.append(remark("motion-log-cut"))
    return Trace(
        run,
        readings.time,
        phase,
        x,
        z,
        angle,
        force,
        why,
        zero,
        clock,
        tuple(flags),
        (force_log.rows, motion_log.rows),
        surface,
        lab_frame.channel_facts(readings.channels, in_stroke),
        hold_s,
    )


_HELD_SE = 0.25
"""Of the time that a position is held: the error of the clock where it may be held, or that of a coarse sensor."""
_LEAST_STEP_CM = 0.03


def _position_in_steps(path: IntruderPath, start: float, end: float) -> tuple[float, list[Remark]]:
    """How long a position stays while the arm moves, s, and its flag; 0 and none where steps are small."""
    inside = (path.time >= start) & (path.time <= end)
    parts = [coordinate[inside] for coordinate in (path.x, path.z)]
    position = max(parts, key=lambda coordinate: np.ptp(coordinate) if coordinate.size else 0.0)
    holds = find_holds(position)
    if holds.rows < 2 or holds.step < _LEAST_STEP_CM:
        return 0.0, []
    hold_s = holds.rows * float(np.median(np.diff(path.time[inside])))
    step_mm = 10 * holds.step
    in_steps = remark("position-in-steps", rows=holds.rows, step_mm=step_mm, off_mm=step_mm / 2)
    return hold_s, [in_steps]


_RAMP_S = 0.1


def _within(time: FloatArray, spans: FloatArray) -> np.ndarray:
    """Tell which samples lie in a stretch of motion or in its ramps."""
    moving = np.zeros(time.size, dtype=bool)
    starts = np.searchsorted(time, spans[:, 0] - _RAMP_S, side="right")
    for begin, stop in zip(starts, np.searchsorted(time, spans[:, 1] + _RAMP_S), strict=True):
        moving[begin:stop] = True
    return moving


def _row_status(
    time: FloatArray, path: IntruderPath, saturated: np.ndarray, max_gap_s: float
) -> np.ndarray:
    """`RowStatus` of each force sample, by what the two logs themselves show."""
    why = np.full(time.size, RowStatus.GOOD, dtype=np.int8)
    for start, end in gaps(path.time, max_gap_s):
        why[(time > start) & (time < end)] = RowStatus.MOTION_GAP
    why[(time < path.time[0]) | (time > path.time[-1])] = RowStatus.NO_MOTION
    why[saturated] = RowStatus.SATURATED
    return why


def _zero(
    config: Config,
    readings: lab_frame.ForceReadings,
    at_rest: np.ndarray,
    in_stroke: np.ndarray,
    zero_log: Log | LogError | None,
    clear_cm: float,
) -> Zero:
    """Zero of a run from its zero log, else as the config states it, else from its rest in air."""
    drift = config.transducer.drift_N_per_min
    if isinstance(zero_log, Log):
        unloaded = lab_frame.force_in_lab_frame(zero_log, config.transducer).force
        zero = zero_of_log(unloaded, drift, config.zero.log_age_min)
    elif config.zero.method == "stated":
        zero = stated_zero(config.zero, config.transducer)
    else:
        middle = float(readings.time[in_stroke].mean())
        zero = find_zero(readings.time, readings.force, at_rest, middle, drift, clear_cm)
    # no rest shows what moves the zero back and forth between it and the stroke
    return replace(zero, variance=zero.variance + config.transducer.slow_noise_N**2)


# --- Flags of a trace: doubts that do not stop the run.


_CHOSEN = (REPEATED, BLANK, OTHER_SOURCE)
"""Rows that hold no reading, or none that the config asks for: that they are left out is no doubt."""


def _lost_rows(force: Log, motion: Log, *, whole_lines: bool) -> list[Remark]:
    """Rows that were lost from each log, and why; `whole_lines`: lines of one table hold force and motion."""
    lost = [
        {
            reason: count
            for reason, count in (*log.dropped.items(), *log.missing.items())
            if reason not in _CHOSEN
        }
        for log in (force, motion)
    ]
    parts = (" (force)", " (motion)") if force.path == motion.path else ("", "")
    flags = []
    for lost_of_log, lost_beside, log, suffix in zip(
        lost, lost[::-1], (force, motion), parts, strict=True
    ):
        for reason, count in lost_of_log.items():
            # of one table a line, unlike a cell, is lost to both logs
            of_both = whole_lines and reason not in OF_CELLS and lost_beside.get(reason) == count
            file = log.path.name + ("" if of_both else suffix)
            flags.append(remark(dropped_rows(reason).code, count=count, file=file, why=reason))
    return list(dict.fromkeys(flags))


def _gaps(stroke_time: FloatArray, max_gap_s: float) -> Iterator[Remark]:
    missed = np.diff(gaps(stroke_time, max_gap_s), axis=1)
    if missed.size == 1:
        yield remark("gap", seconds=missed[0, 0])
    elif missed.size:
        yield remark("gaps", count=missed.size, seconds=missed.sum(), longest=missed.max())


_MOST_REPEATED = 1 / 3


def _doubts(
    config: Config,
    run: Run,
    readings: lab_frame.ForceReadings,
    zero: Zero,
    stroke: np.ndarray,
    lost_s: float,
) -> Iterator[Remark]:
    """Doubts about the readings of the `stroke`, of which the force log lacks so many seconds."""
    yield from _gaps(readings.time[stroke], config.clock.max_gap_s)
    if lost_s > config.clock.max_gap_s:
        yield remark("force-log-short", seconds=lost_s)
    if zero.drift_N > config.transducer.max_drift_N:
        yield remark("zero-drifted", newtons=zero.drift_N)
    # a logger that writes each reading of a slower transducer several times
    share = (~lab_frame.new_readings(readings.channels)[stroke]).mean()
    # the force of a horizontal run may be steady; of others it grows
    if run.direction != "horizontal" and share >= _MOST_REPEATED:
        yield remark("readings-repeated", share=share)
    if count := int(np.count_nonzero(readings.saturated & stroke)):
        yield remark("stroke-saturated", count=count)


# --- Tables of the stage.


RUN_COLUMNS: dict[str, object] = {
    **dict.fromkeys(("run_id", "kind", "status", *REASON, "note", "readings"), ""),
    **dict.fromkeys(("rows_force", "rows_motion"), 0),
    **dict.fromkeys(
        (
            "sample_step_s",
            "clock_offset_s",
            "clock_residual_s",
            "clock_se_s",
            "zero_var_z_N2",
            "zero_var_x_N2",
            "zero_dof",
            "zero_trend_z_N",
            "zero_trend_x_N",
            "clock_hours",
            "clock_rest_s",
            "clock_drift",
            "clock_drift_se",
            "clock_explained",
            "clock_shared_se_s",
            "clock_pushes",
            "surface_z_mm",
            "surface_se_mm",
            "surface_growth_N_per_cm",
            *(
                f"{channel}_{fact}"
                for channel in lab_frame.CHANNELS
                for fact in lab_frame.CHANNEL_FACTS
            ),
        ),
        math.nan,
    ),
}
"""Columns of the table of runs, and what stands where nothing is known."""


def _run_row(
    trace: Trace, given_surface_z_mm: float, clocks: SessionClocks | None
) -> dict[str, object]:
    clock, zero = trace.clock, trace.zero
    row: dict[str, object] = {
        "run_id": trace.run.run_id,
        "kind": trace.run.kind,
        "status": "read",
        "note": say(trace.note),
        "rows_force": trace.rows[0],
        "rows_motion": trace.rows[1],
        "sample_step_s": trace.step_s,
        "clock_offset_s": clock.offset_s,
        "clock_residual_s": clock.residual_s,
        "clock_se_s": math.hypot(clock.offset_se(trace.step_s), _HELD_SE * trace.hold_s),
        "zero_var_z_N2": zero.variance[0],
        "zero_var_x_N2": zero.variance[1],
        "zero_dof": zero.dof,
        "zero_trend_z_N": zero.trend_N[0],
        "zero_trend_x_N": zero.trend_N[1],
    }
    if clocks is not None:
        hours, push = clock.whole_hours, clocks.pushes.get(trace.run.run_id, {})
        session = clocks.of_session(trace.run.session)
        # in a table of six digits hours would hide the rest
        row |= {
            "clock_hours": hours,
            "clock_rest_s": clock.offset_s - HOUR_S * hours,
            "clock_drift": clock.drift,
            "clock_drift_se": push["drift_se"] if session.contradiction else session.drift_se,
            "clock_explained": push.get("explained", math.nan),
            "clock_shared_se_s": clock.shared_se_s,
            "clock_pushes": 1 if session.contradiction else session.pushes,
        }
    if (surface := trace.surface) is not None:
        row |= {
            "surface_z_mm": given_surface_z_mm - 10 * surface.depth_cm,
            "surface_se_mm": 10 * surface.se_cm,
            "surface_growth_N_per_cm": surface.growth_N_per_cm,
        }
    return RUN_COLUMNS | row | trace.channels


def samples_of(traces: list[Trace]) -> pd.DataFrame:
    """Put the samples of all runs into one long table."""
    return samples_table(
        {
            trace.run.run_id: (
                trace.time,
                trace.phase,
                trace.x,
                -trace.z,
                np.degrees(trace.angle),
                *trace.force,
                trace.why,
            )
            for trace in traces
        }
    )


# --- Every row of every log, in the ledger.


_STATUS_OF_PHASE = np.array(
    [RowStatus.GOOD, RowStatus.APPROACH, RowStatus.PAUSE, RowStatus.GOOD, RowStatus.ELSEWHERE],
    dtype=np.int8,
)


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


def account_unassigned_air_runs(campaign: Campaign) -> Ledger:
    """Account for in-air runs that no leg names: they belong to no medium and no stage reads them."""
    ledger = Ledger()
    for run in campaign.unassigned_air_runs:
        counts = []
        for file, reader in zip(
            (run.force_log, run.motion_log), readers(campaign, run), strict=True
        ):
            try:
                counts.append((file, sum(log.rows for log in reader.stream(campaign.raw / file))))
            except LogError as error:
                counts.append((file, error.rows))
        if same_table(campaign.config, run) and counts[0] == counts[1]:
            counts.pop()
        for file, rows in counts:
            ledger.add(run, file, DROPPED, rows, remark("unclaimed"))
    return ledger
