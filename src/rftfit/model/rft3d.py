"""3D-RFT of a plate in the plane of its motion: a whole profile from one push straight down and a friction.

Agarwal, Goldman and Kamrin, *PNAS* 120 (2023), arXiv 2205.14920: stress over depth on a face is
``xi (f1 m + f2 v + f3 g)``, with ``m`` its normal turned down, ``v`` its direction of motion, ``g`` down, and
each ``f`` a polynomial of third degree in ``v.g``, ``m.g`` and ``m.v``, the same for all dry media.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.profiles import Profile, TableProfile
from rftfit.store.chosen import read_toml

_TERMS = read_toml("reference", "rft3d.toml")
COEFFICIENTS = np.array([_TERMS["along_m"], _TERMS["along_v"], _TERMS["down"]])

_NONE = 1e-9
"""A part of a unit vector below this is none: rounding does not choose a side."""


def law(normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """Stress over depth on a face where xi is 1, shape (..., d): neither turned nor capped.

    `normal`, `velocity`: unit vectors, shape (..., d), up last. A vertical face has its normal forward.
    """
    m = normal * _sign(-normal[..., -1], _dot(normal, velocity))[..., None]
    x = np.stack([-velocity[..., -1], -m[..., -1], _dot(m, velocity)])
    terms = np.stack([x[[*factors]].prod(axis=0) for factors in _TERMS["factors"]])
    along_m, along_v, down = np.tensordot(COEFFICIENTS, terms, axes=1)[..., None]
    gravity = np.zeros(m.shape[-1])
    gravity[-1] = -1
    return np.asarray(along_m * m + along_v * velocity + down * gravity)


def level_of(profile: Profile) -> FloatArray:
    """Factor xi of a medium, N/cm^3, by its alpha_z(0, 90 deg); of a stack of draws shape (draws,)."""
    down = np.array([0.0, 0.0, -1.0])
    return np.asarray(profile.alpha(0.0, np.pi / 2)[0] / law(down, down)[2])


def alpha_3drft(
    beta: npt.ArrayLike, gamma: npt.ArrayLike, friction: float
) -> tuple[FloatArray, FloatArray]:
    """alpha_z and alpha_x of a plate, over alpha_z(0, 90 deg), shape (...); angles in rad.

    Of its two faces the one that leads; of a plate that moves along itself the lower one.
    """
    beta, gamma = np.broadcast_arrays(np.asarray(beta, float), np.asarray(gamma, float))
    velocity = -np.stack([np.cos(gamma), np.sin(gamma)], axis=-1)
    normal = np.stack([np.sin(beta), np.cos(beta)], axis=-1)
    normal = normal * _sign(_dot(normal, velocity), -normal[..., -1])[..., None]
    alpha = turn_and_cap(law(normal, velocity), normal, velocity, friction)
    down = np.array([0.0, -1.0])
    x, z = np.moveaxis(alpha / law(down, down)[1], -1, 0)
    return z, x


def turn_and_cap(
    stress: FloatArray, normal: FloatArray, velocity: FloatArray, friction: float
) -> FloatArray:
    """Turn a normal part that pulls and a tangential part that drives; cap the tangential one by friction."""
    across = _dot(stress, normal)
    along = stress - across[..., None] * normal
    share = np.minimum(
        1, friction * np.abs(across) / np.maximum(np.sqrt(_dot(along, along)), _NONE)
    )
    share = np.where(_dot(along, velocity) > _NONE, -share, share)
    return share[..., None] * along - np.abs(across)[..., None] * normal


def rft3d_profile(alpha: float, friction: float, step_deg: float = 1.0) -> TableProfile:
    """3D-RFT (Agarwal, Goldman and Kamrin 2023) of a medium known by one push and one friction.

    A normal stress that pulls and a tangential one that drives are turned, and the tangential one is at
    most `friction` times the normal one, as in published codes. The coefficients are those of
    Hanneszz/3dRFT (commit 4693bfc) and KKKobefeng/3D-RFT (5fa5814), which agree in all 60; all agreeing sources are
    one lineage, and they were not compared with the supplement of the paper.

    Parameters
    ----------
    alpha : float
        Slope of stress over depth of a horizontal plate pushed straight down, alpha_z(0, 90 deg),
        N/cm^3; xi is alpha over 0.87504.
    friction : float
        Coefficient of friction between grains and plate.
    step_deg : float, optional
        Of the table, a part of 90 degrees. The law jumps where a plate moves along itself, and along its
        normal, and between nodes the table passes over that evenly. Forces on the curved model legs are
        within 1.5 % of their peak at 1 degree and within 30 % at 5, on the flat leg, which moves along its
        normal, within 14 %. `read_profile` takes steps from 3.75 degrees.

    Returns
    -------
    TableProfile
        Without a spread and without the model's own error, because no error of the law is known.

    Raises
    ------
    ValueError
        If alpha is not positive, the friction is negative, or the step is no part of 90 degrees.

    Examples
    --------
    >>> import rftfit
    >>> sand = rftfit.rft3d_profile(0.9, friction=0.4)
    >>> forces = rftfit.predict(sand, rftfit.model_leg("c_leg"))
    """
    if not (np.isfinite(alpha) and alpha > 0):
        raise ValueError(f"alpha_z(0, 90 deg) must be a positive number of N/cm^3, found {alpha:g}")
    if not (np.isfinite(friction) and friction >= 0):
        raise ValueError(f"the friction must be a number of at least 0, found {friction:g}")
    steps = round(90 / step_deg) if step_deg > 0 else 0
    if not steps or not np.isclose(steps * step_deg, 90):
        raise ValueError(f"the step must be a part of 90 degrees, found {step_deg:g}")
    angles = np.linspace(-np.pi / 2, np.pi / 2, 2 * steps + 1)
    alpha_z, alpha_x = alpha_3drft(angles[:, None], angles, friction)
    name = f"3D-RFT from alpha_z(0, 90 deg) = {alpha:g} N/cm^3, friction {friction:g}"
    profile = TableProfile(alpha * alpha_z, alpha * alpha_x, angles[:, None], angles, name)
    # how far measured forces lie from a law was not measured, only how far they lie from tables and maps
    profile.model_error = np.nan
    return profile


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray((first * second).sum(axis=-1))


def _sign(number: FloatArray, otherwise: FloatArray) -> FloatArray:
    """1 or -1: the sign of a number, or of another one where it is 0; 1 where both are."""
    chosen = np.where(np.abs(number) > _NONE, number, otherwise)
    return np.where(chosen < -_NONE, -1.0, 1.0)
