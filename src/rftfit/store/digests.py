"""Digests of files, of code and of settings: what a result was made from."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.errors import InputError
from rftfit.store.environment import shipped

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import numpy.typing as npt

_LENGTH = 16
_PACKAGE = Path(__file__).resolve().parents[1]
_SOURCE = (".py", ".toml", ".csv", ".mplstyle", ".html", ".css", ".js")

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

_EVERYWHERE = (
    "errors.py",
    "conventions.py",
    "directions.py",
    "results.py",
    "workflow/job.py",
    "workflow/stages.py",
)
"""What every job of the workflow goes through: the tables that it reads, and the job itself."""

_STAGES = tuple(
    f"workflow/{name}.py" for name in ("measure", "profiles", "validate", "robot", "provenance")
)
"""Functions that rules call."""

_SETTINGS = {"robot": "config/robot.yaml"}
"""Settings of the program itself that a room reads: they count as its code."""


def sha256_of(path: str | Path) -> str:
    """Digest of the content of a file."""
    with open(path, "rb") as handle:  # noqa: PTH123 (a hot path: thousands of files)
        return hashlib.file_digest(handle, "sha256").hexdigest()


def digests_of_files(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of files by name, relative to a folder; empty of what is no regular file or cannot be read."""
    return {name: _digest_or_nothing(f"{folder}/{name}") for name in names}


def _digest_or_nothing(path: str) -> str:
    try:
        # a pipe would keep its reader waiting for ever
        return sha256_of(path) if stat.S_ISREG(os.stat(path).st_mode) else ""  # noqa: PTH116
    except (OSError, ValueError):
        return ""


def sums_text(digests: Mapping[str, str]) -> str:
    """Digests by path, in the form that ``sha256sum --check`` reads; files without one are left out."""
    return "".join(f"{digests[path]}  {path}\n" for path in sorted(digests) if digests[path])


def read_sums(source: str | Path) -> dict[str, str]:
    """Read digests as `sums_text` writes them."""
    try:
        lines = Path(source).read_text(encoding="utf-8").splitlines()
        return {path: digest for digest, path in (line.split("  ", 1) for line in lines)}
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as a list of digests: {error}") from error


def digest_of(*values: object) -> str:
    """Digest of values that JSON can write, or that can say what they are."""
    text = json.dumps(values, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def seal(data: bytes) -> str:
    """Digest of bytes and of all code of the program: only the same code may read them again."""
    return digest_of(hashlib.sha256(data).hexdigest(), source_digests())


def digest_of_numbers(columns: Mapping[str, npt.NDArray[Any]]) -> str:
    """Digest of columns of numbers and of their names."""
    hasher = hashlib.sha256()
    for name, values in columns.items():
        hasher.update(name.encode() + values.tobytes())
    return hasher.hexdigest()[:_LENGTH]


def code_digest(room: str, *extra_files: str) -> str:
    """Digest of the code of a room and of all below it, and of further files of the package."""
    files = source_digests()
    rooms = ROOMS[: ROOMS.index(room) + 1]
    single_files = {
        *_EVERYWHERE,
        *extra_files,
        *(_SETTINGS[room_name] for room_name in rooms if room_name in _SETTINGS),
    }
    return digest_of(
        [
            (name, digest)
            for name, digest in files.items()
            if name in single_files or name.partition("/")[0] in rooms
        ]
    )


@cache
def source_digests() -> dict[str, str]:
    """Digest of every source file that a job may use, by path in the package.

    It is that of the first call: what a process imports later may be another. `cache_clear` forgets it.
    """
    paths = [_PACKAGE / name for name in (*_EVERYWHERE, *_STAGES)]
    paths += [path for room in ROOMS for path in (_PACKAGE / room).rglob("*.*")]
    paths = [path for path in paths if path.suffix in _SOURCE]
    paths_by_name = {path.relative_to(_PACKAGE).as_posix(): path for path in paths}
    paths_by_name |= {name: shipped(name) for name in _SETTINGS.values()}
    return {name: sha256_of(paths_by_name[name])[:_LENGTH] for name in sorted(paths_by_name)}


@cache
def plugin_digest(module: str) -> str:
    """Digest of the source file of a module of another package."""
    from importlib.util import find_spec

    try:
        spec = find_spec(module)
    except (ImportError, ValueError):
        return ""
    return sha256_of(spec.origin)[:_LENGTH] if spec and spec.origin and spec.has_location else ""
