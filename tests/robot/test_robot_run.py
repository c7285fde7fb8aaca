"""A robot run begins at the surface and is judged steady, tipped or buried with the true reason."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rftfit
from rftfit.robot.config import Robot


def changed(robot, **numerics):
    data = robot.model_dump()
    data["numerics"] |= numerics
    return Robot.model_validate(data)


@pytest.mark.parametrize(
    ("curvature", "phase", "height_cm"),
    # legs of 4.1 cm hang from hips 0.75 cm below the middle, or point ahead, and the belly is 1 cm below it
    [(0.0, 0.0, 4.85), (0.0, 0.25, 1.0), (1.0, 0.0, 4.85), (-1.0, 0.0, 4.85)],
)
@pytest.mark.parametrize("drop_cm", [0.0, 2.0])
def test_it_begins_at_rest_with_its_lowest_point_at_the_surface(
    robot, table, curvature, phase, height_cm, drop_cm
):
    gait: dict[str, Any] = {"phase_turns": phase, "samples_per_stride": 2}
    dropped = changed(robot, drop_cm=drop_cm)
    series = rftfit.simulate(table, 2.0, curvature, dropped, **gait).series
    assert series is not None
    expected = [0, height_cm + drop_cm, 0, 0, 0, 0]
    assert_allclose(series.states[0], expected, atol=0.01)


def test_steady_run(robot, table):
    run = rftfit.simulate(table, 2.0, 1.0)
    assert (run.outcome, run.reason, run.warning) == ("steady", "", "")
    assert run.strides == len(run.stride_speeds_cm_per_s) >= 3
    last = run.stride_speeds_cm_per_s[-run.averaged :]
    assert_allclose(run.speed_cm_per_s, last.mean())
    # the transient is left out, and what is averaged is what goes on for ever
    assert run.stride_speeds_cm_per_s[0] < 0.95 * run.speed_cm_per_s
    longer = changed(robot, settled_share=1e-9, settled_cm_per_s=1e-9)
    speeds = rftfit.simulate(table, 2.0, 1.0, longer).stride_speeds_cm_per_s
    assert len(speeds) > run.strides
    assert_allclose(speeds[-5:], run.speed_cm_per_s, rtol=robot.numerics.settled_share)
    assert run.series is None


def test_standing_still(table):
    run = rftfit.simulate(table, 0.0, 1.0)
    assert run.outcome == "steady"
    assert abs(run.speed_cm_per_s) < 0.2
    assert run.warning == ""


@pytest.mark.parametrize(("frequency", "warned"), [(3.8, False), (3.95, True), (-5.0, True)])
def test_fast_legs_are_warned_about(nine, frequency, warned):
    # 2 pi f 4.1 cm passes 1 m/s at 3.88 Hz
    run = rftfit.simulate(nine, frequency, 0.0)
    assert bool(run.warning) == warned
    if warned:
        assert f"{2 * math.pi * abs(frequency) * 4.1:.0f} cm/s" in run.warning


def test_tipped_and_buried(robot, nine):
    # a short body high above close hips: the drive turns it over
    data = robot.model_dump()
    for plate in data["body"]["plates"].values():
        for end in ("from_cm", "to_cm"):
            plate[end] = (plate[end][0] / 4, plate[end][1] - 3)
    for hip in data["legs"]["hips"]:
        hip["x_cm"], hip["z_cm"] = hip["x_cm"] / 5, hip["z_cm"] - 3
    unstable, unable = Robot.model_validate(data), rftfit.FourierProfile(nine.coefficients / 100)
    for outcome, body, medium in (("tipped", unstable, nine), ("buried", robot, unable)):
        run = rftfit.simulate(medium, 1.0, 1.0, body)
        assert (run.outcome, *(why.code for why in run.why)) == (outcome, outcome)
        assert (run.averaged, math.isnan(run.speed_cm_per_s)) == (0, True)


def test_series(table):
    run = rftfit.simulate(table, 2.0, phase_turns=1 / 6, samples_per_stride=50)
    s = run.series
    assert s is not None
    assert tuple(s.force_z_N) == ("belly", "front", "rear", "tripod_1", "tripod_2")
    assert len(s.time_s) == len(s.table()) == 50 * run.strides
    assert_allclose(np.diff(s.time_s), 0.5 / 50)
    assert_allclose(s.leg_angle_deg[:3], [60.0, 67.2, 74.4])
    assert (s.time_s[0], s.x_cm[0], s.pitch_deg[0]) == (0, 0, 0)
    # in the mean over steady strides the ground bears the weight and neither speeds up nor turns
    last, weight_N = slice(-50 * run.averaged, None), 150 * 980.665e-5
    lift, thrust = (
        sum(force[last].mean() for force in forces.values())
        for forces in (s.force_z_N, s.force_x_N)
    )
    assert (lift, thrust) == pytest.approx((weight_N, 0), abs=0.03 * weight_N)
    assert s.drive_moment_N_cm[last].mean() > 0
    # the two tripods do the same, half a stride apart
    tripod_1, tripod_2 = s.force_z_N["tripod_1"][-25:], s.force_z_N["tripod_2"][-50:-25]
    assert_allclose(tripod_1, tripod_2, atol=0.05 * tripod_1.max())
    # samples change nothing but the number of steps to a stride
    bare = rftfit.simulate(table, 2.0, phase_turns=1 / 6)
    assert_allclose(bare.speed_cm_per_s, run.speed_cm_per_s, rtol=1e-9)


@pytest.mark.parametrize("condition", [(2.0, 1.0), (4.0, 0.0)])
def test_speed_converges_with_the_step(robot, table, condition):
    best = rftfit.simulate(table, *condition, changed(robot, method="rk4", step_s=5e-5))
    for method, step_s, most in (
        ("semi_implicit_euler", 1e-4, 0.005),
        ("semi_implicit_euler", 4e-4, 0.02),
        ("rk4", 1e-4, 0.02),
        ("rk4", 4e-4, 0.02),
    ):
        run = rftfit.simulate(table, *condition, changed(robot, method=method, step_s=step_s))
        assert run.outcome == "steady"
        assert run.speed_cm_per_s == pytest.approx(best.speed_cm_per_s, rel=most)
