"""Zero-intercept slope of stress against depth (Eq. 1), with an interval that can be believed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.store.chosen import chosen

_CHOSEN = chosen("measure", "slopes")

COSINES = 12


CURVED_P = 0.01
"""Curvature with less probability than this is no noise."""

FEWEST = 8
"""Samples from which their autocorrelation can be told."""


@lru_cache(maxsize=512)
def _cosines(n: int, count: int) -> FloatArray:
    """First `count` cosine modes over `n` samples, orthonormal, shape (count, n)."""
    order = np.arange(1, count + 1)
    return np.asarray(np.sqrt(2 / n) * np.cos(np.pi * np.outer(order, np.arange(n) + 0.5) / n))


def weighted_sum_variance(
    residual: FloatArray, weight: FloatArray, fitted: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """Variance of sum(weight x error), and its degrees of freedom, from residuals (k, n) of a linear fit.

    The residuals may be autocorrelated, at equal steps: an autoregression whitens them, and the level of
    the white rest is read off its slow modes. `fitted` (p, n): what was fitted, linearly independent; by
    default the weight alone. NaN where too few weights differ from 0 to tell.
    """
    n = weight.size
    if n < FEWEST:
        raise ValueError(
            f"{n} samples are too few to estimate their autocorrelation; at least {FEWEST}"
        )
    memory = _autoregression(residual, min(_CHOSEN.order, n // 8))
    order = memory.shape[1]
    white = residual[:, order:].copy()
    for lag in range(1, order + 1):
        white -= memory[:, lag - 1, None] * residual[:, order - lag : n - lag]
    inner = weight[order:]
    fitted = weight[None, :] if fitted is None else fitted
    count = min(COSINES, inner.size // 4, int(np.count_nonzero(inner)) - len(fitted))
    if count < 1:
        return np.full(len(residual), np.nan), 1.0
    level = _level(white, inner, fitted, count)
    growth, gain = _variance_ratios(weight, memory)
    effective = n / growth
    # one parameter was fitted, at the cost of one of the effectively independent samples
    loss = effective / np.maximum(effective - 1, 0.5)
    return level * gain * growth * (weight @ weight) * loss, float(count)


def _level(white: FloatArray, weight: FloatArray, fitted: FloatArray, count: int) -> FloatArray:
    """Variance of white residuals as their slow, weighted modes show it, shape (k,)."""
    modes = weight * _cosines(weight.size, count)
    basis = _orthonormal(fitted[:, -weight.size :])
    shadow = modes @ basis
    overlap = modes @ modes.T - shadow @ shadow.T
    sums = white @ modes.T - (white @ basis) @ shadow.T
    return np.asarray(np.einsum("ij,ji->i", sums, np.linalg.solve(overlap, sums.T)) / count)


def _orthonormal(rows: FloatArray) -> FloatArray:
    """Orthonormal columns that span the same as some rows."""
    if len(rows) == 1:
        # by hand: the general way costs more than all the rest of `_level`
        return np.asarray(rows.T / np.sqrt(rows[0] @ rows[0]))
    return np.linalg.qr(rows.T)[0]


def _autoregression(residual: FloatArray, order: int) -> FloatArray:
    """Coefficients of an autoregression of each series by Yule and Walker, shape (k, order)."""
    n = residual.shape[1]
    lags = [
        np.einsum("ij,ij->i", residual[:, lag:], residual[:, : n - lag]) for lag in range(order + 1)
    ]
    power: FloatArray = np.where(lags[0] > 0, lags[0], 1.0)
    rho = np.array(lags).T / power[:, None]
    # a little more than 1, so that a series of zeros has a solution too
    rho[:, 0] = 1 + 1e-9
    of_pairs = rho[:, _lags_apart(order)]
    memory = np.asarray(np.linalg.solve(of_pairs, rho[:, 1:, None])[..., 0], dtype=float)
    total = memory.sum(axis=1)
    # biased low by (1 + 3 rho) / n, as is the sample autocorrelation (Kendall 1954)
    raised = np.minimum(
        total + (1 + 3 * np.clip(total, 0, 1)) / n, min(_CHOSEN.max_sum, 1 - 1.6 / n)
    )
    memory[:, 0] += raised - total
    return memory


@lru_cache
def _lags_apart(order: int) -> npt.NDArray[np.intp]:
    """Lags between two samples of the last few, shape (order, order)."""
    return np.abs(np.subtract.outer(np.arange(order), np.arange(order)))


def _variance_ratios(weight: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variance of the weighted sum over that for independent errors; that of errors over white."""
    # twice as long as the weights, so that the ends do not meet
    size = 1 << (2 * weight.size - 1).bit_length()
    filters = np.concatenate([np.ones((len(memory), 1)), -memory], axis=1)
    power = 1 / np.abs(np.fft.rfft(filters, size)) ** 2
    twice = np.full(size // 2 + 1, 2 / size)
    twice[[0, -1]] = 1 / size
    gain: FloatArray = power @ twice
    spread: FloatArray = (power * np.abs(np.fft.rfft(weight, size)) ** 2) @ twice
    return spread / (gain * (weight @ weight)), gain


def combine_dof(variances: FloatArray, dofs: FloatArray) -> FloatArray:
    """Degrees of freedom of a sum, along axis 0, of variance estimates (Welch and Satterthwaite)."""
    total = variances.sum(axis=0)
    parts = (variances**2 / dofs).sum(axis=0)
    safe = np.where(parts > 0, parts, 1.0)
    return np.asarray(np.where(parts > 0, total**2 / safe, np.max(dofs, axis=0)))


GIVEN_DOF = 1e6
"""Degrees of freedom of a variance that is given, not estimated."""


def startup_bias(
    path: FloatArray, stress: FloatArray, steady: npt.NDArray[np.bool_], skip_cm: float
) -> FloatArray:
    """Estimate the mean over the steady part less the steady value, N/cm^2, shape (k,).

    The force of a horizontal run approaches its steady value gradually, so that leaving out a fixed
    length, `skip_cm`, never leaves out all of it. How far the second and the last third of that length lie
    from the steady mean shows how fast it dies away, and so what remains: with d2 and d3 and q = d3 / d2,
    an exponential leaves d3 q / (1 - q) times a third of the skipped length; 0 where fewer than 8 samples
    in either third tell nothing. The first third also knows what the pause before has left, and is not
    used. The mean is not corrected (the published values are plain means); the interval is widened.
    """
    third = skip_cm / 3
    is_finite = np.isfinite(stress).all(axis=0)
    in_second = is_finite & (path >= third) & (path < 2 * third)
    in_last = is_finite & (path >= 2 * third) & (path < skip_cm)
    nothing = np.zeros(stress.shape[0])
    if min(np.count_nonzero(bins) for bins in (in_second, in_last, steady)) < _CHOSEN.least:
        return nothing
    length = float(np.ptp(path[steady]))
    mean = stress[:, steady].mean(axis=1)
    early, late = (stress[:, bins].mean(axis=1) - mean for bins in (in_second, in_last))
    # noise must not pass for a start-up that never ends
    share = np.clip(np.divide(late, early, out=nothing, where=early != 0), 0, _CHOSEN.slowest)
    return np.asarray(late * share / (1 - share) * third / length)


_NO_BEND = 1e-12
"""Share of depth squared that rounding leaves of its part orthogonal to depth."""


@dataclass(frozen=True)
class Slope:
    """Slopes of k stress components against one depth; all arrays of shape (k,).

    `alpha`: sum(sigma z) / sum(z^2), N/cm^3; `se` allows for autocorrelation and for the error of the
    zero, `ols_se` takes samples for independent.
    `intercept`, `free_slope`: of the line with a free intercept, N/cm^2 and N/cm^3; `offset`, `offset_se`:
    depth at which it has no stress, cm; `start`: of `stress_onset`. These and the nonlinearity are NaN in a
    horizontal run.
    `nonlinear_p`: probability that a straight line through zero shows this much curvature by noise;
    `nonlinear_ratio`: how far a parabola through zero leaves it at the end of the window, relative
    to the stress there.
    `startup`, `tare`, `curvature`: standard errors contained in `se`, N/cm^3: what a start-up left in the
    window moves alpha by; the tare, common to all runs that share it; a curvature that is no noise: by how
    much a parabola leaves the line at the end, less (in squares) what noise shows once in a hundred times,
    as the limit of an even distribution.
    `lever`: relative change of alpha for a surface that lies lower by 1 cm than was taken, 1/cm.
    `shift`, `shift_of_tare`: variance of what moves all samples alike, and of the tare's part, (N/cm^2)^2.
    `tare_share`: of the variance that the scatter of the samples causes, how much is the tare's.
    """

    alpha: FloatArray
    se: FloatArray
    dof: FloatArray
    ols_se: FloatArray
    intercept: FloatArray
    free_slope: FloatArray
    nonlinear_p: FloatArray
    nonlinear_ratio: FloatArray
    points: int
    startup: FloatArray
    tare: FloatArray
    curvature: FloatArray
    lever: float
    offset: FloatArray
    offset_se: FloatArray
    start: FloatArray
    shift: FloatArray
    shift_of_tare: FloatArray
    tare_share: FloatArray

    def interval(self, confidence: float) -> tuple[FloatArray, FloatArray]:
        """Return the lower and upper end of the interval of alpha, N/cm^3, at a level between 0 and 1."""
        half_interval = student_quantile(confidence, self.dof) * self.se
        return self.alpha - half_interval, self.alpha + half_interval


def student_quantile(confidence: float, dof: FloatArray | float) -> FloatArray:
    """Half width of a two-sided Student interval in standard errors."""
    from scipy.special import stdtrit  # scipy.stats takes ten times as long to import

    return np.asarray(stdtrit(np.asarray(dof, dtype=float), 0.5 + confidence / 2))


def student_limit(sigmas: float, dof: float) -> float:
    """Student's t at the level of so many standard errors of a normal number: few runs hardly tell their own scatter."""
    from scipy.special import ndtr, stdtrit

    return -float(stdtrit(dof, ndtr(-sigmas)))


def zero_intercept(depth: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Zero-intercept least squares of stress (k, n) on depth (n,), with textbook errors (Eq. 1)."""
    power = float(depth @ depth)
    if depth.size < 2 or power == 0:
        raise ValueError(f"{depth.size} samples, sum of squared depths {power:g}: no slope")
    alpha = stress @ depth / power
    residual = stress - alpha[:, None] * depth
    variance = np.einsum("ij,ij->i", residual, residual) / (depth.size - 1)
    return alpha, np.sqrt(variance / power)


def fit_slope(
    depth: FloatArray,
    stress: FloatArray,
    zero_variance: FloatArray,
    zero_dof: FloatArray,
    depth_sd: float = 0.0,
    startup: FloatArray | None = None,
    tare_stress: FloatArray | None = None,
) -> Slope:
    """Fit the zero-intercept slope with its honest standard error and quality figures.

    `depth` (n,): |z| in the order of recording, cm; at least 8 samples, not all at zero; `stress` (k, n):
    tared, N/cm^2. `zero_variance`, `zero_dof` (m, k): of the stress zero of the run and of its tare,
    (N/cm^2)^2: an error of the zero is the same in all samples, so their scatter does not show it; so is
    that of the depth, `depth_sd`, cm (of the clocks). `startup` (k,): of `startup_bias`, N/cm^2.
    `tare_stress` (k, n): what was subtracted, N/cm^2; its scatter is common to all runs that share the tare.
    """
    alpha, ols_se = zero_intercept(depth, stress)
    power = float(depth @ depth)
    residual = stress - alpha[:, None] * depth
    lever = float(depth.sum()) / power
    # what shifts the stress of all samples alike: errors of the clocks, and of the zeros
    shift = np.vstack([(alpha * depth_sd) ** 2, zero_variance])
    given_dof = np.full(alpha.size, GIVEN_DOF)
    shift_dof = np.vstack([given_dof, zero_dof])
    p_value, ratio, excess, residual_after, noise = _curvature(
        depth, alpha, residual, shift, shift_dof
    )
    # a curvature that is no noise must not pass for noise with a long memory
    bent = p_value < CURVED_P
    scatter, count = weighted_sum_variance(np.where(bent[:, None], residual_after, residual), depth)
    curvature = excess / math.sqrt(3)
    moved = np.zeros(alpha.size) if startup is None else startup * lever
    parts = np.vstack([scatter / power**2, shift * lever**2, moved**2, curvature**2])
    dofs = np.vstack([np.full(alpha.size, count), shift_dof, given_dof, given_dof])
    se = np.sqrt(parts.sum(axis=0))
    intercept, free_slope = free_intercept(depth, stress)
    tare_share = np.zeros(alpha.size)
    if tare_stress is not None:
        tare_share = _share_of_tare(tare_stress, depth, scatter)
    tare = tare_share * scatter / power**2 + zero_variance[1:].sum(axis=0) * lever**2
    offset, offset_se = _offset(depth, intercept, free_slope, noise, shift.sum(axis=0))
    return Slope(
        alpha=alpha,
        se=se,
        dof=combine_dof(parts, dofs),
        ols_se=ols_se,
        intercept=intercept,
        free_slope=free_slope,
        nonlinear_p=p_value,
        nonlinear_ratio=ratio,
        points=depth.size,
        startup=moved,
        tare=np.sqrt(tare),
        curvature=curvature,
        lever=lever,
        offset=offset,
        offset_se=offset_se,
        start=stress_onset(depth, stress),
        shift=shift.sum(axis=0),
        shift_of_tare=zero_variance[1:].sum(axis=0),
        tare_share=tare_share,
    )


def _share_of_tare(tare_stress: FloatArray, depth: FloatArray, scatter: FloatArray) -> FloatArray:
    """How much of the scatter of a tared run is that of its tare, from what a parabola leaves of the tare."""
    position = np.linspace(-1.0, 1.0, depth.size)
    smooth = np.stack([np.ones(depth.size), position, position**2])
    basis = _orthonormal(smooth)
    residual = tare_stress - (tare_stress @ basis) @ basis.T
    of_tare, _ = weighted_sum_variance(residual, depth, smooth)
    share = np.divide(
        np.nan_to_num(of_tare), scatter, out=np.zeros(scatter.size), where=scatter > 0
    )
    return np.minimum(share, 1.0)


def fit_few(depth: FloatArray, stress: FloatArray) -> Slope:
    """Zero-intercept slope of a few independent depths, with the textbook error; of one depth none.

    `depth`: shape (n,), cm. `stress`: shape (k, n), N/cm^2.
    """
    unknown = np.full((2, len(stress)), np.nan)
    if depth.size < 2:
        alpha, se = stress[:, 0] / depth[0], unknown[0]
    else:
        alpha, se = zero_intercept(depth, stress)
    intercept, free_slope = free_intercept(depth, stress) if depth.size > 2 else unknown
    dof = np.full(alpha.size, max(depth.size - 1.0, 1.0))
    nothing = np.zeros(alpha.size)
    lever = float(depth.sum() / (depth @ depth))
    return Slope(
        alpha=alpha,
        se=se,
        dof=dof,
        ols_se=se,
        intercept=intercept,
        free_slope=free_slope,
        nonlinear_p=unknown[0],
        nonlinear_ratio=unknown[1],
        points=depth.size,
        startup=nothing,
        tare=nothing,
        curvature=nothing,
        lever=lever,
        offset=unknown[0],
        offset_se=unknown[1],
        start=stress_onset(depth, stress),
        shift=nothing,
        shift_of_tare=nothing,
        tare_share=nothing,
    )


def fit_few_free(depth: FloatArray, stress: FloatArray) -> Slope:
    """Slope of a few independent depths with a free intercept; of two depths without an error.

    `depth`, `stress`: As of `fit_few`.
    """
    intercept, slope = free_intercept(depth, stress)
    dof = depth.size - 2
    residual = stress - intercept[:, None] - slope[:, None] * depth
    spread = float(depth.var()) * depth.size
    se = np.full(slope.size, np.nan)
    if dof > 0:
        se = np.sqrt((residual**2).sum(axis=1) / dof / spread)
    dofs = np.full(slope.size, max(dof, 1.0))
    return replace(
        fit_few(depth, stress),
        alpha=slope,
        se=se,
        ols_se=se,
        dof=dofs,
        intercept=intercept,
        free_slope=slope,
        lever=0.0,
    )


def free_intercept(depth: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Intercept and slope of each line with a free intercept; NaN along a level path."""
    if level_path(depth):
        nothing = np.full(len(stress), np.nan)
        return nothing, nothing
    centred = depth - depth.mean()
    slope = stress @ centred / float(centred @ centred)
    return stress.mean(axis=1) - slope * depth.mean(), slope


def stress_onset(depth: FloatArray, stress: FloatArray) -> FloatArray:
    """Depth at which each stress begins, cm: of a line whose weight falls with depth, as a bed is uneven by so many percent."""
    nothing = np.full(len(stress), np.nan)
    if depth.size < 3 or level_path(depth):
        return nothing
    weight = 1 / (depth**2 + (_CHOSEN.near * np.abs(depth).max()) ** 2)
    weight /= weight.sum()
    centred, middle = depth - weight @ depth, stress @ weight
    slope = stress @ (weight * centred) / (weight @ centred**2)
    return np.asarray(np.divide(-middle, slope, out=nothing, where=slope != 0) + weight @ depth)


def _offset(
    depth: FloatArray,
    intercept: FloatArray,
    slope: FloatArray,
    noise: FloatArray,
    shift: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Depth of no stress by the line with a free intercept, and its standard error, cm.

    `noise`, `shift` (k,), (N/cm^2)^2: as of `_curvature`, and of what moves all samples alike.
    """
    if np.isnan(slope).all():
        return intercept, intercept  # NaN
    spread = float(depth.var()) * depth.size
    variance = noise * (1 / depth.size + float(depth.mean()) ** 2 / spread) + shift
    size = np.where(slope == 0, np.nan, slope)
    return -intercept / size, np.sqrt(variance) / np.abs(size)


def level_path(depth: FloatArray) -> bool:
    """Tell a horizontal run: what its depth varies by is the noise of the arm's log."""
    return bool(depth.std() <= _CHOSEN.level * np.abs(depth).max())


def _curvature(
    depth: FloatArray,
    alpha: FloatArray,
    residual: FloatArray,
    shift: FloatArray,
    shift_dof: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Test a term in depth squared, made orthogonal to the line through zero.

    A stress that is off by the same everywhere bends the line through zero too, so the variances of
    such shifts belong into the test. Returns its probability, the deviation at the end of the window
    relative to the stress there, how much of it is beyond noise, N/cm^3, the residuals without the term,
    and the variance of a slowly weighted sum of the noise over that of its weights.
    """
    from scipy.special import stdtr, stdtrit

    bend = depth**2 - depth * float(depth**2 @ depth) / float(depth @ depth)
    power = float(bend @ bend)
    # depths of 0 and one other have no curvature either
    if level_path(depth) or power <= _NO_BEND * float(depth**2 @ depth**2):
        nothing = np.full(alpha.size, np.nan)
        return nothing, nothing, np.zeros(alpha.size), residual, nothing
    size = residual @ bend / power
    residual_after = residual - size[:, None] * bend
    scatter, count = weighted_sum_variance(residual_after, bend, np.stack([depth, bend]))
    lever = float(bend.sum()) / power
    parts = np.vstack([scatter / power**2, shift * lever**2])
    dof = combine_dof(parts, np.vstack([np.full(alpha.size, count), shift_dof]))
    error = np.sqrt(parts.sum(axis=0))
    safe = np.where(error > 0, error, 1.0)
    p_value = np.where(error > 0, 2 * stdtr(dof, -np.abs(size) / safe), 1.0)
    deepest = int(np.argmax(depth))
    end_stress = alpha * depth[deepest]
    reference = np.where(end_stress == 0, 1.0, np.abs(end_stress))
    # less what noise shows once in a hundred times: grows from nothing, so that a larger error of the
    # zero, which explains more of it, never makes the whole smaller
    by_noise = stdtrit(dof, 1 - CURVED_P / 2) * error
    excess = np.sqrt(np.maximum(size**2 - by_noise**2, 0.0)) * np.abs(
        bend[deepest] / depth[deepest]
    )
    return p_value, size * bend[deepest] / reference, excess, residual_after, scatter / power
