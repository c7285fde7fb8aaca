"""No rule of the workflow has become slower: ``make timegate``.

    make timegate                  measure a small campaign, and compare with benchmarks/time_gate.csv
    make timegate ARGS=--rewrite   write the rows of this processor anew: for a change that is worth its time
    make timegate ARGS="--scatter 10"   measure ten times, and print how much each rule scatters

Measured is processor time (user and system, of a job's process and its children) in units of a loop of
fixed work that runs before and after each rule, so that another load of the machine changes the ratio little.
Each rule's lowest ratio counts; rules too short to be judged alone are judged together.
"""

from __future__ import annotations

import argparse
import csv
import datetime as dt
import gc
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"

HERE = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(HERE / "tests" / "helpers"))

import numpy as np
from campaigns import FEW, Job, leave_blank, make_campaign, planned_jobs

from rftfit.version import __version__
from rftfit.workflow.job import do_job
from rftfit.workflow.stages import FIGURE_RULES
from rftfit.workflow.state import States, read_states

TABLE = HERE / "benchmarks" / "time_gate.csv"
COLUMNS = ("rule", "judged", "ratio", "date", "version", "commit", "machine")

PRINTED, FAILED, FAILED_IN_ALL = 1.10, 1.25, 1.15
"""Factors over the stored ratio: from this one on a rule is named, fails, all rules together fail."""
ALL, SHORT = "all rules", "short rules"
SHORTEST = 4.0
"""Ratio below which a rule is judged together with all others below it."""
PASSES, TURNS = 2, 3
"""Measurements of a rule, of which the lowest counts; turns of these for a new table, whose median is kept."""

MEASURED_KEYS = {
    "figure": ("estimated_maps", "legs_poppy_LP"),
    "quality": ("yuma",),
    "robot_runs": ("runs_table",),
}
"""Jobs measured of rules that have many alike; of other rules all jobs are."""

START = [sys.executable, "-P", "-c", "import rftfit.workflow.preload"]
PLAN = [sys.executable, "-P", "-m", "rftfit", "run", "--dry-run"]
COMMANDS = {"(start)": START, "(plan)": PLAN}
"""What a run does besides its jobs: imports of the process that is forked, and planning."""

_RANDOM = np.random.default_rng(2013).random(400_000)


def run_loop() -> None:
    """Do fixed work of the sorts that jobs do: arrays in and beyond the cache, many small objects, texts."""
    for first in range(0, 400_000, 50_000):
        np.sort(_RANDOM[first : first + 50_000])
    for _ in range(6):
        np.cumsum(_RANDOM * _RANDOM + 1.0)
    positions: dict[str, list[tuple[int, str]]] = {}
    for number in range(40_000):
        name = f"{number % 977:.1f}"
        positions.setdefault(name, []).append((number, name))
    sorted(positions.items(), key=lambda item: item[1][-1])


def loop_seconds() -> float:
    """Processor time of the loop."""
    begun = time.process_time()
    run_loop()
    return time.process_time() - begun


def job_seconds(states: States, job: Job) -> float:
    """Processor time of a job in a forked process, as the executor forks it; stops at a failure."""
    child = os.fork()
    if not child:
        status = 1
        try:
            do_job(states, job.reads, job.writes)
            status = 0
        except BaseException:  # noqa: BLE001 (a fork must not go on as its parent)
            sys.excepthook(*sys.exc_info())
        finally:
            os._exit(status)
    return _waited_seconds(child, f"{job.rule} {job.key}")


