"""Whether the lock of a campaign's folder is a killed run's, and processes that end with the one that started them.

Snakemake keeps a second one out of a folder by files in ``.snakemake/locks``, which a killed one leaves behind.
"""

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

# --- Note which process holds the lock of a campaign's folder, so that a lock left by a killed process can be removed.


_NOTE = Path("rftfit") / "holder"
"""Path of the note, from ``.snakemake``: the name of the computer, and the identifier of its last start."""
_BOOT = Path("/proc/sys/kernel/random/boot_id")
"""File with an identifier that is new at each start of the computer (Linux)."""


def hold_lock(folder: Path) -> None:
    """Note that this process holds Snakemake's lock: `folder` is ``.snakemake``. Where that fails, nothing is noted.

    The note itself is locked by the system for as long as this process lives, so that others see when it has ended.
    """
    note = folder / _NOTE
    with contextlib.suppress(OSError, OutputError):
        # the handle is never closed: its lock ends with this process
        handle = open_note(note)
        if lock(handle):
            os.ftruncate(handle, 0)
            os.write(handle, _name_computer().encode())


@contextlib.contextmanager
def stale_lock(folder: Path) -> Iterator[bool]:
    """Yield True if Snakemake's lock in `folder`, ``.snakemake``, is certainly left by a process that no longer lives.

    No other process gets True until the block is left: else a second could clear the lock that the first then takes.
    """
    try:
        handle = open_unshared(folder / _NOTE)
    except OSError:
        yield False
        return
    try:
        yield lock(handle) and _is_note_on_lock(handle, folder)
    finally:
        os.close(handle)


def _is_note_on_lock(handle: int, folder: Path) -> bool:
    """Return True where the note (open as `handle`) is about the lock that is there, and of this computer since its start.

    The system's lock on the note says nothing of processes of another computer that shares the folder.
    """
    try:
        lock_times = [path.stat().st_mtime_ns for path in (folder / "locks").glob("*.lock")]
        noted = os.pread(handle, 1000, 0).decode("utf-8", "replace")
        note_time = os.fstat(handle).st_mtime_ns
    except OSError:
        return False
    computer = _name_computer()
    # a note that is older than the lock is about an earlier run
    is_newest = bool(lock_times) and max(lock_times) <= note_time
    return is_newest and bool(computer) and noted == computer


def _name_computer() -> str:
    """Return the name of this computer and the identifier of its start; empty where the system does not tell it."""
    try:
        return f"{platform.node()}\n{_BOOT.read_text(encoding='ascii').strip()}\n"
    except (OSError, ValueError):
        return ""


# --- A process that ends when the one that started it has ended, so that no orphan goes on writing.


PARENT_VARIABLE = "RFTFIT_PARENT"
"""Environment variable of a child: process id of the process to watch."""

SHELL_PREFIX = f"{PARENT_VARIABLE}=$PPID exec " if os.name == "posix" else ""
"""Words before the command of a job: `exec` lets the stage replace the shell, and the stage watches the shell's parent."""

_ORPHANED = 143
"""Exit status of a process that ended with the one it watched: as of SIGTERM."""


def end_now() -> None:
    """End this process at once, without clearing up."""
    try:
        sys.stderr.write("rftfit: ended, since the workflow that started this has ended\n")
        sys.stderr.flush()
    finally:
        os._exit(_ORPHANED)


_INIT = 1
"""Process id of the system's first process, which becomes the parent of those whose own has ended."""


def end_with_parent(end: Callable[[], None] = end_now) -> bool:
    """Watch the process that `PARENT_VARIABLE` names, and call `end` soon after that process has ended.

    `end`: Function that ends this process. The variable is removed from the environment, so that processes started from
    here do not watch, too. Returns True where a process is watched: only on POSIX systems, where the environment asks for
    it, and where that process still lives.
    """
    process_id = os.environ.pop(PARENT_VARIABLE, "")
    if os.name != "posix" or not process_id.isdecimal():
        return False
    import psutil

    parent, starter = os.getppid(), int(process_id)
    # where another program stands between the named process and this one, that program is watched
    if parent != starter and (parent == _INIT or not psutil.pid_exists(starter)):
        end()
        return False
    end_with(parent, end)
    return True


_POLL_S = 0.5
"""Time between two looks at the watched process, s."""


def end_with(process_id: int, end: Callable[[], None] = end_now) -> None:
    """Watch a process from a thread of this one, and call `end`, which ends this one, soon after that process has ended."""
    import psutil

    def watch() -> None:
        with contextlib.suppress(psutil.NoSuchProcess):
            process = psutil.Process(process_id)
            # an ended process that nobody has waited for still has its id
            while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
                time.sleep(_POLL_S)
        end()

    threading.Thread(target=watch, name="end with parent", daemon=True).start()


_PATIENCE_S = 10.0
"""Time that processes have to clear up before they are killed, s."""


def end_group() -> None:
    """End this process and all jobs that it has started (its group): by SIGTERM, so that they clear up, then by SIGKILL."""
    os.killpg(os.getpgrp(), signal.SIGTERM)
    time.sleep(_PATIENCE_S)
    os.killpg(os.getpgrp(), signal.SIGKILL)
