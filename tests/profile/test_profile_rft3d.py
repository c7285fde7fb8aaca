"""3D-RFT in the plane agrees with its law written by hand; `test_space_faces.py` has numbers of others.

3D-RFT: a resistive force theory for bodies in space; it needs one push and a friction.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rftfit
from rftfit.forces import reference_kernel
from rftfit.model.rft3d import COEFFICIENTS, alpha_3drft

GRID = np.radians(np.arange(-90, 91, 5))[:, None], np.radians(np.arange(-180, 181, 5))


def by_hand(beta, gamma, friction):
    """alpha_z and alpha_x where xi is 1, one number after the other."""
    vx, vz = -math.cos(gamma), -math.sin(gamma)
    nx, nz = math.sin(beta), math.cos(beta)
    lead = nx * vx + nz * vz
    if lead < -1e-9 or (abs(lead) <= 1e-9 and nz > 0):
        nx, nz, lead = -nx, -nz, -lead
    up = nz > 1e-9
    a, b, c = -vz, nz if up else -nz, -lead if up else lead
    f1, f2, f3 = (
        k[0] + k[1] * a + k[2] * b + k[3] * c + k[4] * a * a + k[5] * b * b + k[6] * c * c
        + k[7] * a * b + k[8] * b * c + k[9] * c * a + k[10] * a**3 + k[11] * b**3 + k[12] * c**3
        + k[13] * a * b**2 + k[14] * b * a**2 + k[15] * b * c**2 + k[16] * c * b**2
        + k[17] * c * a**2 + k[18] * a * c**2 + k[19] * a * b * c
        for k in COEFFICIENTS.tolist()
    )  # fmt: skip
    x = f1 * (-nx if up else nx) + f2 * vx
    z = f1 * (-nz if up else nz) + f2 * vz - f3
    push = x * nx + z * nz
    tx, tz = x - push * nx, z - push * nz
    size = math.hypot(tx, tz)
    share = min(1.0, friction * abs(push) / size) if size > 1e-9 else 0.0
    if tx * vx + tz * vz > 1e-9:
        share = -share
    return share * tz - abs(push) * nz, share * tx - abs(push) * nx


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.4, 5.0])
def test_the_whole_plane_against_the_law_written_out(friction):
    xi = 0.69 / 0.87504
    profile = rftfit.rft3d_profile(0.69, friction)
    alpha = np.stack(profile.alpha(*GRID))
    for row, beta in enumerate(GRID[0][:, 0]):
        for column, gamma in enumerate(GRID[1]):
            expected = xi * np.array(by_hand(beta, gamma, friction))
            if abs(math.cos(beta)) + abs(math.cos(gamma)) < 1e-9:
                expected[1] = 0  # upright and moving along itself: either side leads
            assert_allclose(alpha[:, row, column], expected, atol=1e-9)


@pytest.mark.parametrize(("step", "most"), [(1, 0.015), (5, 0.3)])
@pytest.mark.parametrize("leg", ["c_leg", "reversed_c_leg"])
def test_forces_on_legs_are_those_of_the_law(step, most, leg):
    outline, motion = rftfit.model_leg(leg), rftfit.rotation(np.arange(-135, 135) + 0.37)
    elements = reference_kernel.place(outline.body, outline.width_cm, motion.poses)
    load = reference_kernel.submerged(elements, outline.solid)[0]
    forces = rftfit.predict(rftfit.rft3d_profile(0.5, 0.4, step), outline, motion)
    alpha = alpha_3drft(*reference_kernel.angles(elements), 0.4)
    for component, component_alpha in zip("zx", alpha, strict=True):
        force = 0.5 * (load * component_alpha).sum(axis=1)
        off = np.abs(forces[f"force_{component}_N"] - force).max()
        assert off < most * np.abs(force).max()


def test_it_goes_where_a_profile_goes(tmp_path):
    profile = rftfit.rft3d_profile(0.35, 0.4, step_deg=5)
    rftfit.write_profile(tmp_path / "sand.json", profile, name="sand")
    again = rftfit.read_profile(tmp_path / "sand.json")
    assert_allclose(again.alpha(*GRID), profile.alpha(*GRID), atol=1e-6)
    run = rftfit.simulate(profile, 2.0)
    assert run.outcome == "steady"
    assert run.speed_cm_per_s > 10


@pytest.mark.parametrize(
    ("numbers", "message"),
    [((0.0, 0.4), "0"), ((math.nan, 0.4), "nan"), ((0.5, 0.4, 0), "found 0")],
)
def test_refused(numbers, message):
    with pytest.raises(ValueError, match=message):
        rftfit.rft3d_profile(*numbers)
