"""Errors of the force model on one body, learned where the body was measured in media whose map is known.

Measured less predicted force, over the load without cancellation, is nearly the same in every medium. This error is
taken as c + o: c belongs to the body, o to the body in this medium. Both are Gaussian processes (Matern 3/2) over the
states of the body: how it is turned, how deep it is and which way it moves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.forces.model_error import LENGTH_BODIES, LENGTH_DEG, longest
from rftfit.model.draws import SEED_OF_MODEL_ERRORS, choose_evenly
from rftfit.model.prior import matern
from rftfit.store.chosen import chosen

_CHOSEN = chosen("forces", "body_error")

IntArray = npt.NDArray[np.intp]

UNKNOWN = round(
    math.hypot(_CHOSEN.common * math.sqrt(1 + 1 / _CHOSEN.bodies), _CHOSEN.per_medium), 2
)
"""Standard deviation of the error of a body that was measured nowhere: c for one more body than those from which its
size was chosen, and o."""


def pose_states(points_cm: FloatArray, poses: FloatArray) -> FloatArray:
    """States of an outline in its poses (p, 6), in lengths of the error, shape (p, f)."""
    angle = poses[:, 2]
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _states(points_cm, turn, poses[:, 1], poses[:, 3:5], poses[:, 5:])


def frame_states(points_cm: FloatArray, frames: FloatArray) -> FloatArray:
    """States of a body in space in its frames (p, 18), in lengths of the error, shape (p, f)."""
    turn = frames[:, 9:] / np.sqrt(2)
    return _states(points_cm, turn, frames[:, 2], frames[:, 3:6], frames[:, 6:9])


def _states(
    points_cm: FloatArray,
    turn: FloatArray,
    height: FloatArray,
    velocity: FloatArray,
    rate: FloatArray,
) -> FloatArray:
    """State in each pose: turn, height and direction of motion of the body, in lengths of the error."""
    length = longest(points_cm)
    moves = np.concatenate([velocity, rate * length / 2], axis=1)
    speed = np.linalg.norm(moves, axis=1, keepdims=True)
    way = moves / np.where(speed > 0, speed, 1.0)
    step = np.radians(LENGTH_DEG)
    return np.concatenate(
        [turn / step, height[:, None] / (LENGTH_BODIES * length), way / step], axis=1
    )


def correlation(states: FloatArray, others: FloatArray) -> FloatArray:
    """Correlation of the error between states (p, f) and others (q, f), shape (p, q)."""
    return matern(np.linalg.norm(states[:, None] - others, axis=-1))


def _find_root(covariance: FloatArray) -> FloatArray:
    """Return the Cholesky root of a covariance, whose variances are raised by 1e-8 so that it has one."""
    raised = covariance + 1e-8 * np.eye(len(covariance))
    return np.asarray(np.linalg.cholesky(raised), dtype=float)


class MeasuredErrors(NamedTuple):
    """Errors of a body over the load in states (m, f).

    `by_component`: numbers of the states with a measured error, Cholesky root of the errors' covariance, and the
    inverse of this root times the errors.
    """

    states: FloatArray
    by_component: tuple[tuple[IntArray, FloatArray, FloatArray], ...]


@dataclass(frozen=True, eq=False)
class BodyError:
    """Relative error of the force model on one body: made by `rftfit.learn_body_error`.

    Parameters
    ----------
    common, per_medium : float
        Standard deviations over the load: of the part of the error that is the same in every medium, and of the part
        that is another one in each. Default: nothing was learned, and the whole error is another one in each medium.
    media : tuple of str
        Media in which the body was measured.
    stated : bool
        True where `per_medium` is stated, as for a body that was measured in one medium, and not learned.
    measured : MeasuredErrors, optional
        Errors that were measured. None: nothing is known but the size of the error.

    Examples
    --------
    >>> import rftfit
    >>> rftfit.BodyError().per_medium
    0.42
    """

    common: float = 0.0
    per_medium: float = UNKNOWN
    media: tuple[str, ...] = ()
    stated: bool = True
    measured: MeasuredErrors | None = field(default=None, repr=False)

    def evaluate(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance of the error over the load in some states (p, f), by component.

        Shapes (components, p) and (components, p, p). Without a measurement of the body there are three equal
        components.
        """
        of_medium = self.per_medium**2 * correlation(states, states)
        if self.measured is None:
            return np.zeros((3, len(states))), np.broadcast_to(of_medium, (3, *of_medium.shape))
        means, covariances = [], []
        for places, root, whitened in self.measured.by_component:
            across = self.common**2 * correlation(states, self.measured.states[places])
            solved = np.linalg.solve(root, across.T)
            means.append(solved.T @ whitened)
            left = self.common**2 * correlation(states, states) - solved.T @ solved
            covariances.append(left + of_medium)
        return np.stack(means), np.stack(covariances)

    def paths(
        self, states: FloatArray, components: int, draws: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the mean of the error over the load (components, p) and draws of the error (draws, components, p)."""
        count = len(states)
        places = choose_evenly(count, _CHOSEN.most_path)
        mean, covariance = self.evaluate(states[places])
        every = np.arange(count)
        # linear between the states that were calculated
        shares = np.stack([np.interp(every, places, unit) for unit in np.eye(places.size)])
        random = np.random.default_rng(SEED_OF_MODEL_ERRORS)
        half = random.standard_normal(((draws + 1) // 2, components, places.size))
        normals = np.concatenate([half, -half])[:draws]
        drawn = np.empty((draws, components, count))
        for component in range(components):
            root = _find_root(covariance[component])
            drawn[:, component] = normals[:, component] @ root.T @ shares
        mean = mean[:components] @ shares
        return mean, mean + drawn

    @cached_property
    def words(self) -> str:
        """Sentence on what was learned of the error."""
        if not self.media:
            return f"error of the model {self.per_medium:g} of the load, stated: the body was not measured before"
        how = "stated, as the body was measured in one medium" if self.stated else "learned"
        return (
            f"error of the model on this body learned from {', '.join(self.media)}; what is left of one medium "
            f"{self.per_medium:.2f} of the load ({how})"
        )


@dataclass(frozen=True)
class ErrorCurve:
    """Errors of the model over the load in one measurement, shape (components, m), and their covariance (components, m, m)."""

    label: str
    states: FloatArray
    residuals: FloatArray
    noise: FloatArray


def learn_from_curves(curves: Sequence[ErrorCurve]) -> BodyError:
    """Learn what the model gets wrong on a body from its errors in some media, as `learn_body_error` returns it."""
    from scipy.linalg import block_diag

    if not curves:
        raise ValueError("a body's error is learned from at least one measurement")
    states = np.concatenate([curve.states for curve in curves])
    medium = np.concatenate([np.full(len(curve.states), k) for k, curve in enumerate(curves)])
    components = len(curves[0].residuals)
    alike = correlation(states, states)
    same_medium = medium[:, None] == medium
    systems = []
    for component in range(components):
        values = np.concatenate([curve.residuals[component] for curve in curves])
        noise = block_diag(*(curve.noise[component] for curve in curves))
        places = np.flatnonzero(np.isfinite(values))
        square = np.ix_(places, places)
        systems.append(
            (places, values[places], alike[square], (alike * same_medium)[square], noise[square])
        )
    common, stated = _CHOSEN.common, len(curves) == 1
    per_medium = (
        _CHOSEN.per_medium
        if stated
        else max(_most_likely(systems, common), _CHOSEN.least_per_medium)
    )
    by_component = []
    for places, values, alike_of_body, alike_in_medium, noise in systems:
        covariance = common**2 * alike_of_body + per_medium**2 * alike_in_medium + noise
        root = _find_root(covariance)
        by_component.append((places, root, np.linalg.solve(root, values)))
    media = tuple(dict.fromkeys(curve.label for curve in curves))
    return BodyError(common, per_medium, media, stated, MeasuredErrors(states, tuple(by_component)))


def _most_likely(
    systems: Sequence[tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]],
    common: float,
) -> float:
    """Find the standard deviation of o with the greatest likelihood, among sizes in equal ratios."""

    def loss(per_medium: float) -> float:
        """Twice the negative logarithm of the likelihood, but for a constant."""
        total = 0.0
        for _, values, alike, in_medium, noise in systems:
            covariance = common**2 * alike + per_medium**2 * in_medium + noise
            root = _find_root(covariance)
            total += 2 * float(np.log(np.diag(root)).sum())
            total += float((np.linalg.solve(root, values) ** 2).sum())
        return total

    least, most = _CHOSEN.tried
    return float(min(np.geomspace(least, most, _CHOSEN.tried_count), key=loss))
