"""Pictures of the running robot for the report page: poses and the force on every element."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.predict.outline import arc
from rftfit.robot.elements import element_series
from rftfit.robot.run import simulate
from rftfit.stages.robot import robot_of
from rftfit.stages.robot_profiles import robot_profile
from rftfit.store import read_csv, write_text

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.profile.base import Profile
    from rftfit.robot.config import Robot

FREQUENCIES_HZ = (1.0, 2.0, 5.0)
CURVATURES = (1.0, 0.86, 0.0, -1.0)
FRAMES = 36
"""Of one stride, the last of the run."""

_SMALLEST_N = 5e-4


def robot_frames(config: Path, alpha: Path, coefficients: Path, frames: Path) -> None:
    """Run a few conditions on the measured table and keep their last stride as pictures.

    Parameters
    ----------
    config : Path
    alpha, coefficients : Path
        Read: alpha table of the robot's medium, coefficients of all.
    frames : Path
        Written (json): see `frames_of`.

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    profile = robot_profile(
        "table", section.medium, read_csv(alpha), read_csv(coefficients),
        campaign.config.fourier.method,
    )  # fmt: skip
    data = frames_of(robot, profile)
    data["medium"] = section.medium
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    write_text(frames, text + "\n")


def frames_of(robot: Robot, profile: Profile) -> dict[str, Any]:
    """Make the pictures of every condition.

    Parameters
    ----------
    robot : Robot
    profile : Profile

    Returns
    -------
    dict
        ``title``; ``plates`` (ends, cm) and ``hips`` (x, z, cm; phase, turns) in the body's frame;
        ``legs``: points of a leg about its hip at theta = 0, by curvature; ``runs``: of each
        condition frequency, curvature, speed, outcome, warning, time of a stride, and by frame
        `pose` (x from the first frame, z, pitch in rad, theta in rad) and `arrows` (x from the
        centre of mass, z, force x, force z for each loaded element; cm and mN).
    """
    shapes = {}
    for curvature in CURVATURES:
        legs = arc(
            curvature, robot.legs.max_length_cm, robot.legs.width_cm, robot.numerics.elements
        )
        body = legs.body
        ends = np.vstack([body[:, :2] - body[:, 4:5] * body[:, 2:4],
                          body[-1:, :2] + body[-1:, 4:5] * body[-1:, 2:4]])  # fmt: skip
        shapes[f"{curvature:g}"] = np.round(ends, 3).tolist()
    return {
        "title": robot.title,
        "plates": [[*plate.from_cm, *plate.to_cm] for plate in robot.body.plates.values()],
        "hips": [[hip.x_cm, hip.z_cm, hip.phase_turns] for hip in robot.legs.hips],
        "legs": shapes,
        "runs": [
            _run(robot, profile, frequency, curvature)
            for curvature in CURVATURES
            for frequency in FREQUENCIES_HZ
        ],
    }


def _run(robot: Robot, profile: Profile, frequency: float, curvature: float) -> dict[str, Any]:
    run = simulate(robot, profile, frequency, curvature, samples_per_stride=FRAMES)
    assert run.series is not None
    last = slice(-FRAMES, None)
    columns: dict[str, Any] = {
        name: {key: part[last] for key, part in values.items()}
        if isinstance(values, dict)
        else values[last]
        for name, values in vars(run.series).items()
        if name != "groups"
    }
    series = replace(run.series, **columns)
    parts = element_series(robot, profile, replace(run, series=series)).values()
    pose = np.column_stack(
        [
            series.x_cm - series.x_cm[0], series.z_cm, np.radians(series.pitch_deg),
            np.radians(series.leg_angle_deg) % (2 * np.pi),
        ]
    )  # fmt: skip
    arrows = []
    for at, x in enumerate(series.x_cm):
        rows = np.vstack(
            [
                np.column_stack(
                    [one.at_x_cm[at].ravel() - x, one.at_z_cm[at].ravel(),
                     one.force_x_N[at].ravel(), one.force_z_N[at].ravel()]
                )
                for one in parts
            ]
        )  # fmt: skip
        felt = rows[np.hypot(rows[:, 2], rows[:, 3]) > _SMALLEST_N]
        felt[:, 2:] *= 1000
        arrows.append(_short(felt))
    speed = run.speed_cm_per_s
    return {
        "frequency_Hz": frequency,
        "curvature": curvature,
        "speed_cm_per_s": float(f"{speed:.5g}") if np.isfinite(speed) else None,
        "outcome": run.outcome,
        "warning": run.warning,
        "stride_s": 1 / frequency,
        "pose": np.round(np.nan_to_num(pose), 4).tolist(),
        "arrows": arrows,
    }


def _short(rows: np.ndarray) -> list[float]:
    """Places to 0.1 mm, forces to 0.1 mN, one list for all."""
    places, forces = np.round(rows[:, :2], 2), np.round(rows[:, 2:], 1)
    flat: list[float] = (np.hstack([places, forces]) + 0.0).ravel().tolist()
    return flat
