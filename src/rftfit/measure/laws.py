"""Other laws than a line through zero: a line with a free intercept, and a power of depth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.slopes import Slope, combine_dof, level_path, weighted_sum_variance

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.campaign.config import Law
    from rftfit.conventions import FloatArray

_STEPS, _SMALL, _LEAST_P, _MOST_P = 8, 1e-6, 0.2, 3.0


@dataclass(frozen=True)
class Fitted:
    """A law with two parameters, fitted to one component of stress.

    `alpha`: Stress over depth where the laws are compared, N/cm^3. `gain`: shape (n,); Its change for
    a change of the stress of each sample, 1/cm. `design`: shape (2, n); What each parameter does. `rest`:
    shape (n,); Residuals, N/cm^2. `exponent`: Of depth; NaN where no power fits.
    """

    alpha: float
    gain: FloatArray
    design: FloatArray
    rest: FloatArray
    exponent: float = 1.0


Laws = dict[str, list[Fitted]]
"""By law, then by component."""


def other_laws(depth: FloatArray, stress: FloatArray, at_cm: float) -> Laws | None:
    """Fit a line with a free intercept and a power of depth; None along a level path.

    `depth`: shape (n,), cm. `stress`: shape (k, n), N/cm^2. `at_cm`: Where the laws are compared.
    """
    if level_path(depth):
        return None
    line = np.stack([np.ones_like(depth), depth])
    weights = _weights(line)
    at = np.array([1 / at_cm, 1.0]) @ weights
    return {
        "free_intercept": [Fitted(float(at @ one), at, line, one - weights @ one @ line) for one in stress],
        "power": [_power(depth, one, at_cm) for one in stress],
    }  # fmt: skip


def _weights(design: FloatArray) -> FloatArray:
    """What each sample does to each of two parameters in least squares, shape (2, n)."""
    square = design @ design.T
    scale = np.sqrt(np.maximum(np.diag(square), 1e-300))
    # a component that is not felt has no exponent: a little more than 1, so that there is a solution
    square = square / np.outer(scale, scale) + 1e-12 * np.eye(2)
    weights: FloatArray = np.linalg.solve(square, design / scale[:, None]) / scale[:, None]
    return weights


def _power(depth: FloatArray, stress: FloatArray, at_cm: float) -> Fitted:
    """Fit stress = alpha at (depth / at)^p by Gauss and Newton."""
    ratio, p = np.maximum(depth, 1e-6) / at_cm, 1.0
    for _ in range(_STEPS):
        shape = ratio**p
        size = float(shape @ stress) / float(shape @ shape)
        design = np.stack([shape, size * shape * np.log(ratio)])
        weights = _weights(design)
        rest = stress - size * shape
        step = float(weights[1] @ rest)
        if abs(step) < _SMALL or not _LEAST_P < p < _MOST_P:
            break
        p += float(np.clip(step, -0.5, 0.5))
    known = _LEAST_P < p < _MOST_P and abs(step) < 0.1
    return Fitted(size / at_cm, weights[0] / at_cm, design, rest, p if known else float("nan"))


def by_law(slope: Slope, laws: Mapping[str, list[Fitted]] | None, law: Law) -> Slope:
    """Put another law's stress over depth in the place of the slope through zero, with its error."""
    if laws is None or law == "through_zero":
        return slope
    noise, dof = np.array([
        weighted_sum_variance(one.rest[None], one.gain, one.design) for one in laws[law]
    ], dtype=object).T  # fmt: skip
    scatter = np.array([float(one[0]) for one in noise])
    moved = np.array([float(one.gain.sum()) for one in laws[law]])
    shift = slope.shift * moved**2
    tare = np.sqrt(0.5 * scatter + slope.shift_of_tare * moved**2)
    alpha = np.array([one.alpha for one in laws[law]])
    return replace(
        slope, alpha=alpha, se=np.sqrt(scatter + shift),
        dof=combine_dof(np.stack([scatter, shift]), np.stack([dof.astype(float), slope.dof])),
        curvature=np.zeros(alpha.size), tare=np.where(slope.tare > 0, tare, 0.0),
        # its intercept has found the surface
        lever=0.0 if law == "free_intercept" else slope.lever,
    )  # fmt: skip
