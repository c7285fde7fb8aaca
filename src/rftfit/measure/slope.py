"""Zero-intercept slope of stress against depth (Eq. 1), with an interval that can be believed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.autocorrelation import combine_dof, weighted_sum_variance
from rftfit.measure.repeats import GIVEN_DOF

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

_LEVEL = 0.005


@dataclass(frozen=True)
class Slope:
    """Slopes of k stress components against one depth; all arrays of shape (k,).

    Parameters
    ----------
    alpha : numpy.ndarray
        sum(sigma z) / sum(z^2), N/cm^3.
    se : numpy.ndarray
        Standard error that allows for autocorrelation and for the error of the zero, N/cm^3.
    dof : numpy.ndarray
        Degrees of freedom of `se`.
    ols_se : numpy.ndarray
        Textbook standard error, which takes samples for independent, N/cm^3.
    intercept, free_slope : numpy.ndarray
        Of the fit with a free intercept, N/cm^2 and N/cm^3; these and what follows are NaN where
        the depth does not change, as in a horizontal run.
    nonlinear_p : numpy.ndarray
        Probability that a straight line through zero shows this much curvature by noise.
    nonlinear_ratio : numpy.ndarray
        Deviation of a parabola through zero from the line at the end of the window, relative to
        the stress there.
    points : int
        Samples used.
    startup : numpy.ndarray
        What a start-up left in the window moves alpha by, N/cm^3; contained in `se`.
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

    def interval(self, confidence: float) -> tuple[FloatArray, FloatArray]:
        """Return the confidence interval of alpha.

        Parameters
        ----------
        confidence : float
            Between 0 and 1.

        Returns
        -------
        lo, hi : numpy.ndarray, shape (k,)
            N/cm^3.
        """
        half = student_quantile(confidence, self.dof) * self.se
        return self.alpha - half, self.alpha + half


def student_quantile(confidence: float, dof: FloatArray | float) -> FloatArray:
    """Half width of a two-sided Student interval in standard errors.

    Parameters
    ----------
    confidence : float
        Between 0 and 1.
    dof : array_like
        Degrees of freedom.

    Returns
    -------
    numpy.ndarray
    """
    from scipy.special import stdtrit  # scipy.stats takes ten times as long to import

    return np.asarray(stdtrit(np.asarray(dof, dtype=float), 0.5 + confidence / 2))


def zero_intercept(depth: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Zero-intercept least squares and its textbook standard error (Eq. 1).

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        |z|, cm.
    stress : numpy.ndarray, shape (k, n)
        N/cm^2.

    Returns
    -------
    alpha, ols_se : numpy.ndarray, shape (k,)
        N/cm^3.

    Raises
    ------
    ValueError
        If there are fewer than two samples or all lie at depth zero.
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
) -> Slope:
    """Fit the zero-intercept slope with its honest standard error and quality figures.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        |z| in the order of recording, cm.
    stress : numpy.ndarray, shape (k, n)
        Tared stress, N/cm^2.
    zero_variance : numpy.ndarray, shape (m, k)
        Variance of the stress zero of the run and of its tare, (N/cm^2)^2: an error of the zero is
        the same in all samples, so their scatter does not show it.
    zero_dof : numpy.ndarray, shape (m, k)
        Degrees of freedom of these.
    depth_sd : float, optional
        Standard error of the depth common to all samples (of the clocks), cm.
    startup : numpy.ndarray, shape (k,), optional
        What a start-up moves the mean stress by (`measure.startup`), N/cm^2; default none.

    Returns
    -------
    Slope

    Raises
    ------
    ValueError
        If there are fewer than 8 samples or all lie at depth zero.
    """
    alpha, ols_se = zero_intercept(depth, stress)
    power = float(depth @ depth)
    residual = stress - alpha[:, None] * depth
    scatter, count = weighted_sum_variance(residual, depth)
    lever = float(depth.sum()) / power
    # what shifts the stress of all samples alike: errors of the clocks, and of the zeros
    shift = np.vstack([(alpha * depth_sd) ** 2, zero_variance])
    given = np.full(alpha.size, GIVEN_DOF)
    shift_dof = np.vstack([given, zero_dof])
    moved = np.zeros(alpha.size) if startup is None else startup * lever
    parts = np.vstack([scatter / power**2, shift * lever**2, moved**2])
    dofs = np.vstack([np.full(alpha.size, count), shift_dof, given])
    se = np.sqrt(parts.sum(axis=0))
    intercept, free_slope = _free_intercept(depth, stress)
    p_value, ratio = _curvature(depth, alpha, residual, shift, shift_dof)
    return Slope(
        alpha, se, combine_dof(parts, dofs), ols_se, intercept, free_slope, p_value, ratio,
        depth.size, moved,
    )  # fmt: skip


def _free_intercept(depth: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    centred = depth - depth.mean()
    spread = float(centred @ centred)
    if _level(depth):
        nothing = np.full(len(stress), np.nan)
        return nothing, nothing
    slope = stress @ centred / spread
    return stress.mean(axis=1) - slope * depth.mean(), slope


def _level(depth: FloatArray) -> bool:
    """Tell a horizontal run: what its depth varies by is the noise of the arm's log."""
    return float(depth.std()) < _LEVEL * float(np.abs(depth).max())


def _curvature(
    depth: FloatArray,
    alpha: FloatArray,
    residual: FloatArray,
    shift: FloatArray,
    shift_dof: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Test a term in depth squared, made orthogonal to the line through zero.

    A stress that is off by the same everywhere bends the line through zero too, so the variances of
    such shifts belong into the test.
    """
    from scipy.special import stdtr

    bend = depth**2 - depth * float(depth**2 @ depth) / float(depth @ depth)
    power = float(bend @ bend)
    if _level(depth):
        nothing = np.full(alpha.size, np.nan)
        return nothing, nothing
    size = residual @ bend / power
    scatter, count = weighted_sum_variance(
        residual - size[:, None] * bend, bend, np.stack([depth, bend])
    )
    lever = float(bend.sum()) / power
    parts = np.vstack([scatter / power**2, shift * lever**2])
    dof = combine_dof(parts, np.vstack([np.full(alpha.size, count), shift_dof]))
    error = np.sqrt(parts.sum(axis=0))
    safe = np.where(error > 0, error, 1.0)
    p_value = np.where(error > 0, 2 * stdtr(dof, -np.abs(size) / safe), 1.0)
    deepest = int(np.argmax(depth))
    end_stress = alpha * depth[deepest]
    reference = np.where(end_stress == 0, 1.0, np.abs(end_stress))
    return p_value, size * bend[deepest] / reference
