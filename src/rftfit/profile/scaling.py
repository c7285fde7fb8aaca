"""Scaling between media: zeta, chi, the generic M0, and the routine for a new medium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.fourier import TERMS_Z

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray


def vertical_penetration(coefficients: FloatArray) -> FloatArray:
    """alpha_z of the fit at (beta, gamma) = (0, 90 deg): A00 + A10 + B11 + B01 + Bm1.

    Its number in N/cm^3 is the scaling factor zeta.

    Parameters
    ----------
    coefficients : numpy.ndarray, shape (..., 9)
        N/cm^3.

    Returns
    -------
    numpy.ndarray, shape (...)
        N/cm^3.
    """
    result: FloatArray = coefficients[..., : len(TERMS_Z)].sum(axis=-1)
    return result


def generic(coefficients: FloatArray) -> FloatArray:
    """Average M_i / zeta_i over the media: the generic coefficients M0.

    Parameters
    ----------
    coefficients : numpy.ndarray, shape (..., media, 9)
        N/cm^3.

    Returns
    -------
    numpy.ndarray, shape (..., 9)
        Dimensionless; alpha_z(0, 90 deg) is 1.
    """
    zeta = vertical_penetration(coefficients)
    result: FloatArray = (coefficients / zeta[..., None]).mean(axis=-2)
    return result


@dataclass(frozen=True)
class Scaled:
    """A new medium by the scaling routine; each quantity with its interval.

    Parameters
    ----------
    zeta, zeta_lo, zeta_hi : float
        Dimensionless.
    chi, chi_lo, chi_hi : float
        The ratio that was used; its interval is that for one further medium.
    coefficients : numpy.ndarray, shape (9,)
        zeta times M0, N/cm^3.
    """

    zeta: float
    zeta_lo: float
    zeta_hi: float
    chi: float
    chi_lo: float
    chi_hi: float
    coefficients: FloatArray


def scale_new_medium(
    alpha: float, alpha_se: float, chi: FloatArray, m0: FloatArray, confidence: float = 0.95
) -> Scaled:
    """Turn one vertical penetration of a flat plate into a whole medium.

    zeta = alpha_z(0, 90 deg) / chi with the mean chi of the reference media, alpha = zeta times the
    generic profile (supplement, scaling routine). The interval takes the scatter of chi between
    media for that of a further medium (Student, sample of the reference media) and adds the error
    of the test itself.

    Parameters
    ----------
    alpha : float
        Measured slope, N/cm^3.
    alpha_se : float
        Its standard error, N/cm^3; 0 if not known.
    chi : numpy.ndarray, shape (media,)
        Of the reference media, at least two.
    m0 : numpy.ndarray, shape (9,)
        Generic coefficients.
    confidence : float, optional
        Level of the intervals.

    Returns
    -------
    Scaled

    Raises
    ------
    ValueError
        If alpha is not positive and finite, its standard error is negative or NaN, or there are
        fewer than two chi or one that is not positive.
    """
    from rftfit.measure.slope import student_quantile

    if not (np.isfinite(alpha) and alpha > 0):
        raise ValueError(f"alpha_z(0, 90 deg) must be a positive number of N/cm^3, found {alpha:g}")
    if not alpha_se >= 0:
        raise ValueError(
            f"the standard error of alpha_z must be 0 or more N/cm^3, found {alpha_se:g}"
        )
    if not (np.isfinite(chi) & (chi > 0)).all():
        raise ValueError("every chi must be a positive number")
    if chi.size < 2:
        raise ValueError(f"the scatter of chi needs at least two reference media, found {chi.size}")
    # ratios: means and intervals on the logarithm keep zeta positive and treat 1/chi alike
    centre = float(chi.mean())
    spread = float(np.log(chi).std(ddof=1)) * np.sqrt(1 + 1 / chi.size)
    half_chi = float(student_quantile(confidence, chi.size - 1)) * spread
    relative = alpha_se / alpha
    total = float(np.hypot(spread, relative))
    half = 0.0
    if total > 0:
        dof = total**4 / (spread**4 / (chi.size - 1) + relative**4 / 1e3)
        half = float(student_quantile(confidence, dof)) * total
    zeta = alpha / centre
    return Scaled(
        zeta, zeta * np.exp(-half), zeta * np.exp(half),
        centre, centre * np.exp(-half_chi), centre * np.exp(half_chi),
        zeta * m0,
    )  # fmt: skip
