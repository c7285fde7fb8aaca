"""What would become of the logs of a campaign, told before it is run."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rftfit.campaign.problems import Place, Problem
from rftfit.errors import InputError
from rftfit.measure.ingest import RunRefused, find_compliance, ingest_run
from rftfit.measure.ledger import Ledger
from rftfit.measure.pairs import load_pairs

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run

LARGEST_BYTES = 20_000_000
"""Larger logs are left to the run itself."""

_NUMBERS = re.compile(r"\d+(?:[.,]\d+)*")


@dataclass
class Opened:
    """What was found in the logs of some runs.

    `problems`: One for each sort of reason, with the number of runs it holds for.
    `runs`: Runs whose logs were read; `passed_over`: those with a log that is too large.
    """

    problems: list[Problem] = field(default_factory=list)
    runs: int = 0
    passed_over: int = 0


def open_logs(campaign: Campaign, medium: str) -> Opened:
    """Read the logs of a medium as the run does, and say which runs it would drop, or doubt, and why.

    All runs of a medium that would be dropped are an error, some of them a warning.
    """
    found = Opened()
    if campaign.numbers:
        return found
    runs = []
    for run in campaign.runs_of(medium):
        sizes = [
            _size(campaign, name) for name in (run.force_log, run.motion_log, run.zero_log) if name
        ]
        if run.excluded or None in sizes:
            continue  # the sheet has said so
        if max(size or 0 for size in sizes) > LARGEST_BYTES:
            found.passed_over += 1
            continue
        runs.append(run)
    compliance = None
    if campaign.config.rigid_contact and runs:
        try:
            compliance = find_compliance(campaign, runs[0])
        except InputError as error:
            found.problems.append(Problem("logs.rigid-contact", Place(""), None, str(error)))
            return found
    refused: dict[str, list[tuple[Run, str]]] = defaultdict(list)
    doubted: dict[str, list[tuple[Run, str]]] = defaultdict(list)
    for run, pair in load_pairs(campaign, runs):
        found.runs += 1
        try:
            trace = ingest_run(campaign.config, run, pair, Ledger(), compliance)
        except RunRefused as error:
            refused[_sort(run, str(error))].append((run, str(error)))
        else:
            for flag in trace.flags:
                doubted[_sort(run, flag)].append((run, flag))
    lost = sum(map(len, refused.values())) == len(runs)
    for members in refused.values():
        said = _said(medium, members, len(runs), "would be dropped")
        found.problems.append(
            Problem(
                "logs.refused", said, None, members[0][1], severity="error" if lost else "warning"
            )
        )
    for members in doubted.values():
        said = _said(medium, members, len(runs), "would be flagged")
        found.problems.append(
            Problem("logs.flagged", said, None, members[0][1], severity="warning")
        )
    return found


def _size(campaign: Campaign, name: str) -> int | None:
    try:
        return (campaign.raw / name).stat().st_size
    except OSError:
        return None


def _sort(run: Run, reason: str) -> str:
    """A reason without what differs from run to run: names and numbers."""
    for name in (run.run_id, run.force_log, run.motion_log):
        reason = reason.replace(name, "")
    return _NUMBERS.sub("#", reason)


def _said(medium: str, members: list[tuple[Run, str]], of: int, what: str) -> Place:
    first = members[0][0]
    count = f"{len(members)} of {of} runs" if len(members) > 1 else "1 run"
    more = ", for example " if len(members) > 1 else ": "
    return Place(f"{medium}, {count} {what}{more}{first.run_id} (row {first.row})")
