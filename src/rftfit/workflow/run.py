"""`rftfit run`: results brought up to date by Snakemake; what is said of outdated ones; profiles of clusters.

A job is one use of a rule, such as ``slopes/poppy_LP`` (rule and medium). Each finished job has left a record: what it read
and wrote, by SHA-256, and its state, digests of the code, settings, run sheet and logs that it used. `Workflow.run` compares
the records with what is there now, marks jobs that are out of date, starts Snakemake as a child process, which plans and
does them, and follows its output (`rftfit.workflow.snakemake`).
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from rftfit.campaign.problems import join_words
from rftfit.errors import InputError, OutputError, WorkflowError
from rftfit.measure.long_logs import MOST_ROWS
from rftfit.measure.read import readers
from rftfit.store.links import RESULTS, put_results_at
from rftfit.workflow.closing import MOST_NAMED
from rftfit.workflow.processes import stale_lock
from rftfit.workflow.records import OutdatedResult, Recorded
from rftfit.workflow.snakemake import (
    Job,
    Progress,
    describe_failed_jobs,
    describe_failure,
    failed_to_write,
    find_snakefile,
    find_snakemakes,
    run_snakemake,
)
from rftfit.workflow.stages import LAST
from rftfit.workflow.state import HANDED, LEAST_MB, States, guard_written, hand_over, read_states

LOG = Path("results/logs/snakemake.log")
"""File with all output of Snakemake, from the campaign's folder."""


@dataclass(frozen=True)
class RunReport:
    """What a run of the workflow did.

    Attributes
    ----------
    made : list of str
        Jobs that were done, in their order: rule and medium, figure or profile.
    skipped : list of str
        Planned jobs that were not done, since what they read came out the same.
    failed : dict of str to str
        Why a job failed, by the job.
    reasons : list of str
        What was edited, damaged, missing or changed, so that it was made again.

    Examples
    --------
    >>> import rftfit
    >>> rftfit.run("my_campaign").made  # doctest: +SKIP
    """

    made: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    reasons: list[str] = field(default_factory=list)


class JobsFailedError(WorkflowError):
    """The workflow stopped since jobs failed, or results could not be written.

    `report`: What was done before. `exit_code`: That of the command `rftfit run`.
    """

    def __init__(self, text: str, report: RunReport, exit_code: int) -> None:
        super().__init__(text)
        self.report = report
        self.exit_code = exit_code


