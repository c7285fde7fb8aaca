"""Measured forces on bodies as observations of a map: a turning leg, a rolling wheel, a foot that presses.

The force of a pose is a sum of weights times alpha, so each measured force is a row of the same linear system as
the push of a plate, whose only weight is 1 in its own direction:

    F = W alpha + H (c + o) + e

e is the error of the reading, H the load without cancellation (`rftfit.model.model_error`), c what the model gets wrong
on this body in every medium, and o what it gets wrong in this medium beside that. c and o are smooth over the states
of the body: a state that comes again has the same error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model import model_error
from rftfit.model.body_error import BodyError, frame_states, pose_states
from rftfit.model.mesh import Mesh, Motion3D
from rftfit.model.motion import Motion
from rftfit.model.outlines import Outline
from rftfit.model.profiles import Profile, TableProfile

if TYPE_CHECKING:
    import pandas as pd

Angles = tuple[FloatArray, FloatArray]

PLANE, SPACE = ("force_z_N", "force_x_N"), ("force_x_N", "force_y_N", "force_z_N")
"""Forces of an outline and of a mesh."""

FEWEST_POSES = 2
"""With fewer poses a force cannot be told from an offset of the sensor."""

_LEAST_SIGNAL = 0.1
"""Standard deviation of a combination of forces over that of its noise, below which it says nothing of the medium."""

_SIZE_SPREAD = 3.0
"""Standard deviation of the size of an unknown medium, relative, in the choice of combinations."""


@dataclass(frozen=True, eq=False)
class Contact:
    """Measured forces on a body that moves through a medium.

    Parameters
    ----------
    body : Outline or Mesh
    motion : Motion or Motion3D
        Its poses: of an outline a `Motion`, of a mesh a `Motion3D`.
    force : mapping of str to array_like, shape (p,), or pandas.DataFrame
        Measured forces of the medium on the body, N: ``force_z_N``, ``force_x_N``, of a mesh also ``force_y_N``. A
        direction that was not measured is left out; a pose that was not is NaN. A table of `predict` has this form.
    errors : float or mapping of str to array_like
        Standard error of a reading, N, as large as it is from bed to bed.
    body_error : BodyError, optional
        What the model gets wrong on this body, learned where it was measured before (`learn_body_error`). Default:
        nothing is known of it but its size, 0.42 of the load.
    name : str, optional
        For people; default: that of the body.

    Raises
    ------
    ValueError
        If there is no force, fewer than two poses with a force touch the medium, the body is in the air in all of
        them, or it never moves.

    Examples
    --------
    >>> import rftfit
    >>> leg, motion = rftfit.model_leg("c_leg"), rftfit.rotation([-60, -30, 0, 30, 60])
    >>> turned = rftfit.predict(rftfit.published_medium("poppy_LP"), leg, motion)
    >>> sand = rftfit.estimate_map(contacts=[rftfit.Contact(leg, motion, turned, errors=0.2)])
    >>> sand.contacts
    1
    """

    body: Outline | Mesh
    motion: Motion | Motion3D
    force: Mapping[str, npt.ArrayLike] | pd.DataFrame = field(repr=False)
    errors: float | Mapping[str, npt.ArrayLike] = field(repr=False)
    body_error: BodyError = field(default_factory=BodyError, repr=False)
    name: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.body, Mesh) != isinstance(self.motion, Motion3D):
            raise ValueError("a mesh moves by a Motion3D, an outline by a Motion")
        label = self.label
        motion = self.frames
        if not np.isfinite(motion).all():
            raise ValueError(f"{label}: a position, angle or velocity is missing")
        rates = motion[:, 3:9] if self.in_space else motion[:, 3:6]
        if not np.abs(rates).any():
            raise ValueError(
                f"{label}: the body never moves; the force of a medium is known where a body moves through it"
            )
        if not np.isfinite(self.measured).any():
            raise ValueError(
                f"{label}: no force was measured; expected {' or '.join(self.components)}"
            )
        if not (self.reading_errors[np.isfinite(self.measured)] > 0).all():
            raise ValueError(f"{label}: the error of each force must be above 0, in N")
        if not self.touches.any():
            raise ValueError(f"{label}: the body is in the air in all {len(motion)} poses")
        poses = int((self.touches & np.isfinite(self.measured).any(axis=0)).sum())
        if poses < FEWEST_POSES:
            raise ValueError(
                f"{label}: {poses} pose with a force in the medium; at least {FEWEST_POSES} are needed: one force "
                "alone cannot be told from an offset of the sensor"
            )

    @property
    def label(self) -> str:
        """Name for people."""
        return self.name or self.body.name

    @property
    def in_space(self) -> bool:
        """Whether the body is a mesh."""
        return isinstance(self.body, Mesh)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the forces."""
        return SPACE if self.in_space else PLANE

    @property
    def frames(self) -> FloatArray:
        """Poses, shape (p, 6), or frames in space, shape (p, 18)."""
        return self.motion.frames if isinstance(self.motion, Motion3D) else self.motion.poses

    @cached_property
    def measured(self) -> FloatArray:
        """Measured forces, N, shape (components, p); NaN where there is none."""
        return self._by_component(self.force, "force")

    @cached_property
    def reading_errors(self) -> FloatArray:
        """Standard errors of the readings, N, shape (components, p)."""
        if isinstance(self.errors, Mapping):
            return self._by_component(self.errors, "errors")
        return np.full(self.measured.shape, float(self.errors))

    def _by_component(
        self, given: Mapping[str, npt.ArrayLike] | pd.DataFrame, what: str
    ) -> FloatArray:
        rows = np.full((len(self.components), len(self.frames)), np.nan)
        for place, name in enumerate(self.components):
            if name not in given:
                continue
            values = np.asarray(given[name], dtype=float)
            if values.shape not in ((), (len(self.frames),)):
                raise ValueError(
                    f"{self.label}: {what} {name}: one number for each of {len(self.frames)} poses expected, "
                    f"found shape {values.shape}"
                )
            rows[place] = values
        return rows

    @cached_property
    def states(self) -> FloatArray:
        """State of the body in each pose, in lengths of its error, shape (p, f)."""
        if isinstance(self.body, Mesh):
            return frame_states(self.body.vertices_cm, self.frames)
        return pose_states(model_error.outline_points(self.body), self.frames)

    @cached_property
    def touches(self) -> npt.NDArray[np.bool_]:
        """Whether a part of the body that leads is in the medium, shape (p,)."""
        profile = TableProfile(np.ones((7, 13)), np.ones((7, 13)))
        return np.asarray(self.load(profile) > 0)

    def load(self, profile: Profile) -> FloatArray:
        """Load without cancellation H in each pose, N, shape (p,)."""
        return np.asarray(self.load_draws(profile)[0])

    def load_draws(self, profile: Profile) -> FloatArray:
        """Load of each of a stack of draws, N, shape (draws, p)."""
        if isinstance(self.body, Mesh) and isinstance(self.motion, Motion3D):
            from rftfit.model.mesh_prediction import mesh_draws

            bare = np.nan_to_num(mesh_draws(profile, self.body, self.motion, "measured", None))
            has_load = bare[..., 9] > 0
            size = model_error.size_of(np.hypot(bare[..., 7], bare[..., 8]))
            return np.asarray(size * has_load, dtype=float)
        assert isinstance(self.body, Outline)
        load = model_error.outline_load(profile, self.body, self.frames, with_centre=False)
        return np.asarray(load.between(0, len(self.frames)).size)

    def force_draws(self, profile: Profile) -> FloatArray:
        """Force by Eq. 2 of each of a stack of draws, N, shape (draws, components, p)."""
        if isinstance(self.body, Mesh) and isinstance(self.motion, Motion3D):
            from rftfit.model.mesh_prediction import mesh_draws

            forces = mesh_draws(profile, self.body, self.motion, "measured", None)[..., :3]
            return np.asarray(forces.swapaxes(1, 2))
        from rftfit.model.forces import force_draws

        assert isinstance(self.body, Outline)
        net = force_draws(profile, self.body, self.frames)
        return np.stack([np.atleast_2d(net.force_z_N), np.atleast_2d(net.force_x_N)], axis=1)

    def weights(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Weights of alpha at the nodes of a map, z then x, shape (components, p, 2 n): Eq. 2 of this body."""
        unit = np.eye(beta.size)
        if not self.in_space:
            # alpha_z makes the vertical force alone, alpha_x the horizontal one
            table = TableProfile(unit, unit, beta, gamma)
            vertical, horizontal = np.moveaxis(self.force_draws(table), 1, 0)
            nothing = np.zeros_like(vertical)
            of_z = np.concatenate([vertical, nothing]).T
            of_x = np.concatenate([nothing, horizontal]).T
            return np.stack([of_z, of_x])
        nothing = np.zeros_like(unit)
        tables = (TableProfile(*alpha, beta, gamma) for alpha in ((unit, nothing), (nothing, unit)))
        forces = np.concatenate([self.force_draws(table) for table in tables])
        return np.moveaxis(forces, 0, -1)


class ContactRows(NamedTuple):
    """Combinations of measured forces that tell of the medium, as numbers with the unit of alpha.

    `weights`: of alpha at the nodes, shape (k, 2 n). `offset`: what the learned error of the bodies adds, for a medium
    of size 1, (k,). `values`, `errors`: what was measured, and its standard error, N/cm^3, (k,).
    """

    weights: FloatArray
    offset: FloatArray
    values: FloatArray
    errors: FloatArray


@dataclass(frozen=True)
class ContactSystem:
    """Contacts as a linear system of the shape of a medium, before the size of the medium is known.

    `mean`: shape of the known media at the nodes, (2 n,). `root`: rows whose products are the covariance about it.
    """

    groups: tuple[_Group, ...]
    mean: FloatArray
    root: FloatArray

    @classmethod
    def of(
        cls, contacts: Sequence[Contact], nodes: Angles, mean: FloatArray, root: FloatArray
    ) -> ContactSystem:
        """Take contacts at nodes (beta, gamma), rad; those of one body share its error."""
        mean_z, mean_x = mean.reshape(2, -1)
        usual = TableProfile(mean_z, mean_x, *nodes)
        of_bodies: dict[int, list[Contact]] = {}
        for contact in contacts:
            of_bodies.setdefault(id(contact.body), []).append(contact)
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

    def rows(self, size: float) -> ContactRows:
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
        return ContactRows(weights / total[:, None], offset / total, values / total, 1 / total)


class _Group(NamedTuple):
    """Contacts of one body: weights (q, 2 n), offset, forces, reading errors and load of size 1 (q,), correlation (q, q)."""

    weights: FloatArray
    offset: FloatArray
    forces: FloatArray
    errors: FloatArray
    load: FloatArray
    correlation: FloatArray

    @classmethod
    def of(cls, contacts: Sequence[Contact], nodes: Angles, usual: Profile) -> _Group:
        body_error = contacts[0].body_error
        states = np.concatenate([contact.states for contact in contacts])
        mean, covariance = body_error.evaluate(states)
        measured = np.concatenate([contact.measured for contact in contacts], axis=1)
        touches = np.concatenate([contact.touches for contact in contacts])
        use = np.isfinite(measured) & touches
        load = np.concatenate([contact.load(usual) for contact in contacts])
        weights = np.concatenate([contact.weights(*nodes) for contact in contacts], axis=1)
        errors = np.concatenate([contact.reading_errors for contact in contacts], axis=1)
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
