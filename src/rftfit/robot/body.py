"""A robot as the arrays that the time-stepper needs, and where every element is during a run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.model.outlines import arc, polyline
from rftfit.robot import reference_kernel

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray
    from rftfit.model.outlines import Outline
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import RobotRun

    IntArray = npt.NDArray[np.int64]


# --- A robot as the arrays that the time-stepper needs: groups of elements that turn together.


NEWTON_IN_G_CM_PER_S2 = 1e5
"""One newton in g cm/s^2: forces are in N, everything that moves in g, cm and s."""


@dataclass(frozen=True)
class Parts:
    """Groups of elements with one angle each: every plate of the body, every tripod of legs.

    `names`: Of the groups: plates by their names, then ``tripod_1``, ``tripod_2``, ... by phase.
    `shape`: shape (6, n); Elements of one member of each group, one group after the other, at
        angle 0 about the member's place, in rows: x, z (cm), unit tangent x, z, half-length (cm),
        area (cm^2).
    `groups`: shape (g, 4); First element and elements in `shape`, first row and rows of `places`.
    `turns`: shape (g, 7); 1 where the group turns with the legs, else 0; cosine and sine of its
        phase; the box around a member at angle 0: middle x, z, half its length along x, z (cm).
    `places`: shape (p, 2); Hips, and the centre of mass for plates: x, z (cm) in the body's frame.
    `inertia`: shape (3,); Acceleration by 1 N (cm/s^2), angular acceleration by 1 N cm (rad/s^2),
        gravity (cm/s^2).
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

    `curvature_times_R`: R'/r of the legs, from -1 (reversed) to 1 (c-legs).
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


# --- Where every element is during a run, and the force on it: for animations (movies S5 and S6).


@dataclass(frozen=True)
class ElementSeries:
    """Elements of one group of members over time: n samples, m members, k elements each.

    `ends_x_cm`, `ends_z_cm`: shape (n, m, k, 2); The two ends of each element.
    `force_x_N`, `force_z_N`: shape (n, m, k).
    `at_x_cm`, `at_z_cm`: shape (n, m, k); Where the force acts.
    """

    ends_x_cm: FloatArray
    ends_z_cm: FloatArray
    force_x_N: FloatArray
    force_z_N: FloatArray
    at_x_cm: FloatArray
    at_z_cm: FloatArray


def element_series(
    robot: Robot, profile: Profile, run: RobotRun, every: int = 1
) -> dict[str, ElementSeries]:
    """Place all elements of a run and give the force on each.

    `profile`: Those that the run was made with. `run`: With a series. `every`: Take every so many
    of its samples. Returns by group, in the order of ``run.series.groups``.
    """
    if run.series is None:
        raise ValueError("the run was made without samples; ask for samples_per_stride")
    parts = assemble(robot, run.condition.curvature_times_R)
    rate = 2 * math.pi * run.condition.frequency_Hz
    turned = np.radians(run.series.leg_angle_deg[::every])
    samples = [
        (
            reference_kernel.place(parts, state, turn, rate),
            reference_kernel.forces(profile, parts, state, turn, rate),
        )
        for state, turn in zip(run.series.states[::every], turned, strict=True)
    ]
    result = {}
    for index, name in enumerate(parts.names):
        x, z, tx, tz, half = np.moveaxis(np.stack([s[0][index] for s in samples]), -1, 0)[:5]
        force_z, force_x, at_x, at_z = np.moveaxis(np.stack([s[1][index] for s in samples]), -1, 0)
        ends = np.array([-1.0, 1.0])
        result[name] = ElementSeries(
            x[..., None] + ends * (half * tx)[..., None],
            z[..., None] + ends * (half * tz)[..., None],
            force_x, force_z, at_x, at_z,
        )  # fmt: skip
    return result
