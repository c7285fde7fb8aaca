"""The zero of the transducer and its error follow from the rests in air, if a log has any.

Zero: what the transducer reads without load.
"""

import math

import numpy as np
import pytest

from rftfit.measure.flags import Refused
from rftfit.measure.lab_frame import find_zero

TIME = np.arange(2000) / 100


def stretches(*pairs):
    in_stretch = np.zeros(TIME.size, dtype=bool)
    for start, end in pairs:
        in_stretch |= (start <= TIME) & (end > TIME)
    return in_stretch


FORCE = np.stack([np.full(TIME.size, 1.25), np.full(TIME.size, -0.5)])
NOISE = np.random.default_rng(0).normal(0, 0.05, FORCE.shape)


@pytest.mark.parametrize("ends", [((0, 0.9), (1.1, 2)), ((18.2, 19.0), (19.1, 20))])
def test_a_rest_cut_in_two_is_no_look_at_the_drift(ends):
    zero = find_zero(TIME, FORCE + NOISE, stretches(*ends), 10.0, 0.6)
    assert math.isnan(zero.drift_N)
    assert (zero.variance > (0.01 * 8) ** 2 / 3).all()


@pytest.mark.parametrize(
    "rests",
    [
        [],
        [(0, 0.49)],
        # only in snatches, or an arm that twitches all the time
        [(k / 10, k / 10 + 0.05) for k in range(20)],
        [(k * 0.41, k * 0.41 + 0.4) for k in range(4)],
    ],
)
def test_no_rest(rests):
    with pytest.raises(Refused) as caught:
        find_zero(TIME, FORCE, stretches(*rests), 10.0, 0.0)
    assert caught.value.remark.code == "no-zero"


@pytest.mark.parametrize(
    ("rate_Hz", "least"), [(1000.0, 50), (100.0, 50), (40.0, 20), (30.0, 15), (10.0, 10)]
)
def test_half_a_second_of_rest_is_enough(rate_Hz, least):
    """50 samples at 100 Hz and faster, and never fewer than 10."""
    time = np.arange(400) / rate_Hz
    force = np.ones((2, 400))
    find_zero(time, force, np.arange(400) < least, float(time[200]), 0.0)
    with pytest.raises(Refused):
        find_zero(time, force, np.arange(400) < least - 1, float(time[200]), 0.0)
    with pytest.raises(Refused):
        find_zero(time[:1], force[:, :1], np.ones(1, dtype=bool), 10.0, 0.0)


def test_rests_too_short_to_count_are_left_out():
    # 0.3 s at the end is no second look: the zero is that of the start
    force = FORCE.copy()
    force[:, TIME > 19] += 5.0
    zero = find_zero(TIME, force, stretches((0, 2), (19.7, 20)), 10.0, 0.0)
    assert math.isnan(zero.drift_N)
    np.testing.assert_allclose(zero.force, FORCE[:, :1])


def test_one_look_at_either_end_knows_the_drift_until_the_stroke():
    for rest, middle in (((0, 2), 0.995), ((18, 20), 18.995)):
        zero = find_zero(TIME, FORCE, stretches(rest), 12.0, 0.6)
        np.testing.assert_allclose(zero.variance, (0.01 * (12 - middle)) ** 2 / 3, rtol=1e-9)


def test_of_three_rests_the_outer_two_count():
    rests = ((0, 1), (1.2, 2), (18, 20))
    noise = np.random.default_rng(1).normal(0, 1, FORCE.shape)
    for noisier in (TIME < 1.1, TIME > 10):
        scaled = FORCE + noise * np.where(noisier, 0.2, 0.02)
        outer = find_zero(TIME, scaled, stretches(rests[0], rests[2]), 10.0, 0.0)
        all_three = find_zero(TIME, scaled, stretches(*rests), 10.0, 0.0)
        np.testing.assert_array_equal(all_three.force, outer.force)
        np.testing.assert_array_equal(all_three.variance, outer.variance)
