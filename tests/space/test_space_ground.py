"""A measured medium acts on the bodies of any simulator with the forces of `rftfit.predict`.

Also tested: a body at rest is held.
"""

import numpy as np
import pytest

import rftfit
from rftfit.errors import InputError

POPPY = rftfit.TableProfile.published("poppy_LP")


def test_a_resting_body_is_held_and_a_plain_law_holds_nothing():
    """After it was pushed down, the elastic law bears its weight without motion."""
    plate = rftfit.Mesh.cylinder(radius_cm=3, width_cm=1).moved(
        np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), np.zeros(3)
    )
    for delta_mm, is_held in ((0.3, True), (0.0, False)):
        ground = rftfit.Ground(POPPY, [plate], delta_mm=delta_mm)
        for depth in np.linspace(0, 2, 400):
            pushed = ground.step([[0, 0, -depth]], np.eye(3), [[0, 0, -5]], [[0, 0, 0]], 0.001)
        at_rest = ground.step([[0, 0, -2]], np.eye(3), [[0, 0, 0]], [[0, 0, 0]], 0.001)
        assert pushed[0, 2] > 10
        assert (at_rest[0, 2] > 0.5 * pushed[0, 2]) == is_held


def test_refused():
    with pytest.raises(InputError, match="no body"):
        rftfit.Ground(POPPY, [])
    with pytest.raises(InputError, match="allowed"):
        rftfit.Ground(POPPY, [rftfit.Mesh.sphere(1)], law="other")
    ground = rftfit.Ground(POPPY, [rftfit.Mesh.sphere(1)])
    with pytest.raises(InputError, match="too long"):
        ground.step([[0, 0, 1]], np.eye(3), [[0, 0, 0]], [[0, 0, 0]], 0.01)
