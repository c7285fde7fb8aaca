"""Likelihood of measured numbers of a medium, for any size and any departure from the known shape.

Numbers y are s (m + d) with normal errors: s is the size of the medium, m the mean shape of known media at these
numbers, d normal with the covariance lambda (C + (1 - w) K + w R) of `rftfit.model.prior`. lambda is called departure,
w rough share.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.model.prior import Blocks, Prior
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
        """Return the numbers with a variance of rounding in their covariance, so that it has an inverse even for exact ones."""
        scale = float(np.abs(self.y).max()) or 1.0
        covariance = self.covariance.copy()
        covariance[np.diag_indices(self.y.size)] += (1e-6 * scale) ** 2
        return self._replace(covariance=covariance)


class PushResidual(NamedTuple):
    """One measured number of a push, and its prediction by the other pushes and the known shape, N/cm^3.

    `component`: ``z`` or ``x``. `error`: standard error of `measured` less `expected`.
    """

    beta_deg: float
    gamma_deg: float
    component: str
    measured: float
    expected: float
    error: float

    def describe(self) -> str:
        """Say the direction, and what was found and expected there."""
        return (
            f"(beta, gamma) = ({self.beta_deg:g}, {self.gamma_deg:g}) deg, alpha_{self.component}: found "
            f"{self.measured:.3g}, expected by the other pushes {self.expected:.3g} +- {self.error:.2g} N/cm^3"
        )


class _EigenPart(NamedTuple):
    """Eigendecomposition of whitened S for numbers that neither S nor errors connect with others.

    `indices`: of the k numbers. `eigenvalues`: (k,), at least 0. `axes`: eigenvectors in rows, times the whitening,
    (k, k): numbers times its transpose have independent errors of 1, and S is diagonal.
    """

    indices: npt.NDArray[np.intp]
    eigenvalues: FloatArray
    axes: FloatArray

    @classmethod
    def of(cls, indices: npt.NDArray[np.intp], rest: FloatArray, whiten: FloatArray) -> _EigenPart:
        """Decompose `rest`, S of the k numbers at `indices`, (k, k); `whiten`: `whitening` of all numbers, (n,) or (n, n).

        Numbers with independent errors are whitened each by its own factor.
        """
        if whiten.ndim == 1:
            factors = whiten[indices]
            values, vectors = np.linalg.eigh(factors[:, None] * rest * factors)
            return cls(indices, np.maximum(values, 0.0), np.ascontiguousarray(vectors.T * factors))
        matrix = whiten[np.ix_(indices, indices)]
        values, vectors = np.linalg.eigh(matrix @ rest @ matrix.T)
        return cls(indices, np.maximum(values, 0.0), vectors.T @ matrix)


class Likelihood:
    """Likelihood of n measured numbers with normal errors, for any size and departure of the medium at one w.

    After whitening, which makes the errors independent and 1, the covariance of the numbers is 1 + t (B B' + S): t is
    the size squared times the departure, B (few columns) the differences of known media, and S the rest, (1 - w) K + w
    R. One eigendecomposition of S serves every t, and B is a correction of few columns (Woodbury). If the errors of z
    and x are independent, S has two parts, and the decomposition takes a quarter of the time. For few numbers, or if S
    has one part, B B' is added to S instead.

    `rough_share`: w. `mean`: mean shape at the numbers, (n,); `y`: the numbers. `first_size`: estimate of s, N/cm^3,
    about which sizes are tried. `least_error`: least standard error of a number without the scatter of beds, N/cm^3.
    Raises ValueError where the numbers show no resistance.
    """

    def __init__(self, measurements: Measurements, rough_share: float) -> None:
        """Decompose the covariance of the numbers once, for all sizes and departures."""
        prior = measurements.prior.select(measurements.prior_index)
        covariance = measurements.covariance
        self.mean, self.y = prior.mean, measurements.y
        variance_without_bed = np.diag(covariance) - (USUAL_PERCENT / 100 * self.y) ** 2
        self.least_error = float(np.sqrt(np.maximum(variance_without_bed, 0.0).min()))
        whiten = whitening(covariance)
        parts = _independent_parts(prior.smooth, covariance)
        if self.y.size <= _CHOSEN.few_numbers or len(parts) == 1:
            # all of the covariance in S, and no B
            parts = [np.arange(self.y.size)]
            rests = [prior.covariance(rough_share)]
            between = prior.between[:0]
        else:
            squares = zip(prior.smooth.squares, prior.rough.squares, strict=True)
            rests = [(1 - rough_share) * k + rough_share * r for k, r in squares]
            between = prior.between
        self._parts = [
            _EigenPart.of(indices, rest, whiten) for indices, rest in zip(parts, rests, strict=True)
        ]
        self._eigenvalues = np.concatenate([part.eigenvalues for part in self._parts])
        # in these axes, from here on: B' in rows (k, n), y and m
        self._between = self._to_axes(between)
        self._y, self._mean = self._to_axes(self.y), self._to_axes(self.mean)
        # first estimate of the size by least squares, with an error of 20 % added to each number
        weight = 1 / (np.diag(covariance) + (0.2 * np.abs(self.y)) ** 2)
        self.first_size = float(weight @ (self.mean * self.y)) / float(weight @ self.mean**2)
        if not self.first_size > 0:
            raise ValueError(
                "the pushes meet no resistance: look at the signs of alpha and at the angles"
            )

    def _to_axes(self, numbers: FloatArray) -> FloatArray:
        """Transform numbers (..., n) to the axes in which errors are independent and 1 and S is diagonal."""
        return np.concatenate(
            [numbers[..., part.indices] @ part.axes.T for part in self._parts], axis=-1
        )

    def _woodbury_inverse(self, variance: FloatArray, over: FloatArray) -> FloatArray:
        """Return the inverse of 1 + t B' D^-1 B, shape (t, k, k), where D is the diagonal of 1 + t S.

        `variance`: t, shape (t,). `over`: 1 / D, shape (t, n). Without B the shape is (t, 0, 0).
        """
        between = self._between
        # B' D^-1 B for every t, as one matrix product of all pairs of columns of B with 1 / D
        products = (between[:, None] * between).reshape(-1, between.shape[1])
        inner = (over @ products.T).reshape(len(over), len(between), len(between))
        return np.asarray(np.linalg.inv(np.eye(len(between)) + variance[:, None, None] * inner))

    def log_likelihood(self, sizes: FloatArray, departures: FloatArray) -> FloatArray:
        """Return the logarithm of the likelihood, shape (departures, sizes), but for a constant.

        It is -(log det V + r' V^-1 r) / 2 with the residual r = y - s m and the covariance V = 1 + t (B B' + S).
        `sizes`: s, N/cm^3; `departures`: lambda; every pair of them is tried.
        """
        variance = (departures[:, None] * sizes**2).ravel()
        diagonal = 1 + variance[:, None] * self._eigenvalues
        if not len(self._between):
            residual = np.tile(self._y - sizes[:, None] * self._mean, (departures.size, 1))
            total = (np.log(diagonal) + residual**2 / diagonal).sum(axis=-1)
            return np.asarray(-0.5 * total).reshape(departures.size, sizes.size)
        # V^-1 = D^-1 - t D^-1 B (1 + t B' D^-1 B)^-1 B' D^-1 with the diagonal D of 1 + t S
        over = 1 / diagonal
        inverse = self._woodbury_inverse(variance, over)
        size = np.broadcast_to(sizes, (departures.size, sizes.size)).ravel()
        # (y - s m)^2 / D, summed for all t at once: y^2 - 2 s y m + s^2 m^2
        terms = self._y * self._y, -2 * self._y * self._mean, self._mean * self._mean
        squares = over @ np.stack(terms, axis=1)
        powers = np.stack([np.ones_like(size), size, size**2], axis=1)
        between_y, between_mean = (
            over @ (self._between * numbers).T for numbers in (self._y, self._mean)
        )
        residual = between_y - size[:, None] * between_mean
        correction = np.einsum("ti,tij,tj->t", residual, inverse, residual)
        total = (squares * powers).sum(axis=1) - variance * correction
        log_determinant = np.log(diagonal).sum(axis=1) - np.linalg.slogdet(inverse)[1]
        return np.asarray(-0.5 * (log_determinant + total)).reshape(departures.size, sizes.size)

    @cached_property
    def expected_size(self) -> float:
        """Posterior mean of the size for lambda = 1, N/cm^3."""
        sizes, weights = weigh([self], np.ones(1), np.zeros((1, 1, 1)))
        return float(weights[0, 0] @ sizes)

    def _solve_in_axes(self, numbers: FloatArray, variance: FloatArray) -> FloatArray:
        """Return the inverse covariance times numbers (draws, n) in the axes of `_to_axes`; `variance`: t, (draws, 1)."""
        over = 1 / (1 + variance * self._eigenvalues)
        without_between = numbers * over
        inverse = self._woodbury_inverse(variance[:, 0], over)
        factors = np.einsum("dij,dj->di", inverse, without_between @ self._between.T)
        return np.asarray(without_between - over * (variance * (factors @ self._between)))

    def solve(self, residual: FloatArray, variance: FloatArray) -> FloatArray:
        """Return the inverse covariance of the numbers times `residual`, (draws, n), in their own axes.

        `variance`: t of each draw, (draws, 1).
        """
        in_axes = self._solve_in_axes(self._to_axes(residual), variance)
        # back from the axes of each part
        answer = np.empty_like(residual)
        ends = np.cumsum([part.indices.size for part in self._parts])[:-1]
        for part, block in zip(self._parts, np.split(in_axes, ends, axis=1), strict=True):
            answer[:, part.indices] = block @ part.axes
        return answer

    def chi_squared(self, size: float) -> float:
        """Return chi squared of the numbers about the mean shape of this size (N/cm^3), for lambda = 1."""
        residual = (self._y - size * self._mean)[None]
        return float((residual * self._solve_in_axes(residual, np.full((1, 1), size**2))).sum())

    def fit_horizontal_ratio(self, is_x: npt.NDArray[np.bool_], size: float) -> tuple[float, float]:
        """Fit alpha_x over alpha_z relative to this ratio in known media; return it and the standard error of its log.

        A ratio far from 1 shows a swapped or wrongly scaled axis. By generalised least squares with one factor on the
        mean shape for each component; NaN if one component was not measured. If a factor is not positive, returns 0 and
        the relative error of the difference of both factors. `is_x` (n,): True for numbers that are alpha_x. `size`:
        N/cm^3.
        """
        if is_x.all() or not is_x.any():
            return math.nan, math.nan
        design = self._to_axes(np.stack([self.mean * ~is_x, self.mean * is_x]))
        weighted = self._solve_in_axes(design, np.full((2, 1), size**2))
        covariance = np.linalg.pinv(weighted @ design.T)
        # factors of the components z and x, and below the covariance of their errors
        z, x = (float(factor) for factor in covariance @ (weighted @ self._y))
        (zz, zx), (_, xx) = covariance
        if min(z, x) <= 0:
            return 0.0, math.sqrt(max(zz + xx - 2 * zx, 0.0)) / abs(z - x)
        return x / z, math.sqrt(max(zz / z**2 + xx / x**2 - 2 * zx / (z * x), 0.0))

    def _precision_of_each(self, size: float) -> FloatArray:
        """Return the diagonal of the inverse covariance of the numbers for lambda = 1 and this size, shape (n,)."""
        variance = np.full(1, size**2)
        over = 1 / (1 + variance[:, None] * self._eigenvalues)
        inverse = self._woodbury_inverse(variance, over)[0]
        between_over = self._between * over
        diagonal = np.empty(self.y.size)
        start = 0
        for part in self._parts:
            stop = start + part.indices.size
            between = between_over[:, start:stop] @ part.axes
            correction = np.einsum("in,ij,jn->n", between, inverse, between)
            without_between = over[0, start:stop] @ part.axes**2
            diagonal[part.indices] = without_between - size**2 * correction
            start = stop
        return diagonal

    def farthest(self, pushes: Pushes, used: npt.NDArray[np.bool_], size: float) -> PushResidual:
        """Return the number that differs most, in units of its error, from its prediction by all other numbers.

        A push with a wrong sign or angle lies far from what the others let expect. `used`: True for those numbers of
        `pushes`, z then x, that are the measured numbers. `size`: of the medium, N/cm^3.
        """
        # leave-one-out residual of number i: (V^-1 r)_i / (V^-1)_ii, with the variance 1 / (V^-1)_ii
        variance = 1 / self._precision_of_each(size)
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
    """Return sizes (k,), N/cm^3, evenly spaced in their logarithm, and posterior weights of w, lambda and size.

    The weights have shape (w, lambda, k). `likelihoods`: one for each w. `departures`: lambda. `log_prior`: of w and
    lambda, shape (w, lambda, 1). The weights sum to 1. The prior of the logarithm of the size is flat, but falls for
    sizes that the errors would hide: pushes in directions where media have hardly any force would otherwise fit the
    weakest medium best.
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


def _independent_parts(rest: Blocks, covariance: FloatArray) -> list[npt.NDArray[np.intp]]:
    """Return the indices of numbers in two parts, z and x, that neither S nor errors connect, or else of all in one part.

    `rest`: K of the prior, whose blocks R has, too. `covariance`: of the errors.
    """
    if len(rest.indices) > 1 and not covariance[np.ix_(*rest.indices)].any():
        return [*rest.indices]
    return [np.arange(len(covariance))]


def are_independent(covariance: FloatArray) -> bool:
    """Return True if a covariance of errors is diagonal: shorter calculations then do."""
    return bool(np.count_nonzero(covariance) == np.count_nonzero(np.diag(covariance)))


def whitening(covariance: FloatArray) -> FloatArray:
    """Return the matrix that makes errors of this covariance (n, n) independent and 1, shape (n, n).

    For errors that are independent already its diagonal alone, shape (n,).
    """
    if are_independent(covariance):
        return 1 / np.sqrt(np.diag(covariance))
    return np.linalg.inv(np.linalg.cholesky(covariance))
