"""Directions that are scattered at random are apart."""

import numpy as np
import pytest

from rftfit.lab.plan import parse_directions


@pytest.mark.parametrize(("count", "apart_deg"), [(40, 6.0), (250, 6.0), (500, 3.0)])
def test_scattered_directions_are_apart(count, apart_deg):
    """No two are taken for one, and straight down is among them."""
    beta, gamma = np.array(parse_directions(f"scattered:{count}", 7)).T
    assert (beta[0], gamma[0]) == (0, 90)
    beta_apart = np.abs((beta - beta[:, None] + 90) % 180 - 90)
    apart = np.maximum(beta_apart, np.abs(gamma - gamma[:, None]))
    assert apart[~np.eye(count, dtype=bool)].min() >= apart_deg
