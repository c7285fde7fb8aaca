"""Why a workflow stopped, for people: each failed job with the message of its own stage."""

from __future__ import annotations

import errno
import re
import signal
from typing import TYPE_CHECKING

from rftfit.cli.output import count
from rftfit.cli.snakemake_output import Failure, Job, Watcher
from rftfit.errors import OutputError

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.cli.snakemake_output import Message

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

    Parameters
    ----------
    watcher : Watcher
        Closed.
    root : Path
        Folder of the campaign.
    log : Path
        The whole log, to be named.
    status : int
        Exit status of Snakemake; below zero where a signal of that number ended it.

    Returns
    -------
    str
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

    Parameters
    ----------
    watcher : Watcher
        Closed.
    root : Path
        Folder of the campaign.

    Returns
    -------
    bool
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
