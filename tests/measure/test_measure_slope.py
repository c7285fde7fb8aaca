"""The slope of a line through zero equals certified values, and its errors behave as theory says.

Certified: the NIST data sets NoInt1 and NoInt2.
"""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import rftfit
from rftfit.measure.slopes import fit_few, fit_slope, startup_bias

DEPTH = np.linspace(1.9, 7.1, 520)


def stress(seed=0):
    noise = np.random.default_rng(seed).normal(0, 0.005, (2, DEPTH.size))
    return np.stack([0.3 * DEPTH, -0.1 * DEPTH]) + noise


def test_nist():
    """Alpha and its textbook error, of the data set NoInt1."""
    slope = rftfit.fit_slope(np.arange(60.0, 71), np.arange(130.0, 141))
    np.testing.assert_allclose(
        [*slope.alpha, *slope.ols_se], [2.07438016528926, 0.0165289256198347], rtol=5e-13
    )


def test_curvature_is_found_and_its_size_is_right():
    slope = rftfit.fit_slope(DEPTH, stress() + 0.02 * DEPTH**2)
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


@settings(max_examples=40)
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
    level = rftfit.fit_slope(depth, 0.1 * depth + random.normal(0, 0.005, (2, 440)))
    np.testing.assert_allclose(level.alpha, 0.1, atol=0.001)
    for name in ("intercept", "free_slope", "nonlinear_p", "nonlinear_ratio"):
        assert np.isnan(getattr(level, name)).all(), name


def test_two_depths_have_no_line_besides_and_one_has_no_error():
    """With the data set NoInt2 of three depths."""
    three = fit_few(np.array([4.0, 5, 6]), np.array([[3.0, 4, 4]]))
    np.testing.assert_allclose(
        [*three.alpha, *three.se], [0.727272727272727, 0.0420827318078432], rtol=5e-13
    )
    two = fit_few(np.array([1.0, 2.0]), np.array([[1.0, 2.5]]))
    np.testing.assert_allclose([*two.alpha, *two.se], [1.2, np.sqrt((0.2**2 + 0.1**2) / 5)])
    assert two.dof == [1]
    assert np.isnan([*two.intercept, *two.free_slope]).all()
    single = fit_few(np.array([2.0]), np.array([[1.0], [3.0]]))
    np.testing.assert_allclose(single.alpha, [0.5, 1.5])
    assert np.isnan(single.se).all()


def test_an_exponential_start_up_is_found():
    """The bias that it leaves in the window is its exact mean there."""
    path = np.linspace(0, 40, 400_001)
    decay_cm, steady, size = 0.4, 0.3, 0.2
    stress = steady + size * np.exp(-path / decay_cm) * np.array([[1.0], [-2.0]])
    window = path >= 2.0
    bias = startup_bias(path, stress, window, 2.0)
    # integral of the exponential from 2 cm on, over the 38 cm of the window
    exact = size * decay_cm * np.exp(-2.0 / decay_cm) / 38
    np.testing.assert_allclose(bias, [exact, -2 * exact], rtol=0.01)
    np.testing.assert_allclose(stress[:, window].mean(axis=1) - steady, bias, rtol=0.01)
