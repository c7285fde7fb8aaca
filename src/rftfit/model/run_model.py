"""Gaussian model of the slopes of plate runs, which shared causes and axes are asked of.

The slopes y of a run, z and x, are those of its direction and an error of the run alone:

    y_i = E(direction of i) + e_i,    E = s (m + d),    d ~ N(0, lambda P + L)

m and P are mean and covariance of the shape of known media (`rftfit.model.shapes`), with `Freedom` for what media differ
in; L holds what the repeats of a direction share; `Scatter` gives the covariance of e; `RunGaussian` solves for all of them.
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
    """Scatter of runs about alpha of their direction, relative to alpha.

    Attributes
    ----------
    bed : float
        Standard deviation of a factor of both components: a bed is looser or denser as a whole.
    rest : float
        Standard deviation of each component alone.
    weak : float
        Share of the largest alpha that is added in squares to alpha where `rest` acts.
    floor : float
        Standard deviation of each component relative to the largest alpha.
    """

    bed: float
    rest: float
    weak: float
    floor: float

    def covariance(self, alpha: FloatArray, se: FloatArray) -> FloatArray:
        """Covariance of the slopes of each run, shape (n, 2, 2), for alpha and errors of the logs of shape (2, n)."""
        level = np.hypot(*alpha)
        largest = level.max(initial=0.0)
        alone = self.rest**2 * (level**2 + (self.weak * largest) ** 2) + (self.floor * largest) ** 2
        covariance = self.bed**2 * outer(alpha)
        for component in (0, 1):
            covariance[:, component, component] += alone + se[component] ** 2
        return covariance


class Freedom(NamedTuple):
    """Factors in which media differ beyond the known shape: of x, of pulls, of level runs, as standard deviations."""

    x: float
    pulls: float
    level: float

    def covariance(self, mean: FloatArray, gamma_deg: FloatArray) -> FloatArray:
        """Covariance, shape (2 n, 2 n), of a mean of shape (2 n,) at n directions."""
        gamma = np.tile(gamma_deg, 2)
        is_x = np.arange(mean.size) >= gamma_deg.size
        factors = self.x * is_x, self.pulls * (gamma < -1), self.level * (np.abs(gamma) <= 1)
        change = np.stack([mean * factor for factor in factors])
        return np.asarray(change.T @ change)


def prior_at(
    beta_deg: FloatArray,
    gamma_deg: FloatArray,
    rough_share: float = 0.0,
    freedom: Freedom | None = None,
    without: tuple[str, ...] = (),
) -> tuple[FloatArray, FloatArray]:
    """Return mean (2 n,) and covariance (2 n, 2 n) of alpha of a medium of size 1 at n directions.

    `rough_share`: Share of the rough shape (`rftfit.model.shapes`). `without`: Published media that are left out.
    """
    wrapped_beta = beta_apart(beta_deg, 0.0)
    prior = published_shapes(without=without).prior(np.radians(wrapped_beta), np.radians(gamma_deg))
    covariance = prior.covariance(rough_share)
    if freedom is not None:
        covariance = covariance + freedom.covariance(prior.mean, gamma_deg)
    return prior.mean, covariance


@dataclass(frozen=True, eq=False)
class RunGaussian:
    """Covariance V of the slopes of n runs about a known mean, solved through the m directions.

    Attributes
    ----------
    scatter : ndarray, shape (n, 2, 2)
        Covariance of the error of each run alone.
    direction : ndarray of int, shape (n,)
        Place of the direction of each run.
    shared : ndarray, shape (2 m, 2 m)
        Covariance of the directions, z first.
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
        """I + P Z' D^-1 Z of the directions."""
        count = len(self.shared) // 2
        gathered = np.zeros((2, count, 2, count))
        places = np.arange(count)
        for row, column in np.ndindex(2, 2):
            sums = np.bincount(self.direction, self.precision[:, row, column], minlength=count)
            gathered[row, places, column, places] = sums
        return np.eye(2 * count) + self.shared @ gathered.reshape(2 * count, -1)

    def sum_by_direction(self, columns: FloatArray) -> FloatArray:
        """Sums over the runs of each direction, shape (2 m, k), of columns of shape (2 n, k)."""
        by_run = columns.reshape(2, self.direction.size, -1)
        sums = np.zeros((2, len(self.shared) // 2, by_run.shape[2]))
        for component in (0, 1):
            np.add.at(sums[component], self.direction, by_run[component])
        return sums.reshape(-1, by_run.shape[2])

    def solve(self, columns: FloatArray) -> FloatArray:
        """V^-1 times columns of shape (2 n,) or (2 n, k)."""
        by_run = columns.reshape(2, self.direction.size, -1)
        weighted = np.einsum("nij,jnk->ink", self.precision, by_run)
        back = np.linalg.solve(self._inner, self.shared @ self.sum_by_direction(weighted))
        of_runs = back.reshape(2, -1, by_run.shape[2])[:, self.direction]
        weighted -= np.einsum("nij,jnk->ink", self.precision, of_runs)
        return np.asarray(weighted.reshape(columns.shape))

    @property
    def log_det(self) -> float:
        """Logarithm of the determinant of V."""
        return float(np.log(np.linalg.det(self.scatter)).sum() + np.linalg.slogdet(self._inner)[1])

    def score(
        self, residual: FloatArray, mean: FloatArray, effects: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Scores (k,) of effects (2 n, k) in a residual (2 n,), and their information (k, k), where the size of the mean is free."""
        solved = self.solve(np.column_stack([mean, effects]))
        solved_mean, solved_effects = solved[:, 0], solved[:, 1:]
        share = (mean @ solved_effects) / (mean @ solved_mean)
        size_free = solved_effects - np.outer(solved_mean, share)
        return residual @ size_free, effects.T @ size_free

    def leave_out(self, residual: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Predict the residual of the direction of each run from all other runs.

        Parameters
        ----------
        residual : ndarray, shape (2, n)
            Slopes less their mean.

        Returns
        -------
        predicted : ndarray, shape (2, n)
        covariance : ndarray, shape (n, 2, 2)
            Without the error of the run alone.
        """
        count = len(self.shared) // 2
        weighted = np.einsum("nij,jn->in", self.precision, residual)
        posterior = np.linalg.solve(self._inner, self.shared)
        expected = (posterior @ self.sum_by_direction(weighted.ravel())).reshape(2, -1)
        both = np.stack([self.direction, count + self.direction])
        with_run = np.linalg.inv(posterior[both[:, None], both].transpose(2, 0, 1))
        covariance = np.linalg.inv(with_run - self.precision)
        told_by_others = np.einsum("nij,jn->in", with_run, expected[:, self.direction]) - weighted
        predicted = np.einsum("nij,jn->in", covariance, told_by_others)
        return predicted, np.asarray(covariance, dtype=np.float64)


def outer(vectors: FloatArray) -> FloatArray:
    """Outer products of n vectors, shape (2, n), with themselves, shape (n, 2, 2)."""
    return np.asarray(np.einsum("in,jn->nij", vectors, vectors))
