"""The bias that a start-up leaves in the fit window equals its exact algebraic value.

Start-up: force that dies away after the plate begins to move.
"""

import numpy as np
import pytest

from rftfit.measure.slopes import startup_bias

SKIP = 3.0
"""Length at the start of the path that the program leaves out, cm."""
STEP = 0.125  # exact in binary: 8 samples in each third of the skipped length
PATH: np.ndarray = np.linspace(0, 64 * STEP, 65)


def steps(second, last, steady=7.0):
    """Stress that is constant in each part; the first third, after a pause, is wild."""
    stress = np.full((1, PATH.size), steady)
    stress[0, PATH < SKIP] += last
    stress[0, PATH < 2.0] += second - last
    stress[0, PATH < 1.0] = 1000.0
    return stress


def left(stress):
    return float(startup_bias(PATH, stress, PATH >= SKIP, SKIP)[0])


@pytest.mark.parametrize(
    ("second", "last", "by_hand"),
    [
        (
            4.0,
            1.0,
            1.0 / 3 / 5,
        ),  # q = 1/4: 1 q / (1 - q) over a third of 1 cm, of the 5 cm averaged
        (-4.0, -1.0, -1.0 / 3 / 5),
        (2.0, 1.0, 1.0 / 5),  # q = 1/2, the slowest that is believed
        (1.0, 0.9, 0.9 / 5),
        (1.0, -0.5, 0.0),  # noise: a start-up does not change its sign
        (0.0, 1.0, 0.0),
    ],
)
def test_by_hand(second, last, by_hand):
    assert left(steps(second, last)) == pytest.approx(by_hand, abs=1e-12)


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


def test_seven_samples_tell_nothing():
    whole = steps(4.0, 1.0)
    assert left(whole) > 0
    for place in (1.0, 2.0, 2.875):  # any of the 8 samples in either third
        short = whole.copy()
        short[0, place == PATH] = np.nan
        assert left(short) == 0
    first = whole.copy()
    first[0, PATH < 1.0] = np.nan
    assert left(first) == left(whole)
    first_seven = np.flatnonzero(PATH >= SKIP)[:7]
    steady = np.isin(np.arange(PATH.size), first_seven)
    assert startup_bias(PATH, whole, steady, SKIP)[0] == 0
    # nor does a stroke of which nothing is skipped
    assert startup_bias(PATH, whole, PATH >= SKIP, 0.0)[0] == 0


def test_a_sample_without_one_component_is_not_used():
    both = np.concatenate([steps(4.0, 1.0), steps(2.0, 1.0)])
    spike = both.copy()
    spike[0, PATH == 2.5] = 50.0
    spike[1, PATH == 2.5] = np.nan
    assert (startup_bias(PATH, spike, PATH >= SKIP, SKIP) == 0).all()
    bias = startup_bias(PATH, both, PATH >= SKIP, SKIP)
    np.testing.assert_allclose(bias, [1 / 15, 1 / 5])
