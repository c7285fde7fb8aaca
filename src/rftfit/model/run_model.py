"""Gaussian model of the slopes of plate runs, by which checks search for shared causes and wrong axes.

The slopes y of a run (z and x) are the sum of those of its direction and of an error of the run alone:

    y_i = E(direction of i) + e_i,    E = s (m + d),    d ~ N(0, lambda P + L)

s is the size of the medium. m and P are mean and covariance of the shape of known media (`rftfit.model.shapes`), where
P includes `Freedom`, further differences between media. L is the covariance of errors that repeats of a direction
share. `Scatter` gives the covariance of e; `RunGaussian` solves linear systems with the covariance of all slopes.

There are n runs in m directions. Numbers of runs are vectors (2 n,), those of directions (2 m,): all z, then all x,
N/cm^3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.directions import beta_apart
from rftfit.model.shapes import published_shapes


class Scatter(NamedTuple):
    """Standard deviations of the slopes of runs about alpha of their direction, relative to alpha.

    Attributes
    ----------
    bed : float
        Of a factor common to both components: a whole bed is looser or denser.
    rest : float
        Of each component alone, relative to the size of alpha and `weak` times the largest size, added in squares.
    weak : float
        Share of the largest alpha, see `rest`.
    floor : float
        Of each component alone, relative to the largest alpha.
    """

    bed: float
    rest: float
    weak: float
    floor: float

    def covariance(self, alpha: FloatArray, se: FloatArray) -> FloatArray:
        """Return the covariance of the slopes of each run, shape (n, 2, 2).

        `alpha`, `se`: alpha of the direction of each run and standard errors of its slopes, shape (2, n), z first,
        N/cm^3.
        """
        size = np.hypot(*alpha)
        largest = size.max(initial=0.0)
        alone = self.rest**2 * (size**2 + (self.weak * largest) ** 2) + (self.floor * largest) ** 2
        covariance = self.bed**2 * outer(alpha)
        for component in (0, 1):
            covariance[:, component, component] += alone + se[component] ** 2
        return covariance


class Freedom(NamedTuple):
    """Standard deviations of factors on alpha by which media differ beyond the known shape.

    `x` acts on alpha_x; `pulls` (motion upward, gamma < 0) and `level` (gamma = 0) act on both components.
    """

    x: float
    pulls: float
    level: float

    def covariance(self, mean: FloatArray, gamma_deg: FloatArray) -> FloatArray:
        """Return the covariance (2 n, 2 n) of alpha by these factors, at n directions.

        `mean`: mean alpha, (2 n,), z first. `gamma_deg`: (n,).
        """
        gamma = np.tile(gamma_deg, 2)
        is_x = np.arange(mean.size) >= gamma_deg.size
        # runs within a degree of level count as level
        factors = self.x * is_x, self.pulls * (gamma < -1), self.level * (np.abs(gamma) <= 1)
        change = np.stack([mean * factor for factor in factors])
        return np.asarray(change.T @ change)


def prior_at(
    beta_deg: FloatArray,
    gamma_deg: FloatArray,
    rough_share: float = 0.0,
    freedom: Freedom | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return mean (2 n,) and covariance (2 n, 2 n) of alpha, z first, of a medium of size 1 at n directions, degrees.

    `rough_share`: share w of the rough covariance (`rftfit.model.prior`). `freedom`: further differences between media;
    None: only those of the known shape.
    """
    wrapped_beta = beta_apart(beta_deg, 0.0)
    prior = published_shapes().prior(np.radians(wrapped_beta), np.radians(gamma_deg))
    covariance = prior.covariance(rough_share)
    if freedom is not None:
        covariance = covariance + freedom.covariance(prior.mean, gamma_deg)
    return prior.mean, covariance


