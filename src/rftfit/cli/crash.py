"""What a user sees of an error that the program did not expect: two lines and a file to send."""

from __future__ import annotations

import platform
import sys
import tempfile
import traceback
from pathlib import Path

import rftfit

CRASH_FILE = "rftfit-crash.txt"

_LONGEST = 300


def crash_message(error: BaseException, words: list[str]) -> str:
    """Write the traceback of an unexpected error to a file, and say where it is.

    Parameters
    ----------
    error : BaseException
    words : list of str
        Of the command line, for the report.

    Returns
    -------
    str
        Message for standard error: the error in one line, and the file.
    """
    text = " ".join(str(error).split()) or "no further text"
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
    message = f"Unexpected error: {type(error).__name__}: {text}\n"
    path = _write(_report(error, words))
    if path is None:
        return f"{message}The full report could not be written anywhere."
    return (
        f"{message}This is a fault of rftfit or of its installation; the full report, to be sent "
        f"with a question, is in\n  {path}"
    )


def _report(error: BaseException, words: list[str]) -> str:
    head = (
        f"rftfit {rftfit.__version__}, Python {platform.python_version()}, {platform.platform()}\n"
        f"command: rftfit {' '.join(words)}\n\n"
    )
    return head + "".join(traceback.format_exception(error))


def _write(text: str) -> Path | None:
    """Write the report into the current folder, or where that cannot be written, a temporary one."""
    for find_folder in (Path.cwd, lambda: Path(tempfile.gettempdir())):
        try:
            path = find_folder() / CRASH_FILE
            path.write_text(text, encoding="utf-8", errors="backslashreplace")
        except (OSError, ValueError):
            continue
        return path
    return None


def quiet_standard_output() -> None:
    """Let the interpreter's last flush go nowhere, after the reader of a pipe has gone."""
    import os

    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
    except (OSError, ValueError):
        # standard output is no file here, so nothing is flushed at the end either
        return
