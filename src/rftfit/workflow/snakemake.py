"""Snakemake as a child process: started, its events followed, stopped with all its children."""

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

from rftfit.errors import OutputError
from rftfit.store import open_growing
from rftfit.store.environment import child_environment, shipped
from rftfit.workflow.processes import VARIABLE
from rftfit.workflow.state import job_name, state_file

_PATIENCE_S = 20.0
_MOST_LINES = 40
_STATUS = re.compile(r"(?:returned non-zero exit status (\d+)|died with <Signals\.(\w+))")
_STAGE = re.compile(r"^rftfit [^:]+: (.*)$")
_SLURM = re.compile(r"SLURM status is: '([\w ]+)'")
_KILLED = {"137": "SIGKILL", "143": "SIGTERM", "139": "SIGSEGV"}
_REFUSED = re.compile(r"OutputError: (.*: cannot write: .*)")
_NO_SPACE = rf"\[Errno (?:{errno.ENOSPC}|{errno.EROFS}|{errno.EDQUOT}|{errno.EFBIG})\] (.*)"
_CURE = "free some space or allow writing there, then run again"
_MEMORY = "most often because the memory was full; try --cores 1"
_END = "At least one job did not complete successfully."


@dataclass
class Job:
    """One job: its rule, the values of its wildcards, and the log files that its rule declares.

    `grouped`: Snakemake knows only that one of the jobs failed that went to a cluster as one.
    """

    rule: str
    logs: list[str] = field(default_factory=list)
    wildcards: dict[str, str] = field(default_factory=dict)
    reason: str = ""
    status: str = ""
    grouped: bool = False

    def __str__(self) -> str:
        return " ".join([self.rule, *self.wildcards.values()])

    @property
    def state(self) -> str:
        """File of its state, which its command names."""
        return state_file(job_name(self.rule, next(iter(self.wildcards.values()), "")))


@dataclass
class Progress:
    """State of a workflow, from the events that Snakemake reports.

    `jobs`: By number, those that began or, in a dry run, would. `made`: Those that finished. `skipped`: Those
    whose record still held. `problem`: What it says of an error that is no job's. `plain`: Lines that are no events.
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
    _ends: list[tuple[str, str]] = field(default_factory=list)

    def feed(self, line: str) -> Job | None:
        """Take one line of output. Returns the job that it says is finished."""
        try:
            event = json.loads(line) if line.startswith('{"snakemake"') else None
        except ValueError:
            event = None
        if event is None:
            self.plain.append(line)
            return None
        text, number = str(event["snakemake"]), str(event.get("jobid", event.get("job_id", "")))
        match event.get("event"):
            case "run_info":
                self.total = int(event.get("stats", {}).get("total", self.total))
            case "progress":
                self.done, self.total = int(event["done"]), int(event["total"])
            case "job_info":
                facts = {name: event[name] for name in ("wildcards", "reason") if name in event}
                self.jobs[number] = Job(event["rule_name"], event.get("log", []), **facts)
            case "job_finished":
                self.done += 1
                if finished := self.jobs.get(number):
                    self.made.append(finished)
                return finished
            case _ if "skipped" in event:
                self.skipped.append(self.jobs.pop(str(event["skipped"])))
            case "job_error":
                unknown = Job(event.get("rule_name", "job"), event.get("log", []))
                job = self.jobs.get(number, unknown)
                slurm = _SLURM.search(str(event.get("rule_msg")))
                job.grouped = bool(event.get("indent"))
                job.status = f"Slurm says {slurm[1]}" if slurm else self._status_of(job)
                self.failed[number] = job
            case "error":
                if status_match := _STATUS.search(text):
                    self._ends.append((text, status_match[1] or status_match[2]))
                elif "LockException" in text or "cannot be locked" in text:
                    self.locked = True
                elif _END not in text:
                    self.problem += [row for row in text.splitlines() if row.strip()][:_MOST_LINES]
            case _:
                self.nothing_to_do |= "Nothing to be done" in text
                self.locked |= "cannot be locked" in text
        return None

    def _status_of(self, job: Job) -> str:
        """Status that a failed job's command ended with; several may fail before one is named."""
        ends_of_job = [end for end in self._ends if f" {job.state} " in end[0]] or self._ends
        if not ends_of_job:
            return ""
        end = ends_of_job[0]
        self._ends.remove(end)
        return end[1]


