"""The symmetry of alpha under mirroring x, and the torus that it completes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray


def check_grid(beta: FloatArray, gamma: FloatArray) -> None:
    """Check that a grid can be mirrored: increasing, symmetric, from -90 to 90 degrees.

    `beta`, `gamma`: shape (nb,); rad.
    """
    for name, angle in (("beta", beta), ("gamma", gamma)):
        whole = angle.size > 1 and np.isclose(angle[-1], np.pi / 2) and (np.diff(angle) > 0).all()
        if not whole or not np.allclose(angle, -angle[::-1]):
            raise ValueError(f"the {name} grid must be symmetric and run from -90 to 90 degrees")


def symmetrise(alpha_z: FloatArray, alpha_x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Make alpha at gamma = +-90 degrees obey its own symmetry.

    There a plate at beta and one at -beta are mirror images: alpha_z(beta) and alpha_z(-beta) are
    replaced by their mean, alpha_x(beta) and -alpha_x(-beta) by theirs (supplement of the paper).

    Parameters
    ----------
    alpha_z, alpha_x : numpy.ndarray, shape (..., nb, ng)
        N/cm^3, rows by beta, columns by gamma, both from -90 to 90 degrees.

    Returns
    -------
    alpha_z, alpha_x : numpy.ndarray
        New arrays of the same shape. A cell whose mirror image is missing keeps its own value; a
        missing one takes its mirror image's.
    """
    alpha_z, alpha_x = alpha_z.copy(), alpha_x.copy()
    for column in (0, -1):
        alpha_z[..., column] = _mean(alpha_z[..., column], alpha_z[..., ::-1, column])
        alpha_x[..., column] = _mean(alpha_x[..., column], -alpha_x[..., ::-1, column])
    return alpha_z, alpha_x


def _mean(one: FloatArray, other: FloatArray) -> FloatArray:
    """Mean of two, or the one that there is."""
    both = (one + other) / 2
    return np.where(np.isnan(one), other, np.where(np.isnan(other), one, both))


def extend(
    gamma: FloatArray, alpha_z: FloatArray, alpha_x: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Extend alpha from gamma in [-90, 90] to [-180, 180] degrees.

    alpha_z(beta, gamma) = alpha_z(-beta, +-pi - gamma), alpha_x(beta, gamma) = -alpha_x(-beta,
    +-pi - gamma), upper sign for gamma > 0 (supplement of the paper).

    Parameters
    ----------
    gamma : numpy.ndarray, shape (ng,)
        rad, symmetric, from -pi/2 to pi/2, with 0 in the middle.
    alpha_z, alpha_x : numpy.ndarray, shape (..., nb, ng)
        N/cm^3, the beta rows symmetric about 0.

    Returns
    -------
    gamma : numpy.ndarray, shape (2 ng - 1,)
        rad, from -pi to pi.
    alpha_z, alpha_x : numpy.ndarray, shape (..., nb, 2 ng - 1)

    Raises
    ------
    ValueError
        If gamma is not such a grid.
    """
    middle = gamma.size // 2
    if (
        gamma.size % 2 == 0
        or not np.isclose(gamma[middle], 0)
        or not np.isclose(gamma[-1], np.pi / 2)
    ):
        raise ValueError("the gamma grid must run from -90 to 90 degrees with 0 in its middle")
    # without the columns at +-90 degrees, which are their own image
    up, down = slice(middle, -1), slice(1, middle + 1)
    gamma_all = np.concatenate([-np.pi - gamma[down][::-1], gamma, np.pi - gamma[up][::-1]])

    def whole(alpha: FloatArray, sign: float) -> FloatArray:
        image = sign * alpha[..., ::-1, :]
        return np.concatenate(
            [image[..., down][..., ::-1], alpha, image[..., up][..., ::-1]], axis=-1
        )

    return gamma_all, whole(alpha_z, 1.0), whole(alpha_x, -1.0)
