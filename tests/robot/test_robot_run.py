"""A robot run begins at the surface and is judged steady, tipped or buried with the true reason."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rftfit import FourierProfile
from rftfit.measure.flags import codes_of
from rftfit.robot.body import assemble
from rftfit.robot.config import Numerics, Robot
from rftfit.robot.run import simulate, start_state


def changed(robot, **numerics):
    settings = robot.numerics.model_dump() | numerics
    return robot.model_copy(update={"numerics": Numerics.model_validate(settings)})


@pytest.mark.parametrize("drop", [0.0, 2.0])
@pytest.mark.parametrize("phase", [0.0, 0.21, 0.5])
@pytest.mark.parametrize("curvature", [1.0, 0.0, -0.4])
def test_it_begins_touching_the_surface(robot, curvature, phase, drop):
    settings = changed(robot, drop_cm=drop)
    parts = assemble(settings, curvature)
    state = start_state(settings, parts, phase)
    assert (state[[0, 2, 3, 4, 5]] == 0).all()
    groups = parts.place(state, 2 * math.pi * phase, 0.0)
    every = np.concatenate([group.reshape(-1, 8) for group in groups])
    lowest = (every[:, 1] - every[:, 4] * np.abs(every[:, 3])).min()
    assert_allclose(lowest, drop, atol=1e-12)


def test_a_run_that_starts_as_a_settled_one_ends_has_no_transient(robot, table):
    from_rest = simulate(robot, table, 2.0, 1.0)
    goes_on = simulate(robot, table, 2.0, 1.0, start=from_rest.end_state)
    assert 3 * goes_on.strides == 2 * from_rest.strides
    assert goes_on.speed_cm_per_s == pytest.approx(from_rest.speed_cm_per_s, rel=5e-3)
    assert goes_on.stride_speeds_cm_per_s[0] > 1.2 * from_rest.stride_speeds_cm_per_s[0]


def test_steady_run(robot, table):
    run = simulate(robot, table, 2.0, 1.0)
    assert (run.outcome, run.reason, run.warning) == ("steady", "", "")
    assert run.strides == len(run.stride_speeds_cm_per_s) >= 3
    last = run.stride_speeds_cm_per_s[-run.averaged :]
    assert_allclose(run.speed_cm_per_s, last.mean())
    # the transient is left out, and what is averaged is what goes on for ever
    assert run.stride_speeds_cm_per_s[0] < 0.95 * run.speed_cm_per_s
    longer = simulate(robot, table, 2.0, 1.0, strides=run.strides + 10)
    assert_allclose(
        longer.stride_speeds_cm_per_s[-5:], run.speed_cm_per_s, rtol=robot.numerics.settled_share
    )
    assert run.series is None


def test_standing_still(robot, table):
    run = simulate(robot, table, 0.0, 1.0)
    assert run.outcome == "steady"
    assert abs(run.speed_cm_per_s) < 0.2
    assert run.warning == ""


@pytest.mark.parametrize(("frequency", "warned"), [(3.8, False), (3.95, True), (-5.0, True)])
def test_fast_legs_are_warned_about(robot, nine, frequency, warned):
    # 2 pi f 4.1 cm passes 1 m/s at 3.88 Hz
    run = simulate(robot, nine, frequency, 0.0, strides=1)
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
    unstable, unable = Robot.model_validate(data), FourierProfile(nine.coefficients / 100)
    for outcome, body, medium in (("tipped", unstable, nine), ("buried", robot, unable)):
        run = simulate(body, medium, 1.0, 1.0)
        assert (run.outcome, codes_of(run.why), run.averaged) == (outcome, outcome, 0)
        assert math.isnan(run.speed_cm_per_s)


def test_series(robot, table):
    run = simulate(robot, table, 2.0, 1.0, 1 / 6, samples_per_stride=50)
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
    bare = simulate(robot, table, 2.0, 1.0, 1 / 6)
    assert_allclose(bare.speed_cm_per_s, run.speed_cm_per_s, rtol=1e-9)


@pytest.mark.parametrize("condition", [(2.0, 1.0), (4.0, 0.0)])
def test_speed_converges_with_the_step(robot, table, condition):
    best = simulate(changed(robot, method="rk4", step_s=5e-5), table, *condition)
    for method, step_s, most in (
        ("semi_implicit_euler", 1e-4, 0.005),
        ("semi_implicit_euler", 4e-4, 0.02),
        ("rk4", 1e-4, 0.02),
        ("rk4", 4e-4, 0.02),
    ):
        run = simulate(changed(robot, method=method, step_s=step_s), table, *condition)
        assert run.outcome == "steady"
        assert run.speed_cm_per_s == pytest.approx(best.speed_cm_per_s, rel=most)
