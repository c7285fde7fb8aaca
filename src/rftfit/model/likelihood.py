"""Likelihood of measured numbers of a medium, for any size and any departure from the known shape."""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.model.prior import Prior
from rftfit.model.pushes import USUAL_PERCENT, Pushes
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "likelihood")


class Measurements(NamedTuple):
    """n measured numbers of a medium, N/cm^3: alpha of pushes, z then x, and combinations of measured forces.

    `prior`: prior of a medium of size 1. `prior_index` (n,): indices of the measured numbers in it. `y` (n,): the
    numbers. `covariance` (n, n): of their errors.
    """

    prior: Prior
    prior_index: npt.NDArray[np.intp]
    y: FloatArray
    covariance: FloatArray

    def with_rounding(self) -> Measurements:
        """Add a variance of rounding to the covariance, so that it has an inverse even for exact numbers."""
        scale = float(np.abs(self.y).max()) or 1.0
        covariance = self.covariance.copy()
        covariance[np.diag_indices(self.y.size)] += (1e-6 * scale) ** 2
        return self._replace(covariance=covariance)


class Likelihood:
    """Likelihood of n measured numbers with normal errors, for any size and departure of the medium at one w.

    After whitening, which makes the errors independent and 1, the covariance of the numbers is 1 + t S: t is the size
    squared times the departure, and S the whitened covariance of a medium of size 1, C + (1 - w) K + w R. One
    eigendecomposition of S serves every t.

    `rough_share`: w.
    """

    def __init__(self, measurements: Measurements, rough_share: float) -> None:
        prior = measurements.prior.select(measurements.prior_index)
        errors_covariance = measurements.covariance
        self.mean, self.y = prior.mean, measurements.y
        variance_without_bed = np.diag(errors_covariance) - (USUAL_PERCENT / 100 * self.y) ** 2
        self.least_error = float(np.sqrt(np.maximum(variance_without_bed, 0.0).min()))
        covariance = prior.covariance(rough_share)
        # independent errors, without products of whole matrices: half the time for hundreds of pushes
        if np.count_nonzero(errors_covariance) == self.y.size:
            whiten = 1 / np.sqrt(np.diag(errors_covariance))
            eigenvalues, vectors = np.linalg.eigh(whiten[:, None] * covariance * whiten)
            self._axes = vectors.T * whiten
        else:
            whiten = np.linalg.inv(np.linalg.cholesky(errors_covariance))
            eigenvalues, vectors = np.linalg.eigh(whiten @ covariance @ whiten.T)
            self._axes = vectors.T @ whiten
        self._eigenvalues = np.maximum(eigenvalues, 0.0)
        self._y, self._mean = self._to_axes(self.y), self._to_axes(self.mean)
        # first estimate of the size by least squares, with an error of 20 % added to each number
        weight = 1 / (np.diag(errors_covariance) + (0.2 * np.abs(self.y)) ** 2)
        self.first_size = float(weight @ (self.mean * self.y)) / float(weight @ self.mean**2)
        if not self.first_size > 0:
            raise ValueError(
                "the pushes meet no resistance: look at the signs of alpha and at the angles"
            )

    def _to_axes(self, numbers: FloatArray) -> FloatArray:
        """Transform numbers (..., n) to the axes in which errors are independent and 1 and S is diagonal."""
        return np.asarray(numbers @ self._axes.T)

    def log_likelihood(self, sizes: FloatArray, departures: FloatArray) -> FloatArray:
        """Return the logarithm of the likelihood, shape (departures, sizes), but for a constant.

        It is -(log det V + r' V^-1 r) / 2 with the residual r = y - s m and the covariance V = 1 + t S.
        """
        variance = departures[:, None] * sizes**2
        diagonal = 1 + variance[..., None] * self._eigenvalues
        residual = self._y - sizes[:, None] * self._mean
        return np.asarray(-0.5 * (np.log(diagonal) + residual**2 / diagonal).sum(axis=-1))

    @cached_property
    def expected_size(self) -> float:
        """Posterior mean of the size for lambda = 1."""
        sizes, weights = weigh([self], np.ones(1), np.zeros((1, 1, 1)))
        return float(weights[0, 0] @ sizes)

    def solve(self, residual: FloatArray, variance: FloatArray) -> FloatArray:
        """Return the inverse covariance of the numbers times `residual`, (draws, n); `variance`: t, (draws, 1)."""
        in_axes = self._to_axes(residual) / (1 + variance * self._eigenvalues)
        return np.asarray(in_axes @ self._axes)

    def chi_squared(self, size: float) -> float:
        """Return chi squared of the numbers about the mean shape of this size, for lambda = 1."""
        residual = self._y - size * self._mean
        return float((residual**2 / (1 + size**2 * self._eigenvalues)).sum())

    def fit_horizontal_ratio(self, is_x: npt.NDArray[np.bool_], size: float) -> tuple[float, float]:
        """Fit alpha_x over alpha_z relative to this ratio in known media; return it and the standard error of its log.

        By generalised least squares with one factor on the mean shape for each component; NaN if one component was not
        measured. If a factor is not positive, returns 0 and the relative error of the difference of both factors.
        `is_x` (n,): True for numbers that are alpha_x.
        """
        if is_x.all() or not is_x.any():
            return math.nan, math.nan
        design = self._to_axes(np.stack([self.mean * ~is_x, self.mean * is_x]))
        weighted = design / (1 + size**2 * self._eigenvalues)
        covariance = np.linalg.pinv(weighted @ design.T)
        z, x = (float(factor) for factor in covariance @ (weighted @ self._y))
        (zz, zx), (_, xx) = covariance
        if min(z, x) <= 0:
            return 0.0, math.sqrt(max(zz + xx - 2 * zx, 0.0)) / abs(z - x)
        return x / z, math.sqrt(max(zz / z**2 + xx / x**2 - 2 * zx / (z * x), 0.0))

    def farthest(self, pushes: Pushes, used: npt.NDArray[np.bool_], size: float) -> PushResidual:
        """Return the number that differs most, in units of its error, from its prediction by all other numbers.

        `used`: True for those numbers of `pushes`, z then x, that are the measured numbers.
        """
        # leave-one-out residual of number i: (V^-1 r)_i / (V^-1)_ii, with the variance 1 / (V^-1)_ii
        precision = (1 / (1 + size**2 * self._eigenvalues)) @ self._axes**2
        variance = 1 / precision
        residual = (self.y - size * self.mean)[None]
        off = self.solve(residual, np.full((1, 1), size**2))[0] * variance
        worst = int(np.argmax(np.abs(off) / np.sqrt(variance)))
        component, push = divmod(int(np.flatnonzero(used)[worst]), pushes.beta.size)
        return PushResidual(
            math.degrees(pushes.beta[push]),
            math.degrees(pushes.gamma[push]),
            COMPONENTS[component],
            float(self.y[worst]),
            float(self.y[worst] - off[worst]),
            math.sqrt(variance[worst]),
        )


