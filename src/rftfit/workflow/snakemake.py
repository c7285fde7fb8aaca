"""Snakemake as a child process: started, followed, stopped with its children; what is said of a failed job.

Snakemake's logger plug-in (`snakemake_logger_plugin_rftfit`) writes each event as one line of JSON with the key ``snakemake``,
the message; other lines of its output are called plain here. `Progress.update_by` reads both. A job is one use of a rule,
such as ``slopes poppy_LP``; its stage, the function that does the work, writes errors to the job's log as
``rftfit RULE VALUE: MESSAGE``. Messages to users are made from these, since Snakemake's own say little of a cause.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from textwrap import indent
from typing import BinaryIO

from rftfit.errors import OutputError
from rftfit.store import open_growing
from rftfit.store.environment import child_environment, shipped
from rftfit.store.text import count
from rftfit.workflow.processes import PARENT_VARIABLE
from rftfit.workflow.state import job_name, state_file

_MOST_LINES = 40
"""Most lines of a log in one message."""


@dataclass
class Job:
    """One job, as Snakemake reports it.

    `rule`: Name of its rule. `logs`: Log files that the rule declares, from the campaign's folder. `wildcards`: Values by
    name of the wildcard, such as the medium: one or none. `reason`: Why it is done, in Snakemake's words. `status`: Of a
    failed job its exit status, the name of the signal that ended it (``SIGKILL``), or what Slurm says of it; empty where
    unknown. `grouped`: True where the job went to a cluster in a group, of which Snakemake knows only that one job failed.
    """

    rule: str
    logs: list[str] = field(default_factory=list)
    wildcards: dict[str, str] = field(default_factory=dict)
    reason: str = ""
    status: str = ""
    grouped: bool = False

    def __str__(self) -> str:
        """Rule and value of its wildcard, as ``slopes poppy_LP``."""
        return " ".join([self.rule, *self.wildcards.values()])

    @property
    def state(self) -> str:
        """Path of the file of the job's state, from the campaign's folder; the command of the job names it."""
        return state_file(job_name(self.rule, next(iter(self.wildcards.values()), "")))


_STATUS_OF_COMMAND = re.compile(
    r"(?:returned non-zero exit status (\d+)|died with <Signals\.(\w+))"
)
"""How Snakemake reports the command of a failed job: its exit status, or the signal that ended it."""

_SLURM = re.compile(r"SLURM status is: '([\w ]+)'")
"""How it reports what the cluster's program Slurm says of a failed job."""

_SUMMARY_OF_END = "At least one job did not complete successfully."
"""Message of Snakemake after failed jobs, which says nothing new."""


