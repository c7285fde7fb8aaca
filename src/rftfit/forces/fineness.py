"""How finely a body that turns is cut: until shorter edges change no peak.

A part of a body moves as its middle does. Where the body is not turned that is exact; where it turns, the velocity
differs along a long part, and its force is wrong: a box of 12 triangles by a factor.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cache
from typing import NamedTuple, TypeVar, cast

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.forces import reference_kernel
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import forces_on
from rftfit.forces.space import compiled_mesh_forces
from rftfit.model.profiles import Profile, published_medium

Body = TypeVar("Body", bound=Outline | Mesh)

CHANGE = 0.01
"""Largest change of a peak that edges a quarter as long may make: the error is then below 2 %, as it falls with the length.

Of a force over the largest sum of the sizes of the forces on all parts, of a moment over the largest moment."""

CHANGE_OF_WHEEL = 0.015
"""The same of a rolling wheel: its flat facets stand for a round rim, and to halve them brings them no nearer to it."""

_POSES = 24
"""Poses in which forces are compared: evenly chosen from those that turn below the surface."""

_MOST_PARTS = 200_000
"""Most parts of a body that is cut to compare: 27 MB."""


def fine_enough(
    body: Body, motion: Motion | Motion3D, law: str = "measured", friction: float | None = None
) -> Body:
    """Halve the longest edges of a body until edges a quarter as long change no peak by more than `CHANGE`.

    The forces compared are those of one published table: the directions in which parts move decide, not the strength of the
    medium. A body that does not turn is returned as it is.
    """
    compared = _poses_that_turn(body, motion)
    if compared is None:
        return body
    forces = _find_forces(body, compared, law, friction)
    rolls = isinstance(compared, Motion3D) and compared.rolling.any()
    allowed = CHANGE_OF_WHEEL if rolls else CHANGE
    longest_cm = _longest_wet_edge(body, compared)
    while longest_cm > 0 and _count_parts(body, longest_cm / 4) <= _MOST_PARTS:
        finer_forces = _find_forces(body.refined(longest_cm / 4), compared, law, friction)
        if _largest_change(forces, finer_forces) <= allowed:
            break
        longest_cm /= 2
        body = cast("Body", body.refined(longest_cm))
        forces = _find_forces(body, compared, law, friction)
    return body


def _poses_that_turn(body: Outline | Mesh, motion: Motion | Motion3D) -> Motion | Motion3D | None:
    """Take a few of the poses in which a body turns and reaches below the surface; None where there is none."""
    if isinstance(motion, Motion3D):
        frames = motion.frames
        turns = frames[:, 6:9].any(axis=1)
        lowest_cm = frames[:, 2] + (_box_corners(body.points_cm) @ frames[:, 15:].T).min(axis=0)
    else:
        frames = motion.poses
        turns = frames[:, 5] != 0
        x, z = _box_corners(body.points_cm).T[..., None]
        angle = frames[:, 2]
        lowest_cm = (frames[:, 1] + z * np.cos(angle) - x * np.sin(angle)).min(axis=0)
    chosen = np.flatnonzero(turns & (lowest_cm < 0) & np.isfinite(frames).all(axis=1))
    if not chosen.size:
        return None
    chosen = chosen[np.unique(np.linspace(0, chosen.size - 1, _POSES).round().astype(int))]
    if isinstance(motion, Motion):
        return replace(motion, poses=frames[chosen])
    few_poses = copy(motion)
    few_poses.frames, few_poses.rolling = frames[chosen], motion.rolling[chosen]
    return few_poses


def _longest_wet_edge(body: Outline | Mesh, motion: Motion | Motion3D) -> float:
    """Longest edge of the parts that reach below the surface in some pose, cm."""
    if isinstance(body, Mesh):
        assert isinstance(motion, Motion3D)
        heights = (frame[2] + body.triangles @ frame[15:] for frame in motion.frames)
        is_wet = np.any([height.min(axis=1) < 0 for height in heights], axis=0)
    else:
        assert isinstance(motion, Motion)
        elements = reference_kernel.place(body.body, body.width_cm, motion.poses)
        height, along_z, half_cm = elements[..., 1], elements[..., 3], elements[..., 4]
        is_wet = (height - half_cm * np.abs(along_z) < 0).any(axis=0)
    return float(body.edges_cm[is_wet].max(initial=0.0))


def _count_parts(body: Outline | Mesh, longest_cm: float) -> float:
    """About how many parts a body has whose edges are at most so long."""
    pieces_of_edge = np.maximum(1.0, body.edges_cm / longest_cm)
    return float((pieces_of_edge**2 if isinstance(body, Mesh) else pieces_of_edge).sum())


def _box_corners(points_cm: FloatArray) -> FloatArray:
    """Corners of the box that holds points (n, 2 or 3), along the axes."""
    ends = np.stack([points_cm.min(axis=0), points_cm.max(axis=0)])
    return np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, ends.shape[1])


class _Forces(NamedTuple):
    """Forces and moments by pose, shape (p, components), and the largest of each that counts."""

    forces: FloatArray
    moments: FloatArray
    largest_force: float
    largest_moment: float


def _find_forces(
    body: Outline | Mesh, motion: Motion | Motion3D, law: str, friction: float | None
) -> _Forces:
    """Forces of the tried medium."""
    profile = _tried_medium()
    if isinstance(body, Mesh):
        assert isinstance(motion, Motion3D)
        sums = compiled_mesh_forces(profile, body, motion, law, friction)
        forces, moments, sizes = sums[:, :3], sums[:, 3:6], sums[:, 9]
    else:
        assert isinstance(motion, Motion)
        net = forces_on(profile, body, motion.poses)
        forces, moments = np.stack([net.force_z_N, net.force_x_N], 1), net.moment_N_cm[:, None]
        sizes = np.hypot(*forces.T)
    return _Forces(forces, moments, float(sizes.max()), float(np.abs(moments).max()))


@cache
def _tried_medium() -> Profile:
    return published_medium("poppy_LP")


def _largest_change(coarse: _Forces, fine: _Forces) -> float:
    """Largest change of a peak of either sign, over what counts of forces and of moments."""
    compared = [
        (coarse.forces, fine.forces, fine.largest_force),
        (coarse.moments, fine.moments, fine.largest_moment),
    ]
    changes = [
        np.abs(end(coarse_components, axis=0) - end(fine_components, axis=0)).max() / largest
        for coarse_components, fine_components, largest in compared
        for end in (np.min, np.max)
        if largest > 0
    ]
    return float(max(changes, default=0.0))