@dataclass
class Workflow:
    """One call of the workflow. To make it reads and checks the campaign, and raises CampaignError for one with errors.

    `config`: Path of the config. `targets`: Paths of results, from the campaign's folder, or names of jobs; empty for all.
    `words`: Further options for Snakemake itself. `cores`: Jobs at once; None: all cores. `cluster`: Profile that puts the
    jobs on a cluster (`find_profile`); None: they run on this machine. `snakefile`: Another workflow instead of the shipped
    one, for tests. `results_at`: Folder that the results are to lie in; None: ``results`` of the campaign, as it is.
    `say`: Function that gets what is made again and why, line by line. `on_job`: Function that gets the progress after
    each line of Snakemake, and the job that has finished by this line, or None.

    Attributes that it makes: `states`, the campaign and the states of its jobs; `recorded`, the records, compared with
    what is there now; `root`, the campaign's folder; `reasons`, the sentences on what was out of date.
    """

    config: Path
    targets: Sequence[str] = ()
    words: Sequence[str] = ()
    cores: int | None = None
    cluster: str | None = None
    snakefile: Path | None = None
    results_at: Path | None = None
    say: Callable[[str], None] = field(default=lambda _: None)
    on_job: Callable[[Progress, Job | None], None] = field(default=lambda *_: None)

    def __post_init__(self) -> None:
        self.states = read_states(self.config)
        self.recorded = Recorded(self.states)
        self.root = self.states.campaign.root
        self.reasons: list[str] = []
        _refuse_packages(self.root)
        if self.results_at is not None:
            put_results_at(self.root, self.results_at)
        guard_written(self.states.campaign)

    def add_paper_files(self) -> None:
        """Add the figures for a paper, as pdf, to the targets; without targets, to all results of a whole run."""
        # without targets Snakemake makes the last result, which needs all others: beside other targets it has to be named
        self.targets = [*(self.targets or [f"{RESULTS}/{LAST}.json"]), *self.states.paper_files]

    def run(self) -> Progress:
        """Make all results that are missing or out of date; return what Snakemake did. A failed job raises JobsFailedError."""
        if not self._mark_outdated():
            return Progress(nothing_to_do=True)
        # a table of numbers instead of logs needs no readers of logs
        if not self.states.campaign.numbers:
            readers(self.states.campaign)  # refuses an unknown dialect before any job starts
        self._clear_stale_lock()
        self.recorded.bring_times_back()
        progress = self._watch(self._command(), self.root / LOG)
        # records and files as they are after the run
        self.recorded = Recorded(self.states)
        self._refuse_outdated_targets()
        return progress

    def _refuse_outdated_targets(self) -> None:
        """Raise where a run without error left a target out of date, because the times of files misled Snakemake."""
        recorded_targets = {*self.recorded.maker, *self.recorded.records}
        # another workflow, or options for Snakemake, may leave results out of date on purpose; of a target without a
        # record it is not known which jobs it needs
        if self.snakefile or self.words or not recorded_targets.issuperset(self.targets):
            return
        findings = self.recorded.findings_of_targets(self.targets)
        jobs_left = list(dict.fromkeys(finding.job for finding in findings))
        if jobs_left:
            names = join_words([name.replace("/", " ") for name in jobs_left], MOST_NAMED)
            raise WorkflowError(
                f"still out of date after this run: {names}. Snakemake goes by the times of files, and those of this disk "
                "or clock are not in order: delete the folder results, then run again"
            )

    def dry_run(self) -> Progress:
        """Find the jobs that a run would do, without doing them: `jobs` of the returned progress.

        Jobs that are out of date are marked in files, as for a run.
        """
        if not self._mark_outdated():
            return Progress(nothing_to_do=True)
        return self._watch([*self._command(), "--dry-run"], None)

    def _mark_outdated(self) -> bool:
        """Find the jobs that are not as recorded, say why, and mark them so that Snakemake plans them.

        Returns False where Snakemake need not be started, since all targets are as recorded. Starting it takes seconds.
        """
        # the records say nothing about another workflow
        if self.snakefile:
            return True
        findings = self.recorded.findings_of_targets(self.targets)
        self.reasons = describe_findings(findings)
        for line in self.reasons:
            self.say(line)
        self.recorded.make_outdated(findings)
        # options for Snakemake may ask for jobs that are up to date
        if not findings and not self.words:
            return False
        for line in describe_memory(self.states, self.recorded):
            self.say(line)
        return True

    def unlock(self) -> None:
        """Clear the lock that a killed run has left in the campaign's folder; raise while a workflow runs there."""
        if process_ids := find_snakemakes(self.root):
            raise WorkflowError(
                f"a workflow is running in {self.root} (process {', '.join(map(str, process_ids))}), so its "
                "lock stays; wait for it, or end it first"
            )
        lines: list[str] = []
        if run_snakemake([*self._command(), "--unlock"], None, lines.append):
            raise WorkflowError("the lock cannot be cleared: " + " ".join(lines[-3:]))

    def _command(self) -> list[str]:
        """Return the words of the command line for Snakemake: targets, where jobs run, and how it plans them.

        The config is named from the campaign's folder, so that the command of a job is the same on any machine.
        """
        source = (self.snakefile or find_snakefile()).resolve()
        where = ["--cores", str(self.cores or "all")]
        if self.cluster is not None:
            where = _cluster_words(self.cluster, source, self.cores)
        config = self.config.absolute().parent.resolve() / self.config.name
        return [
            *self.targets,
            *("--snakefile", str(source), "--directory", str(self.root), *where),
            *("--config", f"campaign={config.relative_to(self.root).as_posix()}"),
            *("--rerun-incomplete", "--keep-going", "--scheduler", "greedy", "--nocolor"),
            # Snakemake shall compare times alone: a state file that was written anew plans its job, whatever it holds
            *("--max-checksum-file-size", "0"),
            # state files are written while jobs are planned: a list of their folder made before lacks them
            *("--max-inventory-time", "0"),
            *("--logger", "rftfit"),
            *self.words,
        ]

    def _watch(self, command: list[str], log: Path | None) -> Progress:
        """Run Snakemake to its end and return its progress; an error becomes a `WorkflowError` that says why.

        `command`: Words for Snakemake. `log`: File for its output; None for a dry run, which keeps none.
        """
        progress = Progress()

        def on_line(line: str) -> None:
            """Update the progress by a line of Snakemake, and hand it on."""
            self.on_job(progress, progress.update_by(line))

        try:
            # a dry run has no jobs; those of a cluster or of another workflow are not forked from here
            forks_jobs = log is not None and self.cluster is None and self.snakefile is None
            if forks_jobs and sys.platform == "linux":
                command = [*command, "--executor", "rftfit"]
            with TemporaryFile(buffering=0) as file:
                environment = {HANDED: hand_over(self.states, file)}
                status = run_snakemake(command, log, on_line, **environment)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                "Stopped. Results that were finished are kept; to go on, give the same command again."
            ) from None
        if progress.locked:
            raise WorkflowError(self._describe_lock())
        if status:
            log_name = log.relative_to(self.root) if log else Path("(not kept in a dry run)")
            text = describe_failure(progress, self.root, log_name, status)
            error = OutputError if failed_to_write(progress, self.root) else WorkflowError
            raise JobsFailedError(text, self.report(progress), error.exit_code)
        return progress

    def report(self, progress: Progress) -> RunReport:
        """Report for users of the package what a run has done, by its progress at the end."""
        made, skipped = [*map(str, progress.made)], [*map(str, progress.skipped)]
        return RunReport(made, skipped, describe_failed_jobs(progress, self.root), self.reasons)

    def _clear_stale_lock(self) -> None:
        """Clear the lock of a killed run where it is certain that nobody holds it: else the user is asked to do so."""
        with stale_lock(self.root / ".snakemake") as certain:
            if certain and run_snakemake([*self._command(), "--unlock"], None, lambda _: None) == 0:
                self.say(
                    "An earlier run was killed: its lock is cleared, and this one goes on from there."
                )

    def _describe_lock(self) -> str:
        """Say who holds the lock by which Snakemake keeps a second one out of the campaign's folder, and what to do."""
        if process_ids := find_snakemakes(self.root):
            return (
                f"another workflow is running in {self.root} (process {', '.join(map(str, process_ids))}): "
                "two at once would write the same files. Wait for it; nothing was run."
            )
        return (
            f"{self.root} is locked, and no workflow seems to be running there: an earlier one was "
            "killed before it could clear its lock. If none runs on another machine that shares this "
            "folder, clear the lock with\n  rftfit run --unlock\nand run again. Finished results are kept."
        )


