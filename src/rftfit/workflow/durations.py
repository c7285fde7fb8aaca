"""How long jobs of each rule took in earlier runs, and the time that this leaves of the run that works."""

from __future__ import annotations

import json
import time
from collections import Counter
from pathlib import Path

from rftfit.store import write_text
from rftfit.workflow.snakemake import Progress

FILE = Path(".snakemake/rftfit/durations.json")
"""Beside the results: no time enters any of them."""


def read_durations(root: Path) -> dict[str, float]:
    """Mean duration of a job by rule, seconds; empty where there was no run, or the file is damaged."""
    try:
        seconds_of_rule = json.loads((root / FILE).read_text(encoding="utf-8"))
        return {str(rule): float(seconds) for rule, seconds in seconds_of_rule.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def keep_durations(root: Path, progress: Progress) -> None:
    """Keep the durations of a run, for rules that it did not work on those of earlier ones."""
    if progress.seconds:
        text = json.dumps(read_durations(root) | _means(progress), indent=1, sort_keys=True)
        write_text(root / FILE, text + "\n")


def seconds_left(earlier_means: dict[str, float], progress: Progress, cores: int) -> float | None:
    """Time until the planned jobs are done, s; None where the duration of a rule is not known.

    `earlier_means`: of earlier runs; that of jobs of this run comes first.
    """
    means = earlier_means | _means(progress)
    ended = [*progress.made, *progress.skipped, *progress.failed.values()]
    jobs_left = Counter(progress.planned) - Counter(job.rule for job in ended)
    if not jobs_left or not jobs_left.keys() <= means.keys():
        return None
    now, left_s = time.monotonic(), sum(means[rule] * count for rule, count in jobs_left.items())
    for number, began in progress.began.items():
        left_s -= min(now - began, means[progress.jobs[number].rule])
    return left_s / min(cores, jobs_left.total())


def _means(progress: Progress) -> dict[str, float]:
    return {rule: sum(durations) / len(durations) for rule, durations in progress.seconds.items()}
