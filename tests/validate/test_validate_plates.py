"""Plates of several sizes: exponents by hand, intervals, and what counts as a departure."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rftfit.compare.sands import by_plate, depth_exponent, size_exponent
from rftfit.measure.errors import REPEATS


@pytest.mark.parametrize("n", [0.8, 1.0, 1.4])
def test_a_power_of_depth(n: float) -> None:
    depth = np.linspace(0.5, 2, 40)
    assert depth_exponent(depth, 3 * depth**n) == pytest.approx(n)


def test_too_few_samples_give_none() -> None:
    assert math.isnan(depth_exponent(np.arange(1.0, 5.0), np.ones(4)))


def test_size() -> None:
    sizes = [6.0, 6.0, 8.0, 8.0, 10.0, 10.0]
    random = np.random.default_rng(0)
    grows = size_exponent(sizes, [0.1 * s * (1 + 0.02 * random.normal()) for s in sizes], 0.95)
    assert grows.holds(1)
    assert not grows.holds(0)
    level = size_exponent(sizes, [1 + 0.02 * random.normal() for _ in sizes], 0.95)
    assert level.holds(0)
    assert math.isnan(size_exponent([6, 6, 6], [1, 1, 1], 0.95).value)


def test_repeats_are_pooled_over_the_plates() -> None:
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
