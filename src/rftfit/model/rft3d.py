"""3D-RFT of a plate in the plane of its motion: a whole profile from one push straight down and a friction.

Agarwal, Goldman and Kamrin, *PNAS* 120 (2023), arXiv 2205.14920: stress over depth on a face is ``xi (f1 m + f2 v + f3
g)``, with ``m`` its normal turned down, ``v`` its direction of motion, ``g`` down, and each ``f`` a polynomial of third
degree in ``v.g``, ``m.g`` and ``m.v``, the same for all dry media. ``xi``, N/cm^3, says how strong a medium is:
alpha_z(0, 90 deg) over what the polynomials give there.

Vectors have shape (..., d): d = 3, x, y, z, or d = 2, x, z; the last component is up.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.profiles import Profile, TableProfile
from rftfit.model.scaling import check_test
from rftfit.store.chosen import read_toml

_TERMS = read_toml("reference", "rft3d.toml")
COEFFICIENTS = np.array([_TERMS["along_m"], _TERMS["along_v"], _TERMS["down"]])
"""Coefficients of the polynomials f1, f2 and f3, one row each."""

_NEGLIGIBLE = 1e-9
"""Product of unit vectors below which it counts as 0, so that rounding does not choose its sign."""


def law(normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the stress over depth on a face in a medium with xi = 1, shape (..., d), before `turn_and_cap`.

    `normal`: outward, `velocity`: unit vectors, shape (..., d).
    """
    # turned down; the normal of a vertical face is turned to where the face moves
    m = normal * _sign(-normal[..., -1], dot(normal, velocity))[..., None]
    products = np.stack([-velocity[..., -1], -m[..., -1], dot(m, velocity)])  # v.g, m.g, m.v
    # each of the 20 terms is a product of up to three of these
    terms = np.stack([products[[*factors]].prod(axis=0) for factors in _TERMS["factors"]])
    along_m, along_v, down = np.tensordot(COEFFICIENTS, terms, axes=1)[..., None]
    gravity = np.zeros(m.shape[-1])
    gravity[-1] = -1
    return np.asarray(along_m * m + along_v * velocity + down * gravity)


def level_of(profile: Profile) -> FloatArray:
    """Return the factor xi of a medium, N/cm^3, from its alpha_z(0, 90 deg); shape (), of a stack of draws (draws,)."""
    down = np.array([0.0, 0.0, -1.0])
    return np.asarray(profile.alpha(0.0, np.pi / 2)[0] / law(down, down)[2])


def alpha_3drft(
    beta: npt.ArrayLike, gamma: npt.ArrayLike, friction: float
) -> tuple[FloatArray, FloatArray]:
    """Return alpha_z and alpha_x of a plate over alpha_z(0, 90 deg), each of shape (...); angles in rad.

    The stress is that of the leading face, or of the lower face if the plate moves along itself. `friction`: as in
    `turn_and_cap`.
    """
    beta, gamma = np.broadcast_arrays(np.asarray(beta, float), np.asarray(gamma, float))
    velocity = -np.stack([np.cos(gamma), np.sin(gamma)], axis=-1)
    normal = np.stack([np.sin(beta), np.cos(beta)], axis=-1)
    normal = normal * _sign(dot(normal, velocity), -normal[..., -1])[..., None]
    alpha = turn_and_cap(law(normal, velocity), normal, velocity, friction)
    down = np.array([0.0, -1.0])
    x, z = np.moveaxis(alpha / law(down, down)[1], -1, 0)
    return z, x


def turn_and_cap(
    stress: FloatArray, normal: FloatArray, velocity: FloatArray, friction: float
) -> FloatArray:
    """Return a stress on a face whose normal part pushes and whose tangential part resists, up to the friction.

    The polynomials of the law may give a part the wrong sign: it is reversed, as in published codes. The size of the
    tangential part is at most `friction` times that of the normal part. `stress`, `normal` (outward unit), `velocity`:
    shape (..., d).
    """
    normal_part = dot(stress, normal)
    tangential = stress - normal_part[..., None] * normal
    tangential_size = np.maximum(np.sqrt(dot(tangential, tangential)), _NEGLIGIBLE)
    factor = np.minimum(1, friction * np.abs(normal_part) / tangential_size)
    # a tangential part along the motion would drive the face
    drives = dot(tangential, velocity) > _NEGLIGIBLE
    factor = np.where(drives, -factor, factor)
    return factor[..., None] * tangential - np.abs(normal_part)[..., None] * normal


def rft3d_profile(alpha: float, friction: float, step_deg: float = 1.0) -> TableProfile:
    """Make the profile of a medium by 3D-RFT (Agarwal, Goldman and Kamrin 2023) from one push and one friction.

    A normal stress that pulls and a tangential stress that drives are reversed, and the tangential stress is at
    most `friction` times the normal stress, as in published codes. The coefficients are those of
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
        Step of the table in both angles; 90 degrees must be a multiple of it. The law jumps where a plate moves along
        itself or along its normal; the table is linear across such a jump, between two nodes. Forces on the curved
        model legs are within 1.5 % of their peak at 1 degree and within 30 % at 5; on the flat leg, which moves
        along its normal, within 14 %. `read_profile` accepts steps from 3.75 degrees.

    Returns
    -------
    TableProfile
        Its `spread` is None and its `model_error` NaN, because no error of the law is known.

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
    check_test(alpha, 0.0)
    if not (np.isfinite(friction) and friction >= 0):
        raise ValueError(f"the friction must be a number of at least 0, found {friction:g}")
    steps = round(90 / step_deg) if step_deg > 0 else 0
    if not steps or not np.isclose(steps * step_deg, 90):
        raise ValueError(f"the step must be a part of 90 degrees, found {step_deg:g}")
    angles = np.linspace(-np.pi / 2, np.pi / 2, 2 * steps + 1)
    alpha_z, alpha_x = alpha_3drft(angles[:, None], angles, friction)
    name = f"3D-RFT from alpha_z(0, 90 deg) = {alpha:g} N/cm^3, friction {friction:g}"
    profile = TableProfile(alpha * alpha_z, alpha * alpha_x, angles[:, None], angles, name)
    # the error of the force model was measured with tables and maps alone
    profile.model_error = np.nan
    return profile


def dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the scalar products of vectors (..., d) with others, shape (...)."""
    return np.asarray((first * second).sum(axis=-1))


def _sign(number: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return 1 or -1: the sign of `number`, or of `otherwise` where `number` is 0; 1 where both are 0."""
    chosen = np.where(np.abs(number) > _NEGLIGIBLE, number, otherwise)
    return np.where(chosen < -_NEGLIGIBLE, -1.0, 1.0)
