"""``rftfit diff``: options of the comparison of two folders of results, which is `rftfit.workflow.diff`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import print_answer


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

    print_answer(compare_folders(first, second), as_json, None if all_ else 10)
