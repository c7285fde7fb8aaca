"""SHA-256 of files: of all logs on every run, which is cheap where nothing has changed."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.errors import InputError, OutputError
from rftfit.store.atomic import write_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_HEADING = "rftfit logs seen 1"
_SETTLED_NS = 2_000_000_000

State = tuple[int, int, int, int]


def sha256_of(path: str | Path) -> str:
    """Digest of the content of a file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with open(path, "rb") as handle:  # noqa: PTH123 (a hot path: thousands of files)
        return hashlib.file_digest(handle, "sha256").hexdigest()


class Seen:
    """Digests of files, remembered with what a file system says about them.

    A file is read again only where its size, its times (of content and of inode, so that a date put
    back does not deceive) or its inode differ from those it was read with.

    Parameters
    ----------
    memory : Path or None
        Where they are remembered from run to run. It may be deleted at any time; None remembers
        nothing, so that every file is read.
    """

    def __init__(self, memory: Path | None) -> None:
        self._memory = memory
        self._known: dict[str, tuple[State, str]] = {}
        self._changed = False
        if memory is not None:
            self._known = _recall(memory)

    def digests(self, paths: Iterable[str]) -> dict[str, str]:
        """Digest many files.

        Parameters
        ----------
        paths : iterable of str
            Absolute.

        Returns
        -------
        dict of str to str
            SHA-256 by path. What is no regular file, or cannot be read, has an empty digest: pipes
            and devices are never opened.
        """
        found: dict[str, str] = {}
        states: dict[str, State] = {}
        for path in paths:
            state = _state(path)
            if state is None:
                found[path] = ""
            elif path in self._known and self._known[path][0] == state:
                found[path] = self._known[path][1]
            else:
                states[path] = state
        if states:
            # one after the other: threads were twice as slow on files of 50 kB
            found |= {path: _try_sha256(path) for path in states}
            self._keep(states, found)
        return found

    def _keep(self, states: Mapping[str, State], found: Mapping[str, str]) -> None:
        now = time.time_ns()
        for path, state in states.items():
            _, modified, changed, _ = state
            # a clock may tick too slowly to tell a change right after reading from none
            settled = max(modified, changed) < now - _SETTLED_NS
            if found[path] and settled and _state(path) == state:
                self._known[path] = (state, found[path])
                self._changed = True

    def save(self) -> None:
        """Remember for the next run, where there is a folder to do so; failing is no error."""
        if self._memory is None or not self._changed or not self._memory.parent.parent.is_dir():
            return
        lines = [_HEADING]
        for path, (state, digest) in sorted(self._known.items()):
            lines.append("\t".join((digest, *map(str, state), path)))
        with contextlib.suppress(OutputError):
            write_text(self._memory, "\n".join(lines) + "\n")
            self._changed = False


def _state(path: str) -> State | None:
    try:
        found = os.stat(path)  # noqa: PTH116
    except (OSError, ValueError):
        return None
    if not stat.S_ISREG(found.st_mode):
        return None
    return (found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino)


def _try_sha256(path: str) -> str:
    try:
        return sha256_of(path)
    except OSError:
        return ""


def _recall(memory: Path) -> dict[str, tuple[State, str]]:
    known: dict[str, tuple[State, str]] = {}
    try:
        heading, *lines = memory.read_text(encoding="utf-8").split("\n")
        if heading != _HEADING:
            return {}
        for line in lines[:-1]:
            digest, size, modified, changed, inode, path = line.split("\t", 5)
            known[path] = ((int(size), int(modified), int(changed), int(inode)), digest)
    except (OSError, ValueError):
        return {}
    return known


def write_sums(digests: Mapping[str, str], target: str | Path) -> None:
    """Write digests in the form that ``sha256sum --check`` reads.

    Parameters
    ----------
    digests : mapping of str to str
        SHA-256 by path; files without one are left out.
    target : str or Path

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_text(target, "".join(f"{digests[path]}  {path}\n" for path in sorted(digests) if digests[path]))  # fmt: skip


def read_sums(source: str | Path) -> dict[str, str]:
    """Read what `write_sums` wrote.

    Parameters
    ----------
    source : str or Path

    Returns
    -------
    dict of str to str

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        lines = Path(source).read_text(encoding="utf-8").splitlines()
        return {path: digest for digest, path in (line.split("  ", 1) for line in lines)}
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as a list of digests: {error}") from error
