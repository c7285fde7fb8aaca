"""``rftfit run``: options of a run, its progress bar, what is printed at its end; see `rftfit.workflow.run`."""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import print_line, warn
from rftfit.errors import InputError, OutputError
from rftfit.store.text import count, table
from rftfit.workflow.closing import closing_lines, failed_checks, media_without_alpha

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rftfit.workflow.snakemake import Job, Progress

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
"""Options of Snakemake that `rftfit run` sets itself: a second value would take the campaign or its records from it."""


def run(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGETS [-- SNAKEMAKE WORDS]",
            help="Results to make, default all; after two dashes, options of Snakemake itself.",
        ),
    ] = None,
    config: options.CampaignConfig = options.CONFIG,
    cores: options.Cores = None,
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
        options.word_option(
            "DIR",
            "Let the results lie in this folder, as on another disk: `results` becomes a link to it, once and for all.",
        ),
    ] = None,
    snakefile: Annotated[Path | None, typer.Option(hidden=True)] = None,
) -> None:
    """Make all results that are missing, edited, damaged or out of date, from logs to figures.

    Config and run sheet are checked first; with an error in them nothing is run. A failed job stops
    what depends on it and nothing else. Run again to go on.
    """
    from rftfit.workflow.run import Workflow

    # extra: options of Snakemake
    targets, extra = _split_words(words or [])
    workflow = Workflow(config, targets, extra, cores, cluster, snakefile, results_at, say=warn)
    if printed:
        workflow.add_paper_files()
    if workflow.states.warnings:
        warn(
            f"{count(workflow.states.warnings, 'warning')} on the campaign; `rftfit check` shows them."
        )
    if unlock:
        workflow.unlock()
        print_line("No lock is left. `rftfit run` goes on from what is finished.")
        return
    if dry_run:
        progress = workflow.dry_run()
    else:
        # the function that shows jobs becomes that attribute
        with shown_jobs() as workflow.on_job:
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


def _split_words(words: list[str]) -> tuple[list[str], list[str]]:
    """Split the words of the command line into targets and, from the first with a dash on, options of Snakemake.

    An option that this command sets itself is refused.
    """
    first = next((i for i, word in enumerate(words) if word.startswith("-")), len(words))
    for word in words[first:]:
        if word.partition("=")[0] in _RESERVED:
            raise InputError(
                f"found {word} after the two dashes; rftfit sets it itself: --config of rftfit run "
                "names the campaign"
            )
    return words[:first], words[first:]


@contextmanager
def shown_jobs() -> Iterator[Callable[[Progress, Job | None], None]]:
    """Yield a function that shows jobs as they finish: a bar in a terminal, else one line for each.

    It is to be `Workflow.on_job`: called after each line of Snakemake, with the progress and the job that has finished by
    this line, or None.
    """
    if not sys.stdout.isatty():

        def print_job(progress: Progress, finished: Job | None) -> None:
            """Print a line for a job that has finished, with the numbers of jobs done and planned."""
            if finished is not None:
                width = len(str(progress.total))
                print_line(f"[{progress.done:{width}d}/{progress.total}] {finished}")

        yield print_job
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bars

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Bars(*columns) as bars:
        task = bars.add_task("finding what has to be done", total=None)

        def move_bar(progress: Progress, finished: Job | None) -> None:
            """Move the bar to the number of jobs done, and name the job that has finished."""
            if finished is not None:
                failed = f", {len(progress.failed)} failed" if progress.failed else ""
                bars.update(task, description=f"{finished}{failed}")
            if progress.total:
                bars.update(task, total=progress.total, completed=progress.done)

        yield move_bar
