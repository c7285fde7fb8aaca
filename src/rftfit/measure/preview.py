"""Measure the logs of a campaign before it is run (`rftfit check`), to report runs that it would drop or flag.

A run is *refused* if it would have no number, for a reason, and *flagged* if it has one that is in doubt. Each medium
goes through the same stages as in `rftfit run`: ingest, tare, and of the fit as much as decides on these two.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from rftfit.campaign.load import Campaign
from rftfit.campaign.problems import Place, Problem, Severity, join_words
from rftfit.campaign.sheet import Run
from rftfit.measure.fits import Stroke, find_strokes, judge_run
from rftfit.measure.flags import REASON, Remark, reason_columns, reason_of
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.session_clocks import SessionClocks, find_session_clocks
from rftfit.measure.tables import ingest_table
from rftfit.measure.tare import TARE_KINDS, tare_medium

LARGEST_BYTES = 20_000_000
"""Size of the largest log that is read for this report, bytes."""

_AT_A_TIME = 256
"""Runs measured at a time, to limit memory."""
_ROWS = 500
"""Rows kept of each run of a table of stress, to save time."""


@dataclass
class LogPreview:
    """Problems in the logs of a medium, and how many of its runs were not read.

    `problems`: One for each code of a reason or flag, with the runs that have it.
    `passed_over`: Number of runs that were not read, as a log is larger than `LARGEST_BYTES`.
    """

    problems: list[Problem] = field(default_factory=list)
    passed_over: int = 0


def measure_for_check(campaign: Campaign) -> list[LogPreview]:
    """Measure each medium as `rftfit run` does, and report which runs it would drop or flag, and why.

    A table of alpha has no logs and no stress to be measured: an empty list.
    """
    table_settings = campaign.config.table
    if table_settings is not None and table_settings.holds == "alpha":
        return []
    large, absent = set(), set()
    for run in campaign.runs:
        logs = filter(None, (run.force_log, run.motion_log, run.zero_log))
        sizes = [campaign.size_of(log) for log in logs]
        if None in sizes:
            absent.add(run.run_id)
        if any(size and size > LARGEST_BYTES for size in sizes):
            large.add(run.run_id)
    # pushes of other media in the same session show the clocks too
    small = tuple(run for run in campaign.runs if run.run_id not in large)
    clocks = find_session_clocks(replace(campaign, runs=small))
    return [
        _open_medium(campaign, medium, large, absent, clocks) for medium in campaign.media_with_runs
    ]


def _open_medium(
    campaign: Campaign, medium: str, large: set[str], absent: set[str], clocks: SessionClocks | None
) -> LogPreview:
    """Measure one medium. A problem is an error if it leaves no plate and no leg of the medium, else a warning.

    `large`, `absent`: run_ids with a log that is too large, or missing.
    `clocks`: Clocks of the sessions, found with the pushes of all media; None if the config asks for no estimate.
    """
    is_table = campaign.config.table is not None
    all_runs = campaign.runs_of(medium)
    runs = [run for run in all_runs if is_table or not {run.run_id, run.tare_run} & large]
    measured = _thin_out(campaign) if is_table else campaign
    reasons, flags = _measure_runs(measured, medium, runs, clocks)
    if is_table:
        # some rows may give no alpha where all rows give one, so refused runs are measured again with all
        refused_runs = [run for run in runs if reasons[run.run_id]]
        reasons |= _measure_runs(campaign, medium, refused_runs, clocks)[0]
        flags = {  # the reader of the table has already warned of all other flags
            run: tuple(flag for flag in flags_of_run if flag.code == "gives-back")
            for run, flags_of_run in flags.items()
        }
    # excluded and absent runs are already reported with the run sheet
    opened = [run for run in runs if not run.excluded and run.run_id not in absent]
    preview = LogPreview(passed_over=len(all_runs) - len(runs))
    # by outcome and code: the runs with this code, each with its first remark
    members: dict[tuple[str, str], dict[Run, Remark]] = defaultdict(dict)
    for outcome, remarks in (("refused", reasons), ("flagged", flags)):
        for run in opened:
            for remark in remarks[run.run_id]:
                members[outcome, remark.code].setdefault(run, remark)
    lost = {run for (outcome, _), runs in members.items() if outcome == "refused" for run in runs}
    judged_runs = [run for run in opened if run.kind not in TARE_KINDS] or opened
    leaves_none = lost.issuperset(judged_runs)
    for (outcome, _), remark_by_run in members.items():
        is_refused = outcome == "refused"
        fate = "dropped" if is_refused else "flagged"
        place = _make_place(medium, list(remark_by_run), len(opened), f"would be {fate}")
        sentence = str(next(iter(remark_by_run.values())))
        severity: Severity = "error" if is_refused and leaves_none else "warning"
        preview.problems.append(
            Problem(f"logs.{outcome}", place, None, sentence, severity=severity)
        )
    return preview


_Remarks = dict[str, tuple[Remark, ...]]


def _measure_runs(
    campaign: Campaign, medium: str, runs: list[Run], clocks: SessionClocks | None
) -> tuple[_Remarks, _Remarks]:
    """Measure some runs of a medium; return their reasons and their flags, by run_id; a run without has an empty tuple.

    The tables `status`, `tared` and `tares` are those of the stages ingest and tare. Of the fit, `judge_run` finds the
    reason and the only flag that is reported, ``gives-back``.
    """
    reasons: _Remarks = {}
    flags: _Remarks = {}
    for portion in _split_runs(runs):
        runs_together = replace(campaign, runs=portion)
        if campaign.numbers:
            samples, status, ledger = ingest_table(runs_together, medium)
        else:
            samples, status, ledger = ingest_medium(runs_together, medium, clocks)
        tared, tares, _ = tare_medium(runs_together, medium, samples, status)
        for table in (status, tares):
            rows = table[["run_id", *REASON]].to_dict("records")
            reasons |= {row["run_id"]: reason_of(row) for row in rows}
        flags |= dict.fromkeys(status["run_id"], ())
        for flag in ledger.flags:
            flags[flag.run_id] += (flag,)
        plates = [run for run in portion if run.kind == "plate"]
        for run, _, stroke in find_strokes(plates, status, tared, tares):
            if isinstance(stroke, Stroke):
                fit = judge_run(run, stroke, campaign.config)
                reason = fit.reason
                flags[run.run_id] += tuple(flag for flag in fit.flags if flag.code == "gives-back")
            else:
                reason = stroke
            # several reasons become one remark, as in the table of fits
            reasons[run.run_id] = reason_of(reason_columns(reason))
    return reasons, flags


def _thin_out(campaign: Campaign) -> Campaign:
    """Return the campaign of a table with every k-th row of each run, so that at most about `_ROWS` remain."""
    numbers = {
        name: {column: values[:: 1 + values.size // _ROWS] for column, values in columns.items()}
        for name, columns in campaign.numbers.items()
    }
    return replace(campaign, numbers=numbers)


def _split_runs(runs: list[Run]) -> Iterator[tuple[Run, ...]]:
    """Split runs into portions of `_AT_A_TIME`, to limit memory; a tare is in each portion that subtracts it."""
    tares = {run.run_id: run for run in runs if run.kind in TARE_KINDS}
    for start in range(0, len(runs), _AT_A_TIME):
        portion = runs[start : start + _AT_A_TIME]
        tare_runs = [tares[run.tare_run] for run in portion if run.tare_run in tares]
        yield tuple(dict.fromkeys([*portion, *tare_runs]))


def _make_place(medium: str, members: list[Run], n_runs: int, fate: str) -> Place:
    """Make the place of a problem, as ``sand, 3 of 40 runs would be dropped: a (row 2), b (row 5) and c (row 6)``.

    `members`: Runs that have the problem, of `n_runs` that were read. `fate`: ``would be dropped`` or ``would be
    flagged``.
    """
    count = f"{len(members)} of {n_runs} runs" if len(members) > 1 else "1 run"
    named = join_words([f"{run.run_id} (row {run.row})" for run in members])
    return Place(f"{medium}, {count} {fate}: {named}")
