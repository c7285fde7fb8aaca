"""Environment of child processes, safe from the folder they work in, and cores they may use."""

from __future__ import annotations

import os


def child_environment(**more: str) -> dict[str, str]:
    """Return this process's environment with some values more, safe in a stranger's folder.

    ``python -m`` and ``python -c`` would look for modules in the current folder first, and so does
    every Python for entries of PYTHONPATH that are empty or relative.

    `**more`: Variables by name.
    """
    environment = {**os.environ, **more, "PYTHONSAFEPATH": "1"}
    paths = environment.pop("PYTHONPATH", "").split(os.pathsep)
    absolute = os.pathsep.join(filter(os.path.isabs, paths))
    return environment | ({"PYTHONPATH": absolute} if absolute else {})


def usable_cores() -> int:
    """Cores that this process may use: a node of a cluster has more than a job may."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
