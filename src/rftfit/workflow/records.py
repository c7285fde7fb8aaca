"""Records of finished jobs: what each read and wrote by SHA-256, and the state it was done in.

One small file a job, ``results/records/RULE/NAME.json``. A result is as recorded when the record of the job
that wrote it names the files and the state that are there now.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

from rftfit.errors import OutputError
from rftfit.store import files, write_text
from rftfit.store.digests import digests_of_files
from rftfit.store.links import RESULTS
from rftfit.workflow.stages import LAST, RULES
from rftfit.workflow.state import STATES, FileDigests, States, job_name, job_of

RECORDS = f"{RESULTS}/records"
_NO_RESULTS = tuple(f"{RESULTS}/{name}/" for name in ("records", "state", "logs"))
"""Folders whose files are no results: records, states and logs of jobs."""


@dataclass(frozen=True)
class Record:
    """One finished job: its state, and the SHA-256 of each file that it read and wrote, by path from the campaign's folder."""

    rule: str
    key: str
    state: dict[str, str]
    reads: dict[str, str]
    writes: dict[str, str]

    @property
    def name(self) -> str:
        """Name of the job."""
        return job_name(self.rule, self.key)

    def save(self, root: Path) -> None:
        """Write the record."""
        text = json.dumps(asdict(self), indent=1, sort_keys=True) + "\n"
        write_text(root / RECORDS / f"{self.name}.json", text)


def read_record(path: Path) -> Record | None:
    """Read a record; None where the file is not there or damaged, which includes a field that is no text."""
    try:
        record = Record(**json.loads(path.read_text(encoding="utf-8")))
        fields = [record.rule, record.key]
        for digests in (record.state, record.reads, record.writes):
            fields += [*digests, *digests.values()]
    except (OSError, ValueError, TypeError, AttributeError):
        return None
    return record if all(isinstance(field, str) for field in fields) else None


def read_state(path: Path) -> dict[str, str]:
    """Read the fingerprint of a job, the small file of its state; empty where it is not there or damaged."""
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


def split_inputs(inputs: Iterable[str]) -> tuple[str, list[str]]:
    """Split the inputs of a job: the file of its state, and the results that it reads."""
    inputs = [*inputs]
    (state,) = (path for path in inputs if path.startswith(f"{STATES}/"))
    return state, [path for path in inputs if path != state]


def record_holds(root: Path, inputs: Iterable[str], outputs: Iterable[str]) -> bool:
    """Tell whether a job was done in the planned state, and read and wrote the files as they are now.

    `inputs`: Paths that its rule reads, with the file of its state. `outputs`: Paths that its rule writes.
    """
    state, reads = split_inputs(inputs)
    record = read_record(root / RECORDS / state.removeprefix(f"{STATES}/"))
    return (
        record is not None
        and record.state == read_state(root / state)
        and record.reads == digests_of_files(root, reads)
        and record.writes == digests_of_files(root, record.writes)
        and set(outputs) <= set(record.writes)
    )


def maker_of(root: Path, path: str) -> Record | None:
    """Find the record of the job that wrote the result at `path`; None where there is none.

    The stem of the file is the job's key, where the job has one: records of that name are read first, then those
    of jobs without a key.
    """
    folder, stem = root / RECORDS, path.rpartition("/")[2].rpartition(".")[0]
    with_key = (rule_folder / f"{stem}.json" for rule_folder in folder.glob("*/"))
    for record_file in (*with_key, *folder.glob("*.json")):
        record = read_record(record_file)
        if record is not None and path in record.writes:
            return record
    return None


@dataclass(frozen=True)
class OutdatedResult:
    """A finding: one thing about a job that is not as recorded.

    `job`: Name of the job. `sort`: ``new`` (never finished), ``edited`` or ``missing`` (a result that it wrote), ``input``
    (a result that it read) or ``changed`` (its state). `what`: Path of the result, or name of the changed part of the
    state, such as ``settings``. `was`: The recorded digest.
    """

    job: str
    sort: str
    what: str = ""
    was: str = ""


LONG_AGO_S = 1.0
"""Time that a result gets which is to be made again, s since 1970: older than every input."""


def set_time(path: Path, seconds: float) -> None:
    """Set the time of a file, s since 1970; nothing happens where the file is not there."""
    try:
        files.set_time(path, seconds)
    except FileNotFoundError:
        return
    except OSError as error:
        raise OutputError(
            f"{path}: its time is in the future or out of order, and cannot be set ({error.strerror}): delete this file, "
            "then run again"
        ) from error


