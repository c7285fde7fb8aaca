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

from rftfit.conventions import FloatArray
from rftfit.forces.model_error import LENGTH_BODIES, LENGTH_DEG, longest
from rftfit.model.draws import SEED_OF_MODEL_ERRORS, choose_evenly
from rftfit.model.prior import matern
from rftfit.store.chosen import chosen

_CHOSEN = chosen("forces", "body_error")

UNKNOWN = round(
    math.hypot(_CHOSEN.common * math.sqrt(1 + 1 / _CHOSEN.bodies), _CHOSEN.per_medium), 2
)
"""Standard deviation of the error of a body that was measured nowhere: c for one more body than those from which its
size was chosen, and o."""


def pose_states(points_cm: FloatArray, poses: FloatArray) -> FloatArray:
    """Return the states of an outline in its poses (p, 6), as `_states`, shape (p, f).

    Poses hold x, z, angle and their rates.
    """
    angle = poses[:, 2]
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _states(points_cm, turn, poses[:, 1], poses[:, 3:5], poses[:, 5:])


def frame_states(points_cm: FloatArray, frames: FloatArray) -> FloatArray:
    """Return the states of a body in space in its frames (p, 18), as `_states`, shape (p, f).

    Frames hold position, velocity, rate and rotation matrix.
    """
    # a small turn changes a rotation matrix by the root of 2 times its angle
    turn = frames[:, 9:] / np.sqrt(2)
    return _states(points_cm, turn, frames[:, 2], frames[:, 3:6], frames[:, 6:9])


def _states(
    points_cm: FloatArray,
    turn: FloatArray,
    height: FloatArray,
    velocity: FloatArray,
    rate: FloatArray,
) -> FloatArray:
    """Return turn, height and direction of motion in each pose, each over its correlation length, side by side.

    The distance of two such states is their distance in the Gaussian process of the error.
    """
    length = longest(points_cm)
    moves = np.concatenate([velocity, rate * length / 2], axis=1)
    speed = np.linalg.norm(moves, axis=1, keepdims=True)
    direction = moves / np.where(speed > 0, speed, 1.0)
    angle = np.radians(LENGTH_DEG)
    return np.concatenate(
        [turn / angle, height[:, None] / (LENGTH_BODIES * length), direction / angle], axis=1
    )


def correlation(states: FloatArray, others: FloatArray) -> FloatArray:
    """Return the correlation of the error between states (p, f) and others (q, f), shape (p, q)."""
    return matern(np.linalg.norm(states[:, None] - others, axis=-1))


def _find_root(covariance: FloatArray) -> FloatArray:
    """Return the Cholesky root of a covariance, whose variances are raised by 1e-8 so that it has one."""
    raised = covariance + 1e-8 * np.eye(len(covariance))
    return np.asarray(np.linalg.cholesky(raised), dtype=float)


