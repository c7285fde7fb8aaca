"""The lift of a level belly alone makes reversed legs too fast in the generic profile."""

import numpy as np
import pytest
from ingredients import compared, ingredients, summary
from numpy.testing import assert_allclose, assert_array_equal

from rftfit import TableProfile
from rftfit.robot.config import paper_robot
from rftfit.robot.speeds import published_speeds

MEDIUM = "poppy_LP"
BELLY = "table, nine terms in alpha_z at (0, 0) alone"
"""Name of the profile that differs from the table in one cell only."""


def test_each_profile_changes_what_it_says():
    profiles = ingredients(MEDIUM)
    rng = np.random.default_rng(4)
    beta, gamma = rng.uniform(-1.5, 1.5, 200), rng.uniform(-1.5, 1.5, 200)
    table = TableProfile.published(MEDIUM).alpha(beta, gamma)
    assert_array_equal(profiles["measured table"].alpha(beta, gamma), table)
    belly = profiles[BELLY].alpha(beta, gamma)
    assert_array_equal(belly[1], table[1])
    # bilinear between the nodes: 30 and 18.43 degrees around that cell
    near = (np.abs(np.degrees(beta)) < 30) & (np.abs(np.degrees(gamma)) < 18.43)
    assert near.any()
    assert_allclose(belly[0][~near], table[0][~near], atol=1e-12)
    assert (belly[0][near] > table[0][near]).all()
    nine_at_cells, nine_terms = (
        profiles[f"nine terms of it{end}"] for end in (", at the cells of the table", "")
    )
    nodes = np.radians([30.0, 0.0, -60.0]), np.radians([45.0, 0.0, 90.0])
    assert_allclose(nine_at_cells.alpha(*nodes), nine_terms.alpha(*nodes), atol=1e-3)


def test_the_lift_of_the_level_belly_alone_makes_reversed_legs_too_fast():
    fast = published_speeds(MEDIUM).query("curvature_times_R < -0.9 and frequency_Hz > 4.8")
    assert len(fast) == 2
    mean, generic = "mean table of five media, times zeta", "generic M0 times zeta"
    table, belly, mean_error, generic_error = (
        summary(compared(paper_robot(), ingredients(MEDIUM)[name], fast))[2]
        for name in ("measured table", BELLY, mean, generic)
    )
    assert abs(table) < 20
    assert min(belly, generic_error) > 40
    # without the nine terms, the mean of the media does well
    assert mean_error == pytest.approx(table, abs=15)
