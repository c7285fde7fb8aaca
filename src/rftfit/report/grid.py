"""Tables of alpha as grids over the angles: cells, their edges, and a finer grid between them."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rftfit import conventions

if TYPE_CHECKING:
    import pandas as pd

FloatArray = npt.NDArray[np.float64]

LIMIT_DEG = 90.0
"""The measured region ends at +-90 degrees in both angles."""


def pivot(table: pd.DataFrame, column: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One column of the alpha table of one medium as a grid.

    Parameters
    ----------
    table : pandas.DataFrame
        With ``beta_deg``, ``gamma_deg`` and `column`, one row per cell.
    column : str

    Returns
    -------
    beta_deg : numpy.ndarray, shape (n,)
    gamma_deg : numpy.ndarray, shape (m,)
        Both ascending.
    values : numpy.ndarray, shape (n, m)
        NaN where the table has no row or no value.

    Raises
    ------
    ValueError
        If two rows are the same cell.
    """
    # a printed 18.43 and the exact angle are one and the same cell
    beta = table["beta_deg"].to_numpy(float).round(2)
    gamma = table["gamma_deg"].to_numpy(float).round(2)
    rows, row = np.unique(beta, return_inverse=True)
    columns, place = np.unique(gamma, return_inverse=True)
    if np.unique(row * columns.size + place).size < row.size:
        raise ValueError(f"{column}: a cell (beta, gamma) appears twice in the table of one medium")
    values = np.full((rows.size, columns.size), np.nan)
    values[row, place] = table[column].to_numpy(float)
    return rows, columns, values


def half_width(table: pd.DataFrame, component: str) -> pd.Series[float]:
    """Half the width of the interval of alpha_z or alpha_x.

    Parameters
    ----------
    table : pandas.DataFrame
        Alpha table.
    component : {"z", "x"}

    Returns
    -------
    pandas.Series
        N/cm^3.
    """
    high = table[f"alpha_{component}_hi_N_per_cm3"].astype(float)
    return (high - table[f"alpha_{component}_lo_N_per_cm3"].astype(float)) / 2


def edges(centres: npt.ArrayLike) -> FloatArray:
    """Borders of the cells: midway between the measured angles, ending at +-90 degrees.

    Parameters
    ----------
    centres : array_like, shape (n,)
        Ascending, degrees.

    Returns
    -------
    numpy.ndarray, shape (n + 1,)
    """
    centres = np.asarray(centres, dtype=float)
    if centres.size == 1:
        return np.array([centres[0] - 5.0, centres[0] + 5.0])
    middle = (centres[1:] + centres[:-1]) / 2
    first, last = 2 * centres[0] - middle[0], 2 * centres[-1] - middle[-1]
    return np.concatenate([[max(first, -LIMIT_DEG)], middle, [min(last, LIMIT_DEG)]])


def _weights(centres: FloatArray, fine: FloatArray) -> FloatArray:
    place = np.clip(np.searchsorted(centres, fine, side="right") - 1, 0, centres.size - 2)
    share = (fine - centres[place]) / (centres[place + 1] - centres[place])
    weights = np.zeros((fine.size, centres.size))
    rows = np.arange(fine.size)
    weights[rows, place] = 1 - share
    weights[rows, place + 1] += share
    return weights


def refine(
    beta_deg: FloatArray, gamma_deg: FloatArray, values: FloatArray, step_deg: float = 2.5
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bilinear interpolation onto a finer grid.

    Parameters
    ----------
    beta_deg, gamma_deg : numpy.ndarray, shapes (n,) and (m,)
        Ascending, at least two each.
    values : numpy.ndarray, shape (n, m)
    step_deg : float
        Largest step of the finer grid; the measured angles are among its lines.

    Returns
    -------
    beta_deg, gamma_deg, values : numpy.ndarray
        NaN wherever a missing cell takes part.
    """
    fine = []
    for centres in (beta_deg, gamma_deg):
        parts = [
            np.linspace(a, b, int(np.ceil((b - a) / step_deg)), endpoint=False)
            for a, b in pairwise(centres)
        ]
        fine.append(np.concatenate([*parts, centres[-1:]]))
    left, right = _weights(beta_deg, fine[0]), _weights(gamma_deg, fine[1]).T
    missing = np.isnan(values)
    result = left @ np.where(missing, 0.0, values) @ right
    result[left @ missing @ right > 1e-9] = np.nan
    return fine[0], fine[1], result


def along_motion(component: str, gamma_deg: FloatArray, alpha: FloatArray) -> FloatArray:
    """Force component times velocity component: positive where alpha does not oppose the motion.

    Parameters
    ----------
    component : {"z", "x"}
    gamma_deg : numpy.ndarray, shape (m,)
    alpha : numpy.ndarray, shape (n, m)
        N/cm^3.

    Returns
    -------
    numpy.ndarray, shape (n, m)
        N/cm^3; zero where that component of the velocity is zero.
    """
    vx, vz = conventions.direction(np.radians(gamma_deg))
    velocity = vz if component == "z" else vx
    # cos(90 deg) is 6e-17 in floating point: such a velocity has no direction
    velocity = np.where(np.abs(velocity) < 1e-9, 0.0, velocity)
    return alpha * velocity
