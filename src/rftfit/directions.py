"""Which runs have the same direction, and which are repeats: by one tolerance and one rule.

A *direction* is a pair of angles (beta, gamma); plates at beta and at beta + 180 degrees are the same plate. Runs are
*repeats* if they have the same direction and, for level pushes, the same depth, on which the force of a level push
depends.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rftfit.conventions import BoolArray, FloatArray, IndexArray

if TYPE_CHECKING:
    import pandas as pd

TOLERANCE_DEG = 0.5
"""Largest difference of each angle within one direction, if a campaign does not set `grid.angle_tolerance_deg`."""

SAME_DEPTH_CM = 0.1
"""Largest step from one depth to the next deeper one that still counts as the same intended depth of level runs."""

_ROUNDING = 1e-6
"""Allowance for rounding: angles 0.5 degrees apart are within 0.5 degrees even if rounding makes it 0.5000001."""


def beta_apart(beta_deg: npt.ArrayLike, other_beta_deg: npt.ArrayLike) -> FloatArray:
    """Return the first attack angle less the second, deg, from -90 to 90; shapes broadcast.

    Beta and beta + 180 degrees are the same plate: 89 and -89 degrees are -2 apart, not 178.
    """
    return np.asarray((np.subtract(beta_deg, other_beta_deg) + 90) % 180 - 90)


def angle_apart(
    beta_deg: npt.ArrayLike,
    gamma_deg: npt.ArrayLike,
    other_beta_deg: npt.ArrayLike,
    other_gamma_deg: npt.ArrayLike,
) -> FloatArray:
    """Return the larger of the differences in beta and in gamma between two directions, deg; shapes broadcast."""
    return np.maximum(
        np.abs(beta_apart(beta_deg, other_beta_deg)),
        np.abs(np.subtract(gamma_deg, other_gamma_deg)),
    )


def same_direction(
    beta_deg: npt.ArrayLike,
    gamma_deg: npt.ArrayLike,
    other_beta_deg: npt.ArrayLike,
    other_gamma_deg: npt.ArrayLike,
    tolerance_deg: float,
) -> BoolArray:
    """Return True where both angles of two directions agree within the tolerance; shapes broadcast."""
    apart_deg = angle_apart(beta_deg, gamma_deg, other_beta_deg, other_gamma_deg)
    return np.asarray(apart_deg <= tolerance_deg + _ROUNDING)


def is_straight_down(
    beta_deg: npt.ArrayLike, gamma_deg: npt.ArrayLike, tolerance_deg: float
) -> BoolArray:
    """Return True where a level plate moves straight down, (beta, gamma) = (0, 90) deg."""
    return same_direction(beta_deg, gamma_deg, 0.0, 90.0, tolerance_deg)


def has_sign(angle_deg: npt.ArrayLike, tolerance_deg: float) -> BoolArray:
    """Return False for plates or paths that are level or upright within the tolerance: a mirror does not change them.

    For others the sign of the angle matters, so a wrong sign can be told. `angle_deg`: beta, or gamma of paths.
    """
    # an angle and its mirror image, its negative, differ by twice the angle
    return np.asarray(np.abs(beta_apart(np.multiply(2, angle_deg), 0.0)) > tolerance_deg)


def number_directions(
    beta_deg: FloatArray,
    gamma_deg: FloatArray,
    tolerance_deg: float,
    depth_cm: npt.ArrayLike = math.nan,
) -> IndexArray:
    """Number n runs by direction, or with `depth_cm` by repeat: runs of the same direction have the same number.

    The angles that most runs have come first and take all runs within the tolerance, so that 44.98 degrees is a repeat of
    45 and no chain of small steps joins runs that are farther apart. `depth_cm`: depth of each run, which counts for
    level runs alone; default NaN: no run is split by depth.

    Returns
    -------
    ndarray of int, shape (n,)
        The number of a direction is the index of its first run with exactly the angles that took the others; the number
        of a repeat, where level runs are split by depth, is the index of its first run.
    """
    angles, first_run, angle_of_run, run_count = np.unique(
        np.stack([beta_deg, gamma_deg]),
        axis=1,
        return_index=True,
        return_inverse=True,
        return_counts=True,
    )
    # first_run, run_count: first run with each distinct pair of angles, and number of its runs
    beta, gamma = angles
    unnumbered = -1
    number_of_angle = np.full(first_run.size, unnumbered)
    # most runs first; of equally many the largest beta, then the largest gamma
    for angle in np.lexsort((gamma, beta, run_count))[::-1]:
        if number_of_angle[angle] == unnumbered:
            is_near = same_direction(beta[angle], gamma[angle], beta, gamma, tolerance_deg)
            number_of_angle[is_near & (number_of_angle == unnumbered)] = first_run[angle]
    number = number_of_angle[angle_of_run.ravel()]
    is_level = np.abs(gamma_deg[number]) <= tolerance_deg + _ROUNDING
    return _split_by_depth(number, np.where(is_level, depth_cm, math.nan))


def number_rows(table: pd.DataFrame, tolerance_deg: float) -> IndexArray:
    """Call `number_directions` for the n rows of a table with ``beta_deg`` and ``gamma_deg``; returns shape (n,)."""
    beta_deg, gamma_deg = (table[name].to_numpy(float) for name in ("beta_deg", "gamma_deg"))
    return number_directions(beta_deg, gamma_deg, tolerance_deg)


def _split_by_depth(number: IndexArray, depth_cm: FloatArray) -> IndexArray:
    """Split the runs of each direction by depth; runs without a depth (NaN) stay together as one more group.

    Returns for each run the index of the first run of its group, shape (n,), as `number` does for directions.
    """
    has_depth = np.isfinite(depth_cm)
    split = number.copy()
    for direction in np.unique(number[has_depth]):
        is_of_direction = number == direction
        with_depth = np.flatnonzero(is_of_direction & has_depth)
        depth_number = number_depths(depth_cm[with_depth])
        groups = [with_depth[depth_number == depth] for depth in np.unique(depth_number)]
        for runs in (*groups, np.flatnonzero(is_of_direction & ~has_depth)):
            split[runs] = runs.min(initial=number.size)
    return split


def number_depths(depth_cm: FloatArray) -> IndexArray:
    """Number the depth that each of n runs was meant to have, from 0, the smallest; returns shape (n,).

    No arm reaches a depth exactly: along the sorted depths, a gap above `SAME_DEPTH_CM` begins a new one.
    """
    order = np.argsort(depth_cm, kind="stable")
    depth_number = np.empty(depth_cm.size, dtype=np.intp)
    depth_number[order] = np.cumsum(
        np.diff(depth_cm[order], prepend=depth_cm[order[:1]]) > SAME_DEPTH_CM + _ROUNDING
    )
    return depth_number


def angles_of_directions(
    number: IndexArray, beta_deg: FloatArray, gamma_deg: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return for each run mean beta and mean gamma, deg, of all runs of its direction, both of shape (n,).

    `number`: Of `number_directions`, the index of a run of the same direction, for each run.
    """
    run_count = np.bincount(number)
    # differences from the run after which the direction is numbered: -90 and 90 degrees have the mean 90, not 0
    beta_off, gamma_off = beta_apart(beta_deg, beta_deg[number]), gamma_deg - gamma_deg[number]
    beta, gamma = (
        angle_deg[number] + np.bincount(number, off_deg)[number] / run_count[number]
        for angle_deg, off_deg in ((beta_deg, beta_off), (gamma_deg, gamma_off))
    )
    return beta, gamma