@dataclass
class Progress:
    """Progress of a workflow, from the events that Snakemake reports.

    `total`, `done`: Numbers of jobs. `jobs`: Jobs that began or, in a dry run, would begin, by Snakemake's number.
    `made`: Jobs that finished. `skipped`: Planned jobs that need not be done, as their record still held. `failed`: Failed
    jobs by number. `problem`: Lines about an error that is not of a job. `plain`: Lines that are no events.
    `nothing_to_do`: True where Snakemake planned no job, or was not started. `locked`: True where another Snakemake holds
    the campaign's folder. `_command_errors`: Errors about commands of jobs, message and exit status or signal, until
    Snakemake names the job of each.
    """

    total: int = 0
    done: int = 0
    jobs: dict[str, Job] = field(default_factory=dict)
    made: list[Job] = field(default_factory=list)
    skipped: list[Job] = field(default_factory=list)
    failed: dict[str, Job] = field(default_factory=dict)
    problem: list[str] = field(default_factory=list)
    plain: list[str] = field(default_factory=list)
    nothing_to_do: bool = False
    locked: bool = False
    _command_errors: list[tuple[str, str]] = field(default_factory=list)

    def update_by(self, line: str) -> Job | None:
        """Update the progress by one line of Snakemake's output; return the job that has finished by it, or None.

        The line is an event, JSON as the logger plug-in writes it, or plain text, which is kept. An event on a job has
        Snakemake's number of it, ``jobid`` or ``job_id``, by which it is found in `jobs`.
        """
        try:
            event = json.loads(line) if line.startswith('{"snakemake"') else None
        except ValueError:
            event = None
        if event is None:
            self.plain.append(line)
            return None
        message, number = str(event["snakemake"]), str(event.get("jobid", event.get("job_id", "")))
        match event.get("event"):
            # what is planned
            case "run_info":
                self.total = int(event.get("stats", {}).get("total", self.total))
            case "progress":
                self.done, self.total = int(event["done"]), int(event["total"])
            # a job begins, or would begin in a dry run
            case "job_info":
                options = {name: event[name] for name in ("wildcards", "reason") if name in event}
                self.jobs[number] = Job(event["rule_name"], event.get("log", []), **options)
            case "job_finished":
                self.done += 1
                if finished := self.jobs.get(number):
                    self.made.append(finished)
                return finished
            # written by this program's executor for a job that it did not do
            case _ if "skipped" in event:
                self.skipped.append(self.jobs.pop(str(event["skipped"])))
            # a job failed; its exit status stands in an error that came before
            case "job_error":
                unknown = Job(event.get("rule_name", "job"), event.get("log", []))
                job = self.jobs.get(number, unknown)
                slurm = _SLURM.search(str(event.get("rule_msg")))
                # Snakemake indents its report on jobs of a group
                job.grouped = bool(event.get("indent"))
                job.status = f"Slurm says {slurm[1]}" if slurm else self._status_of(job)
                self.failed[number] = job
            # of a command, of the lock of the folder, or of Snakemake itself
            case "error":
                if status_match := _STATUS_OF_COMMAND.search(message):
                    self._command_errors.append((message, status_match[1] or status_match[2]))
                elif "LockException" in message or "cannot be locked" in message:
                    self.locked = True
                elif _SUMMARY_OF_END not in message:
                    lines = [row for row in message.splitlines() if row.strip()]
                    self.problem += lines[:_MOST_LINES]
            case _:
                self.nothing_to_do |= "Nothing to be done" in message
                self.locked |= "cannot be locked" in message
        return None

    def _status_of(self, job: Job) -> str:
        """Find the exit status or signal of a failed job in `_command_errors`, and remove this error; empty where unknown.

        Several commands may fail before Snakemake names the first job: the error whose command names the job's state file
        is taken, else the oldest.
        """
        errors = self._command_errors
        errors_of_job = [error for error in errors if f" {job.state} " in error[0]] or errors
        if not errors_of_job:
            return ""
        error_of_job = errors_of_job[0]
        errors.remove(error_of_job)
        return error_of_job[1]


def describe_failure(progress: Progress, root: Path, log: Path, status: int) -> str:
    """Say what failed and why, in the words of the stages instead of Snakemake's.

    `root`: The campaign's folder. `log`: Path of Snakemake's whole log, named in the message. `status`: Exit status of
    Snakemake; below 0: minus the number of the signal that ended it.
    """
    done = f"{progress.done} of {progress.total}"
    if progress.failed:
        causes = describe_failed_jobs(progress, root)
        failed = f"{count(len(causes), 'job')} failed"
        parts = [f"the workflow stopped: {failed}; {done} are done, and what is done is kept."]
        parts += [f"  {job}:\n{indent(why, '    ')}" for job, why in causes.items()]
    elif status < 0:
        name = signal.Signals(-status).name
        why = f", {_MEMORY}" if name == "SIGKILL" else ""
        head = f"the workflow stopped: Snakemake itself was ended by {name}{why}."
        parts = [f"{head} {done} jobs are done and kept; `rftfit run` goes on from there."]
    else:
        lines = _refusals(progress) or progress.problem or progress.plain[-_MOST_LINES:]
        when = f"after {done} jobs" if progress.done else "before any job"
        parts = [f"the workflow stopped {when}:"]
        parts += [f"    {line}" for line in lines or ["Snakemake gave no reason"]]
    return "\n".join([*parts, f"The whole log: {log}"])


def describe_failed_jobs(progress: Progress, root: Path) -> dict[str, str]:
    """Say why jobs failed: by job (rule and value of its wildcard, as ``slopes poppy_LP``), a message of some lines."""
    jobs = _list_failed_jobs(progress, root)
    return {str(job): "\n".join(_describe_cause(job, progress, root)) for job in jobs}


def failed_to_write(progress: Progress, root: Path) -> bool:
    """Return True where files that could not be written are the only cause why the workflow stopped.

    The command then has the exit code of a full disk, on which a script may react.
    """
    if not progress.failed:
        return bool(_refusals(progress))
    return all(
        job.status == str(OutputError.exit_code) or bool(_logs_not_made(job, root))
        for job in progress.failed.values()
    )


_REFUSED = re.compile(r"OutputError: (.*: cannot write: .*)")
"""Error of this program in Snakemake's process, which writes state files."""

