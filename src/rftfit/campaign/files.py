"""Reading small text files, and keeping paths where they belong."""

from __future__ import annotations

import os
import posixpath
import re
import stat
from typing import TYPE_CHECKING, Literal

from rftfit.campaign.names import DEVICE, is_device
from rftfit.campaign.problems import Problem, did_you_mean

if TYPE_CHECKING:
    from pathlib import Path

Status = Literal["file", "folder", "other", "missing", "outside"]

_NEAREST_SEARCHES = 20
_MOST_NAMES = 2000


def read_bytes(path: Path, file: str, area: str, limit: int) -> bytes | Problem:
    """Read a regular file of a sensible size.

    Parameters
    ----------
    path : Path
    file : str
        Its name in the problem.
    area : {"config", "sheet"}
        First part of the problem's code.
    limit : int
        Largest size, bytes.

    Returns
    -------
    bytes or Problem
    """

    def problem(code: str, text: str) -> Problem:
        return Problem(file, None, None, None, text, f"{area}.{code}")

    try:
        state = path.stat()
        # a pipe or device would be read for ever
        if not stat.S_ISREG(state.st_mode):
            return problem("not-a-file", "this is a folder or device, not a file")
        if state.st_size > limit:
            size, most = state.st_size / 1e6, limit / 1e6
            return problem(
                "too-large", f"{size:.1f} MB are too large; at most {most:g} MB are read"
            )
        return path.read_bytes()
    except FileNotFoundError:
        return problem("missing", "the file does not exist")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        return problem("unreadable", f"the file cannot be read: {why}")


def decode(data: bytes, file: str, area: str) -> str | Problem:
    """Decode UTF-8, with or without a byte order mark; all line ends become line feeds.

    Parameters
    ----------
    data : bytes
    file, area : str
        As for `read_bytes`.

    Returns
    -------
    str or Problem
        The problem names the row of the first byte that is not UTF-8.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if data.startswith((b"\xff\xfe", b"\xfe\xff")):
            row, found = None, "UTF-16"
        else:
            row = len(re.findall(rb"\r\n|\r|\n", data[: error.start])) + 1
            found = f"byte {data[error.start]:#04x}"
        allowed = "UTF-8 text; in a spreadsheet save as 'CSV UTF-8', in an editor choose UTF-8"
        return Problem(file, row, None, found, allowed, f"{area}.not-utf8")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def plain_path(text: str) -> tuple[str, str, str | None]:
    """Judge a relative path as it is written.

    Parameters
    ----------
    text : str

    Returns
    -------
    path, fault, nearest : str, str, str or None
        The path without ``.`` parts; why it is refused (empty if it is not: otherwise the last part
        of a problem's code, a colon and what is allowed); and what was probably meant.
    """
    if "\\" in text:
        return text, "backslash: write / and not backslashes", text.replace("\\", "/")
    if not text.isprintable():
        return text, "path: without control characters", None
    if text.startswith(("/", "~")) or re.match(r"[A-Za-z]:", text):
        return text, "path-outside: a relative path, not an absolute one", None
    if ".." in text.split("/"):
        return text, "path-outside: it must stay inside, without ..", None
    if any(is_device(part) for part in text.split("/")):
        return text, f"reserved-name: {DEVICE}", None
    return posixpath.normpath(text), "", None


class Folder:
    """A folder and what lies inside it, with the look-ups remembered.

    Parameters
    ----------
    base : Path
        The folder; links in it are resolved.
    """

    def __init__(self, base: Path) -> None:
        self.base = os.path.realpath(base)
        self._parents: dict[str, str] = {}
        self._names: dict[str, tuple[str, ...]] = {}
        self._searches = 0

    def status(self, path: str) -> Status:
        """Say what lies at a relative path.

        Parameters
        ----------
        path : str
            As returned by `plain_path`.

        Returns
        -------
        {"file", "folder", "other", "missing", "outside"}
            ``outside`` if links lead out of the folder.
        """
        head, _, name = path.rpartition("/")
        # one resolution per folder, not per file: a campaign has thousands of logs in a few folders
        if head not in self._parents:
            self._parents[head] = os.path.realpath(f"{self.base}/{head}") if head else self.base
        full = f"{self._parents[head]}/{name}"
        try:
            mode = os.lstat(full).st_mode
            if stat.S_ISLNK(mode):
                full = os.path.realpath(full)
                mode = os.stat(full).st_mode if self._inside(full) else 0  # noqa: PTH116
        except (OSError, ValueError):
            mode = None
        if not self._inside(full):
            return "outside"
        if mode is None:
            return "missing"
        if stat.S_ISREG(mode):
            return "file"
        return "folder" if stat.S_ISDIR(mode) else "other"

    def nearest(self, path: str) -> str | None:
        """Find the file beside a missing one that was probably meant.

        Parameters
        ----------
        path : str

        Returns
        -------
        str or None
            None too after many searches: a folder with nothing in it needs one message, not hints.
        """
        self._searches += 1
        if self._searches > _NEAREST_SEARCHES:
            return None
        head, _, name = path.rpartition("/")
        if head not in self._names:
            self._names[head] = self._list(head)
        found = did_you_mean(name, self._names[head])
        return None if found is None else f"{head}/{found}" if head else found

    def _inside(self, full: str) -> bool:
        return full == self.base or full.startswith(self.base.rstrip("/\\") + os.sep)

    def _list(self, head: str) -> tuple[str, ...]:
        try:
            names = sorted(os.listdir(f"{self.base}/{head}"))  # noqa: PTH208
        except (OSError, ValueError):
            return ()
        return tuple(names) if len(names) <= _MOST_NAMES else ()
