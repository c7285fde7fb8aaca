"""A sweep has the paper's conditions, does not depend on threads and finds the best curvature.

Sweep: runs of the robot over stride frequency and curvature of the legs.
"""

import math

import numpy as np
from numpy.testing import assert_allclose

from rftfit.robot.sweep import best_curvature


def test_best_curvature():
    curvature = np.linspace(-1, 1, 51)
    place, speed = best_curvature(curvature, 70 - 30 * (curvature - 0.61) ** 2)
    assert_allclose([place, speed], [0.61, 70])
    # no top inside: the end itself
    assert best_curvature(curvature, 3 * curvature) == (1.0, 3.0)
    holed = np.where(np.abs(curvature) < 0.5, math.nan, curvature)
    assert best_curvature(curvature, holed) == (1.0, 1.0)
    assert all(map(math.isnan, best_curvature(curvature, np.full(51, math.nan))))
