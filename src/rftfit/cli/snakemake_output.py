"""Reads what Snakemake says, line by line: jobs done, jobs failed and why, nothing to do, locked."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

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

    Attributes
    ----------
    rule : str
    number : str
        Snakemake's own.
    fields : dict of str to str
        What Snakemake said of it: ``wildcards``, ``log``, ``shell``, ``output`` and others.
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

    Attributes
    ----------
    job : Job
    status : str
        Exit status, or the name of the signal that ended it; empty if not known.
    grouped : bool
        Snakemake knows only that one of the jobs failed that went to a cluster as one.
    """

    job: Job
    status: str = ""
    grouped: bool = False


@dataclass
class Message:
    """What a job said on standard error.

    Attributes
    ----------
    stage : str
        Empty for a traceback.
    lines : list of str
    """

    stage: str
    lines: list[str]


@dataclass
class Watcher:
    """The state of a workflow, from the lines that Snakemake prints.

    Attributes
    ----------
    total, done : int
        Jobs.
    jobs : dict of str to Job
        By number, those that began.
    finished : list of Job
    failures : list of Failure
    messages : list of Message
    problem : list of str
        What Snakemake says of an error that is no job's.
    nothing_to_do, locked : bool
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

        Parameters
        ----------
        line : str
            Without its end.

        Returns
        -------
        Job or None
            The job that this line says is finished.
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
