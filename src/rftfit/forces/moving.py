"""Bodies that move through a medium: the methods that a prediction needs, in the plane and in space alike."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.forces.model_error import Load
from rftfit.forces.peaks import Ends, Peak, PeakTarget
from rftfit.model.profiles import Profile

ForcesByName = dict[str, FloatArray]
"""Forces, N, and moments, N cm, by the name of their column; shape (draws, p), or (p,) for a single profile."""


class BestForces(NamedTuple):
    """Forces by one profile, shape (p,).

    `reason`: why some pose has no number; empty where every pose has one. `leaving`: of a mesh, depth times area of the
    faces that move out of the plane of their normal and the vertical, cm^3, shape (p,).
    """

    forces: ForcesByName
    reason: str = ""
    leaving: FloatArray | None = None


class DrawnForces(NamedTuple):
    """Forces on a body by draw, in some poses of its motion from number `start` on, and the load in these poses.

    `by_direction`: sum of f f^T / |f| over the forces f of faces, shape (draws, p, 3, 3), N, of a body in space.
    """

    start: int
    forces: ForcesByName
    load: Load | None = None
    by_direction: FloatArray | None = None

    @property
    def stop(self) -> int:
        """Number of the first pose after these."""
        return self.start + int(next(iter(self.forces.values())).shape[-1])

    def between(self, start: int, stop: int) -> DrawnForces:
        """Return the forces in the poses from `start` to `stop`; these forces must be those of the whole motion."""
        chosen = slice(start, stop)
        load, by_direction = self.load, self.by_direction
        return DrawnForces(
            start,
            {name: forces[:, chosen] for name, forces in self.forces.items()},
            None if load is None else load.at(chosen),
            None if by_direction is None else by_direction[:, chosen],
        )


class BodyInMotion(ABC):
    """A body and its motion of p poses.

    `quantities`: names of its forces and moments; `wanted`: those that get an interval; `forces`: those that are
    forces, on each of which the force model errs independently.
    """

    quantities: tuple[str, ...]
    wanted: tuple[str, ...]
    forces: tuple[str, ...]
    poses: FloatArray
    columns: Mapping[str, FloatArray]

    @abstractmethod
    def best(self, profile: Profile) -> BestForces:
        """Integrate the forces by one profile."""

    @abstractmethod
    def best_with_load(self, profile: Profile) -> DrawnForces:
        """Integrate the forces by one profile, with their load: in the form of a single draw."""

    @abstractmethod
    def draw(self, stack: Profile, *, with_load: bool) -> Iterator[DrawnForces]:
        """Integrate the forces by each of a stack of draws, a part of the poses at a time."""

    @abstractmethod
    def poses_at_once(self, draws: int) -> int:
        """Return for how many poses draws are held in memory together."""

    @abstractmethod
    def load_size(self, stack: Profile) -> FloatArray:
        """Load without cancellation H by draw, N, shape (draws, p)."""

    @abstractmethod
    def wet_parts(self) -> list[FloatArray]:
        """Return depth times area (cm^3), depth (cm), speed (cm/s) and x (cm) of the elements or faces of all poses.

        A mesh has y (cm), too.
        """

    @property
    @abstractmethod
    def points_cm(self) -> FloatArray:
        """Points that span the body, shape (n, 2 or 3)."""

    @property
    @abstractmethod
    def states(self) -> FloatArray:
        """State of the body in each pose, in lengths of its error, shape (p, f)."""

    @property
    @abstractmethod
    def progress(self) -> FloatArray:
        """How far each pose lies along the motion, in lengths of the model's error, shape (p,)."""

    @abstractmethod
    def model_errors(self, drawn: DrawnForces, paths: FloatArray, eps: float) -> ForcesByName:
        """Errors of the force model by draw; `paths`: unit errors by direction, shape (draws, axes, p)."""

    @abstractmethod
    def body_errors(self, drawn: DrawnForces, paths: FloatArray) -> ForcesByName:
        """Errors of the force model on a body that was measured before; `paths`: over the load, shape (draws, axes, p)."""

    @abstractmethod
    def peak_targets(self, best: ForcesByName) -> list[PeakTarget]:
        """List the peaks that are looked for."""

    @abstractmethod
    def bounds(self, profile: Profile) -> Ends:
        """Return, by pose, the part of each force that has a number, and the most that the rest may add."""

    def finish_columns(
        self,
        columns: dict[str, FloatArray],
        profile: Profile,  # noqa: ARG002 (of a mesh)
        best: BestForces,  # noqa: ARG002 (of a mesh)
    ) -> dict[str, FloatArray]:
        """Return the columns of the table of a prediction, with those that only this form of body has."""
        return columns

    @abstractmethod
    def finish_peak(
        self, peak: Peak, profile: Profile, best: ForcesByName, columns: Mapping[str, FloatArray]
    ) -> Peak:
        """Correct a peak for this form of body; `columns`: those of the table of the prediction."""

    def force_draws(self, stack: Profile) -> FloatArray:
        """Integrate the forces by each of a stack of draws, N, in all poses: shape (draws, axes, p)."""
        parts = [
            np.stack([drawn.forces[name] for name in self.forces], axis=1)
            for drawn in self.draw(stack, with_load=False)
        ]
        return np.concatenate(parts, axis=-1)

    def knows(self, profile: Profile) -> bool:
        """Tell whether a profile has a number in every direction of the body."""
        return bool(has_forces(self.best(profile).forces).all())


def has_forces(forces: ForcesByName) -> npt.NDArray[np.bool_]:
    """Tell in which poses every force has a number, shape (p,)."""
    return np.asarray(np.isfinite(np.stack(list(forces.values()))).all(axis=0))
