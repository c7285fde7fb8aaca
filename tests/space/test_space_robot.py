"""The paper's robot, its legs as sheets in space, runs in MuJoCo as it does in the plane."""

import numpy as np
import pytest

import rftfit

pytest.importorskip("mujoco")

from space_robots import speed_of_paper_robot


def test_the_paper_robot_runs_as_in_the_plane_and_each_stride_takes_energy():
    speed, least_J = speed_of_paper_robot(delta_mm=0, tau_s=0, strides=6)
    planar = rftfit.simulate(rftfit.published_medium("poppy_LP"), 2.0).speed_cm_per_s
    np.testing.assert_allclose(speed, planar, rtol=0.002)
    assert least_J > 0.1
