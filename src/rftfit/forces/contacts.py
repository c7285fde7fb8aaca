"""Contacts: measured forces on legs, wheels, feet, checked; observations of a map, or errors of the model on bodies.

They are observations of a map (`rftfit.model.observations` has their rows in its linear system), or show the
errors of the model on a body. These are smooth over the states of the body: a state that comes again has the same
error.

Arrays of forces have shape (components, p): z and x of an outline, x, y, z of a mesh, in p poses; N, of the medium on
the body, up and toward +x positive. Relative errors are over the load: the sum of the sizes of the forces on all parts
of the body, N, which does not cancel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.forces.bodies import set_in_motion
from rftfit.forces.body_error import BodyError, ErrorCurve, learn_from_curves
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion
from rftfit.forces.moving import BodyInMotion, rates_of
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import QUANTITIES
from rftfit.model.draws import choose_evenly
from rftfit.model.known import profile_of
from rftfit.model.profiles import KnownMedium, Profile, TableProfile
from rftfit.store.chosen import chosen

if TYPE_CHECKING:
    import pandas as pd

FEWEST_POSES = 2
"""Fewest poses with a force in a contact: one force alone cannot be told from an offset of the sensor."""


@dataclass(frozen=True, eq=False)
class Contact:
    """Measured forces on a body that moves through a medium.

    Parameters
    ----------
    body : Outline or Mesh
    motion : Motion or Motion3D
        Poses of the body: a `Motion` for an outline, a `Motion3D` for a mesh.
    force : mapping of str to array_like, shape (p,), or pandas.DataFrame
        Measured forces of the medium on the body, N: ``force_z_N``, ``force_x_N``, of a mesh also ``force_y_N``. A
        direction that was not measured is left out; a pose that was not measured is NaN. A table of `predict` has this
        form.
    errors : float or mapping of str to array_like
        Standard error of a reading, N, which contains the scatter from bed to bed.
    body_error : BodyError, optional
        What the model gets wrong on this body, learned where it was measured before (`learn_body_error`). Default:
        nothing is known of that error but its size, 0.42 of the load.
    name : str, optional
        Name for people; default: the name of the body.

    Raises
    ------
    TypeError
        If the motion of a mesh is no `Motion3D`, or that of an outline is one.
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
        """Refuse forces from which nothing of a medium can be learned, with ValueError."""
        label = self.label
        motion = self.frames
        if not np.isfinite(motion).all():
            raise ValueError(f"{label}: a position, angle or velocity is missing")
        if not rates_of(motion).any():
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

    @cached_property
    def moving(self) -> BodyInMotion:
        """The body in its motion, by which its forces are integrated; a moment is not an observation."""
        return set_in_motion(self.body, self.motion, quantities=QUANTITIES[:2])

    @property
    def components(self) -> tuple[str, ...]:
        """Columns of the forces that may be measured on the body, in the order of the arrays' first axis."""
        return self.moving.force_names

    @property
    def frames(self) -> FloatArray:
        """Poses of an outline, shape (p, 6), or frames of a mesh, shape (p, 18)."""
        return self.moving.poses

    @cached_property
    def measured(self) -> FloatArray:
        """Measured forces, N, shape (components, p); NaN where there is none."""
        return self._by_component(self.force, "force")

    @cached_property
    def reading_errors(self) -> FloatArray:
        """Standard errors of the readings, N, shape (components, p), the same for all where one number was given."""
        if isinstance(self.errors, Mapping):
            return self._by_component(self.errors, "errors")
        return np.full(self.measured.shape, float(self.errors))

    def _by_component(
        self, given: Mapping[str, npt.ArrayLike] | pd.DataFrame, what: str
    ) -> FloatArray:
        """Return forces or errors by component and pose, shape (components, p); NaN where none is given.

        `given`: by the column of the force; one number stands for all poses. `what`: name of the argument, for
        messages.
        """
        rows = np.full((len(self.components), len(self.frames)), np.nan)
        for component, name in enumerate(self.components):
            if name not in given:
                continue
            numbers = np.asarray(given[name], dtype=float)
            if numbers.shape not in ((), (len(self.frames),)):
                raise ValueError(
                    f"{self.label}: {what} {name}: one number for each of {len(self.frames)} poses expected, "
                    f"found shape {numbers.shape}"
                )
            rows[component] = numbers
        return rows

    @cached_property
    def states(self) -> FloatArray:
        """Turn, height and direction of motion in each pose, as `BodyError.evaluate` takes them, shape (p, f)."""
        return self.moving.states

    @cached_property
    def touches(self) -> npt.NDArray[np.bool_]:
        """True for each pose in which a part of the body that leads is in the medium, shape (p,)."""
        # with alpha 1 in all directions a pose has a load wherever a part of the body can bear one
        profile = TableProfile(np.ones((7, 13)), np.ones((7, 13)))
        return self.load(profile) > 0

    def load(self, profile: Profile) -> FloatArray:
        """Return the load without cancellation, H of `rftfit.forces.model_error`, by one profile, N, shape (p,)."""
        return np.asarray(self.moving.load_size(profile)[0])

    def force_draws(self, profile: Profile) -> FloatArray:
        """Return the forces by Eq. 2 for each of a stack of draws, N, shape (draws, components, p)."""
        return self.moving.force_draws(profile)

    def weights(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Return the weights of alpha at the n nodes of a map in each force, alpha_z then alpha_x: (components, p, 2 n).

        `beta`, `gamma`: directions of the nodes, rad, (n,). Eq. 2 is linear in alpha: the weight of a node, cm^3, is
        the force where alpha is 1 there and 0 at all others.
        """
        unit = np.eye(beta.size)
        nothing = np.zeros_like(unit)
        # two stacks of n "draws", each with alpha 1 at one node: of alpha_z, then of alpha_x
        tables = (TableProfile(*alpha, beta, gamma) for alpha in ((unit, nothing), (nothing, unit)))
        forces = np.concatenate([self.force_draws(table) for table in tables])
        return np.moveaxis(forces, 0, -1)


def learn_body_error(measurements: Sequence[tuple[Contact, KnownMedium | str | Path]]) -> BodyError:
    """Learn what the model gets wrong on a body from forces on it in media whose map is known.

    Parameters
    ----------
    measurements : sequence of (Contact, medium)
        At least one pair: forces on the same body, named after the medium, and the medium as `predict` takes it, best
        its map from plates.

    Returns
    -------
    BodyError
        Its `per_medium` is learned from two media or more and at least 0.15; from one it is stated.

    Raises
    ------
    ValueError
        If there is no measurement, or a profile has no number in a pose.

    Examples
    --------
    >>> import rftfit
    >>> rows = rftfit.published_table("fig_s5").query("medium == 'poppy_LP' and leg == 'c_leg'")
    >>> leg, motion = rftfit.model_leg("c_leg"), rftfit.rotation(rows["theta_deg"])
    >>> turned = rftfit.Contact(leg, motion, rows, errors=0.1)
    >>> rftfit.learn_body_error([(turned, rftfit.published_medium("poppy_LP"))]).per_medium
    0.17
    """
    return learn_from_curves(
        [error_curve(contact, profile_of(medium)) for contact, medium in measurements]
    )


def error_curve(contact: Contact, profile: Profile) -> ErrorCurve:
    """Return measured less predicted forces over the load, and their covariance.

    At most `most_states` poses (chosen.toml), evenly spread, are taken: neighbours say the same. Poses in the air and
    without a measured force are left out, since their load is 0. The covariance holds the errors of the readings and of
    alpha, which are no errors of the model. Raises ValueError where a pose has no number.
    """
    poses = np.flatnonzero(contact.touches & np.isfinite(contact.measured).any(axis=0))
    poses = poses[choose_evenly(poses.size, chosen("forces", "body_error").most_states)]
    load = contact.load(profile)[poses]
    best = contact.force_draws(profile)[0][:, poses]
    if not np.isfinite(best).all():
        raise ValueError(f"{contact.label}: {profile.reason or 'no number'}")
    residuals = (contact.measured[:, poses] - best) / load
    reading_errors = np.nan_to_num(contact.reading_errors[:, poses] / load)
    # readings err independently of one another; alpha errs in all poses together
    noise = np.stack([np.diag(variances) for variances in reading_errors**2])
    if isinstance(profile.spread, Profile):
        drawn = contact.force_draws(profile.spread)[..., poses] / load
        noise += [np.cov(drawn[:, component], rowvar=False) for component in range(len(best))]
    return ErrorCurve(contact.label, contact.states[poses], residuals, noise)
