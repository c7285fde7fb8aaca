"""3D-RFT in the plane agrees with its law in space, of which `test_space_faces.py` has numbers of others.

3D-RFT: a resistive force theory for bodies in space; it needs one push and a friction.
"""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import rftfit

GRID = np.radians(np.arange(-90, 91, 15)), np.radians(np.arange(-180, 181, 15))


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.4, 5.0])
def test_the_whole_plane_is_that_of_a_plate_in_space(friction):
    """In every direction in which it does not move along itself."""
    profile = rftfit.rft3d_profile(0.69, friction)
    beta, gamma = (angle.ravel() for angle in np.meshgrid(*GRID, indexing="ij"))
    leads = np.abs(np.sin(beta) * np.cos(gamma) + np.cos(beta) * np.sin(gamma)) > 1e-3
    beta, gamma = beta[leads], gamma[leads]
    plate = rftfit.Mesh.extrude(rftfit.polyline([(-0.5, 0), (0.5, 0)], 1.0, 1))
    velocity = np.stack([-np.cos(gamma), 0 * gamma, -np.sin(gamma)], axis=1)
    turned = Rotation.from_euler("y", beta[:, None])
    motion = rftfit.Motion3D(np.tile([0, 0, -5.0], (beta.size, 1)), velocity, [0, 0, 0], turned)
    options: dict[str, Any] = {"law": "3d-rft", "friction": friction, "model_error": 0}
    forces = rftfit.predict(profile, plate, motion, **options)
    alpha = np.array(profile.alpha(beta, gamma))
    assert_allclose(forces[["force_z_N", "force_x_N"]].to_numpy().T / 5, alpha, atol=1e-9)


@pytest.mark.parametrize("leg", ["c_leg", "reversed_c_leg"])
def test_forces_on_legs_are_those_of_the_law_in_space(leg):
    """A table of the law, in steps of one degree and of five, beside the law itself on the faces of the leg's sheet."""
    theta_deg = np.arange(-135, 135, 9) + 0.37
    turned = Rotation.from_rotvec(np.radians(np.multiply.outer(theta_deg, [0, 1, 0])))
    position = np.broadcast_to([0, 0, 2.0], (theta_deg.size, 3))
    in_space = rftfit.Motion3D(position, [0, 0, 0], [0, 0.2, 0], turned)
    sheet = rftfit.Mesh.extrude(rftfit.model_leg(leg))
    for step_deg, most in ((1, 0.015), (5, 0.3)):
        profile = rftfit.rft3d_profile(0.5, 0.4, step_deg)
        options: dict[str, Any] = {"law": "3d-rft", "friction": 0.4, "model_error": 0}
        law = rftfit.predict(profile, sheet, in_space, **options)
        outline, motion = rftfit.model_leg(leg), rftfit.rotation(theta_deg)
        forces = rftfit.predict(profile, outline, motion, model_error=0)
        for name in ("force_z_N", "force_x_N"):
            assert np.abs(forces[name] - law[name]).max() < most * np.abs(law[name]).max()


@pytest.mark.parametrize(
    ("numbers", "message"),
    [((0.0, 0.4), "0"), ((math.nan, 0.4), "nan"), ((0.5, 0.4, 0), "found 0")],
)
def test_refused(numbers, message):
    with pytest.raises(ValueError, match=message):
        rftfit.rft3d_profile(*numbers)
