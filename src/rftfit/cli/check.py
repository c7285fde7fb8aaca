"""``rftfit check``: everything that is wrong with config and run sheet, or what the campaign holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.exit_codes import INPUT_NOT_VALID
from rftfit.cli.output import count, megabytes, say, table

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.problems import Problem
    from rftfit.robot.check import Checked

_KINDS = ("plate", "rod", "leg", "leg_air")


def check(
    config: Annotated[Path, typer.Option(help="The campaign's configuration.")] = Path(
        "config/config.yaml"
    ),
    strict: Annotated[bool, typer.Option("--strict", help="Count warnings as errors.")] = False,
) -> None:
    """Check configuration, run sheet and logs, and the robot's file, sheet and tracks; print every problem at once.

    Ends with exit code 2 when there are errors, with 0 when there are warnings only.
    """
    from rftfit.campaign.load import check_campaign
    from rftfit.robot.check import check_robot

    campaign, problems = check_campaign(config)
    robot = check_robot(config)
    problems = [*problems, *robot.problems]
    errors = _print_problems(problems, "error")
    warnings = _print_problems(problems, "warning")
    if campaign is not None:
        say(summary(campaign))
        if robot.medium:
            say(of_robot(robot))
        say()
    say(f"{count(errors, 'error')}, {count(warnings, 'warning')}.")
    if campaign is None or errors or (strict and warnings):
        raise typer.Exit(INPUT_NOT_VALID)


def _print_problems(problems: list[Problem], severity: str) -> int:
    chosen = [problem for problem in problems if problem.severity == severity]
    if chosen:
        say(f"{count(len(chosen), severity)}:")
        for problem in chosen:
            say(f"  {problem}")
        say()
    return len(chosen)


def summary(campaign: Campaign) -> str:
    """Describe a campaign: runs and logs of each medium.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    str
        A heading and a table.
    """
    sizes = log_sizes(campaign)
    rows = []
    total = 0
    for medium in (*campaign.media_with_runs, ""):
        if not medium and "" not in {run.medium for run in campaign.runs}:
            continue
        runs = [run for run in campaign.runs if run.medium == medium]
        found = [sizes[file] for run in runs for file in (run.force_log, run.motion_log)]
        there = [size for size in found if size is not None]
        total += sum(there)
        rows.append(
            [
                medium or "(in air)",
                *(str(sum(run.kind == kind for run in runs)) for kind in _KINDS),
                str(sum(run.excluded for run in runs)),
                str(len(there)),
                str(len(found) - len(there)),
                f"{sum(there) / 1e6:.1f}",
            ]
        )
    header = ["medium", *_KINDS, "excluded", "logs", "missing", "MB"]
    title = campaign.config.title
    runs_and_logs = f"{count(len(campaign.runs), 'run')}, {count(len(sizes), 'log')}"
    return f"{title}: {runs_and_logs}, {megabytes(total)}\n{table(header, rows)}"


def of_robot(robot: Checked) -> str:
    """Describe the campaign's robot.

    Parameters
    ----------
    robot : Checked

    Returns
    -------
    str
        One line.
    """
    trials = robot.trials
    if not trials:
        return f"robot on {robot.medium}: no trials of its own"
    conditions = len({trial.condition for trial in trials})
    return f"robot on {robot.medium}: {count(len(trials), 'trial')} of {count(conditions, 'condition')}"


def log_sizes(campaign: Campaign) -> dict[str, int | None]:
    """Sizes of all logs that the run sheet names.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    dict of str to int or None
        Path relative to the raw folder to bytes; None where there is no such file.
    """
    names = [name for run in campaign.runs for name in (run.force_log, run.motion_log)]
    sizes: dict[str, int | None] = {}
    for name in names:
        try:
            sizes[name] = (campaign.raw / name).stat().st_size
        except OSError:
            sizes[name] = None
    return sizes
