"""Repeated penetrations with plates of several sizes: alpha of each, and what RFT takes for granted.

Resistive force theory takes stress for proportional to depth and for independent of the plate's
size. Both are put to the test: stress as a power of depth within the window, alpha as a power of
the plate's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.repeats import Spread, mean_of_repeats, spread_of_runs
from rftfit.measure.slope import student_quantile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rftfit.conventions import FloatArray


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error and interval.

    Parameters
    ----------
    value, se, lo, hi : float
    """

    value: float
    se: float
    lo: float
    hi: float

    def holds(self, number: float) -> bool:
        """Tell whether the interval holds a number.

        Parameters
        ----------
        number : float

        Returns
        -------
        bool
        """
        return self.lo <= number <= self.hi


@dataclass(frozen=True)
class PlateResult:
    """What the repeated runs with one plate say together.

    Parameters
    ----------
    alpha : Estimate
        alpha_z(0, 90 deg), N/cm^3, for one further bed prepared alike: run-to-run spread included.
    runs : int
    largest_deviation : float
        Of a run from the mean of its plate, relative.
    exponent : Estimate
        n of stress ~ depth^n within the window, from the scatter between runs.
    """

    alpha: Estimate
    runs: int
    largest_deviation: float
    exponent: Estimate


def depth_exponent(depth: FloatArray, stress: FloatArray) -> float:
    """Exponent n of stress = k depth^n, least squares of logarithms.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        cm, positive.
    stress : numpy.ndarray, shape (n,)
        N/cm^2.

    Returns
    -------
    float
        NaN with fewer than eight positive samples.
    """
    good = (depth > 0) & (stress > 0)
    if np.count_nonzero(good) < 8:
        return math.nan
    x, y = np.log(depth[good]), np.log(stress[good])
    x = x - x.mean()
    return float(x @ y / (x @ x))


def by_plate(
    alphas: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]],
    exponents: Mapping[str, FloatArray],
    confidence: float,
) -> tuple[dict[str, PlateResult], Spread]:
    """Combine the runs of each plate.

    Parameters
    ----------
    alphas : mapping of str to (alpha, se, dof)
        By plate; arrays of shape (runs,), N/cm^3.
    exponents : mapping of str to numpy.ndarray
        By plate.
    confidence : float

    Returns
    -------
    results : dict of str to PlateResult
    spread : Spread
        From run to run, pooled over the plates.
    """
    spread = spread_of_runs([(alpha, se) for alpha, se, _ in alphas.values()], None)
    results = {}
    for name, (alpha, se, dof) in alphas.items():
        mean, error, freedom = mean_of_repeats(alpha, se, dof, spread)
        results[name] = PlateResult(
            _estimate(mean, error, freedom, confidence),
            alpha.size,
            float(np.abs(alpha / mean - 1).max()),
            _of_scatter(exponents[name], confidence),
        )
    return results, spread


def size_exponent(size_cm: Sequence[float], alpha: Sequence[float], confidence: float) -> Estimate:
    """Exponent m of alpha ~ size^m over all runs; 0 where stress does not depend on the size.

    Parameters
    ----------
    size_cm, alpha : sequence of float
        One entry a run: cm, N/cm^3.
    confidence : float

    Returns
    -------
    Estimate
        NaN throughout with fewer than three runs or one size only.
    """
    x, y = np.log(np.asarray(size_cm, float)), np.log(np.asarray(alpha, float))
    if x.size < 3 or np.ptp(x) == 0:
        return Estimate(*[math.nan] * 4)
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    residual = y - slope * x
    se = math.sqrt(float(residual @ residual) / (x.size - 2) / float(x @ x))
    return _estimate(slope, se, x.size - 2, confidence)


def _of_scatter(values: FloatArray, confidence: float) -> Estimate:
    good = values[np.isfinite(values)]
    if good.size < 2:
        mean = float(good.mean()) if good.size else math.nan
        return Estimate(mean, math.nan, math.nan, math.nan)
    se = float(good.std(ddof=1)) / math.sqrt(good.size)
    return _estimate(float(good.mean()), se, good.size - 1, confidence)


def _estimate(value: float, se: float, dof: float, confidence: float) -> Estimate:
    half = float(student_quantile(confidence, dof)) * se
    return Estimate(value, se, value - half, value + half)
