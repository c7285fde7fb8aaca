"""``rftfit run``: the workflow with sane defaults, progress, and failures that can be read."""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.campaign.problems import join_words
from rftfit.cli import options
from rftfit.cli.output import print_line, warn
from rftfit.errors import InputError, OutputError
from rftfit.store.text import count, table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rftfit.campaign.load import Campaign
    from rftfit.workflow.records import Recorded
    from rftfit.workflow.snakemake import Job, Progress

FILES = (
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
FIGURES = "results/figures/"
PRINT = "rftfit run --print"
LEDGER = "results/ledger.csv"
FINDINGS = "results/findings.csv"

_MOST = 5

_RESERVED = (
    "--config",
    "-C",
    "--snakefile",
    "-s",
    "--directory",
    "-d",
    "--forcerun",
    "-R",
    "--logger",
)


def run(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGETS [-- SNAKEMAKE WORDS]",
            help="Results to make, default all; after two dashes, options of Snakemake itself.",
        ),
    ] = None,
    config: options.CampaignConfig = options.CONFIG,
    cores: Annotated[
        int | None, typer.Option(min=1, help="Jobs at once; default: all cores.")
    ] = None,
    cluster: options.Cluster = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", "-n", help="Say what would be done, and do nothing.")
    ] = False,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="End with exit code 3 where a medium has no alpha at all."),
    ] = False,
    printed: Annotated[
        bool,
        typer.Option("--print", help="Draw the figures as pdf too, for a paper, into results."),
    ] = False,
    unlock: Annotated[
        bool, typer.Option("--unlock", help="Clear the lock that a killed run has left, and stop.")
    ] = False,
    results_at: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Let the results lie in this folder, as on another disk: `results` becomes a link to it, once and for all.",
        ),
    ] = None,
    snakefile: Annotated[Path | None, typer.Option(hidden=True)] = None,
) -> None:
    """Make all results that are missing, edited, damaged or out of date, from logs to figures.

    Config and run sheet are checked first; with an error in them nothing is run. A failed job stops
    what depends on it and nothing else. Run again to go on.
    """
    from rftfit.workflow.run import Workflow

    targets, extra = _split(words or [])
    workflow = Workflow(config, targets, extra, cores, cluster, snakefile, results_at, say=warn)
    if printed:
        workflow.add_printed()
    if workflow.warnings:
        warn(f"{count(workflow.warnings, 'warning')} on the campaign; `rftfit check` shows them.")
    if unlock:
        workflow.unlock()
        print_line("No lock is left. `rftfit run` goes on from what is finished.")
        return
    if dry_run:
        progress = workflow.dry_run()
    else:
        with shown_jobs(workflow.seconds_left) as workflow.on_job:
            progress = workflow.run()
    if progress.nothing_to_do:
        print_line("Nothing to do: all results are up to date.")
    elif extra and not progress.total:
        # something was asked of Snakemake itself: --summary, --list-rules, --dag
        print_line("\n".join(progress.plain))
    elif dry_run:
        print_line(f"At most {count(progress.total, 'job')}:")
        rules = Counter(job.rule for job in progress.jobs.values())
        print_line(table(["rule", "jobs"], [[rule, str(jobs)] for rule, jobs in rules.items()]))
    elif progress.total:
        kept = f"; {len(progress.skipped)} more were still right" if progress.skipped else ""
        print_line(f"Done: {count(len(progress.made), 'job')}{kept}.")
    if not dry_run:
        for line in [*closing_lines(workflow.recorded), *failed_checks(workflow.recorded)]:
            print_line(line)
    if strict and not dry_run and (empty := media_without_alpha(workflow.states.campaign)):
        warn(
            f"No alpha at all: {', '.join(empty)}. The reasons are in results/fits/ and in the page."
        )
        raise typer.Exit(OutputError.exit_code)


def media_without_alpha(campaign: Campaign) -> list[str]:
    """Media of which no plate run gave a number, by the tables that are there."""
    from rftfit.results import Results

    results, empty = Results(campaign), []
    for medium in results.media:
        name = f"alpha/{medium}.csv"
        if results.has(name) and results.table(name)["alpha_z_N_per_cm3"].isna().all():
            empty.append(medium)
    return empty


def _split(words: list[str]) -> tuple[list[str], list[str]]:
    """Targets, and from the first word with a dash on what is Snakemake's."""
    first = next((i for i, word in enumerate(words) if word.startswith("-")), len(words))
    for word in words[first:]:
        if word.partition("=")[0] in _RESERVED:
            raise InputError(
                f"found {word} after the two dashes; rftfit sets it itself: --config of rftfit run "
                "names the campaign"
            )
    return words[:first], words[first:]


@contextmanager
def shown_jobs(
    seconds_left: Callable[[Progress], float | None],
) -> Iterator[Callable[[Progress, Job | None], None]]:
    """Show jobs as they finish: a bar and the time left in a terminal, one line for each in a pipe or file."""
    if not sys.stdout.isatty():

        def line(progress: Progress, finished: Job | None) -> None:
            if finished is not None:
                width = len(str(progress.total))
                print_line(f"[{progress.done:{width}d}/{progress.total}] {finished}")

        yield line
        return
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
        TextColumn("{task.description}"),
    )
    with Bars(*columns) as bars:
        task = bars.add_task("finding what has to be done", total=None, left="")

        def bar(progress: Progress, finished: Job | None) -> None:
            if finished is not None:
                failed = f", {len(progress.failed)} failed" if progress.failed else ""
                bars.update(task, description=f"{finished}{failed}")
            if progress.total:
                left = words_of(seconds_left(progress))
                bars.update(task, total=progress.total, completed=progress.done, left=left)

        yield bar


