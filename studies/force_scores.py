"""Scores of predicted forces, and the error of a force model that is learned from measured forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.forces.reference_kernel import angles, place, submerged

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.conventions import FloatArray
    from rftfit.forces.outlines import Outline
    from rftfit.model.profiles import Profile

LENGTH_DEG = 30.0
"""Correlation length of the model's error over the turn of a leg."""
LEAST_LOAD = 0.2
"""Load of a pose counts at least as this share of the largest load of the motion."""


def percent_inside(lo: FloatArray, hi: FloatArray, measured: FloatArray) -> float:
    """Percent of the numbers that lie inside their intervals, ends included."""
    return float(100 * np.mean((lo <= measured) & (measured <= hi)))


def interval_score(
    lo: FloatArray, hi: FloatArray, measured: FloatArray, confidence: float = 0.95
) -> float:
    """Mean interval score (Gneiting and Raftery 2007): width, and the distance of misses times 2 / (1 - confidence)."""
    miss = np.maximum(lo - measured, 0) + np.maximum(measured - hi, 0)
    return float(np.mean(hi - lo + 2 / (1 - confidence) * miss))


def crps(draws: FloatArray, measured: FloatArray) -> FloatArray:
    """Continuous ranked probability score of draws, shape (m, n), at each of n numbers."""
    count = len(draws)
    rank = 2 * np.arange(1, count + 1) - count - 1
    spread = rank @ np.sort(draws, axis=0) / count**2
    return np.asarray(np.abs(draws - measured).mean(axis=0) - spread)


def moved_peaks(draws: FloatArray, mean: FloatArray) -> FloatArray:
    """Largest value of each draw (m, n), moved so that their mean is the largest of the mean curve (n,).

    The noise of many poses makes the largest of a draw larger than that of the mean on average.
    """
    tops = draws.max(axis=1)
    return np.asarray(mean.max() + tops - tops.mean())


def mean_by_cluster(numbers: FloatArray, clusters: Sequence[str]) -> tuple[float, float]:
    """Mean of the means of the clusters, and its standard error: numbers of a cluster are not independent."""
    names = np.asarray(clusters)
    means = np.array([np.mean(np.asarray(numbers)[names == name]) for name in np.unique(names)])
    if means.size < 2:
        return float(means.mean()), float("nan")
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(means.size))


def learn_error(
    differences: Sequence[FloatArray], variances: Sequence[FloatArray], loads: Sequence[FloatArray]
) -> float:
    """Error of a force model over the load, from measured less predicted forces of curves.

    Maximum of the likelihood of the poses, each curve with the same weight: a difference is normal with the
    variance of alpha's draws plus (error times load)^2. Correlation between poses does not bias it. Without a
    variance of alpha it is the root mean square of difference over load.
    """
    from scipy.optimize import minimize_scalar

    curves = list(zip(differences, variances, loads, strict=True))

    def loss(logarithm: float) -> float:
        total = 0.0
        for difference, variance, load in curves:
            total_variance = variance + (np.exp(logarithm) * load) ** 2
            total += float(np.mean(np.log(total_variance) + difference**2 / total_variance))
        return total

    best = minimize_scalar(loss, bounds=(np.log(1e-3), np.log(10.0)), method="bounded")
    return float(np.exp(best.x))


def loads_of(profile: Profile, outline: Outline, poses: FloatArray) -> FloatArray:
    """Sum over elements of |alpha| |z| dA, both components, and at least a share of its largest: (draws, poses).

    It is the load without the cancellation that makes a net force small; 0 where no element is in the medium.
    """
    elements = place(outline.body, outline.width_cm, poses)
    depth_area, _ = submerged(elements, outline.solid)
    beta, gamma = angles(elements)
    pose, element = np.nonzero(depth_area > 0)
    alpha = profile.alpha(beta[pose, element], gamma[pose, element])
    sums = []
    for component in alpha:
        weighted = np.abs(np.atleast_2d(component)) * depth_area[pose, element]
        # elements of a pose stand together
        starts = np.searchsorted(pose, np.arange(len(poses)))
        total = np.concatenate([np.zeros((len(weighted), 1)), np.cumsum(weighted, axis=1)], axis=1)
        ends = np.append(starts[1:], pose.size)
        sums.append(total[:, ends] - total[:, starts])
    plain = np.hypot(*sums)
    least = LEAST_LOAD * plain.max(axis=1, keepdims=True)
    return np.where((depth_area > 0).any(axis=1), np.hypot(plain, least), 0.0)


def smooth_errors(angle_deg: FloatArray, shape: tuple[int, ...], seed: int) -> FloatArray:
    """Normal numbers of variance 1 over a motion, Matern 3/2 of `LENGTH_DEG`: shape (*shape, poses)."""
    distance = np.sqrt(3) * np.abs(angle_deg[:, None] - angle_deg) / LENGTH_DEG
    covariance = (1 + distance) * np.exp(-distance) + 1e-9 * np.eye(angle_deg.size)
    normals = np.random.default_rng(seed).standard_normal((*shape, angle_deg.size))
    return np.asarray(normals @ np.linalg.cholesky(covariance).T)
