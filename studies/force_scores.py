"""Scores of predicted forces and of alpha, and the error of a force model that is learned from measured forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from rftfit.compare.legs import extreme, measured_peak
from rftfit.model.draws import interval

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frame import Row

    from rftfit import Contact
    from rftfit.conventions import FloatArray

COMPONENTS = ("z", "x")
"""Lift and thrust, in the order of arrays of forces."""
CONFIDENCE = 0.95
LENGTH_DEG = 30.0
"""Correlation length of the model's error over the turn of a leg."""


def peak_of(contact: Contact, component: str) -> float:
    """Measured peak of the force z or x on a leg, N, with its sign."""
    measured = contact.measured[COMPONENTS.index(component)]
    return measured_peak(contact.motion.columns["theta_deg"], measured, component).force_N


def score_curve(contact: Contact, component: str, all_draws: FloatArray, means: FloatArray) -> Row:
    """Scores of the draws (m, 2, p) of force z or x on a leg in the poses with load, percent of the measured peak.

    `means`: best forces, shape (2, p). Draws without scatter have their number for an interval.
    """
    place = COMPONENTS.index(component)
    draws, mean, measured = all_draws[:, place], means[place], contact.measured[place]
    top, loaded = peak_of(contact, component), contact.touches
    highest = extreme(mean, component)
    sign = np.sign(mean[highest])
    lo, hi = interval(draws, CONFIDENCE)
    peak_lo, peak_hi = interval(moved_peaks(sign * draws, sign * mean), CONFIDENCE)
    percent = 100 / abs(top)
    return {
        "peak_percent": percent * abs(mean[highest]) - 100,
        "rms": percent * np.sqrt(np.mean((mean - measured)[loaded] ** 2)),
        "rms_all": percent * np.sqrt(np.mean((mean - measured) ** 2)),
        "inside": percent_inside(lo[loaded], hi[loaded], measured[loaded]),
        "peak_in": float(peak_lo <= sign * top <= peak_hi),
        "crps": percent * crps(draws, measured)[loaded].mean(),
        "score": percent * interval_score(lo[loaded], hi[loaded], measured[loaded]),
        "width": percent * np.mean((hi - lo)[loaded]),
    }


def score_alpha(draws: FloatArray, truth: FloatArray, mean: FloatArray, largest: float) -> Row:
    """Scores of draws (m, ...) of alpha, percent of the largest of the medium; the strongest quarter of the numbers apart."""
    lo, hi = interval(draws, CONFIDENCE)
    percent = 100 / largest
    strong = np.abs(truth) >= np.quantile(np.abs(truth), 0.75)
    return {
        "inside": percent_inside(lo, hi, truth),
        "inside_strong": percent_inside(lo[strong], hi[strong], truth[strong]),
        "score": percent * interval_score(lo, hi, truth),
        "rms": percent * np.sqrt(np.mean((mean - truth) ** 2)),
        "width": percent * np.mean(hi - lo),
        "half": percent * np.sqrt(np.mean((hi - lo) ** 2)) / 2,
    }


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
    means = pd.Series(numbers).groupby([*clusters]).mean()
    mean, error = means.agg(["mean", "sem"]).to_numpy(float)
    return float(mean), float(error)


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


def smooth_errors(angle_deg: FloatArray, shape: tuple[int, ...], seed: int) -> FloatArray:
    """Normal numbers of variance 1 over a motion, Matern 3/2 of `LENGTH_DEG`: shape (*shape, poses)."""
    distance = np.sqrt(3) * np.abs(angle_deg[:, None] - angle_deg) / LENGTH_DEG
    covariance = (1 + distance) * np.exp(-distance) + 1e-9 * np.eye(angle_deg.size)
    normals = np.random.default_rng(seed).standard_normal((*shape, angle_deg.size))
    return np.asarray(normals @ np.linalg.cholesky(covariance).T)
