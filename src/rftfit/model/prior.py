"""Prior of alpha of a further medium: Gaussian, with the covariance C + (1 - w) K + w R of `rftfit.model.maps`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray, mirror
from rftfit.model.observations import Angles, ObservedRows
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "prior")


class Variation(NamedTuple):
    """Prior of the difference of a further medium from the known ones: amplitude and correlation lengths of K and R.

    `floor`, `share`: K has the standard deviation floor + share |m|, for a shape of size 1.
    `smooth`: share of the variance of K with a smooth kernel (squared exponential); the rest has a rough one (Matern
    3/2).
    `smooth_beta`, `smooth_gamma`, `rough_beta`, `rough_gamma`: correlation lengths of these two kernels, as chords
        between points (cos 2 beta, sin 2 beta) and between points (cos gamma, sin gamma).
    `media`: factor on the covariance of the known media.
    `own_beta`, `own_gamma`: correlation lengths of R (Matern 3/2), whose standard deviation is the same everywhere: the
        root mean square of floor + share |m|.
    `most_own`: the prior of the share w of R is flat from 0 to this.
    `departure_dof`: the prior of lambda is inverse gamma with these degrees of freedom and its mode at 1.
    `course_share`: standard deviation of the factor, 1 on average, on the course of 3D-RFT between the lines of the
        published grid.
    """

    floor: float
    share: float
    smooth: float
    smooth_beta: float
    smooth_gamma: float
    rough_beta: float
    rough_gamma: float
    media: float
    own_beta: float
    own_gamma: float
    most_own: float
    departure_dof: float
    course_share: float

    @property
    def rough_shares(self) -> FloatArray:
        """Values of w that are tried, evenly spaced."""
        return np.asarray(np.linspace(0, self.most_own, _CHOSEN.rough_shares), dtype=float)


class Prior(NamedTuple):
    """Prior of n numbers of a medium of size 1: alpha in some directions, or sums of alpha with weights.

    `mean`: m, shape (n,). `between` (k, n): between.T @ between is C. `smooth`, `rough`: K and R.
    """

    mean: FloatArray
    between: FloatArray
    smooth: Blocks
    rough: Blocks

    def at(self, places: npt.NDArray[np.intp]) -> Prior:
        """Return the prior of some of the numbers, in the order of `places`."""
        return Prior(
            self.mean[places],
            self.between[:, places],
            self.smooth.at(places),
            self.rough.at(places),
        )

    def by_blocks(self, counts: Sequence[int]) -> Prior:
        """Reorder all z, then all x, into blocks of directions, each z, then x; `counts`: directions of each."""
        places = np.arange(self.mean.size).reshape(2, -1)
        ends = np.cumsum([0, *counts])
        blocks = [places[:, start:stop].ravel() for start, stop in pairwise(ends)]
        return self.at(np.concatenate(blocks))

    def with_rows(self, rows: ObservedRows, nodes: npt.NDArray[np.intp], place: int) -> Prior:
        """Insert rows of contacts at index `place`; `nodes`: indices of alpha at the nodes of the map, z then x."""
        size = self.mean.size
        all_rows = np.zeros((size + len(rows.values), size))
        is_new = np.zeros(len(all_rows), dtype=bool)
        is_new[place : place + len(rows.values)] = True
        all_rows[~is_new] = np.eye(size)
        all_rows[np.ix_(is_new, nodes)] = rows.weights
        mean = all_rows @ self.mean
        mean[is_new] += rows.offset
        everywhere = (np.arange(len(all_rows)),)
        smooth, rough = (
            Blocks(everywhere, (all_rows @ blocks.whole() @ all_rows.T,))
            for blocks in (self.smooth, self.rough)
        )
        return Prior(mean, self.between @ all_rows.T, smooth, rough)

    def covariance(self, rough_share: float) -> FloatArray:
        """Return C + (1 - w) K + w R, where w is `rough_share`."""
        covariance = self.between.T @ self.between
        self.smooth.add_to(covariance, 1 - rough_share)
        self.rough.add_to(covariance, rough_share)
        return covariance


class Blocks(NamedTuple):
    """A symmetric matrix that is 0 outside of some blocks: 27 instead of 54 MB for a thousand pushes.

    `places`: for each block the indices of its rows (and columns) in the matrix, increasing. `squares`: its numbers.
    """

    places: tuple[npt.NDArray[np.intp], ...]
    squares: tuple[FloatArray, ...]

    def changed(self, change: Callable[[npt.NDArray[np.intp], FloatArray], FloatArray]) -> Blocks:
        """Return the matrix with each block replaced by ``change(places, square)``."""
        return Blocks(self.places, tuple(map(change, self.places, self.squares)))

    def at(self, places: npt.NDArray[np.intp]) -> Blocks:
        """Return the matrix of some rows and the same columns, in the order of `places`."""
        new_places, squares = [], []
        for block_places, square in zip(*self, strict=True):
            chosen = np.flatnonzero(np.isin(places, block_places))
            if chosen.size:
                rows = np.searchsorted(block_places, places[chosen])
                new_places.append(chosen)
                squares.append(square[np.ix_(rows, rows)])
        return Blocks(tuple(new_places), tuple(squares))

    def whole(self) -> FloatArray:
        """Return the whole matrix, with its zeros."""
        matrix = np.zeros((sum(places.size for places in self.places),) * 2)
        self.add_to(matrix)
        return matrix

    def add_to(self, whole: FloatArray, factor: float = 1.0) -> None:
        """Add this matrix times a factor to a whole matrix, in place."""
        for places, square in zip(*self, strict=True):
            whole[np.ix_(places, places)] += factor * square


def symmetric_correlation(
    beta: FloatArray, gamma: FloatArray, kernel: Callable[[FloatArray, FloatArray], FloatArray]
) -> Blocks:
    """Return correlations, by a kernel of chords, of functions on the torus (2 beta, gamma) with alpha's symmetry.

    Alpha_z is even under the mirror image; its variance is scaled to 1 everywhere. Alpha_x is odd; its variance
    goes to 0 where a direction is its own mirror image. Returns two blocks, z and x.
    """

    def kernel_to(angles: Angles) -> FloatArray:
        # kernel of the chords from each direction to each of `angles`, on both circles
        return kernel(
            2 * np.sin(beta[:, None] - angles[0]), 2 * np.sin((gamma[:, None] - angles[1]) / 2)
        )

    direct, mirrored = kernel_to((beta, gamma)), kernel_to(mirror(beta, gamma))
    size = np.sqrt(1 + np.diag(mirrored))
    even = (direct + mirrored) / size / size[:, None]
    places = np.arange(2 * beta.size)
    return Blocks((places[: beta.size], places[beta.size :]), (even, direct - mirrored))


def smooth_kernel(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the kernel of K for chords `beta` and `gamma`."""
    distance = np.hypot(beta / variation.smooth_beta, gamma / variation.smooth_gamma)
    kernel: FloatArray = variation.smooth * np.exp(-(distance**2) / 2)
    kernel += (1 - variation.smooth) * matern(
        np.hypot(beta / variation.rough_beta, gamma / variation.rough_gamma)
    )
    return kernel


