"""Stress on the faces of a body in space, from a map measured in the plane, or by 3D-RFT; in plain numpy.

`rftfit.forces.face_kernel` is the compiled twin. x, y horizontal, z up; a face has its outward unit normal n
and its unit velocity v, and counts where n.v > 0 (`rftfit.forces.leading`). Force on it is alpha |z| A.

The map was measured in a vertical plane, which has one horizontal direction. A face in space has two: e, that of
its normal, and r, that of its motion. Read in the plane of e, the map is exact where v lies in that plane. Read in
the plane of r, with the part that is odd in beta turned by the angle between e and r, the map does not depend on e
where a face is level and has none. The measured law blends both by the tilt of a face: a level face has the
second reading, an upright one the first.
"""

from __future__ import annotations

import numpy as np

from rftfit.conventions import FloatArray, wrap_beta
from rftfit.forces.leading import share_of_face
from rftfit.forces.mesh import IntArray, Mesh, Motion3D, area_vectors
from rftfit.forces.rolling import NO_WHEEL, leading_speed, lies_in_track
from rftfit.model import rft3d
from rftfit.model.packs import NEGLIGIBLE
from rftfit.model.profiles import Profile, TableProfile

LAWS = ("measured", "3d-rft")

STEP_DEG = 5.0
"""Step of the angles of the table that is made of a profile of another form, degrees."""


def as_table(profile: Profile) -> TableProfile:
    """Return a profile as a table over all directions: a table as it is, another form read every `STEP_DEG` degrees."""
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
) -> FloatArray:
    """Stress over depth on faces, x, y, z in N/cm^3, shape (draws, ..., 3).

    `normal`, `velocity`: shape (..., 3), of any length above 0. `friction`: where given, pulling and
    driving parts are turned, and the tangential part is at most this times the normal one.
    """
    vector_pairs = np.broadcast_arrays(np.asarray(normal, float), np.asarray(velocity, float))
    normal, velocity = (
        vectors / np.linalg.norm(vectors, axis=-1, keepdims=True) for vectors in vector_pairs
    )
    if law == "measured":
        stress = _measured_stress(as_table(profile), normal, velocity)
    else:
        stress = np.multiply.outer(rft3d.level_of(profile), rft3d.law(normal, velocity))
    if friction is None:
        return stress
    return rft3d.turn_and_cap(stress, normal, velocity, friction)


