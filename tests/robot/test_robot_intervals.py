"""Intervals of robot speed and best curvature follow from draws of alpha and the model error."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rftfit import TableProfile
from rftfit.robot.intervals import half_width_of_draws, with_model_error


def test_half_width_is_students():
    # about the profile's own number, whose place is known: one degree of freedom a draw
    width = half_width_of_draws(7.0 + np.array([0.3, -0.1, 0.2, -0.4]), 7.0, 0.95)
    root_mean_square = math.sqrt((0.09 + 0.01 + 0.04 + 0.16) / 4)
    assert width.half == pytest.approx(2.776445 * root_mean_square, rel=1e-6)
    assert (width.draws, width.why) == (4, ())
    # no width where a draw, or the profile, has no speed
    lost = half_width_of_draws(np.array([1.0, np.nan, 2.0]), 1.0, 0.95)
    assert math.isnan(lost.half)
    (why,) = lost.why
    assert (why.code, dict(why.values)) == ("draws-lost", {"lost": 1, "draws": 3})
    (why,) = half_width_of_draws(np.ones(3), math.nan, 0.95).why
    assert why.code == "no-speed"


def test_the_error_of_the_model_is_one_factor_for_lift_and_one_for_thrust(table, nine):
    factors = []
    for profile in with_model_error(table, 0.28):
        assert isinstance(profile, TableProfile)
        lift, thrust = (
            profile.alpha_z.max() / table.alpha_z.max(),
            profile.alpha_x.max() / table.alpha_x.max(),
        )
        assert_allclose(profile.alpha_z, lift * table.alpha_z)
        assert_allclose(profile.alpha_x, thrust * table.alpha_x)
        factors.append((lift, thrust))
    normals = np.log(factors).T / 0.28
    assert_allclose(normals.mean(axis=1), 0, atol=1e-9)
    assert_allclose(normals @ normals.T / 4, np.eye(2), atol=1e-9)
    with pytest.raises(TypeError):
        with_model_error(nine, 0.28)
