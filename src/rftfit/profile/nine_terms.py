"""The nine-term Fourier profile, and the generic one scaled by zeta."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.base import FOURIER, Pack, alpha_from_basis, make_pack
from rftfit.profile.fourier import TERMS, TERMS_Z, basis

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray


@dataclass(frozen=True)
class FourierProfile:
    """Alpha as a sum of nine terms (`rftfit.profile.fourier`).

    Parameters
    ----------
    coefficients : numpy.ndarray, shape (..., 9)
        N/cm^3, in the order of `rftfit.profile.fourier.TERMS`; leading axes are draws.
    name : str, optional
    reason : str, optional
        Why there are no coefficients, where they are NaN.

    Raises
    ------
    ValueError
        If there are not nine coefficients.
    """

    coefficients: FloatArray
    name: str = "nine terms"
    reason: str = ""

    def __post_init__(self) -> None:
        values = np.asarray(self.coefficients, dtype=float)
        if values.ndim == 0 or values.shape[-1] != len(TERMS):
            raise ValueError(f"nine coefficients wanted, found an array of shape {values.shape}")
        object.__setattr__(self, "coefficients", values)
        if not self.reason and np.isnan(values).any():
            object.__setattr__(self, "reason", f"{self.name}: a coefficient is missing")

    @property
    def pack(self) -> Pack:
        """See `rftfit.profile.base.Profile`."""
        if self.coefficients.ndim > 1:
            raise ValueError("a stack of draws has no pack; carry it through as draws")
        return make_pack(FOURIER, self.coefficients)

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.profile.base.Profile`."""
        split = len(TERMS_Z)
        return self.coefficients[..., :split], self.coefficients[..., split:]

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.profile.base.Profile`.

        Parameters
        ----------
        beta, gamma : numpy.ndarray

        Returns
        -------
        basis_z, basis_x : numpy.ndarray
        """
        terms_z, terms_x = basis(beta, gamma)
        unknown = np.isnan(beta) | np.isnan(gamma)  # the constant term would hide it
        terms_z = np.where(unknown, np.nan, terms_z)
        return np.moveaxis(terms_z, 0, -1), np.moveaxis(terms_x, 0, -1)

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.profile.base.Profile`.

        Parameters
        ----------
        beta, gamma : array_like

        Returns
        -------
        alpha_z, alpha_x : numpy.ndarray
        """
        return alpha_from_basis(self, beta, gamma)


def scaled_generic(zeta: npt.ArrayLike, m0: FloatArray, name: str = "generic") -> FourierProfile:
    """Make the profile of a medium known by its scaling factor alone: zeta times generic.

    Parameters
    ----------
    zeta : array_like, shape (...)
        Dimensionless; an array makes a stack of draws.
    m0 : numpy.ndarray, shape (..., 9)
        Generic coefficients; leading axes (draws) go with those of `zeta`.
    name : str, optional

    Returns
    -------
    FourierProfile

    Raises
    ------
    ValueError
        If there are not nine coefficients.
    """
    return FourierProfile(np.asarray(zeta, dtype=float)[..., None] * m0, name)
