"""Snakemake as a child process: started, listened to, stopped with all its children."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass, field
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

import rftfit
from rftfit.cli.output import count, say
from rftfit.errors import OutputError, WorkflowError
from rftfit.store.environment import child_environment
from rftfit.workflow.processes import VARIABLE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import TracebackType

    from rich.console import Console


# --- Reads what Snakemake says, line by line: jobs done, jobs failed and why, nothing to do, locked.


_JOB = re.compile(r"^(?:local)?(?:rule|checkpoint) (\S+):$")
_ERROR = re.compile(r"^Error in (?:rule|group) (\S+):$")
_FINISHED = re.compile(r"^Finished (?:jobid: |job )(\d+)(?: \(Rule: (\S+)\))?")
_STEPS = re.compile(r"^(\d+) of (\d+) steps ")
_TOTAL = re.compile(r"^total +(\d+)$")
# jobs that go to a cluster as one are told of further in
_IN_GROUP = " " * 4
_FAILED_GROUP = f"{_IN_GROUP}jobs:"
_WHY_GROUP_FAILED = f"{_IN_GROUP}message: "
_IN_FAILED_GROUP = " " * 8
_FIELD = re.compile(r"^    (\w+): ?(.*)$")
_STAGE = re.compile(r"^rftfit (\w+): (.*)$")
_STATUS = re.compile(r"(?:returned non-zero exit status (\d+)|died with <Signals\.(\w+))")
_LAST_OF_TRACEBACK = re.compile(r"^[A-Za-z_][\w.]*(?:: .*)?$")
_PROBLEM = re.compile(r"^\w*(?:Error|Exception)\b")
_SUMMARY = "At least one job did not complete successfully."
_SNAKEMAKES_OWN = re.compile(
    r"^(\[\w{3} \w{3} +\d+ [\d:]+ \d{4}\]|(local)?(rule|checkpoint) \S+:$|Error in |RuleException"
    r"|CalledProcessError|Command '|Finished job|\d+ of \d+ steps|Select jobs|Execute \d+ job"
    r"|Removing output|Removing temporary|Exiting because|Complete log|Elapsed time|WorkflowError"
    r"|Shutting down|Terminating processes|Trying to restart|Waiting at most|Touching output"
    r"|MissingOutputException|Storing output|Will exit after finishing)"
)
_MOST_LINES = 40


@dataclass
class Job:
    """One job.

    `number`: Snakemake's own.
    `fields`: What Snakemake said of it: ``wildcards``, ``log``, ``shell``, ``output`` and others.
    """

    rule: str
    number: str = ""
    fields: dict[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """Rule and wildcards, for people: ``ingest poppy_LP``."""
        pairs = [pair.partition("=") for pair in self.fields.get("wildcards", "").split(", ")]
        return " ".join([self.rule, *(value for _, _, value in pairs if value)])


@dataclass
class Failure:
    """A job that failed.

    `status`: Exit status, or the name of the signal that ended it; empty if not known.
    `grouped`: Snakemake knows only that one of the jobs failed that went to a cluster as one.
    """

    job: Job
    status: str = ""
    grouped: bool = False


@dataclass
class Message:
    """What a job said on standard error.

    `stage`: Empty for a traceback.
    """

    stage: str
    lines: list[str]


@dataclass
class Watcher:
    """The state of a workflow, from the lines that Snakemake prints.

    `total`, `done`: Jobs.
    `jobs`: By number, those that began.
    `problem`: What Snakemake says of an error that is no job's.
    """

    total: int = 0
    done: int = 0
    jobs: dict[str, Job] = field(default_factory=dict)
    finished: list[Job] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    problem: list[str] = field(default_factory=list)
    nothing_to_do: bool = False
    locked: bool = False
    _block: Job | None = None
    _key: str = ""
    _margin: str = ""
    _in_failed_group: bool = False
    _why_group_failed: str = ""
    _talking: Message | None = None
    _in_problem: bool = False
    _in_traceback: bool = False
    _status: str = ""

    def feed(self, line: str) -> Job | None:
        """Take one line.

        `line`: Without its end. Returns the job that this line says is finished.
        """
        if self._block is not None:
            if self._feed_block(self._block, line.removeprefix(self._margin)):
                return None
            self._close_block()
        if status := _STATUS.search(line):
            self._status = status[1] or status[2]
        self._in_failed_group &= line.startswith(_IN_FAILED_GROUP)
        if line == _FAILED_GROUP:
            self._quiet()
            self._in_failed_group = True
        elif self._in_failed_group and (failed := _JOB.match(line.removeprefix(_IN_FAILED_GROUP))):
            self._margin = _IN_FAILED_GROUP
            self._block = Job(failed[1], fields={"message": self._why_group_failed})
            self.failures.append(Failure(self._block, grouped=True))
        elif line.startswith(_WHY_GROUP_FAILED):
            self._why_group_failed = line.removeprefix(_WHY_GROUP_FAILED)
        elif started := _JOB.match(line) or _JOB.match(line.removeprefix(_IN_GROUP)):
            self._quiet()
            self._margin = _IN_GROUP if line.startswith(_IN_GROUP) else ""
            self._block = Job(started[1])
        elif failed := _ERROR.match(line):
            self._quiet()
            self._margin = ""
            self._block = Job(failed[1])
            self.failures.append(Failure(self._block, self._status))
            self._status = ""
        elif total := _TOTAL.match(line):
            self.total = int(total[1])
        elif steps := _STEPS.match(line):
            self._quiet()
            self.done, self.total = int(steps[1]), int(steps[2])
        elif finished := _FINISHED.match(line):
            self._quiet()
            job = self.jobs.get(finished[1], Job(finished[2] or "job", finished[1]))
            self.finished.append(job)
            self.done = max(self.done, len(self.finished))
            return job
        else:
            self._feed_talk(line)
        return None

    def _feed_block(self, job: Job, line: str) -> bool:
        """Take an indented line below ``rule NAME:``; False where the block is over."""
        if not line.startswith("    "):
            return False
        found = _FIELD.match(line)
        if found and not line.startswith("     "):
            self._key = found[1]
            job.fields[self._key] = found[2]
            if self._key == "jobid":
                job.number = found[2]
        elif self._key:
            job.fields[self._key] = f"{job.fields[self._key]}\n{line.strip()}".strip()
        return True

    def _close_block(self) -> None:
        job, self._block, self._key = self._block, None, ""
        if job is None:
            return
        begun = self.jobs.setdefault(job.number, job)
        # the block of an error lacks the wildcards, that of the start has them
        job.fields = begun.fields | job.fields

    def _feed_talk(self, line: str) -> None:
        """Take a line that is a job's own, or that of an error of Snakemake itself."""
        if "Nothing to be done" in line:
            self.nothing_to_do = True
        if "LockException" in line or "irectory cannot be locked" in line:
            self.locked = True
        if stage := _STAGE.match(line):
            self._quiet()
            self._talking = Message(stage[1], [stage[2]])
            self.messages.append(self._talking)
        elif line.startswith("Traceback (most recent call last)"):
            self._quiet()
            self._in_traceback = True
        elif self._in_traceback:
            if line and not line[0].isspace() and _LAST_OF_TRACEBACK.match(line):
                self._in_traceback = False
                self._talking = Message("", [line])
                self.messages.append(self._talking)
        elif _PROBLEM.match(line) and not line.startswith(("RuleException", "CalledProcessError")):
            self._quiet()
            self._in_problem = True
            self.problem.append(line)
        elif _SNAKEMAKES_OWN.match(line):
            self._quiet()
        elif self._in_problem:
            if line != _SUMMARY and not line.lstrip().startswith("File "):
                self.problem.append(line)
            elif self.problem and line == _SUMMARY:
                self.problem.pop()
        elif self._talking is not None and line.strip():
            self._talking.lines.append(line.rstrip())

    def _quiet(self) -> None:
        self._talking, self._in_problem, self._in_traceback = None, False, False

    def close(self) -> None:
        """Take note that there are no more lines."""
        self._close_block()
        del self.problem[_MOST_LINES:]
        for message in self.messages:
            del message.lines[_MOST_LINES:]