def failure_text(progress: Progress, root: Path, log: Path, status: int) -> str:
    """Say what failed and why, without what Snakemake adds to it.

    `log`: To be named. `status`: Of Snakemake; below zero where a signal of that number ended it.
    """
    done = f"{progress.done} of {progress.total}"
    if progress.failed:
        jobs = failures(progress, root)
        failed = f"{len(jobs)} job{'s' * (len(jobs) > 1)} failed"
        parts = [f"the workflow stopped: {failed}; {done} are done, and what is done is kept."]
        parts += [f"  {job}:\n{indent(why, '    ')}" for job, why in jobs.items()]
    elif status < 0:
        name = signal.Signals(-status).name
        why = f", {_MEMORY}" if name == "SIGKILL" else ""
        head = f"the workflow stopped: Snakemake itself was ended by {name}{why}."
        parts = [f"{head} {done} jobs are done and kept; `rftfit run` goes on from there."]
    else:
        lines = _refusals(progress) or progress.problem or progress.plain[-_MOST_LINES:]
        text = "\n".join(f"    {line}" for line in lines or ["Snakemake gave no reason"])
        when = f"after {done} jobs" if progress.done else "before any job"
        parts = [f"the workflow stopped {when}:\n{text}"]
    return "\n".join([*parts, f"The whole log: {log}"])


def failures(progress: Progress, root: Path) -> dict[str, str]:
    """Why each failed job failed, by the job."""
    jobs = _failed_by_own_log(progress, root)
    return {str(job): "\n".join(_why(job, progress, root)) for job in jobs}


def nothing_written(progress: Progress, root: Path) -> bool:
    """Tell whether all that stopped the workflow is that files could not be written."""
    return (bool(progress.failed) or bool(_refusals(progress))) and all(
        job.status == str(OutputError.exit_code) or bool(_logs_not_made(job, root))
        for job in progress.failed.values()
    )


def _refusals(progress: Progress) -> list[str]:
    """Snakemake's own words for what it cannot write, in its folder or for a job that is to begin."""
    lines = [*progress.problem, *progress.plain]
    refusals = [match[1] for line in lines if (match := _REFUSED.search(line))]
    disk_errors = [match[1] for line in lines if (match := re.search(_NO_SPACE, line))]
    return refusals[:1] or [
        f"Snakemake cannot write: {error}; {_CURE}" for error in disk_errors[:1]
    ]


def _logs_not_made(job: Job, root: Path) -> list[str]:
    """Name the logs of a job that never began, because its shell could not make them."""
    return [name for name in job.logs if job.status == "1" and not (root / name).exists()]


def _failed_by_own_log(progress: Progress, root: Path) -> list[Job]:
    """Of failed jobs that went to a cluster as one, leave those whose own log says that they failed."""
    jobs = list(progress.failed.values())
    silent = [job for job in jobs if job.grouped and not _message(job, progress, root)]
    if silent and len(silent) == len([job for job in jobs if job.grouped]):
        group_job = Job(f"one of {', '.join(map(str, silent))}", status=silent[0].status)
        return [job for job in jobs if not job.grouped] + [group_job]
    return [job for job in jobs if job not in silent]


def _message(job: Job, progress: Progress, root: Path) -> list[str]:
    """The message of a stage, or the last line of a traceback, in a job's own log.

    Where the log could not be written, the stage writes among Snakemake's lines.
    """
    for lines in _logs(job, root):
        begin = next((i for i, line in enumerate(lines) if _STAGE.match(line)), None)
        if begin is not None:
            return [_STAGE.sub(r"\1", lines[begin]), *lines[begin + 1 :][:_MOST_LINES]]
        if "Traceback (most recent call last):" in lines:
            end = "(an error that the program did not expect: its traceback is in the log)"
            return [lines[-1], end]
    lines_of_job = [line for line in progress.plain if line.startswith(f"rftfit {job}: ")]
    return [_STAGE.sub(r"\1", line) for line in lines_of_job[:1]]


