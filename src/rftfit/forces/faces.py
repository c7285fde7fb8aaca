"""Stress on the faces of a body in space, from a map measured in the plane, or by 3D-RFT; in plain numpy.

`rftfit.forces.face_kernel` is the compiled twin. x, y horizontal, z up; a face has its outward unit normal n
and its unit velocity v, and counts where n.v > 0 (`rftfit.forces.leading`). Force on it is alpha |z| A.

The map was measured in a vertical plane, which has one horizontal direction. A face in space has two: e, that of
its normal, and r, that of its motion. Read in the plane of e, the map is exact where v lies in that plane. Read in
the plane of r, with the part that is odd in beta turned by the angle between e and r, the map does not depend on e
where a face is level and has none. The measured law blends both by the tilt of a face: a level face has the
second reading, an upright one the first (docs/theory/space.md).

Attack angles beta and intrusion angles gamma are in rad. Stress over depth is alpha as a vector x, y, z, N/cm^3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rftfit.conventions import FloatArray, wrap_beta
from rftfit.forces.leading import share_of_face
from rftfit.forces.mesh import IntArray, Mesh, area_vectors
from rftfit.forces.rolling import NO_WHEEL, leading_speed, lies_in_track
from rftfit.model import rft3d
from rftfit.model.packs import NEGLIGIBLE
from rftfit.model.profiles import Profile, TableProfile
from rftfit.model.rft3d import dot

LAWS = ("measured", "3d-rft")
"""Laws of the stress on a face: by the whole measured map, or by 3D-RFT from alpha_z(0, 90 deg) alone."""

STEP_DEG = 5.0
"""Step of the angles of the table that is made of a profile of another form, degrees."""


def as_table(profile: Profile) -> TableProfile:
    """Return a profile as a table over all directions: a table as it is, another form read every `STEP_DEG` degrees.

    The law in space reads tables alone. A stack of draws gives a stack.
    """
    if isinstance(profile, TableProfile):
        return profile
    beta = np.radians(np.arange(-90, 91, STEP_DEG))
    gamma = np.radians(np.arange(-180, 181, STEP_DEG))
    alpha = profile.alpha(beta[:, None], gamma)
    return TableProfile.of_nodes(beta, gamma, alpha, profile.name, profile.reason)


def face_alpha(
    profile: Profile,
    normal: FloatArray,
    velocity: FloatArray,
    law: str = "measured",
    friction: float | None = None,
    normal_of_map: FloatArray | None = None,
) -> FloatArray:
    """Return the stress over depth on faces, x, y, z in N/cm^3, shape (..., 3), with leading draws of a stack.

    `normal`: outward, `velocity`: shape (..., 3), of any length above 0. `law`: one of `LAWS`. `friction`: where given,
    a normal part that pulls and a part along the face that drives it change their signs, and the part along the face is
    at most this times the normal one; None: the stress as the law gives it. `normal_of_map`: normal by which the
    measured map is read, where it is another one, shape (..., 3): so it is seen how steep the map is.
    """
    normal, velocity = (_unit(vectors) for vectors in np.broadcast_arrays(normal, velocity))
    if law == "measured":
        normal_of_map = normal if normal_of_map is None else _unit(normal_of_map)
        stress = _measured_stress(as_table(profile), normal_of_map, velocity)
    else:
        stress = np.multiply.outer(rft3d.level_of(profile), rft3d.law(normal, velocity))
    if friction is None:
        return stress
    return rft3d.turn_and_cap(stress, normal, velocity, friction)


def _measured_stress(profile: Profile, normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """Stress over depth by the measured law, with e and r as in the head of this module; unit vectors (..., 3).

    `by_normal` is the reading in the plane of e, `by_motion` that in the plane of r. Turned vectors are turned by 90
    degrees from x toward y. `normal`, `velocity`: unit vectors. Returns x, y, z, (..., 3), with leading draws of a
    stack.
    """
    # tilt: sine of the angle between the face and the level; speed: level part of the unit velocity
    tilt, e = _split_horizontal(normal)
    speed, r = _split_horizontal(velocity)
    e_turned, r_turned = (np.stack([-h[..., 1], h[..., 0]], axis=-1) for h in (e, r))
    beta = wrap_beta(np.arctan2(tilt, normal[..., 2]))
    down, along_e = -velocity[..., 2], dot(velocity[..., :2], e)

    # read in the plane of e: what moves across that plane slides along a level plate
    alpha_z, alpha_x = profile.alpha(beta, np.arctan2(down, -along_e))
    in_plane = np.hypot(along_e, down)
    alpha_x_sliding = profile.alpha(0 * beta, 0 * beta)[1]
    across = dot(velocity[..., :2], e_turned)
    level = _times(in_plane * alpha_x, e) - _times(alpha_x_sliding * across, e_turned)
    by_normal = _join_vertical(level, in_plane * alpha_z)

    # read in the plane of r: the mean of beta and -beta, and half their difference turned from r to e
    gamma = np.arctan2(down, -speed)
    (z_plus, x_plus), (z_minus, x_minus) = profile.alpha(beta, gamma), profile.alpha(-beta, gamma)
    cos_r_e, sin_r_e = dot(e, r), dot(e, r_turned)
    ahead = (x_plus + x_minus) / 2 + (x_plus - x_minus) / 2 * cos_r_e
    sideways = (x_plus - x_minus) / 2 * sin_r_e
    up = (z_plus + z_minus) / 2 + (z_plus - z_minus) / 2 * cos_r_e
    by_motion = _join_vertical(_times(ahead, r) + _times(sideways, r_turned), up)

    upright = (tilt**2)[..., None]
    # alpha without a number does not count where its share is rounding
    return np.where(upright < NEGLIGIBLE, 0.0, upright * by_normal) + np.where(
        1 - upright < NEGLIGIBLE, 0.0, (1 - upright) * by_motion
    )


def share_read_near_pushes(
    profile: TableProfile, normal: FloatArray, velocity: FloatArray
) -> FloatArray:
    """Return the share of alpha of faces that the measured law reads in directions near a push (`FAR_DEG`), shape (n,).

    From 0 to 1. Each of the four readings of `_measured_stress` (in the plane of e, across it, and in the plane of r at
    beta and at -beta) counts by its weight there. `normal`, `velocity`: shape (n, 3), of any length above 0.
    """
    tilt, e = _split_horizontal(_unit(normal))
    speed, r = _split_horizontal(_unit(velocity))
    down, along_e = -_unit(velocity)[:, 2], dot(_unit(velocity)[:, :2], e)
    beta = np.arctan2(tilt, _unit(normal)[:, 2])
    gamma_of_motion = np.arctan2(down, -speed)
    same_way = (1 + dot(e, r)) / 2
    upright, in_plane = tilt**2, along_e**2 + down**2
    # beta, gamma and weight of each reading; the weights of a face sum to 1
    readings = [
        (beta, np.arctan2(down, -along_e), upright * in_plane),
        (0 * beta, 0 * beta, upright * (1 - in_plane)),
        (beta, gamma_of_motion, (1 - upright) * same_way),
        (-beta, gamma_of_motion, (1 - upright) * (1 - same_way)),
    ]
    return np.asarray(
        sum(weight * ~profile.far_from_pushes(beta, gamma) for beta, gamma, weight in readings)
    )


def turn_normals(normals: FloatArray, degrees: float) -> FloatArray:
    """Return normals (..., 3) turned by some degrees about the axis x and about the axis y, shape (2, ..., 3)."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = np.moveaxis(normals, -1, 0)
    about_x = np.stack([x, cos * y - sin * z, cos * z + sin * y], axis=-1)
    about_y = np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=-1)
    return np.stack([about_x, about_y])