# --- Snakemake as a child process: started, listened to, stopped with all its children.


_PATIENCE_S = 20.0


def find_snakefile() -> Path:
    """Find the workflow: at the top of a checkout, inside the package where it was installed."""
    package = Path(rftfit.__file__).resolve().parent
    places = (package.parents[1] / "Snakefile", package / "_workflow" / "Snakefile")
    for place in places:
        if place.is_file():
            return place
    looked = " or ".join(str(place) for place in places)
    raise WorkflowError(f"no workflow found at {looked}; install rftfit again")


def listen(words: Sequence[str], log: Path | None, on_line: Callable[[str], None]) -> int:
    """Run ``python -m snakemake`` and hand on each line that it or a job of it prints.

    It starts beside the workflow and goes to the campaign by ``--directory``: it takes profiles, which
    can hold Python, from the folder that it starts in.

    `words`: After ``python -m snakemake``. `log`: Where the lines are kept as they come.
    `on_line`: Gets each line without its end. Returns exit status.
    """
    with contextlib.ExitStack() as stack:
        keep = stack.enter_context(_open(log)) if log else None
        stack.enter_context(_signals_as_interrupts())
        child = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "snakemake", *words],
                cwd=find_snakefile().parent,
                env=_environment(),
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
                if keep is not None:
                    _keep(keep, raw, log)
                on_line(raw.decode("utf-8", "replace").rstrip("\r\n"))
            return child.wait()
        except BaseException:
            _stop(child)
            raise


