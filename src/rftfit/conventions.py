"""Signs and angles of plate and motion, defined for all other modules, and the types of arrays.

Lab frame: x horizontal, z up, z = 0 at the flat free surface. A plate element at attack angle
beta has the tangent t = (cos beta, -sin beta); one that moves at intrusion angle gamma has the
velocity direction v = (-cos gamma, -sin gamma), components (x, z). gamma = pi/2 is straight down,
-pi/2 straight up, 0 horizontal toward -x. beta is pi-periodic and kept in [-pi/2, pi/2].
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

# types of arrays: numbers, masks, indices
FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IndexArray = npt.NDArray[np.intp]

COMPONENTS = ("z", "x")
"""Components of alpha and of force, in the order of arrays and columns."""

QUASI_STATIC_CM_PER_S = 50.0
"""Speed, cm/s, below which granular forces hardly depend on the speed (Li et al. 2013, text)."""


def tangent(beta: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Components (x, z) of the unit tangent of a plate at attack angle `beta` (rad, any shape), in its shape."""
    beta = np.asarray(beta, dtype=float)
    return np.cos(beta), -np.sin(beta)


def direction(gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Components (x, z) of the unit velocity at intrusion angle `gamma` (rad, any shape), in its shape."""
    gamma = np.asarray(gamma, dtype=float)
    return -np.cos(gamma), -np.sin(gamma)


def intrusion_angle(vx: npt.ArrayLike, vz: npt.ArrayLike) -> FloatArray:
    """Intrusion angle gamma (rad, in (-pi, pi]) of the velocity (`vx`, `vz`), in one unit; NaN where that is zero."""
    vx, vz = np.asarray(vx, dtype=float), np.asarray(vz, dtype=float)
    # 0.0 - v, not -v: a negative zero would turn +pi into -pi
    gamma = np.arctan2(0.0 - vz, 0.0 - vx)
    return np.where((vx == 0) & (vz == 0), np.nan, gamma)


def wrap_beta(beta: npt.ArrayLike) -> FloatArray:
    """Bring an attack angle (rad) into [-pi/2, pi/2): +pi/2 and -pi/2 are the same plate, here -pi/2."""
    beta = np.asarray(beta, dtype=float)
    return np.mod(beta + np.pi / 2, np.pi) - np.pi / 2


def wrap_gamma(gamma: npt.ArrayLike) -> FloatArray:
    """Bring an intrusion angle (rad) into (-pi, pi]."""
    gamma = np.asarray(gamma, dtype=float)
    return np.pi - np.mod(np.pi - gamma, 2 * np.pi)


def mirror(beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Angles (rad) of the same experiment seen from behind: x turned into -x.

    In the mirror image alpha_z is the same and alpha_x has the opposite sign (symmetry extension,
    supplement of the paper). Mirroring twice returns the angles, gamma in (-pi, pi].
    """
    return -np.asarray(beta, dtype=float), wrap_gamma(np.pi - np.asarray(gamma, dtype=float))


def motion_gamma_deg(direction: str, gamma_deg: float) -> float:
    """Return gamma of the motion of a run, deg; an extraction may state gamma of its path on the way down instead.

    `direction`: As in the run sheet, ``intrusion``, ``extraction`` or ``horizontal``. `gamma_deg`: As the sheet states
    it. Logs show the motion: an extraction along the path of a push at 60 degrees moves at -120.
    """
    return gamma_deg - 180 if direction == "extraction" and gamma_deg > 0 else gamma_deg


def file_extraction(beta_deg: float, path_gamma_deg: float) -> tuple[float, float, float]:
    """Find the cell of the alpha table that holds an extraction (a motion upward).

    `path_gamma_deg` is either the angle of the path on the way down, in [0, 90], along which the plate is pulled back,
    or the angle of the motion upward itself, below 0. A plate that is pulled back moves in the direction
    (beta, gamma - 180 deg), which lies outside of the table: it is filed under its mirror image.
    Returns beta and gamma of the cell (deg), and the factor, 1 or -1, by which alpha_x as measured is multiplied.
    """
    if path_gamma_deg < 0:  # the angle of the motion itself, which is in the table
        return beta_deg, path_gamma_deg, 1.0
    # + 0.0 so that no cell is called -0
    return -beta_deg + 0.0, -path_gamma_deg + 0.0, -1.0
