"""``rftfit run``: the workflow with sane defaults, progress, and failures that can be read."""

from __future__ import annotations

import contextlib
import csv
import shutil
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rftfit.campaign.problems import listed, shown
from rftfit.cli.output import count, say, table, warn
from rftfit.errors import InputError, OutputError, WorkflowError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.campaign.load import Campaign
    from rftfit.workflow.snakemake import Watcher


# --- ``--cluster``: the same workflow with its jobs on other machines, told by a Snakemake profile.


FILE = "config.yaml"
NOT_CLUSTERS = ("default",)
"""Profiles beside the Snakefile that run on this machine."""

_SUBMITS = {"slurm": "sbatch"}
"""Executor to the program that it hands jobs over with."""


def cluster_words(name: str, snakefile: Path, cores: int | None) -> list[str]:
    """Words for Snakemake that put the jobs on a cluster.

    `name`: Of a profile beside the Snakefile, or the path of a folder that holds one. `cores`: Of
    the largest job; default: what the profile says.
    """
    folder = find_profile(name, snakefile)
    executor = str(_read(folder / FILE).get("executor", "local"))
    _check_installed(executor, folder)
    return ["--workflow-profile", str(folder), *(["--cores", str(cores)] if cores else [])]


def find_profile(name: str, snakefile: Path) -> Path:
    """Find the folder of a profile.

    `name`: As for `cluster_words`.
    """
    own = snakefile.resolve().parent / "profiles"
    known = sorted(
        p.parent.name for p in own.glob(f"*/{FILE}") if p.parent.name not in NOT_CLUSTERS
    )
    if name in known:
        return own / name
    folder = Path(name).resolve()
    if (folder / FILE).is_file():
        return folder
    raise InputError(
        f"--cluster: found {name!r}; allowed: {', '.join(known)}, or a folder with a profile of "
        f"your own ({FILE})"
    )


def _read(path: Path) -> Mapping[str, Any]:
    import yaml

    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(values, dict):
        raise InputError(f"{path}: it must hold keys and values, as `executor: slurm`")
    return values


def _check_installed(executor: str, folder: Path) -> None:
    """Say what is missing before Snakemake does, in more words."""
    if executor in ("local", "dryrun", "touch"):
        return
    plugin = f"snakemake-executor-plugin-{executor}"
    if find_spec(plugin.replace("-", "_")) is None:
        raise InputError(
            f"the profile {folder.name} needs the package {plugin}, which is not installed; "
            f"install it with `python -m pip install {plugin}`"
            + (" (or `rftfit[cluster]`)" if executor in _SUBMITS else "")
        )
    program = _SUBMITS.get(executor)
    if program is not None and shutil.which(program) is None:
        raise InputError(
            f"there is no program {program} here, which hands jobs over to {executor}: start this "
            "on a machine of the cluster that may submit jobs"
        )


# --- What a finished workflow leaves to look at.


FILES = (
    "results/report.html",
    "results/figures",
    "results/quality",
    "results/alpha_tables.xlsx",
    "results/coefficients.csv",
    "results/penetration.csv",
    "results/reproduction.csv",
    "results/ledger.csv",
)
LEDGER = "results/ledger.csv"


def closing_lines(root: Path) -> list[str]:
    """Name the results that are there, and say how many runs they stand on.

    `root`: Folder of the campaign. Returns empty where there is nothing yet.
    """
    lines = [line for name in FILES if (line := _shown(root, name))]
    if lines:
        lines.insert(0, "To look at:")
    fates = ledger_line(root / LEDGER)
    return [*lines, fates] if fates else lines


def _shown(root: Path, name: str) -> str:
    path = root / name
    if not path.is_dir():
        return f"  {name}" if path.is_file() else ""
    found = sum(1 for inside in path.rglob("*") if inside.is_file())
    return f"  {name}/ ({count(found, 'file')})" if found else ""


def ledger_line(path: Path) -> str:
    """Count the runs and rows that were used and dropped.

    `path`: The ledger. Returns empty if there is no ledger, or it is none.
    """
    runs: dict[str, bool] = {}
    rows = {"used": 0, "dropped": 0}
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            for row in csv.DictReader(handle):
                used = row["fate"] == "used"
                runs[row["run_id"]] = runs.get(row["run_id"], False) or used
                rows["used" if used else "dropped"] += int(row["rows"])
    except (OSError, KeyError, ValueError, TypeError, csv.Error):
        return ""
    if not runs:
        return ""
    good = sum(runs.values())
    return (
        f"Of {count(len(runs), 'run')}, {good} used and {len(runs) - good} dropped; of "
        f"{sum(rows.values())} rows, {rows['used']} used. Every reason is in {LEDGER}."
    )


# --- Logs that have changed since results were made from them: said before they are made anew.


_MOST = 5


def say_changes(campaign: Campaign) -> None:
    """Warn of logs whose content is no longer what the last whole run read."""
    from rftfit.store.digests import read_sums
    from rftfit.workflow.provenance import SUMS, all_log_names, digests_of_logs, logs_seen

    sums: dict[str, str] = {}
    if (campaign.root / SUMS).is_file():
        # a damaged list is made anew by the run itself
        with contextlib.suppress(InputError):
            sums = read_sums(campaign.root / SUMS)
    if not sums:
        return
    raw = campaign.raw.relative_to(campaign.root).as_posix()
    seen = logs_seen(campaign)
    found = digests_of_logs(campaign, all_log_names(campaign), seen)
    # Snakemake then need not read them a second time
    seen.save()
    changed = [name for name, now in found.items() if sums.get(f"{raw}/{name}", now) != now]
    gone = [name for name in changed if not found[name]]
    other = [name for name in changed if found[name]]
    for names, what in ((other, "changed"), (gone, "gone")):
        if names:
            warn(f"{count(len(names), 'log')} {what} since the results were made: {listed(map(shown, names), _MOST)}")  # fmt: skip


# --- ``rftfit run``: the workflow with sane defaults, progress, and failures that can be read.


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
    from rftfit.campaign.load import root_of
    from rftfit.workflow.snakemake import find_snakefile

    targets, extra = _split(words or [])
    root = root_of(config)
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
    from rftfit.workflow.snakemake import Watcher, display, failure_text, listen, nothing_written

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
    from rftfit.workflow.processes import left_by_the_dead
    from rftfit.workflow.snakemake import listen

    with left_by_the_dead(root / ".snakemake") as certain:
        if certain and listen([*command, "--unlock"], root, None, lambda _: None) == 0:
            warn("An earlier run was killed: its lock is cleared, and this one goes on from there.")


def _unlock(command: list[str], root: Path) -> None:
    from rftfit.workflow.snakemake import listen, working_in

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
    from rftfit.workflow.snakemake import working_in

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
