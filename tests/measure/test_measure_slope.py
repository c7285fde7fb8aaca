"""The slope of a line through zero equals certified values, and its errors behave as theory says.

Certified: the NIST data sets NoInt1 and NoInt2.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rftfit.measure.slopes import (
    fit_few,
    fit_slope,
    free_intercept,
    stress_onset,
    student_quantile,
    zero_intercept,
)

NOTHING = np.zeros((2, 2)), np.full((2, 2), 12.0)
"""Variance of the zeros (none) and their degrees of freedom."""
DEPTH = np.linspace(1.9, 7.1, 520)


def stress(seed=0):
    noise = np.random.default_rng(seed).normal(0, 0.005, (2, DEPTH.size))
    return np.stack([0.3 * DEPTH, -0.1 * DEPTH]) + noise


def fit(depth, values, depth_sd=0.0):
    return fit_slope(depth, values, *NOTHING, depth_sd)


@pytest.mark.parametrize(
    ("x", "y", "alpha", "se"),
    [
        (range(60, 71), range(130, 141), 2.07438016528926, 0.0165289256198347),
        ((4, 5, 6), (3, 4, 4), 0.727272727272727, 0.0420827318078432),
    ],
    ids=["NoInt1", "NoInt2"],
)
def test_nist(x, y, alpha, se):
    alpha_and_se = zero_intercept(np.array(x, float), np.array([y], float))
    np.testing.assert_allclose(np.ravel(alpha_and_se), [alpha, se], rtol=5e-13)


def test_curvature_is_found_and_its_size_is_right():
    bent = stress() + 0.02 * DEPTH**2
    slope = fit(DEPTH, bent)
    assert (slope.nonlinear_p < 1e-6).all()
    # the parabola through zero that is fitted lies that much above the line at the deepest sample
    line = slope.alpha * DEPTH[-1]
    curve = np.array([0.3, -0.1]) * DEPTH[-1] + 0.02 * DEPTH[-1] ** 2
    np.testing.assert_allclose(slope.nonlinear_ratio, (curve - line) / np.abs(line), rtol=0.01)


def test_error_of_a_curvature_is_what_noise_does_not_explain():
    bent = stress() + 0.02 * DEPTH**2
    zero = np.full((2, 1, 2), np.array([0.0, 0.01])[:, None, None])
    sure, unsure = (fit_slope(DEPTH, bent, variance, np.full((1, 2), 1e9)) for variance in zero)
    at_end = np.abs(sure.nonlinear_ratio * sure.alpha)
    np.testing.assert_allclose(sure.curvature, at_end / np.sqrt(3), rtol=1e-3)
    # a zero that is off by 0.1 N/cm^2 bends the line through zero by this much, once in a hundred times
    bend = DEPTH**2 - DEPTH * (DEPTH**2 @ DEPTH) / (DEPTH @ DEPTH)
    by_zero = 2.5758 * 0.1 * abs(bend.sum() / (bend @ bend) * bend[-1] / DEPTH[-1])
    unexplained = np.sqrt(np.maximum(at_end**2 - by_zero**2, 0))
    assert (unexplained < 0.9 * at_end).all()
    np.testing.assert_allclose(unsure.curvature, unexplained / np.sqrt(3), rtol=1e-2)


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10**6),
    slow=st.floats(0, 0.01),
    increase=st.floats(1e-5, 0.01),
    bend=st.floats(0, 0.004),
)
def test_a_less_certain_zero_never_narrows_an_interval(seed, slow, increase, bend):
    """Of bent lines too, whose curvature it explains."""
    walk = np.random.default_rng(seed).normal(0, 0.0005, (4, DEPTH.size)).cumsum(axis=1)
    bent = 0.1 * DEPTH + bend * DEPTH**2 + walk
    variances = (np.full((1, 4), zero**2) for zero in (slow, slow + increase))
    fits = [fit_slope(DEPTH, bent, variance, np.full((1, 4), 20.0)) for variance in variances]
    less, larger = (np.subtract(*slope.interval(0.95)[::-1]) for slope in fits)
    assert (larger >= less * (1 - 1e-9)).all()


def test_horizontal_run_has_no_slope_to_free_and_no_curvature():
    """The arm's noise of 3 micrometres in depth must not be taken for a change of depth."""
    random = np.random.default_rng(2)
    depth = 5.08 + random.normal(0, 0.0003, 440)
    level = fit(depth, 0.1 * depth + random.normal(0, 0.005, (2, 440)))
    np.testing.assert_allclose(level.alpha, 0.1, atol=0.001)
    for name in ("intercept", "free_slope", "nonlinear_p", "nonlinear_ratio"):
        assert np.isnan(getattr(level, name)).all(), name


