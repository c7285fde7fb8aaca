"""Forces of a profile on an outline in the plane; one profile, or a stack of draws.

Poses are arrays (p, 6): x, z of the reference point (cm, z = 0 at the surface), angle (rad, from z toward x) and their
rates (per s). A stack of draws is a profile whose parameters have a leading axis: alpha drawn within its errors.
Elements are the short straight pieces of an outline; the load of an element is depth times wet area, cm^3, 0 above the
surface.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.forces import reference_kernel
from rftfit.forces.body_error import pose_states
from rftfit.forces.model_error import MOST_AT_ONCE, outline_load, outline_progress, plane_errors
from rftfit.forces.motion import Motion
from rftfit.forces.moving import BestForces, BodyInMotion, DrawnForces, ForcesByName, WetParts
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import STEEP_DEG, BoundsByName, Peak, PeakTarget
from rftfit.forces.reference_kernel import WetElements
from rftfit.model.compiling import is_worth_compiling
from rftfit.model.profiles import Profile, TableProfile, weighted_sum

QUANTITIES = ("force_z_N", "force_x_N", "moment_N_cm")
"""Columns of the forces and the moment on an outline."""


@dataclass(frozen=True)
class Forces:
    """Net force and moment on an outline by pose, shape (..., p); leading axes are draws.

    Forces are positive up and toward +x. The moment is about the reference point (a leg's axle), positive
    from z toward x: in the sense of the angle, so that moment times the angle's rate is power. `reason`: why
    some numbers are NaN; empty where none is, and of draws.
    """

    force_z_N: FloatArray
    force_x_N: FloatArray
    moment_N_cm: FloatArray
    reason: str = ""

    def by_name(self) -> ForcesByName:
        """Forces and moment by the name of their column."""
        return {name: getattr(self, name) for name in QUANTITIES}


def forces_on(profile: Profile, outline: Outline, poses: FloatArray) -> Forces:
    """Integrate the forces of one profile over an outline in each pose (Eq. 2); `poses`: those of a `Motion`, shape (p, 6).

    Many elements are summed by the compiled kernel, few in numpy, which is then faster: both give the same numbers.
    """
    poses = _check_poses(poses)
    body, width_cm, solid = outline.body, outline.width_cm, outline.solid
    if is_worth_compiling(len(poses) * len(body)):
        from rftfit.model.kernel import pose_forces

        net = pose_forces(profile.pack, body, width_cm, solid, poses)
    else:
        net = reference_kernel.pose_forces(profile, body, width_cm, solid, poses)
    force_z, force_x, moment = net.T.copy()
    reason = ""
    if not np.isfinite(net).all():
        reason = profile.reason or "a position, angle or velocity is missing"
    return Forces(force_z, force_x, moment, reason)


def force_draws(
    profile: Profile, outline: Outline, poses: FloatArray, *, with_moment: bool = True
) -> Forces:
    """Integrate the forces over an outline in each pose (p, 6), by each of a stack of draws of alpha.

    `with_moment`: False saves time, and the moment is NaN. Every profile is linear in its parameters (the alpha of its
    nodes, or its coefficients): the geometry gives the weight of each parameter in each pose once, all draws are then
    one matrix product. Returns arrays of shape (draws, p).
    """
    poses = _check_poses(poses)
    values_z, values_x = profile.parameters
    # weights are calculated of some poses at a time, because of memory
    per_pose = max(1, len(outline.body) * max(values_z.shape[-1], values_x.shape[-1]))
    step = max(1, MOST_AT_ONCE // per_pose)
    weights_of_parts = [
        _weights(profile, outline, poses[start : start + step])
        for start in range(0, len(poses), step)
    ]
    weights_z, weights_x = (
        np.concatenate(weights, axis=1) for weights in zip(*weights_of_parts, strict=True)
    )
    # 0: weights of the force, 1: with the arm x, 2: with the arm z
    force_z, force_x = weighted_sum(values_z, weights_z[0]), weighted_sum(values_x, weights_x[0])
    if with_moment:
        moment = weighted_sum(values_x, weights_x[2]) - weighted_sum(values_z, weights_z[1])
    else:
        moment = np.broadcast_to(np.nan, force_z.shape)
    return Forces(force_z, force_x, moment)


def _weights(
    profile: Profile, outline: Outline, poses: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the weights of the parameters of alpha_z and of alpha_x in three sums, each of shape (3, p, parameters).

    The sums are over elements: of the force, of the force times the arm x, and of the force times the arm z. Weights
    are in cm^3 and cm^4: a sum of parameters (N/cm^3) with them is in N and N cm.
    """
    wet = WetElements.of(outline, poses)
    arm_x, arm_z = np.moveaxis(wet.arm, -1, 0)
    return profile.weights_in_sums(
        wet.load * np.stack([np.ones_like(arm_x), arm_x, arm_z]), *wet.angles
    )


def _check_poses(poses: FloatArray) -> FloatArray:
    """Return poses as one block of numbers; raises ValueError where their shape is not (p, 6)."""
    poses = np.ascontiguousarray(poses, dtype=float)
    if poses.ndim != 2 or poses.shape[1] != 6:
        raise ValueError(f"poses of shape (p, 6) wanted, found {poses.shape}")
    return poses


PEAKS = (
    PeakTarget("lift", "force_z_N", 1),
    PeakTarget("suction", "force_z_N", -1),
    PeakTarget("thrust", "force_x_N", 1),
    PeakTarget("drag", "force_x_N", -1),
    PeakTarget("moment", "moment_N_cm", 1),
    PeakTarget("moment_negative", "moment_N_cm", -1),
)
"""Peaks of the forces on an outline."""


class OutlineInMotion(BodyInMotion):
    """An outline that moves in the plane; `with_interval`: those of `QUANTITIES` that get an interval."""

    force_names = QUANTITIES[:2]

    def __init__(
        self, outline: Outline, motion: Motion, with_interval: Sequence[str] = QUANTITIES
    ) -> None:
        self.outline, self.motion, self.with_interval = outline, motion, tuple(with_interval)
        self.poses, self.columns = motion.poses, motion.columns

    def best(self, profile: Profile) -> BestForces:
        """Integrate the forces by one profile in all poses, N and N cm, shape (p,)."""
        forces = forces_on(profile, self.outline, self.poses)
        return BestForces(forces.by_name(), forces.reason)

    def best_with_load(self, profile: Profile) -> DrawnForces:
        """Integrate the forces by one profile, with their load: in the form of a single draw, shape (1, p)."""
        forces = {name: values[None] for name, values in self.best(profile).forces.items()}
        load = outline_load(profile, self.outline, self.poses)
        return DrawnForces(0, forces, load.interpolate(0, len(self.poses)))

    def draw(self, stack: Profile, *, with_load: bool) -> Iterator[DrawnForces]:
        """Integrate the forces by each of a stack of draws, over `poses_at_once` poses at a time.

        The load is calculated in a few poses of the whole motion first, and interpolated to the poses of each block.
        """
        has_moment = "moment_N_cm" in self.with_interval
        load = (
            outline_load(stack, self.outline, self.poses, with_centre=has_moment)
            if with_load
            else None
        )
        step = self.poses_at_once(len(np.atleast_2d(stack.parameters[0])))
        for start in range(0, len(self.poses), step):
            stop = min(start + step, len(self.poses))
            poses = self.poses[start:stop]
            forces = force_draws(stack, self.outline, poses, with_moment=has_moment).by_name()
            yield DrawnForces(
                start,
                {name: np.atleast_2d(drawn) for name, drawn in forces.items()},
                None if load is None else load.interpolate(start, stop),
            )

    def poses_at_once(self, draws: int) -> int:
        """Return the number of poses whose draws are held in memory together."""
        return max(1, MOST_AT_ONCE // draws)

    def wet_parts(self) -> WetParts:
        """Return the load, depth, speed and position of the elements of all poses."""
        elements, load, centre, _ = WetElements.of(self.outline, self.poses)
        speed = np.hypot(elements[..., 6], elements[..., 7])
        return WetParts(load, -centre[..., 1], speed, (centre[..., 0],))

    @property
    def points_cm(self) -> FloatArray:
        """Points that span the body, shape (n, 2)."""
        return self.outline.points_cm

    @property
    def states(self) -> FloatArray:
        """Turn, height and direction of motion in each pose, in correlation lengths of a body's error, shape (p, f)."""
        return pose_states(self.points_cm, self.poses)

    @property
    def progress(self) -> FloatArray:
        """Distance of each pose along the motion, in correlation lengths of the model's error, shape (p,)."""
        return outline_progress(self.outline, self.poses)

    def model_errors(self, drawn: DrawnForces, paths: FloatArray, eps: float) -> ForcesByName:
        """Calculate errors of the force model by draw; `paths`: errors over eps and the load, shape (draws, 2, p)."""
        assert drawn.load is not None
        # without a centre of the load there is no error of the moment
        return dict(zip(QUANTITIES, plane_errors(drawn.load, paths, eps), strict=False))

    def body_errors(self, drawn: DrawnForces, paths: FloatArray) -> ForcesByName:
        """Calculate errors on a body that was measured before; `paths`: errors over the load, shape (draws, 2, p)."""
        return self.model_errors(drawn, paths, 1.0)

    def peak_targets(self, best: ForcesByName) -> list[PeakTarget]:
        """List the peaks to find: the same for every outline, whatever its best curves are."""
        return [*PEAKS]

    def bounds(self, profile: Profile) -> BoundsByName:
        """Return for each force the sum over elements with a number, and the most that the other elements can add, (p,).

        An element without a number bears at most its load times the largest alpha of the profile in any direction.
        """
        wet = WetElements.of(self.outline, self.poses)
        load, (arm_x, arm_z) = wet.load, np.moveaxis(wet.arm, -1, 0)
        forces, most_forces = [], []
        for alpha, parameters in zip(profile.alpha(*wet.angles), profile.parameters, strict=True):
            largest_alpha = np.nanmax(np.abs(parameters), initial=0.0)
            force = np.where(load == 0, 0.0, load * alpha)
            most_forces.append(np.where(np.isnan(force), load * largest_alpha, 0.0))
            forces.append(np.nan_to_num(force))
        (z, x), (most_z, most_x) = forces, most_forces
        # the moment is the third quantity
        forces.append(arm_z * x - arm_x * z)
        most_forces.append(np.abs(arm_z) * most_x + np.abs(arm_x) * most_z)
        return {
            name: (force.sum(axis=-1), most.sum(axis=-1))
            for name, force, most in zip(QUANTITIES, forces, most_forces, strict=True)
        }

    def finish_peak(
        self, peak: Peak, profile: Profile, best: ForcesByName, columns: Mapping[str, FloatArray]
    ) -> Peak:
        """Return a peak, without its interval of alpha where it is steep."""
        return self.withhold_if_steep(peak, profile, best)

    def turned_forces(self, profile: TableProfile, quantity: str, pose: int) -> FloatArray:
        """Integrate a force in one pose with all elements turned by -`STEEP_DEG` and by `STEEP_DEG`, N, shape (1, 2)."""
        wet, component = self._wet_elements_at(quantity, pose)
        beta, gamma = wet.angles
        turned = np.radians(STEEP_DEG) * np.array([[-1.0], [1.0]])
        forces = wet.load * profile.alpha(beta + turned, gamma)[component]
        return np.asarray(forces.sum(axis=-1)[None])

    def sizes_near_pushes(
        self, profile: TableProfile, quantity: str, pose: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return sizes of a force on elements, N, and 1 for each whose direction lies near a push, shape (elements,)."""
        wet, component = self._wet_elements_at(quantity, pose)
        beta, gamma = wet.angles
        sizes = np.abs(wet.load * profile.alpha(beta, gamma)[component])[0]
        return np.asarray(sizes), np.where(profile.far_from_pushes(beta[0], gamma[0]), 0.0, 1.0)

    def _wet_elements_at(self, quantity: str, pose: int) -> tuple[WetElements, int]:
        """Return the elements in one pose alone, and the component of alpha that makes a force: 0 for z, 1 for x."""
        elements = WetElements.of(self.outline, self.motion.poses[pose : pose + 1])
        return elements, self.force_names.index(quantity)
