"""Signs and angles agree with vector calculation over the whole plane of directions."""

import math

import numpy as np
import pytest

from rftfit import conventions as c

GAMMA = np.radians(np.arange(-180, 181, 5))
"""Directions over the whole plane, rad."""
HALF = math.sqrt(0.5)


def same_angle(angle, expected, period):
    off = np.mod(angle - expected + period / 2, period) - period / 2
    np.testing.assert_allclose(off, 0, atol=1e-12)


@pytest.mark.parametrize(
    ("gamma_deg", "velocity"),
    [(90, (0, -1)), (-90, (0, 1)), (0, (-1, 0)), (45, (-HALF, -HALF)), (135, (HALF, -HALF))],
)
def test_tangent_and_direction_by_hand(gamma_deg, velocity):
    np.testing.assert_allclose(c.direction(math.radians(gamma_deg)), velocity, atol=1e-15)
    np.testing.assert_allclose(c.tangent(math.radians(45)), (HALF, -HALF))


def test_intrusion_angle_undoes_direction():
    for speed in (1.0, 3.7):
        velocity = [speed * component for component in c.direction(GAMMA)]
        same_angle(c.intrusion_angle(*velocity), GAMMA, 2 * np.pi)
    assert float(c.intrusion_angle(1.0, -0.0)) == pytest.approx(math.pi)
    assert math.isnan(float(c.intrusion_angle(0.0, 0.0)))
    # of an angle in single precision too
    assert c.intrusion_angle(np.float32(0.5), 0.1).dtype == np.dtype(float)


@pytest.mark.parametrize("beta_deg", [-90.0, -60, -30, 0, 30, 60, 90])
@pytest.mark.parametrize("gamma_deg", [0.0, 18.43, 45, 71.57, 90])
def test_file_extraction_is_the_mirror_of_the_physical_pull(beta_deg, gamma_deg):
    """The pull goes back along the path; from behind (x into -x) it is the cell's own motion."""
    cell_beta, cell_gamma, sign_x = c.file_extraction(beta_deg, gamma_deg)
    assert (cell_beta, cell_gamma, sign_x) == (-beta_deg, -gamma_deg, -1.0)
    assert math.copysign(1, cell_beta) == 1 or cell_beta < 0
    vx, vz = c.direction(math.radians(gamma_deg))
    np.testing.assert_allclose(c.direction(math.radians(cell_gamma)), (vx, -vz), atol=1e-12)
    # gamma - 180 degrees, as the protocol says
    same_angle(c.intrusion_angle(-vx, -vz), np.radians(gamma_deg - 180), 2 * np.pi)