def _logs(job: Job, root: Path) -> Iterator[list[str]]:
    """Lines of those logs of a job that can be read."""
    for name in job.logs:
        with contextlib.suppress(OSError):
            text = (root / name).read_text(encoding="utf-8", errors="replace")
            yield text.strip().splitlines()


def _why(job: Job, progress: Progress, root: Path) -> list[str]:
    """What a failed job wrote into its log, or else what is known of its end."""
    if absent := _logs_not_made(job, root):
        return [f"{name}: cannot write: {_CURE}" for name in absent]
    if message := _message(job, progress, root):
        return message
    status = _KILLED.get(job.status, job.status)
    if not status.startswith("SIG"):
        for lines in _logs(job, root):
            if lines:
                return lines[-_MOST_LINES:]
    if status == "SIGKILL":
        return [f"killed (SIGKILL), {_MEMORY}"]
    if status.startswith("SIG"):
        return [f"ended by {status}"]
    if status.isdecimal():
        status = f"exit status {status}"
    return [f"no message; {status}" if status else "no message"]


# --- the process


def find_snakefile() -> Path:
    """Find the workflow."""
    return shipped("Snakefile")


def listen(
    words: Sequence[str], log: Path | None, on_line: Callable[[str], None], **variables: str
) -> int:
    """Run ``python -P -m snakemake`` and hand on each line of its output.

    It starts beside the workflow and goes to the campaign by ``--directory``: it takes profiles, which
    can hold Python, from the folder that it starts in. `log`: Where the lines are kept as they come.
    `variables`: Of its environment. Returns exit status.
    """
    with contextlib.ExitStack() as stack:
        keep = None
        if log is not None:
            keep = stack.enter_context(open_growing(log))
        stack.enter_context(_signals_as_interrupts())
        child = stack.enter_context(
            # Snakemake, with words of its own that the user has given
            subprocess.Popen(  # noqa: S603
                [sys.executable, "-P", "-m", "snakemake", *words],
                cwd=find_snakefile().parent,
                env=_environment(**variables),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                # of its own group: Ctrl-C comes here first, and is handed on to all of them at once
                start_new_session=os.name == "posix",
            )
        )
        try:
            assert child.stdout is not None
            for raw in child.stdout:
                if log is not None and keep is not None:
                    with _writing(log):
                        keep.write(raw)
                on_line(raw.decode("utf-8", "replace").rstrip("\r\n"))
            return child.wait()
        except BaseException:
            _stop(child)
            raise


def working_in(root: Path) -> list[int]:
    """Process ids of the Snakemakes that work in a folder, so far as can be told."""
    import psutil

    process_ids = []
    for process in psutil.process_iter(["pid", "cmdline", "cwd"]):
        words = process.info["cmdline"] or []
        is_snakemake = any(Path(word).name.startswith("snakemake") for word in words[:5])
        places = [process.info["cwd"]]
        places += [place for option, place in pairwise(words) if option in ("--directory", "-d")]
        if is_snakemake and any(place and Path(place) == root for place in places):
            process_ids.append(int(process.info["pid"]))
    return sorted(process_ids)


def _environment(**variables: str) -> dict[str, str]:
    # jobs call `python`: it has to be this one, also where the environment was not activated
    python_folder = os.path.dirname(sys.executable)  # noqa: PTH120
    path = os.pathsep.join(filter(None, [python_folder, os.environ.get("PATH", "")]))
    # it ends when this process has ended, even where that could not say so
    variables |= {VARIABLE: str(os.getpid()), "PYTHONUNBUFFERED": "1"}
    return child_environment(PATH=path, **variables)


@contextlib.contextmanager
def _writing(log: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"{log}: cannot write the workflow's log: {error.strerror or error}; {_CURE}"
        ) from error


@contextlib.contextmanager
def _signals_as_interrupts() -> Iterator[None]:
    """Let a polite end of this process end its children too, as Ctrl-C does."""
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


def _stop(child: subprocess.Popen[bytes]) -> None:
    """End Snakemake and its jobs: politely, so that it clears its lock, then less so."""
    # what a script starts in the background ignores Ctrl-C, and its children do
    ignores_interrupt = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    polite_first = ("SIGINT", "SIGTERM", "SIGKILL")[ignores_interrupt:]
    for name in polite_first if os.name == "posix" else ("SIGTERM",):
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