class MeasuredErrors(NamedTuple):
    """Errors over the load that were measured of one component of the force.

    `states`: of the body, shape (m, f). `root`: Cholesky root L of the errors' covariance. `whitened`: L^-1 times the
    errors, shape (m,).
    """

    states: FloatArray
    root: FloatArray
    whitened: FloatArray


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
    measured : tuple of MeasuredErrors
        Errors that were measured, by component of the force. Empty: nothing is known but the size of the error.

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
    measured: tuple[MeasuredErrors, ...] = field(default=(), repr=False)

    def evaluate(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance of the error over the load in some states (p, f), by component of the force.

        Shapes (components, p) and (components, p, p): c given its measured errors, and o of a further medium. Without a
        measurement of the body there are three equal components.
        """
        correlations = correlation(states, states)
        of_medium = self.per_medium**2 * correlations
        if not self.measured:
            return np.zeros((3, len(states))), np.broadcast_to(of_medium, (3, *of_medium.shape))
        means, covariances = [], []
        for errors in self.measured:
            across = self.common**2 * correlation(states, errors.states)
            solved = np.linalg.solve(errors.root, across.T)
            means.append(solved.T @ errors.whitened)
            covariances.append(self.common**2 * correlations - solved.T @ solved + of_medium)
        return np.stack(means), np.stack(covariances)

    def paths(
        self, states: FloatArray, components: int, draws: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the mean of the error over the load (components, p) and draws of the error (draws, components, p)."""
        count = len(states)
        calculated = choose_evenly(count, _CHOSEN.most_path)
        mean, covariance = self.evaluate(states[calculated])
        every = np.arange(count)
        # weights of the calculated states in all states, linear between them: shape (calculated, p)
        weights = np.stack([np.interp(every, calculated, unit) for unit in np.eye(calculated.size)])
        random = np.random.default_rng(SEED_OF_MODEL_ERRORS)
        half = random.standard_normal(((draws + 1) // 2, components, calculated.size))
        # with each draw its negative is used: the mean of all draws is the mean
        normals = np.concatenate([half, -half])[:draws]
        drawn = np.empty((draws, components, count))
        for component in range(components):
            root = _find_root(covariance[component])
            drawn[:, component] = normals[:, component] @ root.T @ weights
        mean = mean[:components] @ weights
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
    """Errors of the model over the load, of one body in one medium.

    `label`: name of the medium. `states`: of the body, shape (m, f). `residuals`: the errors, shape (components, m); NaN
    where none was measured. `noise`: covariance of the errors of measurement and alpha in them, (components, m, m).
    """

    label: str
    states: FloatArray
    residuals: FloatArray
    noise: FloatArray


class _Component(NamedTuple):
    """Errors of one component of the force in all media, shape (m,), and what their covariance is made of, (m, m).

    `alike`: correlation of c. `alike_in_medium`: correlation of o, 0 between media. `noise`: covariance of the noise.
    """

    states: FloatArray
    residuals: FloatArray
    alike: FloatArray
    alike_in_medium: FloatArray
    noise: FloatArray

    def whiten(self, common: float, per_medium: float) -> tuple[FloatArray, FloatArray]:
        """Return the Cholesky root L of the covariance of the residuals, and L^-1 times the residuals."""
        root = _find_root(
            common**2 * self.alike + per_medium**2 * self.alike_in_medium + self.noise
        )
        return root, np.asarray(np.linalg.solve(root, self.residuals), dtype=float)


def learn_from_curves(curves: Sequence[ErrorCurve]) -> BodyError:
    """Learn what the model gets wrong on a body from its errors in some media, as `learn_body_error` returns it."""
    from scipy.linalg import block_diag

    if not curves:
        raise ValueError("a body's error is learned from at least one measurement")
    states = np.concatenate([curve.states for curve in curves])
    medium = np.repeat(np.arange(len(curves)), [len(curve.states) for curve in curves])
    alike = correlation(states, states)
    alike_in_medium = alike * (medium[:, None] == medium)
    components = []
    for number in range(len(curves[0].residuals)):
        residuals = np.concatenate([curve.residuals[number] for curve in curves])
        noise = block_diag(*(curve.noise[number] for curve in curves))
        measured = np.flatnonzero(np.isfinite(residuals))
        square = np.ix_(measured, measured)
        components.append(
            _Component(
                states[measured],
                residuals[measured],
                alike[square],
                alike_in_medium[square],
                noise[square],
            )
        )
    common, stated = _CHOSEN.common, len(curves) == 1
    per_medium = _CHOSEN.per_medium
    if not stated:
        per_medium = max(_most_likely(components, common), _CHOSEN.least_per_medium)
    errors = tuple(
        MeasuredErrors(component.states, *component.whiten(common, per_medium))
        for component in components
    )
    media = tuple(dict.fromkeys(curve.label for curve in curves))
    return BodyError(common, per_medium, media, stated, errors)


def _most_likely(components: Sequence[_Component], common: float) -> float:
    """Find the standard deviation of o with the greatest likelihood, among sizes in equal ratios."""

    def loss(per_medium: float) -> float:
        """Return twice the negative logarithm of the likelihood, but for a constant."""
        total = 0.0
        for component in components:
            root, whitened = component.whiten(common, per_medium)
            total += 2 * float(np.log(np.diag(root)).sum()) + float((whitened**2).sum())
        return total

    least, most = _CHOSEN.tried
    return float(min(np.geomspace(least, most, _CHOSEN.tried_count), key=loss))
