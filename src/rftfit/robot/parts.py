"""A robot as the arrays that the time-stepper needs: groups of elements that turn together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.predict.outline import arc, polyline

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray
    from rftfit.predict.outline import Outline
    from rftfit.robot.config import Robot

    IntArray = npt.NDArray[np.int64]

NEWTON_IN_G_CM_PER_S2 = 1e5
"""One newton in g cm/s^2: forces are in N, everything that moves in g, cm and s."""


@dataclass(frozen=True)
class Parts:
    """Groups of elements with one angle each: every plate of the body, every tripod of legs.

    Parameters
    ----------
    names : tuple of str
        Of the groups: plates by their names, then ``tripod_1``, ``tripod_2``, ... by phase.
    shape : numpy.ndarray, shape (6, n)
        Elements of one member of each group, one group after the other, at angle 0 about the
        member's place, in rows: x, z (cm), unit tangent x, z, half-length (cm), area (cm^2).
    groups : numpy.ndarray of int, shape (g, 4)
        First element and elements in `shape`, first row and rows of `places`.
    turns : numpy.ndarray, shape (g, 7)
        1 where the group turns with the legs, else 0; cosine and sine of its phase; the box around
        a member at angle 0: middle x, z, half its length along x, z (cm).
    places : numpy.ndarray, shape (p, 2)
        Hips, and the centre of mass for plates: x, z (cm) in the body's frame.
    inertia : numpy.ndarray, shape (3,)
        Acceleration by 1 N (cm/s^2), angular acceleration by 1 N cm (rad/s^2), gravity (cm/s^2).
    """

    names: tuple[str, ...]
    shape: FloatArray
    groups: IntArray
    turns: FloatArray
    places: FloatArray
    inertia: FloatArray

    @property
    def elements(self) -> int:
        """Elements of the whole robot."""
        return int((self.groups[:, 1] * self.groups[:, 3]).sum())

    @property
    def reach_cm(self) -> float:
        """Largest distance of an element from the hip it turns about."""
        legs = [
            np.hypot(*rows[:, :2].T) + rows[:, 4]
            for rows, turn in zip(self.members(), self.turns, strict=True)
            if turn[0]
        ]
        return float(np.concatenate(legs).max()) if legs else 0.0

    def members(self) -> list[FloatArray]:
        """Elements (k, 6) of one member of each group, with the columns of `shape`'s rows."""
        return [self.shape[:, first : first + count].T for first, count, _, _ in self.groups]


def assemble(robot: Robot, curvature_times_R: float) -> Parts:
    """Cut a robot into elements.

    Parameters
    ----------
    robot : Robot
    curvature_times_R : float
        R'/r of the legs, from -1 (reversed) to 1 (c-legs).

    Returns
    -------
    Parts

    Raises
    ------
    ValueError
        If the curvature is out of its range.
    """
    count = robot.numerics.elements
    legs = arc(curvature_times_R, robot.legs.max_length_cm, robot.legs.width_cm, count)
    members: list[tuple[str, Outline, float, float, list[tuple[float, float]]]] = []
    for name, plate in robot.body.plates.items():
        ends = [plate.from_cm, plate.to_cm]
        members.append((name, polyline(ends, plate.width_cm, count), 0.0, 0.0, [(0.0, 0.0)]))
    phases = dict.fromkeys(hip.phase_turns for hip in robot.legs.hips)
    for number, phase in enumerate(phases, start=1):
        hips = [(hip.x_cm, hip.z_cm) for hip in robot.legs.hips if hip.phase_turns == phase]
        members.append((f"tripod_{number}", legs, 1.0, 2 * np.pi * phase, hips))
    shapes, groups, turns, places = [], [], [], []
    row = place = 0
    for _, outline, spin, phase, hips in members:
        body = outline.body
        shapes.append(np.column_stack([body, 2 * body[:, 4] * outline.width_cm]))
        groups.append((row, len(body), place, len(hips)))
        turns.append((spin, np.cos(phase), np.sin(phase), *_box(body)))
        places += hips
        row, place = row + len(body), place + len(hips)
    mass, inertia = robot.body.mass_g, robot.body.inertia_g_cm2
    return Parts(
        tuple(name for name, *_ in members),
        np.ascontiguousarray(np.concatenate(shapes).T),
        np.array(groups, dtype=np.int64),
        np.array(turns, dtype=float),
        np.array(places, dtype=float),
        np.array(
            [
                NEWTON_IN_G_CM_PER_S2 / mass,
                NEWTON_IN_G_CM_PER_S2 / inertia,
                robot.numerics.gravity_cm_per_s2,
            ]
        ),
    )


def _box(body: FloatArray) -> tuple[float, ...]:
    """Box around an outline: its middle, and half its lengths."""
    ends = np.concatenate([body[:, :2] + s * body[:, 4:5] * body[:, 2:4] for s in (-1, 1)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    # a little wider, so that rounding never leaves an element out
    return (*((low + high) / 2).tolist(), *((high - low) / 2 + 1e-9).tolist())
