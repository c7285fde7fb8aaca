"""Measured forces on bodies as rows of the linear system of a map: what remains of them that tells of the medium.

The force of a pose is a sum of weights times alpha, so each measured force is a row of the same linear system as
the push of a plate, whose only weight is 1 in its own direction:

    F = W alpha + H (c + o) + e

e is the error of the reading, H the load without cancellation, c what the force model gets wrong on this body in every
medium, and o what it gets wrong in this medium beside that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.profiles import Profile, TableProfile

Angles = tuple[FloatArray, FloatArray]


class ErrorOfBody(Protocol):
    """Relative error of the force model on one body."""

    def evaluate(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and covariance of the error over the load in states (p, f), by component."""


class Observation(Protocol):
    """Measured forces on a body in p poses: `rftfit.Contact`."""

    @property
    def body(self) -> object:
        """The body; observations of one body share its error."""

    @property
    def body_error(self) -> ErrorOfBody:
        """Error of the force model on the body."""

    @property
    def states(self) -> FloatArray:
        """State of the body in each pose, shape (p, f)."""

    @property
    def touches(self) -> npt.NDArray[np.bool_]:
        """Whether the body is in the medium, shape (p,)."""

    @property
    def measured(self) -> FloatArray:
        """Measured forces, N, shape (components, p)."""

    @property
    def reading_errors(self) -> FloatArray:
        """Standard errors of the readings, N, shape (components, p)."""

    def load(self, profile: Profile) -> FloatArray:
        """Load without cancellation, N, shape (p,)."""

    def weights(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Weights of alpha at nodes (rad, n), z then x, shape (components, p, 2 n)."""


_SIZE_SPREAD = 3.0
"""Standard deviation of the size of an unknown medium, relative, in the choice of combinations."""

_LEAST_SIGNAL = 0.1
"""Standard deviation of a combination of forces over that of its noise, below which it says nothing of the medium."""


class ObservedRows(NamedTuple):
    """Combinations of measured forces that tell of the medium, as numbers with the unit of alpha.

    `weights`: of alpha at the nodes, shape (k, 2 n). `offset`: what the learned error of the bodies adds, for a medium
    of size 1, (k,). `values`, `errors`: what was measured, and its standard error, N/cm^3, (k,).
    """

    weights: FloatArray
    offset: FloatArray
    values: FloatArray
    errors: FloatArray


@dataclass(frozen=True)
class ObservedSystem:
    """Observations as a linear system of the shape of a medium, before the size of the medium is known.

    `mean`: shape of the known media at the nodes, (2 n,). `root`: rows whose products are the covariance about it.
    """

    groups: tuple[_Group, ...]
    mean: FloatArray
    root: FloatArray

    @classmethod
    def of(
        cls, observations: Sequence[Observation], nodes: Angles, mean: FloatArray, root: FloatArray
    ) -> ObservedSystem:
        """Take observations at nodes (beta, gamma), rad; those of one body share its error."""
        mean_z, mean_x = mean.reshape(2, -1)
        usual = TableProfile(mean_z, mean_x, *nodes)
        of_bodies: dict[int, list[Observation]] = {}
        for observation in observations:
            of_bodies.setdefault(id(observation.body), []).append(observation)
        groups = tuple(_Group.of(of_body, nodes, usual) for of_body in of_bodies.values())
        return cls(groups, mean, root)

    def first_size(self) -> float:
        """Size of the medium by the forces alone, each over its load."""
        across = along = 0.0
        for group in self.groups:
            expected = group.weights @ self.mean + group.offset
            across += float(expected @ (group.forces / group.load**2))
            along += float(expected @ (expected / group.load**2))
        return across / along if along > 0 else float("nan")

    def rows(self, size: float) -> ObservedRows:
        """Rows of a medium whose loads are those of a medium of this size.

        Combinations that noise hides are left out: of hundreds of poses some tens are left.
        """
        products = np.zeros((len(self.root) + 1,) * 2)
        values = np.zeros(len(products))
        weights = np.zeros((len(products), self.mean.size))
        offset = np.zeros(len(products))
        for group in self.groups:
            design, whitened_offset, forces = group.whitened(size)
            mean = design @ self.mean + whitened_offset
            signals = size * np.column_stack([design @ self.root.T, _SIZE_SPREAD * mean])
            products += signals.T @ signals
            values += signals.T @ forces
            weights += signals.T @ design
            offset += signals.T @ whitened_offset
        squares, axes = np.linalg.eigh(products)
        keep = squares > _LEAST_SIGNAL**2
        combine = (axes[:, keep] / np.sqrt(squares[keep])).T
        weights, offset, values = combine @ weights, combine @ offset, combine @ values
        # in the unit of alpha: a mean of alpha over directions
        total = np.abs(weights).sum(axis=1)
        return ObservedRows(weights / total[:, None], offset / total, values / total, 1 / total)


class _Group(NamedTuple):
    """Observations of one body: weights (q, 2 n), offset, forces, reading errors and load of size 1 (q,), correlation (q, q)."""

    weights: FloatArray
    offset: FloatArray
    forces: FloatArray
    errors: FloatArray
    load: FloatArray
    correlation: FloatArray

    @classmethod
    def of(cls, observations: Sequence[Observation], nodes: Angles, usual: Profile) -> _Group:
        body_error = observations[0].body_error
        states = np.concatenate([observation.states for observation in observations])
        mean, covariance = body_error.evaluate(states)
        measured = np.concatenate([observation.measured for observation in observations], axis=1)
        touches = np.concatenate([observation.touches for observation in observations])
        use = np.isfinite(measured) & touches
        load = np.concatenate([observation.load(usual) for observation in observations])
        weights = np.concatenate(
            [observation.weights(*nodes) for observation in observations], axis=1
        )
        errors = np.concatenate(
            [observation.reading_errors for observation in observations], axis=1
        )
        loads = np.broadcast_to(load, measured.shape)
        component, pose = np.nonzero(use)
        components = len(measured)
        errors_of_body = np.broadcast_to(mean[:components], (components, states.shape[0]))
        correlation = np.zeros((pose.size, pose.size))
        for number in range(components):
            of_component = component == number
            poses = pose[of_component]
            square = np.ix_(of_component, of_component)
            correlation[square] = covariance[number][np.ix_(poses, poses)]
        return cls(
            weights[use],
            (loads * errors_of_body)[use],
            measured[use],
            errors[use],
            loads[use],
            correlation,
        )

    def whitened(self, size: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weights, offset and forces whose errors are independent and 1."""
        from scipy.linalg import solve_triangular

        load = size * self.load
        noise = load[:, None] * self.correlation * load + np.diag(self.errors**2)
        root = np.linalg.cholesky(noise)
        sides = np.column_stack([self.weights, self.offset, self.forces])
        solved = solve_triangular(root, sides, lower=True)
        return solved[:, :-2], solved[:, -2], solved[:, -1]