def weigh(
    likelihoods: list[Likelihood], departures: FloatArray, log_prior: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return sizes (k,), evenly spaced in their logarithm, and the posterior weight of each w, lambda and size.

    `likelihoods`: one for each w. `log_prior`: of w and lambda, shape (w, lambda, 1). The weights sum to 1. The prior
    of the logarithm of the size is flat, but falls for sizes that the errors would hide: pushes in directions where
    media have hardly any force would otherwise fit the weakest medium best.
    """
    first = likelihoods[0]
    low, high = np.log(first.first_size) + np.log(_CHOSEN.widest) * np.array([-1, 1])
    for _ in range(3):  # narrow the range to sizes with weight
        sizes = np.exp(np.linspace(low, high, _CHOSEN.sizes))
        log_weights = log_prior + np.stack(
            [likelihood.log_likelihood(sizes, departures) for likelihood in likelihoods]
        )
        log_weights += np.log(sizes / (sizes + _CHOSEN.hidden_below_se * first.least_error))
        weights = np.exp(log_weights - log_weights.max())
        likely = np.flatnonzero(weights.max(axis=(0, 1)) > 1e-6)
        low = np.log(sizes[max(likely[0] - 1, 0)])
        high = np.log(sizes[min(likely[-1] + 1, sizes.size - 1)])
    return sizes, weights / weights.sum()


class PushResidual(NamedTuple):
    """One measured number of a push, and its prediction by the other pushes and the known shape, N/cm^3."""

    beta_deg: float
    gamma_deg: float
    component: str
    measured: float
    expected: float
    error: float
