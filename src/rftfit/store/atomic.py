"""Files appear whole or not at all: written beside the target, then moved over it."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def atomic_path(target: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the target's folder; move it over the target on success.

    Parameters
    ----------
    target : str or Path
        The file to appear. Its folder is made if need be.

    Yields
    ------
    Path
        Write here. The suffix is the target's own, for writers that look at it.

    Raises
    ------
    OutputError
        If the folder or the file cannot be written (read-only, full disk); nothing is left behind.
    """
    target = Path(target)
    # the process id keeps two jobs apart; a fixed name lets a later run overwrite a killed one's rest
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise OutputError(
            f"{target}: cannot write: {error.strerror or error}. Nothing was left half-written; "
            "free some space or allow writing there, then run again."
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_bytes(target: str | Path, data: bytes) -> None:
    """Write `data` to `target` atomically.

    Parameters
    ----------
    target : str or Path
    data : bytes

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    with atomic_path(target) as path:
        path.write_bytes(data)


def write_text(target: str | Path, text: str) -> None:
    r"""Write `text` as UTF-8 with ``\\n`` line ends to `target` atomically.

    Parameters
    ----------
    target : str or Path
    text : str

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_bytes(target, text.encode("utf-8"))
