"""Reads files that a user names, within limits of size and kind, and keeps their paths inside a folder."""

from __future__ import annotations

import os
import posixpath
import re
import stat
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from rftfit.campaign.problems import CampaignError, Place, Problem, did_you_mean

Status = Literal["file", "folder", "other", "missing", "outside", "refused"]
"""What lies at a path. other: a pipe or device; outside: a link leads out of the folder; refused: for its spelling."""

DEVICE = "a name that is no device of Windows, where it could not be a file"
"""Words on what is allowed, for a name that `is_device`."""

BAG = "metadata.yaml"
"""File that lists which files of its folder are one recording (rosbag2)."""

_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$"]
    + [
        f"{port}{number}"
        for port in ("com", "lpt")
        for number in "0123456789\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}"
    ]
)
"""Names of devices of Windows."""
MOST_SEARCHES = 20
"""Most missing files of a campaign, and unknown tares of a sheet, for which a similar name is searched."""
_MOST_NAMES = 2000
"""Most files of a folder among which a similar name is searched."""


def read_text(path: Path, file: str, area: str, limit: int) -> str:
    """Read a file of UTF-8 text, with or without a byte order mark; all line ends become line feeds.

    The arguments are as in `read_bytes`.
    """
    data = read_bytes(path, file, area, limit)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, value_found = None, "UTF-16"
        if not data.startswith((b"\xff\xfe", b"\xfe\xff")):
            line = len(re.findall(rb"\r\n|\r|\n", data[: error.start])) + 1
            value_found = f"byte {data[error.start]:#04x}"
        allowed = "UTF-8 text; in a spreadsheet save as 'CSV UTF-8', in an editor choose UTF-8"
        problem = Problem(f"{area}.not-utf8", Place(file, line=line), value_found, allowed)
        raise CampaignError([problem]) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_bytes(path: Path, file: str, area: str, limit: int, cure: str = "") -> bytes:
    """Read a regular file of at most `limit` bytes; raises CampaignError for any other, and where it cannot be read.

    `file`: Name of the file for the user. `area`: First part of the code of a problem. `cure`: Advice for a file that
    is too large.
    """

    def refusal(code: str, allowed: str) -> CampaignError:
        """Make the error, to be raised; `code`: last part of the code of the problem; `allowed`: the whole message."""
        return CampaignError([Problem(f"{area}.{code}", Place(file), None, allowed)])

    try:
        state = path.stat()
        # reading a pipe or device would never end
        if not stat.S_ISREG(state.st_mode):
            raise refusal("not-a-file", "this is a folder or device, not a file")
        if state.st_size > limit:
            sizes = (
                f"{state.st_size / 1e6:.1f} MB are too large; at most {limit / 1e6:g} MB are read"
            )
            raise refusal("too-large", sizes + (cure and f": {cure}"))
        return path.read_bytes()
    except FileNotFoundError:
        raise refusal("missing", "the file does not exist") from None
    except (OSError, ValueError) as error:
        # a ValueError, as for a zero byte in the path, has no words of the system
        why = getattr(error, "strerror", None) or error
        raise refusal("unreadable", f"the file cannot be read: {why}") from error


def is_device(name: str) -> bool:
    """Return whether a name, with any ending, means a device under Windows, as ``con.csv``: no file can have it."""
    return name.partition(".")[0].rstrip(" ").casefold() in _DEVICES


def folded(path: str) -> str:
    """Return a path in the form in which some disks compare paths: without case, accents as one character.

    Two paths with the same form may be one file there.
    """
    # twice: accents are joined before case is folded, which may take them apart again
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


