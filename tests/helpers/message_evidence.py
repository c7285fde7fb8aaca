"""Which test makes which message: from a recording of the suite to ``docs/reference/messages/tests.json``.

``make messages`` runs the suite under coverage with the running test as context; this script then
looks up who ran the lines in which each message is made. Of several tests it takes the one that
quotes the message, then one of the same room.
"""

from __future__ import annotations

import ast
import importlib
import json
import os
import re
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

ROOT = Path(__file__).parents[2]
EVIDENCE = ROOT / "docs" / "reference" / "messages" / "tests.json"

sys.path.insert(0, str(ROOT / "docs" / "_ext"))
sites: Any = importlib.import_module("message_sites")
table: Any = importlib.import_module("message_table")


def function_source(test: str, root: Path = ROOT) -> str:
    """Source of a test, with its decorators; empty where there is no such test.

    Parameters
    ----------
    test : str
        ``tests/room/test_file.py::test_name``.
    root : Path, optional
    """
    file, _, name = test.partition("::")
    return _functions(root / file).get(name.rpartition("::")[2], "")


@cache
def _functions(path: Path) -> dict[str, str]:
    if not path.is_file():
        return {}
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    found = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
            first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
            found[node.name] = "\n".join(lines[first - 1 : node.end_lineno])
    return found


def quotes(message: str, source: str) -> bool:
    """Whether a test's source holds the message's code, or two neighbouring words of its text."""
    code, _, text = message.partition(": ")
    if re.fullmatch(r"[a-z-]+\.[a-z-]+", code) and code in source:
        return True
    plain = re.sub(r"\\(.)", r"\1", re.sub(r"\"\s*f?\"", "", source))
    parts = re.split(r"<[^<>]*>|[()|\[\]]", text if code.count(" ") == 0 and text else message)
    for part in parts:
        words = part.split()
        pairs = [" ".join(words[at : at + 2]) for at in range(max(len(words) - 1, 0))]
        if any(len(pair) >= 8 and pair in plain for pair in pairs):
            return True
    return False


def evidence(recording: Path, root: Path = ROOT) -> dict[str, str]:
    """Find a test of each message.

    Parameters
    ----------
    recording : Path
        Data file of coverage.
    root : Path, optional
        Of the project that was recorded.

    Returns
    -------
    dict of str to str
        Message to test, without parameters; messages that no test makes are left out.
    """
    from coverage import CoverageData

    data: Any = CoverageData(str(recording))
    data.read()
    measured = {name.rpartition("/src/rftfit/")[2]: name for name in data.measured_files()}
    lines = {file: data.contexts_by_lineno(name) for file, name in measured.items()}
    found = {}
    for message, places in sites.by_message(sites.find_sites(root / "src" / "rftfit")).items():
        tests = {
            (_test_of(context), site.file.partition("/")[0])
            for site in places
            if site.inside
            for line in range(site.first, site.last + 1)
            for context in lines.get(site.file, {}).get(line, ())
        }
        if best := _best(message, {(test, room) for test, room in tests if test}, root):
            found[message] = best
    return dict(sorted(found.items()))


def _test_of(context: str) -> str:
    context = context.removeprefix("|").partition("|")[0]
    test = re.sub(r"( \(\w+\)|\[.*)$", "", context, flags=re.DOTALL)
    return test if test.startswith("tests/") else ""


def _best(message: str, tests: Iterable[tuple[str, str]], root: Path) -> str:
    def rank(one: tuple[str, str]) -> tuple[bool, bool, str]:
        test, room = one
        return not quotes(message, function_source(test, root)), f"/{room}/" not in test, test

    return min(tests, key=rank, default=("", ""))[0]


def record(words: list[str], folder: Path) -> Path:
    """Run tests under coverage, with the running test as context.

    Parameters
    ----------
    words : list of str
        For pytest; default: the suite without the runs of the whole workflow.
    folder : Path
        For the recording.

    Returns
    -------
    Path
        Data file of coverage.
    """
    rooms = sorted(path for path in (ROOT / "tests").glob("*/") if any(path.glob("test_*.py")))
    chosen = words or [str(path) for path in rooms if path.name != "workflow"]
    rc, recording = ROOT / "tests" / "messages.coveragerc", folder / "recording"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *chosen]
    command += ["--cov", f"--cov-config={rc}", "--cov-context=test", "--cov-report="]
    # a test that is too slow under coverage still says what it says
    environment = {**os.environ, "RFTFIT_RECORDING": str(recording), "COVERAGE_CORE": "ctrace"}
    subprocess.run(command, cwd=ROOT, env=environment, check=False)
    return recording


def main() -> None:
    """Record, write the evidence and say what is missing; earlier evidence that still holds is kept."""
    with tempfile.TemporaryDirectory() as folder:
        found = evidence(record(sys.argv[1:], Path(folder)))
    made = sites.by_message(sites.find_sites(ROOT / "src" / "rftfit"))
    before = json.loads(EVIDENCE.read_text(encoding="utf-8")) if EVIDENCE.is_file() else {}
    for message, test in before.items():
        if message in made and function_source(test):
            room = made[message][0].file.partition("/")[0]
            tests = {test, found.get(message, test)}
            found[message] = _best(message, {(one, room) for one in tests}, ROOT)
    rows = table.load_rows(EVIDENCE.parent)
    shown = {row.message for row in rows if not row.never and not row.picked}
    found = {message: test for message, test in sorted(found.items()) if message in shown}
    text = json.dumps(found, indent=0, ensure_ascii=False)
    EVIDENCE.write_text(text + "\n", encoding="utf-8")
    lacking = sorted(shown - found.keys())
    quoted = sum(quotes(message, function_source(test)) for message, test in found.items())
    sys.stdout.write(
        f"{len(found)} messages with a recorded test, {quoted} of them quoted in it; "
        f"{len(lacking)} without a test\n"
    )
    sys.stdout.write("".join(f"  {message}\n" for message in lacking))


if __name__ == "__main__":
    main()