_NO_SPACE = rf"\[Errno (?:{errno.ENOSPC}|{errno.EROFS}|{errno.EDQUOT}|{errno.EFBIG})\] (.*)"
"""Error of the system where a disk is full or may not be written to."""

_CURE = "free some space or allow writing there, then run again"


def _refusals(progress: Progress) -> list[str]:
    """Return the first message that a file cannot be written by Snakemake's own process, as a list of one; else an empty one.

    That process writes state files by this program, and files of its own.
    """
    lines = [*progress.problem, *progress.plain]
    refusals = [match[1] for line in lines if (match := _REFUSED.search(line))]
    disk_errors = [match[1] for line in lines if (match := re.search(_NO_SPACE, line))]
    return refusals[:1] or [
        f"Snakemake cannot write: {error}; {_CURE}" for error in disk_errors[:1]
    ]


def _logs_not_made(job: Job, root: Path) -> list[str]:
    """List the logs that the shell of a job could not make, so that the job never began; empty for any other job.

    The shell then ends with status 1.
    """
    return [name for name in job.logs if job.status == "1" and not (root / name).exists()]


def _list_failed_jobs(progress: Progress, root: Path) -> list[Job]:
    """List the failed jobs; of jobs that went to a cluster as a group only those whose log holds an error.

    Snakemake calls all jobs of a group failed where one is. Where no log of them holds an error, one entry, whose rule names
    them all, stands for the group.
    """
    jobs = list(progress.failed.values())
    grouped = [job for job in jobs if job.grouped]
    silent = [job for job in grouped if not _find_message(job, progress, root)]
    failed = [job for job in jobs if job not in silent]
    if silent and silent == grouped:
        failed.append(Job(f"one of {', '.join(map(str, silent))}", status=silent[0].status))
    return failed


_STAGE_MESSAGE = re.compile(r"^rftfit [^:]+: (.*)$")
"""First line of a stage's error message: the job, then the message."""


def _find_message(job: Job, progress: Progress, root: Path) -> list[str]:
    """Find in the logs of a failed job why it failed: lines of its stage's message, or the last line of a traceback.

    A stage that cannot write its log writes its message to standard output, among Snakemake's lines. Empty where there is
    no message at all.
    """
    for lines in _read_logs(job, root):
        starts = [place for place, line in enumerate(lines) if _STAGE_MESSAGE.match(line)]
        if starts:
            first, *further = lines[starts[0] :]
            return [_STAGE_MESSAGE.sub(r"\1", first), *further[:_MOST_LINES]]
        if "Traceback (most recent call last):" in lines:
            end = "(an error that the program did not expect: its traceback is in the log)"
            return [lines[-1], end]
    lines_of_job = [line for line in progress.plain if line.startswith(f"rftfit {job}: ")]
    return [_STAGE_MESSAGE.sub(r"\1", line) for line in lines_of_job[:1]]


def _read_logs(job: Job, root: Path) -> Iterator[list[str]]:
    """Yield the lines of each log of a job, a list for each; a log that cannot be read is left out."""
    for name in job.logs:
        with contextlib.suppress(OSError):
            content = (root / name).read_text(encoding="utf-8", errors="replace")
            yield content.strip().splitlines()


_SIGNAL_OF_STATUS = {"137": "SIGKILL", "143": "SIGTERM", "139": "SIGSEGV"}
"""Signal that ended a command, by the exit status that a shell gives it: 128 and the number of the signal."""

_MEMORY = "most often because the memory was full; try --cores 1"


def _describe_cause(job: Job, progress: Progress, root: Path) -> list[str]:
    """Say in lines why a job failed; the first that is known counts.

    A log that could not be made, the message in its log, the signal that ended it, the end of its log, its exit status.
    """
    if absent := _logs_not_made(job, root):
        return [f"{name}: cannot write: {_CURE}" for name in absent]
    if message := _find_message(job, progress, root):
        return message
    status = _SIGNAL_OF_STATUS.get(job.status, job.status)
    if status == "SIGKILL":
        return [f"killed (SIGKILL), {_MEMORY}"]
    if status.startswith("SIG"):
        return [f"ended by {status}"]
    if lines := next(filter(None, _read_logs(job, root)), None):
        return lines[-_MOST_LINES:]
    if status.isdecimal():
        status = f"exit status {status}"
    return [f"no message; {status}" if status else "no message"]


# --- the process