def describe_findings(findings: Sequence[OutdatedResult]) -> list[str]:
    """Say what is made again and why: a line on edited results, one on missing ones, one for each changed part of states.

    Inputs that changed (sort ``input``) need no line, as the result behind them has one, and jobs that never finished (``new``)
    are no surprise.
    """
    lines = []
    for sort, what in (("edited", "not as written (edited or damaged)"), ("missing", "not there")):
        names = [finding.what for finding in findings if finding.sort == sort]
        if names:
            lines.append(f"{what}, made again: {join_words(names, MOST_NAMED)}")
    # by the changed part of the state, such as "settings": names of jobs, as keys so that each stands once, in order
    jobs_by_change: dict[str, dict[str, None]] = {}
    for finding in findings:
        if finding.sort == "changed":
            jobs_by_change.setdefault(finding.what, {})[finding.job.replace("/", " ")] = None
    since = "changed since the results were made"
    return lines + [
        f"{what} {since}: {join_words(jobs, MOST_NAMED)}" for what, jobs in jobs_by_change.items()
    ]


def describe_memory(states: States, recorded: Recorded) -> list[str]:
    """Say how much memory it takes to read the logs of media that are not read yet, a line for each that needs much.

    So a run that would end by a full memory is foreseen. A medium with a log so long that it is averaged has a line, too.
    """
    lines = []
    for medium in states.campaign.media_with_runs:
        # the result for which the logs are read
        if recorded.is_current(f"{RESULTS}/traces/{medium}.parquet"):
            continue
        need = states.memory(medium)
        if need.megabytes < LEAST_MB and not need.long_logs:
            continue
        about = f"reading the logs of {medium} needs up to {need.megabytes} MB of memory"
        if need.long_logs:
            sizes = [f"{name} ({size / 1e6:.0f} MB)" for name, size in need.long_logs.items()]
            about += (
                f"; where one has more than {MOST_ROWS} rows, the means of neighbours are kept: "
                f"{join_words(sizes, MOST_NAMED)}"
            )
        lines.append(about)
    return lines