def working_in(root: Path) -> list[int]:
    """Process ids of the Snakemakes that work in a folder, so far as can be told.

    Returns empty too where other processes cannot be looked at.
    """
    try:
        psutil: Any = import_module("psutil")
    except ImportError:
        return []
    found = []
    for process in psutil.process_iter(["pid", "cmdline", "cwd"]):
        words = process.info["cmdline"] or []
        is_snakemake = any(Path(word).name.startswith("snakemake") for word in words[:4])
        places = [process.info["cwd"], _after(words, "--directory"), _after(words, "-d")]
        if is_snakemake and any(place and Path(place) == root for place in places):
            found.append(int(process.info["pid"]))
    return sorted(found)


def _after(words: Sequence[str], option: str) -> str | None:
    return next((b for a, b in pairwise(words) if a == option), None)


def _environment() -> dict[str, str]:
    # jobs call `python`: it has to be this one, also where the environment was not activated
    here = os.path.dirname(sys.executable)  # noqa: PTH120
    path = os.pathsep.join(filter(None, [here, os.environ.get("PATH", "")]))
    # it ends when this process has ended, even where that could not say so
    return child_environment(PATH=path, PYTHONUNBUFFERED="1", **{VARIABLE: str(os.getpid())})


def _open(log: Path) -> Any:
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        return log.open("wb", buffering=0)
    except OSError as error:
        raise _cannot_write(log, error) from error


def _keep(handle: Any, line: bytes, log: Path | None) -> None:
    try:
        handle.write(line)
    except OSError as error:
        raise _cannot_write(log, error) from error


def _cannot_write(log: Path | None, error: OSError) -> OutputError:
    return OutputError(
        f"{log}: cannot write the workflow's log: {error.strerror or error}; free some space or "
        "allow writing there, then run again"
    )


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
    heard = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, interrupt) for number in heard}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop(child: subprocess.Popen[bytes]) -> None:
    """End Snakemake and its jobs: politely, so that it clears its lock, then less so."""
    steps = ("SIGINT", "SIGTERM", "SIGKILL") if os.name == "posix" else ("SIGTERM",)
    for name in steps:
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


# --- Why a workflow stopped, for people: each failed job with the message of its own stage.


