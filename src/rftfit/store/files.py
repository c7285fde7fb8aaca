"""Writes every file of the program: as a new file beside the target, then moved over it.

A file appears whole or not at all, and nothing is ever written into a file that is there: a symbolic link or a
second name (hard link) of the target loses its name to the new file, and what it leads to stays as it is. Two sorts of file
cannot be moved into place when they are finished, a log that grows and the note of a lock: they are opened where they are the
new file's own inode, with one name.

The file beside it is called ``.NAME.PROCESS.part.SUFFIX``. A process that is killed leaves it behind;
it is never read, and the next process that writes into the folder removes it. Whether its writer
still lives is asked of the kernel, by a lock that ends with the process that holds it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

from rftfit.errors import OutputError

_REST = re.compile(r"\..+\.[0-9]+\.part(\.\w+)?")
_ATTEMPTS = 5
_NO_LINKS = getattr(os, "O_NOFOLLOW", 0)
_cleared: set[Path] = set()


@contextlib.contextmanager
def atomic_path(target: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the target's folder, with its suffix; move it over the target on success."""
    target = Path(target)
    # the process id keeps two programs apart that write the same target
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.parent not in _cleared:
            # once a process: a campaign may have thousands of files in a folder
            _cleared.add(target.parent)
            remove_temporary(target.parent)
        with _claimed(temporary):
            yield temporary
            temporary.replace(target)
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else error.strerror or error
        raise OutputError(
            f"{target}: cannot write: {why}. Nothing was left half-written; "
            "free some space or allow writing there, then run again."
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def is_temporary(name: str) -> bool:
    """Tell whether a file's name is that of an unfinished file."""
    return _REST.fullmatch(name) is not None


def remove_temporary(folder: Path) -> int:
    """Remove what processes that were killed have left in a folder; returns how many files.

    What a living process still writes stays, and so does everything where the system or the disk has
    no locks that would tell.
    """
    removed = 0
    with contextlib.suppress(OSError):
        paths = [entry.path for entry in os.scandir(folder) if is_temporary(entry.name)]
        for path in paths:
            with contextlib.suppress(OSError), _opened(path, _NO_LINKS) as handle:
                if lock(handle):
                    os.unlink(path)  # noqa: PTH108
                    removed += 1
    return removed


def lock(handle: int) -> bool:
    """Take the lock on an open file, which ends with it or this process; False where that cannot be."""
    try:
        fcntl: Any = import_module("fcntl")
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):
        return False
    return True


@contextlib.contextmanager
def _opened(path: str | Path, extra_flags: int = 0) -> Iterator[int]:
    handle = os.open(path, os.O_RDWR | extra_flags, 0o666)
    try:
        yield handle
    finally:
        os.close(handle)


@contextlib.contextmanager
def _claimed(temporary: Path) -> Iterator[None]:
    """Make the file and hold its lock, so that no other process takes it for a dead one's."""
    if os.name != "posix":
        # an open file could not be moved
        yield
        return
    with contextlib.ExitStack() as stack:
        for _ in range(_ATTEMPTS):
            # left by a killed process of this number, or put there by somebody who has guessed the name
            temporary.unlink(missing_ok=True)
            handle = stack.enter_context(_opened(temporary, os.O_CREAT | os.O_EXCL | _NO_LINKS))
            lock(handle)
            # another process may have cleared it away before it was locked
            with contextlib.suppress(FileNotFoundError):
                if temporary.stat().st_ino == os.fstat(handle).st_ino:
                    break
        yield


def write_bytes(target: str | Path, data: bytes) -> None:
    """Write `data` to `target` atomically."""
    with atomic_path(target) as path:
        path.write_bytes(data)


def write_text(target: str | Path, text: str) -> None:
    r"""Write `text` as UTF-8 with ``\\n`` line ends to `target` atomically."""
    write_bytes(target, text.encode("utf-8"))


def copy_file(source: str | Path, target: str | Path) -> None:
    """Copy the content of a file to `target` atomically."""
    with atomic_path(target) as path:
        shutil.copyfile(source, path)


def write_report(folder: Path, prefix: str, text: str) -> Path:
    """Write text into a new file of a drawn name in a folder that only this user reads."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    handle, path = tempfile.mkstemp(".txt", prefix, folder)
    with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as report:
        report.write(text)
    return Path(path)


# --- Files that are written where they are: logs that grow, and the note of a lock.


def open_growing(target: str | Path) -> BinaryIO:
    """Put a new, empty file in the target's place and open it, unbuffered, for what is written as it comes."""
    write_bytes(target, b"")
    return os.fdopen(open_unshared(target, os.O_WRONLY | os.O_APPEND), "wb", buffering=0)


def open_note(path: Path) -> int:
    """Open a small file for reading and writing in place; a new one where none is there, or what is there is shared."""
    with contextlib.suppress(OSError):
        return open_unshared(path)
    write_bytes(path, b"")
    return open_unshared(path)


def open_unshared(path: str | Path, flags: int = os.O_RDWR) -> int:
    """Open a regular file that is there, by a handle of the system.

    Raises
    ------
    OSError
        If it is not there, a link, no regular file, or has a second name (a hard link).
    """
    handle = os.open(path, flags | _NO_LINKS | getattr(os, "O_BINARY", 0))
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode) or status.st_nlink != 1:
        os.close(handle)
        raise OSError(errno.EMLINK, os.strerror(errno.EMLINK), str(path))
    return handle


# --- Files with a second name: a copy by ``cp -al`` shares every file with its original.


def is_shared(status: os.stat_result) -> bool:
    """Tell whether a file has a second name (a hard link), by its status."""
    return stat.S_ISREG(status.st_mode) and status.st_nlink > 1


def cut_shared(path: str | Path) -> None:
    """Give a file that has a second name an inode of its own, with the same content, times and rights."""
    if is_shared(os.lstat(path)):
        with atomic_path(path) as copy:
            shutil.copy2(path, copy)


def set_time(path: str | Path, seconds: float | None = None) -> None:
    """Set the time of a file, s since 1970, or to now; the file of another name keeps its own."""
    cut_shared(path)
    os.utime(path, None if seconds is None else (seconds, seconds))
