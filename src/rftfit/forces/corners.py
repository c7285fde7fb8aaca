"""Velocities that the poses of a path do not tell: at its corners, and where its steps are too coarse.

A pose moves as the mean of the steps before and after it. At a corner the direction of motion changes by an angle that
does not shrink with the step, and the force may be far from that in either step. On a smooth path the mean is right,
and either step alone is half a step early or late; there a smooth curve through the poses tells whether they are close
enough.

Rates are arrays (p, k) over the p poses of a path: of x, z (cm/s) and the angle (rad/s) of an outline, k = 3; velocity
(3) and rate of turning (3) of a mesh, k = 6. `steps` are the rates over the step before each pose and over the step
after it, shape (2, p, k). Largest forces are those of the targets of `moving.peak_targets`: greatest of a sign, or of
either.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np
import numpy.typing as npt

from rftfit.campaign.problems import join_words
from rftfit.conventions import FloatArray
from rftfit.forces.bodies import set_in_motion
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion
from rftfit.forces.moving import BodyInMotion, ForcesByName, rates_of
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import SAME_SHARE, STEEP_DEG, PeakTarget
from rftfit.model.profiles import Profile

SHRINKS = 2**-0.5
"""Change of velocity between the steps beside a pose, over that between steps twice as long, above which the pose is a
corner: at a corner of straight lines both are the same, on a smooth path the first is half of the second."""

LEAST_CHANGE = float(np.radians(STEEP_DEG))
"""Least change of velocity at a corner, over the velocity: that of a direction by `STEEP_DEG`."""

MOST_CHANGE = 0.5
"""Greatest change of a velocity, over the velocity, that a smooth curve through poses is trusted with."""


def describe_corners(
    profile: Profile, body: Outline | Mesh, motion: Motion | Motion3D
) -> list[str]:
    """List sentences on largest forces that depend on velocities that a path does not tell; none for any other motion.

    The forces are calculated again with the velocity of either step at each corner, and with those of a smooth curve
    through the poses between corners. A peak that differs by more than `SAME_SHARE` is named.
    """
    steps = motion.rates_of_steps
    if steps is None or not np.isfinite(steps).all():
        return []
    moving = set_in_motion(body, motion)
    best = moving.best(profile).forces
    is_corner = _find_corners(moving, steps)

    def forces_at(rates: FloatArray) -> ForcesByName:
        """Integrate the forces in the same poses at other rates."""
        return set_in_motion(body, motion.at_rates(rates)).best(profile).forces

    sentences = []
    rates = rates_of(moving.poses)
    if is_corner.any():
        by_steps = [forces_at(np.where(is_corner[:, None], of_step, rates)) for of_step in steps]
        poses, changes = _describe_changes(moving, best, by_steps, "by the steps alone")
        if changes:
            sentences.append(
                f"the path has a corner near {poses}, where a pose moves as the mean of the steps "
                f"beside it: {changes}; quote the larger, or put a pose shortly before and after it; if the path is "
                "smooth there, write more poses"
            )
    smooth = [forces_at(_smooth_rates(moving, steps, is_corner))]
    source = "by a smooth curve through the poses"
    poses, changes = _describe_changes(moving, best, smooth, source)
    if changes:
        sentences.append(
            f"the steps of the path are too coarse near {poses}: {changes}; write more poses"
        )
    return sentences


def _find_corners(moving: BodyInMotion, steps: FloatArray) -> npt.NDArray[np.bool_]:
    """Tell which poses of a path are corners, shape (p,); `steps`: `rates_of_steps`, shape (2, p, k).

    A corner stays as sharp when every second pose is left out, a bend of a smooth path does not: the change between
    single steps is compared with that between steps twice as long. `moving`: the body on its path.
    """
    # the first column of a path is its time
    duration_s = np.diff(moving.positions)[:, None]
    ways = steps[1, :-1] * duration_s
    # rates over two steps together, beside the same pose; beside the ends of the path they are those of single steps
    of_two = (ways[:-1] + ways[1:]) / (duration_s[:-1] + duration_s[1:])
    before = np.concatenate([steps[0, :2], of_two])
    after = np.concatenate([of_two, steps[1, -2:]])
    change = _relative_change(moving, *steps)
    change_of_two = _relative_change(moving, before, after)
    return (change > LEAST_CHANGE) & (change > SHRINKS * change_of_two)


def _smooth_rates(
    moving: BodyInMotion, steps: FloatArray, is_corner: npt.NDArray[np.bool_]
) -> FloatArray:
    """Return the rates of cubic curves through the poses between corners, shape (p, k).

    The motion's own rates are kept at corners, between corners with fewer than four poses from one to the other, and
    where a curve is far from them (`MOST_CHANGE`). `steps`: rates over the steps beside each pose. `is_corner`: shape
    (p,).
    """
    from scipy.interpolate import CubicSpline

    rates, time_s = rates_of(moving.poses), moving.positions
    ways = steps[1, :-1] * np.diff(time_s)[:, None]
    coordinates = np.concatenate([np.zeros((1, rates.shape[1])), np.cumsum(ways, axis=0)])
    curved = rates.copy()
    ends = [0, *np.flatnonzero(is_corner), len(rates) - 1]
    for first, last in pairwise(ends):
        if last - first >= 3:
            poses = slice(first, last + 1)
            curve = CubicSpline(time_s[poses], coordinates[poses])
            curved[poses] = curve(time_s[poses], 1)
    is_kept = is_corner | (_relative_change(moving, rates, curved) > MOST_CHANGE)
    return np.where(is_kept[:, None], rates, curved)


def _relative_change(
    moving: BodyInMotion, rates: FloatArray, other_rates: FloatArray
) -> FloatArray:
    """Return the change of the velocities of a body between rates (p, k), over the larger velocity, shape (p,); 0 at rest.

    Velocities are root mean squares over the corners of the box around the body, so that no choice of the reference
    point matters, and turning and travel count in one unit. `rates`, `other_rates`: in the same poses.
    """
    points_cm = moving.points_cm
    change, size, other_size = np.zeros((3, len(rates)))
    for corner in product(*zip(points_cm.min(axis=0), points_cm.max(axis=0), strict=True)):
        velocity = _velocity_of_point(np.array(corner), moving.poses, rates)
        other = _velocity_of_point(np.array(corner), moving.poses, other_rates)
        change += ((velocity - other) ** 2).sum(axis=-1)
        size += (velocity**2).sum(axis=-1)
        other_size += (other**2).sum(axis=-1)
    larger = np.maximum(size, other_size)
    return np.sqrt(np.divide(change, larger, where=larger > 0, out=np.zeros_like(larger)))


def _velocity_of_point(point_cm: FloatArray, poses: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the velocity of a point of a body in each pose at given rates (p, k), cm/s, shape (p, 2 or 3).

    `point_cm`: in the axes of the body, x, z or x, y, z. `poses`: as in `BodyInMotion`, whose own rates are not used.
    """
    if point_cm.size == 3:
        arm = poses[:, 9:].reshape(-1, 3, 3) @ point_cm
        return np.asarray(rates[:, :3] + np.cross(rates[:, 3:], arm))
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, z = point_cm
    # an angle from z toward x
    turning = np.stack([cos * z - sin * x, -cos * x - sin * z], axis=-1)
    return np.asarray(rates[:, :2] + rates[:, 2:] * turning)


