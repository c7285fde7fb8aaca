"""Motion of a run for figures and page: poses, forces on every element, and the last strides."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.forces.outlines import arc
from rftfit.forces.reference_kernel import element_forces
from rftfit.model.profiles import Profile
from rftfit.robot.body import assemble
from rftfit.robot.config import Robot
from rftfit.robot.run import Condition, RobotRun, Series, simulate


@dataclass(frozen=True)
class ElementSeries:
    """Elements of one group over time: force on each and its point, shape (samples, members, elements).

    `ends_x_cm`, `ends_z_cm` have a further last axis for the two ends of each element.
    """

    ends_x_cm: FloatArray
    ends_z_cm: FloatArray
    force_x_N: FloatArray
    force_z_N: FloatArray
    at_x_cm: FloatArray
    at_z_cm: FloatArray


def element_series(
    robot: Robot, profile: Profile, condition: Condition, series: Series, every: int = 1
) -> dict[str, ElementSeries]:
    """Place all elements in every n-th sample of a run and calculate the force on each, by group.

    Movies S5 and S6 of the paper show such forces. `profile`: the profile of the run. `every`: n.
    """
    parts = assemble(robot, condition.curvature_times_R)
    rate = 2 * np.pi * condition.frequency_Hz
    angles = np.radians(series.leg_angle_deg[::every])
    states = zip(series.states[::every], angles, strict=True)
    # elements of each group (members, n, 8) in each sample
    samples = [parts.place(state, angle, rate) for state, angle in states]
    series_of_groups = {}
    for name, samples_of_group in zip(parts.names, zip(*samples, strict=True), strict=True):
        elements = np.stack(samples_of_group)
        x, z, tx, tz, half = np.moveaxis(elements, -1, 0)[:5]
        force_z, force_x, at_x, at_z = np.moveaxis(element_forces(profile, elements), -1, 0)
        ends = np.array([-1.0, 1.0])
        series_of_groups[name] = ElementSeries(
            x[..., None] + ends * (half * tx)[..., None],
            z[..., None] + ends * (half * tz)[..., None],
            force_x,
            force_z,
            at_x,
            at_z,
        )
    return series_of_groups


# --- Pictures of the running robot for the report page: poses and the force on every element.


FREQUENCIES_HZ = (1.0, 2.0, 5.0)
CURVATURES = (1.0, 0.86, 0.0, -1.0)
FRAMES = 36
"""Pictures of one stride, the last of the run."""


def frames_of(robot: Robot, profile: Profile) -> dict[str, Any]:
    """Return the data of the pictures of the running robot in every condition, for the script of the page.

    ``plates`` (ends, cm) and ``hips`` (x, z, cm; phase, turns) are in the frame of the body. ``legs``: points
    about the hip at theta = 0, by curvature. ``runs``: for each run lists over frames, ``pose`` (x from the first
    frame, z, pitch, nose up, and theta; cm and rad) and ``arrows`` (x from the centre of mass, z, force x, force z of
    each loaded element; cm and mN).
    """
    legs, shapes = robot.legs, {}
    for curvature in CURVATURES:
        body = arc(curvature, legs.max_length_cm, legs.width_cm, robot.numerics.elements).body
        along = body[:, 4:5] * body[:, 2:4]
        ends = np.vstack([body[:, :2] - along, body[-1:, :2] + along[-1:]])
        shapes[f"{curvature:g}"] = np.round(ends, 3).tolist()
    conditions = product(CURVATURES, FREQUENCIES_HZ)
    return {
        "title": robot.title,
        "plates": [[*plate.from_cm, *plate.to_cm] for plate in robot.body.plates.values()],
        "hips": [[hip.x_cm, hip.z_cm, hip.phase_turns] for hip in legs.hips],
        "legs": shapes,
        "runs": [
            _pictures_of_run(robot, profile, frequency, curvature)
            for curvature, frequency in conditions
        ],
    }


def _pictures_of_run(
    robot: Robot, profile: Profile, frequency: float, curvature: float
) -> dict[str, Any]:
    """Simulate one condition; return its speed, and poses and arrows of its last stride (see `frames_of`)."""
    run = simulate(robot, profile, frequency, curvature, samples_per_stride=FRAMES)
    assert run.series is not None
    series = run.series.last(FRAMES)
    groups = element_series(robot, profile, run.condition, series).values()
    ahead, theta = series.x_cm - series.x_cm[0], np.radians(series.leg_angle_deg) % (2 * np.pi)
    pose = np.stack([ahead, series.z_cm, np.radians(series.pitch_deg), theta], axis=1)
    # of all elements in each frame: where the force acts, x and z, and the force, x and z
    x, z, force_x, force_z = (
        np.concatenate([getattr(group, name).reshape(FRAMES, -1) for group in groups], axis=1)
        for name in ("at_x_cm", "at_z_cm", "force_x_N", "force_z_N")
    )
    # points to 0.1 mm, forces to 0.1 mN; + 0.0 turns -0.0 into 0.0
    points = np.round([x - series.x_cm[:, None], z], 2)
    forces = np.round(1000 * np.stack([force_x, force_z]), 1)
    rows = np.moveaxis(np.concatenate([points, forces]) + 0.0, 0, -1)
    # a smaller force has no arrow
    has_arrow = np.hypot(force_x, force_z) > 5e-4
    arrows = [
        rows_of_frame[shown].ravel().tolist()
        for rows_of_frame, shown in zip(rows, has_arrow, strict=True)
    ]
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


# --- The last strides of a run, for figures of its motion.

SAMPLES, STRIDES = 200, 2
"""Samples for each stride, and number of last strides that are shown."""


def stance_of(robot: Robot, profile: Profile, run: RobotRun, samples: int) -> pd.DataFrame:
    """Return every element and the force on it at the last moment when the legs of phase 0 hang straight down.

    One row for each element; x counts from the centre of mass. `samples`: samples of the series in each stride.
    """
    assert run.series is not None
    last = run.series.last(samples)
    # 1 where the legs hang straight down; a pitch with the nose up turns them back
    uprightness = np.cos(np.radians(last.leg_angle_deg - last.pitch_deg))
    from_stance = run.series.last(len(uprightness) - int(np.argmax(uprightness)))
    # the first sample alone
    groups = element_series(robot, profile, run.condition, from_stance, len(from_stance.x_cm))
    condition, x0, tables = run.condition, from_stance.x_cm[0], []
    for name, group in groups.items():
        (x1, x2), (z1, z2) = (
            ends[0].reshape(-1, 2).T for ends in (group.ends_x_cm, group.ends_z_cm)
        )
        at_x, at_z, force_z, force_x = (
            values[0].ravel()
            for values in (group.at_x_cm, group.at_z_cm, group.force_z_N, group.force_x_N)
        )
        columns = {
            "curvature_times_R": condition.curvature_times_R,
            "frequency_Hz": condition.frequency_Hz,
            "group": name,
            "x1_cm": x1 - x0,
            "z1_cm": z1,
            "x2_cm": x2 - x0,
            "z2_cm": z2,
            "at_x_cm": at_x - x0,
            "at_z_cm": at_z,
            "force_z_N": force_z,
            "force_x_N": force_x,
        }
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True)


def tail_of(run: RobotRun, samples: int) -> pd.DataFrame:
    """Return the table of the last two strides of a run with a series; time and x count from the first row.

    Columns: `curvature_times_R, frequency_Hz, stride` (0 to 2), and those of `Series.table`.
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