class Recorded:
    """The recorded jobs of a campaign, compared with files and states as they are now."""

    def __init__(self, states: States) -> None:
        self.states = states
        self.root = states.campaign.root
        self.digests = FileDigests(self.root).digests_of

    @cached_property
    def records(self) -> dict[str, Record | None]:
        """Record of every job of this campaign that has a state, by name, in the order of the data's way; None without a record."""
        paths = (self.root / STATES).rglob("[!.]*.json")
        jobs = sorted(job_of(path.relative_to(self.root).as_posix()) for path in paths)
        # a state may be left of a medium or figure that the campaign no longer has
        jobs = [job for job in jobs if self.states.has_job(*job)]
        jobs.sort(key=lambda job: RULES.index(job[0]))
        names = (job_name(*job) for job in jobs)
        return {name: read_record(self.root / RECORDS / f"{name}.json") for name in names}

    @cached_property
    def maker(self) -> dict[str, Record]:
        """Record of the job that wrote a result, by the path of the result."""
        return {
            path: record for record in self.records.values() if record for path in record.writes
        }

    def collect_records(self, last: Record | None = None) -> dict[str, Record]:
        """Collect the records of a job and of all jobs that its results are made from, by name, from the last job back.

        `last`: Record of that job; default: of the last job of a whole run.
        """
        waiting = [*filter(None, [last or self.records.get(LAST)])]
        records: dict[str, Record] = {}
        while waiting:
            record = waiting.pop()
            if record.name not in records:
                records[record.name] = record
                waiting += [self.maker[path] for path in record.reads if path in self.maker]
        return records

    @cached_property
    def extra_records(self) -> dict[str, Record]:
        """Records of jobs that a whole run does not need, such as a figure for a paper, by each of their results that exists."""
        of_whole_run = self.collect_records()
        return {
            path: record
            for path, record in self.maker.items()
            if record.name not in of_whole_run and (self.root / path).is_file()
        }

    def findings_of_job(self, name: str) -> list[OutdatedResult]:
        """List what is not as recorded about one job, by its name; nothing where its results are up to date."""
        record = self.records.get(name)
        if record is None:
            return [OutdatedResult(name, "new")]
        now = self.digests([*record.writes, *record.reads])
        state = self.states.state_of(record.rule, record.key)
        findings = [
            OutdatedResult(name, "edited" if now[path] else "missing", path, digest)
            for path, digest in record.writes.items()
            if now[path] != digest
        ]
        findings += [
            OutdatedResult(name, "changed", what, was)
            for what in dict.fromkeys([*record.state, *state])
            if (was := record.state.get(what, "")) != state.get(what, "")
        ]
        findings += [
            OutdatedResult(name, "input", path, digest)
            for path, digest in record.reads.items()
            if now[path] != digest or path not in self.maker
        ]
        return findings

    def findings_of_targets(self, targets: Sequence[str] = ()) -> list[OutdatedResult]:
        """List what is not as recorded about all jobs that the targets need; nothing where nothing is to do.

        `targets`: Paths of results or names of jobs; default: the last job, which needs all others.
        """
        records = {
            name: self.maker.get(name) or self.records.get(name) for name in targets or [LAST]
        }
        never_made = [name for name, record in records.items() if record is None]
        needed_records = {
            job: needed_record
            for record in records.values()
            if record
            for job, needed_record in self.collect_records(record).items()
        }
        needed = {*needed_records}
        # only records say what a target needs: one without a record may need every job, and a job without one may have made
        # a result of which no record says who wrote it
        lacks_maker = any(
            path.startswith(f"{RESULTS}/") and path not in self.maker
            for record in needed_records.values()
            for path in record.reads
        )
        for job, record in self.records.items():
            may_be_needed = never_made or (record is None and lacks_maker)
            if may_be_needed and not self.states.on_demand(job):
                needed.add(job)
        findings = [
            finding
            for job in self.records
            if job in needed
            for finding in self.findings_of_job(job)
        ]
        return findings or [OutdatedResult(name, "new") for name in never_made]

    def list_foreign_files(self) -> list[str]:
        """List files below ``results/`` that no job of this campaign wrote: a user's, or left from an earlier configuration."""
        paths = (self.root / RESULTS).rglob("[!.]*")
        names = (path.relative_to(self.root).as_posix() for path in paths if path.is_file())
        return sorted(
            name for name in names if name not in self.maker and not name.startswith(_NO_RESULTS)
        )

    @cached_property
    def outdated(self) -> set[str]:
        """Names of the jobs that are not as recorded, and of all jobs made from their results."""
        names: set[str] = set()
        # in the order of the data's way: a job comes after those whose results it read
        for name, record in self.records.items():
            reads = record.reads if record else ()
            makers = {self.maker[path].name for path in reads if path in self.maker}
            if self.findings_of_job(name) or makers & names:
                names.add(name)
        return names

    def is_current(self, path: str) -> bool:
        """Tell whether a result is there, and it and all that it is made from are as recorded."""
        return path in self.maker and self.maker[path].name not in self.outdated

    def make_outdated(self, findings: Iterable[OutdatedResult]) -> None:
        """Let Snakemake plan the jobs of some findings, whatever the times of files say.

        Their state files are emptied, to be written anew, and their results get a time before all others. No state file
        is deleted, since these files list the jobs of the campaign.
        """
        for name in {finding.job for finding in findings}:
            state = self.root / STATES / f"{name}.json"
            if state.is_file():
                write_text(state, "")
            record = self.records.get(name)
            for path in record.writes if record else ():
                set_time(self.root / path, LONG_AGO_S)

    def bring_times_back(self) -> None:
        """Set results and states that are dated in the future to one time just past, so that what is made now is newer."""
        now_s = time.time()
        # more than the step of the coarsest file times, 2 s
        passed_s = 10.0
        for path in (self.root / RESULTS).rglob("*"):
            with suppress(FileNotFoundError):
                if path.lstat().st_mtime > now_s and path.is_file():
                    set_time(path, now_s - passed_s)
