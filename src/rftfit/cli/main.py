"""The entry point of ``rftfit``: where errors become messages and exit codes."""

from __future__ import annotations

import os

# before numpy is imported: a command's matrices are small, and threads that wait for one another cost several times
# the processor time where other programs run
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import atexit
import contextlib
import errno
import gc
import io
import platform
import sys
import tempfile
import traceback
from pathlib import Path

from rftfit.cli import exit_codes
from rftfit.errors import RftfitError
from rftfit.version import __version__

# a tenth of a short command would be the interpreter's last look through modules for garbage
atexit.register(gc.freeze)

# --- What a user sees of an error that the program did not expect: two lines and a file to send.


CRASH_FILE = "rftfit-crash-"
"""Begin of the name of a report; the rest is drawn, so that nobody else has put a link there."""

_LONGEST = 300


def crash_message(error: BaseException, words: list[str]) -> str:
    """Write the traceback of an unexpected error to a file; the error in one line, and where it is."""
    text = " ".join(str(error).split()) or "no further text"
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
    message = f"Unexpected error: {type(error).__name__}: {text}\n"
    report = (
        f"rftfit {__version__}, Python {platform.python_version()}, {platform.platform()}\n"
        f"command: rftfit {' '.join(words)}\n\n{quoted_traceback(error)}"
    )
    path = _write(report)
    if path is None:
        return f"{message}The full report could not be written anywhere."
    return (
        f"{message}This is a fault of rftfit or of its installation; the full report, to be sent "
        f"with a question, is in\n  {path}"
    )


def quoted_traceback(error: BaseException) -> str:
    """Traceback of an error and of those behind it, whose texts, which may be a stranger's, are quoted."""
    behind = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    earlier = f"{quoted_traceback(behind)}\n" if behind else ""
    calls = "".join(traceback.format_tb(error.__traceback__))
    return f"{earlier}Traceback (most recent call last):\n{calls}{type(error).__name__}: {str(error)!r}\n"


def _write(text: str) -> Path | None:
    """Write the report into the user's own cache, or where that cannot be written, a temporary folder.

    Never into the current folder, which somebody else may have filled.
    """
    # seldom needed
    from rftfit.store.files import write_report

    for find_folder in (_own_cache, lambda: Path(tempfile.gettempdir())):
        try:
            return write_report(find_folder(), CRASH_FILE, text)
        except (OSError, ValueError):
            continue
    return None


def _own_cache() -> Path:
    """Folder of the user's cache for this program."""
    import pooch  # slow to import, and seldom needed

    return Path(pooch.os_cache("rftfit")) / "crashes"


def quiet_standard_output() -> None:
    """Let the interpreter's last flush go nowhere, after the reader of a pipe has gone."""
    # where standard output is no file, nothing is flushed at the end either
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# --- The entry point of ``rftfit``: the one place where errors become messages and exit codes.


_REFUSALS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Of a disk, when something is to be written; results themselves are written by `rftfit.store`."""


STOPPED = "Stopped. Files are written whole or not at all; to go on, give the same command again."


def main(argv: list[str] | None = None) -> int:
    """Run the command line; errors become messages on standard error and one of `MEANINGS`."""
    words = sys.argv[1:] if argv is None else list(argv)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # a file name that the terminal cannot show must not stop the program
            stream.reconfigure(errors="backslashreplace")
    try:
        code = _invoke(words or ["--help"])
        sys.stdout.flush()
    except RftfitError as error:
        return _say_why(f"rftfit: {error}", error.exit_code)
    except KeyboardInterrupt as error:
        return _say_why(str(error) or STOPPED, exit_codes.INTERRUPTED)
    except BrokenPipeError:
        quiet_standard_output()
        return exit_codes.PIPE_CLOSED
    except OSError as error:
        if error.errno not in _REFUSALS:
            return _say_why(crash_message(error, words), exit_codes.UNEXPECTED)
        quiet_standard_output()
        place = error.filename or "standard output"
        return _say_why(
            f"rftfit: {place}: cannot write: {error.strerror}; free some space or write elsewhere, "
            "then run again",
            exit_codes.OUTPUT_NOT_WRITTEN,
        )
    except Exception as error:  # noqa: BLE001
        return _say_why(crash_message(error, words), exit_codes.UNEXPECTED)
    return code


def _say_why(message: str, code: int) -> int:
    # nothing is left to be done where standard error cannot be written either
    with contextlib.suppress(OSError):
        sys.stderr.write(f"{message}\n")
    return code


def _invoke(words: list[str]) -> int:
    """Run one command; a word it does not understand is shown with how it is to be used."""
    # here, so that a damaged installation too ends in a message
    import typer

    from rftfit.cli.app import make_command

    command = make_command()
    try:
        with command.make_context("rftfit", words) as context:
            command.invoke(context)
    except typer.Exit as stop:
        return int(stop.exit_code)
    except typer.Abort:
        raise KeyboardInterrupt from None
    except Exception as error:
        # a usage error; its class has changed its home between versions of typer
        if not (hasattr(error, "format_message") and hasattr(error, "show")):
            raise
        error.show()
        return exit_codes.INPUT_NOT_VALID
    return exit_codes.FINE
