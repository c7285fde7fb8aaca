"""The free surface is found from the force without bias, and never where there is none."""

import numpy as np
import pytest
from pushes import make_push

from rftfit.measure.flags import Refused
from rftfit.measure.surface import find_surface


def pushed(seed, **settings):
    """Depth and force of a push, and its true surface."""
    push = make_push(seed, **settings)
    return np.interp(push.force_time, push.motion_time, push.depth), push.force, push.surface_cm


@pytest.mark.parametrize("bend", [0.0, 8.0, -2.0])
@pytest.mark.parametrize("stiffness", [8.0, 90.0])
def test_bias_and_coverage(stiffness, bend):
    errors, covered = [], 0
    for seed in range(20):
        depth, force, truth = pushed(seed, stiffness=stiffness, bend=bend)
        surface = find_surface(depth, force, 1.5, 0.05)
        errors.append(surface.depth_cm - truth)
        lo, hi = surface.interval()
        covered += lo <= truth <= hi
    assert abs(np.mean(errors)) < 0.01  # a tenth of a millimetre
    assert np.std(errors) < 0.05
    # of 20 intervals at 95 %: fewer than 14 have a probability below one in ten thousand
    assert covered >= 14


def test_a_force_in_air_does_not_matter_and_the_clocks_error_does():
    depth, force, _ = pushed(1)
    surface = find_surface(depth, force, 1.5, 0.05)
    shifted = find_surface(depth, force + 40, 1.5, 0.05, 0.03)
    assert shifted.depth_cm == pytest.approx(surface.depth_cm, abs=1e-6)
    assert shifted.air_N - surface.air_N == pytest.approx(40, abs=1e-6)
    assert surface.growth_N_per_cm == pytest.approx(25, rel=0.1)
    assert shifted.se_cm == pytest.approx(np.hypot(surface.se_cm, 0.03))


def test_no_surface_in_air():
    for seed in range(40):
        random = np.random.default_rng(seed)
        depth = np.linspace(0, 7, 2000)
        # correlated noise, and a zero that drifts as much as a transducer's may
        noise = np.convolve(random.normal(0, 0.1, 2019), np.ones(20) / 20**0.5, "valid")
        drift = np.cumsum(random.normal(0, 0.001, 2000))
        with pytest.raises(Refused):
            find_surface(depth, noise + drift, 1.5, 0.05)


def test_a_thick_plate_enters_gradually():
    # half a plate's thickness above and below the surface the force is less than that of its depth
    depth, _, surface = pushed(11, stiffness=30.0)
    under = depth - surface
    wet = np.clip((under + 0.4) / 0.8, 0, 1)
    force = 30 * np.where(under >= 0.4, under, 0.4 * wet**2)
    force += np.random.default_rng(2).normal(0, 0.1, force.size)
    naive = find_surface(depth, force, 1.5, 0.1)
    passed_over = find_surface(depth, force, 1.5, 0.1, toe_cm=0.4)
    assert abs(naive.depth_cm - surface) > 0.08
    assert abs(passed_over.depth_cm - surface) < 0.03
