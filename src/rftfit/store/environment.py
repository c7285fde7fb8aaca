"""Facts of the machine: files of the program, environment of child processes, usable cores, versions of libraries."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rftfit.errors import InputError
from rftfit.version import __version__

LIBRARIES = ("numpy", "scipy", "pandas", "numba", "pyarrow", "matplotlib", "jinja2", "snakemake")
"""Libraries whose version may change a result, a figure or the page."""

PACKAGE = Path(__file__).resolve().parents[1]
"""Folder of the package rftfit."""


def shipped(name: str) -> Path:
    """Return the path of a file that comes with the program, such as the workflow.

    In a checkout it lies at the top, in an installed program inside the package.
    """
    for path in (PACKAGE.parents[1] / name, PACKAGE / "_workflow" / name):
        if path.exists():
            return path
    raise InputError(
        f"{name}: not there, neither in a checkout nor in {PACKAGE}; install rftfit again"
    )


def user_cache() -> Path:
    """Return the folder of the user's cache for this program."""
    import pooch  # slow to import, and seldom needed

    return Path(pooch.os_cache("rftfit"))


def child_environment(**extra_variables: str) -> dict[str, str]:
    """Return the environment of this process with `extra_variables`, safe in a folder that a stranger has filled.

    Without PYTHONSAFEPATH, ``python -m`` and ``python -c`` would import modules of the current folder first; so would
    any Python for empty or relative entries of PYTHONPATH, which are therefore removed.
    """
    environment = {**os.environ, **extra_variables, "PYTHONSAFEPATH": "1"}
    paths = environment.pop("PYTHONPATH", "").split(os.pathsep)
    absolute = os.pathsep.join(filter(os.path.isabs, paths))
    return environment | ({"PYTHONPATH": absolute} if absolute else {})


def usable_cores() -> int:
    """Return the number of cores that this process may use: a job may use only some cores of a node of a cluster."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def versions() -> dict[str, str]:
    """Return the versions of the program, of Python and of `LIBRARIES`, by name."""
    versions_by_name = {"rftfit": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions_by_name[name] = version(name)
        except PackageNotFoundError:
            versions_by_name[name] = "not installed"
    return versions_by_name