def words_of(seconds: float | None) -> str:
    """Say about how much time is left: tens of seconds, then minutes; empty where it is not known."""
    if seconds is None:
        return ""
    if seconds < 55:
        return f"about {max(10, 10 * round(seconds / 10))} s left"
    return f"about {round(seconds / 60)} min left"


def closing_lines(recorded: Recorded) -> list[str]:
    """Say what was found and how many runs it stands on, and name the results that are there."""
    root = recorded.root
    # a terminal may have no true minus sign
    sentences = [
        f"  {row.get('finding', '')}".replace("\N{MINUS SIGN}", "-")
        for row in _rows(root / FINDINGS)[:3]
        if recorded.is_current(FINDINGS)
    ]
    counts = ledger_line(root / LEDGER) if recorded.is_current(LEDGER) else ""
    current = {path for path in recorded.maker if recorded.is_current(path)}
    shown = [line for name in FILES if (line := _shown(root, current, name))]
    return [
        *(["Found:", *sentences] if sentences else []),
        *filter(None, [counts]),
        *(["To look at:", *shown] if shown else []),
        *_for_a_paper(recorded, current),
        *_not_remade(recorded, current),
        *others_line(recorded),
    ]


def _for_a_paper(recorded: Recorded, current: set[str]) -> list[str]:
    """Name the command that draws the figures for a paper, where they are not drawn."""
    lacking = [path for path in recorded.states.printed if path not in current]
    if not lacking or not any(path.startswith(FIGURES) for path in current):
        return []
    return [f"Figures for a paper, as pdf ({len(lacking)} to draw): {PRINT}"]


def _not_remade(recorded: Recorded, current: set[str]) -> list[str]:
    """Say how many results are older than what they are made from, and were not asked for."""
    from rftfit.workflow.stages import PRINT_RULES

    old_by_command: Counter[str] = Counter()
    for path, record in recorded.maker.items():
        if path not in current:
            on_demand = "rftfit sweep" if recorded.states.on_demand(record.name) else "rftfit run"
            old_by_command[PRINT if record.rule in PRINT_RULES else on_demand] += 1
    return [
        f"Not up to date, as other results were asked for: {count(number, 'file')}; {command} makes them."
        for command, number in sorted(old_by_command.items())
    ]


def others_line(recorded: Recorded) -> list[str]:
    """Name files among the results that are none of this campaign, if there are any."""
    names = join_words(recorded.list_foreign_files(), _MOST)
    return [f"Not made by this campaign, and left as they are: {names}."] if names else []


def _rows(path: Path) -> list[dict[str, str]]:
    """Rows of a table, none where it cannot be read."""
    from rftfit.store import read_cells

    try:
        header, *rows = read_cells(path) or [[]]
    except (OSError, ValueError):
        return []
    return [dict(zip(header, cells, strict=False)) for cells in rows]


def failed_checks(recorded: Recorded) -> list[str]:
    """What the checks say of the media that fail one."""
    return [
        f"{row['medium']}, {row['effect'] or row['verdict']}: {row['sentence']}"
        for medium in recorded.states.campaign.media_with_runs
        if recorded.is_current(f"results/checks/{medium}.csv")
        for row in _rows(recorded.root / f"results/checks/{medium}.csv")
        if row.get("verdict") in ("failed", "accepted")
    ]


def _shown(root: Path, current: set[str], name: str) -> str:
    """A line about a result, or about the files of a folder, that are up to date; empty where there is nothing to see."""
    if name in current:
        is_empty = name.endswith(".csv") and not _rows(root / name)
        return "" if is_empty else f"  {name}"
    inside = sum(path.startswith(f"{name}/") for path in current)
    return f"  {name}/ ({count(inside, 'file')})" if inside else ""


def ledger_line(path: Path) -> str:
    """Count the runs and rows that were used, excluded on purpose and dropped; empty where there is no ledger."""
    from rftfit.page.outcome import USED_AS

    runs: dict[str, bool] = {}
    excluded: set[str] = set()
    rows = {"used": 0, "dropped": 0}
    try:
        for row in _rows(path):
            used, count_of_rows = row["fate"] == "used", int(row["rows"])
            good = used and count_of_rows > 0 and row["reason_code"] == USED_AS.get(row["kind"])
            runs[row["run_id"]] = runs.get(row["run_id"], False) or good
            if row["reason_code"] == "excluded":
                excluded.add(row["run_id"])
            if row["fate"] in rows:  # a sample that was lost is no row of a log
                rows[row["fate"]] += count_of_rows
    except (KeyError, ValueError, TypeError):
        return ""
    if not runs:
        return ""
    kept = sum(runs.values())
    left_out = f", {len(excluded)} excluded" if excluded else ""
    return (
        f"Of {count(len(runs), 'run')}, {kept} used{left_out} and {len(runs) - kept - len(excluded)} dropped; of "
        f"{sum(rows.values())} rows, {rows['used']} used. Every reason is in {LEDGER}."
    )
