"""Scatter of repeats, along the force and across: one estimate for errors of alpha and for the comparison of media.

The force of a run differs from the mean of its direction along that mean, as a bed is looser or denser as a whole, and
across it (at right angles), as grains differ from patch to patch. Both standard deviations are in proportion to the
force, with a floor f for weak directions: variance along = s^2 (|alpha|^2 + f^2 |alpha|_max^2) / (1 + f^2), and the
same across, with an s of its own. Few repeats determine s but hardly f, so all `FLOORS` are kept, each weighted by its
likelihood.

A *force* here is alpha, the vector (z, x) of stress over depth, N/cm^3; *along* and *across* are its directions. Arrays
of shape (floors,) have an element for each of `FLOORS`. `scatter_of_repeats` finds a `RunScatter` from `Repeats`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rftfit.conventions import BoolArray, FloatArray
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `repeats`, says what each decides
_CHOSEN = chosen("measure", "repeats")

FLOORS = np.array(_CHOSEN.floors)
"""Floors f, as fractions of the largest force. With the last one the scatter is nearly the same in all directions."""


class Repeats(NamedTuple):
    """Differences between repeats of each direction, what `scatter_of_repeats` needs of them; shape (directions,) each.

    Attributes
    ----------
    dof : ndarray
        Number of runs minus one.
    along, across : ndarray
        Sum of squares of the runs about their mean, along the mean force and across, (N/cm^3)^2.
    across_known : ndarray of bool
        True if all runs have both components.
    noise_along, noise_across : ndarray
        Variance of a single run by the errors that its log shows, (N/cm^3)^2.
    size : ndarray
        Size of the mean force, N/cm^3.
    largest : ndarray
        Largest force of the medium, N/cm^3.
    """

    dof: FloatArray
    along: FloatArray
    across: FloatArray
    across_known: BoolArray
    noise_along: FloatArray
    noise_across: FloatArray
    size: FloatArray
    largest: FloatArray


def joined(repeats: Iterable[Repeats]) -> Repeats:
    """Join the directions of several media, so that one scatter can be found for all."""
    return Repeats(*(np.concatenate(arrays) for arrays in zip(*repeats, strict=True)))


def along_and_across(alpha: FloatArray, variance: FloatArray) -> tuple[float, float, float, float]:
    """Return ``along``, ``across``, ``noise_along`` and ``noise_across`` of `Repeats` for the runs of one direction.

    `alpha`, `variance`: Alpha and the variance that the log shows, z and x, shape (2, runs).
    """
    mean = alpha.mean(axis=1)
    units = unit_vectors(mean)
    along, across = ((units @ (alpha - mean[:, None])) ** 2).sum(axis=1)
    noise_along, noise_across = units**2 @ variance.mean(axis=1)
    return float(along), float(across), float(noise_along), float(noise_across)


def unit_vectors(force: FloatArray) -> FloatArray:
    """Unit vectors along a `force` of shape (2, ...), then across it, shape (2, 2, ...); along z without a force.

    Across is the force turned by 90 degrees: (-x, z) for a force (z, x).
    """
    size = np.hypot(*force)
    along = np.where(size > 0, force, np.array([1.0, 0.0]).reshape(2, *[1] * size.ndim))
    along = along / np.where(size > 0, size, 1.0)
    return np.stack([along, np.stack([-along[1], along[0]])])


@dataclass(frozen=True)
class RunScatter:
    """Scatter of single runs about the alpha of their direction, for each floor in `FLOORS`.

    Attributes
    ----------
    along, across : ndarray, shape (floors,)
        Relative standard deviations s along the force and across, for the largest force.
    weight : ndarray, shape (floors,)
        Probability of each floor.
    dof : float
        Degrees of freedom of the repeats and of the prior together.
    """

    along: FloatArray
    across: FloatArray
    weight: FloatArray
    dof: float

    def relative(self) -> tuple[float, float]:
        """Relative standard deviations along and across the largest force, averaged over the floors."""
        along, across = (math.sqrt(self.weight @ s**2) for s in (self.along, self.across))
        return along, across

    def covariance(self, alpha: FloatArray, size: FloatArray, largest: float) -> FloatArray:
        """Covariance of single runs, shape (n, 2, 2), for forces along `alpha`, shape (2, n), of `size`, shape (n,)."""
        level = level_of_floors(size, largest)
        covariance = np.zeros((size.size, 2, 2))
        for unit, s in zip(unit_vectors(alpha), (self.along, self.across), strict=True):
            covariance += np.einsum("n,in,jn->nij", self.weight * s**2 @ level, unit, unit)
        return covariance

    def variance_at(self, alpha: FloatArray, component: int, largest: float) -> tuple[float, float]:
        """Return the variance of a component of single runs, and its degrees of freedom.

        `alpha`: Alpha of the direction, N/cm^3, shape (2,). `component`: 0 for z, 1 for x. `largest`: Largest force of
        the medium. The degrees of freedom account for the errors of both scatters and for the unknown floor.
        """
        # parts of the variances along and across that fall on the component
        shares = unit_vectors(alpha)[:, component] ** 2
        level = level_of_floors(np.hypot(*alpha)[None], largest)[:, 0]
        along, across = (
            share * s**2 * level for share, s in zip(shares, (self.along, self.across), strict=True)
        )
        by_floor = along + across
        variance = float(self.weight @ by_floor)
        # the estimate V of a variance with n degrees of freedom has itself the variance 2 V^2 / n
        of_repeats = 2 * (along**2 + across**2) / self.dof
        variance_of_variance = float(self.weight @ (of_repeats + (by_floor - variance) ** 2))
        dof = 2 * variance**2 / variance_of_variance if variance_of_variance > 0 else math.inf
        return variance, dof


def level_of_floors(size: FloatArray, largest: FloatArray | float) -> FloatArray:
    """Factor of s^2 in the variance of forces of `size`, shape (n,), for each floor, (N/cm^3)^2: shape (floors, n).

    This is (|alpha|^2 + f^2 |alpha|_max^2) / (1 + f^2), which is |alpha|^2 for the largest force, whatever the floor.
    """
    squares = size**2 + (FLOORS[:, None] * largest) ** 2
    return np.asarray(squares / (1 + FLOORS[:, None] ** 2))


_USUAL_FLOORS = np.array(_CHOSEN.usual_floors)
"""Probability of each floor before any repeat is seen."""


def usual_scatter(along: float, across: float) -> RunScatter:
    """Make the scatter that is assumed before any repeat is seen: s along and across, the same for each floor."""
    by_floor = np.ones(FLOORS.size)
    return RunScatter(along * by_floor, across * by_floor, _USUAL_FLOORS, 0.0)


_SCATTERS = np.geomspace(_CHOSEN.least_scatter, _CHOSEN.most_scatter, 500)
"""Values of s, the relative scatter at the largest force, whose likelihoods are compared; the smallest counts as 0."""

_NO_VARIANCE = 1e-30
"""Least variance in a likelihood, as repeats may be equal, (N/cm^3)^2."""


def scatter_of_repeats(
    repeats: Repeats, prior: RunScatter | None = None, prior_dof: float = 0.0
) -> RunScatter:
    """Find the most likely scatter of single runs about the mean of their direction, besides the errors of their logs.

    For each floor, the s along and the s across with the largest likelihood; the floors are then weighted by theirs.

    `repeats`: All directions of one medium or more.
    `prior`: Scatter that is assumed before, which counts as `prior_dof` degrees of freedom; None: none is assumed.
    """
    level = level_of_floors(repeats.size, repeats.largest)
    likelihood = np.zeros(FLOORS.size)
    # of each floor the most likely scatter, along the force and across, and the likelihood of both together
    scatters = np.zeros((2, FLOORS.size))
    components = (
        (repeats.along, repeats.noise_along, repeats.dof),
        (repeats.across, repeats.noise_across, repeats.dof * repeats.across_known),
    )
    for component, columns in enumerate(components):
        has_repeats = columns[2] > 0
        squares, noise_variance, dof = (column[has_repeats] for column in columns)
        for floor in range(FLOORS.size):
            # rows: scatters that are compared; columns: directions
            variance = _SCATTERS[:, None] ** 2 * level[floor, has_repeats] + noise_variance
            variance = np.maximum(variance, _NO_VARIANCE)
            # log likelihood of normal runs about their mean
            likelihoods = -0.5 * (dof * np.log(variance) + squares / variance).sum(axis=1)
            if prior is not None:
                # inverse chi-square
                usual = (prior.along, prior.across)[component][floor]
                ratio = usual / _SCATTERS
                likelihoods += prior_dof * (np.log(ratio) - 0.5 * ratio**2)
            scatters[component, floor], most = _find_maximum(likelihoods)
            likelihood[floor] += most
    weight = np.exp(likelihood - likelihood.max())
    if prior is not None:
        weight *= prior.weight
    return RunScatter(
        scatters[0], scatters[1], weight / weight.sum(), float(repeats.dof.sum()) + prior_dof
    )


def _find_maximum(likelihoods: FloatArray) -> tuple[float, float]:
    """Return the scatter in `_SCATTERS` with the largest log likelihood, and that likelihood.

    Both are the vertex of the parabola through three neighbours, in steps of the logarithm of the scatter.
    """
    largest = int(likelihoods.argmax())
    if largest == 0:
        return 0.0, float(likelihoods[0])
    if largest == likelihoods.size - 1:
        return float(_SCATTERS[-1]), float(likelihoods[-1])
    before, most, after = likelihoods[largest - 1 : largest + 2]
    bend = before - 2 * most + after
    step = 0.5 * (before - after) / bend if bend else 0.0
    ratio = _SCATTERS[1] / _SCATTERS[0]
    return float(_SCATTERS[largest] * ratio**step), float(most - 0.25 * (before - after) * step)
