"""MuJoCo as an independent integrator: hinged legs, granular forces applied from outside.

Only the outline of a leg and the force on an element in the medium are shared with the program:
masses, hinges, kinematics, velocities of the elements and the steps in time are MuJoCo's, in SI.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rftfit.model.kernel import element_forces
from rftfit.model.outlines import arc, polyline
from rftfit.robot.body import assemble
from rftfit.robot.run import simulate, start_state

if TYPE_CHECKING:
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot

mujoco: Any = pytest.importorskip("mujoco", reason="the package mujoco is not installed")

STEP_S = 2e-4  # not the program's
STRIDES = {1.0: 3, 2.0: 4, 3.5: 7, 5.0: 9}
# a flywheel so heavy that no force changes its rate: the hinge's angle is prescribed
FLYWHEEL_KG_M2 = 1e6


def model_of(robot: Robot) -> Any:
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


class Independent:
    """A run of the robot in MuJoCo."""

    def __init__(self, robot: Robot, profile: Profile, frequency: float, curvature: float) -> None:
        self.model = model_of(robot)
        self.data = mujoco.MjData(self.model)
        self.pack = profile.pack
        leg = arc(curvature, robot.legs.max_length_cm, robot.legs.width_cm)
        plates = [
            polyline([plate.from_cm, plate.to_cm], plate.width_cm)
            for plate in robot.body.plates.values()
        ]
        outlines = [(1, plate) for plate in plates]
        outlines += [(2 + index, leg) for index in range(len(robot.legs.hips))]
        self.owner = np.concatenate([np.full(len(o.body), body) for body, o in outlines])
        self.body = np.concatenate([o.body for _, o in outlines])
        self.area = np.concatenate([2 * o.body[:, 4] * o.width_cm for _, o in outlines])
        self.rate = 2 * math.pi * frequency
        self.data.qpos[3:] = [2 * math.pi * hip.phase_turns for hip in robot.legs.hips]
        self.data.qvel[3:] = self.rate

    def elements(self) -> np.ndarray:
        data = self.data
        # legs and trunk turn about y alone: the matrix's corners say by how much
        turn = data.xmat.reshape(-1, 3, 3)[self.owner]
        cos, sin = turn[:, 0, 0], turn[:, 0, 2]
        x, z, tx, tz, half = self.body.T
        arm_x, arm_z = x * cos + z * sin, z * cos - x * sin
        velocity = np.zeros((self.model.nbody, 6))
        for index in range(1, self.model.nbody):
            mujoco.mj_objectVelocity(
                self.model, data, mujoco.mjtObj.mjOBJ_XBODY, index, velocity[index], 0
            )
        spin = velocity[self.owner, 1]
        at, moves = 100 * data.xpos[self.owner], 100 * velocity[self.owner, 3:]
        return np.ascontiguousarray(
            np.column_stack(
                [
                    at[:, 0] + arm_x, at[:, 2] + arm_z, tx * cos + tz * sin, tz * cos - tx * sin,
                    half, self.area, moves[:, 0] + spin * arm_z, moves[:, 2] - spin * arm_x,
                ]
            )
        )  # fmt: skip

    def step(self) -> None:
        model, data = self.model, self.data
        mujoco.mj_step1(model, data)
        force_z, force_x, x, z = element_forces(self.pack, self.elements()).T
        at = 100 * data.xpos[self.owner]
        moment = ((z - at[:, 2]) * force_x - (x - at[:, 0]) * force_z) / 100
        sums = [
            np.bincount(self.owner, part, minlength=model.nbody)
            for part in (force_x, force_z, moment)
        ]
        data.qfrc_applied[:] = 0.0
        for index in range(1, model.nbody):
            along, up, about = (part[index] for part in sums)
            if along or up or about:
                mujoco.mj_applyFT(
                    model, data, np.array([along, 0.0, up]), np.array([0.0, about, 0.0]),
                    data.xpos[index], index, data.qfrc_applied,
                )  # fmt: skip
        mujoco.mj_step2(model, data)

    def stride_speeds(self, z_cm: float, strides: int) -> np.ndarray:
        self.data.qpos[1] = z_cm / 100
        steps = round(2 * math.pi / self.rate / STEP_S)
        places = [0.0]
        for _ in range(strides):
            for _ in range(steps):
                self.step()
            places.append(100 * self.data.qpos[0])
        assert abs(self.data.qvel[3:] - self.rate).max() < 1e-6 * self.rate
        return np.asarray(np.diff(places) / (steps * STEP_S))


@pytest.mark.parametrize("curvature", [1.0, 0.0, -1.0], ids=["c-leg", "flat", "reversed"])
@pytest.mark.parametrize("frequency", STRIDES, ids=lambda f: f"{f:g} Hz")
def test_mean_speed_agrees(
    robot: Robot, table: Profile, frequency: float, curvature: float
) -> None:
    ours = simulate(robot, table, frequency, curvature)
    assert ours.outcome == "steady"
    start = start_state(robot, assemble(robot, curvature), 0.0)
    other = Independent(robot, table, frequency, curvature)
    theirs = other.stride_speeds(float(start[1]), STRIDES[frequency])
    assert abs(theirs[-1] / theirs[-2] - 1) < 0.005  # they, too, have come to a steady speed
    np.testing.assert_allclose(ours.speed_cm_per_s, theirs[-2:].mean(), rtol=0.005)
