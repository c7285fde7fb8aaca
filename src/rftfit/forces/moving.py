"""Bodies that move through a medium: the methods that a prediction needs, in the plane and in space alike.

`rftfit.forces.plane` has them for outlines, `rftfit.forces.space` for meshes. Forces are those of the medium on the
body. They are calculated by one profile (alpha of a medium, as a function of two angles), or by a stack of draws: a
profile whose parameters have a leading axis, alpha drawn many times within its errors. A motion has p poses. A part of
a body is a straight element of an outline or a triangle (face) of a mesh. The load of a part is its depth times its
area, cm^3, which alpha (N/cm^3) turns into a force; the load of a body (`Load`) is the sum of the sizes of the forces
on its parts, N, nothing cancelled: the force model errs in proportion to it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.forces.model_error import Load
from rftfit.forces.peaks import (
    NOTICED,
    STEEP,
    STEEPEST,
    BoundsByName,
    Peak,
    PeakTarget,
    pose_of,
    withhold,
)
from rftfit.model.profiles import Profile, TableProfile

ForcesByName = dict[str, FloatArray]
"""Forces, N, and moments, N cm, by the name of their column; shape (draws, p), or (p,) for a single profile."""


class BestForces(NamedTuple):
    """Forces by one profile, shape (p,).

    `reason`: why some pose has no number; empty where every pose has one. `leaving_cm3`: of a mesh by the measured law,
    depth times area of the faces that move out of the plane of their normal and the vertical, shape (p,): on these no
    measurement in the plane tests the law. None of an outline.
    """

    forces: ForcesByName
    reason: str = ""
    leaving_cm3: FloatArray | None = None


class DrawnForces(NamedTuple):
    """Forces on a body by draw, in k poses of its motion from index `start` on.

    `forces`: shape (draws, k). `load`: in these poses, or None where no error of the model is asked for.
    `by_direction`: sum of f f^T / |f| over the forces f of faces, shape (draws, k, 3, 3), N: how much of the load acts
    in each direction; of a solid mesh alone.
    """

    start: int
    forces: ForcesByName
    load: Load | None = None
    by_direction: FloatArray | None = None

    @property
    def stop(self) -> int:
        """Index of the first pose after these."""
        return self.start + int(next(iter(self.forces.values())).shape[-1])

    def between(self, start: int, stop: int) -> DrawnForces:
        """Return the forces in poses `start` to `stop` (exclusive); `self` must be those of the whole motion."""
        poses = slice(start, stop)
        load, by_direction = self.load, self.by_direction
        return DrawnForces(
            start,
            {name: forces[:, poses] for name, forces in self.forces.items()},
            None if load is None else load.at(poses),
            None if by_direction is None else by_direction[:, poses],
        )


class WetParts(NamedTuple):
    """All parts of a body in all poses of its motion, in arrays of the same shape, (p, n): limits are checked on them.

    `load_cm3`: depth times area, 0 where a part bears no load, as above the surface. `depth_cm`: positive below the
    surface. `horizontal_cm`: x, and of a mesh y.
    """

    load_cm3: FloatArray
    depth_cm: FloatArray
    speed_cm_per_s: FloatArray
    horizontal_cm: tuple[FloatArray, ...]


class BodyInMotion(ABC):
    """A body and its motion of p poses.

    `with_interval`: columns of the forces and moments that get an interval. `force_names`: columns of the forces alone,
    on each of which the force model errs independently. `poses`: shape (p, 6): x, z (cm), angle (rad) and their rates
    (per s); of a mesh (p, 18): position (3, cm), velocity (3, cm/s), rate of turning (3, rad/s) and rotation matrix
    (9). `columns`: columns of the table of a prediction that tell the poses apart, such as ``theta_deg``, shape (p,).
    """

    with_interval: tuple[str, ...]
    force_names: tuple[str, ...]
    poses: FloatArray
    columns: Mapping[str, FloatArray]

    @property
    def positions(self) -> FloatArray:
        """Angle or time of each pose: the first of `columns`, shape (p,)."""
        return next(iter(self.columns.values()))

    @abstractmethod
    def best(self, profile: Profile) -> BestForces:
        """Integrate the forces by one profile."""

    @abstractmethod
    def best_with_load(self, profile: Profile) -> DrawnForces:
        """Integrate the forces by one profile, with their load: as a stack of a single draw, so that errors add alike."""

    @abstractmethod
    def draw(self, stack: Profile, *, with_load: bool) -> Iterator[DrawnForces]:
        """Integrate the forces by each of a stack of draws, over `poses_at_once` poses at a time, in their order.

        `with_load`: False saves time where no error of the model is wanted.
        """

    @abstractmethod
    def poses_at_once(self, draws: int) -> int:
        """Return the number of poses whose draws are held in memory together."""

    @abstractmethod
    def wet_parts(self) -> WetParts:
        """Return the load, depth, speed and position of the parts of the body in all poses."""

    @property
    @abstractmethod
    def points_cm(self) -> FloatArray:
        """Points that span the body in its own axes, x, z or x, y, z, cm, shape (n, 2 or 3)."""

    @property
    @abstractmethod
    def states(self) -> FloatArray:
        """Turn, height and direction of motion in each pose, in correlation lengths of a body's error, shape (p, f).

        The f columns are those of `rftfit.forces.body_error`: the nearer two states, the more alike the error of the
        force model on a body that was measured before.
        """

    @property
    @abstractmethod
    def progress(self) -> FloatArray:
        """Distance of each pose along the motion, in correlation lengths of the model's error on any body, shape (p,)."""

    @abstractmethod
    def model_errors(self, drawn: DrawnForces, paths: FloatArray, eps: float) -> ForcesByName:
        """Calculate errors of the force model on any body by draw, N and N cm, shape (draws, k), for the poses of `drawn`.

        `eps`: the usual relative error. `paths`: random errors over eps and the load, shape (draws, forces, k).
        """

    @abstractmethod
    def body_errors(self, drawn: DrawnForces, paths: FloatArray) -> ForcesByName:
        """Calculate errors on a body that was measured before; `paths`: errors over the load, shape (draws, forces, k)."""

    @abstractmethod
    def peak_targets(self, best: ForcesByName) -> list[PeakTarget]:
        """List the peaks to find, of which a body in space has one for each best curve, of the sign of its largest value."""

    @abstractmethod
    def bounds(self, profile: Profile) -> BoundsByName:
        """Bound each force in each pose, where alpha has no number in some directions: a peak may lie in such a pose."""

    def finish_columns(
        self,
        columns: dict[str, FloatArray],
        profile: Profile,  # noqa: ARG002 (of a mesh)
        best: BestForces,  # noqa: ARG002 (of a mesh)
    ) -> dict[str, FloatArray]:
        """Return the columns of the table of a prediction, each of shape (p,), completed by those that only a mesh has.

        `best`: the forces by the profile itself, from `best`.
        """
        return columns

    @abstractmethod
    def finish_peak(
        self, peak: Peak, profile: Profile, best: ForcesByName, columns: Mapping[str, FloatArray]
    ) -> Peak:
        """Return a peak as it is stated for this form of body: withheld where it is steep, without rounding of a mesh.

        `best`: the best curves, (p,), by quantity. `columns`: those of the table of the prediction, (p,).
        """

    @abstractmethod
    def turned_forces(self, profile: TableProfile, quantity: str, pose: int) -> FloatArray:
        """Integrate a force in one pose (its index) with all parts turned by -`STEEP_DEG` and by `STEEP_DEG`, N.

        Depth, area and motion of each part stay as they are: the change of the force shows how steeply alpha changes
        with the attack angle. Shape (axes, 2): one row for each level axis about which the parts are turned, one of an
        outline, two of a mesh.
        """

    @abstractmethod
    def sizes_near_pushes(
        self, profile: TableProfile, quantity: str, pose: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the size of a force on each part in one pose, N, and which share of it alpha near a push gives.

        Both of shape (n,), the share from 0 to 1: alpha farther than `FAR_DEG` from every push is interpolated.
        """

    def withhold_if_steep(self, peak: Peak, profile: Profile, best: ForcesByName) -> Peak:
        """Withhold the interval of alpha of a peak that lies between pushes and changes fast with the attack angle.

        Alpha may there have an edge that no push shows, and all parts on that edge err alike. `best`: the best curves,
        shape (p,), by quantity. Sets `Peak.steepness` of every force by a table or map that has an interval.
        """
        if not isinstance(profile, TableProfile) or np.isnan(peak.lo):
            return peak
        if peak.quantity not in self.force_names or not peak.value:
            return peak
        pose = pose_of(peak, best[peak.quantity])
        less, more = self.turned_forces(profile, peak.quantity, pose).T
        # a turn about any other horizontal axis changes the force less
        steepness = float(np.linalg.norm(more - less)) / 2 / abs(peak.value)
        peak = replace(peak, steepness=steepness)
        if steepness <= STEEPEST or self.share_near_pushes(peak, profile, pose) >= 1 - NOTICED:
            return peak
        return withhold(peak, STEEP)

    def share_near_pushes(self, peak: Peak, profile: TableProfile, pose: int) -> float:
        """Return the share of a peak force that acts in directions near a push, 0 to 1, summed without cancellation.

        `pose`: index of the peak's pose.
        """
        sizes, near = self.sizes_near_pushes(profile, peak.quantity, pose)
        return float((sizes * near).sum() / sizes.sum())

    def force_draws(self, stack: Profile) -> FloatArray:
        """Integrate the forces by each of a stack of draws, N, in all poses: shape (draws, forces, p)."""
        blocks = [
            np.stack([drawn.forces[name] for name in self.force_names], axis=1)
            for drawn in self.draw(stack, with_load=False)
        ]
        return np.concatenate(blocks, axis=-1)

    def load_size(self, stack: Profile) -> FloatArray:
        """Calculate the load without cancellation by each draw of a stack, H of `rftfit.forces.model_error`, N, (draws, p).

        A single profile counts as one draw.
        """
        loads = [drawn.load for drawn in self.draw(stack, with_load=True)]
        return np.concatenate([load.size for load in loads if load is not None], axis=-1)

    def is_covered_by(self, profile: Profile) -> bool:
        """Tell whether a profile has a number in every direction in which a part of the body moves.

        `rftfit.model.known.profile_of` asks: where a table has none, the map of the same medium is taken.
        """
        return bool(has_forces(self.best(profile).forces).all())


def rates_of(poses: FloatArray) -> FloatArray:
    """Return the rates in poses as in `Motion` or in `Motion3D`, shape (p, 3) or (p, 6)."""
    return poses[:, 3:9]


def has_forces(forces: ForcesByName) -> npt.NDArray[np.bool_]:
    """Tell in which poses every force and moment has a number, shape (p,); `forces`: by one profile."""
    return np.asarray(np.isfinite(np.stack(list(forces.values()))).all(axis=0))
