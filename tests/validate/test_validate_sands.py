"""The end of the linear regime of a penetration test is found where its stress bends by a tenth.

Also tested: the errors of a single test by its bed and its rod.
"""

import numpy as np
import pytest

from rftfit import published_table
from rftfit.compare.sands import linear_end


@pytest.mark.parametrize(
    ("noise", "missing", "off_cm"), [(0.0, 0, 0.051), (0.02, 0, 0.45), (0.0, 40, 0.051)]
)
def test_a_straight_line_is_linear_to_its_end(noise, missing, off_cm):
    depth = np.arange(0.01, 6.0, 0.01)
    stress = 0.7 * depth + np.random.default_rng(0).normal(0, noise, depth.size)
    stress[100 : 100 + missing] = np.nan
    assert linear_end(depth, stress) == pytest.approx(5.95, abs=off_cm)


@pytest.mark.parametrize(("curve_per_cm", "end_cm"), [(0.2, 2.857), (-0.1, 3.077)])
def test_a_regime_ends_where_a_parabola_bends_by_a_tenth(curve_per_cm, end_cm):
    """u = curve times depth: it leaves its line through zero by (u / 4) / (1 + 3 u / 4)."""
    depth = np.arange(0.001, 6.0, 0.001)
    detected_cm = linear_end(depth, 0.7 * (depth + curve_per_cm * depth**2))
    assert end_cm - 0.05 <= detected_cm <= end_cm + 0.001


@pytest.mark.parametrize(("count", "is_linear"), [(8, True), (7, False)])
def test_a_regime_has_at_least_eight_samples_below_the_surface(count, is_linear):
    depth = np.concatenate([[-0.2, -0.1, 0.0], np.linspace(0.1, 1.0, count)])
    stress = np.where(depth > 0, 0.7 * depth, 5.0)
    assert np.isfinite(linear_end(depth, stress)) == is_linear


@pytest.mark.parametrize("knee", [1.5, 2.5, 4.0])
def test_a_steeper_second_part_ends_the_regime_behind_its_knee(knee):
    depth = np.arange(0.01, 8.0, 0.01)
    stress = 0.5 * depth + 1.5 * np.clip(depth - knee, 0, None)
    end = linear_end(depth, stress)
    assert knee <= end <= 1.4 * knee


def test_published_sands():
    """Yuma sand bends within the stated 2 cm, the 29 Palms sands stay nearly straight."""
    table = published_table("fig_s11")
    ends = {
        sand: linear_end(curve["depth_cm"].to_numpy(), curve["stress_z_N_per_cm2"].to_numpy())
        for sand, curve in table.groupby("medium")
    }
    assert 1.2 <= ends["yuma"] <= 2.2
    assert ends["palms29"] >= 3
    assert ends["palms29_sieved"] >= 3
