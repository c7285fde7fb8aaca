"""When a file of a watch counts as complete: it has not changed for a time, by its size and time of change.

The watch asks twice a second. Notifications of the system would be cheaper, but fail on network drives.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

Stamp = tuple[int, int] | None
"""Size of a file in bytes, and time of its last change in ns; None if there is no such file."""


class _FileState(NamedTuple):
    """Stamp of a file, the time (s, monotonic clock) since which it is the same, and whether that is long enough ago."""

    stamp: Stamp
    since_s: float
    is_still: bool


def stamp_of(path: str) -> Stamp:
    """Read size and time of change of a file; None if there is no such file."""
    try:
        status = os.stat(path)  # noqa: PTH116 (thousands of files, twice a second)
    except (OSError, ValueError):
        return None
    return status.st_size, status.st_mtime_ns


_TURNS = 4
"""Number of calls of `check_changes` in which a still file is checked once: most files never change again."""


class Files:
    """Stamps of files, each with the time since which it is unchanged; a file is *still* after `wait_s` seconds.

    `check_changes` reads the disk, `stamps` returns what it found.
    """

    def __init__(self, wait_s: float) -> None:
        self.wait_s = wait_s
        self._states: dict[str, _FileState] = {}
        self._turn = 0
        self._folders: dict[str, Stamp] = {}
        self._below: list[str] = []

    def below(self, base: str) -> list[str]:
        """List the paths of the files in a folder and below, without hidden ones.

        The list is kept until the stamp of a folder changes, since to walk through thousands of files takes long.
        """
        is_same = all(stamp_of(path) == stamp for path, stamp in self._folders.items())
        # two changes at the same tick of the disk's clock have one stamp, so list anew now and then
        if not is_same or base not in self._folders or not self._turn % _TURNS:
            self._folders, self._below = {}, []
            for folder, _, names in os.walk(base):
                folder_path = Path(folder).as_posix()
                self._folders[folder_path] = stamp_of(folder_path)
                self._below += [f"{folder_path}/{name}" for name in names if name[0] != "."]
        return self._below

    def check_changes(self, paths: Iterable[str], now_s: float) -> bool:
        """Read the stamps of some files; return True if one of them changed, became still, appeared or disappeared.

        Files that are still are read in one of `_TURNS` calls only. Files that are not among `paths` are forgotten.
        `now_s`: Time by a monotonic clock, s.
        """
        self._turn += 1
        before, self._states = self._states, {}
        for index, path in enumerate(paths):
            state = before.get(path)
            # of the still files another quarter (one of `_TURNS`) at each turn
            if state is None or not state.is_still or not (index + self._turn) % _TURNS:
                stamp = stamp_of(path)
                since_s = state.since_s if state and state.stamp == stamp else now_s
                state = _FileState(stamp, since_s, now_s - since_s >= self.wait_s)
            self._states[path] = state
        return before != self._states

    def stamps(self, paths: Iterable[str]) -> tuple[Stamp, ...] | None:
        """Return the stamps of some files by the last `check_changes`; None if one of them still changes.

        The stamp of a file that is not there is None.
        """
        no_file = _FileState(None, 0, is_still=True)
        states = [self._states.get(path, no_file) for path in paths]
        if not all(state.is_still for state in states):
            return None
        return tuple(state.stamp for state in states)
