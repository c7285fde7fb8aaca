"""All strokes in the motion of a machine or an arm are found, or refused with the true reason.

Stroke: the part of a motion in which the plate moves through the sand.
"""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pushes import REFUSED, RIGHT, WRONG, Pushes, any_pushes, row
from seeds import seeds

from rftfit.campaign.config import Arm
from rftfit.measure.flags import Refused, remark
from rftfit.measure.strokes import IntruderPath, find_stroke

MOTIONS = seeds(200, 12)
"""Motions of each noise."""


@pytest.mark.parametrize("rate_Hz", [10, 200])
@pytest.mark.parametrize("gamma_deg", [90.0, 40.0, 0.0])
@pytest.mark.parametrize("begins", ["air", "contact", "below"])
def test_a_push_that_comes_straight_back(rate_Hz, gamma_deg, begins):
    pushes = Pushes(gamma_deg, (5.0,), begins, rate_Hz=rate_Hz)
    assert {verdict for verdict, _ in pushes.judge()} == {RIGHT}
    assert len(pushes.strokes()) == 1


@pytest.mark.statistics
@pytest.mark.parametrize(("noise_cm", "lone"), [(None, 0), (0.0, 3), (0.02, 3)])
def test_any_motion_gives_its_strokes_or_the_true_reason(noise_cm, lone):
    logs = [any_pushes(seed, noise_cm, lone) for seed in range(MOTIONS)]
    counts = Counter(verdict for pushes in logs for verdict, _ in pushes.judge())
    assert counts[WRONG] == 0
    assert counts[REFUSED] <= 0.03 * counts[RIGHT]


def test_a_noise_that_hides_strokes_is_the_reason():
    """Ten readings a second are too few to average 0.5 mm of noise away; of a hundred a few are enough."""
    pushes = Pushes(lengths_cm=(4.0,), rate_Hz=10, noise_cm=(0.05, 0.0))
    refused = refusal(pushes.motion(), row(90), pushes.arm)
    assert refused.code == "noisy-position"
    assert refused.values["noise_mm"] == pytest.approx(0.5, abs=0.1)
    often = replace(pushes, rate_Hz=100)
    assert {verdict for verdict, _ in often.judge()} == {RIGHT}


def refusal(motion, run, arm):
    with pytest.raises(Refused) as caught:
        find_stroke(motion, motion.spans(arm), run, arm)
    return caught.value.remark


def several(count, lengths, unit="cm"):
    return remark("several-strokes", count=count, lengths=lengths, unit=unit, cure="")


def legs(*ends_deg):
    """Turns of a leg at 0.2 rad/s, a second of rest between them."""
    way = np.radians(np.repeat(ends_deg, 2))
    times = np.cumsum([0, *(1 if a == b else abs(a - b) / 0.2 for a, b in pairwise(way))])
    time = np.arange(0, times[-1], 0.02)
    return IntruderPath(time, 0 * time, 0 * time, np.interp(time, times, way))


SEVERAL = [
    (Pushes(lengths_cm=(6.0, 6.0, 6.0)).motion(), row(90), several(3, "4.0")),
    (Pushes(lengths_cm=(3.0, 6.0)).motion(), row(90), several(2, "1.0, 4.0")),
    (Pushes(lengths_cm=(6.0, 6.0)).motion(), row(90, way="extraction"), several(2, "4.0")),
    (Pushes(0.0, (3.0, 3.0)).motion(), row(0, depth_cm=3.0), several(2, "3.0")),
    (legs(-100, 100, -100, 100), replace(row(90), kind="leg", direction="rotation"), several(2, "199.9", "deg")),
]  # fmt: skip


@pytest.mark.parametrize(("motion", "run", "reason"), SEVERAL)
def test_one_of_several_strokes_is_never_taken_in_silence(motion, run, reason):
    arm = Arm()
    assert refusal(motion, run, arm) == reason
    ends = [
        find_stroke(motion, motion.spans(arm), replace(run, stroke=number), arm)
        for number in (1, 2)
    ]
    assert ends[0][1] <= ends[1][0]


def test_a_push_at_a_speed_that_varies_is_refused_with_the_drive_that_reads_it():
    time = np.arange(0, 40, 0.02)
    # each second the hand rests for 0.6 s
    moving_s = np.clip(np.floor(time - 2) + np.clip((time - 2) % 1 / 0.4, 0, 1), 0, 12)
    z = 2.0 - 0.6 * moving_s
    motion = IntruderPath(time, 0 * z, z, 0 * z)
    refused = refusal(motion, row(90), Arm(speed_cm_per_s=1.5))
    assert refused.code == "several-strokes"
    assert "arm.drive: uneven" in refused.values["cure"]
    hand = Arm(drive="uneven")
    find_stroke(motion, motion.spans(hand), row(90), hand)


