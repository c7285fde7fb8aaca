"""Bodies in MuJoCo on a measured medium sink, rest and feel the forces of `rftfit.predict`.

Models that cannot stand on a medium are refused.
"""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rftfit
from rftfit.errors import InputError
from rftfit.robot.mujoco import attach

mujoco = pytest.importorskip("mujoco")
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


def test_forces_are_those_of_predict():
    model = load(FOOT.format("sphere"))
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[:] = -0.01, [0.1, 0.02, -0.05, 0.3, 0.2, -0.1]
    ground = attach(model, data, POPPY, triangle_cm=9, delta_mm=0, tau_s=0)
    ground.step()
    motion = rftfit.Motion3D([0, 0, -1], [10, 2, -5], [0.3, 0.2, -0.1])
    table = rftfit.predict(POPPY, rftfit.Mesh.sphere(3, 17), motion).iloc[0]
    columns = [*(f"force_{axis}_N" for axis in "xyz"), *(f"moment_{axis}_N_cm" for axis in "xyz")]
    assert_allclose(ground.forces[0, :6], table[columns].to_numpy(float), atol=1e-9)
    assert_allclose(data.xfrc_applied[1, 3:], ground.forces[0, 3:6] / 100, atol=1e-9)


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
    with pytest.raises(InputError, match=words):
        attach(model, mujoco.MjData(model), POPPY, **settings)
