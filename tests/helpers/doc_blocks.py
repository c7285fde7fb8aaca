"""Code blocks of the documentation, and what becomes of each of them.

A block of one of `LANGUAGES` is run, or checked, or says in a comment in front of it why not:

- ``<!-- file: NAME -->``: it is the content of a file, which is there for the blocks below;
- ``<!-- fails: CODE -->``: its last command ends with this exit code;
- ``<!-- from: top -->``: it is run in the folder in which the page began;
- ``<!-- output: above -->``: it is what the block above prints (``make gallery`` writes it anew);
- ``<!-- run by: TEST FILE -->``: another test runs these commands;
- ``<!-- not run: REASON -->``: one of `REASONS`.
"""

import os
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from rftfit.campaign.config import Config
from rftfit.robot.config import Robot

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = ("sh", "bash", "console", "python", "yaml", "toml")
OTHERS = ("text", "powershell")
"""Languages of blocks that show something and are not meant for a reader to run here."""
SITE = "<!-- site"
"""First line of a comment with a directive for the build of the site (``docs/_ext/plain_sources.py``)."""
REASONS = ("needs root", "takes minutes", "network")

_FENCE = re.compile(r"^(`{3,}|~{3,})[ ]*(\{?[\w-]*\}?)(.*)$")
_ANY_FENCE = re.compile(r"^\s*(`{3,}|~{3,})")
_MARK = re.compile(r"^<!-- (file|fails|from|output|run by|not run): (.+?) -->$")


@dataclass(frozen=True)
class Block:
    """One fenced block."""

    page: str
    line: int
    language: str
    text: str
    marks: dict[str, str] = field(default_factory=dict)

    @property
    def place(self):
        return f"{self.page}, line {self.line}"


def pages():
    """Pages of the documentation and the README, from the project's folder."""
    paths = (path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
    return ["README.md", *sorted(name for name in paths if not name.startswith("docs/_"))]


def blocks_of(page, text=None):
    """Blocks of a page, in order; a fence that cannot be understood is an error."""
    lines = (ROOT / page).read_text(encoding="utf-8") if text is None else text
    blocks: list[Block] = []
    marks: dict[str, str] = {}
    opened: tuple[int, str, str] | None = None
    body: list[str] = []
    for number, line in enumerate(lines.splitlines(), start=1):
        if opened is not None:
            if line.strip() == opened[1]:
                blocks.append(Block(page, opened[0], opened[2], "\n".join(body) + "\n", marks))
                opened, marks, body = None, {}, []
            else:
                body.append(line)
        elif fence := _FENCE.match(line):
            opened = (number, fence[1], fence[2])
        elif _ANY_FENCE.match(line):
            raise AssertionError(f"{page}, line {number}: an indented fence escapes the tests")
        elif mark := _MARK.match(line):
            marks[mark[1]] = mark[2]
        elif line.startswith("<!--") and line != SITE:
            raise AssertionError(f"{page}, line {number}: no such mark: {line}")
        elif line.strip() and marks:
            raise AssertionError(f"{page}, line {number}: a mark without a block")
    assert opened is None, f"{page}: a block without end"
    return blocks


def fate(block):
    """What becomes of a block: run, checked, file, run by, not run, shown; empty if it escapes."""
    if block.language.startswith("{") or block.language in OTHERS:
        return "file" if "file" in block.marks else "shown"
    if block.language not in LANGUAGES:
        return ""
    for mark in ("not run", "run by", "file"):
        if mark in block.marks:
            return mark
    return "run" if block.language in ("sh", "bash", "console", "python") else "checked"


def without_progress(text):
    """What a page shows of what a command printed: no lines of progress."""
    return re.sub(r"(?m)^\[ *\d+/\d+\].*\n", "", text).strip()


def comparable(text):
    """A text without what differs from one run or computer to the next: seconds and commits."""
    return re.sub(r"\b\d+\.\d s\b|\b[0-9a-f]{12}\b\+?", "...", without_progress(text))


def commands_in(block):
    """Commands of rftfit that a block calls."""
    return set(re.findall(r"\brftfit(?:\.exe)? +([a-z]+)", block.text))


def check_values(block, base):
    """Let the models judge a block of configuration; `base` has the sections it leaves out."""
    if block.language == "toml":
        assert tomllib.loads(block.text), block.place
        return
    values = yaml.safe_load(block.text)
    if "body" in values:
        Robot.model_validate(values)
        return
    without_robot = {name: section for name, section in base.items() if name != "robot"}
    Config.model_validate(without_robot | values)


class Reader:
    """Somebody who follows a page from top to bottom, in a folder of their own.

    `scripts`: folder of the commands of Python packages. `programs`: PATH of all others.
    """

    def __init__(self, folder, scripts=None, programs=None):
        self.top = self.folder = folder / "work"
        self.folder.mkdir()
        self._state = folder / "here"
        scripts = scripts or Path(sys.executable).parent
        (self.folder / ".venv").mkdir()
        (self.folder / ".venv" / "bin").symlink_to(scripts, target_is_directory=True)
        path = f"{scripts}{os.pathsep}{programs or os.environ['PATH']}"
        self._env = {**os.environ, "PATH": path, "MPLBACKEND": "Agg"}
        self.transcript = self.printed = ""

    def follow(self, block):
        if "file" in block.marks:
            target = self.folder / block.marks["file"]
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
            return
        if "from" in block.marks:
            self.folder = self.top
        if block.language == "python":
            command = [sys.executable, "-c", block.text]
        else:
            text = re.sub(r"^\$ ", "", block.text, flags=re.MULTILINE)
            script = f"trap 'pwd > \"{self._state}\"' EXIT\n{text}"
            command = ["bash", "-euo", "pipefail", "-c", script]
        completed = subprocess.run(
            command,
            cwd=self.folder,
            env=self._env,
            check=False,
            text=True,
            encoding="utf-8",
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self.printed = completed.stdout
        self.transcript += completed.stdout
        expected_code = int(block.marks.get("fails", "0"))
        assert completed.returncode == expected_code, f"{block.place}:\n{completed.stdout}"
        assert "Traceback" not in completed.stdout, f"{block.place}:\n{completed.stdout}"
        if block.language != "python":
            self.folder = Path(self._state.read_text(encoding="utf-8").strip())
