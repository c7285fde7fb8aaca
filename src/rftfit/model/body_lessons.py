"""Learn what the force model gets wrong on a body from forces on it in media whose map is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.model.body_error import (
    COMMON,
    JITTER,
    PER_MEDIUM,
    BodyError,
    IntArray,
    MeasuredErrors,
    correlation,
)
from rftfit.model.contacts import Contact
from rftfit.model.known import profile_of
from rftfit.model.profiles import KnownMedium, Profile

LEAST_PER_MEDIUM = 0.15
"""Of o at least: from three media or fewer of one material it is estimated too small."""

MOST_STATES = 45
"""Poses of a measured curve that are used: neighbours tell the same."""

_SIZES = np.exp(np.linspace(np.log(0.03), np.log(1.2), 24))
"""Standard deviations that are tried."""


def learn_body_error(measurements: Sequence[tuple[Contact, KnownMedium | str | Path]]) -> BodyError:
    """Learn what the model gets wrong on a body from forces on it in media whose map is known.

    Parameters
    ----------
    measurements : sequence of (Contact, medium)
        Forces on the same body, named after the medium, and the medium as `predict` takes it, best its map from plates: at
        least one.

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


def learn_from_curves(curves: Sequence[ErrorCurve]) -> BodyError:
    """Learn what the model gets wrong on a body from its errors in some media: `learn_body_error`."""
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
        noise = np.zeros_like(alike)
        start = 0
        for curve in curves:
            stop = start + len(curve.states)
            noise[start:stop, start:stop] = curve.noise[component]
            start = stop
        places = np.flatnonzero(np.isfinite(values))
        square = np.ix_(places, places)
        systems.append(
            (places, values[places], alike[square], (alike * same_medium)[square], noise[square])
        )
    common, stated = COMMON, len(curves) == 1
    per_medium = PER_MEDIUM if stated else max(_most_likely(systems, common), LEAST_PER_MEDIUM)
    seen = []
    for places, values, alike_of_body, alike_in_medium, noise in systems:
        covariance = common**2 * alike_of_body + per_medium**2 * alike_in_medium + noise
        root = np.linalg.cholesky(covariance + JITTER * np.eye(len(covariance)))
        seen.append((places, root, np.linalg.solve(root, values)))
    media = tuple(dict.fromkeys(curve.label for curve in curves))
    return BodyError(common, per_medium, media, stated, MeasuredErrors(states, tuple(seen)))


def _most_likely(
    systems: Sequence[tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]],
    common: float,
) -> float:
    """Standard deviation of o with the greatest likelihood."""

    def loss(per_medium: float) -> float:
        total = 0.0
        for _, values, alike, in_medium, noise in systems:
            covariance = common**2 * alike + per_medium**2 * in_medium + noise
            root = np.linalg.cholesky(covariance + JITTER * np.eye(values.size))
            total += 2 * float(np.log(np.diag(root)).sum())
            total += float((np.linalg.solve(root, values) ** 2).sum())
        return total

    return float(min(_SIZES, key=loss))


@dataclass(frozen=True)
class ErrorCurve:
    """Errors of the model over the load in one measurement, shape (components, m), and their covariance (components, m, m)."""

    label: str
    states: FloatArray
    residuals: FloatArray
    noise: FloatArray


def error_curve(contact: Contact, profile: Profile) -> ErrorCurve:
    """Measured forces less those by the map of the medium, over the load; `ValueError` if a pose has no number."""
    where = np.flatnonzero(contact.touches & np.isfinite(contact.measured).any(axis=0))
    if where.size > MOST_STATES:
        where = where[np.linspace(0, where.size - 1, MOST_STATES).round().astype(int)]
    load = contact.load(profile)[where]
    best = contact.force_draws(profile)[0][:, where]
    if not np.isfinite(best).all():
        raise ValueError(f"{contact.label}: {profile.reason or 'no number'}")
    residuals = (contact.measured[:, where] - best) / load
    noise = []
    spread = profile.spread
    drawn = contact.force_draws(spread)[..., where] if isinstance(spread, Profile) else None
    for component in range(len(best)):
        reading = np.diag(np.nan_to_num(contact.reading_errors[component, where] / load) ** 2)
        if drawn is not None:
            off = (drawn[:, component] - drawn[:, component].mean(axis=0)) / load
            reading = reading + off.T @ off / (len(off) - 1)
        noise.append(reading)
    return ErrorCurve(contact.label, contact.states[where], residuals, np.stack(noise))
