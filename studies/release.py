"""Prepare a release, and check that nothing of it disagrees: ``make release``.

make release ARGS=0.2.0   writes the version and today's date, and dates what is under Unreleased
make release              checks the release, and prints the command of its tag

The newest section of the changelog states version and date; all other files follow it.
"""

from __future__ import annotations

import datetime as dt
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NUMBER = r"\d+\.\d+\.\d+"
DATE = r"\d{4}-\d\d-\d\d"
VERSIONS = {
    "src/rftfit/version.py": rf'^__version__ = "({NUMBER})"$',
    "pyproject.toml": rf'^version = "({NUMBER})"$',
    "CITATION.cff": rf"^version: ({NUMBER})$",
    "codemeta.json": rf'^  "version": "({NUMBER})",$',
    "README.md": rf"(?:^\*Version|, version) ({NUMBER})\b",
}
"""Pattern of the lines that state the version, by file."""
DATES = {
    "CITATION.cff": rf"^date-released: ({DATE})$",
    "codemeta.json": rf'^  "dateModified": "({DATE})",$',
}
"""Pattern of the line that states the date of the release, by file."""
CHANGELOG = "CHANGELOG.md"
UNRELEASED = "## [Unreleased]"
_SECTION = re.compile(rf"^## \[({NUMBER})\] - ({DATE})$", re.MULTILINE)


def disagreements(root: Path) -> list[str]:
    """List the files whose version or date is not that of the newest section of the changelog."""
    section = _SECTION.search((root / CHANGELOG).read_text("utf-8"))
    if section is None:
        return [f"{CHANGELOG}: no section '## [VERSION] - YYYY-MM-DD'"]
    problems = []
    for patterns, expected in ((VERSIONS, section[1]), (DATES, section[2])):
        for name, pattern in patterns.items():
            stated = re.findall(pattern, (root / name).read_text("utf-8"), re.MULTILINE)
            if {*stated} != {expected}:
                problems.append(f"{name}: {stated or 'nothing'}, {CHANGELOG} has {expected}")
    return problems


def unreleased_changes(root: Path) -> list[str]:
    """List the lines under Unreleased, which a release has none of."""
    _, heading, below = (root / CHANGELOG).read_text("utf-8").partition(f"{UNRELEASED}\n")
    if not heading:
        return [f"no heading '{UNRELEASED}'"]
    return [line for line in below.split("\n## ", 1)[0].splitlines() if line.strip()]


def prepare(root: Path, version: str, date: str) -> None:
    """Write version and date into all files that state them; date what is under Unreleased."""
    for patterns, stated in ((VERSIONS, version), (DATES, date)):
        for name, pattern in patterns.items():
            content = (root / name).read_text("utf-8")
            for line in reversed([*re.finditer(pattern, content, re.MULTILINE)]):
                content = f"{content[: line.start(1)]}{stated}{content[line.end(1) :]}"
            (root / name).write_text(content, "utf-8")
    changes = (root / CHANGELOG).read_text("utf-8")
    changes = changes.replace(UNRELEASED, f"{UNRELEASED}\n\n## [{version}] - {date}", 1)
    (root / CHANGELOG).write_text(changes, "utf-8")


def _git(*words: str) -> str:
    command = ["git", "-C", str(ROOT), *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main() -> None:
    """Prepare the version that is named, or check the one that is prepared."""
    if len(sys.argv) > 1:
        version = sys.argv[1]
        if not re.fullmatch(NUMBER, version):
            sys.exit(f"'{version}' is no version like 0.2.0")
        prepare(ROOT, version, dt.datetime.now(dt.UTC).date().isoformat())
        print(f"{version}: shorten its section of {CHANGELOG} to what a user notices")
        return
    problems = disagreements(ROOT)
    problems += [f"{CHANGELOG}, Unreleased: {line}" for line in unreleased_changes(ROOT)]
    problems += [f"not committed: {line}" for line in _git("status", "--porcelain").splitlines()]
    version = re.findall(
        VERSIONS["pyproject.toml"], (ROOT / "pyproject.toml").read_text("utf-8"), re.MULTILINE
    )[0]
    if _git("tag", "--list", f"v{version}").strip():
        problems.append(f"the tag v{version} exists already")
    if problems:
        sys.exit("\n".join(problems))
    print(f'All agree. Next: git tag -a v{version} -m "rftfit {version}"')


if __name__ == "__main__":
    main()
