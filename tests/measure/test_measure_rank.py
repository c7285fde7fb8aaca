"""A fit that its data do not determine gives NaN or nothing, without an exception or a warning.

A warning is an error in the tests.
"""

import math

import numpy as np
import pandas as pd
import pytest

import rftfit
from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import gradient, spread_of_beds
from rftfit.measure.laws import DepthLaw
from rftfit.measure.surface import find_surface

FLAT = np.ones((1, 60))
"""A stress that is the same at all depths."""
AT_ZERO_AND_ONE = np.where(np.arange(60) < 59, 0.0, 5.0)
"""Depths of which all but the last are zero."""


def alpha_at_one_depth(depth_cm, law):
    """Alpha_z of a cell of three level runs at one depth, and why there is none."""
    place = {"beta_deg": 30.0, "gamma_deg": 0.0, "depth_from_cm": depth_cm, "depth_to_cm": depth_cm}
    numbers = {f"alpha_{c}{end}_N_per_cm3": 0.1 for c in "zx" for end in ("", "_se")}
    runs = pd.DataFrame(
        [{"run_id": name, **place, **numbers, "alpha_z_dof": 9, "alpha_x_dof": 9} for name in "abc"]
    )
    (row,) = alpha_table(runs, "m", 0.95, 1, law=law).to_dict("records")
    return row["alpha_z_N_per_cm3"], row["reason_code"]


def power_at_5_cm(depth_cm):
    """Power of depth that is fitted to the same stress at all depths."""
    (power,) = DepthLaw("power", 5.0).fit(depth_cm, FLAT[:, : depth_cm.size])
    return power


def spread(alpha):
    return spread_of_beds([(np.full((2, 3), alpha), np.zeros((2, 3)))] * 4)


def surface_after_a_rest():
    """Depth of the surface below an intruder that rests at one depth in air, mm."""
    depth = np.r_[np.full(120, -0.01), np.linspace(0.01, 4, 400)]
    force = 10 * np.maximum(depth, 0) + 0.01 * np.sin(np.arange(depth.size))
    return round(10 * find_surface(depth, force, 0.5, 0.05).depth_cm)


@pytest.mark.parametrize(
    ("fitted", "expected"),
    [
        # one depth, which may be the one that is looked for
        (lambda: power_at_5_cm(np.full(60, 5.0)).exponent, math.nan),
        (lambda: power_at_5_cm(np.full(60, 2.0)).alpha, math.nan),
        (lambda: power_at_5_cm(np.zeros(60)).alpha, math.nan),
        (lambda: power_at_5_cm(np.full(1, 2.0)).gain, [math.nan]),
        (lambda: rftfit.fit_slope(np.full(60, 5.0), FLAT).free_slope, [math.nan]),
        (lambda: rftfit.fit_slope(np.full(60, 5.0), FLAT).start, [math.nan]),
        (lambda: rftfit.fit_slope(np.full(60, 5.0), FLAT).nonlinear_p, [math.nan]),
        (lambda: rftfit.fit_slope(AT_ZERO_AND_ONE, FLAT).alpha, [0.2]),
        (lambda: rftfit.fit_slope(AT_ZERO_AND_ONE, FLAT).nonlinear_p, [math.nan]),
        (surface_after_a_rest, 0),
        # one direction
        (lambda: gradient(np.zeros(2), np.zeros(2), np.arange(2.0)), np.zeros((2, 2))),
        # identical values, or none
        (lambda: spread(0.0).error_at(np.full(2, 0.2), 0).sd, 0.0),
        (lambda: spread(0.3).error_at(np.full(2, 0.2), 0).sd, 0.0),
    ],
)
def test_what_data_do_not_determine(fitted, expected):
    np.testing.assert_allclose(fitted(), expected, rtol=1e-9)


def test_a_law_at_a_depth_that_a_cell_does_not_reach_gives_no_alpha():
    assert alpha_at_one_depth(2.0, DepthLaw("power", 2.0)) == (pytest.approx(0.1), "")
    alpha, code = alpha_at_one_depth(2.0, DepthLaw("power", 5.0))
    assert (math.isnan(alpha), code) == (True, "outside-window")


@pytest.mark.parametrize("target", ["map", "zeta"])
def test_a_plan_with_exact_pushes(target):
    rig = rftfit.Rig(error_percent=0, least_percent=0, directions=((0.0, 90.0),))
    steps = rftfit.plan(target, rig=rig, count=3).steps
    assert len(steps) == 4
    assert np.isfinite(steps[-1].overall)
