"""Everything that is wrong with a campaign before it is run: configuration, run sheet, logs, robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.campaign.load import Campaign, check_campaign
from rftfit.campaign.problems import Place, Problem
from rftfit.errors import InputError
from rftfit.measure.readable import open_logs
from rftfit.robot.tracks import RobotCheck, check_robot

if TYPE_CHECKING:
    from rftfit.compare.protocol import PlanPower


@dataclass(frozen=True)
class Checked:
    """What was found: every problem; the campaign, unless its config or run sheet cannot be used; the robot.

    `not_opened`: Runs with a log that is too large to be opened here. `plan`: what runs without a log could tell.
    """

    problems: list[Problem]
    campaign: Campaign | None
    robot: RobotCheck
    not_opened: int
    plan: tuple[PlanPower, ...] = ()

    @property
    def errors(self) -> int:
        """How many of the problems are errors; the others are warnings."""
        return sum(problem.severity == "error" for problem in self.problems)


def check_all(config: Path) -> Checked:
    """Check a campaign; logs are measured as the run does, where nothing else is an error."""
    campaign, problems = check_campaign(config)
    robot = check_robot(config)
    checked = Checked([*problems, *robot.problems], campaign, robot, 0)
    if campaign is not None and any(map(campaign.plates_to_measure, campaign.media_with_runs)):
        # the joint model is slow to import
        from rftfit.compare.protocol import rate_plan

        checked = replace(checked, plan=tuple(rate_plan(campaign)))
    if campaign is None or checked.errors:
        return checked
    try:
        opened = open_logs(campaign)
    except InputError as error:
        unread = Problem("logs.reader", Place(config.name), None, str(error))
        return replace(checked, problems=[*checked.problems, unread])
    of_logs = [problem for logs_of_medium in opened for problem in logs_of_medium.problems]
    passed_over = sum(logs_of_medium.passed_over for logs_of_medium in opened)
    return replace(checked, problems=[*checked.problems, *of_logs], not_opened=passed_over)
