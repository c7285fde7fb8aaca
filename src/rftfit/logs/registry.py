"""The dialects there are, and which one a file is of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.logs.rig import RigDialect

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.logs.base import Dialect

DIALECTS: dict[str, Dialect] = {dialect.name: dialect for dialect in (RigDialect(),)}

HEAD_BYTES = 65536


def dialect(name: str) -> Dialect:
    """Return the reader of that name.

    Parameters
    ----------
    name : str

    Returns
    -------
    Dialect

    Raises
    ------
    InputError
        If there is none; the message lists those there are.
    """
    try:
        return DIALECTS[name]
    except KeyError:
        known = ", ".join(sorted(DIALECTS))
        raise InputError(f"no log dialect {name!r}; allowed: {known}") from None


def detect(path: Path) -> Dialect | None:
    """Tell from its content which dialect a file is of.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Dialect or None
        None when no reader knows it.

    Raises
    ------
    InputError
        If the file cannot be opened.
    """
    try:
        with path.open("rb") as handle:
            head = handle.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be opened: {error.strerror}") from error
    return next((reader for reader in DIALECTS.values() if reader.detect(head)), None)
