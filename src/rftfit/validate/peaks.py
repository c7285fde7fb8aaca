"""Peak of a measured curve: the highest of many noisy readings is too high, a parabola is not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

HALF_WIDTH_DEG = 5.0
"""Of the parabola: the published curves are one within 0.5 % of their peaks."""

_SMOOTH = 7
_BLOCK = 3
_LEAST = 6


@dataclass(frozen=True)
class Peak:
    """Peak of a curve of force against theta.

    Parameters
    ----------
    force_N : float
    se_N : float
        What the scatter of the readings leaves uncertain, N; NaN where the curve is too short to
        show its scatter. An error of the zero is not in it.
    """

    force_N: float
    se_N: float


def extreme(force: FloatArray, component: str) -> int:
    """Place of the largest lift, or of the largest horizontal force of either sign.

    Parameters
    ----------
    force : numpy.ndarray, shape (n,)
    component : str
        ``z`` or ``x``.

    Returns
    -------
    int
    """
    return int(np.argmax(force if component == "z" else np.abs(force)))


def measured_peak(theta_deg: FloatArray, force_N: FloatArray, component: str) -> Peak:
    """Fit a parabola around the highest reading and take its highest point.

    Parameters
    ----------
    theta_deg, force_N : numpy.ndarray, shape (n,)
        One reading a degree, in order.
    component : str
        ``z``, or ``x``, whose peak is the largest force of either sign.

    Returns
    -------
    Peak
        The highest reading itself where fewer than 6 lie around it.
    """
    at = extreme(force_N, component)
    if force_N.size >= 2 * _SMOOTH:
        # where the curve is highest, not where the noise is
        smooth = np.convolve(force_N, np.full(_SMOOTH, 1 / _SMOOTH), mode="valid")
        at = extreme(smooth, component) + _SMOOTH // 2
    fine = np.linspace(-HALF_WIDTH_DEG, HALF_WIDTH_DEG, 101)
    for _ in range(2):
        # once more around the peak of the first parabola where that lies near its end
        centre = theta_deg[at]
        near = np.abs(theta_deg - centre) <= HALF_WIDTH_DEG
        if np.count_nonzero(near) < _LEAST:
            return Peak(float(force_N[at]), math.nan)
        offset = theta_deg[near] - centre
        design = np.vander(offset, 3)
        weights = np.linalg.pinv(design)
        inside = fine[(fine >= offset.min()) & (fine <= offset.max())]
        values = np.vander(inside, 3) @ weights @ force_N[near]
        top = extreme(values, component)
        if abs(inside[top]) <= HALF_WIDTH_DEG / 2:
            break
        at = int(np.argmin(np.abs(theta_deg - centre - inside[top])))
    share = np.vander(inside[top : top + 1], 3)[0] @ weights
    scatter = _long_run_variance(force_N)
    return Peak(float(values[top]), math.sqrt(scatter * float(share @ share)))


def _long_run_variance(force: FloatArray) -> float:
    """Variance of readings, with that of their neighbours' correlation, from third differences.

    Means of three readings hardly know of one another, a leg's curve is smooth over four of them,
    and the median passes over the corners that it has.
    """
    count = force.size // _BLOCK
    if count < 2 * _LEAST:
        return math.nan
    shifted = [
        force[start : start + (force.size - start) // _BLOCK * _BLOCK].reshape(-1, _BLOCK)
        for start in range(_BLOCK)
    ]
    third = np.concatenate([np.diff(part.mean(axis=1), 3) for part in shifted])
    # 1.4826 makes a standard deviation of a median, 1 + 9 + 9 + 1 = 20
    return _BLOCK * (1.4826 * float(np.median(np.abs(third)))) ** 2 / 20
