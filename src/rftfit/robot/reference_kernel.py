"""The robot's motion in plain numpy, to check the compiled one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.model import reference_kernel

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile
    from rftfit.robot.body import Parts


def place(parts: Parts, state: FloatArray, turn: float, rate: float) -> list[FloatArray]:
    """Where all elements are and how they move.

    `state`: shape (6,); x, z (cm), pitch (rad), and their rates. `turn`, `rate`: Of the leg of
    phase 0 relative to the body, rad and rad/s. Returns shape (members, n, 8): For each group,
    elements as `rftfit.model.reference_kernel.element_forces` wants them.
    """
    x0, z0, pitch, vx0, vz0, pitch_rate = state
    result = []
    for shape, (_, _, place, members), turned in zip(
        parts.members(), parts.groups, parts.turns, strict=True
    ):
        spin, cos_phase, sin_phase = turned[:3]
        angle = pitch + (turn + np.arctan2(sin_phase, cos_phase) if spin else 0.0)
        x, z = parts.places[place : place + members].T
        arm_x, arm_z = x * np.cos(pitch) + z * np.sin(pitch), z * np.cos(pitch) - x * np.sin(pitch)
        poses = np.empty((members, 6))
        poses[:, 0], poses[:, 1], poses[:, 2] = x0 + arm_x, z0 + arm_z, angle
        poses[:, 3], poses[:, 4] = vx0 + pitch_rate * arm_z, vz0 - pitch_rate * arm_x
        poses[:, 5] = pitch_rate + spin * rate
        elements = reference_kernel.place(np.ascontiguousarray(shape[:, :5]), 1.0, poses)
        elements[..., 5] = shape[:, 5]
        result.append(elements)
    return result


def forces(
    profile: Profile, parts: Parts, state: FloatArray, turn: float, rate: float
) -> list[FloatArray]:
    """Force on every element.

    `state`: shape (6,). Returns shape (members, n, 4): For each group: force z, x (N), and where
    it acts x, z (cm).
    """
    return [
        reference_kernel.element_forces(profile, elements)
        for elements in place(parts, state, turn, rate)
    ]


def net(
    profile: Profile, parts: Parts, state: FloatArray, turn: float, rate: float
) -> tuple[float, float, float]:
    """Net force and moment.

    `state`: shape (6,). Returns `force_z`, `force_x`: N. Returns `moment`: About the centre of
    mass, from z toward x, N cm.
    """
    every = [part.reshape(-1, 4) for part in forces(profile, parts, state, turn, rate)]
    force_z, force_x, x, z = np.concatenate(every).T
    moment = (z - state[1]) * force_x - (x - state[0]) * force_z
    return float(force_z.sum()), float(force_x.sum()), float(moment.sum())


def advance(
    profile: Profile, parts: Parts, state: FloatArray, turn: float, rate: float, step: float,
    steps: int, rk4: bool = False,
) -> FloatArray:  # fmt: skip
    """Step a robot through time.

    `state`: shape (6,). `step`: s. `rk4`: The classical fourth-order method, else semi-implicit
    Euler. Returns shape (steps + 1, 6): The state before the first step and after each.
    """

    def slope(now: FloatArray, at: float) -> FloatArray:
        force_z, force_x, moment = net(profile, parts, now, at, rate)
        per_newton, per_newton_cm, gravity = parts.inertia
        return np.array(
            [*now[3:], force_x * per_newton, force_z * per_newton - gravity, moment * per_newton_cm]
        )

    path = np.empty((steps + 1, 6))
    path[0] = state
    for k in range(steps):
        now, at = path[k], turn + rate * step * k
        first = slope(now, at)
        if rk4:
            second = slope(now + step / 2 * first, at + rate * step / 2)
            third = slope(now + step / 2 * second, at + rate * step / 2)
            fourth = slope(now + step * third, at + rate * step)
            path[k + 1] = now + step / 6 * (first + 2 * second + 2 * third + fourth)
        else:
            velocity = now[3:] + step * first[3:]
            path[k + 1] = np.concatenate([now[:3] + step * velocity, velocity])
    return path
