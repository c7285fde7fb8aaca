"""Error of the angle theta of legs, which all share, from the angles at which their forces begin.

A leg touches the surface at an angle that only its outline and the height of its axle decide. The prediction of the
force after that depends on the model, which misplaces peaks by up to 15 degrees, to one side for a leg that is curved
forward and to the other for one that is curved back. So the first part of a curve is compared, and not the angle of its
peak.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.measure.slopes import NORMAL_95
from rftfit.store.chosen import chosen

_CHOSEN = chosen("compare", "leg_angle")


def offset_of_curve(measured: pd.DataFrame, predicted: pd.DataFrame) -> float:
    """Return the angle by which the first part of a measured curve lies behind its prediction, whatever the size of the force.

    The prediction is moved along theta, and multiplied by a gain, until it fits the first part best.

    Parameters
    ----------
    measured, predicted : pandas.DataFrame
        Columns ``theta_deg``, increasing, ``force_z_N``, ``force_x_N``.

    Returns
    -------
    float
        Degrees; positive: the logs' theta is too large. NaN where the curve begins under load, or its first part is short.
    """
    theta, force = _curve(measured)
    theta_predicted, force_predicted = _curve(predicted)
    if theta.size < 2 * _CHOSEN.smooth or not np.isfinite(force_predicted).all():
        return math.nan
    size = np.convolve(np.hypot(*force), np.full(_CHOSEN.smooth, 1 / _CHOSEN.smooth), mode="same")
    size_predicted = np.hypot(*force_predicted)
    loaded = np.flatnonzero(size_predicted > 0)
    first_part = np.arange(theta.size) <= np.argmax(size > _CHOSEN.first_part * size.max())
    if not loaded.size or np.count_nonzero(first_part) < _CHOSEN.fewest:
        return math.nan
    # the curve begins under load, or so late that its beginning is not seen
    if theta[0] > theta_predicted[loaded[0]] - _CHOSEN.free_deg:
        return math.nan
    farthest_deg, step_deg = _CHOSEN.farthest_deg, _CHOSEN.step_deg
    offsets = np.arange(-farthest_deg, farthest_deg + step_deg / 2, step_deg)
    shifted_theta = theta[first_part][None] - offsets[:, None]
    # prediction at each offset, shape (2, offsets, readings)
    moved = np.stack(
        [
            np.interp(shifted_theta, theta_predicted, component, left=0.0, right=0.0)
            for component in force_predicted
        ]
    )
    squares = (moved**2).sum(axis=(0, 2))
    products = (moved * force[:, None, first_part]).sum(axis=(0, 2))
    # squares that are explained with the gain that fits best and does not turn the force around
    explained = np.maximum(products, 0.0) ** 2 / np.where(squares > 0, squares, 1.0)
    best = int(explained.argmax())
    is_inside = 0 < best < offsets.size - 1 and explained[best] > 0
    return float(offsets[best]) if is_inside else math.nan


def _curve(table: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Return theta, deg, (n,), and force z and x, N, (2, n), of the rows that have all numbers, by increasing theta.

    `table`: as `measured` of `offset_of_curve`.
    """
    names = ["theta_deg", "force_z_N", "force_x_N"]
    theta, *force = table[names].dropna().sort_values("theta_deg").to_numpy(float).T
    return theta, np.stack(force)


def common_offset(offsets_deg: Mapping[tuple[str, str], float]) -> tuple[float, float, float]:
    """Combine the offsets of single curves. Legs of one shape share an error, and so do all legs in one medium.

    These errors are the model's, not the logs', so five curves of one leg say less than one curve of each of five legs.
    The mean is weighted by the inverse of the covariance of the offsets.

    Parameters
    ----------
    offsets_deg : mapping of (medium, leg) to float
        Offset of each curve by `offset_of_curve`, which may be NaN.

    Returns
    -------
    offset, lo, hi : float
        How far angle theta of the logs lies above the angle of the legs, degrees, and its interval of 95 %; NaN where no
        curve has an offset.
    """
    curves = {curve: offset for curve, offset in offsets_deg.items() if math.isfinite(offset)}
    if not curves:
        return math.nan, math.nan, math.nan
    media, legs = np.array([*curves]).T
    covariance = (
        _CHOSEN.between_media_deg**2 * (media[:, None] == media)
        + _CHOSEN.between_legs_deg**2 * (legs[:, None] == legs)
        + _CHOSEN.between_curves_deg**2 * np.eye(len(curves))
    )
    weights = np.linalg.solve(covariance, np.ones(len(curves)))
    offset = float(weights @ [*curves.values()] / weights.sum())
    half_width = NORMAL_95 / math.sqrt(float(weights.sum()))
    return offset, offset - half_width, offset + half_width
