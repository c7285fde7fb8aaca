"""The machine: environment of child processes, usable cores, versions of what computes."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rftfit.errors import InputError
from rftfit.version import __version__

LIBRARIES = ("numpy", "scipy", "pandas", "numba", "pyarrow", "matplotlib", "jinja2", "snakemake")
"""Whose version may change a result, a figure or the page."""

PACKAGE = Path(__file__).resolve().parents[1]


def shipped(name: str) -> Path:
    """Find a file that comes with the program: at the top of a checkout, inside the package where it was installed."""
    for path in (PACKAGE.parents[1] / name, PACKAGE / "_workflow" / name):
        if path.exists():
            return path
    raise InputError(
        f"{name}: not there, neither in a checkout nor in {PACKAGE}; install rftfit again"
    )


def child_environment(**extra_variables: str) -> dict[str, str]:
    """Return this process's environment with some values more, safe in a stranger's folder.

    ``python -m`` and ``python -c`` would look for modules in the current folder first, and so does
    every Python for entries of PYTHONPATH that are empty or relative.
    """
    environment = {**os.environ, **extra_variables, "PYTHONSAFEPATH": "1"}
    paths = environment.pop("PYTHONPATH", "").split(os.pathsep)
    absolute = os.pathsep.join(filter(os.path.isabs, paths))
    return environment | ({"PYTHONPATH": absolute} if absolute else {})


def usable_cores() -> int:
    """Cores that this process may use: a node of a cluster has more than a job may."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def versions() -> dict[str, str]:
    """Versions of the program, of Python and of `LIBRARIES`."""
    versions_by_name = {"rftfit": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions_by_name[name] = version(name)
        except PackageNotFoundError:
            versions_by_name[name] = "not installed"
    return versions_by_name
