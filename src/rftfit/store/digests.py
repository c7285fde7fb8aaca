"""Digests of files, code and settings, by which the workflow knows from what a result was made.

A *digest* is a hash: equal digests mean equal content. Those of files are a whole SHA-256, those of code and settings
its first 16 digits. The digest of the code of a *room* (a subpackage) covers all rooms that it may import.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.store.environment import PACKAGE, shipped

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import numpy.typing as npt

_LENGTH = 16
"""Hexadecimal digits of a digest of code or settings."""
_SOURCE_SUFFIXES = (".py", ".toml", ".csv", ".mplstyle", ".html", ".css", ".js")

ROOMS = (
    "store",
    "reference",
    "table",
    "campaign",
    "outputs",
    "logs",
    "measure",
    "model",
    "checks",
    "forces",
    "robot",
    "compare",
    "figures",
    "page",
)
"""Rooms of the package from the lowest to the highest: each imports lower ones only."""

# what a job runs besides its room and the rooms below
_FILES_OF_EVERY_JOB = (
    "errors.py",
    "conventions.py",
    "directions.py",
    "results.py",
    "workflow/job.py",
    "workflow/stages.py",
)
"""Files of code that every job of the workflow runs: access to results, and the job itself."""

_FILES_OF_STAGES = tuple(
    f"workflow/{name}.py" for name in ("measure", "profiles", "validate", "robot", "provenance")
)
"""Files with the functions that rules call."""

_SETTINGS = {"robot": "config/robot.yaml"}
"""Room to a file of settings of the program that it reads; this file counts as its code."""


def sha256_of(path: str | Path) -> str:
    """Return the SHA-256 of the content of a file."""
    with open(path, "rb") as handle:  # noqa: PTH123 (called for thousands of files)
        return hashlib.file_digest(handle, "sha256").hexdigest()


def digests_of_files(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of files by name, relative to a folder; empty for a name that is no readable regular file."""
    return {name: _digest_or_nothing(f"{folder}/{name}") for name in names}


def _digest_or_nothing(path: str) -> str:
    """Return the SHA-256 of a regular file; empty where there is none or it cannot be read."""
    try:
        # reading a pipe would wait for ever
        return sha256_of(path) if stat.S_ISREG(os.stat(path).st_mode) else ""  # noqa: PTH116
    except (OSError, ValueError):
        return ""


def sums_text(digests: Mapping[str, str]) -> str:
    """Format digests by path as ``sha256sum --check`` reads them; files without a digest are left out."""
    return "".join(f"{digests[path]}  {path}\n" for path in sorted(digests) if digests[path])


def read_sums(source: str | Path) -> dict[str, str]:
    """Read a file in the form of `sums_text`: path to digest; raises OSError or ValueError."""
    lines = Path(source).read_text(encoding="utf-8").splitlines()
    return {path: digest for digest, path in (line.split("  ", 1) for line in lines)}


def digest_of(*values: object) -> str:
    """Return a short digest of values that JSON can write; any others count by their `str`."""
    text = json.dumps(values, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def seal(data: bytes) -> str:
    """Return a digest of bytes and of all code of the program, for a file that only the same code may read again.

    A pickle, for example, could run what others put into it, or hold objects of another version.
    """
    return digest_of(hashlib.sha256(data).hexdigest(), source_digests())


def digest_of_numbers(columns: Mapping[str, npt.NDArray[Any]]) -> str:
    """Return a short digest of columns of numbers and of their names."""
    hasher = hashlib.sha256()
    for name, values in columns.items():
        hasher.update(name.encode() + values.tobytes())
    return hasher.hexdigest()[:_LENGTH]


def code_digest(room: str, *extra_files: str) -> str:
    """Return a digest of the code that a job of a room runs: a result is out of date when it changes.

    It covers the room, all rooms below, files that every job runs, and `extra_files`, paths in the package.
    """
    rooms = ROOMS[: ROOMS.index(room) + 1]
    settings = [file for room_name, file in _SETTINGS.items() if room_name in rooms]
    single_files = {*_FILES_OF_EVERY_JOB, *extra_files, *settings}
    return digest_of(
        [
            (name, digest)
            for name, digest in source_digests().items()
            if name in single_files or name.partition("/")[0] in rooms
        ]
    )


@cache
def source_digests() -> dict[str, str]:
    """Return the digest of every source file that a job may use, by path in the package.

    The digests are from the first call in a process: files that are edited later keep them until `cache_clear`.
    """
    paths = [PACKAGE / name for name in (*_FILES_OF_EVERY_JOB, *_FILES_OF_STAGES)]
    paths += [path for room in ROOMS for path in (PACKAGE / room).rglob("*.*")]
    paths = [path for path in paths if path.suffix in _SOURCE_SUFFIXES]
    paths_by_name = {path.relative_to(PACKAGE).as_posix(): path for path in paths}
    paths_by_name |= {name: shipped(name) for name in _SETTINGS.values()}
    return {name: sha256_of(paths_by_name[name])[:_LENGTH] for name in sorted(paths_by_name)}


@cache
def plugin_digest(module: str) -> str:
    """Return the digest of the source file of a module of another package; empty where it has none.

    A lab may add a dialect of its own by such a package.
    """
    from importlib.util import find_spec

    try:
        spec = find_spec(module)
    except (ImportError, ValueError):
        return ""
    return sha256_of(spec.origin)[:_LENGTH] if spec and spec.origin and spec.has_location else ""
