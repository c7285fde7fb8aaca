"""The model's own error: how far measured forces lie from Eq. 2 with alpha known exactly.

Eq. 2 adds up plates that do not disturb one another. Forces measured on bodies differ from that sum by

    F = F(draw) + eps H(draw, pose) g(pose)

H is the load without cancellation: hypot(G, 0.2 of the largest G of the motion), with G = hypot(sum |alpha_z| |z| dA,
sum |alpha_x| |z| dA) by the same draw of alpha. g is a unit Gaussian process over the motion (Matern 3/2), one for
each direction of the force. The errors act where the load acts, at its centre, so a moment has the error of
its forces times the arm of the centre.

A solid body in space has three directions, and faces bear little aside: there the error is eps R g with a matrix R, and
R R = S S + (0.2 of the largest G)^2, where S is the sum of f f^T / |f| over the forces f of faces.

Studies and tests of these choices: docs/theory/forces.md. Shapes: draws of alpha, p poses of a motion, n elements. A
stack of draws is a profile whose parameters have a leading axis. Angles of directions are in rad.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.forces.mesh import Mesh
from rftfit.forces.reference_kernel import WetElements
from rftfit.model.draws import SEED_OF_MODEL_ERRORS
from rftfit.model.profiles import EPS, Profile, TableProfile
from rftfit.store.chosen import chosen

if TYPE_CHECKING:
    from rftfit.forces.outlines import Outline

_CHOSEN = chosen("forces", "model_error")

LEAST_LOAD: float = _CHOSEN.least_load
"""Share of the largest G that H has at least."""

EPS_IN_SPACE: float = _CHOSEN.eps_in_space
"""Relative error eps of a solid body in space, by direction (`directed_errors`)."""

SPACE_OVER_PLANE = EPS_IN_SPACE / EPS
"""Eps of a solid in space over that of an outline, `EPS`: faces bear less in one direction than in all."""

LENGTH_DEG: float = _CHOSEN.length_deg
"""Correlation length of g over the angle that a body turns."""

LENGTH_BODIES: float = _CHOSEN.length_bodies
"""Correlation length of g over the way of the reference point, in lengths of the body."""

MOST_AT_ONCE = 2_000_000
"""Most numbers of an array that is held in memory: elements times draws times poses."""


def eps_of(
    model_error: float | None, profile: Profile, body: Outline | Mesh | None = None
) -> float:
    """Return eps, the relative error of the model over the load: `model_error`, or where that is None that of the profile.

    The errors of a solid body in space differ by direction: there the error of the profile counts `SPACE_OVER_PLANE`
    times. A profile on which no error was measured, as of nine terms, has 0, and ValueError is raised where another one
    is asked for: the error of nine terms is one of alpha, and no share of the load contains it (docs/theory/forces.md).
    """
    check_model_error(model_error)
    if has_model_error(profile):
        default = profile.model_error * (SPACE_OVER_PLANE if is_in_space(body) else 1.0)
        return default if model_error is None else float(model_error)
    if model_error:
        raise ValueError(
            f"found a model's error of {model_error:g} with {profile.name}; allowed: 0: the model's own error was measured "
            "by tables and maps, and no interval with it holds the forces of another profile"
        )
    return 0.0


def check_model_error(model_error: float | None) -> None:
    """Raise ValueError if an error of the model that is asked for is negative or not finite."""
    if model_error is not None and not 0 <= model_error < math.inf:
        raise ValueError(f"the model's error must be 0 or a positive number, found {model_error:g}")


def is_in_space(body: Outline | Mesh | None) -> bool:
    """Tell whether a body is a solid in space; a sheet has the errors of an outline."""
    return isinstance(body, Mesh) and not body.sheet


def has_model_error(profile: Profile) -> bool:
    """Tell whether the model's own error was measured on profiles of this form."""
    return not math.isnan(profile.model_error)


def larger_model_error(of_legs: float) -> float:
    """Return eps for the tables and maps of a campaign: that of its own measured legs where this is larger than `EPS`.

    `of_legs`: NaN where no leg was measured. Few legs may agree by chance, so that a smaller one is not taken.
    """
    return max(EPS, of_legs) if math.isfinite(of_legs) else EPS


