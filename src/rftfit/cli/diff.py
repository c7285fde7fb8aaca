"""``rftfit diff``: tells which numbers of two folders of results differ, and what may be the cause."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import json_text, print_line

_MOST = 10
"""Most numbers that are listed without --all."""


def diff(
    first: Annotated[
        Path, typer.Argument(metavar="A", help="A campaign, or a copy of its results.")
    ],
    second: Annotated[Path, typer.Argument(metavar="B", help="The same, made later or otherwise.")],
    all_: Annotated[bool, typer.Option("--all", help="List every number that changed.")] = False,
    as_json: options.AsJson = False,
) -> None:
    """Compare two folders of results: alpha, coefficients, zeta and peaks of legs.

    A change is counted in half widths of the first interval. zeta and alpha_z(0, 90 deg) come first, numbers without an interval last. Logs, rows of the run sheet, settings,
    code and versions that are different are listed: one of them is the cause.
    """
    from rftfit.workflow.diff import compare_folders

    comparison = compare_folders(first, second)
    if as_json:
        print_line(json_text(comparison.as_dict()))
    else:
        print_line(comparison.summary(None if all_ else _MOST))
