"""Media whose law is exact in every direction: neither on the grid of an estimate nor drawn from its prior.

A law gives the stress over depth on a face with normal n (the side that leads) that moves along v, in the plane
or in space, up last. The bilinear media have a table in the plane and no law in space.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rftfit.forces.faces import moving_faces
from rftfit.forces.reference_kernel import angles, place, submerged
from rftfit.model import rft3d
from rftfit.model.profiles import TableProfile
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.conventions import FloatArray
    from rftfit.forces.mesh import Mesh, Motion3D
    from rftfit.forces.outlines import Outline

    Stress = Callable[[FloatArray, FloatArray], FloatArray]
    Alpha = Callable[[FloatArray, FloatArray], FloatArray]

MATERIALS = {name: tuple(other for other in MEDIA if other[:5] == name[:5]) for name in MEDIA}
"""Published media of the material of each."""
SIZE = 0.4
"""alpha_z(0, 90 deg) of the laws, N/cm^3."""


@dataclass(frozen=True)
class Law:
    """An exact medium: alpha(beta, gamma) in the plane, shape (2, ...), and its law in space where it has one."""

    name: str
    alpha: Alpha
    stress: Stress | None = None
    material: tuple[str, ...] = ()
    """Published media that the estimate must not know."""


def dot(vector: FloatArray, factor: FloatArray) -> FloatArray:
    """Products of vectors along the last axis, which stays."""
    return np.asarray((vector * factor).sum(axis=-1, keepdims=True))


def stress_of_3drft(friction: float, normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """3D-RFT (Agarwal, Goldman and Kamrin 2023), turned and capped as in published codes."""
    down = np.zeros(normal.shape[-1])
    down[-1] = -1
    scale = SIZE / rft3d.law(down, down)[-1]
    return rft3d.turn_and_cap(scale * rft3d.law(normal, velocity), normal, velocity, friction)


def stress_with_friction(friction: float, normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """Pressure that depends on how a face leads, faces and moves down, and friction against its slip.

    The pressure ends like a square root where a face moves along itself; friction grows with a small slip.
    """
    leading = np.clip(dot(normal, velocity), 0, 1)
    firmness = 0.40 - 0.35 * velocity[..., -1:] - 0.25 * normal[..., -1:]
    pressure = SIZE * np.sqrt(leading) * np.maximum(firmness, 0.08)
    slip = velocity - leading * normal
    return np.asarray(-pressure * (normal + friction * slip / np.sqrt(dot(slip, slip) + 0.15**2)))


def alpha_by_stress(stress: Stress, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """alpha_z and alpha_x of a plate, N/cm^3, shape (2, ...): stress on the face that leads."""
    velocity = np.stack([-np.cos(gamma), -np.sin(gamma)], axis=-1)
    normal = np.stack([np.sin(beta), np.cos(beta)], axis=-1)
    normal = np.where(dot(normal, velocity) < 0, -normal, normal)
    x, z = np.moveaxis(stress(normal, velocity), -1, 0)
    return np.stack([z, x])


def warped_table(medium: str) -> TableProfile:
    """Table S5 of a medium at other angles, which keeps its symmetry: at published lines, bilinear between them."""
    beta, gamma = np.radians(BETA_DEG)[:, None], np.radians(GAMMA_DEG)
    moved = beta + 0.12 * np.sin(2 * beta), gamma + 0.08 * np.sin(2 * gamma)
    alpha_z, alpha_x = TableProfile.published(medium).alpha(*np.broadcast_arrays(*moved))
    return TableProfile(alpha_z, alpha_x)


def alpha_of_table(table: TableProfile, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """alpha_z and alpha_x, N/cm^3, shape (2, ...)."""
    return np.stack(table.alpha(beta, gamma))


def exact_laws() -> dict[str, Law]:
    """Media by name."""
    laws = {}
    # with a friction of 1 a medium lies farther from the known ones than their frictions allow
    families: dict[str, tuple[Callable[..., FloatArray], tuple[float, ...]]] = {
        "3D-RFT": (stress_of_3drft, (0.3, 0.6)),
        "frictional": (stress_with_friction, (0.3, 0.6, 1.0)),
    }
    for family, (function, frictions) in families.items():
        for friction in frictions:
            stress = partial(function, friction)
            name = f"{family} {friction:g}"
            laws[name] = Law(name, partial(alpha_by_stress, stress), stress)
    for medium in ("poppy_LP", "glass0.3mm_CP"):
        name = f"bilinear {medium}"
        alpha = partial(alpha_of_table, warped_table(medium))
        laws[name] = Law(name, alpha, None, MATERIALS[medium])
    return laws


def forces_in_plane(law: Law, outline: Outline, poses: FloatArray) -> FloatArray:
    """Exact force z and x on an outline, N, shape (2, poses)."""
    elements = place(outline.body, outline.width_cm, poses)
    depth_area, _ = submerged(elements, outline.solid)
    beta, gamma = angles(elements)
    alpha = law.alpha(beta, np.nan_to_num(gamma))
    return np.asarray(np.where(depth_area > 0, depth_area * alpha, 0.0).sum(axis=-1))


def forces_in_space(law: Law, mesh: Mesh, motion: Motion3D) -> FloatArray:
    """Exact force x, y, z on a mesh, N, shape (poses, 3)."""
    if law.stress is None:
        raise ValueError(f"{law.name} has no law in space")
    forces = []
    for frame in motion.frames:
        _, depth_area, areas, moves, _ = moving_faces(mesh, frame)
        normal, velocity = (
            vectors / np.linalg.norm(vectors, axis=-1, keepdims=True) for vectors in (areas, moves)
        )
        forces.append((depth_area[:, None] * law.stress(normal, velocity)).sum(axis=0))
    return np.stack(forces)