def rough_kernel(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the kernel of R for chords `beta` and `gamma`."""
    return matern(np.hypot(beta / variation.own_beta, gamma / variation.own_gamma))


def matern(distance: FloatArray) -> FloatArray:
    """Return the Matern 3/2 kernel of distances in units of its length."""
    return np.asarray((1 + np.sqrt(3) * distance) * np.exp(-np.sqrt(3) * distance))


ZERO_VARIANCE: float = _CHOSEN.zero_variance
"""Variance below which there is none, relative to the largest, or of a shape whose size is 1."""


def root(covariance: FloatArray) -> FloatArray:
    """Return rows R with R.T @ R equal to a covariance: normal numbers times R have this covariance."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    keep = values > ZERO_VARIANCE * max(float(values[-1]), 1e-300)
    return np.asarray((vectors[:, keep] * np.sqrt(values[keep])).T)


def triangular_root(covariance: FloatArray) -> FloatArray:
    """Return triangular rows R with R.T @ R equal to a covariance; columns of numbers without variance are exactly 0.

    Raises the diagonal of `covariance` a little, in place, so that the decomposition succeeds.
    """
    variance = np.diag(covariance).copy()
    covariance[np.diag_indices(variance.size)] += ZERO_VARIANCE * variance.max()
    if variance.size < _CHOSEN.many_numbers:
        rows = np.linalg.cholesky(covariance).T
    else:
        # overwrites the covariance: numpy would make two copies of 54 MB each for a thousand pushes
        from scipy.linalg import cholesky

        rows = cholesky(covariance.T, lower=True, overwrite_a=True, check_finite=False).T
    rows[:, variance <= ZERO_VARIANCE] = 0.0
    return np.asarray(rows)