def _unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (..., 3) divided by their lengths."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _split_horizontal(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the length of the horizontal part of vectors (..., 3), and its direction, shape (..., 2).

    The direction is (1, 0) where the length is 0: what is read by it then has no weight, or does not depend on it.
    """
    length = np.hypot(vector[..., 0], vector[..., 1])
    has_length = length[..., None] > 0
    flat = np.where(has_length, vector[..., :2], [1.0, 0.0])
    return length, flat / np.where(has_length, length[..., None], 1.0)


def _join_vertical(horizontal: FloatArray, up: FloatArray) -> FloatArray:
    """Make vectors (..., 3) of their horizontal parts (..., 2) and their vertical parts (...)."""
    return np.concatenate([horizontal, up[..., None]], axis=-1)


def _times(size: FloatArray, direction: FloatArray) -> FloatArray:
    """Multiply vectors (..., k) by numbers (...)."""
    return size[..., None] * direction


def submerged_parts(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the share of the area of triangles below the surface z = 0, shape (...), and the centroid of that part (..., 3).

    `triangles`: corners by rows, shape (..., 3, 3), cm. A triangle that the surface cuts counts with its wet part, so
    that forces are continuous in height; that part is a triangle, or the whole triangle less one.
    """
    below = triangles[..., 2] < 0
    count = below.sum(axis=-1)
    # the surface cuts a small triangle off at the corner that is alone on its side: `tip`
    alone = np.where(count == 1, below.argmax(axis=-1), below.argmin(axis=-1))
    order = (alone[..., None] + np.arange(3)) % 3
    tip, *base = np.moveaxis(np.take_along_axis(triangles, order[..., None], axis=-2), -2, 0)
    is_cut = (count == 1) | (count == 2)
    # share of either edge from the tip that is cut off
    heights = (np.where(is_cut, tip[..., 2] - corner[..., 2], 1.0) for corner in base)
    first, second = (np.where(is_cut, tip[..., 2] / height, 0.0) for height in heights)
    tip_share = first * second
    tip_centre = tip + (_times(first, base[0] - tip) + _times(second, base[1] - tip)) / 3
    rest_share = np.where(tip_share < 1, 1 - tip_share, 1.0)
    rest_centre = (triangles.mean(axis=-2) - _times(tip_share, tip_centre)) / rest_share[..., None]
    # one corner below: the small triangle is wet; two: the rest is
    tip_is_wet = count == 1
    wet_share = np.where(tip_is_wet, tip_share, np.where(count == 0, 0.0, 1 - tip_share))
    return wet_share, np.where(tip_is_wet[..., None], tip_centre, rest_centre)


