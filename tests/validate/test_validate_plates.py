"""Plates of several sizes: exponents by hand, intervals, and what counts as a departure."""

import math

import numpy as np
import pytest

from rftfit.compare.sands import by_plate, depth_exponent, size_exponent
from rftfit.measure.errors import ASSUMED, REPEATS


@pytest.mark.parametrize("n", [0.8, 1.0, 1.4])
def test_a_power_of_depth(n):
    depth = np.linspace(0.5, 2, 40)
    assert depth_exponent(depth, 3 * depth**n) == pytest.approx(n)


def test_too_few_samples_give_none():
    assert math.isnan(depth_exponent(np.arange(1.0, 5.0), np.ones(4)))


def test_size():
    sizes = [6.0, 6.0, 8.0, 8.0, 10.0, 10.0]
    random = np.random.default_rng(0)
    grows = size_exponent(sizes, [0.1 * s * (1 + 0.02 * random.normal()) for s in sizes], 0.95)
    assert grows.holds(1)
    assert not grows.holds(0)
    level = size_exponent(sizes, [1 + 0.02 * random.normal() for _ in sizes], 0.95)
    assert level.holds(0)
    assert math.isnan(size_exponent([6, 6, 6], [1, 1, 1], 0.95).value)


def test_repeats_are_pooled_over_the_plates():
    own = np.full(3, 0.01), np.full(3, 12.0)
    alphas = {
        "small": (np.array([1.0, 1.1, 0.9]), *own),
        "middle": (np.array([1.5, 1.6, 1.4]), *own),
        "large": (np.array([2.0, 2.1, 1.9]), *own),
    }
    exponents = dict.fromkeys(alphas, np.array([1.1, 1.2, 1.3]))
    results, spread = by_plate(alphas, exponents, 0.95)
    assert spread.source == REPEATS
    assert spread.part(0.3).sd ** 2 == pytest.approx(0.01 - 0.0001)
    small = results["small"]
    assert small.alpha.value == pytest.approx(1.0)
    assert small.alpha.se == pytest.approx(0.1 / math.sqrt(3))
    assert small.largest_deviation == pytest.approx(0.1)
    assert small.runs == 3
    # Student, two degrees of freedom
    assert small.exponent.hi == pytest.approx(1.2 + 4.302653 * 0.1 / math.sqrt(3), rel=1e-5)


def test_a_slope_over_the_size_by_hand():
    """Logarithms 0, 1, 2 and 0, 1.1, 1.9: slope 0.95, squares left 0.015, one degree of freedom."""
    found = size_exponent([1.0, math.e, math.e**2], [1.0, math.exp(1.1), math.exp(1.9)], 0.95)
    se = math.sqrt(0.015 / 2)
    assert (found.value, found.se) == pytest.approx((0.95, se))
    assert (found.lo, found.hi) == pytest.approx((0.95 - 12.7062 * se, 0.95 + 12.7062 * se), 1e-5)
    assert found.holds(found.lo)
    assert found.holds(found.hi)
    assert not found.holds(found.hi + 1e-9)
    assert not found.holds(found.lo - 1e-9)
    two = size_exponent([1.0, 2.0], [1.0, 2.0], 0.95)
    assert all(math.isnan(one) for one in (two.value, two.se, two.lo, two.hi))


def test_a_single_run_has_its_own_error_and_that_of_an_assumed_bed():
    """1 N/cm^3 with 0.03 of 12 degrees of freedom, and 5 % from bed to bed."""
    one = (np.array([1.0]), np.array([0.03]), np.array([12.0]))
    exponents = {"few": np.array([1.1]), "none": np.array([np.nan])}
    results, spread = by_plate(dict.fromkeys(exponents, one), exponents, 0.95)
    assert spread.source == ASSUMED
    found = results["few"]
    assert (found.runs, found.largest_deviation) == (1, 0)
    assert found.alpha.se == pytest.approx(math.hypot(0.03, 0.05))
    half = math.hypot(2.178813 * 0.03, 1.959964 * 0.05)
    assert (found.alpha.lo, found.alpha.hi) == pytest.approx((1 - half, 1 + half), rel=1e-5)
    assert found.exponent.value == 1.1
    assert math.isnan(results["none"].exponent.value)
    for result in results.values():
        assert all(math.isnan(getattr(result.exponent, name)) for name in ("se", "lo", "hi"))


def test_the_scatter_of_exponents_by_hand():
    """1.0 and 1.4 are 1.2 +- 0.2: Student, one degree of freedom; a run without one does not count."""
    alpha = (np.array([1.0, 1.2]), np.full(2, 0.01), np.full(2, 12.0))
    results, _ = by_plate({"plate": alpha}, {"plate": np.array([1.0, np.nan, 1.4])}, 0.95)
    found = results["plate"].exponent
    assert (found.value, found.se) == pytest.approx((1.2, 0.2))
    assert (found.lo, found.hi) == pytest.approx((1.2 - 2.541241, 1.2 + 2.541241), rel=1e-5)
    assert results["plate"].largest_deviation == pytest.approx(0.1 / 1.1)


@pytest.mark.parametrize(("count", "known"), [(8, True), (7, False)])
def test_an_exponent_needs_eight_samples_where_both_are_positive(count, known):
    depth = np.concatenate([[-1.0, 0.0, 1.0, 2.0], np.linspace(0.5, 2, count)])
    stress = np.concatenate([[1.0, 1.0, 0.0, -1.0], 3 * depth[4:] ** 1.3])
    found = depth_exponent(depth, stress)
    assert found == pytest.approx(1.3 if known else math.nan, nan_ok=True)
