"""``rftfit inspect``: options of the description of a log, and its picture; `rftfit.logs.inspection` describes it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import check_picture, print_answer, print_line, write_picture
from rftfit.errors import InputError

_DRAWN = "drawn by rftfit inspect"
"""Mark in a figure: only figures with it are overwritten unasked."""


def inspect_log(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A force log or a motion log.")],
    plot: Annotated[
        Path | None,
        options.word_option("FILE.png", "Draw all columns against time into this file."),
    ] = None,
    dialect: Annotated[
        str | None, options.word_option("NAME", "Read it as this dialect, whatever it looks like.")
    ] = None,
    option: Annotated[
        list[str] | None,
        options.word_option("KEY=VALUE", "An option of the dialect, as in the config."),
    ] = None,
    force: options.Overwrite = False,
    as_json: options.AsJson = False,
) -> None:
    """Show what a log is: dialect, columns and units, clock, resolution, damage, what it lacks.

    The log is only read. The last lines are what config.yaml needs for such logs. Dialects: the
    rig's csv pair, ATI Net F/T, ATI through NI DAQ, rostopic csv, LabVIEW, Instron-style exports,
    xlsx, Parquet and others; any other delimited text is described in the config.
    """
    from rftfit.logs.inspect import recording
    from rftfit.logs.inspection import inspect_file

    log = recording(log)
    check_picture(plot, _DRAWN, force, "--plot")
    inspection = inspect_file(log, dialect, dict(map(_read_option, option or ())))
    print_answer(inspection, as_json)
    if plot is not None:
        from rftfit.figures.log_plot import plot_log

        write_picture(plot, plot_log(inspection.recognition.reader, inspection.surveys), _DRAWN)
        if not as_json:
            print_line(f"\nDrawing: {plot}")


def _read_option(pair: str) -> tuple[str, str | float]:
    """Read KEY=VALUE, an option of a dialect; the value is true or false, a number, or a word, as YAML would read it."""
    key, equals, value = pair.partition("=")
    if not equals:
        raise InputError(f"--option: found {pair!r}; allowed: KEY=VALUE")
    if value.casefold() in ("true", "false"):
        return key, value.casefold() == "true"
    for number in (int, float):
        with suppress(ValueError):
            return key, number(value)
    return key, value
