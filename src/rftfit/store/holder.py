"""Who holds the lock of a campaign's folder, so that a dead holder's lock can be told from a living's.

Snakemake locks a folder with files, which stay when it is killed. Beside them the holder notes the
computer, and holds a lock of the kernel on that note, which ends with the process. A lock of files is
the dead's where the note was made after it, on this very computer since it was started, and nobody
holds the note. Everything else is for a person to judge: the holder may run on another computer.
"""

from __future__ import annotations

import contextlib
import os
import platform
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.store.atomic import lock

if TYPE_CHECKING:
    from collections.abc import Iterator

_NOTE = Path("rftfit") / "holder"
_BOOT = Path("/proc/sys/kernel/random/boot_id")
_held: list[int] = []


def hold(folder: Path) -> None:
    """Note that this process holds the folder's lock, for as long as it lives; failing is no error.

    Parameters
    ----------
    folder : Path
        Snakemake's own folder, ``.snakemake``.
    """
    note = folder / _NOTE
    with contextlib.suppress(OSError):
        note.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(note, os.O_RDWR | os.O_CREAT, 0o666)
        _held.append(handle)
        if lock(handle):
            os.ftruncate(handle, 0)
            os.write(handle, _computer().encode())


@contextlib.contextmanager
def left_by_the_dead(folder: Path) -> Iterator[bool]:
    """Tell whether a folder's lock is that of a process that no longer lives.

    Parameters
    ----------
    folder : Path
        Snakemake's own folder, ``.snakemake``.

    Yields
    ------
    bool
        True only where that is certain. Nobody else gets True until the block is left, so that two
        do not clear it one after the other.
    """
    try:
        handle = os.open(folder / _NOTE, os.O_RDWR)
    except OSError:
        yield False
        return
    try:
        yield lock(handle) and _is_of_here(handle, folder)
    finally:
        os.close(handle)


def _is_of_here(handle: int, folder: Path) -> bool:
    try:
        locks = [path.stat().st_mtime_ns for path in (folder / "locks").glob("*.lock")]
        noted = os.pread(handle, 1000, 0).decode("utf-8", "replace")
        newest = os.fstat(handle).st_mtime_ns
    except OSError:
        return False
    here = _computer()
    return bool(locks) and max(locks) <= newest and bool(here) and noted == here


def _computer() -> str:
    """Name of this computer and of its start; empty where the system does not tell the start."""
    try:
        return f"{platform.node()}\n{_BOOT.read_text(encoding='ascii').strip()}\n"
    except (OSError, ValueError):
        return ""
