"""Figures of the robot, and the motion that two of them show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.report.robot import draw_optimum, draw_speeds
from rftfit.report.robot_motion import draw_motion, draw_reaction
from rftfit.report.saving import save
from rftfit.robot.run import simulate
from rftfit.stages.figures import base_of
from rftfit.stages.robot import robot_of
from rftfit.stages.robot_profiles import PROFILES, robot_profile
from rftfit.store import read_csv, write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.profile.base import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import Run

MOTION_HZ = 2.0
MOTION_CURVATURES = (1.0, 0.0, -1.0)
"""c-leg, flat and reversed c-leg at the stride frequency of the paper's movies."""

SAMPLES, STRIDES = 200, 2


def last_strides(
    robot: Robot, profile: Profile, frequency_Hz: float, curvature: float, samples: int = SAMPLES
) -> pd.DataFrame:
    """Motion and forces over the last two strides of a run.

    Parameters
    ----------
    robot : Robot
    profile : Profile
    frequency_Hz, curvature : float
    samples : int, optional
        In a stride.

    Returns
    -------
    pandas.DataFrame
        `curvature_times_R, frequency_Hz, stride` (0 to 2), and the columns of
        `rftfit.robot.series.Series.table`; time and x count from the first row.
    """
    run = simulate(robot, profile, frequency_Hz, curvature, samples_per_stride=samples)
    return tail_of(run, samples)


def tail_of(run: Run, samples: int) -> pd.DataFrame:
    """Cut the last two strides out of a run.

    Parameters
    ----------
    run : Run
        With a series.
    samples : int
        In a stride.

    Returns
    -------
    pandas.DataFrame
        As `last_strides`; fewer where the run was shorter.
    """
    assert run.series is not None
    table = run.series.table().iloc[-STRIDES * samples :].reset_index(drop=True)
    for name in ("time_s", "x_cm"):
        table[name] -= table[name].iloc[0]
    table["leg_angle_deg"] -= 360 * np.floor(table["leg_angle_deg"].iloc[0] / 360)
    table.insert(0, "stride", np.arange(len(table)) / samples)
    table.insert(0, "frequency_Hz", run.condition.frequency_Hz)
    table.insert(0, "curvature_times_R", run.condition.curvature_times_R)
    return table


def robot_motion(config: Path, alpha: Path, coefficients: Path, motion: Path) -> None:
    """Run the three model legs at 2 Hz on every profile and keep their last two strides.

    Parameters
    ----------
    config : Path
    alpha, coefficients : Path
        Read: alpha table of the robot's medium, coefficients of all.
    motion : Path
        Written.

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    method = campaign.config.fourier.method
    table, values = read_csv(alpha), read_csv(coefficients)
    parts = []
    for name in PROFILES:
        profile = robot_profile(name, section.medium, table, values, method)
        for curvature in MOTION_CURVATURES:
            part = last_strides(robot, profile, MOTION_HZ, curvature)
            part.insert(0, "profile", name)
            parts.append(part)
    write_csv(pd.concat(parts, ignore_index=True), motion)


def figures_robot_speed(
    speed: Path, errors: Path, optimum: Path, fig_4c: Path, fig_4d: Path, fig_s13: Path
) -> None:
    """Draw speed against frequency and curvature (Figs. 4C, 4D, S13).

    Parameters
    ----------
    speed, errors, optimum : Path
        Read: tables of the robot.
    fig_4c, fig_4d, fig_s13 : Path
        Written: png, with pdf and svg beside each.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    runs, compared, best = (read_csv(path) for path in (speed, errors, optimum))
    save(draw_speeds(runs, compared, ["table"]), base_of(fig_4c))
    save(draw_optimum(runs, best), base_of(fig_4d))
    save(draw_speeds(runs, compared), base_of(fig_s13))


def figures_robot_motion(motion: Path, fig_4b: Path, fig_s14: Path) -> None:
    """Draw motion and ground reaction over two strides (after Figs. 4B and S14).

    Parameters
    ----------
    motion : Path
        Read.
    fig_4b, fig_s14 : Path
        Written: png, with pdf and svg beside each.

    Raises
    ------
    RftfitError
        If the input is not valid or a result cannot be written.
    """
    table = read_csv(motion)
    save(draw_motion(table), base_of(fig_4b))
    save(draw_reaction(table), base_of(fig_s14))
