"""Does a test notice when the program is changed in a small way? 400 changes, the same each time.

    make mutants                         judge the changes of studies/mutants.csv by the tests of today
    make mutants ARGS=--keep             ... and keep the verdicts in that file
    make mutants ARGS="--only model"     those of some modules
    make mutants ARGS=--draw             draw the changes anew: after the code has changed
    make mutants ARGS="--show 17"        what a change does, and which tests can notice it

A change (a mutant) is drawn from all lines that tests run in their own process, from every room. The tests that
run its line judge it, the quickest first, until one fails. Which test runs which line is recorded by running the
suite once (`studies/line_recorder.py`), and again when tests or program have changed. Work that is stopped goes on
where it was. The program ends with 1 where a change that a test noticed before is noticed no more.

mutmut makes the changes. They are written into a copy of the program and tested in a child of a process that
has numpy, scipy and pandas loaded, one on each core.
"""

from __future__ import annotations

import argparse
import ast
import csv
import difflib
import hashlib
import importlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "rftfit"
KEPT_CSV = ROOT / "studies" / "mutants.csv"
WORK = ROOT / ".mutants"
LINES = WORK / "lines"
JUDGED = WORK / "judged.csv"
COPIED = (
    "src",
    "tests",
    "config",
    "docs",
    "examples",
    "profiles",
    "studies",
    "workflow",
    "benchmarks",
    "requirements",
    ".github",
    ".ci",
    "raw",
    "pyproject.toml",
    "Snakefile",
    "README.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "LICENSE",
    "Makefile",
    "noxfile.py",
)
PRELOADED = (
    "numpy",
    "scipy.special",
    "scipy.linalg",
    "pandas",
    "hypothesis",
    "numba",
    "pydantic",
    "yaml",
    "pytest",
)
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
NUMBER_DRAWN, SEED = 400, 2013
FEWEST_OF_A_ROOM = 8
FIRST_ROUND_S, ALL_ROUNDS_S = 4.0, 45.0
"""Time, as the recording measured it, of the tests that are tried first and of all that may judge one change."""
MEMORY_BYTES = 8 * 2**30
DIED = ("killed", "timeout", "crash")


@dataclass
class Mutant:
    """One small change of the program and what came of it."""

    number: int
    module: str
    function: str
    line: int
    removed: str
    added: str
    occurrence: int = 0
    """Place among equal passages of the function."""
    verdict: str = ""
    noticed_by: str = ""
    tests: int = 0
    seconds: float = 0.0

    @property
    def room(self) -> str:
        """Folder below src/rftfit, or the module's own name."""
        return self.module.partition("/")[0]

    @property
    def died(self) -> bool:
        """Whether some test noticed it."""
        return self.verdict in DIED


# --- mutants in files -----------------------------------------------------------------------------------------


def read_mutants(path: Path) -> list[Mutant]:
    """Mutants of a csv file."""
    if not path.exists():
        return []
    numbers = {"number": int, "line": int, "occurrence": int, "tests": int, "seconds": float}
    with path.open(newline="", encoding="utf-8") as lines:
        return [
            Mutant(**{name: numbers.get(name, str)(text) for name, text in row.items()})
            for row in csv.DictReader(lines)
        ]


def write_mutants(mutants: list[Mutant], path: Path) -> None:
    """Write all mutants in the order of their numbers."""
    with path.open("w", newline="", encoding="utf-8") as out:
        writer = csv.DictWriter(
            out, [column.name for column in fields(Mutant)], lineterminator="\n"
        )
        writer.writeheader()
        writer.writerows(asdict(mutant) for mutant in sorted(mutants, key=lambda m: m.number))


# --- which test runs which line -------------------------------------------------------------------------------


