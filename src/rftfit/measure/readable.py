"""What would become of the logs of a campaign, before it is run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from rftfit.campaign.load import Campaign
from rftfit.campaign.problems import Place, Problem, Severity, join_words
from rftfit.campaign.sheet import Run
from rftfit.measure.fits import fit_medium
from rftfit.measure.flags import REASON, Remark, reason_of
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.session_clocks import SessionClocks, find_session_clocks
from rftfit.measure.tables import ingest_table
from rftfit.measure.tare import TARE_KINDS, tare_medium

LARGEST_BYTES = 20_000_000
"""Larger logs are left to the run itself."""

_AT_A_TIME, _ROWS = 256, 500


@dataclass
class Opened:
    """What was found in the logs of some runs: a problem for each sort of reason, with how many runs it holds for.

    `runs`: whose logs were read; `passed_over`: with a log that is too large.
    """

    problems: list[Problem] = field(default_factory=list)
    runs: int = 0
    passed_over: int = 0


def open_logs(campaign: Campaign) -> list[Opened]:
    """Measure each medium as the run does, and say which runs it would drop, or doubt, and why."""
    form = campaign.config.table
    if form is not None and form.holds == "alpha":
        return []
    sizes = {run.run_id: _sizes(campaign, run) for run in campaign.runs}
    large = {
        name
        for name, sizes_of_logs in sizes.items()
        if max(filter(None, sizes_of_logs), default=0) > LARGEST_BYTES
    }
    # pushes of other media in the same session show the clocks too
    small = tuple(run for run in campaign.runs if run.run_id not in large)
    clocks = find_session_clocks(replace(campaign, runs=small))
    absent = {name for name, sizes_of_logs in sizes.items() if None in sizes_of_logs}
    return [
        _open_medium(campaign, medium, large, absent, clocks) for medium in campaign.media_with_runs
    ]


def _open_medium(
    campaign: Campaign, medium: str, large: set[str], absent: set[str], clocks: SessionClocks | None
) -> Opened:
    """Measure one medium; `large` and `absent`: runs with a log that is too large, or missing.

    Where no plate and no leg of a medium would be left, that is an error, else a warning.
    """
    preview = Opened()
    form = campaign.config.table
    all_runs = campaign.runs_of(medium)
    runs = [run for run in all_runs if form or not {run.run_id, run.tare_run} & large]
    preview.passed_over = len(all_runs) - len(runs)
    reasons, flags = _measured(_thin(campaign) if form else campaign, medium, runs, clocks)
    if form:
        # a part of the rows may give no alpha where all give one, not the other way round
        refused_runs = [run for run in runs if reasons[run.run_id]]
        reasons |= _measured(campaign, medium, refused_runs, clocks)[0]
        flags = {  # of all else the table's own reader has warned
            run: tuple(flag for flag in flags_of_run if flag.code == "gives-back")
            for run, flags_of_run in flags.items()
        }
    # the sheet has reported the others
    opened = [run for run in runs if not run.excluded and run.run_id not in absent]
    preview.runs = len(opened)
    refused: dict[str, dict[Run, Remark]] = defaultdict(dict)
    doubted: dict[str, dict[Run, Remark]] = defaultdict(dict)
    for run in opened:
        for reason in reasons[run.run_id]:
            refused[reason.code][run] = reason
        for flag in flags[run.run_id]:
            doubted[flag.code].setdefault(run, flag)
    lost = {run for members in refused.values() for run in members}
    judged_runs = [run for run in opened if run.kind not in TARE_KINDS] or opened
    severity: Severity = "error" if lost.issuperset(judged_runs) else "warning"
    for members_by_code, code, fate in (
        (refused, "refused", "dropped"),
        (doubted, "flagged", "flagged"),
    ):
        for members in members_by_code.values():
            place = _place(medium, list(members), len(opened), f"would be {fate}")
            text = str(next(iter(members.values())))
            preview.problems.append(Problem(f"logs.{code}", place, None, text, severity=severity))
        severity = "warning"
    return preview


_Remarks = dict[str, tuple[Remark, ...]]


def _measured(
    campaign: Campaign, medium: str, runs: list[Run], clocks: SessionClocks | None
) -> tuple[_Remarks, _Remarks]:
    """Reasons and flags of some runs, by run_id."""
    reasons: _Remarks = {}
    flags: _Remarks = {}
    for portion in _portions(runs):
        part_campaign = replace(campaign, runs=portion)
        if campaign.numbers:
            samples, status, book = ingest_table(part_campaign, medium)
        else:
            samples, status, book = ingest_medium(part_campaign, medium, clocks)
        tared, tares, _ = tare_medium(part_campaign, medium, samples, status)
        fits, _, book_of_fits = fit_medium(
            part_campaign, medium, status, tared, tares, verdicts_only=True
        )
        for table in (status, tares, fits):
            rows = table[["run_id", *REASON]].to_dict("records")
            reasons |= {row["run_id"]: reason_of(row) for row in rows}
        flags |= dict.fromkeys(status["run_id"], ())
        gives_back = [flag for flag in book_of_fits.flags if flag.code == "gives-back"]
        for flag in (*book.flags, *gives_back):
            flags[flag.run_id] += (flag,)
    return reasons, flags


def _thin(campaign: Campaign) -> Campaign:
    """The campaign of a table with some hundred rows of each run."""
    numbers = {
        name: {column: values[:: 1 + values.size // _ROWS] for column, values in columns.items()}
        for name, columns in campaign.numbers.items()
    }
    return replace(campaign, numbers=numbers)


def _portions(runs: list[Run]) -> Iterator[tuple[Run, ...]]:
    """Part runs so that memory stays flat; a tare is in each portion that subtracts it."""
    tares = {run.run_id: run for run in runs if run.kind in TARE_KINDS}
    for start in range(0, len(runs), _AT_A_TIME):
        portion = runs[start : start + _AT_A_TIME]
        tare_runs = [tares[run.tare_run] for run in portion if run.tare_run in tares]
        yield tuple(dict.fromkeys([*portion, *tare_runs]))


def _sizes(campaign: Campaign, run: Run) -> list[int | None]:
    return [campaign.size_of(log) for log in (run.force_log, run.motion_log, run.zero_log) if log]


def _place(medium: str, members: list[Run], n_runs: int, fate: str) -> Place:
    count = f"{len(members)} of {n_runs} runs" if len(members) > 1 else "1 run"
    named = join_words([f"{run.run_id} (row {run.row})" for run in members])
    return Place(f"{medium}, {count} {fate}: {named}")