class LoadedFaces(NamedTuple):
    """Faces of a mesh that bear a load in a pose, n of them, in the axes of the world.

    `numbers`: their rows in `Mesh.faces`, (n,). `load_cm3`: depth times wet area that leads, (n,). `area_vectors`:
    outward normal times area, cm^2, (n, 3); of a sheet on the side that leads. `velocity`: of the centre of the wet
    part, cm/s, (n, 3). `arm_cm`: from the reference point to this centre, (n, 3).
    """

    numbers: IntArray
    load_cm3: FloatArray
    area_vectors: FloatArray
    velocity: FloatArray
    arm_cm: FloatArray


def moving_faces(mesh: Mesh, frame: FloatArray, rolling: FloatArray = NO_WHEEL) -> LoadedFaces:
    """Return the faces that bear a load in a pose: below the surface, in motion, and of a solid body those that lead.

    `frame`: a row of `Motion3D.frames`, (18,): position (cm), velocity (cm/s) and rate of turning (rad/s) of the
    reference point, and rotation matrix. `rolling`: a row of `rftfit.forces.rolling.rolling_rows`, (4,), by which some
    faces of a rolling wheel do not count; default: no wheel.
    """
    position, velocity, rate = frame[:9].reshape(3, 3)
    corners = mesh.triangles @ frame[9:].reshape(3, 3).T
    normals = area_vectors(corners)
    wet_share, centre = submerged_parts(corners + position)
    arm = centre - position
    velocities = velocity + np.cross(rate, arm)
    # speed along the outward normal, times the area
    outward = (normals * velocities).sum(axis=-1)
    if mesh.sheet:
        normals, outward = normals * np.sign(outward)[:, None], np.abs(outward)
    area = np.linalg.norm(normals, axis=-1)
    speed = np.linalg.norm(velocities, axis=-1)
    outward = leading_speed(outward, normals, rolling)
    leading_share = speed > 0 if mesh.sheet else share_of_face(outward, area * speed)
    share = wet_share * leading_share * ~lies_in_track(normals, arm, rolling)
    loaded = np.flatnonzero(share > 0)
    load = -centre[:, 2] * share * area
    return LoadedFaces(loaded, load[loaded], normals[loaded], velocities[loaded], arm[loaded])