@dataclass(frozen=True)
class Load:
    """Load without cancellation and its centre, by draw, in some poses of a motion or in all.

    `poses`: indices of these poses, shape (k,). `size`: H of the head of this module, N, shape (draws, k). `centre`:
    where the load acts, from the reference point, cm, shape (draws, k, axes): x, z or x, y, z, and (draws, k, 0) where
    no moment is wanted. `loaded`: 1 for each of all p poses that has any load, else 0, shape (p,): interpolated between
    the k poses, H would not be 0 where the body is in the air.
    """

    poses: npt.NDArray[np.intp]
    size: FloatArray
    centre: FloatArray
    loaded: FloatArray

    def interpolate(self, start: int, stop: int) -> Load:
        """Return the load in all poses from `start` to `stop` (exclusive), linear between those where it was calculated."""
        all_poses = np.arange(start, stop)
        last = self.poses.size - 1
        # calculated poses beside each pose; a single calculated pose stands on both sides
        right = np.searchsorted(self.poses, all_poses, side="right").clip(min(1, last), last)
        left = np.maximum(right - 1, 0)
        gap = np.maximum(self.poses[right] - self.poses[left], 1)
        share = (all_poses - self.poses[left]) / gap

        def interpolate(at_poses: FloatArray) -> FloatArray:
            """Interpolate numbers of shape (draws, k, ...)."""
            # weights along the axis of poses
            weight = share.reshape(-1, *[1] * (at_poses.ndim - 2))
            from_left = at_poses.take(left, axis=1)
            return np.asarray(from_left + weight * (at_poses.take(right, axis=1) - from_left))

        size = interpolate(self.size) * self.loaded[start:stop]
        return Load(all_poses, size, interpolate(self.centre), self.loaded[start:stop])

    def at(self, chosen: slice) -> Load:
        """Return the load in the `chosen` poses, where it was calculated in all of them: nothing is interpolated."""
        return Load(
            self.poses[chosen], self.size[:, chosen], self.centre[:, chosen], self.loaded[chosen]
        )


def size_of(load: FloatArray) -> FloatArray:
    """Return H, N, of `load`, G of the head of this module, both of shape (draws, p)."""
    largest = np.nanmax(load, axis=-1, keepdims=True, initial=0.0)
    return np.asarray(np.hypot(load, LEAST_LOAD * largest))


