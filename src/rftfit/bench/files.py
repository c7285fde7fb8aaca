"""Which files are still: they are asked for size and time, since notifications fail on network drives."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Stamp = tuple[int, int] | None
"""Size and time of change of a file, ns; None where there is none."""

_TURNS = 4
"""A file that is still is asked every fourth time: most files of a campaign never change again."""


class _Seen(NamedTuple):
    stamp: Stamp
    since: float
    still: bool


def stamp_of(path: Path | str) -> Stamp:
    """Ask a file for its stamp."""
    try:
        found = os.stat(path)  # noqa: PTH116 (thousands of files, twice a second)
    except (OSError, ValueError):
        return None
    return found.st_size, found.st_mtime_ns


class Files:
    """The stamps of files, and since when they are what they are.

    `wait_s`: A file is still when it has not changed for so long; one that is not there always is.
    """

    def __init__(self, wait_s: float) -> None:
        self.wait_s = wait_s
        self._seen: dict[str, _Seen] = {}
        self._turn = 0

    def look(self, paths: Sequence[str], now: float) -> bool:
        """Ask the files that may have changed; whether one did, or came to rest, or is no longer asked for."""
        self._turn += 1
        changed = len(paths) != len(self._seen)
        seen = {}
        for place, path in enumerate(paths):
            known = self._seen.get(path)
            if known is None or not known.still or not (place + self._turn) % _TURNS:
                stamp, since = stamp_of(path), now
                if known is not None and known.stamp == stamp:
                    since = known.since
                one = _Seen(stamp, since, stamp is None or now - since >= self.wait_s)
                changed |= one != known
                known = one
            seen[path] = known
        self._seen = seen
        return changed

    def stamps(self, paths: Iterable[str]) -> tuple[Stamp, ...] | None:
        """Stamps of some files; None where one of them moves."""
        found = [self._seen[path] for path in paths]
        return tuple(one.stamp for one in found) if all(one.still for one in found) else None


class Tree:
    """Names of the files in a folder; it is listed again where one of its folders changed."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self._folders: dict[str, Stamp] = {}
        self.names: tuple[str, ...] = ()

    def changed(self) -> bool:
        """List the files again where it may be needed; whether it was."""
        if self._folders and all(stamp_of(path) == old for path, old in self._folders.items()):
            return False
        folders, names = {}, []
        for folder, _, files in os.walk(self.base):
            folders[folder] = stamp_of(folder)
            names += [
                os.path.relpath(f"{folder}/{name}", self.base) for name in files if name[0] != "."
            ]
        self._folders, self.names = folders, tuple(sorted(names))
        return True
