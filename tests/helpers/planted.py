"""Links under the names that a campaign's commands write, which lead to a raw log or to the config."""

import base64
import os
from pathlib import Path

from jobs import planned_jobs

from rftfit.workflow.records import RECORDS
from rftfit.workflow.state import job_name, state_file

KINDS = ("symbolic", "hard")
OF_RUN = (
    "results/logs/snakemake.log",
    ".snakemake/rftfit/holder",
    ".snakemake/rftfit/durations.json",
    ".snakemake/iocache/latest.pkl",
    ".snakemake/locks/0.input.lock",
    ".snakemake/locks/0.output.lock",
)
"""Files of a run that belong to no job."""


def places_of(config):
    """Every file that a run of a campaign writes, in the order of its jobs: states, results, records, logs, notes."""
    places = list(OF_RUN)
    for job in planned_jobs(config):
        name = job_name(job.rule, job.key)
        results = [path for path in job.writes if not path.endswith(".log")]
        places += [state_file(name), *results, f"{RECORDS}/{name}.json", f"results/logs/{name}.log"]
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
