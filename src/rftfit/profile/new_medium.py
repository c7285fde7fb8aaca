"""Interval of anything that is scaled from the generic profile to one further medium."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.profile.scaling import Scaled

Interval = tuple["FloatArray", "FloatArray", "FloatArray"]
"""Value, lower and upper end."""


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
