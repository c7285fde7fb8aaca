"""The ``rftfit`` command: the list of commands, and the one place where errors become messages."""

from __future__ import annotations

import contextlib
import io
import sys
from typing import Annotated

import typer

import rftfit
from rftfit.cli import exit_codes
from rftfit.cli.check import check
from rftfit.cli.crash import crash_message, quiet_standard_output
from rftfit.cli.inspect_log import inspect_log
from rftfit.cli.new import init
from rftfit.cli.output import say, warn
from rftfit.cli.reenact import reenact
from rftfit.cli.run import run
from rftfit.cli.scale import scale
from rftfit.errors import RftfitError

# one paragraph per code: the help joins the lines of a paragraph
_EPILOG = "\n\n".join(
    [
        "Example: rftfit reenact && rftfit run",
        "Exit codes:",
        *(f"{code}: {meaning}" for code, meaning in exit_codes.MEANINGS.items()),
    ]
)

app = typer.Typer(
    name="rftfit",
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_EPILOG,
)
app.command("init", epilog="Example: rftfit init my_campaign")(init)
app.command("check", epilog="Example: rftfit check --config config/config.yaml")(check)
app.command(
    "inspect", epilog="Example: rftfit inspect raw/paper/air/air_c_leg_force.csv --plot log.png"
)(inspect_log)
app.command(
    "reenact", epilog="Example: rftfit reenact --media poppy_LP --fault gap --fault saturated"
)(reenact)
app.command(
    "run",
    epilog="Example: rftfit run --cores 2\n\n"
    "Example with words for Snakemake itself, after two dashes: rftfit run -- --forceall",
)(run)
app.command("scale", epilog="Example: rftfit scale --alpha 0.9 --se 0.02 --output sand.csv")(scale)


def _show_version(wanted: bool) -> None:
    if wanted:
        say(f"rftfit {rftfit.__version__}")
        raise typer.Exit


@app.callback()
def _top(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and stop."
        ),
    ] = False,
) -> None:
    """Force-transducer logs to resistive-force models of granular media, with honest intervals.

    New here? `rftfit reenact` writes a demonstration campaign, `rftfit run` makes everything out of
    it. For a campaign of your own: `rftfit init`, `rftfit check`, `rftfit run`.
    """


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
        warn(f"rftfit: {error}")
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort) as error:
        warn(str(error) or "Stopped.")
        return exit_codes.INTERRUPTED
    except BrokenPipeError:
        quiet_standard_output()
        return exit_codes.PIPE_CLOSED
    except Exception as error:  # noqa: BLE001
        with contextlib.suppress(OSError):
            warn(crash_message(error, words))
        return exit_codes.UNEXPECTED
    return code


def _invoke(words: list[str]) -> int:
    """Run one command; a word it does not understand is shown with how it is to be used."""
    command = typer.main.get_command(app)
    try:
        with command.make_context("rftfit", words) as context:
            command.invoke(context)
    except typer.Exit as stop:
        return int(stop.exit_code)
    except Exception as error:
        # a usage error; its class has changed its home between versions of typer
        if not (hasattr(error, "format_message") and hasattr(error, "show")):
            raise
        error.show()
        return exit_codes.INPUT_NOT_VALID
    return exit_codes.FINE


if __name__ == "__main__":
    sys.exit(main())
