"""Links of a campaign that lead out of its folder: nothing is written through them.

A folder that somebody else has filled may hold a link under any name that the program writes; archives keep links.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from rftfit.errors import InputError
from rftfit.store.files import write_text

RESULTS, SNAKEMAKE = "results", ".snakemake"
_SHOWN = 3
_ENVIRONMENTS = ("conda", "singularity", "apptainer")
"""Of Snakemake, which makes them itself, with links."""


def refuse_links_out(
    root: Path, names: Collection[str] = (RESULTS, SNAKEMAKE), allowed: Collection[Path] = ()
) -> None:
    """Refuse a folder in which something that is written to is a link, or lies below one, that leads out.

    Parameters
    ----------
    root : Path
        The campaign.
    names : collection of str, optional
        What is written to, below it.
    allowed : collection of Path, optional
        Folders elsewhere that the user has named (`results_elsewhere`).

    Raises
    ------
    InputError
        If there is such a link, or one that leads nowhere.
    """
    allowed_folders = [os.path.realpath(root), *map(os.path.realpath, allowed)]
    links_out = []
    visited = {f"{root}{os.sep}{SNAKEMAKE}{os.sep}{name}" for name in _ENVIRONMENTS}
    written_paths = {f"{root}{os.sep}{name}" for name in names}
    waiting = [*written_paths]
    while waiting:
        path = waiting.pop()
        target = path
        # what was named may lie below a link
        if path in written_paths or Path(path).is_symlink():
            target = os.path.realpath(path)
            if not any(
                target == folder or target.startswith(folder + os.sep) for folder in allowed_folders
            ):
                links_out.append(path)
                continue
        if target in visited:
            continue
        visited.add(target)
        with suppress(NotADirectoryError, FileNotFoundError), os.scandir(path) as entries:
            waiting += [
                entry.path
                for entry in entries
                if entry.is_symlink() or entry.is_dir(follow_symlinks=False)
            ]
    if links_out:
        links_text = ", ".join(
            f"{path} -> {str(Path(path).readlink() if Path(path).is_symlink() else os.path.realpath(path))!r}"
            for path in sorted(links_out)[:_SHOWN]
        )
        unlisted_text = f" and {len(links_out) - _SHOWN} more" if len(links_out) > _SHOWN else ""
        elsewhere = (
            "; to have the results on another disk, say so yourself: rftfit run --results-at DIR"
        )
        raise InputError(
            f"{links_text}{unlisted_text}: links that lead out of the campaign, through which nothing is written. Delete them"
            f"{elsewhere * (RESULTS in names)}"
        )


def refuse_target_by_link(path: Path) -> None:
    """Refuse to write a file whose name is a link, or lies below the current folder by its name but not in fact.

    Raises
    ------
    InputError
        With the place that the link leads to, which may be named instead.
    """
    real_path = os.path.realpath(path)
    current_folder = os.path.realpath(".")
    is_below = not path.is_absolute() and ".." not in path.parts
    leads_out = (
        is_below
        and os.path.commonpath([current_folder, os.path.realpath(path.parent)]) != current_folder
    )
    if path.is_symlink() or leads_out:
        raise InputError(
            f"{path}: a link leads from here to {real_path!r}, and nothing is written through a link; name that place itself, or another file"
        )


def results_elsewhere(root: Path) -> list[Path]:
    """Folder that the user has named for the results of a campaign; kept outside of the campaign."""
    with suppress(OSError, ValueError, TypeError, AttributeError):
        folder = json.loads(_kept_in().read_text(encoding="utf-8")).get(os.path.realpath(root))
        return [Path(folder)] if folder else []
    return []


def put_results_at(root: Path, folder: Path) -> None:
    """Let the results of a campaign lie in another folder, by a link that the user has asked for.

    Raises
    ------
    InputError
        If the campaign has a folder of results already, or the folder is not there.
    """
    link, folder = root / RESULTS, folder.resolve()
    if not folder.is_dir():
        raise InputError(f"--results-at: found {str(folder)!r}; allowed: a folder that is there")
    if os.path.lexists(link) and not link.is_symlink():
        raise InputError(
            f"{link}: there are results already; move that folder to {folder}, then say --results-at again"
        )
    if link.is_symlink():
        link.unlink()
    link.symlink_to(folder, target_is_directory=True)
    folders_by_campaign: dict[str, str] = {}
    with suppress(OSError, ValueError):
        folders_by_campaign = json.loads(_kept_in().read_text(encoding="utf-8"))
    write_text(
        _kept_in(),
        json.dumps(folders_by_campaign | {os.path.realpath(root): str(folder)}, indent=1),
    )


def _kept_in() -> Path:
    import pooch  # slow to import, and seldom needed

    return Path(pooch.os_cache("rftfit")) / "results-at.json"
