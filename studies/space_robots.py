"""Robots in MuJoCo on a measured medium: the paper's robot beside the planar one, and a quadruped at rest.

    python studies/space_robots.py robot    speed and energy by elastic length and step, beside `simulate`
    python studies/space_robots.py rest     drift of a resting quadruped by step and elastic length
    python studies/space_robots.py speed    simulated seconds a second of processor time, both robots

Two minutes each, on one core.
"""

from __future__ import annotations

import math
import sys
import time
from typing import Any

import mujoco
import numpy as np

from rftfit.forces.mesh import Mesh
from rftfit.forces.outlines import arc, polyline
from rftfit.model.profiles import TableProfile
from rftfit.robot.body import assemble
from rftfit.robot.config import paper_robot
from rftfit.robot.mujoco import MujocoGround, attach
from rftfit.robot.run import simulate, start_state

POPPY = TableProfile.published("poppy_LP")


def paper_robot_in_mujoco(
    delta_mm: float, tau_s: float, step_s: float = 0.001
) -> tuple[Any, MujocoGround]:
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
        f"""<mujoco><compiler boundmass="0"/><option timestep="{step_s}"/><worldbody><body name="trunk">
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
    return data, attach(
        model, data, POPPY, meshes=meshes, triangle_cm=9, delta_mm=delta_mm, tau_s=tau_s
    )


def speed_of_paper_robot(
    delta_mm: float, tau_s: float, strides: int = 8, step_s: float = 0.001
) -> tuple[float, float]:
    """Speed over the last two strides, cm/s, and the least energy that the ground took in one stride, J."""
    data, ground = paper_robot_in_mujoco(delta_mm, tau_s, step_s)
    places, taken = [0.0], []
    for _ in range(strides):
        energy = 0.0
        for _ in range(round(0.5 / step_s)):
            ground.step()
            force, moment = ground.forces[:, :3], ground.forces[:, 3:6] / 100
            velocity, rate = ground.frames[:, 3:6] / 100, ground.frames[:, 6:9]
            energy -= step_s * float((force * velocity).sum() + (moment * rate).sum())
        taken.append(energy)
        places.append(100 * float(data.qpos[0]))
    return places[-1] - places[-3], min(taken)


def robot() -> None:
    """The paper's robot: speed and energy by elastic length and step, beside the planar `simulate`."""
    print(f"simulate: {simulate(paper_robot(), POPPY, 2.0, 1.0).speed_cm_per_s:.3f} cm/s")
    cases = (
        (0.0, 0.0, 1e-3),
        (0.0, 0.0, 5e-4),
        (0.1, 2e-3, 1e-3),
        (0.3, 2e-3, 1e-3),
        (0.9, 2e-3, 1e-3),
    )
    for delta, tau, step in cases:
        speed, least = speed_of_paper_robot(delta, tau, step_s=step)
        print(
            f"delta {delta:g} mm, step {1e3 * step:g} ms: {speed:.3f} cm/s, the ground takes at least "
            f"{1e3 * least:.2f} mJ a stride"
        )


LEGS = "".join(
    f'<body pos="{x} {y} 0"><geom type="capsule" fromto="0 0 0 0 0 -.2" size=".015" mass=".3" contype="0" '
    f'conaffinity="0"/><geom name="foot{x}{y}" type="box" pos="0 0 -.21" size=".035 .035 .01" mass=".2"/></body>'
    for x in (-0.2, 0.2)
    for y in (-0.15, 0.15)
)
QUADRUPED = f"""<mujoco><option timestep="{{step}}"/><worldbody>
<body name="trunk" pos="0 0 .215"><freejoint/><geom type="box" size=".25 .12 .05" mass="7" contype="0" conaffinity="0"/>
{LEGS}</body></worldbody></mujoco>"""


def quadruped(step_s: float, delta_mm: float, tau_s: float) -> tuple[Any, MujocoGround]:
    """9 kg on four box feet."""
    model = mujoco.MjModel.from_xml_string(QUADRUPED.format(step=step_s))
    data = mujoco.MjData(model)
    return data, attach(model, data, POPPY, delta_mm=delta_mm, tau_s=tau_s)


def drift(
    step_s: float, delta_mm: float, tau_s: float, until_s: float = 6.0
) -> tuple[float, float]:
    """Depth of the feet, mm, and how far the trunk moves in the last 5 s, micrometres."""
    data, ground = quadruped(step_s, delta_mm, tau_s)
    start = np.zeros(3)
    while data.time < until_s:
        if data.time < until_s - 5:
            start = data.qpos[:3].copy()
        ground.step()
    return 1e3 * (0.22 - float(data.qpos[2])), 1e6 * float(np.linalg.norm(data.qpos[:3] - start))


def rest() -> None:
    """Drift of a resting quadruped in 5 s, 1 s after it was put down."""
    cases = [(1e-3, 0.3, 2e-3), (5e-4, 0.3, 2e-3), (2e-3, 0.3, 1e-3), (1e-3, 0.1, 2e-3), (1e-3, 0.9, 2e-3), (1e-3, 0.0, 0.0)]  # fmt: skip
    for step, delta, tau in cases:
        depth, moved = drift(step, delta, tau)
        print(
            f"step {1e3 * step:g} ms, delta {delta:g} mm, tau {1e3 * tau:g} ms: {depth:.1f} mm deep, "
            f"moves {moved:.1f} micrometres in 5 s"
        )


def speed() -> None:
    """Simulated seconds a second of processor time at steps of 1 ms."""
    for name, (data, ground) in {
        "paper's robot": paper_robot_in_mujoco(0.3, 2e-3),
        "quadruped": quadruped(1e-3, 0.3, 2e-3),
    }.items():
        ground.step()
        began, start = time.process_time(), data.time
        while data.time < start + 2:
            ground.step()
        print(
            f"{name}: {ground.n_faces} triangles, {2 / (time.process_time() - began):.1f} simulated s a s"
        )


if __name__ == "__main__":
    {"robot": robot, "rest": rest, "speed": speed}[sys.argv[1]]()
