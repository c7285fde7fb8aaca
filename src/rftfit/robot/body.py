"""Conversion of a robot into arrays of plates and legs (`Parts`) for the time-stepper of `rftfit.model.kernel`.

Frame of the body: origin at the centre of mass, x forward, z up, cm. Angles are positive from z toward x, as theta of a
leg: a positive pitch is nose down. An element is a short straight piece of a plate or leg.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.forces.outlines import Outline, arc, polyline
from rftfit.forces.reference_kernel import place
from rftfit.robot.config import Robot

IntArray = npt.NDArray[np.int64]


NEWTON_IN_G_CM_PER_S2 = 1e5
"""One newton in g cm/s^2: forces are in N, masses and motions in g, cm and s."""


@dataclass(frozen=True)
class Parts:
    """Members of a robot (its plates and legs), in groups whose members have the same shape and always the same angle.

    Each plate is a group of one member; then come the legs, one group for each phase: ``tripod_1``, ``tripod_2``, ...

    `names`: names of the groups: those of the plates, then of the tripods.
    `bodies`: shape (groups, n, 5); the n elements of one member of each group, relative to the point about which it
        turns, with the body level and legs of phase 0 hanging down: centre x, z (cm), unit tangent x, z, half-length (cm).
    `widths_cm`: shape (groups,); width of a member across the plane.
    `group`: shape (members,); index of the group of each member.
    `hips`: shape (members, 3); point about which each member turns, in the frame of the body: x, z (cm; the centre of
        mass for plates); then 1 if the member turns with the legs, else 0.
    `inertia`: acceleration by 1 N (cm/s^2), angular acceleration by 1 N cm (rad/s^2), gravity (cm/s^2).
    """

    names: tuple[str, ...]
    bodies: FloatArray
    widths_cm: FloatArray
    group: IntArray
    hips: FloatArray
    inertia: FloatArray

    @property
    def plates(self) -> FloatArray:
        """Elements (k, 5) of all plates of the body, in its frame; columns as in `bodies`."""
        plates: FloatArray = self.bodies[self.group[self.hips[:, 2] == 0]]
        return plates.reshape(-1, 5)

    @property
    def reach_cm(self) -> float:
        """Largest distance of a point of a leg from its hip, which gives the speed of its tip; 0 without legs."""
        legs = self.bodies[self.group[self.hips[:, 2] != 0]].reshape(-1, 5)
        # of an element: distance of its centre, and half its length, as if it lay along the radius
        return float((np.hypot(legs[:, 0], legs[:, 1]) + legs[:, 4]).max(initial=0.0))

    def place(self, state: FloatArray, turn: float, rate: float) -> list[FloatArray]:
        """Return the elements of each group in space at one moment: a list of arrays (members of the group, n, 8).

        Columns as for `rftfit.forces.reference_kernel`: centre x, z (cm, z = 0 at the surface), unit tangent x, z,
        half-length (cm), area (cm^2), velocity x, z (cm/s).

        `state`: shape (6,): x, z of the centre of mass (cm), pitch (rad, nose down), and their rates per second.
        `turn`, `rate`: angle and angular velocity of the legs of phase 0 relative to the body, rad and rad/s.
        """
        x0, z0, pitch, vx0, vz0, spin = state
        groups = []
        for index, (body, width_cm) in enumerate(zip(self.bodies, self.widths_cm, strict=True)):
            # `turns`: 1 for a leg, 0 for a plate
            x, z, turns = self.hips[self.group == index].T
            # arm from the centre of mass to the hip, turned by the pitch from z toward x
            x, z = x * np.cos(pitch) + z * np.sin(pitch), z * np.cos(pitch) - x * np.sin(pitch)
            # pose and rates of each member; the velocity of its hip is that of the body and of the pitch about it
            angle, angle_rate = pitch + turns * turn, spin + turns * rate
            poses = (x0 + x, z0 + z, angle, vx0 + spin * z, vz0 - spin * x, angle_rate)
            groups.append(place(body, width_cm, np.stack(poses, axis=-1)))
        return groups


def assemble(robot: Robot, curvature_times_R: float) -> Parts:
    """Cut a robot into elements, and put plates and legs into groups.

    `curvature_times_R`: R'/r, half of the legs' length from hip to tip over their radius; from -1 (half circles with
    the concave side leading, reversed c-legs) over 0 (flat) to 1 (c-legs).
    """
    count = robot.numerics.elements
    legs = arc(curvature_times_R, robot.legs.max_length_cm, robot.legs.width_cm, count)
    # for each group: name, shape, angle of the legs' phase (rad), and rows of `Parts.hips` of its members
    groups: list[tuple[str, Outline, float, list[tuple[float, float, float]]]] = []
    for name, plate in robot.body.plates.items():
        outline = polyline([plate.from_cm, plate.to_cm], plate.width_cm, count)
        groups.append((name, outline, 0.0, [(0.0, 0.0, 0.0)]))
    # every phase once, in the order of the file
    phases = dict.fromkeys(hip.phase_turns for hip in robot.legs.hips)
    for number, phase in enumerate(phases, start=1):
        hips = [(hip.x_cm, hip.z_cm, 1.0) for hip in robot.legs.hips if hip.phase_turns == phase]
        groups.append((f"tripod_{number}", legs, 2 * np.pi * phase, hips))
    # shapes (1, n, 8), turned by their phase at the origin; of the eight columns, area and velocity follow later
    bodies = [
        place(outline.body, outline.width_cm, np.array([[0.0, 0.0, angle, 0.0, 0.0, 0.0]]))
        for _, outline, angle, _ in groups
    ]
    per_newton = NEWTON_IN_G_CM_PER_S2 / np.array([robot.body.mass_g, robot.body.inertia_g_cm2])
    return Parts(
        tuple(name for name, *_ in groups),
        np.ascontiguousarray(np.concatenate(bodies)[..., :5]),
        np.array([outline.width_cm for _, outline, *_ in groups]),
        np.repeat(np.arange(len(groups)), [len(hips) for *_, hips in groups]),
        np.concatenate([hips for *_, hips in groups]),
        np.append(per_newton, robot.numerics.gravity_cm_per_s2),
    )
