"""Elements of an outline in its poses and forces on them, in numpy; `rftfit.model.kernel` is the compiled twin.

Tests compare both. Draws and pictures use this module, where speed does not matter. Elements are arrays (..., 8):
centre x, z (cm), unit tangent x, z, half-length (cm), area (cm^2), velocity x, z (cm/s); of p poses of an outline of n
elements (p, n, 8). Poses are arrays (p, 6): x, z of the reference point (cm, z = 0 is the surface), angle (rad, from z
toward x) and their rates. The load of an element is depth times wet area, cm^3; alpha (N/cm^3) times it is the force of
the medium on the element (Eq. 2 of the paper).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rftfit.conventions import FloatArray, intrusion_angle, wrap_beta
from rftfit.forces.leading import share_of_face
from rftfit.forces.outlines import Outline
from rftfit.model.profiles import Profile


def place(body: FloatArray, width_cm: float, poses: FloatArray) -> FloatArray:
    """Return the elements of an outline in each pose, shape (p, n, 8), with the columns of the head of this module.

    `body`: centre x, z, unit tangent x, z and half-length of the elements at angle 0, shape (n, 5). `width_cm`: across
    the plane. `poses`: shape (p, 6). A point (x, z) turns to (x cos + z sin, z cos - x sin).
    """
    # of each pose as a column, which broadcasts over the elements
    x0, z0, angle, vx0, vz0, rate = (poses[:, index, None] for index in range(6))
    cos_a, sin_a = np.cos(angle), np.sin(angle)
    x, z = body[:, 0] * cos_a + body[:, 1] * sin_a, body[:, 1] * cos_a - body[:, 0] * sin_a
    tx, tz = body[:, 2] * cos_a + body[:, 3] * sin_a, body[:, 3] * cos_a - body[:, 2] * sin_a
    half = np.broadcast_to(body[:, 4], x.shape)
    columns = (x0 + x, z0 + z, tx, tz, half, 2 * half * width_cm, vx0 + rate * z, vz0 - rate * x)
    return np.stack(columns, axis=-1)


def submerged(elements: FloatArray, solid: bool = False) -> tuple[FloatArray, FloatArray]:
    """Return the load (cm^3) of elements (..., 8), shape (...), and the centre x, z (cm) of their wet parts, (..., 2).

    An element that crosses the surface counts with its lower part, that part's area and centre, so that
    the load is continuous in height. The load is 0 above the surface and without velocity. `solid`: only
    elements that move outward, to the right of their tangent, count (`rftfit.forces.leading`).
    """
    x, z, tx, tz, half, area, vx, vz = np.moveaxis(elements, -1, 0)
    # half the height that an element spans
    rise = half * np.abs(tz)
    # depths of the lower and of the upper end
    low, high = rise - z, -rise - z
    crossing = (low > 0) & (high < 0)
    wet_share = np.where(crossing, low / np.where(crossing, 2 * rise, 1.0), 1.0)
    # mean depth of the wet part times its area
    load = np.where(crossing, low / 2, -z) * wet_share * area
    speed = np.hypot(vx, vz)
    idle = (low <= 0) | (speed == 0)
    # the normal is (tz, -tx), to the right of the tangent
    if solid:
        load = load * share_of_face(vx * tz - vz * tx, speed)
    # from the centre of the element to that of its wet part, along the tangent
    along = -np.where(tz > 0, 1.0, -1.0) * half * (1 - wet_share)
    centre = np.stack([x + along * tx, z + along * tz], axis=-1)
    return np.where(idle, 0.0, load), centre


def angles(elements: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the attack angle beta and the intrusion angle gamma (rad) of elements (..., 8); gamma is NaN without velocity."""
    beta = wrap_beta(np.arctan2(-elements[..., 3], elements[..., 2]))
    return beta, intrusion_angle(elements[..., 6], elements[..., 7])


class WetElements(NamedTuple):
    """Elements of an outline in its poses, and what of them lies below the surface.

    `elements`: shape (p, n, 8). `load`: depth times wet area, cm^3, shape (p, n). `centre`: x, z of the wet part, cm,
    shape (p, n, 2). `reference`: x, z of the reference point, cm, shape (p, 1, 2).
    """

    elements: FloatArray
    load: FloatArray
    centre: FloatArray
    reference: FloatArray

    @classmethod
    def of(cls, outline: Outline, poses: FloatArray) -> WetElements:
        """Place an outline in poses (p, 6), and find what lies below the surface."""
        elements = place(outline.body, outline.width_cm, poses)
        return cls(elements, *submerged(elements, outline.solid), poses[:, None, :2])

    @property
    def arm(self) -> FloatArray:
        """Vector from the reference point to the centre of each wet part, x, z (cm), shape (p, n, 2)."""
        return self.centre - self.reference

    @property
    def angles(self) -> tuple[FloatArray, FloatArray]:
        """Attack and intrusion angle (rad) of each element, each (p, n); 0 where an element bears nothing.

        Its own angles could be such that alpha has no number, which would make the sum over elements NaN.
        """
        beta, gamma = (np.where(self.load == 0, 0.0, angle) for angle in angles(self.elements))
        return beta, gamma


def element_forces(profile: Profile, elements: FloatArray, solid: bool = False) -> FloatArray:
    """Return the force z, x (N) on elements (..., 8), and the point x, z (cm) where it acts: shape (..., 4)."""
    load, centre = submerged(elements, solid)
    alpha = np.stack(profile.alpha(*angles(elements)), axis=-1)
    force = np.where(load[..., None] == 0, 0.0, load[..., None] * alpha)
    return np.concatenate([force, centre], axis=-1)


def net(forces: FloatArray, x0: FloatArray, z0: FloatArray) -> FloatArray:
    """Return sums of `element_forces` (..., n, 4): force z, x (N) and moment about (x0, z0) (N cm), shape (..., 3).

    The moment is positive from z toward x. `x0`, `z0`: cm, shape (...).
    """
    force_z, force_x, x, z = np.moveaxis(forces, -1, 0)
    moment = (z - z0[..., None]) * force_x - (x - x0[..., None]) * force_z
    return np.stack([force_z.sum(-1), force_x.sum(-1), moment.sum(-1)], axis=-1)


def pose_forces(
    profile: Profile, body: FloatArray, width_cm: float, solid: bool, poses: FloatArray
) -> FloatArray:
    """Return the force z, x (N) and the moment about the reference point (N cm) in each pose, shape (p, 3).

    Arguments as in `place` and `submerged`.
    """
    forces = element_forces(profile, place(body, width_cm, poses), solid)
    return net(forces, poses[:, 0], poses[:, 1])
