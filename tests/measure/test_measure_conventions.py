"""Signs and angles agree with vector calculation over the whole plane of directions."""

import math

import numpy as np
import pytest

from rftfit import conventions as c

BETA, GAMMA = np.meshgrid(np.radians(np.arange(-90, 91, 7.5)), np.radians(np.arange(-180, 181, 5)))
"""Directions over the whole plane, rad."""


def same_angle(angle, expected, period):
    off = np.mod(angle - expected + period / 2, period) - period / 2
    np.testing.assert_allclose(off, 0, atol=1e-12)


def test_tangent_and_direction_by_hand():
    half = math.sqrt(0.5)
    np.testing.assert_allclose(c.tangent(math.radians(45)), (half, -half))
    np.testing.assert_allclose(c.direction(math.radians(90)), (0, -1), atol=1e-15)
    np.testing.assert_allclose(c.direction(math.radians(-90)), (0, 1), atol=1e-15)
    np.testing.assert_allclose(c.direction(0), (-1, 0), atol=1e-15)
    np.testing.assert_allclose(c.direction(math.radians(45)), (-half, -half))
    np.testing.assert_allclose(c.direction(math.radians(135)), (half, -half))


def test_intrusion_angle_undoes_direction():
    same_angle(c.intrusion_angle(*c.direction(GAMMA)), GAMMA, 2 * np.pi)
    scaled = [3.7 * component for component in c.direction(GAMMA)]
    same_angle(c.intrusion_angle(*scaled), GAMMA, 2 * np.pi)


def test_intrusion_angle_at_the_edges():
    assert float(c.intrusion_angle(1.0, 0.0)) == pytest.approx(math.pi)
    assert float(c.intrusion_angle(1.0, -0.0)) == pytest.approx(math.pi)
    assert float(c.intrusion_angle(-1.0, -0.0)) == 0
    assert math.isnan(float(c.intrusion_angle(0.0, 0.0)))


def test_wraps():
    beta, gamma = BETA + 3 * np.pi, GAMMA - 4 * np.pi
    same_angle(c.wrap_beta(beta), BETA, np.pi)
    same_angle(c.wrap_gamma(gamma), GAMMA, 2 * np.pi)
    assert (c.wrap_beta(beta) >= -np.pi / 2).all()
    assert (c.wrap_beta(beta) < np.pi / 2).all()
    assert (c.wrap_gamma(gamma) > -np.pi).all()
    assert (c.wrap_gamma(gamma) <= np.pi).all()
    assert float(c.wrap_beta(np.pi / 2)) == -np.pi / 2
    assert float(c.wrap_gamma(-np.pi)) == np.pi


def test_mirror_is_the_image_in_x():
    beta, gamma = c.mirror(BETA, GAMMA)
    vx, vz = c.direction(GAMMA)
    np.testing.assert_allclose(c.direction(gamma), (-vx, vz), atol=1e-12)
    # a plate is its tangent up to its sign
    tx, tz = c.tangent(BETA)
    mx, mz = c.tangent(beta)
    np.testing.assert_allclose(mx * tz - -tx * mz, 0, atol=1e-12)


@pytest.mark.parametrize("beta_deg", [-90.0, -60, -30, 0, 30, 60, 90])
@pytest.mark.parametrize("gamma_deg", [0.0, 18.43, 45, 71.57, 90])
def test_file_extraction_is_the_mirror_of_the_physical_pull(beta_deg, gamma_deg):
    """The pull goes back along the path; from behind (x into -x) it is the cell's own motion."""
    cell_beta, cell_gamma, sign_x = c.file_extraction(beta_deg, gamma_deg)
    assert (cell_beta, cell_gamma, sign_x) == (-beta_deg, -gamma_deg, -1.0)
    assert math.copysign(1, cell_beta) == 1 or cell_beta < 0
    vx, vz = c.direction(math.radians(gamma_deg))
    pull = (-float(vx), -float(vz))
    seen_from_behind = (-pull[0], pull[1])
    np.testing.assert_allclose(c.direction(math.radians(cell_gamma)), seen_from_behind, atol=1e-12)
    physical = c.intrusion_angle(*pull)
    beta, gamma = c.mirror(math.radians(beta_deg), physical)
    same_angle(beta, np.radians(cell_beta), np.pi)
    same_angle(gamma, np.radians(cell_gamma), 2 * np.pi)
    # gamma - 180 degrees, as the protocol says
    same_angle(physical, np.radians(gamma_deg - 180), 2 * np.pi)


def test_angles_in_single_precision_come_back_in_double():
    angle = np.float32(0.5)
    values = [
        *c.tangent(angle),
        *c.direction(angle),
        c.wrap_beta(angle),
        c.wrap_gamma(angle),
        *c.mirror(angle, angle),
        c.intrusion_angle(angle, 0.1),
        c.intrusion_angle(0.1, angle),
        c.intrusion_angle(angle, angle),
    ]
    assert [value.dtype for value in values] == [np.dtype(float)] * len(values)
    for value, exact in zip(
        values[:6], (np.cos(0.5), -np.sin(0.5), -np.cos(0.5), -np.sin(0.5), 0.5, 0.5), strict=True
    ):
        assert abs(float(value) - exact) < 1e-15
