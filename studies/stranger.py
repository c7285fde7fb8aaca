"""The tests that read third-party files pass, or are skipped, in a clone that has none beside it.

    make stranger                        the tests that look for ../shared/data
    make stranger ARGS=--all             all tests, as `make test` runs them

The committed files are cloned into an empty folder, and the tests run there with this environment.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def main() -> int:
    """Run the tests in the clone; return pytest's exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--all", action="store_true", help="all tests")
    parser.add_argument("words", nargs="*", help="further words for pytest")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="a stranger's ") as folder:
        clone = Path(folder) / "rftfit"
        subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
        test_files = [] if arguments.all else files_with_shared_data(clone / "tests")
        pytest_options = ["-n", "2", "--dist", "loadfile", "-m", "not page and not slow"]
        process = subprocess.run(
            [sys.executable, "-m", "pytest", *pytest_options, *arguments.words, *test_files],
            cwd=clone,
            env={**os.environ, "PYTHONPATH": str(clone / "src")},
            check=False,
        )
        return process.returncode


def files_with_shared_data(tests: Path) -> list[Path]:
    """Return the test files that import `third_party`, or a helper that does."""
    sources = {path: path.read_text(encoding="utf-8") for path in sorted(tests.rglob("*.py"))}
    helpers = {"third_party"}
    while True:
        pattern = re.compile(rf"^\s*(from|import) ({'|'.join(helpers)})\b", re.MULTILINE)
        importers = [path for path, source in sources.items() if pattern.search(source)]
        new_helpers = {path.stem for path in importers if path.parent.name == "helpers"} - helpers
        if not new_helpers:
            return [path for path in importers if path.parent.name != "helpers"]
        helpers |= new_helpers


if __name__ == "__main__":
    sys.exit(main())