def outline_load(
    profile: Profile, outline: Outline, poses: FloatArray, *, with_centre: bool = True
) -> Load:
    """Calculate the load on an outline, in at most `load_poses` (chosen.toml) of its p poses (p, 6), evenly spread.

    The load changes slowly along a motion and its draws are slow to calculate, so that `Load.interpolate` fills the
    other poses. `profile`: a single one, or a stack of draws. `with_centre`: False saves time where no moment is
    wanted.
    """
    count, elements = len(poses), max(len(outline.body), 1)
    draws = len(profile.parameters[0]) if profile.parameters[0].ndim > 1 else 1
    if not count:
        return Load(np.zeros(0, int), np.zeros((draws, 0)), np.zeros((draws, 0, 2)), np.zeros(0))
    most_poses = np.clip(_CHOSEN.load_elements // elements, 25, _CHOSEN.load_poses)
    # every n-th pose and the last one
    calculated = np.append(np.arange(0, count - 1, math.ceil(count / most_poses)), count - 1)
    at_once = max(1, MOST_AT_ONCE // (draws * elements))
    sizes, centres = [], []
    for start in range(0, calculated.size, at_once):
        some_poses = poses[calculated[start : start + at_once]]
        size, centre = _load_and_centre(profile, outline, some_poses, with_centre)
        sizes.append(size)
        centres.append(centre)
    loaded = [
        _bears_load(outline, poses[start : start + _CHOSEN.load_elements])
        for start in range(0, count, _CHOSEN.load_elements)
    ]
    size, centre = size_of(np.concatenate(sizes, axis=1)), np.concatenate(centres, axis=1)
    return Load(calculated, size, centre, np.concatenate(loaded))


def _bears_load(outline: Outline, poses: FloatArray) -> FloatArray:
    """Return 1 for each pose in which an element bears a load, else 0."""
    return np.asarray((WetElements.of(outline, poses).load > 0).any(axis=-1), dtype=float)


def _load_and_centre(
    profile: Profile, outline: Outline, poses: FloatArray, with_centre: bool
) -> tuple[FloatArray, FloatArray]:
    """Return G, N, (draws, p), and the centre of the load from the reference point, x and z, cm, (draws, p, 2).

    The centre weights each element with the size of its force. Where `with_centre` is False, its shape is (draws, p,
    0).
    """
    wet = WetElements.of(outline, poses)
    wet = wet._replace(load=np.nan_to_num(wet.load))
    load, (beta, gamma) = wet.load, wet.angles
    if not with_centre and isinstance(profile, TableProfile):
        size = np.hypot(*profile.sums_of_sizes(load, beta, gamma))
        return size, np.zeros((*size.shape, 0))
    arm = np.nan_to_num(wet.arm)
    # seven digits of a load are enough; shape (p, elements, draws), so that the sums run over whole rows
    force_z, force_x = (
        np.abs(alpha).reshape(*load.shape, -1) * load[..., None].astype(np.float32)
        for alpha in _alpha_of_draws(profile, beta.ravel(), gamma.ravel())
    )
    size = np.hypot(force_z.sum(axis=1), force_x.sum(axis=1)).T.astype(float)
    if not with_centre:
        return size, np.zeros((*size.shape, 0))
    force_size = np.sqrt(force_z**2 + force_x**2)
    total = force_size.sum(axis=1)
    # p poses, n elements, d draws, c the two coordinates
    moments = np.einsum("pnd,pnc->dpc", force_size, arm.astype(np.float32), optimize=True)
    centre = moments / np.where(total > 0, total, 1.0).T[..., None]
    return size, centre.astype(float)


def _alpha_of_draws(
    profile: Profile, beta: FloatArray, gamma: FloatArray
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Return alpha_z and alpha_x of each draw in directions (n,), rad, 0 where there is none, each of shape (n, draws).

    In single precision, which is enough of a load and takes half the time.
    """
    if isinstance(profile, TableProfile):
        # alpha at the nodes of the table, (nodes, draws), then interpolated to the directions
        nodes = [np.atleast_2d(values).astype(np.float32).T.copy() for values in profile.parameters]
        z, x = (profile.interpolate_draws(alpha, beta, gamma) for alpha in nodes)
    else:
        z, x = (np.atleast_2d(alpha).astype(np.float32).T for alpha in profile.alpha(beta, gamma))
    # one NaN makes the sum NaN: only then the arrays are copied
    return (z, x) if np.isfinite(z.sum() + x.sum()) else (np.nan_to_num(z), np.nan_to_num(x))


# --- The process over the motion.


def longest(points_cm: FloatArray) -> float:
    """Return the length of a body, cm: the largest distance between two of its points (n, 2 or 3), within 0.5 %.

    It is the widest shadow of the points over many directions, which takes less time than all pairs of points.
    """
    if points_cm.shape[1] == 2:
        angle = np.pi * np.arange(_CHOSEN.directions) / _CHOSEN.directions
        directions = np.stack([np.cos(angle), np.sin(angle)])
    else:
        # evenly over half a sphere: a spiral by the golden angle
        number = np.arange(20 * _CHOSEN.directions) + 0.5
        up = number / number.size
        turn = np.pi * (1 + np.sqrt(5)) * number
        level = np.sqrt(1 - up**2)
        directions = np.stack([level * np.cos(turn), level * np.sin(turn), up])
    return float(np.ptp(points_cm @ directions, axis=0).max())


def progress(turned_rad: FloatArray, moved_cm: FloatArray, length_cm: float) -> FloatArray:
    """Return the distance of each pose along the motion, in correlation lengths of g, shape (p,).

    Errors of the model in two poses are the more alike, the nearer the poses are by this distance. `turned_rad`,
    `moved_cm`: between neighbouring poses, shape (p - 1,). A turn of `LENGTH_DEG` counts as much as a way of
    `LENGTH_BODIES` lengths of the body. `length_cm`: of the body (`longest`).
    """
    turns = np.abs(turned_rad) / math.radians(LENGTH_DEG)
    ways = moved_cm / (LENGTH_BODIES * length_cm)
    return np.concatenate([[0.0], np.cumsum(np.nan_to_num(np.hypot(turns, ways)))])


def outline_progress(outline: Outline, poses: FloatArray) -> FloatArray:
    """Calculate `progress`, shape (p,), for the poses (p, 6) of an outline: x, z, angle and their rates."""
    steps = np.diff(poses[:, :3], axis=0)
    moved = np.hypot(steps[:, 0], steps[:, 1])
    return progress(steps[:, 2], moved, longest(outline.points_cm))[: len(poses)]


def frames_progress(points_cm: FloatArray, frames: FloatArray) -> FloatArray:
    """Calculate `progress`, shape (p,), for the frames of a body in space whose points are (n, 3).

    `frames`: shape (p, 18); the first three numbers are the position, cm, the last nine the rotation matrix.
    """
    turns = frames[:, 9:].reshape(-1, 3, 3)
    # the rotation from one pose to the next by the angle a has the trace 1 + 2 cos a
    trace = np.einsum("pij,pij->p", turns[1:], turns[:-1])
    turned = np.arccos(np.clip((trace - 1) / 2, -1, 1))
    moved = np.linalg.norm(np.diff(frames[:, :3], axis=0), axis=1)
    return progress(turned, moved, longest(points_cm))[: len(frames)]


def error_paths(progress: FloatArray, draws: int, axes: int, step: int) -> Iterator[FloatArray]:
    """Draw g over the motion, `step` poses at a time: arrays of shape (draws, axes, poses), standard deviation 1.

    `progress`: distance of each pose, from the function of this name, shape (p,). `axes`: number of forces, which err
    independently. Matern 3/2 is a Markov process of its value and its rate, so any number of poses takes one pass. With
    each draw its negative is used: the draws of every pose lie evenly about 0.
    """
    if 0 < progress.size <= step:
        yield _paths_of_motion(progress.tobytes(), draws, axes)
        return
    yield from _draw_paths(progress, draws, axes, step)


# the legs of a campaign turn alike, and the draws for one of them take 0.1 s
@lru_cache(maxsize=4)
def _paths_of_motion(progress_bytes: bytes, draws: int, axes: int) -> FloatArray:
    """Draw g over all poses at once, read-only as callers share it; `progress_bytes`: the array, as a key of the cache."""
    progress = np.frombuffer(progress_bytes)
    (paths,) = _draw_paths(progress, draws, axes, progress.size)
    paths.setflags(write=False)
    return paths


def _draw_paths(progress: FloatArray, draws: int, axes: int, step: int) -> Iterator[FloatArray]:
    """Draw g as `error_paths`, without the cache: from pose to pose for half of the draws, the others are their negatives."""
    random = np.random.default_rng(SEED_OF_MODEL_ERRORS)
    # of the standard library, as scipy takes longer to import than all of this
    normal = NormalDist()
    scores = np.array([normal.inv_cdf((draw + 0.5) / draws) for draw in range(draws)])[:, None]
    half = (draws + 1) // 2
    # value and rate of change of g at the first pose, each of shape (half, axes)
    value, rate = random.standard_normal((2, half, axes))
    gaps = np.sqrt(3) * np.diff(progress)
    for start in range(0, progress.size, step):
        stop = min(start + step, progress.size)
        block = np.empty((stop - start, half, axes))
        for pose in range(start, stop):
            if pose and (gap := gaps[pose - 1]) > 0:
                value, rate = _draw_next(value, rate, float(gap), random)
            block[pose - start] = value
        antithetic = np.concatenate([block, -block], axis=1)[:, :draws]
        # each draw gets the normal score of its rank: quantiles in every pose are those of a normal, without the noise
        # of few draws
        even = np.empty_like(antithetic)
        np.put_along_axis(even, antithetic.argsort(axis=1), scores, axis=1)
        yield even.transpose(1, 2, 0)


def _draw_next(
    value: FloatArray, rate: FloatArray, gap: float, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Draw value and rate of g, each of shape (half, axes), one gap farther.

    `gap`: root of 3 times the distance in correlation lengths. The rate is in units of its standard deviation. Both go
    on by the transition matrix [[a, b], [-b, c]] of the Matern 3/2 process, a = e^-gap (1 + gap), b = e^-gap gap,
    c = e^-gap (1 - gap) (Hartikainen & Sarkka 2010), and noise that keeps their variances at 1.
    """
    fade = math.exp(-gap)
    a, b, c = fade * (1 + gap), fade * gap, fade * (1 - gap)
    # the variances stay 1: what fades of the old value and rate is drawn anew, with this covariance
    value_variance = max(1 - a * a - b * b, 0.0)
    covariance = b * (a - c)
    rate_variance = max(1 - b * b - c * c, 0.0)
    # its Cholesky root: [[value_sd, 0], [shared, rate_sd]]
    value_sd = math.sqrt(value_variance)
    shared = covariance / value_sd if value_sd > 0 else 0.0
    rate_sd = math.sqrt(max(rate_variance - shared * shared, 0.0))
    normals = random.standard_normal((2, *value.shape))
    return (
        a * value + b * rate + value_sd * normals[0],
        c * rate - b * value + shared * normals[0] + rate_sd * normals[1],
    )


def plane_errors(load: Load, paths: FloatArray, eps: float) -> tuple[FloatArray, ...]:
    """Return errors of force z, force x (N) and, where the load has a centre, the moment (N cm), of shape (draws, p).

    The error of a force is eps H g, that of the moment the moment of these errors at the centre of the load. `paths`:
    draws of g for force z and force x, shape (draws, 2, p). A load without a centre gives no error of the moment.
    """
    size = eps * load.size
    error_z, error_x = size * paths[:, 0], size * paths[:, 1]
    if not load.centre.shape[-1]:
        return error_z, error_x
    moment = load.centre[..., 1] * error_x - load.centre[..., 0] * error_z
    return error_z, error_x, moment


def space_errors(load: Load, paths: FloatArray, eps: float) -> FloatArray:
    """Return errors of force x, y, z (N) and moment x, y, z (N cm) of a body in space, shape (draws, p, 6).

    The error of a force is eps H g, equally large in all directions, as for a sheet; that of the moment acts at the
    centre of the load. `paths`: draws of g for the three forces, shape (draws, 3, p).
    """
    force = eps * load.size[..., None] * paths.transpose(0, 2, 1)
    return np.concatenate([force, np.cross(load.centre, force)], axis=-1)


def directed_errors(
    load: Load, by_direction: FloatArray, paths: FloatArray, eps: float
) -> FloatArray:
    """Return errors of a solid body, as `space_errors`, but in each direction as large as what the faces bear in it.

    `by_direction`: S (draws, p, 3, 3), N, the sum of f f^T / |f| over the forces f of faces. The errors are eps R g
    with R R = S S + (0.2 of the largest G)^2: they turn with the body. `load`, `paths`: as in `space_errors`.
    """
    # R is a function of S, so that both have the same axes (eigenvectors, in columns), along which R is diagonal
    loads, axes = np.linalg.eigh(by_direction)
    # the floor is 0.2 of the largest G; the largest H, which the load holds, is hypot(1, 0.2) of it
    largest = np.nanmax(load.size, axis=-1, keepdims=True, initial=0.0)
    floor = LEAST_LOAD / math.hypot(1.0, LEAST_LOAD) * largest * load.loaded
    sizes = np.hypot(loads, floor[..., None])
    # g along each of the axes; then the errors back in x, y, z
    along = np.einsum("dpij,dpi->dpj", axes, paths.transpose(0, 2, 1), optimize=True)
    force = eps * np.einsum("dpij,dpj->dpi", axes, sizes * along, optimize=True)
    return np.concatenate([force, np.cross(load.centre, force)], axis=-1)


def is_tested(size: float, least: float, most: float) -> bool:
    """Tell whether a length or speed lies between the least and the most on which the model's own error was tested.

    Those a few percent outside (`near` of chosen.toml) still count as tested.
    """
    near: float = _CHOSEN.near
    return least / near <= size <= near * most


def beyond_tested(length_cm: float, fastest_cm_per_s: float, eps: float) -> list[str]:
    """Say where a body leaves the sizes and speeds on which `eps`, the relative error of the model, was chosen and tested.

    `length_cm`: largest distance between two points of the body. `fastest_cm_per_s`: greatest speed of a point below
    the surface.
    """
    low, high = _CHOSEN.tested_length_cm
    limits = []
    if not is_tested(length_cm, low, high):
        limits.append(
            f"the model's own error ({eps:g}) was never tested on a body of {length_cm:.3g} cm: it is from legs and a wheel "
            f"of {low:.3g} to {high:.3g} cm"
        )
    if not is_tested(fastest_cm_per_s, 0.0, _CHOSEN.tested_speed_cm_per_s):
        limits.append(
            f"the model's own error ({eps:g}) was never tested at {fastest_cm_per_s:.3g} cm/s: it is from bodies of at most "
            f"{_CHOSEN.tested_speed_cm_per_s:.2g} cm/s"
        )
    return limits
