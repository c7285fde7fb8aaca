"""A file that a command is asked to write: never over one of somebody else's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.errors import InputError, OutputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def check_target(
    path: Path, mark: str, what: str, force: bool, inputs: Sequence[Path | None] = ()
) -> None:
    """Refuse a path whose file is not one of the command's own.

    Parameters
    ----------
    path : Path
    mark : str
        How the first line of the command's own files begins: only these are overwritten unasked.
    what : str
        What is to be written, for the message.
    force : bool
        Whether the user said that a file of somebody else's may be overwritten.
    inputs : sequence of Path or None, optional
        Files that are read: these are never overwritten.

    Raises
    ------
    InputError
        If there is a file that must stay.
    OutputError
        If it cannot be looked at, or is a folder.
    """
    if path.is_dir():
        raise OutputError(f"{path}: this is a folder; name a file for the {what}")
    try:
        with path.open("rb") as handle:
            ours = handle.read(len(mark)) == mark.encode()
    except FileNotFoundError:
        return
    except OSError as error:
        raise OutputError(f"{path}: cannot be looked at: {error.strerror or error}") from error
    if any(other is not None and other.exists() and other.samefile(path) for other in inputs):
        raise InputError(f"{path}: this file is read; name another for the {what} with --output")
    if not ours and not force:
        command = mark.removeprefix("# ").partition("written by ")[2]
        raise InputError(
            f"{path}: this file is there and was not written by {command}, so it is left as it is; "
            "name another with --output, or add --force to overwrite it"
        )
