"""The paper's robot, its legs as sheets in space, runs in MuJoCo as it does in the plane.

MuJoCo is an independent integrator: masses, hinges, places and velocities of all bodies and the steps in time are its own.
"""

import math
from typing import Any

import numpy as np
import pytest
import yaml
from paper import PROJECT
from seeds import seeds

import rftfit

mujoco: Any = pytest.importorskip("mujoco", reason="the package mujoco is not installed")

POPPY = rftfit.published_medium("poppy_LP")
ROBOT = yaml.safe_load((PROJECT / "config" / "robot.yaml").read_text("utf-8"))
HIPS = ROBOT["legs"]["hips"]
FLYWHEEL_KG_M2 = 1e6
"""So heavy that no force changes its rate: the angle of a hinge is prescribed."""


def robot_in_mujoco(frequency_Hz, curvature, step_s, start_cm):
    """The paper's robot in the plane, its legs as sheets in space, driven by hinges of great inertia."""
    legs = "".join(
        f'<body name="leg{i}" pos="{hip["x_cm"] / 100} 0 {hip["z_cm"] / 100}">'
        f'<joint type="hinge" axis="0 1 0" armature="{FLYWHEEL_KG_M2}"/>'
        '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/></body>'
        for i, hip in enumerate(HIPS)
    )
    inertia = ROBOT["body"]["inertia_g_cm2"] * 1e-7
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler boundmass="0"/><option timestep="{step_s}"/><worldbody><body name="trunk">
        <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <joint type="hinge" axis="0 1 0"/><inertial pos="0 0 0"
        mass="{ROBOT["body"]["mass_g"] / 1000}" diaginertia="{inertia} {inertia} {inertia}"/>
        {legs}</body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    length_cm, width_cm = ROBOT["legs"]["max_length_cm"], ROBOT["legs"]["width_cm"]
    leg = rftfit.Mesh.extrude(rftfit.arc(curvature, length_cm, width_cm))
    corners = []
    for plate in ROBOT["body"]["plates"].values():
        line = rftfit.polyline([plate["from_cm"], plate["to_cm"]], plate["width_cm"])
        corners.append(rftfit.Mesh.extrude(line).triangles.reshape(-1, 3))
    faces = np.arange(sum(map(len, corners))).reshape(-1, 3)
    trunk = rftfit.Mesh(np.concatenate(corners), faces, "trunk", sheet=True)
    meshes = {"trunk": trunk} | {f"leg{i}": leg for i in range(len(HIPS))}
    data.qpos[1] = start_cm / 100
    data.qpos[3:] = [2 * math.pi * hip["phase_turns"] for hip in HIPS]
    data.qvel[3:] = 2 * math.pi * frequency_Hz
    simulator: Any = rftfit.mujoco
    options = {"meshes": meshes, "triangle_cm": 9, "delta_mm": 0, "tau_s": 0}
    return data, simulator.attach(model, data, POPPY, **options)


GAITS = (
    (2.0, 1.0, 6, 1e-3, 0.002),
    (5.0, 1.0, 9, 1e-3, 0.005),
    (2.0, -1.0, 4, 2e-4, 0.005),
    (1.0, 0.0, 3, 1e-3, 0.005),
    (3.5, 1.0, 7, 5e-4, 0.005),
)
"""Frequency in Hz, curvature times R', strides, step in s, relative difference."""


@pytest.mark.statistics
@pytest.mark.parametrize(
    ("frequency_Hz", "curvature", "strides", "step_s", "most"), seeds(GAITS, GAITS[:3])
)
def test_the_paper_robot_runs_as_in_the_plane_and_each_stride_takes_energy(
    frequency_Hz, curvature, strides, step_s, most
):
    planar = rftfit.simulate(POPPY, frequency_Hz, curvature, samples_per_stride=10)
    assert planar.outcome == "steady"
    assert planar.series is not None
    start_cm = float(planar.series.z_cm[0])
    data, ground = robot_in_mujoco(frequency_Hz, curvature, step_s, start_cm)
    steps, places = round(1 / frequency_Hz / step_s), [0.0]
    for _ in range(strides):
        energy_J = 0.0
        for _ in range(steps):
            ground.step()
            force, moment = ground.forces[:, :3], ground.forces[:, 3:6] / 100
            velocity, rate = ground.frames[:, 3:6] / 100, ground.frames[:, 6:9]
            energy_J -= step_s * float((force * velocity).sum() + (moment * rate).sum())
        assert energy_J > 0.1
        places.append(100 * float(data.qpos[0]))
    speeds = np.diff(places) / (steps * step_s)
    # they, too, have come to a steady speed
    np.testing.assert_allclose(speeds[-1], speeds[-2], rtol=0.005)
    np.testing.assert_allclose(speeds[-2:].mean(), planar.speed_cm_per_s, rtol=most)
