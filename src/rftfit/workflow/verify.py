"""`rftfit verify`: whether results, and what they were made from, are still as recorded; why results are out of date.

A job is one use of a rule, such as ``slopes/poppy_LP``. Its record holds the SHA-256 of the files that it read and wrote, and
its state: digests of ``code``, ``settings``, ``rows`` of the run sheet, ``logs``. The last job of a whole run wrote what
all of it depended on (`Provenance`). Paths of results are text, from the campaign's folder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rftfit.campaign.problems import did_you_mean, join_words
from rftfit.errors import InputError
from rftfit.store.links import RESULTS
from rftfit.store.text import count, first_of
from rftfit.workflow.closing import list_others
from rftfit.workflow.provenance import (
    RECORD,
    Change,
    Provenance,
    changes_between,
    format_changes,
    present_provenance,
    read_provenance,
)
from rftfit.workflow.records import OutdatedResult, Recorded


@dataclass(frozen=True)
class Verified:
    """Answer of `rftfit verify`: results compared with their records.

    `now`: Records, with files and states as they are now. `asked`: Paths of results that were asked for by name, empty for
    all. `changes`: Changes in logs, runs, settings, code and versions since the last whole run. `provenance`: What the
    results of that run depended on.
    """

    now: Recorded
    asked: Sequence[str]
    changes: Sequence[Change]
    provenance: Provenance

    @cached_property
    def recorded_paths(self) -> list[str]:
        """Paths of all recorded results: those of a whole run, and those made by name besides, as a figure for a paper."""
        of_whole_run = [
            path for record in self.now.collect_records().values() for path in record.writes
        ]
        return [*of_whole_run, *self.now.extra_records]

    @property
    def paths(self) -> Sequence[str]:
        """Paths of the results that were verified: the ones asked for, or all."""
        return self.asked or self.recorded_paths

    @cached_property
    def differ(self) -> list[str]:
        """Paths of the verified results that are not as recorded, or are made from something that is not."""
        return [path for path in self.paths if not self.now.is_current(path)]

    @property
    def is_as_recorded(self) -> bool:
        """True where there are results, and all verified ones are as recorded."""
        return bool(self.now.collect_records()) and not self.differ

    @cached_property
    def why(self) -> list[str]:
        """Reasons why results are out of date, a sentence each."""
        return list_reasons(self.now)

    def summary(self, most: int | None = None) -> str:
        """Format the answer for people: each result asked for, changes since the last whole run, reasons, a count.

        `most`: Most lines of each list; None: all.
        """
        lines = [
            line for path in self.asked for line in [*_describe_chain(self.now, path, most), ""]
        ]
        changes = [f"Changed: {line}." for line in format_changes(self.changes, most)]
        lines += first_of(changes, most, "more changes")
        results = count(len(self.paths), "result")
        if self.why or self.differ:
            lines += first_of(self.why, most)
            # results that a whole run does not make have to be named
            by_name = self.asked or any(path in self.now.extra_records for path in self.differ)
            with_names = " with their names" if by_name else ""
            lines.append(
                f"{len(self.differ)} of {results} not as recorded; `rftfit run`{with_names} makes "
                f"them again. (Recorded in {RECORD} and results/records.)"
            )
            if self.now.collect_records() and not any(
                finding.sort in _OF_RESULTS for finding in _find_outdated(self.now)
            ):
                lines.append(
                    "No result was edited, damaged or lost: what they are made from has changed."
                )
        else:
            made_with = f"made with rftfit {self.provenance.versions.get('rftfit', '')}"
            made_with += f" at commit {self.provenance.commit}" * bool(self.provenance.commit)
            lines.append(f"{results}: all as recorded, {made_with}.")
        return "\n".join([*lines, *list_others(self.now)])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer as plain words and lists, for ``--json``."""
        return {
            "as_recorded": {path: path not in self.differ for path in self.paths},
            "changed": [str(change) for change in self.changes],
            "why": self.why,
            "others": self.now.list_foreign_files(),
            "versions": self.provenance.versions,
        }


def verify_results(now: Recorded, results: Sequence[Path]) -> Verified:
    """Compare results with their records, and the records with logs, settings and code as they are now.

    `results`: Files and folders whose results are compared; empty for all. Without a record of a whole run raises InputError.
    """
    recorded = read_provenance(now.root / RESULTS)
    changes = changes_between(recorded, present_provenance(now.states))
    # a name may also ask for a result that a whole run does not make, such as a figure for a paper
    asked = _find_asked(results, now.root, [*now.maker])
    return Verified(now, asked, changes, recorded)