_MOST_LINES_OF_A_LOG = 15
_SEE_LOG = re.compile(r" \(check log file\(s\) for error details\)$")
_KILLED = {"137": "SIGKILL", "143": "SIGTERM", "139": "SIGSEGV"}
_TOLD_BY_SLURM = re.compile(r"SLURM status is: '([\w ]+)'")
_SHELL_REFUSED = "1"
_NOT_WRITTEN = str(OutputError.exit_code)
# Snakemake's own words for what it cannot write, in its folder or for a job that is to begin
_REFUSED = re.compile(
    rf"^OSError: \[Errno (?:{errno.ENOSPC}|{errno.EROFS}|{errno.EDQUOT}|{errno.EFBIG})\] (.*)"
)
_CURE = "free some space or allow writing there, then run again"
_MEMORY = "most often because the memory was full; try --cores 1"


def failure_text(watcher: Watcher, root: Path, log: Path, status: int = 1) -> str:
    """Say what failed and why, without what Snakemake adds to it.

    `watcher`: Closed. `root`: Folder of the campaign. `log`: The whole log, to be named. `status`:
    Exit status of Snakemake; below zero where a signal of that number ended it.
    """
    if watcher.failures:
        failed = _told_apart({f.job.number: f for f in watcher.failures}, root)
        unclaimed = list(watcher.messages)
        head = f"the workflow stopped: {count(len(failed), 'job')} failed"
        parts = [f"{head}; {watcher.done} of {watcher.total} are done, and what is done is kept."]
        for failure in failed.values():
            lines = _from_its_log(failure, root) or _claim(failure, unclaimed)
            lines = lines or [
                f"{log}: cannot write: {_CURE}" for log in _logs_not_made(failure, root)
            ]
            text = "\n".join(f"    {line}" for line in lines or [_without_words(failure)])
            parts.append(f"  {failure.job.title}:\n{text}")
    elif status < 0:
        name = signal.Signals(-status).name
        why = f", {_MEMORY}" if name == "SIGKILL" else ""
        head = f"the workflow stopped: Snakemake itself was ended by {name}{why}."
        done = f"{watcher.done} of {watcher.total} jobs are done and kept"
        parts = [f"{head} {done}; `rftfit run` goes on from there."]
    else:
        lines = _refusals(watcher) or [line for line in watcher.problem if line.strip()]
        lines = lines or [line for message in watcher.messages for line in message.lines]
        text = "\n".join(f"    {line}" for line in lines or ["Snakemake gave no reason"])
        when = f"after {watcher.done} of {watcher.total} jobs" if watcher.done else "before any job"
        parts = [f"the workflow stopped {when}:\n{text}"]
    parts.append(f"The whole log: {log}")
    return "\n".join(parts)


def nothing_written(watcher: Watcher, root: Path) -> bool:
    """Tell whether all that stopped the workflow is that files could not be written.

    `watcher`: Closed. `root`: Folder of the campaign.
    """
    return (bool(watcher.failures) or bool(_refusals(watcher))) and all(
        failure.status == _NOT_WRITTEN or bool(_logs_not_made(failure, root))
        for failure in watcher.failures
    )


def _refusals(watcher: Watcher) -> list[str]:
    found = [_REFUSED.match(line) for line in watcher.problem]
    return [f"Snakemake cannot write: {match[1]}; {_CURE}" for match in found[:1] if match]


def _logs_not_made(failure: Failure, root: Path) -> list[str]:
    """Name the logs of a job that never began, because its shell could not make them."""
    if failure.status != _SHELL_REFUSED:
        return []
    return [name for name in _logs(failure) if not (root / name).exists()]


def _logs(failure: Failure) -> list[str]:
    named = _SEE_LOG.sub("", failure.job.fields.get("log", ""))
    return [name for name in named.split(", ") if name]


