"""What the results of a campaign depend on outside of ``results/``: logs, robot, rows of the run sheet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rftfit.campaign.files import BAG

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.store.digests import Seen

# the number of a row, and what nobody computes with
_LEFT_OUT = ("row", "note")


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """Logs that a medium is measured from, relative to the raw folder; some may not exist.

    `medium`: Empty for the runs that belong to none.
    """
    runs = campaign.runs_of(medium) if medium else campaign.unclaimed
    names = {name for run in runs for name in (run.force_log, run.motion_log, run.zero_log)} - {""}
    contact = campaign.config.rigid_contact
    if contact is not None and medium:
        names |= {contact.force_log, contact.motion_log}
    if names and campaign.config.force_log.calibration is not None:
        names.add(campaign.config.force_log.calibration)
    bags = [name.removesuffix(BAG) for name in names if name.endswith(f"/{BAG}")]
    parts = (bag + path.name for bag in bags for path in (campaign.raw / bag).glob("*.*"))
    return sorted(names.union(parts))


def digests_of_files(folder: Path, names: Iterable[str], seen: Seen) -> dict[str, str]:
    """SHA-256 of files by name, relative to a folder; empty where there is no such file."""
    paths = {f"{folder}/{name}": name for name in names}
    return {paths[path]: digest for path, digest in seen.digests(paths).items()}


def robot_files(campaign: Campaign) -> list[str]:
    """The robot's own file, its sheet and its tracks, so far as they exist, from the campaign's folder."""
    robot = campaign.config.robot
    if robot is None or not campaign.robot_medium:
        return []
    paths = [campaign.root / robot.file] if robot.file else []
    if robot.runs is not None:
        from rftfit.workflow.robot import trials_of

        sheet = campaign.raw / robot.runs
        paths += [sheet, *(sheet.parent / trial.track for trial in trials_of(campaign))]
    return sorted(
        {path.resolve().relative_to(campaign.root).as_posix() for path in paths if path.is_file()}
    )


def rows_of(campaign: Campaign, medium: str) -> list[list[str]]:
    """Cells of a medium's rows of the run sheet, or of all; order and numbers of rows do not count."""
    runs = campaign.runs_of(medium) if medium else campaign.runs
    # whether they are recordings at all is told beside the whole
    origin = [] if medium else [[f"re-enacted: {campaign.reenacted}"]]
    return origin + sorted(
        [*cells(run).values(), *(str(row) for row in campaign.numbers.get(run.run_id, ()))]
        for run in runs
    )


def cells(run: Run) -> dict[str, str]:
    """What counts of a row of the run sheet, as text by column."""
    return {
        name: _text(getattr(run, name))
        for name in run.__dataclass_fields__
        if name not in _LEFT_OUT
    }


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)
