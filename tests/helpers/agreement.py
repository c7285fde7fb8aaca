"""What `rftfit check` says of a campaign beside what its stages do with it."""

import re

import pandas as pd
from jobs import run_rules

from rftfit.campaign.load import check_campaign
from rftfit.errors import InputError
from rftfit.measure.read import readers
from rftfit.page.outcome import outcome_of_runs
from rftfit.results import open_results

REFUSED, NOTHING, SOME, ALL = "refused", "nothing left", "some dropped", "all used"


def compare(folder, stages=()):
    """Check and run a campaign, by default all of it, and say in a word how it went.

    Raises
    ------
    AssertionError
        If `check` passes what the stages refuse, or drops what they use, or one of them breaks.
    """
    root = folder.root
    completed = folder.rftfit("check")
    campaign, problems = check_campaign(folder.config)
    if campaign is None:
        assert completed.returncode == 2, completed.stdout
        return REFUSED
    if fault := _fault_of_readers(campaign):
        assert completed.returncode == 2
        assert fault in completed.stdout
        return REFUSED
    run_rules(folder.config, *stages)
    of_sheet = {problem.place.row for problem in problems if problem.place.row is not None}
    excluded = [run for run in campaign.runs if run.excluded]
    empty = False
    lost: set[str] = set()
    for medium in campaign.media_with_runs:
        reasons = _reasons(root / "results", medium)
        runs = [run for run in campaign.runs_of(medium) if not run.excluded]
        lost_of_medium = {run.run_id for run in runs if reasons[run.run_id]}
        with_logs = {r.run_id for r in runs if _has_logs(campaign.raw, r)}
        assert _count_dropped(completed.stdout, medium) == len(lost_of_medium & with_logs), (
            sorted(lost_of_medium & with_logs),
            completed.stdout,
        )
        assert all(run.row in of_sheet for run in runs if run.run_id in lost_of_medium - with_logs)
        plates_and_legs = {run.run_id for run in runs if run.kind in ("plate", "leg")}
        nothing = (
            bool(lost_of_medium & with_logs)
            and (plates_and_legs & with_logs or with_logs) <= lost_of_medium
        )
        empty |= nothing
        lost |= lost_of_medium
    assert completed.returncode == (2 if empty else 0), completed.stdout
    # and the page tells of the same runs
    dropped = {str(row["run_id"]) for row in outcome_of_runs(open_results(root)).dropped}
    assert lost == dropped - {run.run_id for run in (*campaign.unassigned_air_runs, *excluded)}
    return NOTHING if empty else SOME if lost else ALL


def _fault_of_readers(campaign):
    try:
        if not campaign.numbers:
            readers(campaign)
    except InputError as error:
        return str(error)
    return ""


def _has_logs(raw, run):
    names = (run.force_log, run.motion_log, run.zero_log)
    return all((raw / name).is_file() for name in names if name)


def _reasons(results, medium):
    """Why each run gave no number, by the tables of the stages; empty where it gave one."""
    reasons: dict[str, str] = {}
    for name in ("runs", "tares", "fits"):
        table = pd.read_csv(results / name / f"{medium}.csv", dtype=str, keep_default_na=False)
        reasons |= dict(zip(table["run_id"], table["reason"], strict=True))
    return reasons


def _count_dropped(text, medium):
    """How many runs of a medium `check` says would be dropped."""
    lines = [line for line in text.splitlines() if line.startswith(f"  {medium}, ")]
    counts = [re.match(r".*?, (\d+) (?:of \d+ )?runs? would be dropped", line) for line in lines]
    return sum(int(count[1]) for count in counts if count)