def _told_apart(failed: dict[str, Failure], root: Path) -> dict[str, Failure]:
    """Of jobs that went to a cluster as one, leave those whose own log says that they failed."""
    silent = {
        number: one
        for number, one in failed.items()
        if one.grouped and not _from_its_log(one, root)
    }
    if silent and len(silent) == len(failed):
        first = next(iter(silent.values())).job
        names = ", ".join(one.job.title for one in silent.values())
        only = {"message": first.fields.get("message", "")}
        return {first.number: Failure(Job(f"one of {names}", first.number, only))}
    return {number: one for number, one in failed.items() if number not in silent}


def _from_its_log(failure: Failure, root: Path) -> list[str]:
    """Read what the job wrote into the log file that its rule declares."""
    for name in _logs(failure):
        try:
            text = (root / name).read_text(encoding="utf-8", errors="replace")
        except OSError:
            continue
        reader = Watcher()
        for line in text.splitlines():
            reader.feed(line)
        reader.close()
        if reader.messages:
            return reader.messages[-1].lines
        if text.strip() and not failure.grouped:
            return text.strip().splitlines()[-_MOST_LINES_OF_A_LOG:]
    return []


def _claim(failure: Failure, unclaimed: list[Message]) -> list[str]:
    """Take the message that belongs to a failed job out of those that were seen.

    Jobs run side by side and speak before Snakemake says who failed: the stage must be in the job's
    command, and among several of one stage the one that names the job's medium goes first.
    """
    command = failure.job.fields.get("shell", "")
    words = failure.job.title.split()[1:]

    def fits(message: Message) -> bool:
        pattern = rf"\brftfit['\"]? {re.escape(message.stage)}\b"
        return message.stage in ("", failure.job.rule) or bool(re.search(pattern, command))

    candidates = [message for message in unclaimed if fits(message)]
    if not candidates:
        return []

    def rank(message: Message) -> tuple[bool, bool]:
        text = "\n".join(message.lines)
        return (message.stage == "", not any(word in text for word in words))

    best = min(candidates, key=rank)
    unclaimed.remove(best)
    if best.stage == "":
        return [
            *best.lines,
            "(an error that the program did not expect: its traceback is in the log)",
        ]
    return best.lines


def _without_words(failure: Failure) -> str:
    if told := _TOLD_BY_SLURM.search(failure.job.fields.get("message", "")):
        return f"no message; Slurm says {told[1]}"
    status = _KILLED.get(failure.status, failure.status)
    if status == "SIGKILL":
        return f"killed (SIGKILL), {_MEMORY}"
    if status.startswith("SIG"):
        return f"ended by {status}"
    return f"no message; exit status {status}" if status else "no message"


# --- How far a workflow is: a bar in a terminal, one short line per job in a pipe or file.


class Display(Protocol):
    """Shows jobs as they finish."""

    def __enter__(self) -> Self:
        """Begin."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End."""

    def update(self, watcher: Watcher, finished: Job | None) -> None:
        """Show the state after one line.

        `finished`: The job that this line says is finished.
        """


class Lines:
    """One line per finished job, with its count."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def update(self, watcher: Watcher, finished: Job | None) -> None:
        """Show the state after one line."""
        if finished is not None:
            width = len(str(watcher.total))
            say(f"[{watcher.done:{width}d}/{watcher.total}] {finished.title}")


class Bar:
    """A bar with the count, the time, and the job that finished last.

    `console`: Default: standard output.
    """

    def __init__(self, console: Console | None = None) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
        from rich.progress import TimeElapsedColumn as Elapsed

        self._progress = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            Elapsed(),
            # a medium's name is no markup
            TextColumn("{task.description}", markup=False),
            console=console,
        )
        self._task = self._progress.add_task("looking what has to be done", total=None)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def update(self, watcher: Watcher, finished: Job | None) -> None:
        """Show the state after one line."""
        if finished is not None:
            failed = f", {len(watcher.failures)} failed" if watcher.failures else ""
            self._progress.update(self._task, description=f"{finished.title}{failed}")
        if watcher.total:
            self._progress.update(self._task, total=watcher.total, completed=watcher.done)


def display() -> Display:
    """Return the display that suits standard output."""
    return Bar() if sys.stdout.isatty() else Lines()
