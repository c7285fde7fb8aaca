"""``--cluster``: the same workflow with its jobs on other machines, told by a Snakemake profile."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

FILE = "config.yaml"
NOT_CLUSTERS = ("default",)
"""Profiles beside the Snakefile that run on this machine."""

_SUBMITS = {"slurm": "sbatch"}
"""Executor to the program that it hands jobs over with."""


def cluster_words(name: str, snakefile: Path, cores: int | None) -> list[str]:
    """Words for Snakemake that put the jobs on a cluster.

    Parameters
    ----------
    name : str
        Of a profile beside the Snakefile, or the path of a folder that holds one.
    snakefile : Path
    cores : int or None
        Of the largest job; default: what the profile says.

    Returns
    -------
    list of str

    Raises
    ------
    InputError
        If there is no such profile, it cannot be read, or what it needs is not installed here.
    """
    folder = find_profile(name, snakefile)
    executor = str(_read(folder / FILE).get("executor", "local"))
    _check_installed(executor, folder)
    return ["--workflow-profile", str(folder), *(["--cores", str(cores)] if cores else [])]


def find_profile(name: str, snakefile: Path) -> Path:
    """Find the folder of a profile.

    Parameters
    ----------
    name : str
        As for `cluster_words`.
    snakefile : Path

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If there is none.
    """
    own = snakefile.resolve().parent / "profiles"
    known = sorted(
        p.parent.name for p in own.glob(f"*/{FILE}") if p.parent.name not in NOT_CLUSTERS
    )
    if name in known:
        return own / name
    folder = Path(name).resolve()
    if (folder / FILE).is_file():
        return folder
    raise InputError(
        f"--cluster: found {name!r}; allowed: {', '.join(known)}, or a folder with a profile of "
        f"your own ({FILE})"
    )


def _read(path: Path) -> Mapping[str, Any]:
    import yaml

    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(values, dict):
        raise InputError(f"{path}: it must hold keys and values, as `executor: slurm`")
    return values


def _check_installed(executor: str, folder: Path) -> None:
    """Say what is missing before Snakemake does, in more words."""
    if executor in ("local", "dryrun", "touch"):
        return
    plugin = f"snakemake-executor-plugin-{executor}"
    if find_spec(plugin.replace("-", "_")) is None:
        raise InputError(
            f"the profile {folder.name} needs the package {plugin}, which is not installed; "
            f"install it with `python -m pip install {plugin}`"
            + (" (or `rftfit[cluster]`)" if executor in _SUBMITS else "")
        )
    program = _SUBMITS.get(executor)
    if program is not None and shutil.which(program) is None:
        raise InputError(
            f"there is no program {program} here, which hands jobs over to {executor}: start this "
            "on a machine of the cluster that may submit jobs"
        )
