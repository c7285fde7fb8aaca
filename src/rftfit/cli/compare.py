"""``rftfit compare``: options of the comparison of two media, sessions or folders; its figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_picture, print_answer, print_line, write_picture

_DRAWN = "drawn by rftfit compare"
"""Mark in a figure: only figures with it are overwritten unasked."""


def compare(
    first: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="Medium of the campaign in this folder, FOLDER:MEDIUM, FOLDER with one medium, or one of these with "
            "@LABEL for a session; or a profile file of rftfit export, or published:MEDIUM.",
        ),
    ],
    second: Annotated[str, typer.Argument(metavar="B", help="The same.")],
    confidence: options.Level = 0.95,
    figure: Annotated[Path | None, options.file_option("Also a figure: png, svg or pdf.")] = None,
    all_: Annotated[bool, typer.Option("--all", help="List every common direction.")] = False,
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Tell whether two media, two sessions or two folders of results differ, in size and in shape.

    Compares single runs in common directions. Prints the ratio of sizes and the difference of shape, each with its
    interval and p value, and the least differences that these runs would show.
    """
    options.check_confidence(confidence)
    check_picture(figure, _DRAWN, force)
    comparison = rftfit.compare_media(first, second, confidence)
    print_answer(comparison, as_json, None if all_ else 5)
    if figure is not None:
        from rftfit.figures.comparison import draw_comparison

        write_picture(figure, draw_comparison(comparison), _DRAWN)
        if not as_json:
            print_line(f"Figure: {figure}")
