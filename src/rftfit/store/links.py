"""Refuses symbolic links where files are written, and cuts second names (hard links) of what Snakemake writes in place.

A folder that somebody else has filled may hold a link under any name that the program writes; archives keep links, and a
backup by ``cp -al`` is made of second names.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

from rftfit.errors import InputError
from rftfit.store.files import cut_shared, is_shared, write_text

RESULTS, SNAKEMAKE = "results", ".snakemake"
_SHOWN = 3
_ENVIRONMENTS = ("conda", "conda-archive", "singularity")
"""Folders of Snakemake that package managers fill, with links and second names of their own."""
_LEVELS = 2
"""Levels of these folders in which Snakemake itself writes: ``conda/HASH.yaml``, ``conda/HASH/env_setup_done``."""


class LinkError(InputError):
    """Symbolic links stand where files are written; `paths` are to be removed."""

    code = "files.link-in-the-way"

    def __init__(self, paths: Collection[Path], other_cure: str = "") -> None:
        self.paths = sorted(paths)
        shown_paths = self.paths[:_SHOWN]
        links = ", ".join(f"{path} -> {_target_of(path)!r}" for path in shown_paths)
        import shlex  # in a refusal alone

        unlisted = f" and {len(paths) - _SHOWN} more" if len(paths) > _SHOWN else ""
        names = " ".join(shlex.quote(str(path)) for path in shown_paths)
        super().__init__(
            f"{links}{unlisted}: a symbolic link where files are written, through which files that rftfit did not make could be "
            f"overwritten; nothing was written [{self.code}]. Remove the link, its target stays: rm {names}{other_cure}"
        )


def _target_of(path: Path) -> str:
    return os.readlink(path) if path.is_symlink() else os.path.realpath(path)  # noqa: PTH115 (as written)


def refuse_links(root: Path, names: Collection[str] = (RESULTS, SNAKEMAKE)) -> None:
    """Refuse a folder in which a symbolic link stands where files are written, wherever it leads.

    `results` may be a link where the user has said so (`put_results_at`), and environments of Snakemake have links.

    Parameters
    ----------
    root : Path
        The campaign.
    names : collection of str, optional
        Files and folders below it that are written to.

    Raises
    ------
    LinkError
        If there is such a link.
    """
    links: set[Path] = set()
    for name in names:
        path = root / name
        on_the_way = [path, *path.parents][: len(Path(name).parts)]
        links.update(way for way in on_the_way if way.is_symlink() and not _is_named_by_user(way))
        if name == SNAKEMAKE:
            entries, entries_of_environments = _entries_of_snakemake(root)
            links.update(
                Path(entry.path)
                for entry in entries_of_environments
                if entry.is_symlink() and _leads_to_campaign(root, entry.path)
            )
        else:
            entries = [*_entries(str(path))]
        links.update(Path(entry.path) for entry in entries if entry.is_symlink())
    if links:
        elsewhere = (
            "; to have the results on another disk, say so yourself: rftfit run --results-at DIR"
        )
        raise LinkError(links, elsewhere * (RESULTS in names))


def cut_shared_files(root: Path, lab_files: Collection[Path]) -> None:
    """Give each file that Snakemake writes in place an inode of its own; the file of the other name stays as it is.

    Parameters
    ----------
    root : Path
        The campaign.
    lab_files : collection of Path
        Raw folder, run sheet and folder of the config: a name that Snakemake has for one of their files is removed.
    """
    entries, entries_of_environments = _entries_of_snakemake(root)
    shared = [entry.path for entry in entries if is_shared(entry.stat(follow_symlinks=False))]
    shared_in_environments = [
        entry.path
        for entry in entries_of_environments
        if is_shared(entry.stat(follow_symlinks=False))
    ]
    if not shared and not shared_in_environments:
        return
    lab_inodes = _inodes(lab_files)
    for path in (*shared, *shared_in_environments):
        status = os.lstat(path)
        if (status.st_dev, status.st_ino) in lab_inodes:
            Path(path).unlink()
        elif path in shared:
            cut_shared(path)


def _inodes(paths: Collection[Path]) -> set[tuple[int, int]]:
    """Device and inode of files, and of all files in folders."""
    inodes = set()
    for path in paths:
        for file in path.rglob("*") if path.is_dir() else [path]:
            with suppress(OSError):
                status = file.stat()
                inodes.add((status.st_dev, status.st_ino))
    return inodes


def _is_named_by_user(path: Path) -> bool:
    target = path.resolve()
    return path.name == RESULTS and any(
        target == folder.resolve() for folder in results_elsewhere(path.parent)
    )


def _leads_to_campaign(root: Path, link: str) -> bool:
    """Tell whether a link leads to a file of the campaign that is none of Snakemake's."""
    target, campaign = Path(os.path.realpath(link)), Path(os.path.realpath(root))
    return target.is_relative_to(campaign) and not target.is_relative_to(campaign / SNAKEMAKE)


def _entries_of_snakemake(root: Path) -> tuple[list[os.DirEntry[str]], list[os.DirEntry[str]]]:
    """List all below ``.snakemake``, but of environments the first levels, which are the second list."""
    folder = f"{root}{os.sep}{SNAKEMAKE}"
    environments = {f"{folder}{os.sep}{name}" for name in _ENVIRONMENTS}
    entries = [*_entries(folder, not_into=environments)]
    return entries, [
        entry
        for path in sorted(environments)
        if not os.path.islink(path)  # noqa: PTH114 (a hot path)
        for entry in _entries(path, levels=_LEVELS)
    ]


def _entries(
    folder: str, levels: int | None = None, not_into: Collection[str] = ()
) -> Iterator[os.DirEntry[str]]:
    """Yield what is in a folder, of all levels or the first; no link below it is followed."""
    waiting = [(folder, 1)]
    while waiting:
        folder, level = waiting.pop()
        try:
            with os.scandir(folder) as scanned:
                entries = [*scanned]
        except (NotADirectoryError, FileNotFoundError):
            continue
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be looked into: {error.strerror}; links there could not be found"
            ) from error
        yield from entries
        if level != levels:
            waiting += [
                (entry.path, level + 1)
                for entry in entries
                if entry.is_dir(follow_symlinks=False) and entry.path not in not_into
            ]


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
    campaign = root.resolve()
    if not folder.is_dir() or folder.is_relative_to(campaign) or campaign.is_relative_to(folder):
        raise InputError(
            f"--results-at: found {str(folder)!r}; allowed: a folder that is there, outside of the campaign"
        )
    if os.path.lexists(link) and not link.is_symlink():
        raise InputError(
            f"{link}: there are results already; move that folder to {folder}, then say --results-at again"
        )
    if link.is_symlink():
        link.unlink()
    link_folder(link, folder)
    folders_by_campaign: dict[str, str] = {}
    with suppress(OSError, ValueError):
        folders_by_campaign = json.loads(_kept_in().read_text(encoding="utf-8"))
    write_text(
        _kept_in(),
        json.dumps(folders_by_campaign | {os.path.realpath(root): str(folder)}, indent=1),
    )


def link_folder(link: Path, folder: Path) -> None:
    """Make a link to a folder, where nothing is."""
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(folder, target_is_directory=True)


def _kept_in() -> Path:
    import pooch  # slow to import, and seldom needed

    return Path(pooch.os_cache("rftfit")) / "results-at.json"
