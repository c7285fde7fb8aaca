"""Where an example's files come from: the package, a folder, a mirror, or the public repository."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import rftfit
from rftfit.cli.output import count, megabytes, say
from rftfit.errors import InputError, OutputError
from rftfit.store import atomic_path, write_bytes
from rftfit.store.manifest import read_sums, sha256_of

if TYPE_CHECKING:
    from collections.abc import Mapping

SUMS = "logs.sha256"
INSTALL = "pip install pooch"


@dataclass(frozen=True)
class Example:
    """One example: its own files, and where its logs are to be had.

    Parameters
    ----------
    name, title : str
    address : str
        Folder of the logs on the web, ending with a slash; pinned, so that it never changes.
    credit : str
        Who recorded them, and their licence.
    """

    name: str
    title: str
    address: str
    credit: str


EXAMPLES = {
    "cmu-sand": Example(
        "cmu-sand",
        "nine penetrations of circular plates into sand",
        "https://raw.githubusercontent.com/robomechanics/3d-terramechanics/"
        "55a6e92b35cb7a94530e47311fd7c4767fafb835/raw-data-processing/f-d-large-box/",
        "Catherine Pavlov and Aaron Johnson, Carnegie Mellon University, MIT licence",
    )
}


def own_files(name: str) -> Path:
    """Find the files of an example: at the top of a checkout, inside the package where installed.

    Parameters
    ----------
    name : str

    Returns
    -------
    Path
        Its folder.

    Raises
    ------
    InputError
        If it is not there.
    """
    package = Path(rftfit.__file__).resolve().parent
    for folder in (package.parents[1] / "examples" / name, package / "_examples" / name):
        if (folder / SUMS).is_file():
            return folder
    raise InputError(f"the files of the example {name} are not there; install rftfit again")


def lay_out(source: Path, folder: Path) -> None:
    """Copy configuration and run sheet into the folder; what is there is never overwritten.

    Parameters
    ----------
    source : Path
        From `own_files`.
    folder : Path

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    for file in sorted((source / "config").iterdir()):
        target = folder / "config" / file.name
        if not target.exists():
            write_bytes(target, file.read_bytes())


def fetch_logs(example: Example, source: Path, raw: Path, origin: str | None) -> None:
    """Bring the logs into the raw folder, each checked against its known sha256.

    Parameters
    ----------
    example : Example
    source : Path
        From `own_files`.
    raw : Path
        Logs that are there and are right stay as they are.
    origin : str or None
        A folder, or the address of a mirror; the public repository if not given.

    Raises
    ------
    InputError
        If a log cannot be had, or is not the one that is known.
    OutputError
        If it cannot be written.
    """
    sums = read_sums(source / SUMS)
    lacking = {name: digest for name, digest in sums.items() if not _is_right(raw / name, digest)}
    if not lacking:
        say(f"All {count(len(sums), 'log')} are there, checked against their sha256.")
        return
    wrong = [name for name in lacking if (raw / name).exists()]
    if wrong:
        raise InputError(
            f"{raw / wrong[0]}: not the log of that name (its sha256 differs), and "
            f"{count(len(wrong) - 1, 'other')} like it; move them away"
        )
    try:
        raw.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{raw}: cannot be made: {error.strerror}; allow writing there or name another folder"
        ) from error
    if origin is not None and "://" not in origin:
        _copy(Path(origin), raw, lacking)
    else:
        address = example.address if origin is None else origin.rstrip("/") + "/"
        _download(address, raw, lacking)
    size = sum((raw / name).stat().st_size for name in lacking)
    say(
        f"{count(len(lacking), 'log')}, {megabytes(size)}, from {origin or example.address}, "
        "checked against their sha256."
    )
    say(f"Recorded by {example.credit}.")


def _is_right(path: Path, digest: str) -> bool:
    return path.is_file() and sha256_of(path) == digest


def _copy(folder: Path, raw: Path, wanted: Mapping[str, str]) -> None:
    for name, digest in wanted.items():
        if not (folder / name).is_file():
            raise InputError(
                f"--from: no {name} in {folder}; allowed: a folder with all logs of the example"
            )
        if not _is_right(folder / name, digest):
            raise InputError(
                f"--from: {folder / name} is not the log of that name (sha256 differs)"
            )
        with atomic_path(raw / name) as part:
            shutil.copyfile(folder / name, part)


def _download(address: str, raw: Path, wanted: Mapping[str, str]) -> None:
    try:
        import pooch
    except ImportError:
        raise InputError(
            f"logs are downloaded with the package pooch; install it: {INSTALL}; or give a folder "
            "that has them: --from DIR"
        ) from None
    pooch.get_logger().setLevel("ERROR")
    known = {name: f"sha256:{digest}" for name, digest in wanted.items()}
    store = pooch.create(path=raw, base_url=address, registry=known, retry_if_failed=2)
    for place, name in enumerate(wanted, start=1):
        say(f"  {place} of {len(wanted)}: {name}")
        try:
            store.fetch(name)
        except (OSError, ValueError) as error:
            # the libraries below raise errors of many kinds, all of these two families
            raise InputError(
                f"{address}{name}: cannot be downloaded ({str(error).splitlines()[0][:200]}); without "
                "a connection, give a folder that has the logs: --from DIR"
            ) from error