def find_snakefile() -> Path:
    """Return the path of the Snakefile that comes with the program."""
    return shipped("Snakefile")


def run_snakemake(
    words: Sequence[str], log: Path | None, on_line: Callable[[str], None], **variables: str
) -> int:
    """Run ``python -P -m snakemake`` and hand on each line of its output; return its exit status, below 0 for a signal.

    Snakemake starts in the folder of the Snakefile and goes to the campaign by ``--directory``, because it reads profiles,
    which can hold Python, from the folder that it starts in.

    `words`: Its options. `log`: File that keeps the lines as they come; None: none. `on_line`: Function that gets each
    line. `variables`: Further variables of its environment.
    """
    opened_log: contextlib.AbstractContextManager[BinaryIO | None]
    opened_log = open_growing(log) if log else contextlib.nullcontext()
    with (
        opened_log as log_file,
        _signals_as_interrupts(),
        # Snakemake, with words of its own that the user has given
        subprocess.Popen(  # noqa: S603
            [sys.executable, "-P", "-m", "snakemake", *words],
            cwd=find_snakefile().parent,
            env=_environment(**variables),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            # in a process group of its own: Ctrl-C reaches this process alone, which ends the whole group
            start_new_session=os.name == "posix",
        ) as child,
    ):
        try:
            assert child.stdout is not None
            for raw in child.stdout:
                try:
                    if log_file is not None:
                        log_file.write(raw)
                except OSError as error:
                    raise OutputError(
                        f"{log}: cannot write the workflow's log: {error.strerror or error}; {_CURE}"
                    ) from error
                on_line(raw.decode("utf-8", "replace").rstrip("\r\n"))
            return child.wait()
        except BaseException:
            _stop(child)
            raise


def find_snakemakes(root: Path) -> list[int]:
    """Find the process ids of all Snakemakes that work in the folder `root`, as far as this user may see processes.

    Such a one was started in the folder, or with the option ``--directory`` for it.
    """
    import psutil

    process_ids = []
    for process in psutil.process_iter(["pid", "cmdline", "cwd"]):
        words = process.info["cmdline"] or []
        # it may be started as a program, or as a module of Python with some options
        is_snakemake = any(Path(word).name.startswith("snakemake") for word in words[:5])
        folders = [process.info["cwd"]]
        folders += [folder for option, folder in pairwise(words) if option in ("--directory", "-d")]
        if is_snakemake and any(folder and Path(folder) == root for folder in folders):
            process_ids.append(int(process.info["pid"]))
    return sorted(process_ids)


def _environment(**variables: str) -> dict[str, str]:
    """Return the environment variables of Snakemake: this Python first in PATH, and this process as the one to watch."""
    # jobs call `python`, which has to be this Python also where its environment was not activated
    python_folder = os.path.dirname(sys.executable)  # noqa: PTH120
    path = os.pathsep.join(filter(None, [python_folder, os.environ.get("PATH", "")]))
    # Snakemake watches this process and ends with it, even where this process was killed
    variables |= {PARENT_VARIABLE: str(os.getpid()), "PYTHONUNBUFFERED": "1"}
    return child_environment(PATH=path, **variables)


@contextlib.contextmanager
def _signals_as_interrupts() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into `KeyboardInterrupt` inside the block, so that they end the children too, as Ctrl-C does.

    Only the main thread of a process may handle signals: in another one nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    # what is ignored stays so: nohup keeps a run alive when its terminal closes
    handled = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, interrupt) for number in handled}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


_PATIENCE_S = 20.0
"""Time that Snakemake has to end after each signal, s."""


def _stop(child: subprocess.Popen[bytes]) -> None:
    """End Snakemake and its jobs: first by a signal that lets it clear its lock, then by harder ones."""
    # a process that a script started in the background ignores Ctrl-C, and so do its children: then the first is left out
    ignores_interrupt = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    signals = ("SIGINT", "SIGTERM", "SIGKILL")[ignores_interrupt:]
    for name in signals if os.name == "posix" else ("SIGTERM",):
        if child.poll() is not None:
            return
        with contextlib.suppress(OSError, KeyboardInterrupt):
            if os.name == "posix":
                os.killpg(child.pid, getattr(signal, name))
            else:
                child.terminate()
        # a second Ctrl-C is an impatient user: the next step comes at once
        with contextlib.suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
            # communicate, not wait: a full pipe would keep the child from ending
            child.communicate(timeout=_PATIENCE_S)
