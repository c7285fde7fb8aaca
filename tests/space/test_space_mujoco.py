"""Bodies in MuJoCo on a measured medium sink, rest and feel the forces of `rftfit.predict`.

Models that cannot stand on a medium are refused.
"""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rftfit

mujoco = pytest.importorskip("mujoco")
simulator: Any = rftfit.mujoco
attach = simulator.attach
POPPY = rftfit.TableProfile.published("poppy_LP")


def load(inside, options="", step=0.001):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" {options}/><worldbody>{inside}</worldbody></mujoco>'
    )


FOOT = '<body name="foot" pos="0 0 0.02"><freejoint/><geom name="sole" type="{}" size=".03 .03 .02" mass="1"/></body>'
"""A free body with one geometry, in MuJoCo's XML."""


@pytest.mark.parametrize("kind", ["box", "sphere", "capsule", "cylinder", "ellipsoid"])
def test_a_foot_sinks_and_rests(kind):
    model = load(FOOT.format(kind))
    data = mujoco.MjData(model)
    ground = attach(model, data, POPPY, triangle_cm=1)
    taken, places = 0.0, []
    for _ in range(1500):
        before = data.qvel[2]
        ground.step()
        taken -= ground.forces[0, 2] * (before + data.qvel[2]) / 2 * model.opt.timestep
        places.append(data.qpos[:3].copy())
    assert taken > 0
    assert_allclose(ground.forces[0, 2], 9.81, rtol=0.01)
    assert np.ptp(places[-500:], axis=0).max() < 1e-4  # m
    # pulled out again, the ground takes more energy
    for _ in range(300):
        before = data.qvel[2]
        data.qfrc_applied[2] = 15.0
        ground.step()
        taken -= ground.forces[0, 2] * (before + data.qvel[2]) / 2 * model.opt.timestep
        assert taken > 0


FLOOR = '<geom name="floor" type="plane" size="1 1 1"/>'
REFUSED: dict[str, tuple[str, str, dict[str, Any], str]] = {
    "floor": (FLOOR + FOOT.format("box"), "", {}, "floor"),
    "name": (FOOT.format("box"), "", {"geoms": ["soles"]}, "sole"),
    "integrator": (FOOT.format("box"), 'integrator="RK4"', {}, "RK4"),
    "long step": (FOOT.format("box"), "", {"tau_s": 0.01}, "allowed"),
    "nothing": ('<geom name="a" size="1"/>', "", {}, "no geom"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case):
    inside, options, settings, words = REFUSED[case]
    model = load(inside, options)
    with pytest.raises(rftfit.RftfitError, match=words):
        attach(model, mujoco.MjData(model), POPPY, **settings)


# --- A body declared a wheel


SLOPE = """<mujoco><option timestep="0.001" integrator="implicitfast" gravity="{ahead} 0 {down}"/>
<worldbody><body name="wheel" pos="0 0 0.05"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<joint name="axle" type="hinge" axis="0 1 0" pos="{offset} 0 0"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.002 0.003 0.002"/></body></worldbody></mujoco>"""
"""A wheel that moves in the plane, on a slope by turned gravity."""


def roll_down(slope_deg, seconds, speed=0.0, **options):
    """Ground, data, energy that was lost and work of the medium of a wheel on a slope."""
    slope = np.radians(slope_deg)
    gravity = {"ahead": 9.81 * np.sin(slope), "down": -9.81 * np.cos(slope)}
    model = mujoco.MjModel.from_xml_string(SLOPE.format(offset=0, **gravity))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    data.qvel[:] = speed, 0, speed / 0.04
    meshes = {"wheel": rftfit.Mesh.wheel(3.2, 3, lug_cm=0.8, lugs=24, thickness_cm=0.3)}
    ground = attach(model, data, POPPY, meshes=meshes, triangle_cm=1, **options)
    mujoco.mj_forward(model, data)
    before, work = data.energy.sum(), 0.0
    for _ in range(round(1000 * seconds)):
        rates = data.qvel.copy()
        ground.step()
        force = data.xfrc_applied[1, [0, 2, 4]]
        work += 0.001 * force @ (rates + data.qvel) / 2
    mujoco.mj_forward(model, data)
    return ground, data, data.energy.sum() - before, work


def test_energy_of_a_lugged_wheel_that_rolls_down_a_slope():
    ground, data, gained, work = roll_down(25, 0.8, speed=1.0, wheels=["wheel"])
    assert ground.rules == ("own-track",)
    assert data.qpos[0] > 0.1  # it rolled
    assert work < 0
    assert gained == pytest.approx(work, rel=0.01)


def test_a_lugged_wheel_rests_on_a_level_bed():
    with_rule, plain = (roll_down(0, 1.0, **options) for options in ({"wheels": ["wheel"]}, {}))
    for _, data, _, _ in (with_rule, plain):
        assert np.abs(data.qvel).max() < 1e-3
    # it never rolled, so it has no rut
    assert_allclose(with_rule[1].qpos, plain[1].qpos, atol=5e-4)


def test_wheels_that_are_refused():
    model = mujoco.MjModel.from_xml_string(SLOPE.format(ahead=0, down=-9.81, offset=0.01))
    data = mujoco.MjData(model)
    meshes = {"wheel": rftfit.Mesh.cylinder(4, 3)}
    with pytest.raises(rftfit.RftfitError, match="origin"):
        attach(model, data, POPPY, meshes=meshes, wheels=["wheel"])
    with pytest.raises(rftfit.RftfitError, match="allowed"):
        attach(model, data, POPPY, meshes=meshes, wheels=["wheels"])
