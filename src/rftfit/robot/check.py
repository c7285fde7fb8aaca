"""Everything that is wrong with a campaign's robot: its own file, its sheet, the tracks in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.campaign.configfile import read_config
from rftfit.campaign.files import Folder, plain_path
from rftfit.campaign.load import root_of
from rftfit.campaign.problems import CampaignError, Problem
from rftfit.campaign.table import read_table
from rftfit.robot.configfile import read_robot
from rftfit.robot.sheet import Trial, read_trials

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from rftfit.campaign.config import RobotRuns


@dataclass(frozen=True)
class Checked:
    """What was found.

    Attributes
    ----------
    medium : str
        The one that the robot runs on; empty where the campaign has no robot.
    trials : tuple of Trial
        Rows of its sheet without an error.
    problems : tuple of Problem
        Errors, and a warning for each track that is not there: such a trial is dropped.
    """

    medium: str = ""
    trials: tuple[Trial, ...] = ()
    problems: tuple[Problem, ...] = ()


def check_robot(config: Path) -> Checked:
    """Check the robot of a campaign, whatever else is wrong with the campaign.

    Parameters
    ----------
    config : Path
        ``config.yaml``. Errors of its own are not repeated; files that its section ``robot`` names
        and that are not there are errors of the configuration too (`rftfit.campaign.load`).

    Returns
    -------
    Checked
    """
    root = root_of(config)
    file, _ = read_config(config, config.name)
    section = file.config.robot if file.config is not None else None
    if file.config is None or section is None:
        return Checked()
    runs, media = _of_campaign(root, file.config.run_sheet)
    # a campaign without runs on its medium (a part of a re-enactment) has no robot either
    if media and section.medium not in media:
        return Checked()
    problems = _own_file(root, section)
    if section.runs is None:
        return Checked(section.medium, (), tuple(problems))
    raw, (sheet, fault, _) = root / file.config.raw, plain_path(section.runs)
    if fault or Folder(raw).status(sheet) != "file":
        return Checked(section.medium, (), tuple(problems))
    name = f"{file.config.raw.rstrip('/')}/{sheet}"
    trials, found = read_trials(raw / sheet, name, section.medium, runs)
    problems += found
    problems += _tracks(trials, raw, sheet, name)
    ordered = sorted(problems, key=lambda one: (one.file, one.row or 0))
    return Checked(section.medium, tuple(trials), tuple(ordered))


def _of_campaign(root: Path, run_sheet: str) -> tuple[set[str], set[str]]:
    """Names of runs and media in the campaign's own sheet, right or wrong."""
    path, fault, _ = plain_path(run_sheet)
    if fault or Folder(root).status(path) != "file":
        return set(), set()
    table, _ = read_table(root / path, path)
    if table is None:
        return set(), set()
    at = {name: place for place, name in enumerate(table.header)}
    cells = {
        name: {row[at[name]] for _, row in table.rows if at[name] < len(row)} if name in at else set()
        for name in ("run_id", "medium")
    }  # fmt: skip
    return cells["run_id"] - {""}, cells["medium"] - {""}


def _own_file(root: Path, section: RobotRuns) -> list[Problem]:
    path, fault, _ = plain_path(section.file or "")
    if section.file is None or fault or Folder(root).status(path) != "file":
        return []
    try:
        read_robot(root / path, path)
    except CampaignError as error:
        return list(error.problems)
    return []


def _tracks(trials: Iterable[Trial], raw: Path, sheet: str, name: str) -> list[Problem]:
    inside = Folder(raw)
    above = sheet.rpartition("/")[0]
    found = []
    for trial in trials:
        path = f"{above}/{trial.track}" if above else trial.track
        status = inside.status(path)
        if status == "file":
            continue
        outside = status == "outside"
        allowed = (
            "a file inside the raw folder; a link leads out of it"
            if outside
            else "a file that exists; the trial is dropped while its track is missing"
        )
        found.append(
            Problem(
                name, trial.row, "track", trial.track, allowed,
                "robot-sheet.track-outside" if outside else "robot-sheet.track-missing",
                "error" if outside else "warning",
                nearest=None if outside else _beside(inside.nearest(path), above),
            )
        )  # fmt: skip
    return found


def _beside(path: str | None, above: str) -> str | None:
    """Write a path as the sheet would, from the sheet's own folder."""
    return path.removeprefix(f"{above}/") if path and above else path
