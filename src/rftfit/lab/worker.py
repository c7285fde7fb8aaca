"""Writes the logs of a list of runs; also a program of its own, so that several work at once."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rftfit.errors import OutputError, RftfitError
from rftfit.lab.faults import damage_recording, damage_text
from rftfit.lab.rig import record
from rftfit.lab.write import force_text, log_texts
from rftfit.store import write_bytes

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.config import Config
    from rftfit.lab.plan import Run


@dataclass(frozen=True)
class Job:
    """Runs to write.

    Attributes
    ----------
    config : Config
    raw : Path
        Folder of the logs.
    seed : int
        Of the random numbers; those of a run depend on it and on the run_id alone.
    runs : tuple of (Run, tuple of str)
        Each run with the names of its faults.
    spread : float
        Standard deviation of alpha from one prepared bed to the next, N/cm^3.
    """

    config: Config
    raw: Path
    seed: int
    runs: tuple[tuple[Run, tuple[str, ...]], ...]
    spread: float = 0.0


def run_logs(
    run: Run, config: Config, seed: int, faults: tuple[str, ...] = (), spread: float = 0.0
) -> dict[str, bytes | None]:
    """Make the two logs of a run.

    Parameters
    ----------
    run : Run
    config : Config
    seed : int
    faults : tuple of str
    spread : float
        Standard deviation of alpha from one prepared bed to the next, N/cm^3.

    Returns
    -------
    dict of str to bytes
        Path relative to raw, and content; None where a fault takes the file away.
    """
    recording = record(run, config, seed, raised="never_touches" in faults, spread=spread)
    if faults:
        recording = damage_recording(faults, recording, config)
    force, motion = log_texts(run, recording, config)
    if "wrong_unit" in faults:
        unit = "N" if config.transducer.force_unit == "lbf" else "lbf"
        force = force_text(run, recording, unit)
    damaged = damage_text(faults, force) if faults else force
    return {
        run.force_log: None if damaged is None else damaged.encode(),
        run.motion_log: None if "missing_tare" in faults else motion.encode(),
    }


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be removed: {error.strerror or error}; allow writing there or close it in "
            "other programs"
        ) from error


def write_runs(job: Job) -> tuple[int, int]:
    """Write the logs of a job.

    Parameters
    ----------
    job : Job

    Returns
    -------
    n_files, n_bytes : int

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    files = size = 0
    for run, faults in job.runs:
        for name, content in run_logs(run, job.config, job.seed, faults, job.spread).items():
            if content is None:
                _remove(job.raw / name)
                continue
            write_bytes(job.raw / name, content)
            files += 1
            size += len(content)
    return files, size


def _elsewhere(job: Job) -> tuple[int, int]:
    """Do a job in a Python of its own.

    A plain child process, not multiprocessing: that one imports the caller's script again, which
    then needs a ``__main__`` guard, or forks a process that may have threads.
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    done = subprocess.run(
        [sys.executable, "-m", "rftfit.lab.worker"],
        input=pickle.dumps(job),
        capture_output=True,
        env=environment,
        check=False,
    )
    if done.returncode:
        told = done.stderr.decode(errors="replace").strip().splitlines()
        raise RftfitError(f"writing the logs stopped: {told[-1] if told else done.returncode}")
    result = pickle.loads(done.stdout)
    if isinstance(result, RftfitError):
        raise result
    files, size = result
    return int(files), int(size)


def write_all(job: Job, workers: int) -> tuple[int, int]:
    """Write the logs of a job with several workers at once; the bytes do not depend on how many.

    Parameters
    ----------
    job : Job
    workers : int
        1 stays in this process.

    Returns
    -------
    n_files, n_bytes : int

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    workers = max(1, min(workers, len(job.runs) // 20))
    if workers == 1 or not sys.executable:
        return write_runs(job)
    shares = [replace(job, runs=job.runs[number::workers]) for number in range(workers)]
    with ThreadPoolExecutor(workers) as pool:
        counts = list(pool.map(_elsewhere, shares))
    return sum(files for files, _ in counts), sum(size for _, size in counts)


def main() -> None:
    """Read a pickled job from standard input, do it, write the pickled counts (or the error)."""
    job = pickle.load(sys.stdin.buffer)
    result: tuple[int, int] | RftfitError
    try:
        result = write_runs(job)
    except RftfitError as error:
        result = error
    sys.stdout.buffer.write(pickle.dumps(result))


if __name__ == "__main__":
    main()
