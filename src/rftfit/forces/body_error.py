"""Errors of the force model on one body, learned where the body was measured in media whose map is known.

Measured less predicted force, over the load without cancellation, is nearly the same in every medium. This error is
taken as c + o: c belongs to the body, o to the body in this medium. Both are Gaussian processes (Matern 3/2) over the
states of the body: how it is turned, how deep it is and which way it moves. What was learned is a `BodyError`.

Errors are over the load of the body in the same pose (`rftfit.forces.model_error`), so they have no unit. They have
components: one for each force, z and x of an outline, x, y, z of a mesh. A state is a row of f numbers, turn, height
and direction of motion, each over its correlation length: the distance of two rows says how alike their errors are.
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
    """Return the states of an outline in its poses, shape (p, 6): f is cos and sin of its angle, height, x, z, turning.

    `points_cm`: points that span the body, (n, 2). `poses`: x, z (cm), angle (rad) and their rates (per s), shape (p,
    6).
    """
    angle = poses[:, 2]
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _states(points_cm, turn, poses[:, 1], poses[:, 3:5], poses[:, 5:])


def frame_states(points_cm: FloatArray, frames: FloatArray) -> FloatArray:
    """Return the states of a body in space, shape (p, 16): rotation (9), height, velocity (3) and turning (3).

    `points_cm`: points that span the body, (n, 3). `frames`: position (3, cm), velocity (3), rate of turning (3, rad/s)
    and rotation matrix (9), shape (p, 18).
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
    """Return turn, height and direction of motion in each pose, each over its correlation length, side by side: (p, f).

    The distance of two such states is their distance in the Gaussian process of the error. `turn`: shape (p, k),
    numbers whose distance is the angle between two poses, rad, where it is small. `height`: cm, (p,). `velocity`: cm/s,
    (p, 2 or 3). `rate`: of turning, rad/s, (p, 1 or 3). `points_cm`: span the body, by which its length is known.
    """
    length = longest(points_cm)
    # turning moves the ends of a body, which lie half its length from the middle
    moves = np.concatenate([velocity, rate * length / 2], axis=1)
    speed = np.linalg.norm(moves, axis=1, keepdims=True)
    direction = moves / np.where(speed > 0, speed, 1.0)
    angle = np.radians(LENGTH_DEG)
    return np.concatenate(
        [turn / angle, height[:, None] / (LENGTH_BODIES * length), direction / angle], axis=1
    )


def correlation(states: FloatArray, others: FloatArray) -> FloatArray:
    """Return the correlation of the error between states (p, f) and others (q, f), 0 to 1, shape (p, q)."""
    return matern(np.linalg.norm(states[:, None] - others, axis=-1))


def _find_root(covariance: FloatArray) -> FloatArray:
    """Return the Cholesky root (lower triangle) of a covariance, (m, m), whose variances are raised by 1e-8.

    Two equal states make a covariance singular: it has a root only when it is raised.
    """
    raised = covariance + 1e-8 * np.eye(len(covariance))
    return np.asarray(np.linalg.cholesky(raised), dtype=float)


class MeasuredErrors(NamedTuple):
    """Errors of one component of the force that were measured on a body, in the form that predicts those in other states.

    `states`: of the body, shape (m, f). `root`: Cholesky root L of the errors' covariance, (m, m). `whitened`: L^-1
    times the errors, shape (m,).
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

        Shapes (components, p) and (components, p, p). The mean is that of c, given its measured errors (the formulas of
        regression by a Gaussian process); the covariance is what remains unknown of c, and o of a further medium.
        Without a measurement of the body the mean is 0, and there are three equal components, as many as any body
        needs.
        """
        correlations = correlation(states, states)
        of_medium = self.per_medium**2 * correlations
        if not self.measured:
            return np.zeros((3, len(states))), np.broadcast_to(of_medium, (3, *of_medium.shape))
        means, covariances = [], []
        for errors in self.measured:
            # only c is alike between the media of the measurements and a further one
            across = self.common**2 * correlation(states, errors.states)
            solved = np.linalg.solve(errors.root, across.T)
            means.append(solved.T @ errors.whitened)
            covariances.append(self.common**2 * correlations - solved.T @ solved + of_medium)
        return np.stack(means), np.stack(covariances)

    def paths(
        self, states: FloatArray, components: int, draws: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the mean of the error over the load (components, p) and draws of the error (draws, components, p).

        `states`: those of the p poses of a motion, in their order. Long motions are calculated in some poses, evenly
        spread, and are linear between them.
        """
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
        """Sentence for people on what was learned of the error."""
        if not self.media:
            return f"error of the model {self.per_medium:g} of the load, stated: the body was not measured before"
        how = "stated, as the body was measured in one medium" if self.stated else "learned"
        return (
            f"error of the model on this body learned from {', '.join(self.media)}; what is left of one medium "
            f"{self.per_medium:.2f} of the load ({how})"
        )


@dataclass(frozen=True)
class ErrorCurve:
    """Measured errors of the model over the load, of one body along one motion in one medium, from which one learns.

    `label`: name of the medium. `states`: of the body, shape (m, f). `residuals`: measured less predicted force over
    the load, shape (components, m); NaN where none was measured. `noise`: covariance of `residuals` by errors of
    measurement and of alpha, which are no errors of the model, (components, m, m).
    """

    label: str
    states: FloatArray
    residuals: FloatArray
    noise: FloatArray


class _Component(NamedTuple):
    """Measured errors of one component of the force in all media together, and what their covariance is made of, (m, m).

    `states`: shape (m, f). `residuals`: shape (m,), without NaN. `alike`: correlation of c. `alike_in_medium`:
    correlation of o, 0 between media. `noise`: covariance of the noise, 0 between curves.
    """

    states: FloatArray
    residuals: FloatArray
    alike: FloatArray
    alike_in_medium: FloatArray
    noise: FloatArray

    def whiten(self, common: float, per_medium: float) -> tuple[FloatArray, FloatArray]:
        """Return the Cholesky root L of the covariance of the residuals (m, m), and L^-1 times the residuals (m,).

        `common`, `per_medium`: standard deviations of c and of o.
        """
        root = _find_root(
            common**2 * self.alike + per_medium**2 * self.alike_in_medium + self.noise
        )
        return root, np.asarray(np.linalg.solve(root, self.residuals), dtype=float)


def learn_from_curves(curves: Sequence[ErrorCurve]) -> BodyError:
    """Learn what the model gets wrong on a body from its errors in some media, as `rftfit.learn_body_error` returns it.

    The size of c is chosen (`common` of chosen.toml), that of o is the most likely one; from a single curve it cannot
    be told from c, and is the chosen one. Raises ValueError without a curve.
    """
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
    """Return the standard deviation of o with the greatest likelihood.

    It is one of `tried_count` sizes in equal ratios between those of `tried` (chosen.toml). `components`: err
    independently, so that their likelihoods multiply. `common`: standard deviation of c.
    """

    def loss(per_medium: float) -> float:
        """Return twice the negative logarithm of the Gaussian likelihood, but for a constant: log det + chi squared."""
        total = 0.0
        for component in components:
            root, whitened = component.whiten(common, per_medium)
            total += 2 * float(np.log(np.diag(root)).sum()) + float((whitened**2).sum())
        return total

    least, most = _CHOSEN.tried
    return float(min(np.geomspace(least, most, _CHOSEN.tried_count), key=loss))
