"""``rftfit check``: options, and when it ends with exit code 2; the checks are `rftfit.workflow.check`."""

from __future__ import annotations

from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.exit_codes import INPUT_NOT_VALID
from rftfit.cli.output import print_answer
from rftfit.workflow.check import check_all


def check(
    config: options.ConfigFile = options.CONFIG,
    strict: Annotated[
        bool, typer.Option("--strict", help="Count warnings and failed checks as errors.")
    ] = False,
    diagnose: Annotated[
        bool,
        typer.Option(
            "--diagnose", help="Check, too, whether the numbers of the logs can be believed."
        ),
    ] = False,
    as_json: options.AsJson = False,
) -> None:
    """Check configuration, run sheet and logs, and the robot's file, sheet and tracks; print every problem at once.

    Every log of up to 20 MB is measured as `rftfit run` measures it. With --diagnose the physical checks of `rftfit run` are made, and what
    fails is told with its likely cause. Ends with exit code 2 when there are errors, with 0 when there are only warnings and
    failed checks.
    """
    checked = check_all(config, diagnose=diagnose)
    print_answer(checked, as_json)
    # numbers: 0, or None where no physical check was made, is no doubt
    found_doubts = checked.warnings or checked.failed_checks
    if checked.campaign is None or checked.errors or (strict and found_doubts):
        raise typer.Exit(INPUT_NOT_VALID)
