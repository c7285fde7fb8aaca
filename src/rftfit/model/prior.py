"""Prior of alpha of a further medium: Gaussian, with the covariance C + (1 - w) K + w R of `rftfit.model.maps`.

It is that of a medium of size 1 (root mean square of alpha over the published grid). m is the mean shape of the known
media, C their covariance; K, smooth, and R, rough, let a further medium differ from all known ones; w is the share of
R; lambda (departure) multiplies the whole covariance. Numbers of the prior are alpha in n directions, all z, then all
x.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    `smooth`: share of the variance of K with a squared exponential kernel; the rest has a Matern 3/2 kernel.
    `smooth_beta`, `smooth_gamma`: correlation lengths of the squared exponential kernel, as chords between points
        (cos 2 beta, sin 2 beta) and between points (cos gamma, sin gamma).
    `matern_beta`, `matern_gamma`: the same of the Matern kernel of K.
    `media`: factor on the covariance of the known media.
    `rough_beta`, `rough_gamma`: correlation lengths of R (Matern 3/2), whose standard deviation is the same everywhere:
        the root mean square of floor + share |m|.
    `most_rough`: the prior of the share w of R is flat from 0 to this.
    `departure_dof`: the prior of lambda is inverse gamma with these degrees of freedom and its mode at 1.
    `course_share`: standard deviation of the factor, 1 on average, on the course of 3D-RFT between the lines of the
        published grid.
    """

    floor: float
    share: float
    smooth: float
    smooth_beta: float
    smooth_gamma: float
    matern_beta: float
    matern_gamma: float
    media: float
    rough_beta: float
    rough_gamma: float
    most_rough: float
    departure_dof: float
    course_share: float

    @property
    def rough_shares(self) -> FloatArray:
        """Values of w that are tried, evenly spaced."""
        return np.linspace(0, self.most_rough, _CHOSEN.rough_shares)


class Prior(NamedTuple):
    """Prior of n numbers of a medium of size 1: alpha in some directions, or sums of alpha with weights.

    `mean`: m, shape (n,). `between` (k, n): between.T @ between is C, the covariance between known media. `smooth`,
    `rough`: K and R.
    """

    mean: FloatArray
    between: FloatArray
    smooth: Blocks
    rough: Blocks

    def select(self, indices: npt.NDArray[np.intp]) -> Prior:
        """Return the prior of some of the numbers, in the order of `indices`."""
        return Prior(
            self.mean[indices],
            self.between[:, indices],
            self.smooth.select(indices),
            self.rough.select(indices),
        )

    def insert_rows(self, rows: ObservedRows, nodes: npt.NDArray[np.intp], position: int) -> Prior:
        """Return the prior with combinations of measured forces as further numbers, from index `position` on.

        A combination is a weighted sum of alpha, so its mean and covariance follow from those of alpha. `nodes`:
        indices of alpha at the nodes of the map, to which the weights of the rows belong, z then x.
        """
        size = self.mean.size
        # each number of the new prior as weights of the numbers of this one
        weights = np.insert(np.eye(size), position, np.zeros((rows.values.size, size)), axis=0)
        is_new = np.zeros(len(weights), dtype=bool)
        is_new[position : position + rows.values.size] = True
        weights[np.ix_(is_new, nodes)] = rows.weights
        mean = weights @ self.mean
        mean[is_new] += rows.offset
        all_indices = (np.arange(len(weights)),)
        smooth, rough = (
            Blocks(all_indices, (weights @ blocks.whole() @ weights.T,))
            for blocks in (self.smooth, self.rough)
        )
        return Prior(mean, self.between @ weights.T, smooth, rough)

    def covariance(self, rough_share: float) -> FloatArray:
        """Return C + (1 - w) K + w R, where w is `rough_share`, shape (n, n)."""
        covariance = self.between.T @ self.between
        self.smooth.add_to(covariance, 1 - rough_share)
        self.rough.add_to(covariance, rough_share)
        return covariance


def order_by_blocks(counts: Sequence[int]) -> npt.NDArray[np.intp]:
    """Return indices that sort alpha of n directions, z then x, into blocks of directions, each z then x.

    For counts 1, 2 they are 0, 3, 1, 2, 4, 5. `counts`: number of directions of each block; their sum is n.
    """
    z_and_x = np.arange(2 * sum(counts)).reshape(2, -1)
    return np.concatenate(
        [block.ravel() for block in np.split(z_and_x, np.cumsum(counts)[:-1], axis=1)]
    )


