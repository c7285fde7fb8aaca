"""Why a workflow stopped, for people: each failed job with the message of its own stage."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rftfit.cli.output import count
from rftfit.cli.snakemake_output import Watcher

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.cli.snakemake_output import Failure, Message

_MOST_LINES_OF_A_LOG = 15
_SEE_LOG = re.compile(r" \(check log file\(s\) for error details\)$")
_KILLED = {"137": "SIGKILL", "143": "SIGTERM", "139": "SIGSEGV"}


def failure_text(watcher: Watcher, root: Path, log: Path) -> str:
    """Say what failed and why, without what Snakemake adds to it.

    Parameters
    ----------
    watcher : Watcher
        Closed.
    root : Path
        Folder of the campaign.
    log : Path
        The whole log, to be named.

    Returns
    -------
    str
    """
    if watcher.failures:
        failed = {failure.job.number: failure for failure in watcher.failures}
        unclaimed = list(watcher.messages)
        head = f"the workflow stopped: {count(len(failed), 'job')} failed"
        parts = [f"{head}; {watcher.done} of {watcher.total} are done, and what is done is kept."]
        for failure in failed.values():
            lines = _from_its_log(failure, root) or _claim(failure, unclaimed)
            text = "\n".join(f"    {line}" for line in lines or [_without_words(failure)])
            parts.append(f"  {failure.job.title}:\n{text}")
    else:
        lines = [line for line in watcher.problem if line.strip()]
        lines = lines or [line for message in watcher.messages for line in message.lines]
        text = "\n".join(f"    {line}" for line in lines or ["Snakemake gave no reason"])
        parts = [f"the workflow stopped before any job:\n{text}"]
    parts.append(f"The whole log: {log}")
    return "\n".join(parts)


def _from_its_log(failure: Failure, root: Path) -> list[str]:
    """Read what the job wrote into the log file that its rule declares."""
    named = _SEE_LOG.sub("", failure.job.fields.get("log", ""))
    for name in filter(None, named.split(", ")):
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
        if text.strip():
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
    status = _KILLED.get(failure.status, failure.status)
    if status == "SIGKILL":
        return "killed (SIGKILL), most often because the memory was full; try --cores 1"
    if status.startswith("SIG"):
        return f"ended by {status}"
    return f"no message; exit status {status}" if status else "no message"
