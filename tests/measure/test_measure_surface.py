"""The free surface from the force: without bias, inside its interval, and never where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from pushes import make_push

from rftfit.measure.surface import find_surface


def find(seed, **settings):
    push = make_push(seed, **settings)
    depth = np.interp(push.force_time, push.motion_time, push.depth)
    return find_surface(depth, push.force, 1.5, 0.05), push.surface_cm


@pytest.mark.parametrize("bend", [0.0, 8.0, -2.0])
@pytest.mark.parametrize("stiffness", [8.0, 90.0])
def test_bias_and_coverage(stiffness, bend):
    errors, covered = [], 0
    for seed in range(20):
        found, truth = find(seed, stiffness=stiffness, bend=bend)
        errors.append(found.depth_cm - truth)
        lo, hi = found.interval()
        covered += lo <= truth <= hi
    assert abs(np.mean(errors)) < 0.01  # a tenth of a millimetre
    assert np.std(errors) < 0.05
    # of 20 intervals at 95 %: fewer than 14 have a probability below one in ten thousand
    assert covered >= 14


def test_a_force_that_is_not_zero_in_air_does_not_matter():
    push = make_push(1)
    depth = np.interp(push.force_time, push.motion_time, push.depth)
    one = find_surface(depth, push.force, 1.5, 0.05)
    other = find_surface(depth, push.force + 40, 1.5, 0.05)
    assert other.depth_cm == pytest.approx(one.depth_cm, abs=1e-6)
    assert other.air_N - one.air_N == pytest.approx(40, abs=1e-6)
    assert one.growth_N_per_cm == pytest.approx(25, rel=0.1)


def test_the_clocks_error_is_part_of_it():
    push = make_push(2)
    depth = np.interp(push.force_time, push.motion_time, push.depth)
    alone = find_surface(depth, push.force, 1.5, 0.05)
    more = find_surface(depth, push.force, 1.5, 0.05, 0.03)
    assert more.se_cm == pytest.approx(np.hypot(alone.se_cm, 0.03))


def test_no_surface_in_air():
    for seed in range(40):
        random = np.random.default_rng(seed)
        depth = np.linspace(0, 7, 2000)
        # correlated noise, and a zero that drifts as much as a transducer's may
        noise = np.convolve(random.normal(0, 0.1, 2019), np.ones(20) / 20**0.5, "valid")
        drift = np.cumsum(random.normal(0, 0.001, 2000))
        with pytest.raises(ValueError, match="not found"):
            find_surface(depth, noise + drift, 1.5, 0.05)


def test_a_log_that_begins_in_contact():
    depth = np.linspace(0, 4, 800)
    with pytest.raises(ValueError, match="begin in air"):
        find_surface(depth, 30 * depth + 10, 1.5, 0.05)


def test_a_log_that_ends_at_the_surface():
    depth = np.linspace(0, 3.02, 300)
    force = 200 * np.maximum(depth - 3.0, 0)
    with pytest.raises(ValueError, match="not found"):
        find_surface(depth, force, 1.5, 0.05)


def test_too_few_readings():
    with pytest.raises(ValueError, match="10 readings"):
        find_surface(np.arange(10.0), np.arange(10.0), 1.5, 0.05)


def test_a_thick_plate_enters_gradually():
    # half a plate's thickness above and below the surface the force is less than that of its depth
    push = make_push(11, stiffness=30.0)
    depth = np.interp(push.force_time, push.motion_time, push.depth)
    under = depth - push.surface_cm
    wet = np.clip((under + 0.4) / 0.8, 0, 1)
    force = 30 * np.where(under >= 0.4, under, 0.4 * wet**2)
    force += np.random.default_rng(2).normal(0, 0.1, force.size)
    naive = find_surface(depth, force, 1.5, 0.1)
    passed_over = find_surface(depth, force, 1.5, 0.1, toe_cm=0.4)
    assert abs(naive.depth_cm - push.surface_cm) > 0.08
    assert abs(passed_over.depth_cm - push.surface_cm) < 0.03


def test_a_force_of_the_wrong_sign_is_told():
    push = make_push(1)
    depth = np.interp(push.force_time, push.motion_time, push.depth)
    with pytest.raises(ValueError, match=r"no ground, or the sign of z .* or of the force"):
        find_surface(depth, -push.force, 1.5, 0.05)
