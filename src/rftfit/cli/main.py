"""The entry point of ``rftfit``: the one place where errors become messages and exit codes."""

from __future__ import annotations

import contextlib
import errno
import io
import sys

from rftfit.cli import exit_codes
from rftfit.cli.crash import crash_message, quiet_standard_output
from rftfit.errors import RftfitError

_REFUSALS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Of a disk, when something is to be written; results themselves are written by `rftfit.store`."""


def main(argv: list[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : list of str, optional
        Words after the program's name; default: those of this process.

    Returns
    -------
    int
        One of `rftfit.cli.exit_codes`. Errors become messages on standard error; a traceback is
        never shown.
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
        return _say_why(f"rftfit: {error}", error.exit_code)
    except KeyboardInterrupt as error:
        return _say_why(str(error) or "Stopped.", exit_codes.INTERRUPTED)
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

    from rftfit.cli.app import app

    command = typer.main.get_command(app)
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


if __name__ == "__main__":
    sys.exit(main())
