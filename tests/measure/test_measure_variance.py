"""The estimated variance of sums of correlated errors agrees with the exact variance."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

import rftfit
from rftfit.measure.slopes import fit_slope

SERIES, N = 3000, 300
"""Simulated series of errors, and the length of each."""
SIGMA = 0.05


def correlated(rho, seed, n=N):
    """Errors of deviation SIGMA, each `rho` times the one before plus something new."""
    white = np.random.default_rng(seed).standard_normal((SERIES, n + 300))
    scale = SIGMA * np.sqrt(1 - rho**2)
    return np.asarray(lfilter([scale], [1, -rho], white, axis=1)[:, 300:])


@pytest.mark.parametrize("rho", [0.0, 0.6, -0.4])
@pytest.mark.parametrize("depth", [np.ones(N), np.linspace(1, 4, N)], ids=["mean", "slope"])
def test_variance_of_correlated_errors(rho, depth):
    slope = rftfit.fit_slope(depth, correlated(rho, 3))
    power = float(depth @ depth)
    exact = SIGMA**2 * float(depth @ toeplitz(rho ** np.arange(N)) @ depth) / power**2
    # of a line some series look curved by chance, which is an error of its own
    variance = slope.se**2 - slope.curvature**2
    assert np.mean(variance) == pytest.approx(exact, rel=0.06)
    # a Student t needs a variance that scatters as chi square with its degrees of freedom does
    straight = slope.curvature == 0
    np.testing.assert_allclose(slope.dof[straight], 12)
    assert np.var(variance) == pytest.approx(2 * np.mean(variance) ** 2 / 12, rel=0.3)


@pytest.mark.parametrize(
    ("n", "dof"), [(8, 1), (15, 3), (16, 3), (40, 8), (52, 11), (53, 12), (500, 12)]
)
def test_short_series_have_fewer_degrees_of_freedom(n, dof):
    # one sample in eight goes into the autoregression, at most five; four are needed a cosine
    slope = rftfit.fit_slope(np.ones(n), correlated(0.0, 5, n))
    np.testing.assert_allclose(slope.dof, dof)
    assert np.isfinite(slope.se).all()
    assert (slope.se > 0).all()


@pytest.mark.parametrize(
    ("samples", "rho", "fewest", "most"),
    [(N, 0.0, 0.04, 0.06), (N, 0.7, 0.04, 0.06), (100, 0.0, 0.04, 0.07)],
)
def test_false_alarms_of_curvature_are_as_many_as_said(samples, rho, fewest, most):
    """Lines with noise and nothing else: p is uniform, 5 % of them lie below 0.05, 1 % below 0.01."""
    depth = np.linspace(2.0, 7.0, samples)
    noise = correlated(rho, 13, samples)
    p = rftfit.fit_slope(depth, 0.3 * depth + noise).nonlinear_p
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
    p_without_zero = rftfit.fit_slope(depth, stress).nonlinear_p
    assert np.mean(p_without_zero < 0.05) > 0.5


def test_no_stress_is_straight():
    slope = rftfit.fit_slope(np.linspace(1, 5, 50), np.zeros((2, 50)))
    for numbers in (slope.alpha, slope.se, slope.nonlinear_ratio):
        np.testing.assert_array_equal(numbers, 0)
    np.testing.assert_array_equal(slope.nonlinear_p, 1)


@pytest.mark.parametrize(
    ("rho", "least", "most"), [(0.6, 0.97, 1.18), (0.0, 0.97, 1.05), (-0.9, 0.95, 1.03)]
)
def test_a_short_rest_is_not_too_sure_and_hardly_too_unsure(rho, least, most):
    """Half a second of rest: what the bias of so short an autoregression leaves."""
    n = 60
    mean = rftfit.fit_slope(np.ones(n), correlated(rho, 3, n))
    exact = SIGMA**2 * float(toeplitz(rho ** np.arange(n)).sum()) / n**2
    assert least < np.mean(mean.se**2) / exact < most
