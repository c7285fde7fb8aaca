"""The estimated variance of sums of correlated errors agrees with the exact variance."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from rftfit.measure.slopes import fit_slope, weighted_sum_variance

SERIES, N = 3000, 300
"""Simulated series of errors, and the length of each."""
SIGMA = 0.05


def correlated(rho, seed, n=N):
    """Errors of deviation SIGMA, each `rho` times the one before plus something new."""
    white = np.random.default_rng(seed).standard_normal((SERIES, n + 300))
    scale = SIGMA * np.sqrt(1 - rho**2)
    return np.asarray(lfilter([scale], [1, -rho], white, axis=1)[:, 300:])


@pytest.mark.parametrize("rho", [0.0, 0.6, -0.4])
@pytest.mark.parametrize("weight", [np.ones(N), np.linspace(1, 4, N)], ids=["mean", "slope"])
def test_variance_of_correlated_errors(rho, weight):
    errors = correlated(rho, 3)
    fitted = (errors @ weight)[:, None] * weight / (weight @ weight)
    variance, dof = weighted_sum_variance(errors - fitted, weight)
    exact = SIGMA**2 * float(weight @ toeplitz(rho ** np.arange(N)) @ weight)
    assert np.mean(variance) == pytest.approx(exact, rel=0.06)
    # a Student t needs a variance that scatters as chi square with its degrees of freedom does
    assert dof == 12
    assert np.var(variance) == pytest.approx(2 * np.mean(variance) ** 2 / dof, rel=0.3)


@pytest.mark.parametrize(
    ("n", "dof"), [(8, 1), (15, 3), (16, 3), (40, 8), (52, 11), (53, 12), (500, 12)]
)
def test_short_series_have_fewer_degrees_of_freedom(n, dof):
    # one sample in eight goes into the autoregression, at most five; four are needed a cosine
    errors = correlated(0.0, 5, n)
    variance, series_dof = weighted_sum_variance(errors - errors.mean(axis=1)[:, None], np.ones(n))
    assert series_dof == dof
    assert np.isfinite(variance).all()
    assert (variance > 0).all()


@pytest.mark.parametrize(
    ("samples", "rho", "fewest", "most"),
    [(N, 0.0, 0.04, 0.06), (N, 0.7, 0.04, 0.06), (100, 0.0, 0.04, 0.07)],
)
def test_false_alarms_of_curvature_are_as_many_as_said(samples, rho, fewest, most):
    """Lines with noise and nothing else: p is uniform, 5 % of them lie below 0.05, 1 % below 0.01."""
    depth = np.linspace(2.0, 7.0, samples)
    noise = correlated(rho, 13, samples)
    nothing = np.zeros((1, SERIES)), np.full((1, SERIES), 12.0)
    p = fit_slope(depth, 0.3 * depth + noise, *nothing).nonlinear_p
    assert np.mean(p) == pytest.approx(0.5, abs=0.02)
    assert fewest < np.mean(p < 0.05) < most
    assert fewest / 8 < np.mean(p < 0.01) < most / 3
    assert p.max() <= 1


def test_an_error_of_the_zero_is_no_curvature():
    """A shift bends the line through zero: its variance belongs into the test."""
    depth = np.linspace(2.0, 7.0, N)
    zero_sd = 0.02
    shift = np.random.default_rng(3).normal(0, zero_sd, SERIES)[:, None]
    stress = 0.3 * depth + shift + correlated(0.0, 14) / 10
    variance, dof = np.full((1, SERIES), zero_sd**2), np.full((1, SERIES), 1000.0)
    p = fit_slope(depth, stress, variance, dof).nonlinear_p
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.013)
    p_without_zero = fit_slope(depth, stress, 0 * variance, dof).nonlinear_p
    assert np.mean(p_without_zero < 0.05) > 0.5


def test_no_stress_is_straight():
    slope = fit_slope(np.linspace(1, 5, 50), np.zeros((2, 50)), np.zeros((1, 2)), np.ones((1, 2)))
    np.testing.assert_array_equal(slope.alpha, 0)
    np.testing.assert_array_equal(slope.nonlinear_ratio, 0)
    np.testing.assert_array_equal(slope.nonlinear_p, 1)
    np.testing.assert_array_equal(slope.se, 0)


@pytest.mark.parametrize(
    ("rho", "least", "most"), [(0.6, 0.97, 1.18), (0.0, 0.97, 1.05), (-0.9, 0.95, 1.03)]
)
def test_a_short_rest_is_not_too_sure_and_hardly_too_unsure(rho, least, most):
    """Half a second of rest: what the bias of so short an autoregression leaves."""
    n = 60
    errors = correlated(rho, 3, n)
    variance, _ = weighted_sum_variance(errors - errors.mean(axis=1)[:, None], np.ones(n))
    exact = SIGMA**2 * float(toeplitz(rho ** np.arange(n)).sum())
    assert least < np.mean(variance) / exact < most
