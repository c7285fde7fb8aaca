"""Refuses symbolic links where files are written, and copies files with a second name that Snakemake writes in place.

A folder that somebody else has filled may hold a symbolic link under any name that the program writes, so that writing
there would overwrite a file elsewhere. Archives keep links, and in a backup by ``cp -al`` each file is a second name
(hard link) of its original. The one link that is allowed is `results`, where the user has asked for it: a *note* in the
user's cache says so.

``root`` is the folder of a campaign. The *environments* of Snakemake are folders in ``.snakemake`` that package
managers fill.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

from rftfit.errors import InputError
from rftfit.store.environment import user_cache
from rftfit.store.files import cut_shared, is_shared, write_text

RESULTS, SNAKEMAKE = "results", ".snakemake"
_SHOWN = 3
"""Most links that a message names."""


class LinkError(InputError):
    """Symbolic links stand where files are written; the user has to remove `paths`.

    `other_cure`: Another cure, at the end of the message.
    """

    code = "files.link-in-the-way"

    def __init__(self, paths: Collection[Path], other_cure: str = "") -> None:
        import shlex  # needed only for a refusal

        self.paths = sorted(paths)
        shown_paths = self.paths[:_SHOWN]
        links = ", ".join(f"{path} -> {_target_of(path)!r}" for path in shown_paths)
        unlisted = f" and {len(paths) - _SHOWN} more" if len(paths) > _SHOWN else ""
        names = " ".join(shlex.quote(str(path)) for path in shown_paths)
        super().__init__(
            f"{links}{unlisted}: a symbolic link where files are written, through which files that rftfit did not make could be "
            f"overwritten; nothing was written [{self.code}]. Remove the link, its target stays: rm {names}{other_cure}"
        )


def _target_of(path: Path) -> str:
    """Return where a link leads, as written in it; for a path below a link, its real path."""
    return os.readlink(path) if path.is_symlink() else os.path.realpath(path)  # noqa: PTH115 (as written)


def refuse_links(root: Path, names: Collection[str] = (RESULTS, SNAKEMAKE)) -> None:
    """Refuse a campaign in which a symbolic link stands where files are written, wherever the link leads.

    Allowed are a link `results` that the user has asked for (`put_results_at`), and links in environments of Snakemake
    that do not lead into the campaign.

    Parameters
    ----------
    root : Path
        Folder of the campaign.
    names : collection of str, optional
        Files and folders in this folder that are written to.

    Raises
    ------
    LinkError
        If there is such a link.
    """
    links: set[Path] = set()
    for name in names:
        path = root / name
        # the path itself, and the folders between it and the root
        below_root = [path, *path.parents][: len(Path(name).parts)]
        links.update(p for p in below_root if p.is_symlink() and not _is_named_by_user(p))
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
        cure = "; to have the results on another disk, say so yourself: rftfit run --results-at DIR"
        raise LinkError(links, cure if RESULTS in names else "")


def cut_shared_files(root: Path, lab_files: Collection[Path]) -> None:
    """Replace each file with a second name that Snakemake writes in place by a copy, so that only the copy is changed.

    Parameters
    ----------
    root : Path
        Folder of the campaign.
    lab_files : collection of Path
        Raw folder, run sheet and folder of the config: if a file of Snakemake is a second name for one of their
        files, this name is removed without a copy.
    """
    entries, entries_of_environments = _entries_of_snakemake(root)
    shared = [
        entry.path
        for entry in (*entries, *entries_of_environments)
        if is_shared(entry.stat(follow_symlinks=False))
    ]
    lab_inodes = _inodes(lab_files) if shared else set()
    in_environments = {entry.path for entry in entries_of_environments}
    for path in shared:
        status = os.lstat(path)
        if (status.st_dev, status.st_ino) in lab_inodes:
            Path(path).unlink()
        elif path not in in_environments:
            cut_shared(path)


def _inodes(paths: Collection[Path]) -> set[tuple[int, int]]:
    """Return device and inode, which identify a file under any name, of files and of all files in folders."""
    inodes = set()
    for path in paths:
        for file in path.rglob("*") if path.is_dir() else [path]:
            with suppress(OSError):
                status = file.stat()
                inodes.add((status.st_dev, status.st_ino))
    return inodes


def _is_named_by_user(path: Path) -> bool:
    """Return whether a path is the link `results` that the user has asked for."""
    folder = _noted_folders().get(os.path.realpath(path.parent)) if path.name == RESULTS else None
    return folder is not None and Path(folder).resolve() == path.resolve()


def _leads_to_campaign(root: Path, link: str) -> bool:
    """Return whether a link leads to a file of the campaign outside of ``.snakemake``, which nothing may overwrite."""
    target, campaign = Path(os.path.realpath(link)), Path(os.path.realpath(root))
    return target.is_relative_to(campaign) and not target.is_relative_to(campaign / SNAKEMAKE)


_ENVIRONMENTS = ("conda", "conda-archive", "singularity")
"""Folders of Snakemake that package managers fill, where links and second names are normal."""
_LEVELS = 2
"""Levels of such a folder in which Snakemake itself writes: ``conda/HASH.yaml``, ``conda/HASH/env_setup_done``."""


def _entries_of_snakemake(root: Path) -> tuple[list[os.DirEntry[str]], list[os.DirEntry[str]]]:
    """Return all entries below ``.snakemake`` outside of its environments, and those in the first levels of these.

    An entry is a file, a folder or a link.
    """
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
    """Yield the files and folders in a folder, in all levels or the first `levels`; no link is followed.

    `not_into`: Paths of folders whose content is left out.
    """
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
    """Refuse to write a file whose name is a link, or whose relative path leads through a link out of this folder.

    Raises
    ------
    InputError
        With the place to which the link leads, which the user may name instead.
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


def put_results_at(root: Path, folder: Path) -> None:
    """Put the results of a campaign in another folder that the user has named: `results` becomes a noted link.

    Raises
    ------
    InputError
        If the campaign already has a folder of results, or `folder` does not exist or is part of the campaign.
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
    noted = _noted_folders() | {os.path.realpath(root): str(folder)}
    write_text(_path_of_note(), json.dumps(noted, indent=1))


def link_folder(link: Path, folder: Path) -> None:
    """Make a link to a folder; the place of the link must be free."""
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(folder, target_is_directory=True)


def _noted_folders() -> dict[str, str]:
    """Read the note: path of a campaign to the folder that the user has named for its results; empty without one."""
    with suppress(OSError, ValueError, AttributeError):
        noted = json.loads(_path_of_note().read_text(encoding="utf-8"))
        return {campaign: str(folder) for campaign, folder in noted.items()}
    return {}


def _path_of_note() -> Path:
    """Return the file, outside of any campaign, that notes which campaign has its results where."""
    return user_cache() / "results-at.json"
