"""Small changes of the program, drawn by a seed from the code of today, each judged by the tests.

    make mutants ARGS="--seed 20261128"                        40 mutants of every room
    make mutants ARGS="--seed 20261128 --rooms model logs"     of two rooms
    make mutants ARGS="--seed 20261128 --changed-since v1.2"   a tenth from lines changed since a commit
    make mutants ARGS="--seed 20261128 --rooms --columns 40"   40 false columns of the published tables
    make mutants ARGS="--seed 20261128 --tests tests/golden"   judged by some tests alone
    make mutants ARGS="--seed 20261128 --only-live"            what lived in the last run, by the tests of today

A mutant is judged by the tests that run its statement, the quickest first, until one fails, and at the end by
`tests/golden`, whose commands run in processes of their own. Which test runs which line is recorded by running the
tests once (`studies/line_recorder.py`), and again when tests or program have changed. Verdicts are in `.mutants/`;
a run that was stopped goes on there. `studies/drawn_mutants.py` says which changes there are.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import importlib
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import false_columns
from drawn_mutants import PACKAGE, ROOT, Mutant, draw_columns, draw_lines, rooms_of_package

WORK = ROOT / ".mutants"
TREE = WORK / "tree"
"""Copy of program and tests in which one mutant at a time is awake."""
COMPILED = TREE / "numba"
"""Cache of compiled functions; numba renews one where its own file has changed."""
SEEN_FALSE = WORK / "seen-false"
"""File that a false column leaves which is not the true one."""
LINES = WORK / "lines"
VERDICTS = WORK / "verdicts.json"
COVERAGE = WORK / "coverage"
"""Where `make` puts the package of that name."""
FINAL_TESTS = ("tests/golden",)
"""Tests whose commands run in processes of their own, where lines are not recorded."""
PRELOADED = ("numpy", "scipy.special", "scipy.linalg", "pandas", "hypothesis", "numba", "pytest")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
QUICK_S, ALL_S, FINAL_S = 4.0, 45.0, 300.0
"""Processor time of the quick tests, of all that run the line, and of the final ones."""
ENDED = "ended with "
"""Begins what stands for a test where the process of the tests was stopped."""
MEMORY_BYTES = 8 * 2**30


def main() -> int:
    """Draw, judge and print; 1 where a room has more live mutants than are allowed."""
    options = parse_options()
    os.environ |= ONE_THREAD
    WORK.mkdir(exist_ok=True)
    if (ROOT.parent / "shared").exists() and not (WORK / "shared").exists():
        (WORK / "shared").symlink_to(ROOT.parent / "shared")
    rooms = rooms_of_package() if options.rooms is None else options.rooms
    if options.only_live:
        mutants = read_verdicts()
    else:
        since = options.changed_since
        mutants = draw_lines(options.seed, rooms, options.number, since, options.share)
        mutants += draw_columns(options.seed, options.columns)
    judge_all(mutants, options)
    print(format_report(mutants))
    return int(largest_live_share(mutants) > options.most_live)


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description="Mutants of the program, judged by its tests.")
    option = parser.add_argument
    option("--seed", type=int, required=True, help="of the draw, for example the date")
    option("--rooms", nargs="*", metavar="ROOM", help="folders or modules of src/rftfit (all)")
    option("--number", type=int, default=40, help="mutants of each room (40)")
    option("--columns", type=int, default=0, help="mutants of published columns (0)")
    option("--changed-since", default="", metavar="COMMIT", help="some from lines changed since")
    option("--share", type=float, default=0.1, help="how many of these (0.1)")
    option("--tests", nargs="+", default=[], metavar="PATH", help="tests that judge (all)")
    option("--recorded", action="store_true", help="use the recording that is there, if older")
    option("--only-live", action="store_true", help="judge the live ones of the last run again")
    option("--most-live", type=float, default=1.0, help="share of a room above which it fails (1)")
    return parser.parse_args()


# --- verdicts ---------------------------------------------------------------------------------------------------


def judge_all(mutants: list[Mutant], options: argparse.Namespace) -> None:
    """Judge the mutants that have no verdict by these tests, and keep each verdict at once."""
    digest = digest_of_sources(options.tests)
    stamp = WORK / "verdicts-of-sources"
    if options.only_live:
        waiting = [mutant for mutant in mutants if mutant.verdict == "live"]
    else:
        is_same = stamp.exists() and stamp.read_text(encoding="utf-8") == digest
        verdicts = {mutant.identity: mutant for mutant in read_verdicts()} if is_same else {}
        for mutant in mutants:
            if mutant.identity in verdicts:
                vars(mutant).update(vars(verdicts[mutant.identity]))
        waiting = [mutant for mutant in mutants if not mutant.verdict]
    stamp.write_text(digest, encoding="utf-8")
    if not waiting:
        return
    recording = record_lines(options, digest)
    for module in PRELOADED:
        importlib.import_module(module)
    begin = time.monotonic()
    judge = Judge(recording, final_tests_of(options.tests))
    for count, mutant in enumerate(waiting, 1):
        judge.judge(mutant)
        contents = [asdict(each_mutant) for each_mutant in mutants]
        VERDICTS.write_text(json.dumps(contents, indent=1), encoding="utf-8")
        minutes = (time.monotonic() - begin) / 60
        print(f"{count:4} of {len(waiting)} {minutes:6.1f} min {mutant}", flush=True)


def final_tests_of(tests: list[str]) -> list[str]:
    """Those of the tests that run the commands in processes of their own."""
    final_tests = [path for path in FINAL_TESTS if (ROOT / path).exists()]
    return [path for path in final_tests if not tests or path in tests]


def read_verdicts() -> list[Mutant]:
    """Mutants of the last run."""
    if not VERDICTS.exists():
        return []
    return [Mutant(**fields) for fields in json.loads(VERDICTS.read_text(encoding="utf-8"))]


def largest_live_share(mutants: list[Mutant]) -> float:
    """Largest share of live mutants in a room, those left out that look equivalent."""
    verdicts_by_room: dict[str, list[str]] = defaultdict(list)
    for mutant in mutants:
        if mutant.verdict != "equivalent-looking":
            verdicts_by_room[mutant.room].append(mutant.verdict)
    shares = (verdicts.count("live") / len(verdicts) for verdicts in verdicts_by_room.values())
    return max(shares, default=0.0)


def format_report(mutants: list[Mutant]) -> str:
    """Counts by room, then every live mutant with its change."""
    lines = ["| room | drawn | noticed | equivalent-looking | live |", "|---|---|---|---|---|"]
    for room in sorted({mutant.room for mutant in mutants}):
        verdicts = [mutant.verdict for mutant in mutants if mutant.room == room]
        counts = [verdicts.count(name) for name in ("noticed", "equivalent-looking", "live")]
        lines.append(f"| {room} | {len(verdicts)} | {' | '.join(map(str, counts))} |")
    unnoticed = [mutant for mutant in mutants if mutant.verdict != "noticed"]
    return "\n".join([*lines, *(f"\n{mutant}\n{mutant.difference}" for mutant in unnoticed)])


# --- which test runs which line -------------------------------------------------------------------------------


@dataclass
class Recording:
    """Which test runs which line, with the time of tests and of the fixtures that they share."""

    seconds: dict[str, float] = field(default_factory=dict)
    """Time of each test that passes."""
    fixtures: dict[str, list[str]] = field(default_factory=dict)
    """Shared fixtures of each test."""
    fixture_seconds: dict[str, float] = field(default_factory=dict)
    contexts: dict[str, dict[int, set[str]]] = field(default_factory=dict)
    """Tests and fixtures by module and line."""

    def tests_of(self, mutant: Mutant) -> set[str]:
        """Tests that run a line of the mutant's statement, themselves or by a shared fixture.

        Where none is recorded, as of compiled code, the tests that run a line of its module or of a module which
        imports it.
        """
        contexts_by_line = self.contexts.get(mutant.module, {})
        contexts = {name for line in mutant.statement for name in contexts_by_line.get(line, ())}
        if not contexts:
            modules = [mutant.module, *modules_that_import(mutant.module)]
            recorded = [self.contexts.get(module, {}) for module in modules]
            contexts = set().union(*(names for lines in recorded for names in lines.values()))
        return {
            test
            for test in self.seconds
            if test in contexts or not contexts.isdisjoint(self.fixtures[test])
        }

    def order(self, tests: Iterable[str]) -> list[tuple[str, float]]:
        """Put the quickest tests first; each with the time up to its end."""
        paid: set[str] = set()
        total_s = 0.0
        ordered = []
        for test in sorted(tests, key=lambda test: (self._cost(test, set()), test)):
            total_s += self._cost(test, paid)
            paid |= set(self.fixtures[test])
            ordered.append((test, total_s))
        return ordered

    def _cost(self, test: str, paid: set[str]) -> float:
        unpaid = (name for name in self.fixtures[test] if name not in paid)
        return self.seconds[test] + sum(self.fixture_seconds.get(name, 0.0) for name in unpaid)


def modules_that_import(module: str) -> list[str]:
    """Modules of the package in whose source another one is imported."""
    room, _, name = f"rftfit/{module.removesuffix('.py')}".replace("/", ".").rpartition(".")
    imported = re.compile(rf"from {room}(\.{name} import|[^\n]*import[^\n]*\b{name}\b)")
    paths = (path for path in PACKAGE.rglob("*.py") if imported.search(path.read_text("utf-8")))
    return [path.relative_to(PACKAGE).as_posix() for path in paths]


def digest_of_sources(tests: Sequence[str]) -> str:
    """Digest of the program, of its tests, and of which of them judge."""
    digest = hashlib.sha256(repr(sorted(tests)).encode())
    for path in files_of_project():
        if path.startswith(("src/", "tests/")):
            digest.update(path.encode())
            digest.update((ROOT / path).read_bytes())
    return digest.hexdigest()


def files_of_project() -> list[str]:
    """Files that git tracks or would track."""
    arguments = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return sorted(path for path in set(listed.splitlines()) if (ROOT / path).is_file())


def record_lines(options: argparse.Namespace, digest: str) -> Recording:
    """Run the tests once with their lines recorded, unless that was done."""
    stamp = LINES / "of-sources"
    recorded_digest = stamp.read_text(encoding="utf-8") if stamp.exists() else ""
    if recorded_digest == digest or (recorded_digest and options.recorded):
        return read_recording()
    print("recording which test runs which line: the tests once ...", flush=True)
    shutil.rmtree(LINES, ignore_errors=True)
    arguments = ["-p", "line_recorder", "--record-lines", str(LINES), "-q", "-m", "not page"]
    arguments += ["-n", str(os.cpu_count()), "--dist", "loadfile", "--no-loadscope-reorder"]
    arguments += ["-p", "no:cacheprovider", *options.tests]
    search_path = os.pathsep.join([str(ROOT / "studies"), str(COVERAGE)])
    environment = os.environ | {"PYTHONPATH": search_path}
    subprocess.run(
        [sys.executable, "-m", "pytest", *arguments], cwd=ROOT, env=environment, check=False
    )
    stamp.write_text(digest, encoding="utf-8")
    return read_recording()


def read_recording() -> Recording:
    """Join what the processes of the tests have written."""
    sys.path.append(str(COVERAGE))
    coverage: Any = importlib.import_module("coverage")
    recording = Recording()
    for path in sorted(LINES.glob("tests-*.json")):
        record = json.loads(path.read_text(encoding="utf-8"))
        for test, outcome in record["tests"].items():
            recording.fixtures[test] = outcome["fixtures"]
            if outcome["passed"] and (ROOT / test.partition("::")[0]).exists():
                recording.seconds[test] = outcome["seconds"]
        for fixture, seconds in record["fixtures"].items():
            longest_s = max(seconds, recording.fixture_seconds.get(fixture, 0.0))
            recording.fixture_seconds[fixture] = longest_s
    for path in sorted(LINES.glob("lines.*")):
        lines = coverage.CoverageData(basename=str(path))
        lines.read()
        for file in lines.measured_files():
            module = Path(file).as_posix().rpartition("/src/rftfit/")[2]
            contexts_by_line = recording.contexts.setdefault(module, {})
            for line, contexts in lines.contexts_by_lineno(file).items():
                contexts_by_line.setdefault(line, set()).update(filter(None, contexts))
    return recording


# --- judging --------------------------------------------------------------------------------------------------


class Judge:
    """Tests one mutant at a time in a copy of program and tests."""

    def __init__(self, recording: Recording, final_tests: list[str]) -> None:
        self.recording = recording
        self.final_tests = final_tests
        self.untrusted: set[str] = set()
        """Tests that fail in the copy as it is, so they cannot judge."""
        self.stamp_s = 1_000_000_000
        self.passes_unchanged = cache(self._passes_unchanged)
        shutil.rmtree(TREE, ignore_errors=True)
        for path in files_of_project():
            (TREE / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, TREE / path)

    def judge(self, mutant: Mutant) -> None:
        """Run the tests that can notice a mutant, and write its verdict into it."""
        source = (PACKAGE / mutant.module).read_text(encoding="utf-8")
        mutant.tests, mutant.noticed_by = 0, ""
        mutant.tests_of_line = len(self.recording.tests_of(mutant))
        SEEN_FALSE.unlink(missing_ok=True)
        for tests, seconds in self._rounds(mutant):
            mutant.tests += len(tests)
            mutant.noticed_by = self._noticing_test(mutant, source, tests, seconds)
            if mutant.noticed_by:
                mutant.verdict = "noticed"
                return
        is_same_table = mutant.is_column and not SEEN_FALSE.exists()
        is_equivalent = mutant.looks_equivalent or is_same_table
        mutant.verdict = "equivalent-looking" if is_equivalent else "live"

    def _rounds(self, mutant: Mutant) -> Iterator[tuple[list[str], float]]:
        """Tests to run one after the other, with their processor time."""
        ordered = self.recording.order(self.recording.tests_of(mutant))
        quick = [test for test, until_s in ordered if until_s <= QUICK_S]
        quick = quick or [test for test, _ in ordered[:1]]
        slower = [test for test, until_s in ordered if until_s <= ALL_S and test not in quick]
        rounds = [(quick, QUICK_S), (slower, ALL_S), (self.final_tests, FINAL_S)]
        return ((tests, seconds) for tests, seconds in rounds if tests)

    def _noticing_test(self, mutant: Mutant, source: str, tests: list[str], seconds: float) -> str:
        """First test that fails with the mutant and passes without it, or how the tests ended."""
        while True:
            self._put(mutant.module, mutant.mutated(source))
            failed = self._first_failure(tests, seconds)
            self._put(mutant.module, source)
            if not failed or failed.startswith(ENDED) or self.passes_unchanged(failed):
                return failed
            self.untrusted.add(failed)

    def _passes_unchanged(self, test: str) -> bool:
        return not self._first_failure([test], ALL_S)

    def _put(self, module: str, source: str) -> None:
        """Write a module with a time of its own, so that no compiled file of another mutant is taken for it."""
        path = TREE / "src" / "rftfit" / module
        path.write_text(source, encoding="utf-8")
        if "_compiled" in source:
            # a compiled caller in another file would go on with what it had compiled
            shutil.rmtree(COMPILED, ignore_errors=True)
        self.stamp_s += 10
        os.utime(path, (self.stamp_s, self.stamp_s))

    def _first_failure(self, tests: list[str], nominal_s: float) -> str:
        """Run tests in a child process up to the first failure; its name, or how the child ended."""
        failed = TREE / "failed.txt"
        failed.unlink(missing_ok=True)
        child = os.fork()
        if child == 0:
            status = 70
            try:
                status = run_tests(
                    [*tests, *(f"--deselect={test}" for test in self.untrusted)], nominal_s
                )
            finally:
                os._exit(status)
        _, status = os.waitpid(child, 0)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child, signal.SIGKILL)  # what the tests have left running
        exit_code = os.waitstatus_to_exitcode(status)
        if exit_code in (0, 5):  # passed, or no test there
            return ""
        return failed.read_text(encoding="utf-8") if failed.exists() else f"{ENDED}{exit_code}"


def forget_program() -> None:
    """Let the next import take the program of the copy: columns are drawn by that of the project, which stays imported."""
    for name in [*sys.modules]:
        if name.partition(".")[0] in (PACKAGE.name, Path(false_columns.__file__).stem):
            del sys.modules[name]


def run_tests(tests: list[str], nominal_s: float) -> int:
    """In the child: run tests of a copy; leave the name of the first that fails in a file."""
    import pytest

    os.setsid()
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    for limit in (signal.SIGPROF, signal.SIGALRM):
        signal.signal(limit, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, 20 + 8 * nominal_s)
    signal.alarm(int(300 + 32 * nominal_s))
    os.chdir(TREE)
    # in memory where the system has such a folder, since a disk may delete slowly
    memory = Path("/dev/shm")  # noqa: S108 (a folder in it has a drawn name)
    name = f"rftfit-mutants-{hashlib.sha256(str(TREE).encode()).hexdigest()[:12]}"
    scratch = memory / name if os.access(memory, os.W_OK) else TREE / "scratch"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    search_path = [str(TREE / "src"), str(TREE / "studies")]
    sys.path[:0] = search_path
    forget_program()
    os.environ |= {
        "PYTHONPATH": os.pathsep.join(search_path),
        "NUMBA_CACHE_DIR": str(COMPILED),
        "HYPOTHESIS_STORAGE_DIRECTORY": str(scratch / "hypothesis"),
        "TMPDIR": str(scratch),
        false_columns.SEEN: str(SEEN_FALSE),
    }
    log = os.open(TREE / "log.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)

    class FirstFailure:
        """Writes the name of the first test, or of the first module of tests, that fails."""

        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            self.write(report)

        def pytest_collectreport(self, report: pytest.CollectReport) -> None:
            self.write(report)

        def write(self, report: pytest.TestReport | pytest.CollectReport) -> None:
            # the session, which has no name, fails after a module that cannot be imported
            failed = TREE / "failed.txt"
            if report.failed and report.nodeid and not failed.exists():
                failed.write_text(report.nodeid, encoding="utf-8")

    arguments = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--no-showlocals"]
    arguments += ["--tb=short", "--basetemp", str(scratch / "pytest")]
    arguments += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    return int(pytest.main([*arguments, *tests], plugins=[FirstFailure()]))


if __name__ == "__main__":
    sys.exit(main())
