"""The stage ingest: logs of a medium as traces in the lab frame, the table of runs, and every row in the ledger.

`ingest_medium` is the stage ``ingest``. For each run it reads the two logs (`read_logs`) and makes a `Trace`
(`trace_run`: forces z and x in N, positions in cm, one clock), or finds the `Remark`s why this is impossible: the run
is *refused*. Rows of logs go into the `Ledger` with their use or the reason why they are not used. Good rows of the
*stroke* (the push, pull or turn that is measured) are left to later stages, which use them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import COMPONENTS
from rftfit.errors import InputError
from rftfit.logs.base import Log, LogError
from rftfit.measure.clocks import HOUR_S
from rftfit.measure.flags import (
    REASON,
    Remark,
    dropped_rows,
    format_remarks,
    quoted,
    reason_columns,
    remark,
)
from rftfit.measure.lab_frame import CHANNEL_FACTS, CHANNELS, without_repeats
from rftfit.measure.ledger import DROPPED, LOST, USED, Ledger, RowStatus
from rftfit.measure.read import Logs, read_logs, readers, same_table
from rftfit.measure.samples import PHASES, samples_table
from rftfit.measure.session_clocks import SessionClocks, find_session_clocks
from rftfit.measure.surface import Compliance, find_compliance
from rftfit.measure.trace import HELD_SE, Trace, trace_run


def ingest_medium(
    campaign: Campaign, medium: str, clocks: SessionClocks | None = None
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Read all logs of a medium; a run that cannot be used stays in the table with its reason.

    `clocks`: Clocks of the sessions; default: where the config asks for an estimate, from the pushes of this campaign.

    Returns a table with a row for each force sample (``run_id`` and `SAMPLE_COLUMNS`); a table with a row for each run
    (`RUN_COLUMNS`: status, reason, clock and zero); and a ledger with the flags of the runs and the rows of all logs,
    except the good rows of the strokes.
    """
    traces, rows, ledger = ingest_traces(campaign, medium, clocks)
    return _join_samples(traces), pd.DataFrame(rows, columns=list(RUN_COLUMNS)), ledger


def ingest_traces(
    campaign: Campaign, medium: str, clocks: SessionClocks | None = None
) -> tuple[list[Trace], list[dict[str, object]], Ledger]:
    """Read all logs of a medium; return traces, rows of the table of runs, and the ledger of `ingest_medium`.

    `clocks`: see `ingest_medium`. Runs without a trace have a row with the status ``refused``.
    """
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
            # every run states it as its reason
            compliance = error
    for run, logs in read_logs(campaign, runs):
        outcome = _ingest_run(config, run, logs, ledger, compliance, clocks)
        if isinstance(outcome, Trace):
            traces.append(outcome)
            rows.append(_make_run_row(outcome, config.arm.surface_z_mm, clocks))
            ledger.flag(run, *outcome.flags)
        else:
            refused = {"run_id": run.run_id, "kind": run.kind, "status": "refused"}
            rows.append(RUN_COLUMNS | refused | _angles_seen(outcome) | reason_columns(outcome))
    return traces, rows, ledger


def _ingest_run(
    config: Config,
    run: Run,
    logs: Logs,
    ledger: Ledger,
    compliance: Compliance | InputError | None,
    clocks: SessionClocks | None,
) -> Trace | list[Remark]:
    """Align the two logs of a run and turn them into the lab frame, or return the reasons why not.

    Enters the rows into the `ledger`, except the good rows of the stroke.

    `compliance`: Yield of the machine under load, or the error why it is not known, which refuses the run; None if the
    config asks for none. `clocks`: Clocks of the sessions; None where they are not estimated.
    """
    force, motion = logs.force, logs.motion
    # a line that holds force and motion is counted once, by the use of its force
    counted_once = same_table(config, run) and force.rows == motion.rows
    if run.excluded:
        reasons = [remark("excluded", why=run.reason)]
    elif isinstance(force, LogError) or isinstance(motion, LogError) or logs.problems:
        reasons = logs.problems
    elif isinstance(compliance, InputError):
        reasons = [quoted(compliance, "rigid-contact")]
    else:
        try:
            read = without_repeats(force, config.transducer)
            trace = trace_run(config, run, read, motion, logs.zero, compliance, clocks)
        except ValueError as error:
            reasons = [quoted(error)]
        else:
            _account_for_logs(ledger, run, read, None if counted_once else motion, trace)
            return trace
    _account_for_refused_log(ledger, run, run.force_log, force, reasons)
    if not counted_once:
        _account_for_refused_log(ledger, run, run.motion_log, motion, reasons)
    return reasons


# --- Tables of the stage.


RUN_COLUMNS: dict[str, object] = {
    **dict.fromkeys(("run_id", "kind", "status", *REASON, "note", "readings"), ""),
    **dict.fromkeys(("rows_force", "rows_motion"), 0),
    **dict.fromkeys(
        (
            "sample_step_s",
            "seen_beta_deg",
            "seen_gamma_deg",
            "clock_offset_s",
            "clock_residual_s",
            "clock_se_s",
            "zero_var_z_N2",
            "zero_var_x_N2",
            "zero_dof",
            "zero_trend_z_N",
            "zero_trend_x_N",
            "zero_change_z_N",
            "zero_change_x_N",
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
            *(f"{channel}_{fact}" for channel in CHANNELS for fact in CHANNEL_FACTS),
        ),
        math.nan,
    ),
}
"""Columns of the table of runs, and their values where nothing is known; their meanings: `outputs/measure.toml`."""