_DIRECTION_SIGNS = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Signs that reverse the direction of the letters behind them, so that a text can mislead its reader."""


def unshowable(text: str) -> str:
    """Return the first character that a page or figure cannot show as it is; empty if there is none."""
    if text.isprintable():  # a fast way out, as most texts are
        return ""
    for sign in text:
        is_control = sign not in "\t\n" and unicodedata.category(sign) in ("Cc", "Cs")
        if is_control or sign in _DIRECTION_SIGNS:
            return sign
    return ""


class BadPath(Exception):
    """A path that is refused because of its spelling; whoever knows the place of the path makes a problem of it.

    `code`: Last part of the code of a problem. `allowed`: Words on what is allowed. `nearest`: The path as it was
    probably meant.
    """

    def __init__(self, code: str, allowed: str, nearest: str | None = None) -> None:
        super().__init__(allowed)
        self.code, self.allowed, self.nearest = code, allowed, nearest


def inside(path: str, folder: str) -> bool:
    """Return whether a path is a folder, or lies in this folder; both without links, absolute or from one folder."""
    return path == folder or path.startswith(folder.rstrip("/\\") + os.sep)


def plain_path(written: str) -> str:
    """Return a relative path without its ``.`` parts; `written`: path as the user wrote it.

    Raises `BadPath` for a path that leads out of its folder, or that means another file, or none, on another system.
    """
    parts = written.split("/")
    if "\\" in written:
        raise BadPath("backslash", "write / and not backslashes", written.replace("\\", "/"))
    if not written.strip() or not written.isprintable():
        raise BadPath("path", "without control characters" if written.strip() else "not blank")
    if written.startswith(("/", "~")) or re.match(r"[A-Za-z]:", written):
        raise BadPath("path-outside", "a relative path, not an absolute one")
    if ".." in parts:
        raise BadPath("path-outside", "it must stay inside, without ..")
    if any(map(is_device, parts)):
        raise BadPath("reserved-name", DEVICE)
    return posixpath.normpath(written)


class Entry(NamedTuple):
    """What lies at a path; for a path that cannot be used also `code` of the problem, `why`, and the `nearest` file.

    A path with the status missing has no code, as only its user knows whether it is needed; it may have a `nearest`.
    """

    path: str
    status: Status
    code: str = ""
    why: str = ""
    nearest: str | None = None


class Folder:
    """A folder in which the files of a user are looked up, and which their paths must not leave.

    `base`: Its path, without links. `elsewhere`: Further folders to which links may lead.
    """

    def __init__(self, base: Path | str, elsewhere: Sequence[str] = ()) -> None:
        self.base = os.path.realpath(base)
        self.elsewhere = (*elsewhere,)
        self._searches = 0

    def look_up(self, written: str) -> Entry:
        """Return what lies at a path as the user has written it, with the reason if it cannot be used."""
        try:
            path = plain_path(written)
        except BadPath as bad:
            return Entry(written, "refused", bad.code, bad.allowed, bad.nearest)
        status = self.status(path)
        if status == "outside":
            return Entry(path, status, "path-outside", "a link leads out of it")
        return Entry(path, status, nearest=self.nearest(path) if status == "missing" else None)

    def status(self, path: str) -> Status:
        """Return what lies at a path from `plain_path`; ``outside`` if a link leads out of the folder."""
        # the path without links
        real = os.path.realpath(f"{self.base}/{path}")
        if not any(inside(real, folder) for folder in (self.base, *self.elsewhere)):
            return "outside"
        try:
            mode = os.stat(real).st_mode  # noqa: PTH116
        except (OSError, ValueError):
            return "missing"
        if stat.S_ISREG(mode):
            return "file"
        return "folder" if stat.S_ISDIR(mode) else "other"

    def nearest(self, path: str) -> str | None:
        """Return the path of the file beside a missing one that was probably meant, or None.

        `path`: From `plain_path`. Also None after many searches: where all files are missing, hints do not help.
        """
        self._searches += 1
        if self._searches > MOST_SEARCHES:
            return None
        parent, slash, name = path.rpartition("/")
        try:
            names = sorted(os.listdir(f"{self.base}/{parent}"))  # noqa: PTH208
        except (OSError, ValueError):
            return None
        if len(names) > _MOST_NAMES:
            return None
        # a link that leads nowhere is listed under the name that is missing
        nearest_name = did_you_mean(name, [file for file in names if file != name])
        return nearest_name and f"{parent}{slash}{nearest_name}"


def campaign_folder(root: Path, raw: str) -> Folder:
    """Return the folder of a campaign; its raw folder, which is only read, may be a link to another place.

    `raw`: Path of the raw folder as the config has it.
    """
    try:
        path = Path(os.path.realpath(root), plain_path(raw))
    except BadPath:
        return Folder(root)
    # the raw folder, or a folder on the way to it, may be the link; those above the campaign are resolved
    links = [part for part in (path, *path.parents) if os.path.islink(part)]  # noqa: PTH114
    return Folder(root, [os.path.realpath(link) for link in links])