def _describe_changes(
    moving: BodyInMotion, best: ForcesByName, others: Sequence[ForcesByName], source: str
) -> tuple[str, str]:
    """Say in which poses, and by how much, largest forces differ by more than `SAME_SHARE`: two texts.

    The second is empty where none differs. `best`: forces of the motion, shape (p,) by column. `others`: forces in the
    same poses at other velocities, of which the larger counts. `source`: of these, in words.
    """
    numbers_of_poses, changes = [], []
    for target in moving.peak_targets(best):
        size, pose = _largest(target, best)
        other_size, other_pose = max(_largest(target, forces) for forces in others)
        if abs(other_size - size) <= SAME_SHARE * _largest_of_kind(target, best):
            continue
        numbers_of_poses.append(pose if size > other_size else other_pose)
        # force_z_N: name "force z", unit ""; moment_N_cm: name "moment", unit " cm", both behind N
        name, _, unit = target.quantity.replace("_", " ").partition(" N")
        changes.append(
            f"the largest {name} has {target.sign * size:.4g} N{unit} in the table and "
            f"{target.sign * other_size:.4g} {source}"
        )
    positions = dict.fromkeys(f"{moving.positions[pose]:g}" for pose in numbers_of_poses)
    return f"{next(iter(moving.columns))} {join_words(positions)}", "; ".join(changes)


def _largest_of_kind(target: PeakTarget, forces: ForcesByName) -> float:
    """Return the largest of all forces where the peak is a force, else of all moments; infinite where all are 0.

    Changes are judged by it, so that a force that is small beside the others gives no sentence.
    """
    kind = target.quantity.partition("_")[0]
    sizes = [np.abs(forces[name]) for name in forces if name.startswith(kind)]
    return float(np.nanmax(sizes, initial=0.0)) or np.inf


def _largest(target: PeakTarget, forces: ForcesByName) -> tuple[float, int]:
    """Return the size of the largest force of the peak's sign, and the index of its pose.

    The size is 0 where no pose has this sign. `forces`: shape (p,) by column; poses without a number do not count.
    """
    sizes: FloatArray = np.nan_to_num(target.sign * forces[target.quantity])
    return float(sizes.max(initial=0.0)), int(sizes.argmax())
