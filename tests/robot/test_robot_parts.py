"""A robot's limits and its steady state have the values calculated by hand."""

import math

import numpy as np
import pytest

from rftfit.robot.body import assemble
from rftfit.robot.config import Numerics
from rftfit.robot.run import irregular, settled, tipped_or_buried


@pytest.mark.parametrize(
    ("height", "pitch_deg", "outcome", "code"),
    [
        (7.0, 90.0, None, ""),
        (7.0, -90.0, None, ""),
        (7.0, 90.5, "tipped", "tipped"),
        (7.0, -90.5, "tipped", "tipped"),
        (-1.999, 0.0, None, ""),
        (-2.001, 0.0, "buried", "buried"),
        # 2 cm and 6.5 cm from the middle to the upper end of the front: 4.982 cm
        (-4.98, 30.0, None, ""),
        (-4.984, 30.0, "buried", "buried"),
        (math.nan, 0.0, "not steady", "force-unknown"),
    ],
)
def test_fallen_is_past_its_limit_and_names_the_stride(robot, height, pitch_deg, outcome, code):
    ends = np.zeros((4, 6))
    ends[-1, 1:3] = height, math.radians(pitch_deg) * (1 - 1e-12)
    verdict = tipped_or_buried(assemble(robot, 1.0), ends, robot.numerics)
    assert (verdict.outcome if verdict else None) == outcome
    if verdict:
        assert (verdict.why[0].code, verdict.averaged) == (code, 0)
        assert verdict.why[0].values.get("stride", 3) == 3


@pytest.mark.parametrize(
    ("course", "last", "expected"),
    [
        # strides of 0.5 s, two to a stretch of 1 s: 100 cm/s, then 101.0 cm/s is within 1 %
        ([0, 7, 14, 64, 114, 164], 215, True),
        ([0, 7, 14, 64, 114, 164], 215.1, False),
        # the other way round: slower, by a share of the later speed
        ([0, 7, 14, 64, 114, 164], 213.02, True),
        ([0, 7, 14, 64, 114, 164], 212.98, False),
        # at 1 cm/s a share is too strict: 0.5 cm/s is allowed
        ([0, 0, 0, 0.5, 1, 1.5], 2.49, True),
        ([0, 0, 0, 0.5, 1, 1.5], 2.51, False),
        # backward likewise
        ([0, -7, -14, -64, -114, -164], -215, True),
    ],
)
def test_settled_compares_speeds_per_second(course, last, expected):
    numerics = Numerics(settled_share=0.01, settled_cm_per_s=0.5)
    ends = np.zeros((7, 6))
    ends[:, 0] = [*course, last]
    assert settled(ends, 2, 0.5, numerics) == expected
    # the same course in strides of twice the time is half as fast, and so are its differences
    assert settled(ends, 2, 1.0, numerics) == (expected or last == 2.51)


@pytest.mark.parametrize(("column", "limit"), [(1, 0.05), (2, math.radians(1.0))])
@pytest.mark.parametrize("sign", [-1, 1])
def test_settled_looks_at_height_and_pitch_of_both_ends(column, limit, sign):
    ends = np.zeros((7, 6))
    ends[:, 0] = 10.0 * np.arange(7)
    for size, expected in ((0.99, True), (1.01, False)):
        ends[:, column] = 0
        ends[-1, column] = sign * size * limit
        assert settled(ends, 2, 1.0, Numerics()) == expected
    # three stretches are needed, the first for the transient
    ends[:, column] = 0
    assert settled(ends, 2, 1.0, Numerics())
    assert not settled(ends[1:], 2, 1.0, Numerics())
    # where the stretch before began does not matter, nor the transient
    ends[:, column] = 0
    ends[:3, column] = 1.0
    assert settled(ends, 2, 1.0, Numerics())


@pytest.mark.parametrize(
    ("speeds", "averaged", "code"),
    [
        (np.repeat([3.0, 100.0, 104.9], 4), 8, "thirds"),
        (np.repeat([3.0, 100.0, 105.6], 4), 0, "thirds"),
        (np.repeat([3.0, 100.0, 95.3], 4), 8, "thirds"),
        (np.repeat([3.0, 100.0, 95.1], 4), 0, "thirds"),
        (np.repeat([0.0, -100.0, -104.9], 4), 8, "thirds"),
        # an odd rest belongs to the first third
        ([900.0, 900.0, 10.0, 10.0], 2, "thirds"),
        ([0.0, 0.04, 0.0], 2, "thirds"),
        ([0.0, 0.06, 0.0], 0, "thirds"),
        ([1.0, 1.0, 1.0], 2, "thirds"),
        ([1.0, 1.0], 0, "few-strides"),
    ],
)
def test_irregular_compares_the_last_two_thirds(speeds, averaged, code):
    numerics = Numerics(steady_share=0.05, settled_cm_per_s=0.05)
    verdict = irregular(np.array(speeds), numerics)
    assert (verdict.outcome == "steady", verdict.averaged) == (averaged > 0, averaged)
    why = verdict.why[-1]
    assert why.code == code
    if len(speeds) == 12:
        assert dict(why.values) == {"strides": 12, "second": speeds[4], "last": speeds[8]}