def _measured_stress(profile: Profile, normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """Stress over depth by the measured law (head of this module); `aside` and `t` are e and r turned by 90 degrees."""
    tilt, e = _split_horizontal(normal)
    speed, r = _split_horizontal(velocity)
    aside, t = (np.stack([-h[..., 1], h[..., 0]], axis=-1) for h in (e, r))
    beta = wrap_beta(np.arctan2(tilt, normal[..., 2]))
    down, along_e = -velocity[..., 2], (velocity[..., :2] * e).sum(axis=-1)

    alpha_z, alpha_x = profile.alpha(beta, np.arctan2(down, -along_e))
    in_plane = np.hypot(along_e, down)
    across = profile.alpha(0 * beta, 0 * beta)[1]  # of a level plate that moves along itself
    part_aside = (velocity[..., :2] * aside).sum(axis=-1)
    level = _times(in_plane * alpha_x, e) - _times(across * part_aside, aside)
    by_normal = _join_vertical(level, in_plane * alpha_z)

    gamma = np.arctan2(down, -speed)
    (z1, x1), (z2, x2) = profile.alpha(beta, gamma), profile.alpha(-beta, gamma)
    cos_p, sin_p = (e * r).sum(axis=-1), (e * t).sum(axis=-1)
    ahead, sideways = (x1 + x2) / 2 + (x1 - x2) / 2 * cos_p, (x1 - x2) / 2 * sin_p
    by_motion = _join_vertical(
        _times(ahead, r) + _times(sideways, t), (z1 + z2) / 2 + (z1 - z2) / 2 * cos_p
    )
    upright = (tilt**2)[..., None]
    parts = (upright, by_normal), (1 - upright, by_motion)
    return np.asarray(
        sum(np.where(share < NEGLIGIBLE, 0.0, share * alpha) for share, alpha in parts)
    )


def _split_horizontal(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Length of the horizontal part of a vector, and its direction, shape (..., 2): (1, 0) where the length is 0."""
    length = np.hypot(vector[..., 0], vector[..., 1])
    has_length = length[..., None] > 0
    flat = np.where(has_length, vector[..., :2], [1.0, 0.0])
    return length, flat / np.where(has_length, length[..., None], 1.0)


def _join_vertical(horizontal: FloatArray, up: FloatArray) -> FloatArray:
    return np.concatenate([horizontal, up[..., None]], axis=-1)


def _times(size: FloatArray, direction: FloatArray) -> FloatArray:
    return size[..., None] * direction


def submerged_parts(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of the area of triangles (..., 3, 3) below the surface, and the centroid of that part (..., 3)."""
    below = triangles[..., 2] < 0
    count = below.sum(axis=-1)
    # the surface cuts a small triangle off at the corner that is alone on its side: `tip`
    alone = np.where(count == 1, below.argmax(axis=-1), below.argmin(axis=-1))
    order = (alone[..., None] + np.arange(3)) % 3
    tip, *base_corners = np.moveaxis(
        np.take_along_axis(triangles, order[..., None], axis=-2), -2, 0
    )
    cut = (count == 1) | (count == 2)
    heights = (np.where(cut, tip[..., 2] - corner[..., 2], 1.0) for corner in base_corners)
    along_first, along_second = (np.where(cut, tip[..., 2] / height, 0.0) for height in heights)
    share = along_first * along_second
    centre = (
        tip
        + (_times(along_first, base_corners[0] - tip) + _times(along_second, base_corners[1] - tip))
        / 3
    )
    middle = triangles.mean(axis=-2)
    other_centre = (middle - _times(share, centre)) / np.where(share < 1, 1 - share, 1.0)[..., None]
    # one corner below: the small triangle is wet; two: the rest is
    wet = np.where(count == 1, share, np.where(count == 0, 0.0, 1 - share))
    return wet, np.where((count == 1)[..., None], centre, other_centre)


def moving_faces(
    mesh: Mesh, frame: FloatArray, rolling: FloatArray = NO_WHEEL
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Find the faces that bear a load in a pose: number, depth times wet area (cm^3), area vector, velocity, arm (cm).

    `frame`: a row of `Motion3D.frames`. `rolling`: a row of `rftfit.forces.rolling.rolling_rows`.
    """
    position, velocity, rate = frame[:9].reshape(3, 3)
    corners = mesh.triangles @ frame[9:].reshape(3, 3).T
    areas = area_vectors(corners)
    share, centre = submerged_parts(corners + position)
    arm = centre - position
    moves = velocity + np.cross(rate, arm)
    outward = (areas * moves).sum(axis=-1)
    if mesh.sheet:
        areas, outward = areas * np.sign(outward)[:, None], np.abs(outward)
    area = np.linalg.norm(areas, axis=-1)
    speed = np.linalg.norm(moves, axis=-1)
    outward = leading_speed(outward, areas, rolling)
    leading = speed > 0 if mesh.sheet else share_of_face(outward, area * speed)
    share = share * leading * ~lies_in_track(areas, arm, rolling)
    loaded = np.flatnonzero(share > 0)
    load = -centre[:, 2] * share * area
    return loaded, load[loaded], areas[loaded], moves[loaded], arm[loaded]


def mesh_forces(
    profile: Profile,
    mesh: Mesh,
    motion: Motion3D,
    law: str = "measured",
    friction: float | None = None,
) -> FloatArray:
    """Integrate force x, y, z (N) and moment x, y, z about the reference point (N cm), shape (..., p, 6), in plain numpy.

    Tests and a benchmark compare the compiled `rftfit.forces.space.compiled_mesh_forces` with it.
    """
    forces_of_poses = []
    for frame, rolling in zip(motion.frames, motion.rolling, strict=True):
        _, load, normal, moves, arm = moving_faces(mesh, frame, rolling)
        force = _times(load, face_alpha(profile, normal, moves, law, friction))
        of_faces = np.concatenate([force, np.cross(arm, force)], axis=-1)
        forces_of_poses.append(of_faces.sum(axis=-2))
    return np.stack(forces_of_poses, axis=-2)
