"""Intervals of robot speed and best curvature follow from draws of alpha and the model error."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rftfit import reference
from rftfit.measure.flags import codes_of, remark
from rftfit.model.fourier import as_array
from rftfit.model.profiles import FourierProfile, TableProfile
from rftfit.reference import alpha_grid
from rftfit.robot.config import paper_robot
from rftfit.robot.intervals import (
    best_width,
    coarser,
    each_draw,
    half_width_of_draws,
    speed_widths,
    speeds_of,
    with_arc_scaled,
    with_model_error,
)
from rftfit.robot.run import Condition

FAST = [Condition(5.0, 0.8), Condition(4.0, 1.0)]
"""Two conditions of a fast robot: frequency in Hz and curvature of the legs."""
NINE = FourierProfile(as_array(reference.coefficients("poppy_LP")))
"""Nine terms of a published medium."""


def nine_draws(spread, count=8):
    noise = np.random.default_rng(5).standard_normal((count, 9))
    return FourierProfile(NINE.coefficients * (1 + spread * noise))


def test_half_width_is_students():
    # about the profile's own number, whose place is known: one degree of freedom a draw
    width = half_width_of_draws(7.0 + np.array([0.3, -0.1, 0.2, -0.4]), 7.0, 0.95)
    root_mean_square = math.sqrt((0.09 + 0.01 + 0.04 + 0.16) / 4)
    assert width.half == pytest.approx(2.776445 * root_mean_square, rel=1e-6)
    assert (width.draws, width.why) == (4, ())
    # no width where a draw, or the profile, has no speed
    lost = half_width_of_draws(np.array([1.0, np.nan, 2.0]), 1.0, 0.95)
    assert math.isnan(lost.half)
    assert lost.why == (remark("draws-lost", lost=1, draws=3),)
    assert codes_of(half_width_of_draws(np.ones(3), math.nan, 0.95).why) == "no-speed"


def test_widths_grow_with_the_errors_of_alpha():
    robot = paper_robot()
    small, large = (
        speed_widths(robot, NINE, each_draw(nine_draws(spread), 8), FAST, 0.95)[0]
        for spread in (0.002, 0.004)
    )
    ratios = [
        large_width.half / small_width.half
        for small_width, large_width in zip(small, large, strict=True)
    ]
    assert ratios == pytest.approx([2, 2], rel=0.05)
    assert all(0.001 < width.half < 2 for width in large)


def test_the_error_of_the_model_is_one_factor_for_lift_and_one_for_thrust():
    bare = TableProfile(*alpha_grid("poppy_LP"))
    factors = []
    for profile in with_model_error(bare, 0.28):
        assert isinstance(profile, TableProfile)
        lift, thrust = (
            profile.alpha_z.max() / bare.alpha_z.max(),
            profile.alpha_x.max() / bare.alpha_x.max(),
        )
        assert_allclose(profile.alpha_z, lift * bare.alpha_z)
        assert_allclose(profile.alpha_x, thrust * bare.alpha_x)
        factors.append((lift, thrust))
    normals = np.log(factors).T / 0.28
    assert_allclose(normals.mean(axis=1), 0, atol=1e-9)
    assert_allclose(normals @ normals.T / 4, np.eye(2), atol=1e-9)
    with pytest.raises(TypeError):
        with_model_error(NINE, 0.28)


def test_widths_hold_what_another_arc_does():
    robot, draws = paper_robot(), each_draw(nine_draws(0.002, 2), 2)
    exact, small, large = (
        speed_widths(robot, NINE, draws, [Condition(5.0, 0.8)], 0.95, arc_percent=size)[0][0].half
        for size in (0.0, 1.0, 2.0)
    )
    near = with_arc_scaled(Condition(5.0, 0.8), 1.01)
    assert math.asin(near.curvature_times_R) == pytest.approx(1.01 * math.asin(0.8))
    unmoved, moved = speeds_of(coarser(robot), [NINE], [Condition(5.0, 0.8), near])[0]
    assert small == pytest.approx(math.hypot(exact, 1.96 * (moved - unmoved)), rel=1e-3)
    assert exact < small < large
    assert with_arc_scaled(Condition(5.0, 0.0), 1.01).curvature_times_R == 0
    assert 0.99 < with_arc_scaled(Condition(5.0, 1.0), 1.01).curvature_times_R < 1


def test_no_interval_of_a_best_curvature_at_the_end():
    # on nine terms the c-leg itself is the fastest
    width = best_width(paper_robot(), NINE, each_draw(nine_draws(0.001, 2), 2), 0.95)
    assert math.isnan(width.half)
    assert codes_of(width.why) == "best-at-end"
