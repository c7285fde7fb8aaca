"""Writes every file of the program: as a new file beside the target, then moved over it.

A file appears whole or not at all, and nothing is ever written into an existing file: if the target is a symbolic link
or has a second name (hard link), the new file replaces this name, and the file behind it stays unchanged. Two sorts of
file cannot be moved into place when they are finished: a log that grows, and the note of a lock. These are written in
place, but only if they are regular files with a single name.

The new file is called ``.NAME.PROCESS.part.SUFFIX`` until it is moved. A process that is killed leaves it behind;
it is never read, and the next process that writes into the folder removes it. The writer holds a lock on the file,
which the kernel releases when the process ends: so the lock tells whether the writer still lives.
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

_UNFINISHED = re.compile(r"\..+\.[0-9]+\.part(\.\w+)?")
"""Name of a new file until it is moved."""
_ATTEMPTS = 5
"""Times that a new file is made again, if another process removes it before it is locked."""
_NO_LINKS = getattr(os, "O_NOFOLLOW", 0)
"""Flag that refuses to open a symbolic link; 0 where the system has none."""
_cleared: set[Path] = set()
"""Folders in which this process has already removed unfinished files."""


@contextlib.contextmanager
def atomic_path(target: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the target's folder, with its suffix; move it over the target on success.

    The caller writes into that path. After an exception nothing is left of it, and an OSError becomes an `OutputError`.
    """
    target = Path(target)
    # with the process id, two programs that write the same target have different temporary files
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.parent not in _cleared:
            # once for each folder, as it may have thousands of files
            _cleared.add(target.parent)
            remove_temporary(target.parent)
        with _created_and_locked(temporary):
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
    """Return whether a name is that of an unfinished file."""
    return _UNFINISHED.fullmatch(name) is not None


def remove_temporary(folder: Path) -> int:
    """Remove the unfinished files of killed processes from a folder; return their number.

    Files of living processes stay, and so do all files where the system or the disk has no locks.
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
    """Lock an open file until it is closed or this process ends; return whether that worked.

    False where another process holds the lock, or the system or disk has no locks.
    """
    try:
        fcntl: Any = import_module("fcntl")
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):
        return False
    return True


@contextlib.contextmanager
def _opened(path: str | Path, extra_flags: int) -> Iterator[int]:
    """Open a file for reading and writing, yield its handle (a number of the system), and close it."""
    handle = os.open(path, os.O_RDWR | extra_flags, 0o666)
    try:
        yield handle
    finally:
        os.close(handle)


@contextlib.contextmanager
def _created_and_locked(temporary: Path) -> Iterator[None]:
    """Create the temporary file and hold its lock, so that no other process removes it as left behind."""
    if os.name != "posix":
        # elsewhere an open file could not be moved
        yield
        return
    with contextlib.ExitStack() as stack:
        for _ in range(_ATTEMPTS):
            # a killed process with this id may have left it, or a stranger may have put a link there
            temporary.unlink(missing_ok=True)
            handle = stack.enter_context(_opened(temporary, os.O_CREAT | os.O_EXCL | _NO_LINKS))
            lock(handle)
            # another process may have removed it before it was locked: then try again
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
    """Write text into a new file with a random name, in a folder that only this user can read; return its path.

    The name begins with `prefix`. A report may quote data, and nobody else can guess the name or put a link there.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    handle, path = tempfile.mkstemp(".txt", prefix, folder)
    with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as report:
        report.write(text)
    return Path(path)


# --- Files that are written in place: logs that grow, and the note of a lock


def open_growing(target: str | Path) -> BinaryIO:
    """Replace the target by a new, empty file and open it for appending without a buffer, as for a log that grows."""
    write_bytes(target, b"")
    return os.fdopen(open_unshared(target, os.O_WRONLY | os.O_APPEND), "wb", buffering=0)


def open_note(path: Path) -> int:
    """Open a small file for reading and writing in place, and return its handle.

    A new one takes the place of a file with a second name, as nothing may change that; where there is none, it is made.
    """
    with contextlib.suppress(OSError):
        return open_unshared(path)
    write_bytes(path, b"")
    return open_unshared(path)


def open_unshared(path: str | Path, flags: int = os.O_RDWR) -> int:
    """Open an existing regular file with a single name; return a handle of the system.

    Raises
    ------
    OSError
        If the file does not exist, is a link or no regular file, or has a second name (a hard link).
    """
    handle = os.open(path, flags | _NO_LINKS | getattr(os, "O_BINARY", 0))
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode) or status.st_nlink != 1:
        os.close(handle)
        raise OSError(errno.EMLINK, os.strerror(errno.EMLINK), str(path))
    return handle


# --- Files with a second name (hard link): a copy of a folder by ``cp -al`` shares every file with its original


def is_shared(status: os.stat_result) -> bool:
    """Return whether a file has a second name (a hard link), by its status."""
    return stat.S_ISREG(status.st_mode) and status.st_nlink > 1


def cut_shared(path: str | Path) -> None:
    """Replace a file that has a second name by a copy with the same times and rights: the two are separate then."""
    if is_shared(os.lstat(path)):
        with atomic_path(path) as copy:
            shutil.copy2(path, copy)


def set_time(path: str | Path, seconds: float | None = None) -> None:
    """Set the time of a file, s since 1970, or to now (None); under a second name the file keeps its time."""
    cut_shared(path)
    os.utime(path, None if seconds is None else (seconds, seconds))
