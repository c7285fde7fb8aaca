"""Coefficients and alpha of a medium scaled from one penetration test, with their intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.fourier import evaluate
from rftfit.profile.new_medium import Interval, with_interval
from rftfit.profile.scaling import scale_new_medium

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.profile.reference_media import Reference
    from rftfit.profile.scaling import Scaled


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