def command_seconds(command: Sequence[str]) -> float:
    """Processor time of a command; stops at a failure."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    seconds = _waited_seconds(child.pid, " ".join(command))
    child.returncode = 0  # waited for already
    return seconds


def _waited_seconds(child: int, name: str) -> float:
    _, status, usage = os.wait4(child, 0)
    if status:
        sys.exit(f"{name}: failed with status {os.waitstatus_to_exitcode(status)}")
    return usage.ru_utime + usage.ru_stime


class Campaign:
    """Few directions in loose poppy seeds, its legs and robot, and one sand: its results are made, and measured."""

    def __init__(self, root: Path) -> None:
        config = make_campaign(root, ("poppy_LP", "yuma"), directions=FEW).config
        os.chdir(root)
        self._jobs = planned_jobs(config)
        self._states = read_states(config)
        # what was imported and planned lives to the end: no job copies it by looking for garbage in it
        gc.freeze()
        self.rules = [*dict.fromkeys(job.rule for job in self._jobs), *COMMANDS]
        self._passes = [self._measure(self.rules, making=True)]

    def lowest(self, rules: Sequence[str]) -> dict[str, float]:
        """Lowest ratio of each rule in some measurements that were not used before."""
        while len(self._passes) < PASSES:
            self._passes.append(self._measure(rules))
        lowest = {rule: min(ratios[rule] for ratios in self._passes) for rule in rules}
        self._passes = []
        return lowest

    def _measure(self, rules: Sequence[str], *, making: bool = False) -> dict[str, float]:
        """Divide each rule's processor time by that of the loop before and after each of its jobs.

        `making`: do all jobs, also those that are not measured.
        """
        ratios = dict.fromkeys(rules, 0.0)
        work: list[tuple[str, Callable[[], float]]] = []
        for job in self._jobs:
            if job.key in MEASURED_KEYS.get(job.rule, [job.key]):
                if job.rule in ratios:
                    work.append((job.rule, partial(job_seconds, self._states, job)))
            elif making:
                work.append(("", partial(self._do_unmeasured, job)))
        # the last ones, since a plan of results that are not there yet takes longer
        for rule, command in COMMANDS.items():
            if rule in ratios:
                work.append((rule, partial(command_seconds, command)))
        before = loop_seconds()
        for rule, measure_seconds in work:
            seconds = measure_seconds()
            after = loop_seconds()
            if rule:
                ratios[rule] += 2 * seconds / (before + after)
            before = after
        return ratios

    def _do_unmeasured(self, job: Job) -> float:
        if job.rule in FIGURE_RULES:
            leave_blank(Path.cwd(), self._states, job)
            return 0.0
        return job_seconds(self._states, job)


# --- The table, and what is beyond it.


Measurement = Callable[[Sequence[str]], dict[str, float]]
"""Returns the ratios of the named rules."""


@dataclass(frozen=True)
class Stored:
    """A row of the table: how a rule is judged (`SHORT` or alone), its ratio, and what it was measured on."""

    rule: str
    judged: str
    ratio: float
    date: str
    version: str
    commit: str
    machine: str


def read_table(path: Path = TABLE) -> list[Stored]:
    """Read the stored ratios of all processors; empty where there is no table yet."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as handle:
        rows = [*csv.DictReader(handle)]
    return [
        Stored(
            row["rule"],
            row["judged"],
            ratio=float(row["ratio"]),
            date=row["date"],
            version=row["version"],
            commit=row["commit"],
            machine=row["machine"],
        )
        for row in rows
    ]


def rows_of(machine_name: str, table: Sequence[Stored]) -> list[Stored]:
    """Rows of one processor."""
    return [stored for stored in table if stored.machine == machine_name]


def write_table(ratios: Mapping[str, float], path: Path = TABLE) -> None:
    """Write ratios of this processor, and which of them are too short to be judged alone; rows of others stay."""
    date = dt.datetime.now(dt.UTC).date().isoformat()
    origin = date, __version__, commit(), machine()
    rows = [
        Stored(rule, SHORT if ratio < SHORTEST else rule, ratio, *origin)
        for rule, ratio in ratios.items()
    ]
    others = [stored for stored in read_table(path) if stored.machine != machine()]
    with path.open("w", encoding="utf-8", newline="") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in [*others, *rows]:
            writer.writerow(astuple(replace(row, ratio=round(row.ratio, 2))))


def commit() -> str:
    """Commit that the checkout rests on, with + where it was changed."""
    command = ["git", "-C", str(HERE), "describe", "--always", "--exclude=*", "--dirty=+"]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    return completed.stdout.strip() or "unknown"


def machine() -> str:
    """Sort of processor and version of Python: between others, ratios are not comparable to 10 %."""
    fields = {"processor": platform.processor() or platform.machine()}
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(encoding="utf-8").split("\n\n")[0].splitlines()
        fields = dict(line.replace("\t", "").split(": ", 1) for line in lines if ": " in line)
    names = ("processor",) if "model name" not in fields else ("model name", "cpu family", "model")
    python = ".".join(platform.python_version_tuple()[:2])
    return " ".join([*(fields[name] for name in names), f"Python {python}"])


def unmatched(measured: Iterable[str], table: Sequence[Stored]) -> list[str]:
    """List rules that are measured or stored, but not both."""
    return sorted({*measured} ^ {stored.rule for stored in table})


def factors(ratios: Mapping[str, float], table: Sequence[Stored]) -> dict[str, float]:
    """Divide measured by stored ratios: of rules that are judged alone, of the short ones, of all that were measured."""
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for stored in table:
        if stored.rule in ratios:
            for group in (stored.judged, ALL):
                sums[group][0] += ratios[stored.rule]
                sums[group][1] += stored.ratio
    return {group: measured / kept for group, (measured, kept) in sums.items()}


def limit(group: str) -> float:
    """Factor from which on a group of rules fails."""
    return FAILED_IN_ALL if group == ALL else FAILED


def beyond(factor_of: Mapping[str, float]) -> list[str]:
    """List groups of rules that are slower than their limit."""
    return [group for group, factor in factor_of.items() if factor >= limit(group)]


