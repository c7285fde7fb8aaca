"""Records of finished jobs, and when a job counts as out of date: a file or its state is not as its record says.

A job is a rule (such as ``slopes``) with one value of its wildcard, its key (such as a medium); its name is ``RULE/KEY``, or
``RULE`` without a wildcard. Its *state* is a dict from ``code``, ``settings``, ``rows``, ``order``, ``logs``, ``robot files``
to a digest: what its results depend on besides the files that it reads. A *record* is written when a job has finished: one
small file, ``results/records/RULE/KEY.json``, with its state and the SHA-256 of each file that it read and wrote.

Paths of results are text, relative to the campaign's folder, as ``results/runs/poppy_LP.csv``. Snakemake plans jobs by the
times of files alone, which do not show an edited result or a changed setting: so `rftfit run` asks these records first.
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
"""Folder of the records, from the campaign's folder."""


@dataclass(frozen=True)
class Record:
    """One finished job: its rule and key, its state, and the SHA-256 of each file that it read and wrote, by path.

    `key` is empty for a rule without a wildcard. `reads` is without the file of the state.
    """

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
        """Write the record to its file in the campaign's folder `root`."""
        text = json.dumps(asdict(self), indent=1, sort_keys=True) + "\n"
        write_text(root / RECORDS / f"{self.name}.json", text)


def read_record(path: Path) -> Record | None:
    """Read a record; None where the file is not there or damaged, so that its job counts as never finished."""
    try:
        record = Record(**json.loads(path.read_text(encoding="utf-8")))
        texts = [record.rule, record.key]
        for digests in (record.state, record.reads, record.writes):
            texts += digests.values()
    except (OSError, ValueError, TypeError, AttributeError):
        return None
    # a damaged file may still be JSON with the right names
    return record if all(isinstance(text, str) for text in texts) else None


def read_state(path: Path) -> dict[str, str]:
    """Read the planned state of a job from its file, ``results/state/RULE/KEY.json``; empty where it is absent or damaged."""
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


def split_inputs(inputs: Iterable[str]) -> tuple[str, list[str]]:
    """Split the paths of a job's inputs; return the path of the file of its state, and the results that it reads.

    Every rule has exactly one file of a state among its inputs.
    """
    inputs = [*inputs]
    (state,) = (path for path in inputs if path.startswith(f"{STATES}/"))
    return state, [path for path in inputs if path != state]


def record_holds(root: Path, inputs: Iterable[str], outputs: Iterable[str]) -> bool:
    """Return True where a job need not be done again: it was done in the planned state, and its files are as recorded.

    The executor asks this for a job that Snakemake has planned because an input is newer, though its content may be the
    same. `inputs`: Paths that its rule reads, one of which is the file of its state. `outputs`: Paths that its rule writes.
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

    Few records are read: a job with a key writes files whose stem is this key (``results/runs/poppy_LP.csv``), and so
    does its record; records of jobs without a key are read last.
    """
    folder = root / RECORDS
    stem = path.rpartition("/")[2].rpartition(".")[0]
    with_key = (rule_folder / f"{stem}.json" for rule_folder in folder.glob("*/"))
    for record_file in (*with_key, *folder.glob("*.json")):
        record = read_record(record_file)
        if record is not None and path in record.writes:
            return record
    return None


@dataclass(frozen=True)
class OutdatedResult:
    """A finding: one thing about a job that is not as recorded, so that the job is to be done again.

    `job`: Name of the job. `sort`: ``new`` (never finished), ``edited`` or ``missing`` (a result that it wrote), ``input``
    (a result that it read) or ``changed`` (its state). `what`: Path of the result, or key of the changed entry of the
    state, such as ``settings``; empty for ``new``. `was`: The recorded digest of it; empty for ``new``.
    """

    job: str
    sort: str
    what: str = ""
    was: str = ""


_NO_RESULTS = tuple(f"{RESULTS}/{name}/" for name in ("records", "state", "logs"))
"""Folders whose files are no results: records, states and logs of jobs."""


