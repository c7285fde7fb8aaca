"""A robot of one's own trots in MuJoCo: `python studies/space_walk.py MODEL.xml --feet FL FR RL RR`.

The joints between a foot and the trunk keep it on its path, by the model's own kinematics; nothing else is controlled. Shapes, masses and
joints are those of the file, its first keyframe is the stance; it must have no floor, and its motors do nothing. The last link of each leg
feels the medium: loosely packed poppy seeds, `--times` as firm. A picture needs `MUJOCO_GL=egl` or `osmesa`. Four minutes on one core.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import mujoco
import numpy as np
from PIL import Image

from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.model.profiles import TableProfile
from rftfit.reference import alpha_grid
from rftfit.robot.mujoco import attach

PHASES = np.array([0.0, 0.5, 0.5, 0.0])
"""Of the feet, in strides: feet of one diagonal move together."""
STAND_S, REST_S, STRIDES = 2.0, 3.0, 8
STIFFNESS, DAMPING, TORQUE = 300.0, 5.0, 24.0
"""Of every joint: N m/rad, N m s/rad, and the greatest torque, N m."""


def load(path: str, step_s: float) -> Any:
    """Model of the file, with a surface to look at."""
    spec, white = mujoco.MjSpec.from_file(path), [0.93, 0.96, 1]
    spec.option.timestep, spec.option.integrator = step_s, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    for number, geom in enumerate(spec.geoms):
        geom.name = geom.name or f"geom {number}"
    sand = spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3, 3, 0.1], rgba=[0.85, 0.75, 0.55, 0.7]
    )
    sand.contype = sand.conaffinity = 0
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        width=64,
        height=64,
        rgb1=white,
        rgb2=white,
    )
    spec.visual.headlight.ambient[:] = [0.4] * 3
    return spec.compile()


class Legs:
    """Feet, the joints and links above them, and the joint targets of the motion."""

    def __init__(self, model: Any, options: argparse.Namespace) -> None:
        self.model, self.still, self.options = model, mujoco.MjData(model), options
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, self.still, 0)
        mujoco.mj_kinematics(model, self.still)
        self.feet = [model.geom(name).id for name in options.feet]
        self.home, bodies = self.still.geom_xpos[self.feet].copy(), model.geom_bodyid[self.feet]
        self.joints = [self.above(body) for body in bodies]
        every = np.concatenate(self.joints)
        self.places, self.rates = model.jnt_qposadr[every], model.jnt_dofadr[every]
        last = np.isin(model.body_weldid[model.geom_bodyid], model.body_weldid[bodies])
        collides = np.flatnonzero(last & (model.geom_contype | model.geom_conaffinity != 0))
        self.geoms = [model.geom(number).name for number in collides]
        self.stance, self.trot = (
            self.reach(self.home),
            [self.reach(self.home + self.path(phase)) for phase in np.arange(50) / 50],
        )
        self.drawn_in = self.reach(self.home + np.array([0, 0, options.lift_cm / 100]))

    def above(self, body: int) -> list[int]:
        """Joints between a body and the trunk."""
        if body == self.model.body_rootid[body]:
            return []
        first, count = self.model.body_jntadr[body], self.model.body_jntnum[body]
        return [*range(first, first + count), *self.above(self.model.body_parentid[body])]

    def path(self, stride: float) -> FloatArray:
        """How far the feet are from the stance, m: they go back on the ground, forward in the air."""
        phase = (stride + PHASES) % 1
        swing = np.pi * np.clip(2 * phase - 1, 0, 1)
        along = self.options.stride_cm * np.where(
            phase < 0.5, 0.5 - 2 * phase, -0.5 * np.cos(swing)
        )
        return (
            np.stack([along, 0 * along, self.options.lift_cm * np.sin(swing) ** 2], axis=-1) / 100
        )

    def reach(self, places: FloatArray) -> FloatArray:
        """Positions of the joints that bring the feet to these places."""
        jacobian = np.zeros((3, self.model.nv))
        for _ in range(50):
            mujoco.mj_kinematics(self.model, self.still)
            mujoco.mj_comPos(self.model, self.still)
            errors = places - self.still.geom_xpos[self.feet]
            for foot, joints, error in zip(self.feet, self.joints, errors, strict=True):
                mujoco.mj_jacGeom(self.model, self.still, jacobian, None, foot)
                leg_jacobian = jacobian[:, self.model.jnt_dofadr[joints]]
                moved = leg_jacobian.T @ np.linalg.solve(
                    leg_jacobian @ leg_jacobian.T + 1e-5 * np.eye(3), error
                )
                self.still.qpos[self.model.jnt_qposadr[joints]] += moved
        if np.abs(errors).max() > 0.002:
            sys.exit("a foot cannot reach its path: choose a smaller --stride-cm or --lift-cm")
        return self.still.qpos[self.places].copy()

    def target(self, time_s: float) -> FloatArray:
        """Of the joints: they stand up in a second, rest, then trot."""
        strides = (time_s - STAND_S - REST_S) * self.options.hz
        if strides < 0:
            return self.stance + max(0.0, 1 - time_s) * (self.drawn_in - self.stance)
        low, fraction = divmod((strides + 0.25) * 50, 1)
        now, soon = self.trot[int(low) % 50], self.trot[int(low + 1) % 50]
        return self.stance + min(1.0, strides) * (now + fraction * (soon - now) - self.stance)


def walk(options: argparse.Namespace, step_s: float, delta_mm: float) -> str:
    """One run: a row of numbers, and a picture of its last moment."""
    model = load(options.model, step_s)
    legs, data = Legs(model, options), mujoco.MjData(model)
    data.qpos[:] = legs.still.qpos
    data.qpos[2] += model.geom_size[legs.feet[0], 0] - legs.still.geom_xpos[legs.feet, 2].min()
    alpha_z, alpha_x = (options.times * alpha for alpha in alpha_grid("poppy_LP"))
    ground = attach(model, data, TableProfile(alpha_z, alpha_x), legs.geoms, delta_mm=delta_mm)
    trunk = model.body_rootid[ground.bodies[0]]
    ends = [STAND_S, *(STAND_S + REST_S + np.arange(STRIDES + 1) / options.hz)]
    positions, taken, tilted, deep, began = [], np.zeros(len(ends)), 0.0, 0.0, time.process_time()
    for number, end in enumerate(ends):
        while data.time < end - step_s / 2:
            joint_errors = legs.target(data.time) - data.qpos[legs.places]
            torque = STIFFNESS * joint_errors - DAMPING * data.qvel[legs.rates]
            data.qfrc_applied[legs.rates] = np.clip(torque, -TORQUE, TORQUE)
            ground.step()
            power = (
                ground.forces[:, :3] * ground.frames[:, 3:6]
                + ground.forces[:, 3:6] * ground.frames[:, 6:9]
            )
            taken[number] -= step_s * float(power.sum()) / 100
            tilted = max(tilted, float(np.degrees(np.arccos(min(1.0, data.xmat[trunk, 8])))))
            deep = max(deep, -100 * float(data.geom_xpos[legs.feet, 2].min()))
        positions.append(data.xpos[trunk].copy())
    pace = data.time / (time.process_time() - began)
    if options.picture:
        camera = mujoco.MjvCamera()
        camera.lookat[:] = [*positions[-1][:2], 0.12]
        camera.distance, camera.azimuth, camera.elevation = 1.0, 120, -13
        with mujoco.Renderer(model, 400, 640) as renderer:
            renderer.update_scene(data, camera)
            Image.fromarray(renderer.render()).save(options.picture, quality=70)
    (along, aside), drift = (
        100 * (positions[-1] - positions[3])[:2] / (STRIDES - 2) * options.hz,
        1e6 * np.linalg.norm(positions[1] - positions[0]),
    )
    return (
        f"| {1e3 * step_s:g} | {delta_mm:g} | {along:.1f} | {aside:.1f} | {tilted:.0f} | {deep:.1f} | {drift:.1f} | "
        f"{taken[4:].mean():.1f} ({taken[4:].min():.1f}) | {pace:.2f} |"
    )


def main() -> None:
    """Four runs: two steps, three elastic lengths."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", help="MJCF, or a URDF that MuJoCo loads")
    parser.add_argument(
        "--feet", nargs=4, required=True, help="geoms: front left and right, rear left and right"
    )
    parser.add_argument("--picture", help="file for the last moment of a run")
    for name, default in (("times", 1.0), ("hz", 2.5), ("stride-cm", 8.0), ("lift-cm", 7.0)):
        parser.add_argument(f"--{name}", type=float, default=default)
    options = parser.parse_args()
    print(
        "| step, ms | delta, mm | speed, cm/s | aside, cm/s | greatest tilt, deg | deepest foot, cm | drift in 3 s, micrometres | "
        "taken in a stride (least), J | simulated s a s |\n" + "|---" * 9 + "|"
    )
    try:
        for step_s, delta_mm in ((1e-3, 0.3), (5e-4, 0.3), (1e-3, 0.1), (1e-3, 0.9)):
            print(walk(options, step_s, delta_mm), flush=True)
    except (InputError, KeyError, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