def _find_asked(words: Sequence[Path], root: Path, recorded_paths: list[str]) -> list[str]:
    """Find the recorded results that `words` name: files or folders, from the working folder or the campaign's folder `root`.

    `recorded_paths`: Paths of all recorded results, from `root`. Returns those that are named; a word that names none is an
    error.
    """
    asked: dict[str, None] = {}
    for word in words:
        paths = [(Path.cwd() / word).resolve(), (root / word).resolve()]
        candidates = [path for path in paths if root in path.parents]
        asked_paths = [
            path
            for candidate in candidates
            for path in recorded_paths
            if (root / path).is_relative_to(candidate)
        ]
        if not asked_paths:
            nearest = did_you_mean(word.as_posix(), recorded_paths)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InputError(
                f"{word}: not among the {len(recorded_paths)} results that are recorded, so nobody can say "
                f"what it was made from{hint}"
            )
        asked |= dict.fromkeys(asked_paths)
    return list(asked)


def _describe_chain(now: Recorded, name: str, most: int | None) -> list[str]:
    """Describe in lines what the result of path `name` was made from: jobs, logs, rows of the run sheet, and what differs.

    `most`: Most entries of each list; None: all.
    """
    # from the last job back
    jobs = now.collect_records(now.maker[name])
    state = "as recorded" if now.is_current(name) else "not as recorded"
    lines = [f"{name}: {state}", f"  sha256 {now.maker[name].writes[name]}", "  made by:"]
    keys_by_rule: dict[str, list[str]] = {}
    for job in reversed(jobs.values()):
        keys_by_rule.setdefault(job.rule, []).extend(filter(None, [job.key]))
    lines += [
        f"    {rule}{' of ' + join_words(keys, most) if keys else ''}"
        for rule, keys in keys_by_rule.items()
    ]
    # media whose logs were read; a job of all media has none of its own
    jobs_with_logs = (job for job in jobs.values() if "logs" in job.state)
    media = [*filter(None, (now.states.medium_of(job.rule, job.key) for job in jobs_with_logs))]
    logs = list(dict.fromkeys(log for medium in media for log in now.states.log_digests(medium)))
    runs = {run.run_id for medium in media for run in now.states.campaign.runs_of(medium)}
    depends = dict.fromkeys(what for job in jobs.values() for what in job.state)
    lines += [
        f"  {count(len(logs), 'log')}: {join_words(logs, most)}",
        f"  {count(len(runs), 'row')} of the run sheet: {join_words(sorted(runs), most)}",
        f"  depends on: {', '.join(depends)}",
    ]
    findings_of_chain = [finding for job in jobs for finding in now.findings_of_job(job)]
    return lines + [f"  {_format_finding(finding)}" for finding in findings_of_chain[:most]]


def list_reasons(now: Recorded) -> list[str]:
    """Say why results are out of date, a sentence for each reason; without results, say what was never made."""
    return list(dict.fromkeys(map(_format_finding, _find_outdated(now))))


_OF_RESULTS = ("edited", "missing", "new")
"""Values of `OutdatedResult.sort` about the files of results; the others are about what results are made from."""


def _find_outdated(now: Recorded) -> list[OutdatedResult]:
    """Find what differs from the records of all jobs that made results; without results, the jobs that are not done.

    The jobs are those of the whole run and those that made a single result by its name. `now.outdated` also has the jobs
    whose inputs alone are outdated: these have no finding of their own, so that only causes are returned.
    """
    of_whole_run = now.collect_records()
    findings = [] if of_whole_run else now.findings_of_targets()
    jobs = dict.fromkeys([*of_whole_run, *(record.name for record in now.extra_records.values())])
    for job in jobs:
        if job in now.outdated:
            findings += now.findings_of_job(job)
    return findings


def _format_finding(finding: OutdatedResult) -> str:
    """Format one finding about a job as a sentence, without full stop."""
    job = finding.job.replace("/", " ")
    match finding.sort:
        case "edited" | "missing":
            fault = "edited or damaged" if finding.sort == "edited" else "not there"
            return f"result {finding.what}: {fault}; was sha256 {finding.was[:12]}"
        case "new":
            return f"{job}: never finished"
        case "input":
            return f"{job}: {finding.what} is another than it was made from"
        case _:
            return f"{job}: made with other {finding.what}"
