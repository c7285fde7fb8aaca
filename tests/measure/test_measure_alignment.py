"""Clocks from the force alone: the truth comes back inside its interval, or the answer is no."""

from __future__ import annotations

import numpy as np
import pytest
from pushes import make_push

from rftfit.measure.alignment import (
    LagProfile,
    contact_basis,
    estimate_clocks,
    new_readings,
    smooth_basis,
)
from rftfit.measure.slopes import student_quantile

T95 = float(student_quantile(0.95, 12))


def estimate(push, max_se_s=0.2, max_drift=1e-3):
    return estimate_clocks(
        push.force_time, push.force, push.motion_time, push.depth, max_drift, max_se_s
    )


@pytest.mark.parametrize("hours", [-5, 0, 1, 9])
def test_whole_hours_and_the_rest(hours):
    push = make_push(1, offset_s=3600 * hours + 0.31)
    found = estimate(push)
    assert found.clock.offset_s == pytest.approx(
        push.offset_s, abs=T95 * found.clock.offset_se(0.01)
    )
    assert found.clock.offset_se(0.01) < 0.05
    assert found.clock.whole_hours == hours


def test_clocks_with_unrelated_zeros():
    push = make_push(2, offset_s=-1.6e9 + 700.0)
    found = estimate(push)
    assert found.clock.whole_hours == 0
    assert found.clock.offset_s == pytest.approx(
        push.offset_s, abs=T95 * found.clock.offset_se(0.01)
    )


def test_a_drift_over_a_long_push():
    push = make_push(3, offset_s=0.2, drift=4e-3)
    found = estimate(push, max_drift=1e-2)
    assert found.clock.drift == pytest.approx(4e-3, abs=T95 * found.drift_se)
    assert found.clock.offset_s == pytest.approx(
        push.offset_at(found.clock.reference_s), abs=T95 * found.clock.offset_se(0.01)
    )


@pytest.mark.parametrize(
    "settings",
    [{}, {"bend": 6.0}, {"rate_Hz": 12.3}, {"by_hand": False}],
    ids=["by hand", "bent", "slow transducer", "steady with a pause"],
)
def test_intervals_cover_the_truth(settings):
    random = np.random.default_rng(7)
    misses, wide = 0, []
    for seed in range(16):
        offset = 3600 * int(random.integers(-3, 4)) + float(random.uniform(-0.5, 0.5))
        push = make_push(seed, offset_s=offset, drift=float(random.normal(0, 1e-3)), **settings)
        found = estimate(push)
        truth = push.offset_at(found.clock.reference_s)
        misses += abs(found.clock.offset_s - truth) > T95 * found.clock.offset_se(0.01)
        wide.append(found.clock.offset_se(0.01))
    # 95 % intervals of 16 runs: six misses or more have a probability of one in ten thousand
    assert misses < 6
    assert np.median(wide) < 0.04


def test_readings_that_a_slow_transducer_repeats_count_once():
    push = make_push(4, rate_Hz=12.5)
    held = push.force_time[:, None] + np.arange(8) * 0.01
    slow = estimate_clocks(
        held.ravel(), np.repeat(push.force, 8), push.motion_time, push.depth, 1e-3, 0.2
    )
    assert slow.clock.offset_s == pytest.approx(estimate(push).clock.offset_s, abs=1e-9)
    fresh = new_readings(np.array([[1.0, 1.0, 2.0, 2.0], [0.0, 0.0, 0.0, 1.0]]))
    assert fresh.tolist() == [True, False, True, True]


def test_steady_force_is_refused():
    push = make_push(5)
    steady = np.random.default_rng(0).normal(3.0, 0.05, push.force.size)
    with pytest.raises(ValueError, match="no contact"):
        estimate_clocks(push.force_time, steady, push.motion_time, push.depth, 1e-3, 0.1)


def test_noise_without_motion_is_refused():
    push = make_push(6)
    with pytest.raises(ValueError, match="no motion in depth"):
        estimate_clocks(
            push.force_time, push.force, push.motion_time, np.zeros(push.depth.size), 1e-3, 0.1
        )


def test_a_force_of_another_run_is_refused():
    push = make_push(8)
    time = push.force_time
    waves = 20 * np.abs(np.sin(3 * (time - time[0]))) + 0.1 * (time - time[0])
    with pytest.raises(ValueError, match=r"at no lag|equally well|uncertain"):
        estimate_clocks(time, waves, push.motion_time, push.depth, 1e-3, 0.1)


def test_a_push_at_one_speed_throughout_does_not_decide():
    # from the first to the last sample the arm moves at one speed: every lag is as good
    time = np.arange(0, 20, 0.01)
    depth = 0.4 * time
    force = 25 * np.maximum(depth - 1, 0) + np.random.default_rng(0).normal(0, 0.1, time.size)
    with pytest.raises(ValueError, match=r"uncertain|equally well"):
        estimate_clocks(time[200:1800], force[200:1800], time, depth, 1e-3, 0.05)


def test_an_uncertain_offset_is_refused():
    with pytest.raises(ValueError, match="allowed: 1e-06 s"):
        estimate(make_push(9), max_se_s=1e-6)


def test_too_few_readings_and_logs_apart():
    push = make_push(10)
    with pytest.raises(ValueError, match="30 readings"):
        estimate_clocks(
            push.force_time[:30], push.force[:30], push.motion_time, push.depth, 1e-3, 0.1
        )


def test_rivals_of_a_profile():
    lag = np.arange(6.0)
    assert LagProfile(lag, np.array([0.9, 0.2, 0.9, 0.21, 0.9, 0.9])).rivals() == [3.0]
    assert LagProfile(lag, np.array([0.9, 0.2, 0.21, 0.9, 0.9, 0.9])).rivals() == []


def test_the_smooth_functions():
    depth = np.linspace(-1, 4, 200)
    basis = smooth_basis(depth, 7)
    np.testing.assert_allclose(basis.sum(axis=1), 1.0)
    # a cubic is among them
    cubic = 1 + depth - 0.3 * depth**3
    weights = np.linalg.lstsq(basis, cubic, rcond=None)[0]
    np.testing.assert_allclose(basis @ weights, cubic, atol=1e-9)
    bent = contact_basis(depth, 1.0, 4.0, 5)
    lift = 2 + 3 * np.maximum(depth - 1, 0)
    weights = np.linalg.lstsq(bent, lift, rcond=None)[0]
    np.testing.assert_allclose(bent @ weights, lift, atol=1e-9)
