"""MuJoCo, an independent integrator, gives the same mean speeds of the robot.

Legs are hinged and granular forces are applied from outside. Only the outline of a leg and the
force on an outline in a pose are shared with the program: masses, hinges, places and velocities of
all bodies and the steps in time are MuJoCo's, in SI.
"""

import math
from typing import Any

import numpy as np
import pytest
from seeds import seeds

from rftfit import arc, polyline
from rftfit.model.kernel import pose_forces
from rftfit.robot.body import assemble
from rftfit.robot.run import simulate, start_state

mujoco: Any = pytest.importorskip("mujoco", reason="the package mujoco is not installed")

STEP_S = 2e-4  # not the program's
STRIDES = {1.0: 3, 2.0: 4, 3.5: 7, 5.0: 9}
"""Stride frequency in Hz to the strides that are run."""
# a flywheel so heavy that no force changes its rate: the hinge's angle is prescribed
FLYWHEEL_KG_M2 = 1e6


def model_of(robot):
    legs = "".join(
        f'<body name="leg{index}" pos="{hip.x_cm / 100} 0 {hip.z_cm / 100}">'
        f'<joint name="hinge{index}" type="hinge" axis="0 1 0" armature="{FLYWHEEL_KG_M2}"/>'
        '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/></body>'
        for index, hip in enumerate(robot.legs.hips)
    )
    inertia = robot.body.inertia_g_cm2 * 1e-7
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler boundmass="0"/>
        <option timestep="{STEP_S}" integrator="Euler"
                gravity="0 0 {-robot.numerics.gravity_cm_per_s2 / 100}"/>
        <worldbody><body name="trunk">
        <joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
        <joint name="pitch" type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="{robot.body.mass_g / 1000}"
                  diaginertia="{inertia} {inertia} {inertia}"/>
        {legs}</body></worldbody></mujoco>"""
    )


def pose_of(model, data, body):
    velocity, turn = np.zeros(6), data.xmat[body]
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
    x, _, z = 100 * data.xpos[body]
    # legs and trunk turn about y alone: the matrix's corners say by how much
    angle = math.atan2(turn[2], turn[0])
    return np.array([[x, z, angle, 100 * velocity[3], 100 * velocity[5], velocity[1]]])


def stride_speeds(robot, profile, frequency, curvature, z_cm):
    """Mean speed of each stride of a run of the robot in MuJoCo."""
    model, rate = model_of(robot), 2 * math.pi * frequency
    data = mujoco.MjData(model)
    leg = arc(curvature, robot.legs.max_length_cm, robot.legs.width_cm)
    outlines = [
        (1, polyline([plate.from_cm, plate.to_cm], plate.width_cm))
        for plate in robot.body.plates.values()
    ]
    outlines += [(2 + index, leg) for index in range(len(robot.legs.hips))]
    data.qpos[1] = z_cm / 100
    data.qpos[3:] = [2 * math.pi * hip.phase_turns for hip in robot.legs.hips]
    data.qvel[3:] = rate
    steps, places = round(1 / frequency / STEP_S), [0.0]
    for _ in range(STRIDES[frequency]):
        for _ in range(steps):
            mujoco.mj_step1(model, data)
            data.qfrc_applied[:] = 0.0
            for body, line in outlines:
                pose = pose_of(model, data, body)
                up, along, about = pose_forces(profile.pack, line.body, line.width_cm, False, pose)[
                    0
                ]
                if along or up or about:
                    force, moment = np.array([along, 0.0, up]), np.array([0.0, about / 100, 0.0])
                    place, applied = data.xpos[body], data.qfrc_applied
                    mujoco.mj_applyFT(model, data, force, moment, place, body, applied)
            mujoco.mj_step2(model, data)
        places.append(100 * data.qpos[0])
    assert abs(data.qvel[3:] - rate).max() < 1e-6 * rate
    return np.diff(places) / (steps * STEP_S)


GAITS = (2.0, -1.0), (5.0, 1.0), (1.0, 0.0), (3.5, 1.0), (5.0, -1.0)
"""Frequency in Hz and curvature times R'."""


@pytest.mark.statistics
@pytest.mark.parametrize(("frequency", "curvature"), seeds(GAITS, GAITS[:2]))
def test_mean_speed_agrees(robot, table, frequency, curvature):
    ours = simulate(robot, table, frequency, curvature)
    assert ours.outcome == "steady"
    start = start_state(robot, assemble(robot, curvature), 0.0)
    theirs = stride_speeds(robot, table, frequency, curvature, float(start[1]))
    assert abs(theirs[-1] / theirs[-2] - 1) < 0.005  # they, too, have come to a steady speed
    np.testing.assert_allclose(ours.speed_cm_per_s, theirs[-2:].mean(), rtol=0.005)
