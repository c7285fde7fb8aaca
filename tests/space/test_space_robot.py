"""The paper's robot, its legs as sheets in space, runs in MuJoCo as it does in the plane."""

import math

import numpy as np
import pytest

import rftfit
from rftfit.robot.body import assemble
from rftfit.robot.config import paper_robot
from rftfit.robot.mujoco import attach
from rftfit.robot.run import start_state

mujoco = pytest.importorskip("mujoco")

POPPY = rftfit.published_medium("poppy_LP")
STEP_S = 0.001


def paper_robot_in_mujoco():
    """The paper's robot in the plane, its legs as sheets in space, driven at 2 Hz by hinges of great inertia."""
    robot = paper_robot()
    legs = "".join(
        f'<body name="leg{i}" pos="{hip.x_cm / 100} 0 {hip.z_cm / 100}">'
        '<joint type="hinge" axis="0 1 0" armature="1e6"/>'
        '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/></body>'
        for i, hip in enumerate(robot.legs.hips)
    )
    inertia = robot.body.inertia_g_cm2 * 1e-7
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler boundmass="0"/><option timestep="{STEP_S}"/><worldbody><body name="trunk">
        <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <joint type="hinge" axis="0 1 0"/><inertial pos="0 0 0"
        mass="{robot.body.mass_g / 1000}" diaginertia="{inertia} {inertia} {inertia}"/>
        {legs}</body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    leg = rftfit.Mesh.extrude(rftfit.arc(1.0, robot.legs.max_length_cm, robot.legs.width_cm))
    plates = [rftfit.polyline([p.from_cm, p.to_cm], p.width_cm) for p in robot.body.plates.values()]
    corners = np.concatenate(
        [rftfit.Mesh.extrude(plate).triangles.reshape(-1, 3) for plate in plates]
    )
    trunk = rftfit.Mesh(corners, np.arange(len(corners)).reshape(-1, 3), "trunk", sheet=True)
    meshes = {"trunk": trunk} | {f"leg{i}": leg for i in range(len(robot.legs.hips))}
    data.qpos[1] = start_state(robot, assemble(robot, 1.0), 0.0)[1] / 100
    data.qpos[3:] = [2 * math.pi * hip.phase_turns for hip in robot.legs.hips]
    data.qvel[3:] = 4 * math.pi
    return data, attach(model, data, POPPY, meshes=meshes, triangle_cm=9, delta_mm=0, tau_s=0)


def speed_and_least_energy(strides):
    """Speed over the last two strides, cm/s, and the least energy that the ground took in one stride, J."""
    data, ground = paper_robot_in_mujoco()
    places, taken = [], []
    for _ in range(strides):
        energy = 0.0
        for _ in range(round(0.5 / STEP_S)):
            ground.step()
            force, moment = ground.forces[:, :3], ground.forces[:, 3:6] / 100
            velocity, rate = ground.frames[:, 3:6] / 100, ground.frames[:, 6:9]
            energy -= STEP_S * float((force * velocity).sum() + (moment * rate).sum())
        taken.append(energy)
        places.append(100 * float(data.qpos[0]))
    return places[-1] - places[-3], min(taken)


def test_the_paper_robot_runs_as_in_the_plane_and_each_stride_takes_energy():
    speed, least_J = speed_and_least_energy(strides=6)
    planar = rftfit.simulate(POPPY, 2.0).speed_cm_per_s
    np.testing.assert_allclose(speed, planar, rtol=0.002)
    assert least_J > 0.1