def _angles_seen(reasons: Sequence[Remark]) -> dict[str, object]:
    """Angles of plate and path that the log of a refused run shows, degrees, where they differ from the run sheet.

    Keys are columns of the table of runs, from which `checks/sheet.py` finds runs whose angles stand in another row:
    ``seen_beta_deg``, and ``seen_gamma_deg`` of the longest stretch, to be compared with `Run.motion_gamma_deg`.
    """
    angles: dict[str, object] = {}
    for reason in reasons:
        if reason.code == "other-angle":
            angles["seen_beta_deg"] = reason.values["found"]
        elif reason.code == "other-direction":
            angles["seen_gamma_deg"] = reason.values["seen_deg"]
    return angles


def _make_run_row(
    trace: Trace, given_surface_z_mm: float, clocks: SessionClocks | None
) -> dict[str, object]:
    """Make the row of a run that was read in the table of runs; its columns are those of `RUN_COLUMNS`.

    `given_surface_z_mm`: z of the arm at the surface by the config; a surface found from the force is stated as z of
    the arm too. `clocks`: None where the clocks are not estimated.
    """
    clock, zero = trace.clock, trace.zero
    row: dict[str, object] = {
        "run_id": trace.run.run_id,
        "kind": trace.run.kind,
        "status": "read",
        "note": format_remarks(trace.note),
        "rows_force": trace.rows[0],
        "rows_motion": trace.rows[1],
        "sample_step_s": trace.step_s,
        "clock_offset_s": clock.offset_s,
        "clock_residual_s": clock.residual_s,
        "clock_se_s": math.hypot(clock.offset_se(trace.step_s), HELD_SE * trace.hold_s),
        "zero_dof": zero.dof,
    }
    for k, c in enumerate(COMPONENTS):
        row[f"zero_var_{c}_N2"] = zero.variance[k]
        row[f"zero_trend_{c}_N"] = zero.trend_N[k]
        row[f"zero_change_{c}_N"] = zero.change_N[k]
    if clocks is not None:
        hours, push = clock.whole_hours, clocks.pushes.get(trace.run.run_id, {})
        session = clocks.of_session(trace.run.session)
        # whole hours stand in a column apart, as a table keeps six digits only
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


def _join_samples(traces: list[Trace]) -> pd.DataFrame:
    """Put the samples of all runs into one long table, with the columns `SAMPLE_COLUMNS`.

    It has depth, positive, instead of z, and angles in degrees.
    """
    return samples_table(
        {
            # in the order of `SAMPLE_COLUMNS`
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
"""Status of good rows by their phase, in the order of `PHASES`."""


def _account_for_logs(
    ledger: Ledger, run: Run, force: Log, motion: Log | None, trace: Trace
) -> None:
    """Enter all rows of the logs into the ledger, except the good rows of the stroke.

    `motion`: None where force and motion are the same rows of one table.
    """
    _account_for_left_out_rows(ledger, run, run.force_log, force)
    if motion is not None:
        _account_for_left_out_rows(ledger, run, run.motion_log, motion)
        ledger.add(run, run.motion_log, USED, motion.size, remark("path"), *trace.note)
    good = trace.why == RowStatus.GOOD
    status = np.where(good, _STATUS_OF_PHASE[trace.phase], trace.why)
    handed_on = (trace.phase == PHASES.index("stroke")) & good
    # the good rows that remain are those in air
    ledger.add_rows(run, status[~handed_on], "zero")


def _account_for_left_out_rows(ledger: Ledger, run: Run, file: str, log: Log) -> None:
    """Enter the rows of a log that were left out into the ledger, and lost rows: those that the file lacks."""
    for fate, counts in ((DROPPED, log.dropped), (LOST, log.missing)):
        for reason, rows in counts.items():
            ledger.add(run, file, fate, rows, dropped_rows(reason))


def _account_for_refused_log(
    ledger: Ledger, run: Run, file: str, log: Log | LogError, reasons: Sequence[Remark]
) -> None:
    """Enter all rows of a log of a refused run into the ledger as dropped, with the `reasons` why.

    `file`: Path of the log as the run sheet names it. `log`: The log, or the error why it could not be read.
    """
    rows = log.rows if isinstance(log, LogError) else log.size
    ledger.add(run, file, DROPPED, rows, *reasons)
    if isinstance(log, Log):
        _account_for_left_out_rows(ledger, run, file, log)


def account_unassigned_air_runs(campaign: Campaign) -> Ledger:
    """Enter the rows of in-air runs that no leg names as tare: they belong to no medium and no stage reads them.

    So the ledger accounts for these logs too, of which only the rows are counted.
    """
    ledger = Ledger()
    for run in campaign.unassigned_air_runs:
        # file and number of rows of each of the two logs
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
