"""The law by which stress in a natural sand grows with depth is named, or said to be unknown."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit.measure.laws import find_crust


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
