"""Measured forces on bodies as rows of the linear system from which a map is estimated, less those that noise hides.

The force of a pose is a sum of weights times alpha, so each measured force is a row of the same linear system as
the push of a plate, whose only weight is 1 in its own direction:

    F = W alpha + H (c + o) + e

e is the error of the reading and H the load without cancellation: the sum of the sizes of the forces on all elements.
c is the relative error of the force model on this body in every medium, and o its further error in this medium.

The size of a medium is the root mean square of its alpha over the published grid, N/cm^3; a medium of size 1 has the
shape alone. A map has n nodes; alpha at them is a vector (2 n,), all z, then all x. Forces have components, z and x of
an outline, x, y, z of a mesh; N, of the medium on the body.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.profiles import Profile, TableProfile
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "observations")

Angles = tuple[FloatArray, FloatArray]
"""Beta and gamma of directions, rad."""


class ErrorOfBody(Protocol):
    """Relative error of the force model on one body, as `rftfit.BodyError` has it, which this room does not import."""

    def evaluate(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean (components, p) and covariance (components, p, p) of the error over the load; `states`: (p, f)."""


class Observation(Protocol):
    """Measured forces on a body in p poses, as `rftfit.Contact` has them, which this room does not import."""

    @property
    def body(self) -> object:
        """The body; observations of one body share its error."""

    @property
    def body_error(self) -> ErrorOfBody:
        """Error of the force model on the body."""

    @property
    def states(self) -> FloatArray:
        """The numbers that describe each pose, on which the error of the force model depends, shape (p, f)."""

    @property
    def touches(self) -> npt.NDArray[np.bool_]:
        """True where the body is in the medium, shape (p,)."""

    @property
    def measured(self) -> FloatArray:
        """Measured forces, N, shape (components, p)."""

    @property
    def reading_errors(self) -> FloatArray:
        """Standard errors of the readings, N, shape (components, p)."""

    def load(self, profile: Profile) -> FloatArray:
        """Return the load without cancellation by a profile, N, shape (p,)."""

    def weights(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Return the weights of alpha at n nodes (rad) in the forces, (components, p, 2 n): alpha_z, then alpha_x."""


class ObservedRows(NamedTuple):
    """k combinations of measured forces that depend on the medium: each is as good as a push that measures a mean of alpha.

    `weights`: of alpha at the n nodes, shape (k, 2 n), whose sizes add up to 1. `offset` (k,): contribution of the mean
    error of the force model on these bodies, for a medium of size 1. `values`, `errors` (k,): measured value and its
    standard error, N/cm^3; the errors are independent.
    """

    weights: FloatArray
    offset: FloatArray
    values: FloatArray
    errors: FloatArray


@dataclass(frozen=True)
class ObservedSystem:
    """Observations as a linear system of the shape of a medium, before the size of the medium is known.

    `bodies`: forces on each body. `mean`: mean shape of the known media at the n nodes, (2 n,). `root` (k, 2 n):
    root.T @ root is the covariance of the shape about this mean.
    """

    bodies: tuple[_BodyForces, ...]
    mean: FloatArray
    root: FloatArray

    @classmethod
    def of(
        cls, observations: Sequence[Observation], nodes: Angles, mean: FloatArray, root: FloatArray
    ) -> ObservedSystem:
        """Make the system for nodes (beta, gamma), rad; observations of one body share an error of the model.

        `mean`, `root`: as in the class.
        """
        mean_z, mean_x = mean.reshape(2, -1)
        mean_profile = TableProfile(mean_z, mean_x, *nodes)
        # one body is one object: another one of the same shape may have been made differently
        by_body: dict[int, list[Observation]] = {}
        for observation in observations:
            by_body.setdefault(id(observation.body), []).append(observation)
        bodies = (_BodyForces.of(of_body, nodes, mean_profile) for of_body in by_body.values())
        return cls(tuple(bodies), mean, root)

    def first_size(self) -> float:
        """Return a first estimate of the size of the medium, N/cm^3, by least squares; NaN where no force is expected.

        Forces are divided by their loads, because the error of the force model is in proportion to the load.
        """
        forces_times_expected = expected_squared = 0.0
        for body in self.bodies:
            expected = body.weights @ self.mean + body.offset
            forces_times_expected += float(expected @ (body.forces / body.load**2))
            expected_squared += float(expected @ (expected / body.load**2))
        return forces_times_expected / expected_squared if expected_squared > 0 else math.nan

    def rows(self, size: float) -> ObservedRows:
        """Return combinations of the forces with independent errors, which are those at loads of a medium of this size.

        Combinations that noise hides, whose signal over noise is below `least_signal` (chosen.toml), are left out:
        hundreds of poses become some tens of rows.
        """
        # a signal is what one independent part of the prior changes in the forces: its parts of shape, and its size
        count = len(self.root) + 1
        products = np.zeros((count, count))
        values, offset = np.zeros((2, count))
        weights = np.zeros((count, self.mean.size))
        for body in self.bodies:
            design, whitened_offset, forces = body.whiten(size)
            mean = design @ self.mean + whitened_offset
            # in units of the noise of the forces
            signals = size * np.column_stack([design @ self.root.T, _CHOSEN.size_spread * mean])
            products += signals.T @ signals
            values += signals.T @ forces
            weights += signals.T @ design
            offset += signals.T @ whitened_offset
        # the combinations are the left singular vectors of all signals; their singular values are signal over noise
        squares, axes = np.linalg.eigh(products)
        keep = squares > _CHOSEN.least_signal**2
        combine = (axes[:, keep] / np.sqrt(squares[keep])).T
        weights, offset, values = combine @ weights, combine @ offset, combine @ values
        # weights whose sizes add up to 1 make each row a mean of alpha over directions, in N/cm^3
        total = np.abs(weights).sum(axis=1)
        return ObservedRows(weights / total[:, None], offset / total, values / total, 1 / total)


class _BodyForces(NamedTuple):
    """The q measured forces on one body, of all its observations.

    `weights` (q, 2 n): of alpha at the nodes. `offset` (q,): force by the mean error of the force model, and `load`
    (q,): load without cancellation, both for a medium of size 1, N. `forces`, `errors` (q,): measured, N.
    `covariance` (q, q): of the relative error of the force model.
    """

    weights: FloatArray
    offset: FloatArray
    forces: FloatArray
    errors: FloatArray
    load: FloatArray
    covariance: FloatArray

    @classmethod
    def of(
        cls, observations: Sequence[Observation], nodes: Angles, mean_profile: Profile
    ) -> _BodyForces:
        """Join the observations of one body, without poses in the air and forces that were not measured.

        `nodes`: of the map. `mean_profile`: the mean shape, for the load of a medium of size 1.
        """
        states = np.concatenate([observation.states for observation in observations])
        mean_error, covariance = observations[0].body_error.evaluate(states)
        load = np.concatenate([observation.load(mean_profile) for observation in observations])
        touches = np.concatenate([observation.touches for observation in observations])
        # by component and pose, the poses of all observations behind one another
        weights = np.concatenate([o.weights(*nodes) for o in observations], axis=1)
        forces = np.concatenate([o.measured for o in observations], axis=1)
        errors = np.concatenate([o.reading_errors for o in observations], axis=1)
        component, pose = used = np.nonzero(np.isfinite(forces) & touches)
        # the errors of two components are independent
        same_component = component[:, None] == component
        return cls(
            weights[used],
            load[pose] * mean_error[used],
            forces[used],
            errors[used],
            load[pose],
            same_component * covariance[component[:, None], pose[:, None], pose],
        )

    def whiten(self, size: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return weights (q, 2 n), offset (q,) and forces (q,), transformed so that errors are independent and 1.

        `size`: of the medium, N/cm^3, to which the errors of the force model are in proportion.
        """
        from scipy.linalg import solve_triangular

        load = size * self.load
        noise = load[:, None] * self.covariance * load + np.diag(self.errors**2)
        sides = np.column_stack([self.weights, self.offset, self.forces])
        solved = solve_triangular(np.linalg.cholesky(noise), sides, lower=True)
        return solved[:, :-2], solved[:, -2], solved[:, -1]
