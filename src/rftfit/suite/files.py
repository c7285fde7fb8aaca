"""Where the files of an example come from: shipped, copied or downloaded, checked by digest, all files or none.

An example is recorded data, known by the SHA-256 that its ``example.yaml`` states, with files of a campaign that reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from rftfit.campaign.problems import join_words
from rftfit.errors import InputError
from rftfit.store import copy_file, write_text
from rftfit.store.digests import sha256_of
from rftfit.store.environment import shipped
from rftfit.store.links import refuse_links, refuse_target_by_link
from rftfit.suite.declared import Example, ExampleFile

RAW = "raw"
"""Folder of the data in the folder of an example."""
_MOST_NAMED = 5
"""Most files or problems that a message names."""


def lay_out(
    example: Example, folder: Path, origin: str | None, say: Callable[[str], None]
) -> list[ExampleFile]:
    """Write data, campaign and copies of an example into a folder; files that are there and right stay.

    Nothing is written before every file is available with its published digest.

    Parameters
    ----------
    example : Example
    folder : Path
    origin : str or None
        A folder that has the data in it or below, or the address of a mirror; None: the addresses of the example.
    say : callable
        Called with a line of text for each download.

    Returns
    -------
    list of ExampleFile
        Files that were written.

    Raises
    ------
    InputError
        If a file is absent, differs or cannot be downloaded.
    OutputError
        If the folder cannot be written.
    """
    settings = example.settings
    if folder.resolve() == example.folder.resolve():
        raise InputError(f"{folder}: this is the example itself; name another folder to run it in")
    paths = {file.name: folder / RAW / file.name for file in settings.files}
    names = [f"{RAW}/{name}" for name in paths]
    refuse_target_by_link(folder)
    refuse_links(folder, [*names, *settings.campaign, *settings.copied])
    lacking = [file for file in settings.files if not _is_as_published(paths[file.name], file)]
    # these are another file's bytes, perhaps of the user: they are not overwritten
    wrong = [str(paths[file.name]) for file in lacking if paths[file.name].exists()]
    if wrong:
        raise InputError(
            f"{join_words(wrong, _MOST_NAMED)}: not as published (another sha256); move what is there away, and run again"
        )
    with TemporaryDirectory(prefix="rftfit-example-") as downloads:
        sources = _find_sources(example, lacking, origin, Path(downloads), say)
        for file in lacking:
            copy_file(sources[file.name], paths[file.name])
    # a campaign's file that is there may have been edited, and stays
    contents = {
        name: shipped(source).read_text(encoding="utf-8")
        for name, source in settings.copied.items()
    }
    for name, content in {**contents, **settings.campaign}.items():
        if not (folder / name).exists():
            write_text(folder / name, content)
    return lacking


def _is_as_published(path: Path, file: ExampleFile) -> bool:
    """Return True if there is a file at `path` with the size and SHA-256 of the published one."""
    return path.is_file() and path.stat().st_size == file.size and sha256_of(path) == file.sha256


def _find_sources(
    example: Example,
    lacking: Sequence[ExampleFile],
    origin: str | None,
    downloads: Path,
    say: Callable[[str], None],
) -> dict[str, Path]:
    """Find or download the files that are lacking; return where each is, by name.

    A file that is shipped with the example is taken first. `origin`, `say`: As in `lay_out`. `downloads`: Folder for
    downloads.
    """
    sources = {
        file.name: example.folder / file.name
        for file in lacking
        if file.may_be_shipped and _is_as_published(example.folder / file.name, file)
    }
    not_shipped = [file for file in lacking if file.name not in sources]
    if origin is not None and "://" not in origin:
        return sources | _find_in_folder(Path(origin), not_shipped)
    for number, file in enumerate(not_shipped, start=1):
        address = file.address if origin is None else f"{origin.rstrip('/')}/{file.name}"
        say(f"  {number} of {len(not_shipped)}: {file.name}")
        sources[file.name] = _download(address, file, downloads)
    return sources


def _find_in_folder(folder: Path, files: Sequence[ExampleFile]) -> dict[str, Path]:
    """Return the paths of published files in a folder or below, by name; one error names all that are absent or different."""
    if not folder.is_dir():
        raise InputError(
            f"--from: {folder} is no folder; allowed: a folder with the data, or an address"
        )
    sources: dict[str, Path] = {}
    problems = []
    for file in files:
        # where it should lie, then any file below with its name
        paths = [folder / file.name, *sorted(folder.rglob(Path(file.name).name))]
        candidates = [path for path in paths if path.is_file()]
        published = [path for path in candidates if _is_as_published(path, file)]
        if published:
            sources[file.name] = published[0]
        elif candidates:
            size = candidates[0].stat().st_size
            fault = "another sha256" if size == file.size else f"{size} bytes of {file.size}"
            problems.append(f"{candidates[0]}: not as published: {fault}")
        else:
            problems.append(f"no {file.name} in {folder} or below")
    if problems:
        further = len(problems) - _MOST_NAMED
        raise InputError(
            f"--from: {'; '.join(problems[:_MOST_NAMED])}"
            f"{f'; and {further} more' if further > 0 else ''}. Nothing was written."
        )
    return sources


def _download(address: str, file: ExampleFile, downloads: Path) -> Path:
    """Download a file into the folder `downloads`, check its digest and return its path; raise InputError if this fails."""
    import pooch  # slow to import, and seldom needed

    pooch.get_logger().setLevel("ERROR")
    try:
        name = file.sha256
        return Path(pooch.retrieve(address, f"sha256:{file.sha256}", fname=name, path=downloads))
    except Exception as error:
        # the libraries below raise errors of many kinds: of the network, of the protocol, of the digest
        why = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
        raise InputError(
            f"{address}: cannot be downloaded as published ({why}). Nothing was written. Without a connection, give a "
            "folder that has the data: --from DIR"
        ) from error
