"""Runs of `rftfit run` that are killed, and what they leave."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import psutil  # type: ignore[import-untyped]

from rftfit.store.files import is_rest
from rftfit.workflow.warm import WARM

if TYPE_CHECKING:
    from pathlib import Path

    from campaigns import Folder

STAGE, SNAKEMAKE, RUN, ALL = "a stage", "Snakemake", "`rftfit run`", "all of them"
KINDS = (STAGE, SNAKEMAKE, RUN, ALL)
STORE = "robot/parts/"
"""Where a sweep keeps finished runs as they come: its tables grow row by row."""
FORK = "a fork"
"""A stage that is forked from the warm process: its command does not name it."""

RECORDS = "records/"
"""What each stage has made: it grows task by task."""

_LONGEST_S = 1200.0


@dataclass(frozen=True)
class Left:
    """What a kill left in results/.

    Attributes
    ----------
    complete : int
        Files with the bytes of the undisturbed run.
    partial : list of str
        Files with other bytes: there must be none.
    rests : int
        Unfinished files that the program itself recognises as such.
    """

    complete: int
    partial: list[str]
    rests: int


@dataclass(frozen=True)
class Living:
    """The processes of a run at one moment.

    `warm`: That from which stages are forked. `stages`: Commands of stages and their forks, by stage.
    """

    run: psutil.Process
    snakemake: psutil.Process | None
    warm: list[psutil.Process]
    stages: dict[psutil.Process, str]

    def chosen(self, kind: str, pick: float) -> list[psutil.Process]:
        """Processes to kill; `pick`, from 0 to 1, says which stage of several. Empty: none yet."""
        if kind == RUN:
            return [self.run]
        if self.snakemake is None:
            return []
        if kind == SNAKEMAKE:
            return [self.snakemake]
        stages = sorted(self.stages, key=lambda one: one.pid)
        if kind == STAGE:
            return stages[int(pick * len(stages)) :][:1]
        return [self.run, self.snakemake, *self.warm, *stages]


def start(folder: Folder, output: Path, *words: str) -> subprocess.Popen[bytes]:
    """Start `rftfit run` in a session of its own, so that nothing but the test ends it."""
    with output.open("wb") as handle:
        return subprocess.Popen(
            [sys.executable, "-m", "rftfit.cli.main", "run", *words], cwd=folder.root,
            stdin=subprocess.DEVNULL, stdout=handle, stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip


def run(folder: Folder, output: Path, *words: str) -> int:
    return start(folder, output, *words).wait(_LONGEST_S)


def living(child: subprocess.Popen[Any]) -> Living:
    """Look at the processes of a run."""
    top = psutil.Process(child.pid)
    snakemake, warm, stages = None, [], {}
    for process in top.children(recursive=True):
        try:
            words = process.cmdline()
        except psutil.Error:
            continue
        if words[1:4] == ["-P", "-m", "snakemake"]:
            snakemake = process
        elif words[1:5] == ["-P", "-m", "rftfit", WARM]:
            if process.ppid() == child.pid:
                warm.append(process)
            elif process.ppid() in [one.pid for one in warm]:  # not what a stage itself forks
                stages[process] = FORK
        elif words[1:4] == ["-P", "-m", "rftfit"]:
            stages[process] = words[4]
    return Living(top, snakemake, warm, stages)


def kill(child: subprocess.Popen[bytes], kind: str, pick: float) -> tuple[bool, list[str]]:
    """Kill what is asked for, waiting for it to be there; also the stages that ran then."""
    while child.poll() is None:
        try:
            now = living(child)
        except psutil.NoSuchProcess:
            break
        victims = now.chosen(kind, pick)
        for victim in victims:
            # nobody is to see the others go, and to clear up
            with contextlib.suppress(psutil.Error):
                victim.suspend()
        for victim in victims:
            try:
                os.kill(victim.pid, signal.SIGKILL)
            except ProcessLookupError:
                victims = []
        if victims:
            named = [now.stages[v] for v in victims if v in now.stages] or now.stages.values()
            return True, sorted(named)
        time.sleep(0.01)
    return False, []


def working(root: Path) -> list[psutil.Process]:
    """Processes whose current folder is the campaign's."""
    found = []
    for process in psutil.process_iter(["cwd", "status"]):
        dead = process.info["status"] == psutil.STATUS_ZOMBIE
        if process.info["cwd"] == str(root) and not dead:
            found.append(process)
    return found


def seconds_until_quiet(root: Path, limit_s: float) -> float:
    """How long it takes until no process works in the campaign's folder; infinite beyond the limit."""
    began = time.monotonic()
    while (passed := time.monotonic() - began) < limit_s:
        if not working(root):
            return passed
        time.sleep(0.05)
    return float("inf")


def fresh(folder: Folder) -> None:
    for name in ("results", ".snakemake"):
        shutil.rmtree(folder.root / name, ignore_errors=True)


def state(folder: Folder) -> dict[str, tuple[int, int, int]]:
    """Inode, size and time of every file in results/: equal means that nobody wrote."""
    found = {path.as_posix(): path.lstat() for path in (folder.root / "results").rglob("*")}
    return {name: (one.st_ino, one.st_size, one.st_mtime_ns) for name, one in found.items()}


def look(folder: Folder, whole: dict[str, str], kept: Path) -> Left:
    """Compare what is there with the undisturbed run, whose results are kept in a folder."""
    complete, partial, rests = 0, [], 0
    for name, digest in folder.digests().items():
        if is_rest(name.rpartition("/")[2]):
            rests += 1
        elif whole.get(name) == digest or _grows(name, folder.root / "results", kept):
            complete += 1
        else:
            partial.append(name)
    return Left(complete, partial, rests)


def _grows(name: str, there: Path, kept: Path) -> bool:
    """Whether a file is one of those that grow, and every part of it is one of the whole file."""
    if not (kept / name).is_file():
        return False
    text, whole = ((place / name).read_text(encoding="utf-8") for place in (there, kept))
    if name.startswith(RECORDS):
        tasks, all_tasks = json.loads(text), json.loads(whole)
        return all(all_tasks.get(key) == task for key, task in tasks.items())
    return (
        name.startswith(STORE)
        and text.endswith("\n")
        and set(text.splitlines()) <= set(whole.splitlines())
    )