@dataclass
class Recording:
    """Which test runs which line, with the time of tests and of the fixtures that they share."""

    seconds: dict[str, float] = field(default_factory=dict)
    """Of each test that passes."""
    fixtures: dict[str, list[str]] = field(default_factory=dict)
    """Shared fixtures of each test."""
    fixture_seconds: dict[str, float] = field(default_factory=dict)
    contexts: dict[str, dict[int, set[str]]] = field(default_factory=dict)
    """Contexts by module and line."""

    def lines(self, module: str) -> dict[int, set[str]]:
        """Tests that run each line of a module."""
        tests_of_fixture: dict[str, set[str]] = defaultdict(set)
        for test, fixtures in self.fixtures.items():
            for fixture in fixtures:
                tests_of_fixture[fixture].add(test)
        passed = self.seconds.keys()
        tests_by_line = {}
        for line, contexts in self.contexts.get(module, {}).items():
            tests: set[str] = set()
            for context in contexts:
                tests |= tests_of_fixture.get(context, {context})
            tests_by_line[line] = tests & passed
        return {line: tests for line, tests in tests_by_line.items() if tests}

    def order(self, tests: set[str]) -> list[tuple[str, float]]:
        """Put the cheapest tests first; each with the time up to its end."""
        paid: set[str] = set()
        total = 0.0
        ordered = []
        for test in sorted(tests, key=lambda test: (self._cost(test, set()), test)):
            total += self._cost(test, paid)
            paid |= set(self.fixtures[test])
            ordered.append((test, total))
        return ordered

    def keep(self, tests: set[str]) -> None:
        """Leave out tests that are no more."""
        self.seconds = {test: s for test, s in self.seconds.items() if test in tests}
        self.fixtures = {test: f for test, f in self.fixtures.items() if test in tests}

    def _cost(self, test: str, paid: set[str]) -> float:
        unpaid = (name for name in self.fixtures[test] if name not in paid)
        return self.seconds[test] + sum(self.fixture_seconds.get(name, 0.0) for name in unpaid)


