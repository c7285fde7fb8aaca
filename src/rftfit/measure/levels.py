"""Levels of a number in many rows: its median, two clusters, consecutive runs with a shifted level, and stretches.

``values`` has an element for each row or run, in their order, shape (n,), in any unit. A *level* is the number about
which values scatter; a *stretch* is a sequence of neighbouring rows that are alike. Masks are bool, shape (n,).
"""

from __future__ import annotations

import math

import numpy as np

from rftfit.conventions import BoolArray, FloatArray, IndexArray
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `levels`, says what each decides
_CHOSEN = chosen("measure", "levels")


def median(values: FloatArray) -> float:
    """Median of finite values; NaN of none, without the warning of numpy."""
    return float(np.median(values)) if values.size else math.nan


def sd_by_median(deviations: FloatArray) -> FloatArray:
    """Standard deviation of normal numbers by the median of the size of their deviations, along the last axis.

    A few numbers far away, which would decide a usual standard deviation, hardly change it.
    """
    return np.asarray(1.4826 * np.median(np.abs(deviations), axis=-1))


FEW_RUNS = 3
"""Fewest runs whose median has a standard error."""

_DEVIATION_OF_MEAN = math.sqrt(math.pi / 2)
"""Standard deviation of normal numbers over their mean deviation from the median."""


def median_of_runs(values: FloatArray) -> tuple[float, float]:
    """Return the median of some runs and its standard error, from their scatter; NaN for fewer than three.

    The scatter is the mean deviation, with which the ratio of error to standard error follows Student's t. The median
    deviation of few runs is often too small by chance: of nine runs, limits are exceeded 50 times as often as Student's
    t says.
    """
    if values.size < FEW_RUNS:
        return math.nan, math.nan
    middle = float(np.median(values))
    scatter = _DEVIATION_OF_MEAN * float(np.abs(values - middle).mean())
    # the median of normal numbers scatters 1.2533 times as much as their mean
    return middle, 1.2533 * scatter / math.sqrt(values.size)


def _fewest_in_cluster(count: int) -> int:
    """Fewest runs of a cluster among `count` runs."""
    share_of_runs: int = math.ceil(_CHOSEN.cluster * count)
    return max(FEW_RUNS + 1, share_of_runs)


MODES: float = _CHOSEN.modes
"""Least difference of two clusters over their spread."""


def two_clusters(values: FloatArray) -> tuple[float, BoolArray] | None:
    """Split values into two clusters and mark one of them; None where there is only one cluster.

    Two clusters show that a cause, as a surface that was set anew, divides the runs. Every split of the ordered values
    is tried; that with the smallest deviations from the medians of both sides counts, if these are far apart.

    Returns how clear the split is (difference over spread over `MODES`, more than 1), and True for the values of the
    smaller cluster; of two equally large clusters, for that farther from 0.
    """
    count, fewest = values.size, _fewest_in_cluster(values.size)
    best: tuple[float, BoolArray] = (1.0, np.zeros(count, dtype=bool))
    least_deviation = math.inf
    # place of each value among all in ascending order; equal ones in the order of runs
    ranks = np.argsort(np.argsort(values, kind="stable"))
    for split in range(fewest, count - fewest + 1):
        above = ranks >= split
        middles = np.median(values[above]), np.median(values[~above])
        deviation = np.abs(values - np.where(above, *middles))
        largest_deviation = float(max(deviation[above].mean(), deviation[~above].mean()))
        spread = max(_DEVIATION_OF_MEAN * largest_deviation, _CHOSEN.least_spread)
        clear = float(abs(middles[0] - middles[1])) / spread / MODES
        if clear > 1.0 and deviation.sum() < least_deviation - 1e-9:
            best, least_deviation = (clear, above), float(deviation.sum())
    clear, above = best
    if clear <= 1.0:
        return None
    sizes = above.sum(), (~above).sum()
    farther = abs(np.median(values[above])) >= abs(np.median(values[~above]))
    mark_above = sizes[0] < sizes[1] or (sizes[0] == sizes[1] and farther)
    return clear, above if mark_above else ~above


def shifted_runs(common: FloatArray, level: FloatArray, sigma: FloatArray) -> BoolArray:
    """Find the consecutive runs whose common shift of `level` is most significant, and mark them, shape (runs,).

    Something may have changed for a while, as a gain or the zero of the arm. All stretches of runs are tried by least
    squares of a shift beside `common`. If the shifted runs are more than half, the others are marked; none if there are
    too few runs. The result says which runs are most likely shifted, not that they are.

    `common`: Columns of effects that all runs share and that are fitted beside the shift, shape (runs, k).
    `level`: Number of each run, with the standard errors `sigma`, shape (runs,).
    """
    count, fewest = level.size, _fewest_in_cluster(level.size)
    # runs at which a stretch may begin or end, at most 301
    ends = np.unique(np.linspace(0, count, min(count, 300) + 1).astype(int))
    first, last = (ends[k] for k in np.triu_indices(ends.size, 1))
    fits = (last - first >= fewest) & (count - (last - first) >= fewest)
    in_stretch = np.zeros(count, dtype=bool)
    if not fits.any():
        return in_stretch
    first, last = first[fits], last[fits]
    # all numbers in units of their standard errors, without what the columns in `common` explain
    basis, sizes, _ = np.linalg.svd(common / sigma[:, None], full_matrices=False)
    # columns that depend on each other take one degree of freedom
    basis = basis[:, sizes > 1e-9 * sizes.max(initial=0.0)]
    scaled_residual = level / sigma
    scaled_residual = scaled_residual - basis @ (basis.T @ scaled_residual)
    # sums over each stretch, as differences of cumulative sums
    sums = np.zeros((count + 1, 2 + basis.shape[1]))
    sums[1:] = np.cumsum(
        np.column_stack([scaled_residual, 1 / sigma, basis]) / sigma[:, None], axis=0
    )
    # of each stretch: sum of residual / sigma, of 1 / sigma^2, and of the shared columns
    residual_sum, weight_sum, *shared = (sums[last] - sums[first]).T
    # the shared columns absorb some of a shift; the shift over its standard error is residual_sum / sqrt(free)
    free = np.maximum(weight_sum - np.sum(np.square(shared), axis=0), 1e-9)
    best = int(np.argmax(np.abs(residual_sum) / np.sqrt(free)))
    in_stretch[first[best] : last[best]] = True
    return in_stretch if 2 * in_stretch.sum() <= count else ~in_stretch


def find_stretches(is_inside: BoolArray) -> IndexArray:
    """Return the first row of every stretch of True, and the row after its last one, shape (2, k)."""
    edges = np.flatnonzero(np.diff(is_inside, prepend=False, append=False))
    return edges.reshape(-1, 2).T


def find_equal_stretches(values: np.ndarray) -> tuple[IndexArray, IndexArray]:
    """Return the first row and the length of every stretch of equal values, shape (k,) each; `values`: shape (n,)."""
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    return starts, np.diff(np.append(starts, values.size))
