"""The depth-only model: the baseline that knows depth and projected area, but no angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.base import DEPTH_ONLY, Pack, alpha_from_basis, make_pack

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray
    from rftfit.profile.base import Profile

STILL = 1e-12
"""A velocity component below this part of the speed is none: rounding does not choose its side."""


@dataclass(frozen=True)
class DepthOnlyProfile:
    """Each component opposes its own velocity component, whatever the angles (design section 2).

    alpha_z = alpha_z(0, pi/2) |cos beta| going down, alpha_z(0, -pi/2) |cos beta| going up, 0 in
    purely horizontal motion; alpha_x = alpha_x(pi/2, 0) |sin beta| going toward -x, its negative
    going toward +x, 0 in purely vertical motion.

    Parameters
    ----------
    values : numpy.ndarray, shape (..., 3)
        alpha_z(0, pi/2), alpha_z(0, -pi/2) (negative: it pulls down what goes up) and
        alpha_x(pi/2, 0), N/cm^3; leading axes are draws.
    name : str, optional
    reason : str, optional
        Why a value is missing.

    Raises
    ------
    ValueError
        If there are not three values.
    """

    values: FloatArray
    name: str = "depth-only"
    reason: str = ""

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=float)
        if values.ndim == 0 or values.shape[-1] != 3:
            raise ValueError(f"three values wanted, found an array of shape {values.shape}")
        object.__setattr__(self, "values", values)

    @classmethod
    def of(cls, profile: Profile, name: str = "depth-only") -> DepthOnlyProfile:
        """Take the three values from another profile (measured: from the table).

        Parameters
        ----------
        profile : Profile
            One, or a stack of draws.
        name : str, optional

        Returns
        -------
        DepthOnlyProfile
        """
        alpha_z, alpha_x = profile.alpha([0.0, 0.0, np.pi / 2], [np.pi / 2, -np.pi / 2, 0.0])
        values = np.concatenate([alpha_z[..., :2], alpha_x[..., 2:]], axis=-1)
        return cls(values, name, profile.reason if np.isnan(values).any() else "")

    @property
    def pack(self) -> Pack:
        """See `rftfit.profile.base.Profile`."""
        if self.values.ndim > 1:
            raise ValueError("a stack of draws has no pack; carry it through as draws")
        return make_pack(DEPTH_ONLY, self.values)

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.profile.base.Profile`."""
        return self.values[..., :2], self.values[..., 2:]

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.profile.base.Profile`.

        Parameters
        ----------
        beta, gamma : numpy.ndarray

        Returns
        -------
        basis_z, basis_x : numpy.ndarray
        """
        down, left = np.sin(gamma), np.cos(gamma)  # parts of the velocity toward -z and -x
        level, upright = np.abs(np.cos(beta)), np.abs(np.sin(beta))
        unknown = np.isnan(beta) | np.isnan(gamma)
        basis_z = np.stack([level * (down > STILL), level * (down < -STILL)], axis=-1)
        basis_x = upright * ((left > STILL).astype(float) - (left < -STILL))
        basis_z, basis_x = (
            np.where(unknown[..., None], np.nan, part) for part in (basis_z, basis_x[..., None])
        )
        return basis_z, basis_x

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