def slower_twice(
    measure: Measurement, table: Sequence[Stored]
) -> tuple[dict[str, float], list[str]]:
    """Factors of all groups of rules, and those groups that are beyond their limit in two measurements.

    Only what is beyond is measured a second time.
    """
    first = factors(measure([stored.rule for stored in table]), table)
    suspects = beyond(first)
    if not suspects:
        return first, []
    again = [stored.rule for stored in table if {stored.judged, ALL} & {*suspects}]
    second = factors(measure(again), table)
    # the sum of all rules is that of all rules only where all were measured
    repeated = {group: second[group] for group in suspects}
    lower = {group: min(factor, repeated.get(group, factor)) for group, factor in first.items()}
    return lower, beyond({group: lower[group] for group in suspects})


def format_factors(factor_of: Mapping[str, float]) -> list[str]:
    """One line for each group of rules that is slower than `PRINTED`, and one for all rules."""
    slowest = sorted(factor_of.items(), key=lambda item: -item[1])
    return [
        f"{group:20} {factor:5.2f} of the stored time (limit {limit(group):.2f})"
        for group, factor in slowest
        if factor >= PRINTED or group == ALL
    ]


# --- What is done by the command.


def rewrite(campaign: Campaign) -> None:
    """Write the table from the median of some measurements; print which factors it changes."""
    turns = [campaign.lowest(campaign.rules) for _ in range(TURNS)]
    ratios = {rule: statistics.median(turn[rule] for turn in turns) for rule in campaign.rules}
    for stored in rows_of(machine(), read_table()):
        if stored.rule in ratios:
            print(f"{stored.rule:20} {stored.ratio:7.2f} -> {ratios[stored.rule]:7.2f}")
    write_table(ratios)
    print(f"{TABLE.relative_to(HERE)}: {len(ratios)} rules")


def print_scatter(campaign: Campaign, repeats: int) -> None:
    """Print how much the measurement of each rule scatters: largest and standard deviation over the median."""
    turns = [campaign.lowest(campaign.rules) for _ in range(repeats)]
    turns_of_rule = {rule: [turn[rule] for turn in turns] for rule in campaign.rules}
    short = [rule for rule in turns_of_rule if statistics.median(turns_of_rule[rule]) < SHORTEST]
    turns_of_rule[SHORT] = [sum(turn[rule] for rule in short) for turn in turns]
    turns_of_rule[ALL] = [sum(turn.values()) for turn in turns]
    print("| rule | ratio, median | largest | standard deviation |\n|---|---|---|---|")
    for rule, ratios in turns_of_rule.items():
        median = statistics.median(ratios)
        deviation = statistics.stdev(ratios) / median
        print(f"| {rule} | {median:.2f} | {max(ratios) / median:.3f} | {deviation:.3f} |")


def why_not_checked(table: Sequence[Stored]) -> str:
    """Say why nothing can be compared here; empty where this processor has stored times."""
    if not hasattr(os, "fork"):
        return "processor time by rule needs a system that can fork a process."
    if rows_of(machine(), table):
        return ""
    stored_machines = ", ".join(sorted({stored.machine for stored in table}))
    return (
        f"the stored times are those of {stored_machines}; this is {machine()}, and a ratio to the loop does not carry over from one "
        "processor to another. `make timegate ARGS=--rewrite` adds this one."
    )


def check(rules: Sequence[str], measure: Measurement) -> int:
    """Compare with the stored times of this processor; 0 where no rule is slower than its limit."""
    table = rows_of(machine(), read_table())
    if names := unmatched(rules, table):
        print(
            f"{TABLE.relative_to(HERE)} and the workflow do not have the same rules: {', '.join(names)}.\n"
            "`make timegate ARGS=--rewrite` measures the table anew.",
            file=sys.stderr,
        )
        return 1
    factor_of, slower = slower_twice(measure, table)
    print("\n".join(format_factors(factor_of)))
    if slower:
        print(
            f"Slower in two measurements: {', '.join(slower)}. Where this is worth it, write the table "
            "anew in the same commit: make timegate ARGS=--rewrite",
            file=sys.stderr,
        )
        return 1
    print(f"No rule is slower than its limit ({FAILED:.2f}; all together {FAILED_IN_ALL:.2f}).")
    return 0


def main() -> int:
    """Measure and compare, or write the table, or print the scatter."""
    # as in the process that the jobs of a run are forked from
    import_module("rftfit.workflow.preload")
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rewrite", action="store_true", help="write the table anew")
    parser.add_argument("--scatter", type=int, metavar="TIMES", help="print the scatter")
    chosen = parser.parse_args()
    is_compared = not (chosen.rewrite or chosen.scatter)
    if is_compared and (why := why_not_checked(read_table())):
        print(f"NOT CHECKED: {why}")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(Path(folder))
        if chosen.rewrite:
            rewrite(campaign)
        elif chosen.scatter:
            print_scatter(campaign, chosen.scatter)
        else:
            return check(campaign.rules, campaign.lowest)
    return 0


if __name__ == "__main__":
    sys.exit(main())
