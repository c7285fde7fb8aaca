"""A leg that turns about a fixed axle above the surface: the paper's rotation trials."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.predict.forces import Forces, force_draws, forces_on

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray
    from rftfit.predict.outline import Outline
    from rftfit.profile.base import Profile

THETA_DEG = np.arange(-135.0, 136.0)
"""The sweep of the paper: from the front (+x) down and backward."""

HIP_HEIGHT_CM = 2.0
RATE_RAD_PER_S = 0.2


def rotation_poses(
    theta: npt.ArrayLike,
    hip_height_cm: float = HIP_HEIGHT_CM,
    rate_rad_per_s: float = RATE_RAD_PER_S,
) -> FloatArray:
    """Poses of a leg on a fixed axle at x = 0.

    Parameters
    ----------
    theta : array_like, shape (p,)
        rad, from straight down to the direction from axle to tip: the tip lies at
        2R (-sin theta, -cos theta), so negative theta is in front.
    hip_height_cm : float, optional
        Of the axle above the free surface.
    rate_rad_per_s : float, optional
        Of theta. Forces depend on its sign alone.

    Returns
    -------
    numpy.ndarray, shape (p, 6)
    """
    theta = np.asarray(theta, dtype=float)
    poses = np.zeros((theta.size, 6))
    poses[:, 1], poses[:, 2], poses[:, 5] = hip_height_cm, theta, rate_rad_per_s
    return poses


def sweep(
    profile: Profile,
    leg: Outline,
    theta: npt.ArrayLike | None = None,
    hip_height_cm: float = HIP_HEIGHT_CM,
    rate_rad_per_s: float = RATE_RAD_PER_S,
) -> Forces:
    """Force and moment on a turning leg against theta.

    Parameters
    ----------
    profile : Profile
    leg : Outline
    theta : array_like, shape (p,), optional
        rad; by default -135 to 135 degrees by 1 (`THETA_DEG`).
    hip_height_cm, rate_rad_per_s : float, optional
        See `rotation_poses`.

    Returns
    -------
    Forces
        Arrays of shape (p,); the moment is about the axle.

    Raises
    ------
    ValueError
        If the profile is a stack of draws.
    """
    theta = np.radians(THETA_DEG) if theta is None else theta
    return forces_on(profile, leg, rotation_poses(theta, hip_height_cm, rate_rad_per_s))


def sweep_draws(
    profile: Profile,
    leg: Outline,
    theta: npt.ArrayLike | None = None,
    hip_height_cm: float = HIP_HEIGHT_CM,
    rate_rad_per_s: float = RATE_RAD_PER_S,
) -> Forces:
    """`sweep` for a stack of draws of a profile.

    Parameters
    ----------
    profile : Profile
        Parameters with a leading axis of draws.
    leg : Outline
    theta : array_like, shape (p,), optional
    hip_height_cm, rate_rad_per_s : float, optional

    Returns
    -------
    Forces
        Arrays of shape (draws, p).
    """
    theta = np.radians(THETA_DEG) if theta is None else theta
    return force_draws(profile, leg, rotation_poses(theta, hip_height_cm, rate_rad_per_s))