@dataclass(frozen=True, eq=False)
class RunGaussian:
    """Covariance V of the slopes of n runs in m directions about a known mean.

    Linear systems with V are solved with matrices of size 2 m, not 2 n (Woodbury): V = D + Z P Z', where D is
    `scatter`, P is `shared`, and Z gives each run the values of its direction.

    Attributes
    ----------
    scatter : ndarray, shape (n, 2, 2)
        Covariance of the error of each run alone.
    direction : ndarray of int, shape (n,)
        Number of the direction of each run, from 0 to m - 1.
    shared : ndarray, shape (2 m, 2 m)
        Covariance of the slopes of the directions, z first.
    """

    scatter: FloatArray
    direction: npt.NDArray[np.intp]
    shared: FloatArray

    @cached_property
    def precision(self) -> FloatArray:
        """Inverse covariance of each run alone, shape (n, 2, 2)."""
        return np.asarray(np.linalg.inv(self.scatter), dtype=np.float64)

    @cached_property
    def _inner(self) -> FloatArray:
        """Matrix I + P Z' D^-1 Z, shape (2 m, 2 m), by which Woodbury's formula inverts V."""
        count = len(self.shared) // 2
        precision_sums = np.zeros((2, count, 2, count))  # Z' D^-1 Z
        directions = np.arange(count)
        for row, column in np.ndindex(2, 2):
            sums = np.bincount(self.direction, self.precision[:, row, column], minlength=count)
            precision_sums[row, directions, column, directions] = sums
        return np.eye(2 * count) + self.shared @ precision_sums.reshape(2 * count, -1)

    def sum_by_direction(self, columns: FloatArray) -> FloatArray:
        """Return sums of columns of shape (2 n, k) over the runs of each direction, shape (2 m, k): Z' times them."""
        by_run = columns.reshape(2, self.direction.size, -1)
        sums = np.zeros((2, len(self.shared) // 2, by_run.shape[2]))
        for component in (0, 1):
            np.add.at(sums[component], self.direction, by_run[component])
        return sums.reshape(-1, by_run.shape[2])

    def solve(self, columns: FloatArray) -> FloatArray:
        """Return V^-1 times columns of shape (2 n,) or (2 n, k), in the same shape.

        V^-1 = D^-1 - D^-1 Z (I + P Z' D^-1 Z)^-1 P Z' D^-1 (Woodbury).
        """
        by_run = columns.reshape(2, self.direction.size, -1)
        weighted = np.einsum("nij,jnk->ink", self.precision, by_run)
        by_direction = np.linalg.solve(self._inner, self.shared @ self.sum_by_direction(weighted))
        correction = by_direction.reshape(2, -1, by_run.shape[2])[:, self.direction]
        weighted -= np.einsum("nij,jnk->ink", self.precision, correction)
        return np.asarray(weighted.reshape(columns.shape))

    @property
    def log_det(self) -> float:
        """Logarithm of the determinant of V, for likelihoods: log det D + log det(I + P Z' D^-1 Z)."""
        return float(np.log(np.linalg.det(self.scatter)).sum() + np.linalg.slogdet(self._inner)[1])

    def score(
        self, residual: FloatArray, mean: FloatArray, effects: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the scores (k,) of effects (2 n, k) in a residual (2 n,), and their information matrix (k, k).

        The most likely sizes of the effects are the inverse of that matrix times the scores. An effect is the change of
        all slopes by a shared cause of size 1. The size of the mean (2 n,) is free: the part of an effect that is
        proportional to the mean does not count.
        """
        solved = self.solve(np.column_stack([mean, effects]))
        solved_mean, solved_effects = solved[:, 0], solved[:, 1:]
        share_of_mean = (mean @ solved_effects) / (mean @ solved_mean)
        beside_mean = solved_effects - np.outer(solved_mean, share_of_mean)
        return residual @ beside_mean, effects.T @ beside_mean

    def leave_out(self, residual: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Predict for each run the residual of its direction from all other runs.

        Parameters
        ----------
        residual : ndarray, shape (2, n)
            Slopes less their mean.

        Returns
        -------
        predicted : ndarray, shape (2, n)
        covariance : ndarray, shape (n, 2, 2)
            Covariance of `predicted`, to which the error of the run itself is not added.
        """
        count = len(self.shared) // 2
        weighted = np.einsum("nij,jn->in", self.precision, residual)
        posterior = np.linalg.solve(self._inner, self.shared)
        expected = (posterior @ self.sum_by_direction(weighted.ravel())).reshape(2, -1)
        z_and_x = np.stack([self.direction, count + self.direction])
        # the precision of the direction by all runs, less the precision that the run itself adds
        precision_by_all = np.linalg.inv(posterior[z_and_x[:, None], z_and_x].transpose(2, 0, 1))
        covariance = np.linalg.inv(precision_by_all - self.precision)
        weighted_by_all = np.einsum("nij,jn->in", precision_by_all, expected[:, self.direction])
        predicted = np.einsum("nij,jn->in", covariance, weighted_by_all - weighted)
        return predicted, np.asarray(covariance, dtype=np.float64)


def outer(vectors: FloatArray) -> FloatArray:
    """Return the outer product of each of n vectors, shape (2, n), with itself, shape (n, 2, 2)."""
    return np.asarray(np.einsum("in,jn->nij", vectors, vectors))
