"""The marker file lists re-enacted logs, so that original logs are never overwritten.

Before it writes, ``rftfit reenact`` calls `find_earlier`, which refuses a folder with a file that the marker does not
list or that was changed since, and `clear`, which removes the listed ones. ``raw`` is the folder of the logs, ``sheet``
the path of the run sheet, which may lie elsewhere.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from rftfit.campaign.load import REENACTED
from rftfit.campaign.problems import join_words
from rftfit.errors import InputError, OutputError
from rftfit.reference import CITATION
from rftfit.store import write_text

MARKER = REENACTED
"""Name of the marker file."""
_LIST = "files (bytes, path from this folder):"
"""Last line of the marker before the list: of each file its size in bytes, and its path."""
_UNFINISHED = "-"
"""Stands for the size of a file that may not be complete."""


def write_marker(raw: Path, names: Iterable[Path], made_by: str, *, complete: bool) -> None:
    """Write the marker into the raw folder: what its logs are, and which files are re-enacted, the run sheet too.

    `names`: Paths of the files. `made_by`: Version and options of the program.
    `complete`: False before the first log is written, when the sizes of files are not yet known.
    """
    lines = []
    for path in sorted(set(names)):
        relative = Path(os.path.relpath(path, raw)).as_posix()
        if not complete:
            lines.append(f"{_UNFINISHED} {relative}")
        elif path.is_file():
            lines.append(f"{path.stat().st_size} {relative}")
    text = (
        "The logs in this folder are simulated: computed from published results, for\n"
        "demonstration and tests. They are not original recordings.\n\n"
        f"Published in: {CITATION}.\n"
        f"Made by: {made_by}.\n\n"
        "rftfit reenact clears and rewrites the files of this list and touches no others.\n"
    )
    write_text(raw / MARKER, f"{text}{_LIST}\n" + "\n".join(lines) + "\n")


def find_earlier(raw: Path, sheet: Path) -> list[Path]:
    """Find the files of an earlier re-enactment, the run sheet first; refuse files of another origin.

    A file is of another origin if the marker does not list it with its size, or if there is no marker. A run sheet with
    its header alone is that of a new campaign, and no obstacle.
    """
    if raw.exists() and not raw.is_dir():
        raise InputError(f"{raw}: this is no folder, so no logs can be written into it")
    marker = raw / MARKER
    earlier_files = {path for path in _list_files(raw) if path not in (marker, raw / "README.md")}
    earlier_files.discard(sheet)
    if sheet.is_file() and not _has_only_header(sheet):
        earlier_files.add(sheet)
    if not marker.is_file():
        if earlier_files:
            raise InputError(
                f"{raw}: {_format_names_with_verb(earlier_files, raw)} not from rftfit reenact (no {MARKER} says so), so "
                "nothing was written. Original logs are never overwritten: name another folder as "
                "`raw` and another `run_sheet` in the config, or move these files away"
            )
        return []
    sizes = _read_marker(marker, raw, sheet)
    foreign = {path for path in earlier_files if not _is_ours(path, sizes)}
    if foreign:
        raise InputError(
            f"{raw}: {_format_names_with_verb(foreign, raw)} not as rftfit reenact wrote them (see {MARKER}), so "
            "nothing was written; move these files away, then call rftfit reenact again"
        )
    # the sheet is first, so that it is removed before the logs that it names
    return sorted(earlier_files, key=lambda path: (path != sheet, path))


def clear(files: Sequence[Path]) -> None:
    """Remove the files of an earlier re-enactment, in their order, and folders left empty."""
    for path in files:
        remove(path)
    for folder in {path.parent for path in files}:
        # rmdir fails for a folder that is not empty
        with contextlib.suppress(OSError):
            folder.rmdir()


def remove(path: Path) -> None:
    """Remove a file, if it is there."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be removed: {error.strerror or error}; allow writing there or close it in "
            "other programs"
        ) from error


def _list_files(raw: Path) -> list[Path]:
    """List all files below the raw folder, and links to folders; refuse a folder that cannot be read."""

    def stop(error: OSError) -> None:
        """Refuse a folder that cannot be read."""
        # a folder that cannot be read may hold original logs
        raise InputError(f"{error.filename}: cannot be looked into: {error.strerror}") from error

    paths = []
    for folder, folders, names in os.walk(raw, onerror=stop if raw.is_dir() else None):
        paths += [Path(folder) / name for name in names]
        # a link to another folder counts as a foreign file: logs must not be written through it
        paths += [Path(folder) / name for name in folders if (Path(folder) / name).is_symlink()]
    return paths


def _read_marker(marker: Path, raw: Path, sheet: Path) -> dict[Path, int | None]:
    """Read the files of a marker and their sizes in bytes, None for a file that may not be complete.

    A marker that cannot be read or was edited is refused, as it no longer says which logs are simulated.
    """
    try:
        head, list_heading, listing = marker.read_text(encoding="utf-8").partition(f"{_LIST}\n")
    except (OSError, ValueError) as error:
        raise InputError(
            f"{marker}: cannot be read: {error}; delete the folder yourself if no original log is in it"
        ) from error
    sizes: dict[Path, int | None] = {}
    for line in listing.splitlines():
        size, _, name = line.partition(" ")
        path = Path(os.path.normpath(raw / name))
        # an edited list must not reach outside
        inside = path.is_relative_to(raw) or path == sheet
        if not name or not inside or not (size == _UNFINISHED or size.isdecimal()):
            list_heading = ""
            break
        sizes[path] = None if size == _UNFINISHED else int(size)
    if not head or not list_heading:
        raise InputError(
            f"{marker}: this list has been changed, so it is not known which logs are simulated "
            "and nothing was written; delete the folder yourself if no original log is in it"
        )
    return sizes


_PART = re.compile(r"^\.(?P<stem>.+)\.\d+\.part(?P<suffix>\.\w+)?$")
"""Name of the temporary file of a writer."""


def _is_ours(path: Path, sizes: dict[Path, int | None]) -> bool:
    """Return True for a file of the marker with its size there (`sizes`), or for a part of such a file."""
    part_match = _PART.match(path.name)
    if part_match:
        # a writer that was killed leaves such a part
        return path.with_name(f"{part_match['stem']}{part_match['suffix'] or ''}") in sizes
    return path in sizes and not path.is_symlink() and sizes[path] in (None, path.stat().st_size)


def _has_only_header(sheet: Path) -> bool:
    """Return True if a run sheet has no rows below its header, as `rftfit init` made it."""
    try:
        lines = sheet.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError):
        return False
    return sum(1 for line in lines if line.strip()) <= 1


_MOST_SHOWN = 5
"""Most files named in one message."""


def _format_names_with_verb(paths: set[Path], raw: Path) -> str:
    """Format the names of some files, followed by ``is`` or ``are``."""
    names = sorted(Path(os.path.relpath(path, raw)).as_posix() for path in paths)
    return f"{join_words(names, _MOST_SHOWN)} {'is' if len(names) == 1 else 'are'}"
