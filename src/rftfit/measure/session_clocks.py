"""Offset and drift of the clocks of a session, from its pushes straight down, for all its runs; the clock of a run.

A *session* is the runs with one label in the column session of the run sheet: its two programs ran on without a
restart, so one offset (motion time minus force time, s) and one drift (change of the offset per s) hold for all of its
runs. Only a push straight down shows them by itself, as its force depends on depth alone: `align_push`.
`find_session_clock` joins these pushes, and `find_clock` gives each run its clock by the method of the config.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.config import ClockSettings
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.logs.base import Log
from rftfit.measure import lab_frame
from rftfit.measure.alignment import BUILD_UP_S, Alignment, estimate_clocks
from rftfit.measure.clocks import ClockFit, align, moving_spans, whole_spans
from rftfit.measure.flags import Refused, Remark, quoted, reason_columns, remark
from rftfit.measure.read import read_logs
from rftfit.measure.strokes import IntruderPath
from rftfit.outputs.dictionary import columns_of
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `session_clocks`, says what each decides
_CHOSEN = chosen("measure", "session_clocks")

Push = dict[Any, Any]
"""Row of `align_medium`, one push straight down: ``run_id``, ``session``, its clock from its logs alone, ``reason``.

The clock: ``offset_s`` and its error ``se_s``, ``drift``, ``drift_se``, ``reference_s``, ``offset_hours``,
``explained``; NaN where the push shows none, for the reason.
"""


def align_medium(campaign: Campaign, medium: str) -> pd.DataFrame:
    """Align the clocks of each push straight down of a medium from its logs alone: a table with the rows `Push`."""
    rows = []
    for run, alignment in align_pushes(campaign, medium):
        row: Push = {"run_id": run.run_id, "medium": medium, "session": run.session}
        if isinstance(alignment, Alignment):
            row |= _clock_cells(alignment) | reason_columns(())
        else:
            row |= reason_columns([alignment])
        rows.append(row)
    return pd.DataFrame(rows, columns=columns_of("clocks/{medium}.parquet"))


def align_pushes(campaign: Campaign, medium: str) -> Iterator[tuple[Run, Alignment | Remark]]:
    """Align the clocks of each push straight down of a medium by its force, or yield the remark why that fails."""
    runs = [run for run in campaign.runs_of(medium) if goes_straight_down(run) and not run.excluded]
    for run, logs in read_logs(campaign, runs):
        if not isinstance(logs.force, Log) or not isinstance(logs.motion, Log):
            yield run, logs.problems[0]
            continue
        try:
            framed = lab_frame.logs_in_lab_frame(campaign.config, run, logs.force, logs.motion)
            yield run, align_push(campaign.config.clock, run, *framed)
        except ValueError as error:
            yield run, quoted(error)


def goes_straight_down(run: Run) -> bool:
    """Return True for a push straight down: its force depends on depth alone, and can show the offset of the clocks."""
    return run.direction == "intrusion" and run.gamma_deg == 90


def align_push(
    settings: ClockSettings, run: Run, readings: lab_frame.ForceReadings, path: IntruderPath
) -> Alignment:
    """Align force and motion log of one push straight down by its force; refuse any other run.

    `readings`: Forces in the lab frame, on the clock of the force log. `path`: Path on that of the motion log.
    """
    if not goes_straight_down(run):
        raise Refused("no-push-to-match", direction=run.direction, gamma=run.gamma_deg)
    good = ~readings.saturated
    return estimate_clocks(
        readings.time[good],
        readings.force[0, good],
        path.time,
        -path.z,
        settings.max_drift,
        settings.max_se_s,
    )


def _clock_cells(alignment: Alignment) -> Push:
    """Make the cells of a `Push` whose clocks are aligned."""
    clock = alignment.clock
    return {
        "offset_s": clock.offset_s,
        "reference_s": clock.reference_s,
        "se_s": clock.se_s,
        "drift": clock.drift,
        "drift_se": alignment.drift_se,
        "offset_hours": float(clock.whole_hours),
        "explained": alignment.explained,
    }


# --- the clocks of a session


@dataclass(frozen=True)
class SessionClock:
    """Clock of a session: motion time minus force time is offset + drift x (force time - reference), s.

    `covariance`: Covariance of offset (s) and drift (s per s), shape (2, 2).
    `hours`: Whole hours in the offset.
    `pushes`: Number of pushes from which the clock was found; 0: no clock.
    `contradiction`: Description of the offsets of the pushes, if no common offset and drift fits them; else empty.
    `why`: Reason why the first push has no offset, if no push has one.
    """

    offset_s: float = math.nan
    drift: float = math.nan
    reference_s: float = math.nan
    covariance: tuple[tuple[float, ...], ...] = ((0.0, 0.0), (0.0, 0.0))
    hours: int = 0
    pushes: int = 0
    contradiction: str = ""
    why: str = ""

    @property
    def drift_se(self) -> float:
        """Standard error of the drift."""
        return math.sqrt(self.covariance[1][1])

    def fit_at(self, time_s: float) -> ClockFit:
        """Clock of a run at a time of the force log, s; its error is common to all runs of the session.

        The error grows with the distance from the pushes, by that of the drift.
        """
        design = np.array([1.0, time_s - self.reference_s])
        variance = float(design @ np.array(self.covariance) @ design)
        # the force lags the depth in all pushes alike: more pushes do not make this error smaller
        se_s = math.sqrt(variance + BUILD_UP_S**2)
        offset_s = self.offset_s + self.drift * (time_s - self.reference_s)
        return ClockFit(offset_s, self.drift, time_s, se_s=se_s, hours=self.hours, shared_se_s=se_s)


@dataclass(frozen=True)
class SessionClocks:
    """Clocks of the sessions of a campaign.

    `sessions`: Clocks by the label of the session; a blank label for all runs without a session.
    `pushes`: Rows of `align_medium` with an offset, by run_id; they serve where a session has no common clock.
    """

    sessions: Mapping[str, SessionClock]
    pushes: Mapping[str, Push] = field(default_factory=dict)

    @classmethod
    def of_pushes(cls, tables: Iterable[pd.DataFrame], settings: ClockSettings) -> SessionClocks:
        """Find the clock of each session from the pushes of all media; `tables`: of `align_medium`, one a medium."""
        rows = [row for table in tables for row in table.to_dict("records")]
        rows.sort(key=lambda row: str(row["run_id"]))
        labels = dict.fromkeys(str(row["session"]) for row in rows)
        sessions = {
            label: find_session_clock([row for row in rows if row["session"] == label], settings)
            for label in labels
        }
        return cls(sessions, {str(row["run_id"]): row for row in rows if _is_aligned(row)})

    def of_session(self, label: str) -> SessionClock:
        """Clock of a session; without an offset if the session has no push straight down."""
        return self.sessions.get(label, SessionClock())

    def of_run(self, run: Run, time: FloatArray, max_se_s: float) -> ClockFit:
        """Clock of a run: that of its session, or of the run alone if the pushes of the session contradict one another.

        `time`: Times of its force log, s, shape (n,). `max_se_s`: Largest standard error of the offset, s.
        """
        clock, session = self.of_session(run.session), _name_of_session(run)
        if not clock.pushes:
            why = clock.why and f" ({clock.why})"
            raise Refused("no-push-aligned", session=session, why=why)
        if clock.contradiction:
            push = self.pushes.get(run.run_id)
            if push is None:
                raise Refused("clocks-contradict", session=session, pushes=clock.contradiction)
            return _clock_of_push(push)
        fitted = clock.fit_at(float(time[0] + time[-1]) / 2)
        assert fitted.se_s is not None
        if fitted.se_s > max_se_s:
            raise Refused(
                "session-uncertain",
                session=session,
                pushes=clock.pushes,
                seconds=fitted.se_s,
                most=max_se_s,
                offset=fitted.offset_s,
            )
        return fitted


def find_session_clocks(campaign: Campaign) -> SessionClocks | None:
    """Estimate the clocks of all sessions from the pushes straight down; None if the config asks for no estimate."""
    if campaign.config.clock.method != "estimate":
        return None
    tables = (align_medium(campaign, medium) for medium in campaign.media_with_runs)
    return SessionClocks.of_pushes(tables, campaign.config.clock)


def find_clock(
    settings: ClockSettings,
    run: Run,
    readings: lab_frame.ForceReadings,
    path: IntruderPath,
    spans: FloatArray,
    clocks: SessionClocks | None,
) -> ClockFit:
    """Find the clock of a run by the method of the config: one clock, an estimate from the force, or a sync line.

    `settings`: Section ``clock`` of the config. `readings`, `path`: Forces and path in the lab frame.
    `spans`: Stretches of motion of `path`, s, shape (k, 2).
    `clocks`: Clocks of the sessions, for an estimate; None: estimate the clock from this run alone.
    """
    if settings.method == "same_clock":
        return ClockFit()
    time = readings.time
    if settings.method == "estimate":
        if clocks is None:
            return align_push(settings, run, readings, path).clock
        return clocks.of_run(run, time, settings.max_se_s)
    if readings.arm_moving is None:
        raise Refused("no-sync-line")
    force_spans = moving_spans(time, readings.arm_moving)
    force_spans = whole_spans(force_spans, float(time[0]), float(time[-1]))
    # the speed is known from the second sample to the last but one; no spans in fewer than three
    motion_spans = whole_spans(spans, *path.time[[1, -2]]) if len(spans) else spans
    return align(force_spans, motion_spans, settings.max_residual_s)


def _is_aligned(row: Push) -> bool:
    """Return True if a push shows the offset of the clocks, and not the reason why not."""
    return math.isfinite(row["offset_s"])


def _clock_of_push(row: Push) -> ClockFit:
    """Clock of a push from its logs alone; only the error by the lag of the force is common to all runs."""
    return ClockFit(
        row["offset_s"],
        row["drift"],
        row["reference_s"],
        se_s=row["se_s"],
        hours=int(row["offset_hours"]),
        shared_se_s=BUILD_UP_S,
    )


def find_session_clock(pushes: list[Push], settings: ClockSettings) -> SessionClock:
    """Fit one offset and drift to the pushes of one session.

    Weighted least squares; the prior of the drift has the standard deviation `settings.max_drift`. Pushes that differ
    by more than their errors widen the error of the clock (R. T. Birge, Phys. Rev. 40, 207, 1932). If a push differs by
    more than `sigmas` standard errors, there is no common clock.

    `pushes`: Rows of `align_medium`; some may have no offset.
    """
    aligned = [row for row in pushes if _is_aligned(row)]
    if not aligned:
        return SessionClock(why=str(next((row["reason"] for row in pushes), "")))
    # several strokes of one log have one alignment
    aligned = [*{(row["offset_s"], row["reference_s"]): row for row in aligned}.values()]
    offset, time, se, drift, drift_se = (
        np.array([row[name] for row in aligned], dtype=float)
        for name in ("offset_s", "reference_s", "se_s", "drift", "drift_se")
    )
    # the lag of the force is common to all pushes, so it is no part of their scatter
    variance = np.maximum(se**2 - BUILD_UP_S**2, _CHOSEN.least_se_s**2)
    # offsets are counted from their median, as they may be as large as a time since 1970
    base, reference = float(np.median(offset)), float(np.average(time, weights=1 / variance))
    design = np.stack([np.ones(time.size), time - reference])
    # the alignment of each push already used the prior: remove it there, so that it counts only once
    prior = 1 / settings.max_drift**2
    weight = 1 / np.maximum(drift_se, 1e-12) ** 2
    shows_drift = weight > prior
    drift_weight = prior + float((weight - prior)[shows_drift].sum())
    # least squares of offset and drift: from how the offsets change, and from the drift within each push
    normal = (design / variance) @ design.T + np.diag([0.0, drift_weight])
    moment = (design / variance) @ (offset - base)
    moment[1] += float(weight[shows_drift] @ drift[shows_drift])
    covariance = np.linalg.inv(normal)
    fitted = covariance @ moment
    residual = offset - base - fitted @ design
    is_outlier = np.abs(residual) > _CHOSEN.sigmas * np.sqrt(variance + BUILD_UP_S**2)
    if is_outlier.any() or abs(fitted[1]) > _CHOSEN.sigmas * settings.max_drift:
        return SessionClock(pushes=len(aligned), contradiction=_describe_groups(aligned))
    freedom = max(len(aligned) - 2, 1)
    covariance = covariance * max(1.0, float((residual**2 / variance).sum()) / freedom)
    return SessionClock(
        offset_s=base + float(fitted[0]),
        drift=float(fitted[1]),
        reference_s=reference,
        covariance=tuple(map(tuple, covariance.tolist())),
        hours=round(float(np.median([row["offset_hours"] for row in aligned]))),
        pushes=len(aligned),
    )


def _describe_groups(pushes: list[Push]) -> str:
    """Describe the offsets of pushes in the order of time, to show where a clock was set; those that agree are a group.

    For example ``+0.412 s in a, b and 3 more; +5.730 s in f``.
    """
    first, *others = sorted(pushes, key=lambda row: (row["reference_s"], str(row["run_id"])))
    groups = [[first]]
    for row in others:
        last = groups[-1][-1]
        error_s = math.hypot(row["se_s"], last["se_s"])
        if abs(row["offset_s"] - last["offset_s"]) > _CHOSEN.sigmas * error_s:
            groups.append([])
        groups[-1].append(row)
    descriptions = []
    for group in groups[: _CHOSEN.most_groups]:
        names = ", ".join(str(row["run_id"]) for row in group[: _CHOSEN.most_names])
        count_left = len(group) - _CHOSEN.most_names
        more = f" and {count_left} more" if count_left > 0 else ""
        offset = float(np.median([row["offset_s"] for row in group]))
        descriptions.append(f"{offset:+.3f} s in {names}{more}")
    groups_left = len(groups) - _CHOSEN.most_groups
    return "; ".join(descriptions) + (f"; {groups_left} more" if groups_left > 0 else "")


def flags_of_clock(run: Run, clocks: SessionClocks | None) -> tuple[Remark, ...]:
    """Flag a run that is aligned by its own logs, as the pushes of its session contradict one another; else no flag."""
    if clocks is None or not (contradiction := clocks.of_session(run.session).contradiction):
        return ()
    return (remark("clock-by-itself", session=_name_of_session(run), pushes=contradiction),)


def _name_of_session(run: Run) -> str:
    """Name of the session of a run, for a sentence."""
    return f"session {run.session}" if run.session else "the runs without a session"
