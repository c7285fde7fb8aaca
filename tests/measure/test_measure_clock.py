"""Two clocks are aligned by the arm's starts and stops with a true error, or are refused."""

import numpy as np
import pytest

from rftfit.campaign.config import Arm
from rftfit.measure.clocks import align, moving_spans
from rftfit.measure.flags import Refused, remark
from rftfit.measure.strokes import IntruderPath

LIMIT = 0.05
"""Largest residual of aligned clocks, s."""


def spans(*pairs):
    """Starts and ends as an array of shape (n, 2)."""
    return np.array(pairs, dtype=float).reshape(-1, 2)


RUN = spans((2.0, 5.1), (7.1, 15.4))
"""Spans of time in which the arm moves, s."""


class Rig:
    """One run seen by a 100 Hz sync line and by a jittered 50 Hz motion log on another clock."""

    def __init__(self, seed, offset, whole_steps):
        random = np.random.default_rng(seed)
        self.offset = offset
        starts, moves, ramp = np.array([2.0, 7.0]), np.array([3.0, 8.0]), 0.05
        if not whole_steps:
            starts, moves = starts + random.uniform(0, 0.1, 2), moves + random.uniform(0, 0.1, 2)
        stops = starts + moves + ramp
        self.force_time = 1000 + random.uniform(0, 0.01) + np.arange(1700) / 100
        t = self.force_time - 1000
        self.line = ((t[:, None] >= starts) & (t[:, None] <= stops)).any(axis=1).astype(float)
        tick = random.uniform(0, 0.02) + np.arange(850) / 50
        tick = tick + random.uniform(-0.004, 0.004, tick.size)
        moved = np.zeros(tick.size)
        for start, length in zip(starts, moves, strict=True):
            after = np.clip(tick - start, 0, length + ramp)
            left = length + ramp - after
            moved += np.where(
                after < ramp,
                after**2 / (2 * ramp),
                np.where(left < ramp, length - left**2 / (2 * ramp), after - ramp / 2),
            )
        z = 1.6 - moved + random.normal(0, 0.0003, tick.size)
        angle = np.radians(30 + random.normal(0, 0.02, tick.size))
        self.motion = IntruderPath(1000 + tick + offset, np.zeros(tick.size), z, angle)

    def fit(self):
        force = moving_spans(self.force_time, self.line)
        return align(force, self.motion.spans(Arm()), LIMIT)


@pytest.mark.parametrize("whole_steps", [True, False])
def test_error_of_the_offset_is_honest(whole_steps):
    """Where the arm moves for whole samples, all edges err alike and their number is no help."""
    rigs = [Rig(seed, 0.3137 * (-1) ** seed, whole_steps) for seed in range(100)]
    fits = [rig.fit() for rig in rigs]
    errors_s = np.array([fit.offset_s - rig.offset for fit, rig in zip(fits, rigs, strict=True)])
    pulls = errors_s / [fit.offset_se(0.01) for fit in fits]
    # the spread of a uniform distribution is never quite reached by a normal's tails
    assert 0.7 < np.sqrt(np.mean(pulls**2)) < 1.15
    if whole_steps:
        return
    assert {(fit.edges, fit.drift, fit.whole_hours) for fit in fits} == {(4, 0.0, 0)}
    assert max(fit.residual_s for fit in fits) < 0.01
    # an edge is known to a step of 10 ms (sync line) or 20 ms (motion): 2 ms for the mean of four
    assert np.abs(errors_s.mean()) < 0.0005
    assert errors_s.std() < 0.002
    assert np.abs(errors_s).max() < 0.005


def test_drift_of_the_clocks_over_a_long_run():
    starts = np.arange(0, 4000, 400.0)
    force = np.stack([starts, starts + 60], axis=1)
    fit = align(force, force * (1 + 5e-5) + 2, LIMIT)
    assert fit.drift == pytest.approx(5e-5, rel=1e-6)
    np.testing.assert_allclose(fit.motion_time(force), force * (1 + 5e-5) + 2, atol=1e-9)
    assert fit.residual_s < 1e-9


def test_both_ends_of_a_ramp_cancel():
    early_late = np.array([0.02, -0.02])
    fit = align(RUN, RUN + early_late + 1, LIMIT)
    assert fit.offset_s == pytest.approx(1)
    assert fit.residual_s < 1e-12


def refusal(force, motion):
    with pytest.raises(Refused) as caught:
        align(force, motion, LIMIT)
    return caught.value.remark


def test_files_of_different_runs_are_refused():
    # differences of the edges; of three stretches the last two fit best
    for motion, edges_s in (
        (spans((2.0, 5.1), (7.1, 14.0)), (0.0, 0.0, 0.0, -1.4)),
        (spans((0.0, 1.0), (3.0, 4.0), (9.0, 16.0)), (1.0, -1.1, 1.9, 0.6)),
    ):
        disagreement = remark("clocks-disagree", seconds=np.std(edges_s), most=LIMIT)
        assert refusal(RUN, motion) == disagreement


def test_two_ways_to_match_are_refused():
    even = spans((0, 1), (2, 3), (4, 5))
    assert refusal(even[:2], even) == refusal(even, even[1:]) == remark("clocks-ambiguous")
    assert align(even, even + 5, LIMIT).offset_s == pytest.approx(5)


def test_nothing_to_match():
    assert refusal(np.empty((0, 2)), RUN) == remark("nothing-to-match", force=0, motion=2)


def test_motion_log_of_two_samples_has_no_stretch():
    two = np.zeros(2)
    assert IntruderPath(np.arange(2.0), two, two, two).spans(Arm()).shape == (0, 2)
