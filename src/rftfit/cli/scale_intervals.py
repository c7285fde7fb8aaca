"""Coefficients and alpha of a medium scaled from one penetration test, with their intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.fourier import evaluate
from rftfit.profile.scaling import scale_new_medium

if TYPE_CHECKING:
    from rftfit.cli.scale_sources import Reference
    from rftfit.conventions import FloatArray
    from rftfit.profile.scaling import Scaled

Interval = tuple["FloatArray", "FloatArray", "FloatArray"]
"""Value, lower and upper end."""


def scale_from(reference: Reference, alpha: float, alpha_se: float, confidence: float) -> Scaled:
    """Run the scaling routine.

    Parameters
    ----------
    reference : Reference
    alpha, alpha_se : float
        alpha_z(0, 90 deg) of the new medium and its standard error, N/cm^3.
    confidence : float

    Returns
    -------
    Scaled

    Raises
    ------
    ValueError
        If alpha is not positive and finite, or there are fewer than two reference media.
    """
    return scale_new_medium(alpha, alpha_se, reference.chi, reference.m0, confidence)


def with_interval(
    scaled: Scaled, generic: FloatArray, of_media: FloatArray, confidence: float
) -> Interval:
    """Scale a quantity of the generic profile; its interval is that for one further medium.

    Two errors are joined as independent ones: that of zeta, and how far a medium's own profile lies
    from the generic one, taken from the scatter of the reference media (Student).

    Parameters
    ----------
    scaled : Scaled
    generic : numpy.ndarray, shape (...)
        Of the generic profile, dimensionless.
    of_media : numpy.ndarray, shape (media, ...)
        The same of each reference medium, divided by its zeta.
    confidence : float

    Returns
    -------
    value, lo, hi : numpy.ndarray, shape (...)
        N/cm^3.
    """
    from rftfit.measure.slope import student_quantile

    media = of_media.shape[0]
    spread = of_media.std(axis=0, ddof=1) * np.sqrt(1 + 1 / media)
    shape = student_quantile(confidence, media - 1) * spread * scaled.zeta
    value = scaled.zeta * generic
    ends = np.stack([scaled.zeta_lo * generic, scaled.zeta_hi * generic])
    below, above = value - ends.min(axis=0), ends.max(axis=0) - value
    return value, value - np.hypot(below, shape), value + np.hypot(above, shape)


def coefficients_with_interval(scaled: Scaled, reference: Reference, confidence: float) -> Interval:
    """Nine coefficients of the new medium.

    Parameters
    ----------
    scaled : Scaled
    reference : Reference
    confidence : float

    Returns
    -------
    value, lo, hi : numpy.ndarray, shape (9,)
        N/cm^3.
    """
    return with_interval(scaled, reference.m0, reference.scaled, confidence)


def alpha_with_interval(
    scaled: Scaled, reference: Reference, beta: FloatArray, gamma: FloatArray, confidence: float
) -> tuple[Interval, Interval]:
    """Alpha of the new medium.

    Parameters
    ----------
    scaled : Scaled
    reference : Reference
    beta, gamma : numpy.ndarray
        rad; shapes broadcast to (...).
    confidence : float

    Returns
    -------
    alpha_z, alpha_x : tuple of numpy.ndarray
        Value, lower and upper end, each of shape (...), N/cm^3.
    """
    generic = evaluate(reference.m0, beta, gamma)
    each = [evaluate(own, beta, gamma) for own in reference.scaled]
    return (
        with_interval(scaled, generic[0], np.stack([z for z, _ in each]), confidence),
        with_interval(scaled, generic[1], np.stack([x for _, x in each]), confidence),
    )