def digest_of_sources() -> str:
    """Digest of program and tests."""
    digest = hashlib.sha256()
    for top in ("src", "tests"):
        for path in sorted((ROOT / top).rglob("*.py")):
            digest.update(path.relative_to(ROOT).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def record_lines(*, is_older_enough: bool = False) -> Recording:
    """Run the suite once with its lines recorded, unless the recording is of these sources, or an older one is enough."""
    stamp = LINES / "of-sources"
    digest = digest_of_sources()
    is_current = stamp.exists() and stamp.read_text(encoding="utf-8") == digest
    if is_older_enough and stamp.exists() and not is_current:
        recording = read_recording(LINES)
        recording.keep(collected_tests())
        return recording
    if not is_current:
        print("recording which test runs which line: the whole suite once ...", flush=True)
        shutil.rmtree(LINES, ignore_errors=True)
        words = [
            "-p",
            "line_recorder",
            "--record-lines",
            str(LINES),
            "-q",
            "-m",
            "not page",
            "-n",
            str(os.cpu_count()),
            "--dist",
            "loadfile",
            "--no-loadscope-reorder",
            "-p",
            "no:cacheprovider",
        ]
        paths = os.pathsep.join([str(ROOT / "studies"), str(WORK / "tool")])
        subprocess.run(
            [sys.executable, "-m", "pytest", *words],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": paths, **dict.fromkeys(THREADS, "1")},
            check=False,
        )
        stamp.write_text(digest, encoding="utf-8")
    return read_recording(LINES)


def collected_tests() -> set[str]:
    """Tests that the suite has now."""
    words = ["--collect-only", "-q", "-n", "0", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return {line for line in done.stdout.splitlines() if "::" in line}


def read_recording(folder: Path) -> Recording:
    """Join what the processes of the suite have written."""
    coverage: Any = importlib.import_module("coverage")
    recording = Recording()
    for path in sorted(folder.glob("tests-*.json")):
        record = json.loads(path.read_text(encoding="utf-8"))
        for test, about in record["tests"].items():
            recording.fixtures[test] = about["fixtures"]
            if about["passed"]:
                recording.seconds[test] = about["seconds"]
        for fixture, seconds in record["fixtures"].items():
            longest = max(seconds, recording.fixture_seconds.get(fixture, 0.0))
            recording.fixture_seconds[fixture] = longest
    for path in sorted(folder.glob("lines-*")):
        data = coverage.CoverageData(basename=str(path))
        data.read()
        for file in data.measured_files():
            module = Path(file).as_posix().rpartition("/src/rftfit/")[2]
            contexts_of_lines = recording.contexts.setdefault(module, {})
            for line, contexts in data.contexts_by_lineno(file).items():
                contexts_of_lines.setdefault(line, set()).update(filter(None, contexts))
    return recording


# --- drawing --------------------------------------------------------------------------------------------------


def draw(recording: Recording, number: int, seed: int) -> list[Mutant]:
    """Draw mutants from all covered lines, at least some from every room."""
    changes: dict[str, Changes] = {}
    candidates: dict[str, list[tuple[str, int]]] = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        module = path.relative_to(PACKAGE).as_posix()
        lines = recording.lines(module)
        if lines:
            changes[module] = Changes(module, path.read_text(encoding="utf-8"))
            places = changes[module].covered(lines)
            candidates[module.partition("/")[0]] += [(module, place) for place in places]
    total = sum(map(len, candidates.values()))
    print(f"{total} mutants of covered lines in {len(candidates)} rooms and modules", flush=True)
    random_order = random.Random(seed)
    drawn: dict[str, list[tuple[str, int]]] = {}
    for room, of_room in sorted(candidates.items()):
        share = max(round(number * len(of_room) / total), FEWEST_OF_A_ROOM)
        drawn[room] = random_order.sample(of_room, min(share, len(of_room)))
    while (
        sum(map(len, drawn.values())) > number
    ):  # the largest rooms give back what small ones have too much
        max(drawn.values(), key=len).pop()
    mutants = [
        changes[module].mutant(place) for of_room in drawn.values() for module, place in of_room
    ]
    mutants.sort(key=lambda mutant: (mutant.module, mutant.line, mutant.added))
    for place, mutant in enumerate(mutants, 1):
        mutant.number = place
    return mutants


class Changes:
    """All small changes of a module that mutmut knows, but those of messages."""

    def __init__(self, module: str, source: str) -> None:
        mutation: Any = importlib.import_module("mutmut.mutation.file_mutation")
        metadata: Any = importlib.import_module("libcst.metadata")
        self.module = module
        self.source = source
        tree = ast.parse(source)
        self.spans = statement_spans(tree)
        self.functions = function_spans(tree)
        self.plain = without_decorators(source, tree)
        self.parsed, self.changes, *_ = mutation.create_mutations(
            module, self.plain, None, lines_of_raise(tree)
        )
        wrapper = metadata.MetadataWrapper(self.parsed, unsafe_skip_copy=True)
        self.places = wrapper.resolve(metadata.PositionProvider)

    def covered(self, lines: dict[int, set[str]]) -> list[int]:
        """Changes of functions whose statement tests run, by their place in the list of all."""
        cst: Any = importlib.import_module("libcst")
        texts = (cst.SimpleString, cst.FormattedString, cst.ConcatenatedString)
        covered = []
        for number, change in enumerate(self.changes):
            node = change.original_node
            position = self.places.get(node)
            if position is None or not self._function_at(position.start.line):
                continue
            if isinstance(node, texts) and " " in self.parsed.code_for_node(node):
                continue  # words for people, not what the program does
            line = position.start.line
            first, last = self.spans.get(line, (line, line))
            if any(line in lines for line in range(first, last + 1)):
                covered.append(number)
        return covered

    def _function_at(self, line: int) -> str:
        spans = self.functions
        return next((name for name, (first, last) in spans if first <= line <= last), "")

    def mutant(self, number: int) -> Mutant:
        """One of the changes, as lines that are replaced."""
        change = self.changes[number]
        after = self.parsed.deep_replace(change.original_node, change.mutated_node).code
        begin, end, new = changed_passage(
            self.plain.splitlines(keepends=True), after.splitlines(keepends=True)
        )
        original = self.source.splitlines(keepends=True)
        function = self._function_at(self.places[change.original_node].start.line)
        function_begin = dict(self.functions)[function][0] - 1
        removed = "".join(original[begin:end])
        earlier = "".join(original[function_begin:begin])
        return Mutant(
            0, self.module, function, begin + 1, removed, "".join(new), earlier.count(removed)
        )


def changed_passage(before: list[str], after: list[str]) -> tuple[int, int, list[str]]:
    """Lines [begin, end) that a change replaces, and what it puts there."""
    begin = 0
    while begin < min(len(before), len(after)) and before[begin] == after[begin]:
        begin += 1
    tail = 0
    while tail < min(len(before), len(after)) - begin and before[-1 - tail] == after[-1 - tail]:
        tail += 1
    return begin, len(before) - tail, after[begin : len(after) - tail]


def without_decorators(source: str, tree: ast.Module) -> str:
    """Blank the decorators of functions: mutmut leaves out what has one."""
    lines = source.splitlines(keepends=True)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            for decorator in node.decorator_list:
                for number in range(decorator.lineno, (decorator.end_lineno or 0) + 1):
                    lines[number - 1] = "\n"
    return "".join(lines)


def lines_of_raise(tree: ast.Module) -> set[int]:
    """Lines of the statements that raise an error: that there is one is tested, not how it is worded."""
    return {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Raise)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }


def statement_spans(tree: ast.Module) -> dict[int, tuple[int, int]]:
    """First and last line of the innermost statement, or of its head, by line."""
    spans = {}
    for node in ast.walk(tree):  # outer statements come before inner ones
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            last = max(body[0].lineno - 1, node.lineno) if body else node.end_lineno or node.lineno
            for line in range(node.lineno, last + 1):
                spans[line] = (node.lineno, last)
    return spans


def function_spans(tree: ast.AST, prefix: str = "") -> list[tuple[str, tuple[int, int]]]:
    """Qualified names of functions and methods with their first and last line."""
    spans = []
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            spans.append((prefix + node.name, (node.lineno, node.end_lineno or node.lineno)))
        elif isinstance(node, ast.ClassDef):
            spans += function_spans(node, f"{prefix}{node.name}.")
    return spans


def mutated_source(source: str, mutant: Mutant) -> tuple[str, int] | None:
    """The module with a mutant in it and the line where it begins now, or None where the passage is there no more."""
    span = dict(function_spans(ast.parse(source))).get(mutant.function)
    if span is None:
        return None
    lines = source.splitlines(keepends=True)
    head, body, tail = lines[: span[0] - 1], lines[span[0] - 1 : span[1]], lines[span[1] :]
    text = "".join(body)
    begin = -1
    for _ in range(mutant.occurrence + 1):
        begin = text.find(mutant.removed, begin + 1)
        if begin < 0:
            return None
    changed = text[:begin] + mutant.added + text[begin + len(mutant.removed) :]
    first_line = span[0] + text.count("\n", 0, begin)
    return "".join([*head, changed, *tail]), first_line


# --- judging --------------------------------------------------------------------------------------------------


class Bench:
    """A copy of program and tests in which one mutant at a time is awake."""

    def __init__(self, place: int) -> None:
        self.tree = WORK / f"tree{place}"
        shutil.rmtree(self.tree, ignore_errors=True)
        self.tree.mkdir(parents=True)
        ignored = shutil.ignore_patterns("__pycache__", "_build", "logs")
        for name in COPIED:
            if (ROOT / name).is_dir():
                keep_all = name in ("src", "tests")
                shutil.copytree(
                    ROOT / name,
                    self.tree / name,
                    ignore=shutil.ignore_patterns("__pycache__") if keep_all else ignored,
                )
            elif (ROOT / name).exists():
                shutil.copy(ROOT / name, self.tree / name)
        self.stamp = 1_000_000_000

    def put(self, module: str, source: str) -> None:
        """Write a module with a time of its own, so that no compiled file of another mutant is taken for it."""
        path = self.tree / "src" / "rftfit" / module
        path.write_text(source, encoding="utf-8")
        self.stamp += 10
        os.utime(path, (self.stamp, self.stamp))

    def start(self, tests: list[str], nominal_s: float) -> int:
        """Run tests to the first failure in a child process; give its number."""
        child = os.fork()
        if child == 0:
            code = 70
            try:
                code = run_tests(self.tree, tests, nominal_s)
            finally:
                os._exit(code)
        return child


def scratch_of(tree: Path) -> Path:
    """Folder for what tests write: in memory where the system has such a place, since a disk may delete slowly."""
    memory = Path("/dev/shm")
    is_usable = memory.is_dir() and os.access(memory, os.W_OK)
    name = hashlib.sha256(str(tree).encode()).hexdigest()[:12]
    return memory / f"rftfit-mutants-{name}" if is_usable else tree / "scratch"


def run_tests(tree: Path, tests: list[str], nominal_s: float) -> int:
    """In the child: run tests of a copy; leave the name of the first that fails in a file."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, 20 + 8 * nominal_s)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(int(90 + 16 * nominal_s))
    os.chdir(tree)
    scratch = scratch_of(tree)
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    paths = [str(tree / "src"), str(tree / "studies")]
    sys.path[:0] = paths
    os.environ["PYTHONPATH"] = os.pathsep.join(paths)
    os.environ["NUMBA_CACHE_DIR"] = str(tree / "numba")
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(scratch / "hypothesis")
    os.environ["TMPDIR"] = str(scratch)
    log = os.open(tree / "log.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)
    import pytest

    failed = tree / "failed.txt"
    failed.unlink(missing_ok=True)

    class FirstFailure:
        """Writes the name of a test that fails."""

        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            if report.failed:
                failed.write_text(report.nodeid, encoding="utf-8")

    options = [
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:xdist",
        "--no-showlocals",
        "--tb=short",
        "--basetemp",
        str(scratch / "pytest"),
        "-W",
        "ignore::pytest.PytestAssertRewriteWarning",
    ]
    return int(pytest.main([*options, *tests], plugins=[FirstFailure()]))


def verdict_of(status: int) -> str:
    """What the end of a child process says of its mutant."""
    if os.WIFSIGNALED(status):
        timers = (signal.SIGPROF, signal.SIGALRM)
        return "timeout" if os.WTERMSIG(status) in timers else "crash"
    # 1: a test failed; 2, 3, 4: tests could not even be collected
    return {0: "survived"}.get(os.WEXITSTATUS(status), "killed")


@dataclass
class Trial:
    """A mutant on a bench, with the rounds of tests that are left."""

    mutant: Mutant
    source: str
    rounds: list[tuple[list[str], float]]
    is_check: bool = False
    """Whether the test that noticed the mutant runs without it, to see that it passes then."""
    round_tests: list[str] = field(default_factory=list)
    child: int = 0


class Judge:
    """Judges mutants, one on each core."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.benches = [Bench(place) for place in range(os.cpu_count() or 1)]
        self.trusted: set[str] = set()
        self.excluded: set[str] = set()
        """Tests that fail in the copy without any mutant, so they cannot judge."""

    def rounds_of(self, mutant: Mutant, source: str) -> list[tuple[list[str], float]]:
        """Tests in rounds, with the time they need: the quickest alone first."""
        spans = statement_spans(ast.parse(source))
        first, last = spans.get(mutant.line, (mutant.line, mutant.line))
        last = max(last, mutant.line + mutant.removed.count("\n") - 1)
        lines = self.recording.lines(mutant.module)
        tests: set[str] = set()
        for line in range(first, last + 1):
            tests |= lines.get(line, set())
        ordered = self.recording.order(tests - self.excluded)
        if mutant.noticed_by in tests:
            ordered.sort(key=lambda row: row[0] != mutant.noticed_by)
        quick = [test for test, until_s in ordered if until_s <= FIRST_ROUND_S][:60]
        if mutant.noticed_by in tests:
            quick = [mutant.noticed_by]
        quick = quick or [test for test, _ in ordered[:1]]
        later = [t for t, until_s in ordered if t not in quick and until_s <= ALL_ROUNDS_S]
        rounds = [(quick, FIRST_ROUND_S), (later, ALL_ROUNDS_S)]
        return [(tests_of_round, seconds) for tests_of_round, seconds in rounds if tests_of_round]

    def judge(self, mutants: list[Mutant]) -> Any:
        """Yield mutants with their verdicts as these come."""
        waiting = list(reversed(mutants))
        running: dict[int, tuple[Trial, Bench]] = {}
        free = list(self.benches)
        while waiting or running:
            while waiting and free:
                mutant = waiting.pop()
                source = (
                    (PACKAGE / mutant.module).read_text(encoding="utf-8")
                    if (PACKAGE / mutant.module).exists()
                    else ""
                )
                placed = mutated_source(source, mutant)
                if placed is None:
                    mutant.verdict = "gone"
                    yield mutant
                    continue
                changed, mutant.line = placed
                trial = Trial(mutant, source, self.rounds_of(mutant, source))
                if not trial.rounds:
                    mutant.verdict = "uncovered"
                    yield mutant
                    continue
                mutant.tests, mutant.seconds = 0, 0.0
                bench = free.pop()
                bench.put(mutant.module, changed)
                self._next_round(trial, bench)
                running[trial.child] = trial, bench
            if not running:
                continue
            child, status, used = os.wait4(-1, 0)
            if child not in running:
                continue
            kill_group(child)
            trial, bench = running.pop(child)
            trial.mutant.seconds = round(trial.mutant.seconds + used.ru_utime + used.ru_stime, 1)
            if self._goes_on(trial, bench, verdict_of(status)):
                running[trial.child] = trial, bench
                continue
            bench.put(trial.mutant.module, trial.source)
            free.append(bench)
            yield trial.mutant
        for bench in self.benches:
            shutil.rmtree(scratch_of(bench.tree), ignore_errors=True)

    def _next_round(self, trial: Trial, bench: Bench) -> None:
        tests, seconds = trial.rounds.pop(0)
        trial.round_tests = tests
        trial.mutant.tests += len(tests)
        trial.child = bench.start(tests, seconds)

    def _goes_on(self, trial: Trial, bench: Bench, verdict: str) -> bool:
        """Write the verdict of a round down; whether another round was started."""
        mutant = trial.mutant
        failed = bench.tree / "failed.txt"
        if trial.is_check:
            if verdict == "survived":
                self.trusted.add(mutant.noticed_by)
                return False
            self.excluded.add(mutant.noticed_by)
            print(f"cannot judge: {mutant.noticed_by} fails in the copy as it is", flush=True)
            mutant.noticed_by, trial.is_check = "", False
            trial.rounds = self.rounds_of(mutant, trial.source)
            if not trial.rounds:
                mutant.verdict = "uncovered"
                return False
            placed = mutated_source(trial.source, mutant)
            bench.put(mutant.module, placed[0] if placed else trial.source)
            self._next_round(trial, bench)
            return True
        mutant.verdict = verdict
        if verdict == "survived":
            mutant.noticed_by = ""
            if trial.rounds:
                self._next_round(trial, bench)
                return True
            return False
        mutant.noticed_by = failed.read_text(encoding="utf-8") if failed.exists() else ""
        if mutant.noticed_by and mutant.noticed_by not in self.trusted:
            trial.is_check = True
            bench.put(mutant.module, trial.source)
            trial.child = bench.start([mutant.noticed_by], ALL_ROUNDS_S)
            return True
        return False


def kill_group(child: int) -> None:
    """End what a child has left running."""
    try:
        os.killpg(child, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return


# --- command line ---------------------------------------------------------------------------------------------


def table(mutants: list[Mutant]) -> str:
    """Verdicts by room, then the survivors."""
    lines = ["| room | judged | noticed | survived | gone or not run |", "|---|---|---|---|---|"]
    for room in [*sorted({mutant.room for mutant in mutants}), "all"]:
        of_room = [mutant for mutant in mutants if room in (mutant.room, "all")]
        died = sum(mutant.died for mutant in of_room)
        alive = sum(mutant.verdict == "survived" for mutant in of_room)
        lines.append(
            f"| {room} | {died + alive} | {died} | {alive} | {len(of_room) - died - alive} |"
        )
    for mutant in mutants:
        if mutant.verdict == "survived":
            lines.append(
                f"{mutant.number}: {mutant.module}:{mutant.line} {mutant.function} ({mutant.tests} tests)"
            )
    return "\n".join(lines)


def difference(mutant: Mutant) -> str:
    """What a mutant changes, as a diff."""
    place = f"{mutant.module}:{mutant.line}"
    return "".join(
        difflib.unified_diff(
            mutant.removed.splitlines(keepends=True),
            mutant.added.splitlines(keepends=True),
            place,
            mutant.function,
            n=0,
        )
    )


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description="Mutants of the program, judged by its tests.")
    parser.add_argument("--draw", action="store_true", help="draw the mutants anew")
    parser.add_argument("--number", type=int, default=NUMBER_DRAWN, help="how many to draw")
    parser.add_argument("--seed", type=int, default=SEED, help="of the draw")
    parser.add_argument("--only", default="", help="modules whose path begins with this")
    parser.add_argument(
        "--noticed", action="store_true", help="only those that a test noticed before"
    )
    parser.add_argument(
        "--older-lines",
        action="store_true",
        help="use a recording of older sources: quicker, nearly as good",
    )
    parser.add_argument("--keep", action="store_true", help=f"keep the verdicts in {KEPT_CSV.name}")
    parser.add_argument(
        "--anew", action="store_true", help="forget what an earlier, stopped run has judged"
    )
    parser.add_argument("--show", type=int, metavar="NUMBER", help="print what a mutant changes")
    parser.add_argument("--table", action="store_true", help="print the kept verdicts")
    return parser.parse_args()


def show(mutant: Mutant, recording: Recording) -> str:
    """What a mutant changes, its verdict, and the tests that can notice it."""
    tests = recording.lines(mutant.module).get(mutant.line, set())
    names = [f"  {until_s:7.1f} s  {test}" for test, until_s in recording.order(tests)[:20]]
    verdict = f"{mutant.verdict} {mutant.noticed_by}"
    return "\n".join([difference(mutant), verdict, f"{len(tests)} tests run the line:", *names])


def main() -> int:
    """Judge the mutants that are asked for; 1 where one that was noticed is noticed no more."""
    options = parse()
    WORK.mkdir(exist_ok=True)
    kept_mutants = read_mutants(KEPT_CSV)
    if options.table:
        print(table(kept_mutants))
        return 0
    sys.path.insert(0, str(WORK / "tool"))
    shared = WORK / "shared"
    if not shared.exists() and (ROOT.parent / "shared").exists():
        shared.symlink_to(ROOT.parent / "shared")
    recording = record_lines(is_older_enough=options.older_lines)
    if options.draw:
        kept_mutants = draw(recording, options.number, options.seed)
        write_mutants(kept_mutants, KEPT_CSV)
        JUDGED.unlink(missing_ok=True)
    if options.show:
        print(show(kept_mutants[options.show - 1], recording))
        return 0
    stamp = WORK / "judged-of-sources"
    digest = digest_of_sources()
    is_of_these_sources = stamp.exists() and stamp.read_text(encoding="utf-8") == digest
    if options.anew or not is_of_these_sources:
        JUDGED.unlink(missing_ok=True)
    stamp.write_text(digest, encoding="utf-8")
    done = {mutant.number: mutant for mutant in read_mutants(JUDGED)}
    requested_mutants = [
        mutant
        for mutant in read_mutants(KEPT_CSV)
        if mutant.module.startswith(options.only) and (mutant.died or not options.noticed)
    ]
    judge_all(
        [mutant for mutant in requested_mutants if mutant.number not in done], recording, done
    )
    judged = [done[mutant.number] for mutant in requested_mutants]
    print(table(judged))
    before = {mutant.number: mutant for mutant in kept_mutants}
    revived = [m for m in judged if before[m.number].died and m.verdict == "survived"]
    for mutant in revived:
        print(f"noticed no more: {mutant.number}\n{difference(mutant)}")
    if options.keep:
        write_mutants([done.get(mutant.number, mutant) for mutant in kept_mutants], KEPT_CSV)
    return 1 if revived and not options.keep else 0


def judge_all(mutants: list[Mutant], recording: Recording, done: dict[int, Mutant]) -> None:
    """Judge mutants and write each down as soon as it is judged."""
    if not mutants:
        return
    os.environ |= dict.fromkeys(THREADS, "1")
    for module in PRELOADED:
        importlib.import_module(module)
    begin = time.monotonic()
    for count, mutant in enumerate(Judge(recording).judge(mutants), 1):
        done[mutant.number] = mutant
        write_mutants(list(done.values()), JUDGED)
        minutes = (time.monotonic() - begin) / 60
        place = f"{mutant.module}:{mutant.line}"
        print(
            f"{count:4} of {len(mutants)} {minutes:6.1f} min {mutant.verdict:9} {place}", flush=True
        )


if __name__ == "__main__":
    sys.exit(main())
