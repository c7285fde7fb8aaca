"""Motion of a run for figures and page: poses, forces on every element, and the last strides.

Three clients: movies take `element_series`; the report page `frames_of`, the data of its moving pictures; figures and
tables of the motion `tail_of` (table of the last strides) and `stance_of` (forces at one moment). All start from the
`Series` of a run (`rftfit.robot.run`). Its groups are the plates of the body by name, then the legs of each phase,
``tripod_1``, ...; an element is a short straight piece of a plate or leg.
"""

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
    """Elements of one group over time, arrays (samples, members of the group, elements), in the frame of the ground.

    `ends_x_cm`, `ends_z_cm`: with a further last axis for the two ends of each element.
    `force_x_N`, `force_z_N`: force of the ground on each element; 0 above the surface.
    `at_x_cm`, `at_z_cm`: point where it acts, the middle of the submerged part.
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
    """Place all elements in every n-th sample of a run and calculate the force on each, by name of the group.

    Movies S5 and S6 of the paper show such forces; the run itself keeps only their sums. `profile`, `condition`: those
    of the run. `series`: its samples, or the last of them. `every`: n.
    """
    parts = assemble(robot, condition.curvature_times_R)
    rate = 2 * np.pi * condition.frequency_Hz
    angles = np.radians(series.leg_angle_deg[::every])
    states = zip(series.states[::every], angles, strict=True)
    # for each sample a list of arrays (members, n, 8), one for each group
    samples = [parts.place(state, angle, rate) for state, angle in states]
    series_of_groups = {}
    # `zip(*samples)` gives for each group its arrays in all samples
    for name, samples_of_group in zip(parts.names, zip(*samples, strict=True), strict=True):
        elements = np.stack(samples_of_group)
        # centre, unit tangent and half-length
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
"""Stride frequencies that a reader of the page can choose."""
CURVATURES = (1.0, 0.86, 0.0, -1.0)
"""R'/r that a reader can choose: c-leg, the paper's best leg at 5 Hz, flat leg, reversed c-leg."""
FRAMES = 36
"""Pictures of one stride, the last of the run."""


def frames_of(robot: Robot, profile: Profile) -> dict[str, Any]:
    """Simulate all `CURVATURES` at all `FREQUENCIES_HZ`; return the pictures as plain data for the script of the page.

    ``plates`` (x, z of one end and of the other, cm) and ``hips`` (x, z, cm; phase, turns) are in the frame of the
    body. ``legs``: points x, z (cm) of the legs about the hip at theta = 0, by curvature as text. ``runs``: one entry
    for each condition, with its speed and outcome and two lists over frames: ``pose`` (x from the first frame, z,
    pitch, nose up, and theta; cm and rad) and ``arrows`` (a flat list of four numbers for each loaded element: x from
    the centre of mass, z, force x, force z; cm and mN).
    """
    legs, shapes = robot.legs, {}
    for curvature in CURVATURES:
        body = arc(curvature, legs.max_length_cm, legs.width_cm, robot.numerics.elements).body
        # elements of the leg: centre x, z, unit tangent x, z, half-length; from the centre to one end
        along = body[:, 4:5] * body[:, 2:4]
        # first end of each element, and the tip
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
    """Simulate one condition; return its entry in ``runs`` of `frames_of`: speed, outcome, pictures of its last stride.

    `frequency`: Hz. `curvature`: R'/r. A pose without a number, of a run that lost its forces, is 0.
    """
    run = simulate(robot, profile, frequency, curvature, samples_per_stride=FRAMES)
    assert run.series is not None
    series = run.series.last(FRAMES)
    groups = element_series(robot, profile, run.condition, series).values()
    ahead, theta = series.x_cm - series.x_cm[0], np.radians(series.leg_angle_deg) % (2 * np.pi)
    pose = np.stack([ahead, series.z_cm, np.radians(series.pitch_deg), theta], axis=1)
    # arrays (frames, all elements of all groups): where the force acts, x and z, and the force, x and z
    x, z, force_x, force_z = (
        np.concatenate([getattr(group, name).reshape(FRAMES, -1) for group in groups], axis=1)
        for name in ("at_x_cm", "at_z_cm", "force_x_N", "force_z_N")
    )
    # points to 0.1 mm, forces to 0.1 mN; + 0.0 turns -0.0 into 0.0
    points = np.round([x - series.x_cm[:, None], z], 2)
    forces = np.round(1000 * np.stack([force_x, force_z]), 1)
    # the four numbers of an arrow last: (frames, elements, 4)
    rows = np.moveaxis(np.concatenate([points, forces]) + 0.0, 0, -1)
    # a force below 0.5 mN would be too short to be seen: no arrow
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
"""Samples in each stride of the runs shown in figures, and number of last strides that are shown."""


def stance_of(robot: Robot, profile: Profile, run: RobotRun) -> pd.DataFrame:
    """Return every element and the force on it at the last moment when the legs of phase 0 hang straight down (stance).

    `run`: with `SAMPLES` samples for each stride, on this robot and profile. One row for each element: condition,
    group, its ends ``x1_cm``, ``z1_cm``, ``x2_cm``, ``z2_cm``, the point where the force acts, ``at_x_cm``,
    ``at_z_cm``, and the force of the ground on it, ``force_z_N``, ``force_x_N``. x counts from the centre of mass, z
    from the surface.
    """
    assert run.series is not None
    last = run.series.last(SAMPLES)
    # 1 where the legs hang straight down; a pitch with the nose up turns them back
    uprightness = np.cos(np.radians(last.leg_angle_deg - last.pitch_deg))
    from_stance = run.series.last(len(uprightness) - int(np.argmax(uprightness)))
    # every n-th sample, with all samples as n: the first alone, the stance
    groups = element_series(robot, profile, run.condition, from_stance, len(from_stance.x_cm))
    condition, x0, tables = run.condition, from_stance.x_cm[0], []
    for name, group in groups.items():
        # arrays (elements of all members,), of the only sample
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


def tail_of(run: RobotRun) -> pd.DataFrame:
    """Return the table of the last `STRIDES` strides of a run with `SAMPLES` samples for each stride.

    Columns: `curvature_times_R, frequency_Hz, stride` (0 to 2), and those of `Series.table`. Time and x count from the
    first row, where the angle of the legs is from 0 to 360 degrees; it grows from there without being wrapped.
    """
    assert run.series is not None
    table = run.series.last(STRIDES * SAMPLES).table()
    for name in ("time_s", "x_cm"):
        table[name] -= table[name].iloc[0]
    table["leg_angle_deg"] -= 360 * np.floor(table["leg_angle_deg"].iloc[0] / 360)
    table.insert(0, "stride", np.arange(len(table)) / SAMPLES)
    table.insert(0, "frequency_Hz", run.condition.frequency_Hz)
    table.insert(0, "curvature_times_R", run.condition.curvature_times_R)
    return table
