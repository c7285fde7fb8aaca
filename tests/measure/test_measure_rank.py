"""A fit that its data do not determine gives NaN or nothing, without an exception or a warning.

A warning is an error in the tests.
"""

import math

import numpy as np
import pandas as pd
import pytest

import rftfit
from rftfit.compare.sands import bend_of
from rftfit.measure.alpha import alpha_table, column
from rftfit.measure.errors import gradient, spread_of_beds
from rftfit.measure.laws import LINE_THROUGH_ZERO, DepthLaw, other_laws
from rftfit.measure.levels import shifted_runs
from rftfit.measure.slopes import fit_few, fit_slope, weighted_sum_variance
from rftfit.measure.surface import find_surface

FLAT = np.ones((1, 60))
"""A stress that is the same at all depths."""
ZERO = np.zeros((1, 1)), np.ones((1, 1))
"""Variance of the zero (none) and its degrees of freedom."""
AT_ZERO_AND_ONE = np.where(np.arange(60) < 59, 0.0, 5.0)
"""Depths of which all but the last are zero."""


def alpha_at_one_depth(depth_cm, law=LINE_THROUGH_ZERO):
    """Alpha_z of a cell of three level runs at one depth, and why there is none."""
    place = {"beta_deg": 30.0, "gamma_deg": 0.0, "depth_from_cm": depth_cm, "depth_to_cm": depth_cm}
    numbers = {column(c, end): 0.1 for c in "zx" for end in ("", "_se")}
    runs = pd.DataFrame(
        [{"run_id": name, **place, **numbers, "alpha_z_dof": 9, "alpha_x_dof": 9} for name in "abc"]
    )
    (row,) = alpha_table(runs, "m", 0.95, 1, law=law).to_dict("records")
    return [row[column("z")], row["reason_code"]]


def power_at_5_cm(depth_cm):
    """Power of depth that is fitted to the same stress at all depths."""
    (power,) = DepthLaw("power", 5.0).fit(depth_cm, FLAT[:, : depth_cm.size])
    return power


def spread(alpha):
    return spread_of_beds([(np.full((2, 3), alpha), np.zeros((2, 3)))] * 4)


def plan_with_exact_pushes(target):
    rig = rftfit.Rig(error_percent=0, least_percent=0, directions=((0.0, 90.0),))
    plan = rftfit.plan(target, rig=rig, count=3)
    return len(plan.steps), bool(np.isfinite(plan.steps[-1].typical))


def surface_after_a_rest():
    """Depth of the surface below an intruder that rests at one depth in air, mm."""
    depth = np.r_[np.full(120, -0.01), np.linspace(0.01, 4, 400)]
    force = 10 * np.maximum(depth, 0) + 0.01 * np.sin(np.arange(depth.size))
    return round(10 * find_surface(depth, force, 0.5, 0.05).depth_cm)


NO_BED = (0.0, "repeats")


@pytest.mark.parametrize(
    ("fitted", "expected"),
    [
        # one depth, which may be the one that is looked for
        (lambda: power_at_5_cm(np.full(60, 5.0)).exponent, math.nan),
        (lambda: power_at_5_cm(np.full(60, 2.0)).alpha, math.nan),
        (lambda: power_at_5_cm(np.zeros(60)).alpha, math.nan),
        (lambda: power_at_5_cm(np.full(1, 2.0)).gain, [math.nan]),
        (lambda: other_laws(np.zeros(60), FLAT, 5.0) is None, True),
        (lambda: fit_slope(np.full(60, 5.0), FLAT, *ZERO).free_slope, [math.nan]),
        (lambda: fit_slope(np.full(60, 5.0), FLAT, *ZERO).start, [math.nan]),
        (lambda: fit_few(np.full(3, 2.0), FLAT[:, :3]).free_slope, [math.nan]),
        (lambda: fit_slope(np.full(60, 5.0), FLAT, *ZERO).nonlinear_p, [math.nan]),
        (lambda: fit_slope(AT_ZERO_AND_ONE, FLAT, *ZERO).alpha, [0.2]),
        (lambda: fit_slope(AT_ZERO_AND_ONE, FLAT, *ZERO).nonlinear_p, [math.nan]),
        (lambda: weighted_sum_variance(FLAT, np.zeros(60))[0], [math.nan]),
        (lambda: bend_of(np.full(9, 2.0), np.ones(9)), math.nan),
        (lambda: bend_of(np.full(1, 2.0), np.ones(1)), math.nan),
        (lambda: alpha_at_one_depth(2.0), [0.1, ""]),
        (lambda: alpha_at_one_depth(2.0, DepthLaw("power", 2.0)), [0.1, ""]),
        (lambda: alpha_at_one_depth(2.0, DepthLaw("power", 5.0)), [math.nan, "outside-window"]),
        (lambda: alpha_at_one_depth(0.0), [math.nan, "zero-depths"]),
        (surface_after_a_rest, 0),
        # one direction
        (lambda: gradient(np.zeros(2), np.zeros(2), np.arange(2.0)), np.zeros((2, 2))),
        (lambda: plan_with_exact_pushes("map"), (4, True)),
        (lambda: plan_with_exact_pushes("zeta"), (4, True)),
        # identical values, or none
        (lambda: (spread(0.0).error_at(np.full(2, 0.2), 0).sd, spread(0.0).source), NO_BED),
        (lambda: (spread(0.3).error_at(np.full(2, 0.2), 0).sd, spread(0.3).source), NO_BED),
    ],
)
def test_what_data_do_not_determine(fitted, expected):
    fit_output = fitted()
    if isinstance(expected, (float, list, np.ndarray)) and not isinstance(fit_output, list):
        np.testing.assert_allclose(fit_output, expected, rtol=1e-9)
    elif isinstance(fit_output, list):
        assert fit_output[1] == expected[1]
        np.testing.assert_allclose(fit_output[0], expected[0])
    else:
        assert fit_output == expected


@pytest.mark.parametrize("constant", [0.0, 1.0])
def test_a_column_that_says_nothing_new_takes_no_freedom(constant):
    """Starts of runs on one path: a lag, which would move all alike, hides no run."""
    random = np.random.default_rng(1)
    common = np.column_stack([np.ones(12), np.full(12, constant)])
    for start in random.normal(0, 0.05, (30, 12)):
        alone = shifted_runs(common[:, :1], start, np.full(12, 0.05))
        assert (shifted_runs(common, start, np.full(12, 0.05)) == alone).all()