class Blocks(NamedTuple):
    """A symmetric matrix that is 0 outside of some blocks: 27 instead of 54 MB for a thousand pushes.

    `indices`: for each block the indices of its rows (and columns) in the matrix, increasing. `squares`: the blocks.
    """

    indices: tuple[npt.NDArray[np.intp], ...]
    squares: tuple[FloatArray, ...]

    def select(self, indices: npt.NDArray[np.intp]) -> Blocks:
        """Return the matrix of some rows and the same columns, in the order of `indices`; a block without a row goes."""
        new_indices, squares = [], []
        for block_indices, square in zip(*self, strict=True):
            selected = np.flatnonzero(np.isin(indices, block_indices))
            if selected.size:
                rows = np.searchsorted(block_indices, indices[selected])
                new_indices.append(selected)
                squares.append(square[np.ix_(rows, rows)])
        return Blocks(tuple(new_indices), tuple(squares))

    @property
    def diagonal(self) -> FloatArray:
        """Diagonal of the matrix."""
        diagonal = np.empty(sum(indices.size for indices in self.indices))
        for indices, square in zip(*self, strict=True):
            diagonal[indices] = np.diag(square)
        return diagonal

    def whole(self) -> FloatArray:
        """Return the whole matrix, with its zeros."""
        matrix = np.zeros((sum(indices.size for indices in self.indices),) * 2)
        self.add_to(matrix)
        return matrix

    def add_to(self, whole: FloatArray, factor: float = 1.0) -> None:
        """Add this matrix times a factor to a whole matrix, in place."""
        for indices, square in zip(*self, strict=True):
            whole[np.ix_(indices, indices)] += factor * square


def symmetric_correlation(
    beta: FloatArray, gamma: FloatArray, kernel: Callable[[FloatArray, FloatArray], FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return correlations of alpha_z and of alpha_x between n directions (rad), each of shape (n, n).

    `kernel`: function of the chords between two directions on the circles of 2 beta and of gamma, which returns their
    correlation without symmetry. Alpha_z is even under the mirror image; its variance is scaled to 1 everywhere.
    Alpha_x is odd; its variance goes to 0 where a direction is its own mirror image, as alpha_x itself does.
    """

    def kernel_to(angles: Angles) -> FloatArray:
        """Return the kernel between the n directions and others (m,), shape (n, m)."""
        # chords of circles of radius 1: twice the sine of half the angle, of 2 beta and of gamma
        return kernel(
            2 * np.sin(beta[:, None] - angles[0]), 2 * np.sin((gamma[:, None] - angles[1]) / 2)
        )

    # covariances k(a, b) + k(a, mirror of b) of an even function, and their difference of an odd one
    direct, mirrored = kernel_to((beta, gamma)), kernel_to(mirror(beta, gamma))
    sd_even = np.sqrt(1 + np.diag(mirrored))
    return (direct + mirrored) / sd_even / sd_even[:, None], direct - mirrored


def smooth_kernel(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the kernel of K for chords `beta` and `gamma` of one shape: a squared exponential and a Matern 3/2 kernel.

    The first lets alpha change smoothly, the second less smoothly.
    """
    distance = np.hypot(beta / variation.smooth_beta, gamma / variation.smooth_gamma)
    kernel: FloatArray = variation.smooth * np.exp(-(distance**2) / 2)
    kernel += (1 - variation.smooth) * matern(
        np.hypot(beta / variation.matern_beta, gamma / variation.matern_gamma)
    )
    return kernel


def rough_kernel(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the kernel of R for chords `beta` and `gamma` of one shape: Matern 3/2, over shorter angles than K."""
    return matern(np.hypot(beta / variation.rough_beta, gamma / variation.rough_gamma))


def matern(distance: FloatArray) -> FloatArray:
    """Return the Matern 3/2 kernel of distances in units of its length: (1 + root(3) d) exp(-root(3) d), in their shape."""
    return np.asarray((1 + np.sqrt(3) * distance) * np.exp(-np.sqrt(3) * distance))


ZERO_VARIANCE: float = _CHOSEN.zero_variance
"""Variance below which there is none, relative to the largest, or of a shape whose size is 1."""


def root(covariance: FloatArray) -> FloatArray:
    """Return rows, (k, n), whose R.T @ R is a covariance (n, n): normal numbers (k,) times R have this covariance.

    Axes without variance are left out, so k is at most n.
    """
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    keep = values > ZERO_VARIANCE * max(float(values[-1]), 1e-300)
    return np.asarray((vectors[:, keep] * np.sqrt(values[keep])).T)


def triangular_root(covariance: FloatArray) -> FloatArray:
    """Return triangular rows R, (n, n), with R.T @ R equal to a covariance.

    Columns of numbers without variance are exactly 0. The first numbers then depend on the first normal numbers alone.
    Overwrites `covariance`: its diagonal is raised a little, so that the decomposition succeeds, and a large one is
    used up as memory.
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
