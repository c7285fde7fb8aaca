"""Lines and branches of the program that the tests run, room by room: ``make coverage``.

    make coverage                          all tests but the pages of the documentation
    make coverage ARGS="-m 'not page and not slow'"     words for pytest: a part of the tests

Processes that tests start are counted, compiled kernels are not. What is never run is a place without
a test; what is run is not thereby tested: `make mutants` says more.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / ".mutants" / "covered"
CONFIG = """\
[run]
branch = true
parallel = true
source_pkgs = rftfit
data_file = {place}/data
"""
STARTUP = "import coverage\n\ncoverage.process_startup()\n"
"""Begins every Python that a test starts."""
COUNTS = ("num_statements", "covered_lines", "num_branches", "covered_branches")


def percent(count: int, total: int) -> str:
    """Format a share."""
    return f"{100 * count / total:.0f} %" if total else "-"


def table(files: dict[str, dict[str, dict[str, int]]]) -> list[str]:
    """Sum what was run over the modules of each room."""
    rooms: dict[str, Counter[str]] = defaultdict(Counter)
    for name, coverage in files.items():
        folder = Path(name.rpartition("src/")[2]).parent
        rooms[folder.parts[:2][-1]] += Counter({key: coverage["summary"][key] for key in COUNTS})
    rows = [*sorted(rooms.items()), ("all", sum(rooms.values(), Counter()))]
    lines = ["| room | lines | run | branches | taken |", "|---|---|---|---|---|"]
    for room, counts in rows:
        statements, run, branches, taken = (counts[key] for key in COUNTS)
        shares = percent(run, statements), percent(taken, branches)
        lines.append(f"| {room} | {statements} | {shares[0]} | {branches} | {shares[1]} |")
    return lines


def main() -> None:
    """Run the tests, print a table; the exit status is that of the tests."""
    PLACE.mkdir(parents=True, exist_ok=True)
    for old in PLACE.glob("data*"):
        old.unlink()
    config = PLACE / "config"
    config.write_text(CONFIG.format(place=PLACE.as_posix()), encoding="utf-8")
    (PLACE / "sitecustomize.py").write_text(STARTUP, encoding="utf-8")
    search_path = os.pathsep.join(map(str, (PLACE, ROOT / ".mutants" / "coverage")))
    environment = {**os.environ, "PYTHONPATH": search_path, "COVERAGE_PROCESS_START": str(config)}

    def python(*words: str) -> int:
        command = [sys.executable, *words]
        return subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode

    pytest = ["-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", "--no-loadscope-reorder"]
    code = python(*pytest, "-m", "not page", "-p", "no:cacheprovider", *sys.argv[1:])
    report = PLACE / "report.json"
    about = ("--quiet", f"--rcfile={config}")
    if python("-m", "coverage", "combine", *about):
        sys.exit("no process was measured")
    python("-m", "coverage", "json", *about, "-o", str(report))
    print("\n".join(table(json.loads(report.read_text(encoding="utf-8"))["files"])))
    sys.exit(code)


if __name__ == "__main__":
    main()
