"""The lift of a level belly alone makes reversed legs too fast in the generic profile."""

import numpy as np
from paper import BETA, GAMMA, by_hand

import rftfit

LEVEL_BELLY = np.flatnonzero((BETA == 0) & (GAMMA == 0))[0]


def error_percent(profile):
    """Mean error of the speed of reversed legs at high frequency."""
    rows = rftfit.published_table("fig_4c").to_numpy(float)
    fast = rows[(rows[:, 0] < -0.9) & (rows[:, 1] > 4.8)]
    assert len(fast) == 2
    speeds = [rftfit.simulate(profile, row[1], row[0]).speed_cm_per_s for row in fast]
    return 100 * np.mean(np.array(speeds) / fast[:, 2] - 1)


def test_the_lift_of_the_level_belly_alone_makes_reversed_legs_too_fast():
    *_, z, x = rftfit.TableProfile.published("poppy_LP").cells
    assert abs(error_percent(rftfit.TableProfile(z, x, BETA, GAMMA))) < 20
    nine = rftfit.FourierProfile(by_hand(BETA, GAMMA, z, x))
    lift = z.copy()
    lift[LEVEL_BELLY] = nine.alpha(0.0, 0.0)[0]
    np.testing.assert_allclose([z[LEVEL_BELLY], lift[LEVEL_BELLY]], [-0.007, 0.111], atol=5e-4)
    assert error_percent(rftfit.TableProfile(lift, x, BETA, GAMMA)) > 40
    assert error_percent(nine) > 40
