"""The simulated robot obeys momentum, energy, statics and symmetry, and its steps converge."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from robotsteps import step

import rftfit
from rftfit.robot.body import assemble
from rftfit.robot.config import Robot

G = 980.665
"""Gravity, cm/s^2."""
ERG_PER_N_CM = 1e5


def with_plate():
    """A single level plate of 6 x 4 cm as the body; its one leg is too short to touch anything."""
    plate = {"from_cm": [-3.0, 0.0], "to_cm": [3.0, 0.0], "width_cm": 4.0}
    body = {"mass_g": 150.0, "inertia_g_cm2": 2080.0, "plates": {"plate": plate}}
    hips = [{"x_cm": 0.0, "z_cm": 0.0, "phase_turns": 0.0}]
    legs = {"max_length_cm": 1e-9, "width_cm": 1e-9, "hips": hips}
    return Robot.model_validate({"title": "plate", "body": body, "legs": legs})


@pytest.mark.parametrize("rk4", [False, True])
def test_free_flight(robot, table, rk4):
    # thrown high with turning legs: no force but weight, whatever the legs do
    state, time, off = np.array([0.0, 500.0, 0.1, 30.0, 100.0, 2.0]), 0.5, 1e-12 if rk4 else 1e-4
    end = step(table, assemble(robot, 1.0), state, 0.0, 30.0, 1e-4, 5000, rk4)
    assert_allclose(end[3:], [30.0, 100.0 - G * time, 2.0], rtol=1e-12)
    assert_allclose(end[[0, 2]], [30.0 * time, 0.1 + 2.0 * time], rtol=1e-12)
    assert_allclose(end[1], 500.0 + 100.0 * time - G * time**2 / 2, rtol=off)
    before, after = (
        150 * (s[3:5] @ s[3:5] / 2 + G * s[1]) + 2080 * s[5] ** 2 / 2 for s in (state, end)
    )
    assert after == pytest.approx(before, rel=off)


def together(forces):
    return np.asarray(np.sum(list(forces.values()), axis=0))


def each_step(robot, profile, curvature, frequency):
    """Motion by semi-implicit Euler, a sample before every step."""
    steps = round(1 / frequency / robot.numerics.step_s)
    return rftfit.simulate(profile, frequency, curvature, robot, samples_per_stride=steps).series


@pytest.mark.parametrize(("curvature", "frequency"), [(1.0, 2.0), (0.0, 4.0), (-1.0, 1.0)])
def test_momentum_and_energy_with_sand(robot, profile, curvature, frequency):
    s = each_step(robot, profile, curvature, frequency)
    assert s is not None
    mass, inertia = robot.body.mass_g, robot.body.inertia_g_cm2
    step_s, spin = s.time_s[1], -np.radians(s.pitch_rate_deg_per_s)
    force_x = ERG_PER_N_CM * together(s.force_x_N)[:-1]
    force_z = ERG_PER_N_CM * together(s.force_z_N)[:-1]
    moment = ERG_PER_N_CM * s.moment_N_cm[:-1]
    # the impulse of all forces is the change of momentum
    for force, momentum in (
        (force_x, mass * s.velocity_x_cm_per_s),
        (force_z - mass * G, mass * s.velocity_z_cm_per_s),
        (moment, inertia * spin),
    ):
        impulse = step_s * np.cumsum(force)
        scale = np.abs(momentum).max()
        assert_allclose(impulse, momentum[1:] - momentum[0], atol=1e-8 * scale)
    # the granular forces' work on the rigid body is the change of its energy, weight included
    vx, vz, turning = (
        (rate[1:] + rate[:-1]) / 2 for rate in (s.velocity_x_cm_per_s, s.velocity_z_cm_per_s, spin)
    )
    work = step_s * np.cumsum(force_x * vx + force_z * vz + moment * turning)
    speed = s.velocity_x_cm_per_s**2 + s.velocity_z_cm_per_s**2
    energy = mass * (speed / 2 + G * s.z_cm) + inertia * spin**2 / 2
    scale = np.abs(energy - energy[0]).max()
    # height goes with the velocity at the end of a step, not with that of its middle
    slip = mass * G * step_s * np.ptp(s.velocity_z_cm_per_s)
    assert slip < 0.01 * scale
    assert_allclose(work, energy[1:] - energy[0], atol=slip)
    # sand takes energy: over whole strides the drive has to give more than it gets back
    work_of_drive = ERG_PER_N_CM * step_s * (s.drive_moment_N_cm * 2 * math.pi * frequency).sum()
    assert work_of_drive > max(energy[-1] - energy[0], 0)


@pytest.mark.parametrize("drop_cm", [0.0, 1.0, 5.0])
def test_dropped_plate_comes_to_rest(table, drop_cm):
    # weight times fall = half of alpha times area times depth squared
    robot, weight_N = with_plate(), 150.0 * G / 1e5
    alpha, area = float(table.alpha(0.0, math.pi / 2)[0]), 24.0
    stiffness = alpha * area
    depth = (weight_N + math.sqrt(weight_N**2 + 2 * stiffness * weight_N * drop_cm)) / stiffness
    parts = assemble(robot, 0.0)
    creeps = []
    for step_s in (2e-5, 1e-5):
        state = np.array([0.0, drop_cm, 0.0, 0.0, 0.0, 0.0])
        heights = []
        for _ in range(600):
            state = step(table, parts, state, 0.0, 0.0, step_s, round(1e-3 / step_s))
            heights.append(state[1])
        assert_allclose(-min(heights), depth, rtol=2e-3)
        assert abs(state[2]) < 1e-6
        # it then stays there, but for what the force's jump at no velocity makes of a finite step
        creeps.append(heights[-1] - heights[-101])
    assert np.abs(creeps).max() < 0.01 * depth
    assert_allclose(creeps[0] / creeps[1], 2, atol=0.4)


def mirrored(robot):
    data = robot.model_dump()
    for plate in data["body"]["plates"].values():
        for end in ("from_cm", "to_cm"):
            plate[end] = (-plate[end][0], plate[end][1])
    for hip in data["legs"]["hips"]:
        hip["x_cm"], hip["phase_turns"] = -hip["x_cm"], -hip["phase_turns"] % 1
    return Robot.model_validate(data)


@pytest.mark.parametrize("curvature", [1.0, 0.0, -0.6])
def test_mirror_image(robot, profile, curvature):
    # reversed legs that turn the other way, on the mirrored body, do the mirror image of the run
    data = robot.model_dump()
    data["legs"]["hips"][0]["x_cm"] = 4.0  # a robot that is not its own mirror image
    robot = Robot.model_validate(data)
    courses = []
    for body, sign in ((robot, 1), (mirrored(robot), -1)):
        gait: dict[str, Any] = {"phase_turns": 0.1 * sign, "samples_per_stride": 20}
        s = rftfit.simulate(profile, 2.0 * sign, curvature * sign, body, **gait).series
        assert s is not None
        courses.append([sign * s.x_cm[:12], s.z_cm[:12], sign * s.pitch_deg[:12]])
    for course, mirrored_course, most in zip(*courses, (2e-5, 2e-5, 1e-3), strict=True):
        assert_allclose(course, mirrored_course, atol=most)


def test_order_of_the_methods(robot, nine):
    # wholly in the sand and always moving on, the forces are smooth
    parts = assemble(robot, 0.5)
    state = np.array([0.0, -20.0, 0.0, 400.0, -150.0, 3.0])
    weak = rftfit.FourierProfile(nine.coefficients / 30)

    def end(steps, rk4):
        return step(weak, parts, state, 0.0, 6.0, 0.016 / steps, steps, rk4=rk4)

    best = end(4096, True)
    for rk4, order in ((False, 1), (True, 4)):
        errors = [np.abs(end(steps, rk4) - best).max() for steps in (8, 16, 32)]
        ratios = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
        assert_allclose(ratios, order, atol=0.3)
