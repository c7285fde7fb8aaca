"""The bias that a start-up leaves in the fit window equals its exact algebraic value.

Start-up: force that dies away after the plate begins to move.
"""

import numpy as np

from rftfit.measure.slopes import startup_bias


def test_an_exponential_is_found():
    path = np.linspace(0, 40, 400_001)
    decay_cm, steady, size = 0.4, 0.3, 0.2
    stress = steady + size * np.exp(-path / decay_cm) * np.array([[1.0], [-2.0]])
    window = path >= 2.0
    bias = startup_bias(path, stress, window, 2.0)
    # integral of the exponential from 2 cm on, over the 38 cm of the window
    exact = size * decay_cm * np.exp(-2.0 / decay_cm) / 38
    np.testing.assert_allclose(bias, [exact, -2 * exact], rtol=0.01)
    np.testing.assert_allclose(stress[:, window].mean(axis=1) - steady, bias, rtol=0.01)
