"""Numbering of the directions of runs: one tolerance and one rule for every question that is asked of runs.

A *direction* is a pair of angles; plates at beta and at beta + 180 degrees are the same plate. A *repeat* has the depth of
its direction too where the push is level, since the force of a level push depends on its depth.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray

if TYPE_CHECKING:
    import pandas as pd

TOLERANCE_DEG = 0.5
"""Difference of each angle up to which directions are one, where a campaign states none (`grid.angle_tolerance_deg`)."""

SAME_DEPTH_CM = 0.1
"""Difference of depth up to which level runs were meant for one depth."""

_ROUNDING = 1e-6
"""Rounding error of angles and depths: 0.5 is within 0.5 however it is rounded."""


def beta_apart(beta_deg: npt.ArrayLike, other_beta_deg: npt.ArrayLike) -> FloatArray:
    """Difference of two attack angles, from -90 to 90 degrees."""
    return np.asarray((np.subtract(beta_deg, other_beta_deg) + 90) % 180 - 90)


def angle_apart(
    beta_deg: npt.ArrayLike,
    gamma_deg: npt.ArrayLike,
    other_beta_deg: npt.ArrayLike,
    other_gamma_deg: npt.ArrayLike,
) -> FloatArray:
    """Return the larger difference of the two angles of directions, deg, whose shapes broadcast."""
    return np.maximum(
        np.abs(beta_apart(beta_deg, other_beta_deg)),
        np.abs(np.subtract(gamma_deg, other_gamma_deg)),
    )


def same_direction(
    beta_deg: npt.ArrayLike,
    gamma_deg: npt.ArrayLike,
    other_beta_deg: npt.ArrayLike,
    other_gamma_deg: npt.ArrayLike,
    tolerance_deg: float = TOLERANCE_DEG,
) -> npt.NDArray[np.bool_]:
    """Return where two directions, deg, whose shapes broadcast, are one within the tolerance."""
    apart_deg = angle_apart(beta_deg, gamma_deg, other_beta_deg, other_gamma_deg)
    return np.asarray(apart_deg <= tolerance_deg + _ROUNDING)


def number_directions(
    beta_deg: FloatArray,
    gamma_deg: FloatArray,
    tolerance_deg: float,
    depth_cm: npt.ArrayLike = math.nan,
) -> npt.NDArray[np.intp]:
    """Number the direction, or with `depth_cm` the repeat, of each of n runs.

    The angles that most runs have come first and take all runs within the tolerance, so that 44.98 degrees is a repeat of
    45 and no chain of small steps joins what is farther apart.

    Returns
    -------
    ndarray of int, shape (n,)
        Index of a run of the direction: the first with the angles after which it is named, or the first at its depth.
    """
    angles, first_run, angle_of_run, run_count = np.unique(
        np.stack([beta_deg, gamma_deg]),
        axis=1,
        return_index=True,
        return_inverse=True,
        return_counts=True,
    )
    number_of_angle = np.full(first_run.size, -1)
    for angle in np.lexsort((*angles[::-1], run_count))[::-1]:
        if number_of_angle[angle] < 0:
            is_near = same_direction(
                angles[0, angle], angles[1, angle], angles[0], angles[1], tolerance_deg
            )
            number_of_angle[is_near & (number_of_angle < 0)] = first_run[angle]
    number = number_of_angle[angle_of_run.ravel()]
    is_level = np.abs(gamma_deg[number]) <= tolerance_deg + _ROUNDING
    return _split_by_depth(number, np.where(is_level, depth_cm, math.nan))


def number_rows(table: pd.DataFrame, tolerance_deg: float) -> npt.NDArray[np.intp]:
    """Number the direction of each row of a table with ``beta_deg`` and ``gamma_deg``, as `number_directions`, shape (n,)."""
    beta_deg, gamma_deg = (table[name].to_numpy(float) for name in ("beta_deg", "gamma_deg"))
    return number_directions(beta_deg, gamma_deg, tolerance_deg)


def _split_by_depth(number: npt.NDArray[np.intp], depth_cm: FloatArray) -> npt.NDArray[np.intp]:
    """Number the depths of each direction apart; its runs without a depth are together."""
    has_depth = np.isfinite(depth_cm)
    split = number.copy()
    for direction in np.unique(number[has_depth]):
        is_of_direction = number == direction
        with_depth = np.flatnonzero(is_of_direction & has_depth)
        level = number_depths(depth_cm[with_depth])
        groups = [with_depth[level == place] for place in np.unique(level)]
        for runs in (*groups, np.flatnonzero(is_of_direction & ~has_depth)):
            split[runs] = runs.min(initial=number.size)
    return split


def number_depths(depth_cm: FloatArray) -> npt.NDArray[np.intp]:
    """Number the depths that were meant, from the smallest, shape (n,): a gap of more than `SAME_DEPTH_CM` parts them."""
    order = np.argsort(depth_cm, kind="stable")
    level = np.empty(depth_cm.size, dtype=np.intp)
    level[order] = np.cumsum(
        np.diff(depth_cm[order], prepend=depth_cm[order[:1]]) > SAME_DEPTH_CM + _ROUNDING
    )
    return level


def angles_of_directions(
    number: npt.NDArray[np.intp], beta_deg: FloatArray, gamma_deg: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return mean beta and gamma, deg, of the runs of the direction of each run, both of shape (n,)."""
    run_count = np.bincount(number)
    beta_off, gamma_off = beta_apart(beta_deg, beta_deg[number]), gamma_deg - gamma_deg[number]
    beta, gamma = (
        angle_deg[number] + np.bincount(number, off_deg)[number] / run_count[number]
        for angle_deg, off_deg in ((beta_deg, beta_off), (gamma_deg, gamma_off))
    )
    return beta, gamma
