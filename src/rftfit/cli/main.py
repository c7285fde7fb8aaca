"""The entry point of ``rftfit``: which error becomes which message and exit code; the report of an unexpected one."""

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
from collections.abc import Callable
from pathlib import Path

from rftfit.cli import exit_codes
from rftfit.errors import RftfitError
from rftfit.version import __version__

# at the end the interpreter would search all modules for garbage: a tenth of the time of a short
# command
atexit.register(gc.freeze)

# --- What a user sees of an error that the program did not expect: two lines and a file to send.


CRASH_FILE = "rftfit-crash-"
"""Beginning of the name of a report; the rest is random, so that nobody else can have put a link there."""


_LONGEST = 300
"""Most characters of an unexpected error that are shown; the report has all."""


def crash_message(error: BaseException, words: list[str]) -> str:
    """Write the report of an unexpected error to a file; return a message with the error and the file's path.

    `words`: Command line, without ``rftfit``.
    """
    error_text = " ".join(str(error).split()) or "no further text"
    if len(error_text) > _LONGEST:
        error_text = f"{error_text[:_LONGEST]}..."
    message = f"Unexpected error: {type(error).__name__}: {error_text}\n"
    report = (
        f"rftfit {__version__}, Python {platform.python_version()}, {platform.platform()}\n"
        f"command: rftfit {' '.join(words)}\n\n{quoted_traceback(error)}"
    )
    path = _write_crash_report(report)
    if path is None:
        return f"{message}The full report could not be written anywhere."
    return (
        f"{message}This is a fault of rftfit or of its installation; the full report, to be sent "
        f"with a question, is in\n  {path}"
    )


def quoted_traceback(error: BaseException) -> str:
    """Format the traceback of an error and of the errors that led to it, the first one first.

    Texts of errors are quoted, because they may hold cells of files that strangers have written.
    """
    # as Python does: the stated cause, else the error that was being handled, unless `from None` hides it
    cause = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    earlier = f"{quoted_traceback(cause)}\n" if cause else ""
    calls = "".join(traceback.format_tb(error.__traceback__))
    return f"{earlier}Traceback (most recent call last):\n{calls}{type(error).__name__}: {str(error)!r}\n"


def _write_crash_report(text: str) -> Path | None:
    """Write the report into the user's cache, or else a temporary folder; return its path, None where neither can be written.

    It is never written into the current folder, which somebody else may have filled.
    """
    # seldom needed
    from rftfit.store.environment import user_cache
    from rftfit.store.files import write_report

    find_folder: Callable[[], str | Path]
    for find_folder, subfolder in ((user_cache, "crashes"), (tempfile.gettempdir, "")):
        # to find a folder may fail, too
        with contextlib.suppress(OSError, ValueError):
            return write_report(Path(find_folder(), subfolder), CRASH_FILE, text)
    return None


def quiet_standard_output() -> None:
    """Direct standard output to the null device: the interpreter flushes it once more at its end, which would fail."""
    # standard output that is no file has no number and is not flushed at the end
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# --- The entry point of ``rftfit``: the one place where errors become messages and exit codes.


_REFUSALS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Numbers of system errors of a disk that refuses to be written to; errors of results are raised by `rftfit.store`."""


STOPPED = "Stopped. Files are written whole or not at all; to go on, give the same command again."


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit code (`exit_codes.MEANINGS`); an error becomes a message on standard error.

    `argv`: Words after ``rftfit``; default: those of this process.
    """
    words = sys.argv[1:] if argv is None else list(argv)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # a file name that the terminal cannot show must not stop the program
            stream.reconfigure(errors="backslashreplace")
    try:
        code = _invoke(words or ["--help"])
        sys.stdout.flush()
    except RftfitError as error:
        return _report_error(f"rftfit: {error}", error.exit_code)
    except KeyboardInterrupt as error:
        return _report_error(str(error) or STOPPED, exit_codes.INTERRUPTED)
    # whoever read the output, such as `head`, has stopped
    except BrokenPipeError:
        quiet_standard_output()
        return exit_codes.PIPE_CLOSED
    except OSError as error:
        if error.errno not in _REFUSALS:
            return _report_error(crash_message(error, words), exit_codes.UNEXPECTED)
        quiet_standard_output()
        target = error.filename or "standard output"
        return _report_error(
            f"rftfit: {target}: cannot write: {error.strerror}; free some space or write elsewhere, "
            "then run again",
            exit_codes.OUTPUT_NOT_WRITTEN,
        )
    except Exception as error:  # noqa: BLE001
        return _report_error(crash_message(error, words), exit_codes.UNEXPECTED)
    return code


def _report_error(message: str, code: int) -> int:
    """Print a message to standard error, and return the exit code."""
    # where standard error cannot be written either, the exit code alone is left
    with contextlib.suppress(OSError):
        sys.stderr.write(f"{message}\n")
    return code


def _invoke(words: list[str]) -> int:
    """Run the command that `words` name and return its exit code; a wrong option is shown with the command's usage."""
    # imported here, so that a damaged installation ends in a message, too
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
        # a usage error: known by its methods, as its class is in another package from version to
        # version of typer
        if not (hasattr(error, "format_message") and hasattr(error, "show")):
            raise
        error.show()
        return exit_codes.INPUT_NOT_VALID
    return exit_codes.FINE