def _refuse_packages(root: Path) -> None:
    """Refuse a campaign folder with packages in it that Snakemake would import: they may be somebody else's code."""
    folder = root / ".snakemake" / "pip-deployments"
    if os.path.lexists(folder):
        raise InputError(
            f"{folder}: Snakemake would execute what is in this folder, and rftfit puts nothing "
            "there; see where it came from, delete it, then run again"
        )


# --- clusters


def _cluster_words(name: str, snakefile: Path, cores: int | None) -> list[str]:
    """Return options of Snakemake that put the jobs on a cluster; refuse a profile that cannot work here.

    A profile is a folder with options of Snakemake in a file. `name`: Name or path of the profile (`find_profile`).
    `snakefile`: Path of the workflow, beside which the shipped profiles lie. `cores`: Most cores of one job; None: as the
    profile says.
    """
    folder = find_profile(name, snakefile)
    # the executor hands jobs over: "slurm", or "local" on this machine
    executor = str(_read_profile(folder / _PROFILE_FILE).get("executor", "local"))
    _check_installed(executor, folder)
    return ["--workflow-profile", str(folder), *(["--cores", str(cores)] if cores else [])]


_PROFILE_FILE = "config.yaml"
"""File in the folder of a profile that holds its options."""


def find_profile(name: str, snakefile: Path) -> Path:
    """Find the folder of a profile; `name`: a profile in ``profiles`` beside the Snakefile, or the path of a folder."""
    profiles_folder = snakefile.resolve().parent / "profiles"
    names = {path.parent.name for path in profiles_folder.glob(f"*/{_PROFILE_FILE}")}
    # the profile "default" runs jobs on this machine
    cluster_names = sorted(names - {"default"})
    if name in cluster_names:
        return profiles_folder / name
    folder = Path(name).resolve()
    if (folder / _PROFILE_FILE).is_file():
        return folder
    raise InputError(
        f"--cluster: found {name!r}; allowed: {', '.join(cluster_names)}, or a folder with a profile of "
        f"your own ({_PROFILE_FILE})"
    )


def _read_profile(path: Path) -> Mapping[str, Any]:
    """Read a profile of Snakemake: its options by name, without the leading dashes."""
    import yaml

    try:
        profile = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(profile, dict):
        raise InputError(f"{path}: it must hold keys and values, as `executor: slurm`")
    return profile


_SUBMITS = {"slurm": "sbatch"}
"""Program that hands over the jobs of an executor, by the name of the executor."""


def _check_installed(executor: str, folder: Path) -> None:
    """Refuse an executor that cannot work here; Snakemake itself would say less about the cause.

    `executor`: Name of the part of Snakemake that starts jobs. `folder`: That of the profile, named in messages.
    """
    if executor in ("local", "dryrun", "touch"):
        return
    # Snakemake writes the path of Python without quotes into the shell command of a job
    if unsafe_match := re.search(r"[^\w@%+=:,./-]", sys.executable):
        raise InputError(
            f"{sys.executable}: a cluster's jobs cannot start a Python whose path has a {unsafe_match[0]!r}: make "
            "the environment in a folder with letters, digits, - and _ alone in its path"
        )
    plugin = f"snakemake-executor-plugin-{executor}"
    if find_spec(plugin.replace("-", "_")) is None:
        raise InputError(
            f"the profile {folder.name} needs the package {plugin}, which is not installed; "
            f"install it with `python -m pip install {plugin}`"
        )
    program = _SUBMITS.get(executor)
    if program is not None and shutil.which(program) is None:
        raise InputError(
            f"there is no program {program} here, which hands jobs over to {executor}: start this "
            "on a machine of the cluster that may submit jobs"
        )
