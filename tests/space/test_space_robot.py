"""The paper's robot with MuJoCo as integrator and its legs as sheets in space."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rftfit
from rftfit.model.mesh import Mesh
from rftfit.model.outlines import arc, polyline
from rftfit.robot.body import assemble
from rftfit.robot.config import paper_robot
from rftfit.robot.mujoco import attach
from rftfit.robot.run import simulate, start_state

mujoco = pytest.importorskip("mujoco")


def test_the_paper_robot_runs_as_in_the_plane():
    robot, medium = paper_robot(), rftfit.TableProfile.published("poppy_LP")
    legs = "".join(
        f'<body name="leg{i}" pos="{hip.x_cm / 100} 0 {hip.z_cm / 100}">'
        '<joint type="hinge" axis="0 1 0" armature="1e6"/>'
        '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/></body>'
        for i, hip in enumerate(robot.legs.hips)
    )
    inertia = robot.body.inertia_g_cm2 * 1e-7
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler boundmass="0"/><option timestep="0.001"/><worldbody><body name="trunk">
        <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <joint type="hinge" axis="0 1 0"/><inertial pos="0 0 0"
        mass="{robot.body.mass_g / 1000}" diaginertia="{inertia} {inertia} {inertia}"/>
        {legs}</body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    leg = Mesh.extrude(arc(1.0, robot.legs.max_length_cm, robot.legs.width_cm))
    plates = [polyline([p.from_cm, p.to_cm], p.width_cm) for p in robot.body.plates.values()]
    corners = np.concatenate([Mesh.extrude(plate).triangles.reshape(-1, 3) for plate in plates])
    trunk = Mesh(corners, np.arange(len(corners)).reshape(-1, 3), "trunk", sheet=True)
    meshes = {"trunk": trunk} | {f"leg{i}": leg for i in range(len(robot.legs.hips))}
    data.qpos[1] = start_state(robot, assemble(robot, 1.0), 0.0)[1] / 100
    data.qpos[3:] = [2 * math.pi * hip.phase_turns for hip in robot.legs.hips]
    data.qvel[3:] = 4 * math.pi
    ground = attach(model, data, medium, meshes=meshes, triangle_cm=9, delta_mm=0, tau_s=0)
    places = []
    for _ in range(6):
        places.append(100 * data.qpos[0])
        for _ in range(500):
            ground.step()
    speed = (100 * data.qpos[0] - places[-1]) / 0.5
    np.testing.assert_allclose(speed, simulate(robot, medium, 2.0, 1.0).speed_cm_per_s, rtol=0.005)
