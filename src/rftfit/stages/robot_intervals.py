"""Half widths of the intervals of the robot's speed and best curvature, from the errors of alpha."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.profile.media_fits import fit_media
from rftfit.robot.intervals import (
    BEST,
    BEST_DRAWS,
    COLUMNS,
    DRAWS,
    SPEED,
    best_width,
    each_draw,
    speed_widths,
)
from rftfit.robot.run import Condition
from rftfit.robot.sensitivity import BEST_AT_HZ
from rftfit.stages.robot import robot_of
from rftfit.store import read_csv, write_csv
from rftfit.validate.predictions import laboratory_candidates

PROFILES = ("table", "generic")
"""On which speeds are predicted in earnest; depth-only is the baseline that they are held against."""

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.robot.config import Robot
    from rftfit.validate.predictions import Candidate


def robot_intervals(config: Path, alpha: list[Path], measured: Path, intervals: Path) -> None:
    """Run the robot on draws of alpha, under every measured condition and for its best curvature.

    Parameters
    ----------
    config : Path
    alpha : list of Path
        Read: alpha tables of all laboratory media.
    measured : Path
        Read: measured conditions.
    intervals : Path
        Written: half widths, `rftfit.robot.intervals.COLUMNS`.

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    candidates = _candidates(campaign.config, section.medium, [read_csv(path) for path in alpha])
    level = campaign.config.fit.confidence
    found = widths(robot, candidates, read_csv(measured), level)
    found.insert(0, "medium", section.medium)
    write_csv(found[COLUMNS], intervals)


def _candidates(config: Config, medium: str, tables: list[pd.DataFrame]) -> list[Candidate]:
    """Profiles of the robot's medium with draws."""
    method = config.fourier.method
    fits = [fit for fit in fit_media(tables, config) if fit.method == method]
    table = next(table for table in tables if table["medium"].iloc[0] == medium)
    own = next(fit for fit in fits if fit.medium == medium)
    found = laboratory_candidates(table, own, [fit for fit in fits if not fit.reason], config)
    return sorted(
        (one for one in found if one.name in PROFILES), key=lambda one: PROFILES.index(one.name)
    )


def widths(
    robot: Robot,
    candidates: list[Candidate],
    measured: pd.DataFrame,
    confidence: float,
    threads: int | None = None,
) -> pd.DataFrame:
    """Half widths for every measured condition, and of the best curvature, on each profile.

    Parameters
    ----------
    robot : Robot
    candidates : list of Candidate
        Profiles and their draws.
    measured : pandas.DataFrame
        Measured conditions.
    confidence : float
    threads : int, optional
        Default: one for each core.

    Returns
    -------
    pandas.DataFrame
        Columns `rftfit.robot.intervals.COLUMNS` without the medium.
    """
    import pandas as pd

    known = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    places = zip(known["frequency_Hz"], known["curvature_times_R"], strict=True)
    conditions = [Condition(*place) for place in dict.fromkeys(places)]
    rows: list[tuple[object, ...]] = []
    for one in candidates:
        draws = each_draw(one.draws, DRAWS)
        found = speed_widths(robot, one.profile, draws, conditions, confidence, threads)
        rows += [
            (one.name, SPEED, at.curvature_times_R, at.frequency_Hz, w.half, w.draws, w.reason)
            for at, w in zip(conditions, found, strict=True)
        ]
        many = each_draw(one.draws, BEST_DRAWS)
        best = best_width(robot, one.profile, many, confidence, threads)
        rows.append((one.name, BEST, math.nan, BEST_AT_HZ, best.half, best.draws, best.reason))
    return pd.DataFrame(rows, columns=COLUMNS[1:])