class Recorded:
    """The recorded jobs of a campaign, compared with files and states as they are now.

    Every file and every state is read once, at the first question about it: after a run a new `Recorded` is needed.
    `states`: The campaign, with the states of its jobs as they are now. `root`: The campaign's folder. `digests`: Function
    from paths to their SHA-256, by path; empty for a file that is not there.
    """

    def __init__(self, states: States) -> None:
        self.states = states
        self.root = states.campaign.root
        self.digests = FileDigests(self.root).digests_of

    @cached_property
    def records(self) -> dict[str, Record | None]:
        """Records by name of the job; None for a job that has a state and no record, which means that it never finished.

        The order is that of the rules, in which a job comes behind those whose results it reads. The jobs are taken from
        the state files, since Snakemake, which alone has the list of all jobs, writes such a file for each when it plans.
        """
        paths = (self.root / STATES).rglob("[!.]*.json")
        jobs = sorted(job_of(path.relative_to(self.root).as_posix()) for path in paths)
        # a state may be left of a medium or figure that the campaign no longer has
        jobs = [job for job in jobs if self.states.has_job(*job)]
        jobs.sort(key=lambda job: RULES.index(job[0]))
        names = (job_name(*job) for job in jobs)
        return {name: read_record(self.root / RECORDS / f"{name}.json") for name in names}

    @cached_property
    def maker(self) -> dict[str, Record]:
        """For each result, by its path: the record of the job that wrote it."""
        return {
            path: record for record in self.records.values() if record for path in record.writes
        }

    def collect_records(self, last: Record | None = None) -> dict[str, Record]:
        """Collect by name the records of a job and of all jobs that its results are made from, that job first.

        `last`: Record of that job; default: of the last job of a whole run, which reads all results; without such a record
        the answer is empty.
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
        """By the path of each result that exists and that a whole run does not make: the record of the job that wrote it.

        Such results were made by name, as a figure for a paper.
        """
        of_whole_run = self.collect_records()
        return {
            path: record
            for path, record in self.maker.items()
            if record.name not in of_whole_run and (self.root / path).is_file()
        }

    def findings_of_job(self, name: str) -> list[OutdatedResult]:
        """List what is not as recorded about one job, by its name; nothing where all it read, wrote and used is as it was.

        Jobs before it are not asked: its input may be as recorded, and yet out of date (`outdated` follows this).
        """
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
        """List what is not as recorded about all jobs that the targets need; nothing where nothing is to be done.

        `targets`: Paths of results or names of jobs; default: the last job of a whole run, which needs all others. What a
        job needs is known from records only: where one is lacking, every job that might be needed is taken.
        """
        records_of_targets = {
            name: self.maker.get(name) or self.records.get(name) for name in targets or [LAST]
        }
        never_made = [name for name, record in records_of_targets.items() if record is None]
        needed_records: dict[str, Record] = {}
        for record in filter(None, records_of_targets.values()):
            needed_records |= self.collect_records(record)
        # a target without a record may need any job; and where no record says who wrote a result that is needed, any job
        # without a record may have written it
        lacks_maker = any(
            path.startswith(f"{RESULTS}/") and path not in self.maker
            for record in needed_records.values()
            for path in record.reads
        )
        findings: list[OutdatedResult] = []
        for job, record_of_job in self.records.items():
            may_be_needed = never_made or (record_of_job is None and lacks_maker)
            if job in needed_records or (may_be_needed and not self.states.on_demand(job)):
                findings += self.findings_of_job(job)
        # before the first run there are no jobs to say anything about
        return findings or [OutdatedResult(name, "new") for name in never_made]

    def list_foreign_files(self) -> list[str]:
        """List paths of files below ``results/`` that no job of this campaign wrote: a user's, or of an earlier config."""
        paths = (self.root / RESULTS).rglob("[!.]*")
        names = (path.relative_to(self.root).as_posix() for path in paths if path.is_file())
        return sorted(
            name for name in names if name not in self.maker and not name.startswith(_NO_RESULTS)
        )

    @cached_property
    def outdated(self) -> set[str]:
        """Names of the jobs that are not as recorded, and of all jobs made from their results."""
        names: set[str] = set()
        # a job comes behind those whose results it read (`records`), so these are settled before it
        for name, record in self.records.items():
            reads = record.reads if record else ()
            makers = {self.maker[path].name for path in reads if path in self.maker}
            if self.findings_of_job(name) or makers & names:
                names.add(name)
        return names

    def is_current(self, path: str) -> bool:
        """Return True where a result is there, and it and all that it is made from are as recorded."""
        return path in self.maker and self.maker[path].name not in self.outdated

    def make_outdated(self, findings: Iterable[OutdatedResult]) -> None:
        """Change files so that Snakemake plans the jobs of some findings: it plans a job whose input is newer than its output.

        Their state files are emptied: Snakemake's process writes them anew, and so newer. Their results get a time before
        all others. No state file is deleted, since these files list the jobs of the campaign (`records`).
        """
        for name in {finding.job for finding in findings}:
            state = self.root / STATES / f"{name}.json"
            if state.is_file():
                write_text(state, "")
            record = self.records.get(name)
            for path in record.writes if record else ():
                set_time(self.root / path, LONG_AGO_S)

    def bring_times_back(self) -> None:
        """Set the time of files below ``results/`` that are dated in the future to one just past.

        Such times come from a clock that was wrong or another machine; what is made now would seem older than its inputs.
        """
        now_s = time.time()
        # more than the step of the coarsest file times, 2 s
        passed_s = 10.0
        for path in (self.root / RESULTS).rglob("*"):
            with suppress(FileNotFoundError):
                if path.lstat().st_mtime > now_s and path.is_file():
                    set_time(path, now_s - passed_s)


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
