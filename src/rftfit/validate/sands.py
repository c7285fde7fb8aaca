"""Penetration of natural sands: where the linear regime ends, and the slope up to there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.slope import zero_intercept

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

BEND = 0.10
"""Largest bend of a regime that is called linear: see `bend_of`."""

SHALLOWEST_CM = 1.0
STEP_CM = 0.05


def bend_of(depth: FloatArray, stress: FloatArray) -> float:
    """Bend of a curve through zero: how far a parabola leaves the line at the end, relative to it.

    Parameters
    ----------
    depth, stress : numpy.ndarray, shape (n,)
        cm, N/cm^2.

    Returns
    -------
    float
        Positive where the curve steepens.
    """
    design = np.stack([depth, depth**2], axis=1)
    (slope, curve), *_ = np.linalg.lstsq(design, stress, rcond=None)
    end = float(depth.max())
    line = float(zero_intercept(depth, stress[None])[0][0]) * end
    return float(slope * end + curve * end**2 - line) / line if line else float("nan")


def linear_end(depth: FloatArray, stress: FloatArray, bend: float = BEND) -> float:
    """Find the depth to which a penetration curve is linear.

    The regime grows from `SHALLOWEST_CM` as long as its bend stays within `bend`.

    Parameters
    ----------
    depth, stress : numpy.ndarray, shape (n,)
        cm, N/cm^2; tared.
    bend : float, optional

    Returns
    -------
    float
        cm; NaN if even the shallowest part is bent more, or there are too few samples.
    """
    good = np.isfinite(stress) & (depth > 0)
    depth, stress = depth[good], stress[good]
    found = float("nan")
    for end in np.arange(SHALLOWEST_CM, float(depth.max(initial=0.0)) + STEP_CM / 2, STEP_CM):
        part = depth <= end
        if np.count_nonzero(part) < 8 or abs(bend_of(depth[part], stress[part])) > bend:
            return found
        found = float(end)
    return found