def test_pushes_by_hand():
    arm = Arm(drive="uneven")
    motion = Pushes(lengths_cm=(6.0, 7.0), dwell_s=0.3).motion()
    assert refusal(motion, row(90), arm) == several(2, "4.0, 5.0")
    first, second = (find_stroke(motion, motion.spans(arm), row(90, k), arm) for k in (1, 2))
    np.testing.assert_allclose([*first, *second], [3.0, 7.0, 15.6, 20.6], atol=0.03)


@pytest.mark.parametrize(
    ("from_cm", "to_cm", "way", "ends"),
    [
        # through the surface, 2.1 cm below the begin or 3.9 cm above it
        (2.1, -4.0, "intrusion", (3.1, 7.1)),
        (-3.9, 2.0, "extraction", (1.0, 4.9)),
        # within 3 mm of the surface: where the arm rests
        (0.2, -4.0, "intrusion", (1.0, 5.2)),
        (-4.0, 0.2, "extraction", (1.0, 5.2)),
        # below it
        (-1.0, -4.0, "intrusion", (1.0, 4.0)),
    ],
)
def test_a_stroke_begins_or_ends_at_the_surface(from_cm, to_cm, way, ends):
    """At 1 cm/s after a rest of 1 s, in four readings a second: the surface lies between two of them."""
    time = np.arange(0, 10, 0.25)
    z = np.interp(time, [1, 1 + abs(to_cm - from_cm)], [from_cm, to_cm])
    motion, arm = IntruderPath(time, 0 * z, z, 0 * z), Arm(speed_cm_per_s=1.0, position_unit="cm")
    stroke = np.array(find_stroke(motion, motion.spans(arm), row(90, way=way), arm))
    at_surface = np.array([from_cm > 0.3, to_cm > 0.3])
    np.testing.assert_allclose(stroke[at_surface], np.array(ends)[at_surface], atol=1e-9)
    np.testing.assert_allclose(stroke, ends, atol=0.13)


@pytest.mark.parametrize("x_cm", [0.0, 40.0])
@pytest.mark.parametrize("is_down_first", [True, False])
def test_a_path_with_a_corner_and_no_pause_has_a_stroke_up_to_it_or_from_it_on(is_down_first, x_cm):
    """6 cm down and 20 cm aside in the sand, in either order; where the frame has its zero does not matter."""
    down_s, aside_s = ([1, 7], [7, 27]) if is_down_first else ([21, 27], [1, 21])
    time = np.arange(0, 28, 0.02)
    x = x_cm + np.interp(time, aside_s, [0, 20])
    z = np.interp(time, down_s, [-1.0, -7.0])
    motion, arm = IntruderPath(time, x, z, 0 * z), Arm(speed_cm_per_s=1.0, position_unit="cm")
    stroke = find_stroke(motion, motion.spans(arm), row(90), arm)
    np.testing.assert_allclose(stroke, down_s, atol=0.1)


def test_two_directions_in_one_log():
    down, slanted = Pushes(lengths_cm=(5.0,)).motion(), Pushes(45.0, (6.0,)).motion()
    parts = zip(vars(down).values(), vars(slanted).values(), strict=True)
    time, x, z, angle = (np.concatenate(columns) for columns in parts)
    time[down.time.size :] += down.time[-1] + 1
    both, arm = IntruderPath(time, x, z, angle), Arm()
    ends = [find_stroke(both, both.spans(arm), row(gamma, 1), arm) for gamma in (90, 45)]
    np.testing.assert_allclose(ends, [[3.0, 6.0], [16.8, 20.0]], atol=0.1)


@pytest.mark.parametrize(("depth_cm", "lowest"), [(0.23, "-0.23"), (0.2996, "-0.2996")])
def test_the_rule_for_the_surface_is_told(depth_cm, lowest):
    pushes = Pushes(lengths_cm=(depth_cm,), begins="contact", rate_Hz=1000)
    motion = pushes.motion()
    motion.z[motion.z.argmin()] = -depth_cm
    refused = refusal(motion, row(90), pushes.arm)
    assert (refused.code, refused.values["least"]) == ("surface-not-reached", -0.3)
    # as many digits as tell the two apart
    assert f" {lowest} cm" in str(refused)


def test_an_arm_that_stands_still_below_the_surface_is_refused():
    time = np.arange(0, 20, 0.02)
    still = IntruderPath(time, 0 * time, 0 * time - 3.0, 0 * time)
    assert refusal(still, row(90), Arm(speed_cm_per_s=1.0)).code == "too-slow"
