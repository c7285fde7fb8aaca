"""A line with a free intercept and a power of depth are recovered, with right intervals.

They stand beside the line through zero, which is the model's law.
"""

import numpy as np
import pytest

import rftfit
from rftfit.measure.laws import DepthLaw, find_crust, other_laws, replace_slope

DEPTH = np.linspace(0.5, 8.0, 700)


@pytest.mark.parametrize(
    ("law", "truth", "exponent", "offset"),
    [("free_intercept", 0.3, 1.0, 0.3), ("power", 0.3, 1.2, 0.0)],
)
def test_the_chosen_law_covers_what_the_line_misses(law, truth, exponent, offset):
    random = np.random.default_rng(7)
    inside = []
    for _ in range(200):
        stress = 0.3 * (DEPTH - offset) * (DEPTH / 5) ** (exponent - 1)
        stress = stress + random.normal(0, 0.01, DEPTH.size)
        line = rftfit.fit_slope(DEPTH, stress)
        chosen = replace_slope(line, DepthLaw(law, 5.0).fit(DEPTH, stress[None]))
        lo, hi = chosen.interval(0.95)
        alpha_at_5cm = truth * (1 - offset / 5)
        inside.append(lo[0] <= alpha_at_5cm <= hi[0])
        assert abs(line.alpha[0] - alpha_at_5cm) > 5 * line.se[0] or line.curvature[0] > 0
    assert 0.90 <= np.mean(inside) <= 0.995


@pytest.mark.parametrize("exponent", [0.4, 0.7, 1.25, 1.9, 2.8])
def test_exponents_are_found(exponent):
    laws = other_laws(DEPTH, (0.3 * 5 * (DEPTH / 5) ** exponent)[None], 5.0)
    assert laws is not None
    (power,) = laws.power
    assert power.exponent == pytest.approx(exponent, abs=1e-4)
    assert power.alpha == pytest.approx(0.3, rel=1e-4)
    np.testing.assert_allclose(power.residual, 0, atol=1e-4)


def test_what_has_no_power():
    """A component that is not felt, and level runs."""
    laws = other_laws(DEPTH, np.zeros((1, DEPTH.size)), 5.0)
    assert laws is not None
    assert laws.power[0].alpha == 0
    assert other_laws(np.full(700, 5.0), np.ones((1, 700)), 5.0) is None


def test_a_stress_that_is_no_power_has_no_exponent():
    """Its alpha is that of the tangent to the powers at p = 1, by plain least squares."""
    tangent = np.stack([DEPTH, DEPTH * np.log(DEPTH / 5.0)], axis=1)
    for stress in (np.exp(-2 * DEPTH), np.exp(3 * DEPTH)):
        laws = other_laws(DEPTH, stress[None], 5.0)
        assert laws is not None
        assert np.isnan(laws.power[0].exponent)
        (alpha, _), *_ = np.linalg.lstsq(tangent, stress, rcond=None)
        assert laws.power[0].alpha == pytest.approx(alpha, rel=1e-6)


@pytest.mark.parametrize(
    ("disturb", "is_crust"),
    [
        (lambda depth: 1.2 * np.exp(-(((depth - 0.4) / 0.15) ** 2)), True),
        (lambda depth: 0 * depth, False),
        # stick-slip falls again and again
        (lambda depth: 0.5 * (8 * depth % 1 < 0.5), False),
        # a stone lies deep
        (lambda depth: 3 * np.exp(-(((depth - 4) / 0.2) ** 2)), False),
    ],
)
def test_a_crust_is_one_peak_near_the_surface(disturb, is_crust):
    depth = np.linspace(0, 5, 400)
    crust = find_crust(depth, 0.3 * (depth + disturb(depth)))
    assert (crust is not None) == is_crust
    if crust is not None:
        assert crust.depth_cm == pytest.approx(0.45, abs=0.1)
        line_N_per_cm2 = 0.3 * crust.depth_cm
        broken_N_per_cm2 = 0.3 * (crust.depth_cm + disturb(crust.depth_cm))
        # a moving mean lowers the peak
        assert 0.85 < (crust.excess + 1) * line_N_per_cm2 / broken_N_per_cm2 < 1
