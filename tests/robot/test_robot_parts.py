"""A robot's elements, its limits and its steady state have the values calculated by hand."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rftfit.measure.flags import codes_of, remark
from rftfit.robot.body import assemble
from rftfit.robot.config import Numerics
from rftfit.robot.run import highest_point, irregular, settled, tipped_or_buried


def test_areas_and_lengths_are_those_of_the_robot(robot):
    parts = assemble(robot, 1.0)
    assert parts.names == ("belly", "front", "rear", "tripod_1", "tripod_2")
    assert (len(parts.group), parts.bodies.shape[1]) == (9, 30)
    belly, front, rear, leg, _ = parts.bodies
    area = 2 * parts.bodies[..., 4].sum(axis=1) * parts.widths_cm
    assert_allclose(area[:3], [13 * 2, 3 * 2, 3 * 2])
    # a half circle over the diameter 2R' = 4.1 cm, 1 cm wide
    assert area[3] == pytest.approx(math.pi * 2.05, rel=1e-3)
    assert 2 * leg[:, 4].sum() == pytest.approx(math.pi * 2.05, rel=1e-3)
    flat = assemble(robot, 0.0).bodies[3]
    assert 2 * flat[:, 4].sum() == pytest.approx(4.1)
    for plate in (belly, front, rear, leg):
        assert_allclose(np.hypot(plate[:, 2], plate[:, 3]), 1)
    assert_allclose(belly[:, 1], -1.0)
    assert_allclose(front[:, 0], 6.5)
    assert_allclose(rear[:, 0], -6.5)
    assert_allclose([front[:, 1].mean(), rear[:, 1].mean()], 0.5, atol=1e-12)


def test_tripods_are_three_hips_half_a_turn_apart(robot):
    parts = assemble(robot, 1.0)
    assert_array_equal(parts.group, [0, 1, 2, 3, 3, 3, 4, 4, 4])
    # half a turn is the mirror image through the hip
    assert_allclose(parts.bodies[4, :, :4], -parts.bodies[3, :, :4], atol=1e-15)
    z = robot.legs.hips[0].z_cm
    assert_allclose(parts.hips[3:6], [[5.5, z, 1], [-5.5, z, 1], [0, z, 1]])
    assert_allclose(parts.hips[6:], [[0, z, 1], [5.5, z, 1], [-5.5, z, 1]])
    assert_array_equal(parts.hips[:3], 0)


def test_a_newton_moves_150_grams_by_its_weight(robot):
    per_newton, per_newton_cm, gravity = assemble(robot, 1.0).inertia
    # 1 N on 0.150 kg is 6.667 m/s^2; 1 N cm on 2080 g cm^2 = 2.08e-4 kg m^2 is 48.08 rad/s^2
    assert per_newton == pytest.approx(100 * 1 / 0.150)
    assert per_newton_cm == pytest.approx(0.01 / 2.08e-4)
    assert gravity == pytest.approx(980.665)


@pytest.mark.parametrize("curvature", [-1.0, -0.4, 0.0, 0.5, 1.0])
def test_reach_of_a_leg_is_its_tip(robot, curvature):
    # the tip is 2R' = 4.1 cm away; a curved leg's last element counts with its length
    parts, longest = assemble(robot, curvature), math.pi * 2.05 / 30
    assert 4.1 - 1e-9 <= parts.reach_cm <= 4.1 + (longest if curvature else 1e-9)
    # a body without legs reaches nowhere
    assert dataclasses.replace(parts, hips=parts.hips * [1, 1, 0]).reach_cm == 0


@pytest.mark.parametrize(
    ("pitch_deg", "highest"),
    [
        (0, 2),
        # a quarter turn brings one end of the body, 6.5 cm from its middle, to the top
        (90, 6.5),
        (-90, 6.5),
        (30, 2 * math.cos(math.pi / 6) + 6.5 * math.sin(math.pi / 6)),
        # leaning over backward, the lower end of the rear plate comes out on top
        (135, (1 + 6.5) * math.sqrt(0.5)),
        (180, 1),
    ],
)
def test_highest_point_turns_with_the_body(robot, pitch_deg, highest):
    state = np.array([7.0, 1.0, math.radians(pitch_deg), 0.0, 0.0, 0.0])
    assert highest_point(assemble(robot, 1.0), state) == pytest.approx(1 + highest)


@pytest.mark.parametrize(
    ("height", "pitch_deg", "outcome", "code"),
    [
        (7.0, 90.0, None, ""),
        (7.0, -90.0, None, ""),
        (7.0, 90.5, "tipped", "tipped"),
        (7.0, -90.5, "tipped", "tipped"),
        (-1.999, 0.0, None, ""),
        (-2.001, 0.0, "buried", "buried"),
        (math.nan, 0.0, "not steady", "force-unknown"),
    ],
)
def test_fallen_is_past_its_limit_and_names_the_stride(robot, height, pitch_deg, outcome, code):
    ends = np.zeros((4, 6))
    ends[-1, 1:3] = height, math.radians(pitch_deg) * (1 - 1e-12)
    verdict = tipped_or_buried(assemble(robot, 1.0), ends, robot.numerics)
    assert (verdict.outcome if verdict else None) == outcome
    if verdict:
        assert (codes_of(verdict.why), verdict.averaged) == (code, 0)
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
    assert code in codes_of(verdict.why)
    if len(speeds) == 12:
        second, last = speeds[[4, 8]]
        assert verdict.why[-1] == remark("thirds", strides=12, second=second, last=last)
