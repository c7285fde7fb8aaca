"""Last lines that `rftfit run` prints: findings, counts of runs and rows, files to look at, what was not made.

Paths of results are text, from the campaign's folder. A result is up to date where it and all that it is made from are as
the records of their jobs say (`rftfit.workflow.records.Recorded`); lines speak of such results alone.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.campaign.problems import join_words
from rftfit.errors import InputError
from rftfit.store.text import count
from rftfit.workflow.check import format_failures
from rftfit.workflow.stages import PRINT_RULES

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign
    from rftfit.workflow.records import Recorded

LOOK_AT = (
    "results/report.html",
    "results/figures",
    "results/quality",
    "results/robot_full",
    "results/alpha_tables.xlsx",
    "results/coefficients.csv",
    "results/penetration.csv",
    "results/reproduction.csv",
    "results/checks",
    "results/ledger.csv",
)
"""Files and folders that the last lines of a run name."""

PRINT = "rftfit run --print"
"""Command that draws the figures for a paper."""
LEDGER = "results/ledger.csv"
"""Table of what became of every row of every log."""
FINDINGS = "results/findings.csv"
"""Table of the sentences at the head of the report page, the most important first."""

MOST_NAMED = 5
"""Most files or jobs named in one line."""


def closing_lines(recorded: Recorded) -> list[str]:
    """List the lines: what the campaign found, from how many runs, the results to look at, and what was not made."""
    root = recorded.root
    current = {path for path in recorded.maker if recorded.is_current(path)}
    rows = _read_rows(root / FINDINGS)[:3] if FINDINGS in current else []
    # the three most important; a terminal may have no true minus sign
    findings = [f"  {row.get('finding', '')}".replace("\N{MINUS SIGN}", "-") for row in rows]
    counts = describe_ledger(root / LEDGER) if LEDGER in current else ""
    results = [*filter(None, (_format_result(root, current, name) for name in LOOK_AT))]
    return [
        *(["Found:", *findings] if findings else []),
        *filter(None, [counts]),
        *(["To look at:", *results] if results else []),
        *_name_print_command(recorded, current),
        *_count_outdated(recorded, current),
        *list_others(recorded),
    ]


def _read_rows(path: Path) -> list[dict[str, str]]:
    """Read the rows of a csv table, each a dict from column to cell; none where it cannot be read."""
    from rftfit.store import read_cells

    try:
        header, *rows = read_cells(path) or [[]]
    except (OSError, ValueError):
        return []
    # not strict: a damaged row may be shorter
    return [dict(zip(header, cells, strict=False)) for cells in rows]


def describe_ledger(path: Path) -> str:
    """Say how many runs and rows were used, excluded on purpose and dropped; empty where the ledger cannot be read.

    `path`: That of the ledger. It has a row for each run, log, ``fate`` (used or dropped) and reason, with ``rows``, the
    number of rows of the log.
    """
    from rftfit.measure.ledger import DROPPED, USED, runs_with_result
    from rftfit.store import read_csv

    try:
        ledger = read_csv(path, lambda name: "count" if name == "rows" else "text")
        used = len(runs_with_result(ledger))
        runs = ledger["run_id"].nunique()
        excluded = ledger.loc[ledger["reason_code"] == "excluded", "run_id"].nunique()
        # other fates count lost samples, which are no rows of a log
        rows_used, rows_dropped = (
            int(ledger.loc[ledger["fate"] == fate, "rows"].sum()) for fate in (USED, DROPPED)
        )
    except (OSError, KeyError, ValueError, TypeError, InputError):
        return ""
    if not runs or ledger["rows"].isna().any():
        return ""
    left_out = f", {excluded} excluded" if excluded else ""
    return (
        f"Of {count(runs, 'run')}, {used} used{left_out} and {runs - used - excluded} dropped; of "
        f"{rows_used + rows_dropped} rows, {rows_used} used. Every reason is in {LEDGER}."
    )


def _format_result(root: Path, current: set[str], name: str) -> str:
    """Format a line that names a result, or a folder with its number of results; empty where none is up to date.

    `current`: Paths of results that are up to date. `name`: Path of the file or folder. A table without rows has no line.
    """
    if name in current:
        is_empty = name.endswith(".csv") and not _read_rows(root / name)
        return "" if is_empty else f"  {name}"
    files_inside = sum(path.startswith(f"{name}/") for path in current)
    return f"  {name}/ ({count(files_inside, 'file')})" if files_inside else ""


def _name_print_command(recorded: Recorded, current: set[str]) -> list[str]:
    """Return a line with the command that draws the figures for a paper, where other figures are there and some of these not.

    `current`: Paths of results that are up to date.
    """
    lacking = [path for path in recorded.states.paper_files if path not in current]
    if not lacking or not any(path.startswith("results/figures/") for path in current):
        return []
    return [f"Figures for a paper, as pdf ({len(lacking)} to draw): {PRINT}"]


def _count_outdated(recorded: Recorded, current: set[str]) -> list[str]:
    """Say how many results are out of date, since this run was not asked for them, and which command makes them.

    `current`: Paths of results that are up to date.
    """
    old_by_command: Counter[str] = Counter()
    for path, record in recorded.maker.items():
        if path not in current:
            command = "rftfit sweep" if recorded.states.on_demand(record.name) else "rftfit run"
            old_by_command[PRINT if record.rule in PRINT_RULES else command] += 1
    return [
        f"Not up to date, as other results were asked for: {count(number, 'file')}; {command} makes them."
        for command, number in sorted(old_by_command.items())
    ]


def list_others(recorded: Recorded) -> list[str]:
    """Return a line that names files below ``results/`` that this campaign did not make; no line where there are none."""
    names = join_words(recorded.list_foreign_files(), MOST_NAMED)
    return [f"Not made by this campaign, and left as they are: {names}."] if names else []


def failed_checks(recorded: Recorded) -> list[str]:
    """Describe the failed physical checks of all media whose table of checks is up to date, a line each."""
    tables = (f"results/checks/{medium}.csv" for medium in recorded.states.campaign.media_with_runs)
    return [
        line
        for name in tables
        if recorded.is_current(name)
        for line in format_failures(_read_rows(recorded.root / name))
    ]


def media_without_alpha(campaign: Campaign) -> list[str]:
    """List media whose table of alpha is there and holds no number: a strict run fails for them."""
    from rftfit.results import Results

    results = Results(campaign)
    empty = []
    for medium in results.media:
        name = f"alpha/{medium}.csv"
        if results.has(name) and results.table(name)["alpha_z_N_per_cm3"].isna().all():
            empty.append(medium)
    return empty
