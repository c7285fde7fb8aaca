"""``rftfit run``: the workflow with sane defaults, progress, and failures that can be read."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.output import count, say, table, warn
from rftfit.errors import InputError, OutputError, WorkflowError

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign
    from rftfit.cli.snakemake_output import Watcher

LOG = Path("results/logs/snakemake.log")

_RESERVED = ("--config", "-C", "--snakefile", "-s", "--directory", "-d")


def run(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TARGETS]... [-- SNAKEMAKE WORDS]...",
            help="Results to make, default all; after two dashes, options of Snakemake itself.",
        ),
    ] = None,
    config: Annotated[Path, typer.Option(help="The campaign's configuration.")] = Path(
        "config/config.yaml"
    ),
    cores: Annotated[
        int | None, typer.Option(min=1, help="Jobs at once; default: all cores.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            help="Hand the jobs over to a cluster: slurm, or a folder with a Snakemake profile."
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", "-n", help="Say what would be done, and do nothing.")
    ] = False,
    unlock: Annotated[
        bool, typer.Option("--unlock", help="Clear the lock that a killed run has left, and stop.")
    ] = False,
    snakefile: Annotated[Path | None, typer.Option(hidden=True)] = None,
) -> None:
    """Make all results that are missing or out of date, from logs to figures.

    Config and run sheet are checked first; with an error in them nothing is run. A failed job stops
    what depends on it and nothing else. Run again to go on.
    """
    from rftfit.cli.campaign_paths import campaign_root
    from rftfit.cli.cluster import cluster_words
    from rftfit.cli.results import closing_lines
    from rftfit.cli.run_changes import say_changes
    from rftfit.cli.snakemake_process import find_snakefile

    targets, extra = _split(words or [])
    root = campaign_root(config)
    source = (snakefile or find_snakefile()).resolve()
    if cluster is None:
        where = ["--cores", str(cores or "all")]
    else:
        where = cluster_words(cluster, source, cores)
    command = [
        *targets,
        *("--snakefile", str(source)),
        *("--directory", str(root)),
        *where,
        # it takes all words up to the next option
        *(
            "--config",
            f"campaign={(config.absolute().parent.resolve() / config.name).relative_to(root).as_posix()}",
        ),
        *("--rerun-incomplete", "--keep-going", "--scheduler", "greedy", "--nocolor"),
        *extra,
    ]
    campaign = _check(config)
    if not unlock and not dry_run:
        _clear_lock_of_the_dead(command, root)
    if unlock:
        _unlock(command, root)
    elif dry_run:
        say_changes(campaign)
        _show_plan(_watch([*command, "--dry-run"], root, None, plain=bool(extra)), root)
    else:
        say_changes(campaign)
        watcher = _watch(command, root, root / LOG, plain=bool(extra))
        if watcher.nothing_to_do:
            say("Nothing to do: all results are up to date.")
        elif watcher.total:
            say(f"Done: {count(watcher.done, 'job')}.")
        for line in closing_lines(root):
            say(line)


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


def _check(config: Path) -> Campaign:
    from rftfit.campaign.load import check_campaign
    from rftfit.campaign.problems import CampaignError

    campaign, problems = check_campaign(config)
    if campaign is None:
        raise CampaignError(problems)
    if problems:
        warn(f"{count(len(problems), 'warning')} on the campaign; `rftfit check` shows them.")
    return campaign


def _watch(command: list[str], root: Path, log: Path | None, *, plain: bool) -> Watcher:
    """Run Snakemake to its end; an error becomes a `WorkflowError` that says why."""
    from rftfit.cli.failures import failure_text, nothing_written
    from rftfit.cli.progress import display
    from rftfit.cli.snakemake_output import Watcher
    from rftfit.cli.snakemake_process import listen

    watcher = Watcher()
    lines: list[str] = []
    try:
        with display() as shown:

            def on_line(line: str) -> None:
                lines.append(line)
                shown.update(watcher, watcher.feed(line))

            status = listen(command, root, log, on_line)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            "Stopped. Results that were finished are kept; `rftfit run` goes on from there."
        ) from None
    watcher.close()
    if watcher.locked:
        raise WorkflowError(_lock_text(root))
    if status:
        named = log.relative_to(root) if log else Path("(not kept in a dry run)")
        kind = OutputError if nothing_written(watcher, root) else WorkflowError
        raise kind(failure_text(watcher, root, named, status))
    if plain and not watcher.total and not watcher.nothing_to_do:
        # something was asked of Snakemake itself: --summary, --list-rules, --dag
        say("\n".join(lines))
    return watcher


def _show_plan(watcher: Watcher, root: Path) -> None:
    jobs = Counter(job.rule for job in watcher.jobs.values())
    if watcher.nothing_to_do or not jobs:
        say(f"Nothing to do: all results of {root.name} are up to date.")
        return
    say(f"{count(watcher.total, 'job')} would run:")
    rows = []
    for rule, number in jobs.items():
        own = [job.title.split()[1:] for job in watcher.jobs.values() if job.rule == rule]
        rows.append([rule, str(number), ", ".join(" ".join(words) for words in own if words)])
    say(table(["rule", "jobs", "for"], rows))


def _clear_lock_of_the_dead(command: list[str], root: Path) -> None:
    """Clear the lock of a killed run where it is certain that nobody holds it."""
    from rftfit.cli.snakemake_process import listen
    from rftfit.store.holder import left_by_the_dead

    with left_by_the_dead(root / ".snakemake") as certain:
        if certain and listen([*command, "--unlock"], root, None, lambda _: None) == 0:
            warn("An earlier run was killed: its lock is cleared, and this one goes on from there.")


def _unlock(command: list[str], root: Path) -> None:
    from rftfit.cli.snakemake_process import listen, working_in

    others = working_in(root)
    if others:
        raise WorkflowError(
            f"a workflow is running in {root} (process {', '.join(map(str, others))}), so its lock "
            "stays; wait for it, or end it first"
        )
    lines: list[str] = []
    if listen([*command, "--unlock"], root, None, lines.append):
        raise WorkflowError("the lock cannot be cleared: " + " ".join(lines[-3:]))
    say("No lock is left. `rftfit run` goes on from what is finished.")


def _lock_text(root: Path) -> str:
    from rftfit.cli.snakemake_process import working_in

    others = working_in(root)
    if others:
        return (
            f"another workflow is running in {root} (process {', '.join(map(str, others))}): two "
            "at once would write the same files. Wait for it; nothing was run."
        )
    return (
        f"{root} is locked, and no workflow seems to be running there: an earlier one was killed "
        "before it could clear its lock. If none runs on another machine that shares this folder, "
        "clear the lock with\n  rftfit run --unlock\nand run again. Finished results are kept."
    )
