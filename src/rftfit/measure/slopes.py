"""Zero-intercept slope of stress against depth (Eq. 1), with an interval that allows for autocorrelated samples.

Eq. 1 of Li, Zhang and Goldman (2013) takes stress for alpha times depth, so alpha is the slope of a line through zero:
`fit_slope` fits it to a log, `fit_few` to a few rows of a table. Neighbouring samples of a log have similar errors, so
n samples are worth fewer independent ones: `weighted_sum_variance` gives the variance of any weighted sum of such
errors, and so of a slope. docs/theory/slope.md derives this.

``depth``: cm, positive, shape (n,), in the order of recording, at equal steps of time. ``stress``: N/cm^2, shape (k, n)
for k components, usually z and x. "k series" are k rows of an array, each of n samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from rftfit.conventions import BoolArray, FloatArray
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `slopes`, says what each decides
_CHOSEN = chosen("measure", "slopes")

COSINES = 12
"""Most slow cosine modes from which the variance of the noise is estimated: only slow noise moves a slope."""

CURVED_P = 0.01
"""Probability by chance below which a curvature counts as real."""

FEWEST = 8
"""Fewest samples from which an autocorrelation is estimated."""


@lru_cache(maxsize=512)
def _cosine_modes(n: int, count: int) -> FloatArray:
    """First `count` cosine modes over `n` samples, the slowest first, orthonormal, shape (count, n)."""
    order = np.arange(1, count + 1)
    return np.asarray(np.sqrt(2 / n) * np.cos(np.pi * np.outer(order, np.arange(n) + 0.5) / n))


def weighted_sum_variance(
    residual: FloatArray, weight: FloatArray, fitted: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """Return the variance of sum(weight x error) and its degrees of freedom, from residuals of a linear fit.

    The residuals may be autocorrelated, at equal steps: an autoregression whitens them, and the variance of the white
    residuals is estimated from their slow modes. The variance of the sum is that of white errors, times sum(weight^2),
    times the ratios of `_variance_ratios`, times m / (m - 1) for m effectively independent samples. NaN where too few
    weights differ from 0.

    `residual`: k series, shape (k, n), so that the variance has shape (k,). `weight`: shape (n,).
    `fitted`: Functions that were fitted, linearly independent, shape (p, n); default: the weight alone.
    """
    n = weight.size
    if n < FEWEST:
        raise ValueError(
            f"{n} samples are too few to estimate their autocorrelation; at least {FEWEST}"
        )
    coefficients = _fit_autoregression(residual, min(_CHOSEN.order, n // 8))
    order = coefficients.shape[1]
    # white[t] = residual[t] - sum over lags of coefficient x residual[t - lag]
    white = residual[:, order:].copy()
    for lag in range(1, order + 1):
        white -= coefficients[:, lag - 1, None] * residual[:, order - lag : n - lag]
    weight_of_white = weight[order:]
    fitted = weight[None, :] if fitted is None else fitted
    independent = int(np.count_nonzero(weight_of_white)) - len(fitted)
    modes = min(COSINES, weight_of_white.size // 4, independent)
    if modes < 1:
        return np.full(len(residual), np.nan), 1.0
    white_variance = _white_variance(white, weight_of_white, fitted, modes)
    of_sum, of_errors = _variance_ratios(weight, coefficients)
    effective = n / of_sum
    # the fit of one parameter costs one effectively independent sample
    loss = effective / np.maximum(effective - 1, 0.5)
    return white_variance * of_errors * of_sum * (weight @ weight) * loss, float(modes)


def _white_variance(
    white: FloatArray, weight: FloatArray, fitted: FloatArray, count: int
) -> FloatArray:
    """Variance of white residuals, shape (k,), from their sums with `count` slow modes times the weight.

    So noise counts where the weight is large, and at the low frequencies that the weighted sum keeps. The fitted
    functions are projected out of the modes, since the residuals are orthogonal to them.

    `white`: shape (k, n). `weight`: shape (n,). `fitted`: shape (p, n or longer); its last n columns count.
    """
    modes = weight * _cosine_modes(weight.size, count)
    basis = _orthonormal_columns(fitted[:, -weight.size :])
    on_fitted = modes @ basis
    # products of the projected modes with each other and with the residuals
    overlap = modes @ modes.T - on_fitted @ on_fitted.T
    sums = white @ modes.T - (white @ basis) @ on_fitted.T
    # mean square of the sums, each in units of its standard deviation for white noise of variance 1
    return np.asarray(np.einsum("ij,ji->i", sums, np.linalg.solve(overlap, sums.T)) / count)


def _orthonormal_columns(rows: FloatArray) -> FloatArray:
    """Orthonormal columns, shape (n, p), that span the same space as the `rows`, shape (p, n)."""
    if len(rows) == 1:
        # the general way takes longer than all the rest of `_white_variance`
        return np.asarray(rows.T / np.sqrt(rows[0] @ rows[0]))
    return np.linalg.qr(rows.T)[0]


def _fit_autoregression(residual: FloatArray, order: int) -> FloatArray:
    """Coefficients of an autoregression of each series (k, n) by the Yule-Walker equations, shape (k, order).

    The model: error[t] = sum over lags 1 to `order` of coefficient x error[t - lag] + white noise.
    """
    n = residual.shape[1]
    products = np.array(
        [
            np.einsum("ij,ij->i", residual[:, lag:], residual[:, : n - lag])
            for lag in range(order + 1)
        ]
    )
    # autocorrelation at the lags 0 to `order`, shape (k, order + 1)
    rho = (products / np.where(products[0] > 0, products[0], 1.0)).T
    # a little more than 1, so that a series of zeros has a solution too
    rho[:, 0] = 1 + 1e-9
    index = np.arange(order)
    matrix = rho[:, np.abs(index[:, None] - index)]
    coefficients = np.asarray(np.linalg.solve(matrix, rho[:, 1:, None])[..., 0], dtype=float)
    total = coefficients.sum(axis=1)
    # corrects the bias of a sample autocorrelation, which is too low by (1 + 3 rho) / n (Kendall 1954)
    raised = np.minimum(
        total + (1 + 3 * np.clip(total, 0, 1)) / n, min(_CHOSEN.max_sum, 1 - 1.6 / n)
    )
    coefficients[:, 0] += raised - total
    return coefficients


def _variance_ratios(weight: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two ratios for errors of an autoregression with the coefficients (k, order), shape (k,) each.

    1. Variance of the weighted sum, relative to that for independent errors of the same variance.
    2. Variance of the errors, relative to that of their white residuals.

    Both are sums over frequencies: the spectrum of the errors is 1 / |1 - sum(coefficient e^(-i w lag))|^2.
    """
    # twice as long as the weights, as a Fourier transform is periodic
    size = 1 << (2 * weight.size - 1).bit_length()
    filters = np.concatenate([np.ones((len(coefficients), 1)), -coefficients], axis=1)
    spectrum = 1 / np.abs(np.fft.rfft(filters, size)) ** 2
    # a real transform holds each frequency once, but for the first and the last its negative counts too
    share = np.full(size // 2 + 1, 2 / size)
    share[[0, -1]] = 1 / size
    of_errors: FloatArray = spectrum @ share
    of_sum: FloatArray = (spectrum * np.abs(np.fft.rfft(weight, size)) ** 2) @ share
    return of_sum / (of_errors * (weight @ weight)), of_errors


def combine_dof(variances: FloatArray, dofs: FloatArray) -> FloatArray:
    """Degrees of freedom of the sum of variance estimates V along axis 0: (sum V)^2 / sum(V^2 / dof).

    This is the formula of Welch and Satterthwaite; where all variances are 0, the largest of the dofs. The large
    estimates decide: how well small ones are known hardly matters.
    """
    squares = (variances**2 / dofs).sum(axis=0)
    square_of_sum = variances.sum(axis=0) ** 2
    safe = np.where(squares > 0, squares, 1.0)
    return np.asarray(np.where(squares > 0, square_of_sum / safe, np.max(dofs, axis=0)))


GIVEN_DOF = 1e6
"""Degrees of freedom of a variance that is given, not estimated: Student's t is then a normal distribution."""


def startup_bias(
    path: FloatArray, stress: FloatArray, steady: BoolArray, skip_cm: float
) -> FloatArray:
    """Estimate the effect of the start-up on the mean stress of a horizontal run, N/cm^2, shape (k,).

    The force of a horizontal run approaches its steady value gradually, so that a start-up remains after a fixed
    length, `skip_cm`, is left out. Let d2 and d3 be the differences of the means of the second and last third of that
    length from the steady mean. An exponential with q = d3 / d2 then leaves d3 q / (1 - q) times a third of the skipped
    length. The first third is not used, as the pause before affects it. 0 where a third or the steady part has too few
    samples. The mean is not corrected, as the published values are plain means; the interval is widened.

    `path`: Length travelled, cm, shape (n,). `stress`: N/cm^2, shape (k, n). `steady`: True for the samples that are
    fitted.
    """
    third = skip_cm / 3
    is_finite = np.isfinite(stress).all(axis=0)
    in_second = is_finite & (path >= third) & (path < 2 * third)
    in_last = is_finite & (path >= 2 * third) & (path < skip_cm)
    nothing = np.zeros(stress.shape[0])
    if min(np.count_nonzero(samples) for samples in (in_second, in_last, steady)) < _CHOSEN.least:
        return nothing
    length = float(np.ptp(path[steady]))
    mean = stress[:, steady].mean(axis=1)
    d2, d3 = (stress[:, samples].mean(axis=1) - mean for samples in (in_second, in_last))
    # limited, so that noise does not make a start-up that hardly decays
    q = np.clip(np.divide(d3, d2, out=nothing, where=d2 != 0), 0, _CHOSEN.slowest)
    # sum of the later thirds, d3 (q + q^2 + ...), each a third long, as a mean over the steady part
    return np.asarray(d3 * q / (1 - q) * third / length)


_NO_BEND = 1e-12
"""Share of sum(depth^4) in the component of depth^2 orthogonal to depth, up to which that component is rounding."""


@dataclass(frozen=True)
class Slope:
    """Slopes of k stress components against one depth, what `fit_slope` and `fit_few` return; all arrays of shape (k,).

    `alpha`: sum(sigma z) / sum(z^2), N/cm^3.
    `se`, `dof`: Standard error of alpha, which allows for autocorrelation and for the error of the zero, and its
    degrees of freedom.
    `ols_se`: Standard error of alpha if the samples were independent.
    `intercept`, `free_slope`: Line with a free intercept, N/cm^2 and N/cm^3.
    `offset`, `offset_se`: Depth at which that line has no stress, and its standard error, cm.
    `start`: Depth at which stress begins, cm, of `stress_onset`.
    `nonlinear_p`: Probability that noise shows this much curvature of a line through zero.
    `nonlinear_ratio`: Distance of a parabola through zero from the line at the end of the window, relative to the
    stress there.
    `points`: Number of samples.
    `startup`, `tare`, `curvature`: Standard errors contained in `se`, N/cm^3. `startup`: effect of a start-up in the
    window.
    `tare`: error of the tare, common to all runs that share it. `curvature`: distance of the parabola from the line,
    less (in squares) the distance that noise exceeds once in a hundred times; taken as the limit of a uniform
    distribution.
    `lever`: Relative change of alpha for a surface that lies 1 cm lower than assumed, 1/cm.
    `shift`, `shift_of_tare`: Variance of errors that are the same in all samples, and how much of it the tare causes,
    (N/cm^2)^2.
    `tare_share`: Fraction of the variance by the scatter of samples that comes from the tare.

    From `intercept` to `nonlinear_ratio` all are NaN in a horizontal run.
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
    """Half width of a two-sided interval of Student's t, in standard errors; `confidence`: 0 to 1."""
    from scipy.special import stdtrit  # scipy.stats takes ten times as long to import

    return np.asarray(stdtrit(np.asarray(dof, dtype=float), 0.5 + confidence / 2))


def normal_quantile(confidence: float) -> float:
    """Half width of a two-sided interval of a normal number, in standard deviations; 1.96 for 0.95."""
    return NormalDist().inv_cdf(0.5 + confidence / 2)


NORMAL_95 = normal_quantile(0.95)
"""Half width of an interval of a normal number that is 95 % whatever a campaign states, in standard deviations."""


def student_p(t: FloatArray | float, dof: FloatArray | float) -> FloatArray:
    """Two-sided p value of `t`, a number divided by its standard error, by Student's t."""
    from scipy.special import stdtr

    return np.asarray(2 * stdtr(dof, -np.abs(t)))


def student_limit(sigmas: float, dof: float) -> float:
    """Student's t that is exceeded as often as a normal number exceeds `sigmas` standard deviations.

    It is larger than `sigmas`, as the scatter of few runs is not well known.
    """
    from scipy.special import ndtr, stdtrit

    return -float(stdtrit(dof, ndtr(-sigmas)))


def zero_intercept(depth: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Zero-intercept least squares (Eq. 1) of stress (k, n) on depth (n,): alpha and its textbook error, shape (k,).

    The error is that of independent samples: sqrt(sum(residual^2) / (n - 1) / sum(depth^2)).
    """
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
    """Fit the zero-intercept slope, with a standard error that includes errors common to all samples.

    An error of the zero or of the clocks is the same in all samples, so that their scatter does not show it.

    `depth`: |z| in the order of recording, cm, shape (n,); at least 8 samples, not all at zero.
    `stress`: Tared stress, N/cm^2, shape (k, n).
    `zero_variance`, `zero_dof`: Variance of the zero of the run (row 0) and, if it has a tare, of that (row 1),
    (N/cm^2)^2, and its degrees of freedom, shape (1 or 2, k).
    `depth_sd`: Standard error that all depths share, by the clocks and the surface, cm.
    `startup`: Effect of the start-up of a level run on the mean stress, of `startup_bias`, N/cm^2, shape (k,); None:
    none.
    `tare_stress`: Tare that was subtracted, N/cm^2, shape (k, n); None: none. Its scatter is an error that all runs
    with the same tare share, so `Slope.tare` keeps it apart.
    """
    alpha, ols_se = zero_intercept(depth, stress)
    power = float(depth @ depth)
    residual = stress - alpha[:, None] * depth
    # change of alpha if all stresses are larger by 1 N/cm^2; also its relative change for depths that are 1 cm off
    lever = float(depth.sum()) / power
    # variances of errors that shift the stress of all samples alike: of the depth, and of the zeros
    shift = np.vstack([(alpha * depth_sd) ** 2, zero_variance])
    given_dof = np.full(alpha.size, GIVEN_DOF)
    shift_dof = np.vstack([given_dof, zero_dof])
    test = _test_curvature(depth, alpha, residual, shift, shift_dof)
    # residuals of a curved stress would look like noise with a long memory: subtract a real curvature
    bent = test.p_value < CURVED_P
    # variance of sum(depth x error), and its degrees of freedom; alpha has this error over `power`
    scatter, count = weighted_sum_variance(np.where(bent[:, None], test.residual, residual), depth)
    # an error that is equally likely anywhere up to a limit has a standard deviation of the limit over sqrt(3)
    curvature = test.excess / math.sqrt(3)
    startup_error = np.zeros(alpha.size) if startup is None else startup * lever
    variances = np.vstack([scatter / power**2, shift * lever**2, startup_error**2, curvature**2])
    dofs = np.vstack([np.full(alpha.size, count), shift_dof, given_dof, given_dof])
    intercept, free_slope = free_intercept(depth, stress)
    tare_share = np.zeros(alpha.size)
    if tare_stress is not None:
        tare_share = _share_of_tare(tare_stress, depth, scatter)
    tare = tare_share * scatter / power**2 + zero_variance[1:].sum(axis=0) * lever**2
    offset, offset_se = _zero_stress_depth(
        depth, intercept, free_slope, test.noise, shift.sum(axis=0)
    )
    return Slope(
        alpha=alpha,
        se=np.sqrt(variances.sum(axis=0)),
        dof=combine_dof(variances, dofs),
        ols_se=ols_se,
        intercept=intercept,
        free_slope=free_slope,
        nonlinear_p=test.p_value,
        nonlinear_ratio=test.ratio,
        points=depth.size,
        startup=startup_error,
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
    """Fraction of the scatter of a tared run that comes from its tare, 0 to 1, shape (k,).

    The noise of the tare is what a parabola does not explain of it. `scatter`: Variance of sum(depth x error) of the
    tared stress, shape (k,).
    """
    position = np.linspace(-1.0, 1.0, depth.size)
    smooth = np.stack([np.ones(depth.size), position, position**2])
    basis = _orthonormal_columns(smooth)
    residual = tare_stress - (tare_stress @ basis) @ basis.T
    of_tare, _ = weighted_sum_variance(residual, depth, smooth)
    share = np.divide(
        np.nan_to_num(of_tare), scatter, out=np.zeros(scatter.size), where=scatter > 0
    )
    return np.minimum(share, 1.0)


def fit_few(depth: FloatArray, stress: FloatArray) -> Slope:
    """Fit the zero-intercept slope of a few independent depths; the error is NaN for a single depth.

    Rows of a table are no samples of one log: they have no zero, clock or tare of their own, and no autocorrelation, so
    the textbook error holds. `depth`: cm, shape (n,). `stress`: N/cm^2, shape (k, n).
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


def free_intercept(depth: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return intercept (N/cm^2) and slope (N/cm^3) of k lines with a free intercept; NaN along a level path."""
    if level_path(depth):
        nothing = np.full(len(stress), np.nan)
        return nothing, nothing
    centred = depth - depth.mean()
    slope = stress @ centred / float(centred @ centred)
    return stress.mean(axis=1) - slope * depth.mean(), slope


def stress_onset(depth: FloatArray, stress: FloatArray) -> FloatArray:
    """Depth at which each stress begins, cm, shape (k,): zero of a line fitted with more weight near the surface.

    A depth other than 0 shows a surface that is off. A bed is uneven in proportion to its stress, so deeper samples
    have larger errors and less weight.
    """
    nothing = np.full(len(stress), np.nan)
    if depth.size < 3 or level_path(depth):
        return nothing
    weight = 1 / (depth**2 + (_CHOSEN.near * np.abs(depth).max()) ** 2)
    weight /= weight.sum()
    centred, middle = depth - weight @ depth, stress @ weight
    slope = stress @ (weight * centred) / (weight @ centred**2)
    return np.asarray(np.divide(-middle, slope, out=nothing, where=slope != 0) + weight @ depth)


def _zero_stress_depth(
    depth: FloatArray,
    intercept: FloatArray,
    slope: FloatArray,
    noise: FloatArray,
    shift: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the depth at which the line with a free intercept has no stress, and its standard error, cm.

    The depth is -intercept / slope, its error that of the line at zero depth over the slope; shape (k,) each. Many runs
    with such depths show how far the free surface is off.

    `noise`: Variance of the noise, of `_test_curvature`, (N/cm^2)^2, shape (k,).
    `shift`: Variance of errors that are the same in all samples, (N/cm^2)^2, shape (k,).
    """
    if np.isnan(slope).all():
        return intercept, intercept  # NaN
    spread = float(depth.var()) * depth.size
    variance = noise * (1 / depth.size + float(depth.mean()) ** 2 / spread) + shift
    divisor = np.where(slope == 0, np.nan, slope)
    return -intercept / divisor, np.sqrt(variance) / np.abs(divisor)


def level_path(depth: FloatArray) -> bool:
    """Return True for a horizontal run, whose depth varies only by the noise of the motion log."""
    return bool(depth.std() <= _CHOSEN.level * np.abs(depth).max())


class _CurvatureTest(NamedTuple):
    """Result of the test of a term in depth squared; arrays of shape (k,), but for `residual`.

    `p_value`: Probability of this curvature by chance.
    `ratio`: Distance of the parabola from the line at the end of the window, relative to the stress there.
    `excess`: That distance beyond noise, divided by the depth there, N/cm^3.
    `residual`: Residuals without the term, N/cm^2, shape (k, n).
    `noise`: Variance of the noise at low frequencies, (N/cm^2)^2.
    """

    p_value: FloatArray
    ratio: FloatArray
    excess: FloatArray
    residual: FloatArray
    noise: FloatArray


def _test_curvature(
    depth: FloatArray,
    alpha: FloatArray,
    residual: FloatArray,
    shift: FloatArray,
    shift_dof: FloatArray,
) -> _CurvatureTest:
    """Test whether residuals (k, n) of lines through zero hold a term in depth squared, orthogonal to the line.

    A stress that is curved over depth has no single alpha: its alpha depends on the window, which is an error of alpha.

    An equal shift of all stresses looks like curvature of a line through zero, so the test includes the variances
    `shift` of such shifts, (N/cm^2)^2, with their degrees of freedom, shape (m, k).
    """
    # depth squared less its projection on depth
    bend = depth**2 - depth * float(depth**2 @ depth) / float(depth @ depth)
    power = float(bend @ bend)
    # depths of 0 and a single other one have no curvature either
    if level_path(depth) or power <= _NO_BEND * float(depth**2 @ depth**2):
        nothing = np.full(alpha.size, np.nan)
        return _CurvatureTest(nothing, nothing, np.zeros(alpha.size), residual, nothing)
    curvature = residual @ bend / power
    residual_after = residual - curvature[:, None] * bend
    scatter, count = weighted_sum_variance(residual_after, bend, np.stack([depth, bend]))
    lever = float(bend.sum()) / power
    variances = np.vstack([scatter / power**2, shift * lever**2])
    dof = combine_dof(variances, np.vstack([np.full(alpha.size, count), shift_dof]))
    error = np.sqrt(variances.sum(axis=0))
    safe = np.where(error > 0, error, 1.0)
    p_value = np.where(error > 0, student_p(curvature / safe, dof), 1.0)
    deepest = int(np.argmax(depth))
    end_stress = alpha * depth[deepest]
    reference = np.where(end_stress == 0, 1.0, np.abs(end_stress))
    # what noise does not explain, in squares: it grows from 0, so that a larger error of the
    # zero, which explains more, never makes the whole error smaller
    by_noise = student_quantile(1 - CURVED_P, dof) * error
    beyond_noise = np.sqrt(np.maximum(curvature**2 - by_noise**2, 0.0))
    excess = beyond_noise * np.abs(bend[deepest] / depth[deepest])
    ratio = curvature * bend[deepest] / reference
    return _CurvatureTest(p_value, ratio, excess, residual_after, scatter / power)
