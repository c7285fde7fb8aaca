"""``rftfit check``: everything that is wrong with config and run sheet, or what the campaign holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.main import INPUT_NOT_VALID
from rftfit.cli.output import count, megabytes, say, table
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.problems import Problem
    from rftfit.robot.tracks import Checked


# --- The config alone, and where its raw folder and run sheet lie: they may not exist yet.


@dataclass(frozen=True)
class Places:
    """A checked configuration and its folders.

    `root`: The campaign's folder.
    `raw`, `sheet`: Inside the root; need not exist.
    """

    config: Config
    root: Path
    raw: Path
    sheet: Path


def campaign_root(config_path: Path) -> Path:
    """Folder of a campaign: that of its config, or the one above where that is named ``config``.

    Returns absolute.
    """
    folder = config_path.absolute().parent
    return (folder.parent if folder.name == "config" else folder).resolve()


def read_places(config_path: Path) -> Places:
    """Read and check the configuration without its run sheet."""
    from rftfit.campaign.problems import CampaignError
    from rftfit.campaign.reading import read_config

    file, problems = read_config(config_path, config_path.as_posix())
    if file.config is None:
        raise CampaignError(problems)
    root = campaign_root(config_path)
    raw = _inside(root, "raw", file.config.raw)
    sheet = _inside(root, "run_sheet", file.config.run_sheet)
    if raw == root:
        raise InputError(
            f"{config_path}, key raw: found '{file.config.raw}'; allowed: a folder below the "
            "campaign's own"
        )
    return Places(file.config, root, raw, sheet)


def _inside(root: Path, key: str, written: str) -> Path:
    from rftfit.campaign.reading import plain_path

    path, fault, nearest = plain_path(written)
    whole = (root / path).resolve()
    if fault or not whole.is_relative_to(root):
        why = fault.partition(": ")[2] or "a link leads out of it"
        hint = f"; did you mean '{nearest}'?" if nearest else ""
        raise InputError(
            f"config, key {key}: found '{written}'; allowed: a path inside the campaign's folder; "
            f"{why}{hint}"
        )
    return whole


# --- ``rftfit check``: everything that is wrong with config and run sheet, or what the campaign holds.


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
    from rftfit.robot.tracks import check_robot

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

    Returns A heading and a table.
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

    Returns one line.
    """
    trials = robot.trials
    if not trials:
        return f"robot on {robot.medium}: no trials of its own"
    conditions = len({trial.condition for trial in trials})
    return f"robot on {robot.medium}: {count(len(trials), 'trial')} of {count(conditions, 'condition')}"


def log_sizes(campaign: Campaign) -> dict[str, int | None]:
    """Sizes of all logs that the run sheet names.

    Returns path relative to the raw folder to bytes; None where there is no such file.
    """
    names = [name for run in campaign.runs for name in (run.force_log, run.motion_log)]
    sizes: dict[str, int | None] = {}
    for name in names:
        try:
            sizes[name] = (campaign.raw / name).stat().st_size
        except OSError:
            sizes[name] = None
    return sizes
