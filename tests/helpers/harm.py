"""What may befall a run: it is killed, its disk is full or read-only, links lie where it writes."""

import base64
import contextlib
import functools
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import psutil
from campaigns import planned_jobs

from rftfit.store.files import is_temporary

# --- Runs of `rftfit run` that are killed, and what they leave ----------------------------------------------------

STAGE, SNAKEMAKE, RUN, ALL = "a stage", "Snakemake", "`rftfit run`", "all of them"
KINDS = (STAGE, SNAKEMAKE, RUN, ALL)
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

    `server`: That from which jobs are forked, and its like. `stages`: Jobs, by their command's word or as forks.
    """

    run: psutil.Process
    snakemake: psutil.Process | None
    server: list[psutil.Process]
    stages: dict[psutil.Process, str]

    def chosen(self, kind, pick):
        """Processes to kill; `pick`, from 0 to 1, says which stage of several. Empty: none yet."""
        if kind == RUN:
            return [self.run]
        if self.snakemake is None:
            return []
        if kind == SNAKEMAKE:
            return [self.snakemake]
        stages = sorted(self.stages, key=lambda process: process.pid)
        if kind == STAGE:
            return stages[int(pick * len(stages)) :][:1]
        return [self.run, self.snakemake, *self.server, *stages]


def start(folder, output, *words):
    """Start `rftfit run` in a session of its own, so that nothing but the test ends it."""
    with output.open("wb") as handle:
        return subprocess.Popen(
            [sys.executable, "-m", "rftfit", "run", *words],
            cwd=folder.root,
            stdin=subprocess.DEVNULL,
            stdout=handle,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


def run(folder, output, *words):
    return start(folder, output, *words).wait(_LONGEST_S)


def living(child):
    """Look at the processes of a run."""
    top = psutil.Process(child.pid)
    snakemake, server, stages = None, list[psutil.Process](), {}
    for process in top.children(recursive=True):
        try:
            words = process.cmdline()
        except psutil.Error:
            continue
        if words[1:4] == ["-P", "-m", "snakemake"]:
            snakemake = process
        elif words[1:4] == ["-P", "-m", "rftfit.workflow.job"]:
            stages[process] = words[4].split("/")[2]
        elif any("multiprocessing" in word for word in words):
            if process.ppid() in [server_process.pid for server_process in server]:
                stages[process] = "a fork"
            else:
                server.append(process)
    return Living(top, snakemake, server, stages)


def kill(child, kind, pick):
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
            stage_names = [now.stages[v] for v in victims if v in now.stages] or now.stages.values()
            return True, sorted(stage_names)
        time.sleep(0.01)
    return False, []


def working(root):
    """Processes whose current folder is the campaign's."""
    processes = []
    for process in psutil.process_iter(["cwd", "status"]):
        dead = process.info["status"] == psutil.STATUS_ZOMBIE
        if process.info["cwd"] == str(root) and not dead:
            processes.append(process)
    return processes


def seconds_until_quiet(root, limit_s):
    """How long it takes until no process works in the campaign's folder; infinite beyond the limit."""
    began = time.monotonic()
    while (passed := time.monotonic() - began) < limit_s:
        if not working(root):
            return passed
        time.sleep(0.05)
    return float("inf")


def fresh(folder):
    for name in ("results", ".snakemake"):
        shutil.rmtree(folder.root / name, ignore_errors=True)


def state(folder):
    """Inode, size and time of every file in results/: equal means that nobody wrote."""
    stats = {path.as_posix(): path.lstat() for path in (folder.root / "results").rglob("*")}
    return {name: (stat.st_ino, stat.st_size, stat.st_mtime_ns) for name, stat in stats.items()}


def compare_results(folder, whole):
    """Compare what is there with the undisturbed run."""
    complete, partial, rests = 0, [], 0
    for name, digest in folder.digests().items():
        if is_temporary(name.rpartition("/")[2]):
            rests += 1
        elif whole.get(name) == digest:
            complete += 1
        else:
            partial.append(name)
    return Left(complete, partial, rests)


# --- Small and read-only disks, in a mount namespace of the test's own, where the system lets one have it ---------

_OWN = ("unshare", "--user", "--map-root-user", "--mount")
BLOCK = 4096


@functools.cache
def why_not():
    """Why no disk can be made here; empty where it can."""
    if not sys.platform.startswith("linux") or shutil.which("unshare") is None:
        return "disks of a test's own need Linux and unshare"
    trial = [*_OWN, "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"]
    completed = subprocess.run(trial, capture_output=True, text=True, check=False)
    return (
        f"this system allows no disk of a test's own: {completed.stderr.strip()}"
        if completed.returncode
        else ""
    )


def on_own_disks(words, **options):
    """Run a program that may mount: what it mounts nobody else sees, and goes with it."""
    return subprocess.run([*_OWN, *words], text=True, check=False, **options)


def mount(folder, size):
    """Mount a disk of so many bytes on a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    subprocess.run(words, check=True)


def change(folder, *options):
    """Give a disk another size, or make it read-only (``ro``) or writable (``rw``)."""
    subprocess.run(["mount", "-o", ",".join(["remount", *options]), folder], check=True)


def unmount(folder):
    subprocess.run(["umount", folder], check=True)


def room(folder):
    """Bytes that the files of a folder take on a disk."""
    sizes = (path.lstat().st_size for path in folder.rglob("*") if path.is_file())
    return sum(-(-size // BLOCK) * BLOCK for size in sizes)


# --- Links under the names that a campaign's commands write, which lead to a raw log or to the config -------------

OF_RUN = (
    "results/logs/snakemake.log",
    ".snakemake/rftfit/holder",
    ".snakemake/iocache/latest.pkl",
    ".snakemake/locks/0.input.lock",
    ".snakemake/locks/0.output.lock",
)
"""Files of a run that belong to no job."""


def places_of(config):
    """Every file that a run of a campaign writes, in the order of its jobs: states, results, records, logs, notes."""
    places = list(OF_RUN)
    for job in planned_jobs(config):
        name = f"{job.rule}/{job.key}" if job.key else job.rule
        results = [path for path in job.writes if not path.endswith(".log")]
        of_job = f"results/records/{name}.json", f"results/logs/{name}.log"
        places += [f"results/state/{name}.json", *results, *of_job]
        notes = (base64.urlsafe_b64encode(path.encode()).decode() for path in results)
        places += [
            f".snakemake/{kind}/{note}" for note in notes for kind in ("metadata", "incomplete")
        ]
    return list(dict.fromkeys(places))


def victims_of(root):
    """Files of the lab that a link may lead to: a raw log, the run sheet and the config."""
    logs = sorted((root / "raw").rglob("*_force.csv"))
    return [logs[0], *sorted((root / "raw").rglob("runs.csv")), root / "config" / "config.yaml"]


def plant(root, place, kind, victim):
    """Put a link to a file of the lab in the place of a file; what is there goes."""
    path = root / place
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    if kind == "symbolic":
        path.symlink_to(os.path.relpath(victim, path.parent))
    else:
        os.link(victim, path)


def lab_files(root):
    """Content and time of all files that the lab made, by path."""
    paths = [path for name in ("raw", "config") for path in (Path(root) / name).rglob("*")]
    return {
        path.relative_to(root).as_posix(): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in paths
        if path.is_file()
    }
