"""The lock of a campaign folder, and processes that end with the one that started them."""

from __future__ import annotations

import contextlib
import os
import platform
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rftfit.errors import OutputError
from rftfit.store.files import lock, open_note, open_unshared

# --- Which process holds the lock of a campaign's folder, so that a lock left by a killed process can be removed.


_NOTE = Path("rftfit") / "holder"
_BOOT = Path("/proc/sys/kernel/random/boot_id")
_held: list[int] = []


def hold_lock(folder: Path) -> None:
    """Note in ``.snakemake`` that this process holds the lock, for as long as it lives; failing is no error."""
    note = folder / _NOTE
    with contextlib.suppress(OSError, OutputError):
        handle = open_note(note)
        _held.append(handle)
        if lock(handle):
            os.ftruncate(handle, 0)
            os.write(handle, _computer().encode())


@contextlib.contextmanager
def stale_lock(folder: Path) -> Iterator[bool]:
    """Tell whether it is certain that the lock in ``.snakemake`` is that of a process that no longer lives.

    Nobody else gets True until the block is left, so that two do not clear it one after the other.
    """
    try:
        handle = open_unshared(folder / _NOTE)
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
    computer = _computer()
    return bool(locks) and max(locks) <= newest and bool(computer) and noted == computer


def _computer() -> str:
    """Name of this computer and of its start; empty where the system does not tell the start."""
    try:
        return f"{platform.node()}\n{_BOOT.read_text(encoding='ascii').strip()}\n"
    except (OSError, ValueError):
        return ""


# --- A process that ends when the one that started it has ended, so that no orphan goes on writing.


VARIABLE = "RFTFIT_PARENT"
"""Process id of the process to watch, in the environment of its child."""

SHELL_PREFIX = f"{VARIABLE}=$PPID exec " if os.name == "posix" else ""
"""In front of a job's one command: the stage takes the shell's place, below the shell's own parent."""

_LOOK_S = 0.5
_PATIENCE_S = 10.0
_INIT = 1
_ORPHANED = 143


def end_with_parent(end: Callable[[], None] | None = None) -> bool:
    """Watch the process that the environment names, and end (default: at once) soon after it has ended.

    The name is taken out of the environment, so that processes started from here do not watch it.
    Returns whether anything is watched: only on POSIX systems, and where the environment asks for it.
    """
    process_id = os.environ.pop(VARIABLE, "")
    if os.name != "posix" or not process_id.isdecimal():
        return False
    import psutil

    end = end or end_now
    parent, starter = os.getppid(), int(process_id)
    # where another program stands between, that one is watched
    if parent != starter and (parent == _INIT or not psutil.pid_exists(starter)):
        end()
        return False
    end_with(parent, end)
    return True


def end_with(process_id: int, end: Callable[[], None] | None = None) -> None:
    """Watch a process from a thread, and end (default: at once) soon after it has ended."""
    import psutil

    def watch() -> None:
        with contextlib.suppress(psutil.NoSuchProcess):
            process = psutil.Process(process_id)
            # an ended process that nobody has waited for still has its id
            while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
                time.sleep(_LOOK_S)
        (end or end_now)()

    threading.Thread(target=watch, name="end with parent", daemon=True).start()


def end_now() -> None:
    """End this process without a further step of it."""
    try:
        sys.stderr.write("rftfit: ended, since the workflow that started this has ended\n")
        sys.stderr.flush()
    finally:
        os._exit(_ORPHANED)


def end_group() -> None:
    """End this process and all jobs it has started: politely, so that it clears up, then less so."""
    os.killpg(os.getpgrp(), signal.SIGTERM)
    time.sleep(_PATIENCE_S)
    os.killpg(os.getpgrp(), signal.SIGKILL)