def test_errors_of_zero_and_depth_add_in_quadrature():
    variance = np.array([[1e-4, 4e-4], [3e-4, 5e-4]])
    plain = fit(DEPTH, stress())
    lever = DEPTH.sum() / (DEPTH @ DEPTH)
    zeroed = fit_slope(DEPTH, stress(), variance, NOTHING[1])
    expected = np.sqrt(plain.se**2 + variance.sum(axis=0) * lever**2)
    np.testing.assert_allclose(zeroed.se, expected, rtol=1e-12)
    assert zeroed.lever == pytest.approx(lever)
    # of a tare whose scatter is not given, the zero alone
    np.testing.assert_allclose(zeroed.tare**2, variance[1] * lever**2, rtol=1e-9)
    alone = fit_slope(DEPTH, stress(), variance[:1], NOTHING[1][:1])
    np.testing.assert_array_equal(alone.tare, [0, 0])
    np.testing.assert_allclose(zeroed.shift, variance.sum(axis=0))
    np.testing.assert_allclose(zeroed.shift_of_tare, variance[1])
    grown = (zeroed.offset_se**2 - plain.offset_se**2) * zeroed.free_slope**2
    np.testing.assert_allclose(grown, variance.sum(axis=0), rtol=1e-6)
    shifted = fit(DEPTH, stress(), depth_sd=0.01)
    expected = np.sqrt(plain.se**2 + (plain.alpha * 0.01 * lever) ** 2)
    np.testing.assert_allclose(shifted.se, expected, rtol=1e-12)


def test_a_few_depths_are_fitted_with_the_textbook_error():
    """Of a table of stress: independent means, without log, zero or tare."""
    depth = np.array([1.0, 2.0, 4.0])
    few_fit = fit_few(depth, np.array([[1.0, 2.0, 3.5], [-0.5, -1.0, -2.0]]))
    # by hand: sum of products 19 and -10.5, of squares 21
    alpha = np.array([19 / 21, -0.5])
    left = np.array([1.0, 2.0, 3.5]) - alpha[0] * depth
    se = [np.sqrt(left @ left / 2 / 21), 0.0]
    slope, intercept = np.polyfit(depth, [1.0, 2.0, 3.5], 1)
    expected: dict[str, Any] = {
        "alpha": alpha,
        "se": se,
        "ols_se": se,
        "dof": [2, 2],
        "free_slope": [slope, -0.5],
        "intercept": [intercept, 0.0],
    }
    unknown = ("nonlinear_p", "nonlinear_ratio", "offset", "offset_se")
    nothing = ("startup", "tare", "curvature", "shift", "shift_of_tare")
    expected |= dict.fromkeys(unknown, np.nan) | dict.fromkeys(nothing, 0)
    for name, values in expected.items():
        np.testing.assert_allclose(getattr(few_fit, name), values, atol=1e-12, err_msg=name)
    assert few_fit.points == 3
    assert few_fit.lever == pytest.approx(7 / 21)


def test_two_depths_have_no_line_besides_and_one_has_no_error():
    two = fit_few(np.array([1.0, 2.0]), np.array([[1.0, 2.5]]))
    np.testing.assert_allclose(two.alpha, [1.2])
    np.testing.assert_allclose(two.se, [np.sqrt((0.2**2 + 0.1**2) / 1 / 5)])
    assert two.dof == [1]
    assert np.isnan([*two.intercept, *two.free_slope]).all()
    single = fit_few(np.array([2.0]), np.array([[1.0], [3.0]]))
    np.testing.assert_allclose(single.alpha, [0.5, 1.5])
    assert np.isnan(single.se).all()
    np.testing.assert_array_equal(single.dof, [1, 1])


@pytest.mark.parametrize(
    ("confidence", "dof", "value"),
    [(0.95, 4, 2.776445), (0.95, 10, 2.228139), (0.95, 1e9, 1.959964), (0.90, 5, 2.015048)],
)
def test_student(confidence, dof, value):
    assert float(student_quantile(confidence, dof)) == pytest.approx(value, rel=1e-6)


def test_where_stress_begins():
    """Of lines exactly; an unevenness that grows with depth moves it less than it moves the plain line."""
    depth = np.linspace(1, 7, 200)
    begins = stress_onset(depth, np.stack([0.3 * (depth - 0.4), -0.05 * (depth + 0.2)]))
    np.testing.assert_allclose(begins, [0.4, -0.2], rtol=1e-9)
    uneven = 0.3 * depth * (1 + 0.05 * (depth > 5))
    intercept, slope = free_intercept(depth, uneven[None])
    assert abs(stress_onset(depth, uneven[None])[0]) < 0.5 * abs(intercept[0] / slope[0])
    for level, stress in ((np.full(9, 2.0), np.ones((1, 9))), (depth, np.zeros((1, 200)))):
        assert np.isnan(stress_onset(level, stress)).all()


def test_share_of_the_tare_is_what_its_own_scatter_shows():
    """A rod that is quiet beside its plate has a small share, however its force rises; one of equal noise half."""
    random = np.random.default_rng(5)
    noise_of_run = random.normal(0, 0.01, (400, DEPTH.size))
    noise_of_tare = random.normal(0, 0.01, (400, DEPTH.size))
    rod = 0.02 * DEPTH + 0.003 * DEPTH**2
    nothing = np.zeros((2, 400)), np.ones((2, 400))
    for ratio, expected in [(0.0, 0.0), (0.3, 0.09 / 1.09), (1.0, 0.5), (3.0, 0.9)]:
        tare = rod + ratio * noise_of_tare
        tared = 0.3 * DEPTH + noise_of_run - ratio * noise_of_tare
        slope = fit_slope(DEPTH, tared, *nothing, tare_stress=tare)
        assert np.median(slope.tare_share) == pytest.approx(expected, abs=0.1)
        assert slope.tare_share.max() <= 1
        without = fit_slope(DEPTH, tared, *nothing)
        np.testing.assert_array_equal(slope.se, without.se)
        np.testing.assert_array_equal(without.tare, 0)
