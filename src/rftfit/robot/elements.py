"""Where every element is during a run, and the force on it: for animations (movies S5 and S6)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.robot import plain
from rftfit.robot.parts import assemble

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.profile.base import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import Run


@dataclass(frozen=True)
class ElementSeries:
    """Elements of one group of members over time: n samples, m members, k elements each.

    Parameters
    ----------
    ends_x_cm, ends_z_cm : numpy.ndarray, shape (n, m, k, 2)
        The two ends of each element.
    force_x_N, force_z_N : numpy.ndarray, shape (n, m, k)
    at_x_cm, at_z_cm : numpy.ndarray, shape (n, m, k)
        Where the force acts.
    """

    ends_x_cm: FloatArray
    ends_z_cm: FloatArray
    force_x_N: FloatArray
    force_z_N: FloatArray
    at_x_cm: FloatArray
    at_z_cm: FloatArray


def element_series(
    robot: Robot, profile: Profile, run: Run, every: int = 1
) -> dict[str, ElementSeries]:
    """Place all elements of a run and give the force on each.

    Parameters
    ----------
    robot : Robot
    profile : Profile
        Those that the run was made with.
    run : Run
        With a series.
    every : int, optional
        Take every so many of its samples.

    Returns
    -------
    dict of str to ElementSeries
        By group, in the order of ``run.series.groups``.

    Raises
    ------
    ValueError
        If the run has no series.
    """
    if run.series is None:
        raise ValueError("the run was made without samples; ask for samples_per_stride")
    parts = assemble(robot, run.condition.curvature_times_R)
    rate = 2 * math.pi * run.condition.frequency_Hz
    turned = np.radians(run.series.leg_angle_deg[::every])
    samples = [
        (plain.place(parts, state, turn, rate), plain.forces(profile, parts, state, turn, rate))
        for state, turn in zip(run.series.states[::every], turned, strict=True)
    ]
    result = {}
    for index, name in enumerate(parts.names):
        x, z, tx, tz, half = np.moveaxis(np.stack([s[0][index] for s in samples]), -1, 0)[:5]
        force_z, force_x, at_x, at_z = np.moveaxis(np.stack([s[1][index] for s in samples]), -1, 0)
        ends = np.array([-1.0, 1.0])
        result[name] = ElementSeries(
            x[..., None] + ends * (half * tx)[..., None],
            z[..., None] + ends * (half * tz)[..., None],
            force_x, force_z, at_x, at_z,
        )  # fmt: skip
    return result
