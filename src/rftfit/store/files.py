"""Files appear whole or not at all: written beside the target, then moved over it.

The file beside it is called ``.NAME.PROCESS.part.SUFFIX``. A process that is killed leaves it behind;
it is never read, and the next process that writes into the folder removes it. Whether its writer
still lives is asked of the kernel, by a lock that ends with the process that holds it.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

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
        if temporary.is_symlink():
            # nobody writes a link of this name: somebody has guessed it
            temporary.unlink()
        for _ in range(_ATTEMPTS):
            handle = stack.enter_context(_opened(temporary, os.O_CREAT | os.O_TRUNC | _NO_LINKS))
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
