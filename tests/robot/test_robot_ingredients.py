"""The lift of a level belly alone makes reversed legs too fast in the generic profile."""

import numpy as np

import rftfit
from rftfit import reference
from rftfit.model.fourier import fit_lsq
from rftfit.reference import BETA_DEG, GAMMA_DEG

NODES = np.meshgrid(np.radians(BETA_DEG), np.radians(GAMMA_DEG), indexing="ij")
LEVEL_BELLY = int(np.flatnonzero(BETA_DEG == 0)[0]), int(np.flatnonzero(GAMMA_DEG == 0)[0])


def error_percent(profile):
    """Mean error of the speed of reversed legs at high frequency."""
    rows = rftfit.published_table("fig_4c").to_numpy(float)
    fast = rows[(rows[:, 0] < -0.9) & (rows[:, 1] > 4.8)]
    assert len(fast) == 2
    speeds = [rftfit.simulate(profile, row[1], row[0]).speed_cm_per_s for row in fast]
    return 100 * np.mean(np.array(speeds) / fast[:, 2] - 1)


def test_the_lift_of_the_level_belly_alone_makes_reversed_legs_too_fast():
    z, x = reference.alpha_grid("poppy_LP")
    assert abs(error_percent(rftfit.TableProfile(z, x))) < 20
    nine = rftfit.FourierProfile(fit_lsq(*(angle.ravel() for angle in (*NODES, z, x))))
    lift = z.copy()
    lift[LEVEL_BELLY] = nine.alpha(0.0, 0.0)[0]
    np.testing.assert_allclose([z[LEVEL_BELLY], lift[LEVEL_BELLY]], [-0.007, 0.111], atol=5e-4)
    assert error_percent(rftfit.TableProfile(lift, x)) > 40
    assert error_percent(nine) > 40
