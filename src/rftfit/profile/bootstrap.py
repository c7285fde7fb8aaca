"""Draws of the alpha table within its own errors, for the intervals of everything that follows."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column, grid
from rftfit.measure.fits import COMPONENTS

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray


def alpha_draws(
    table: pd.DataFrame, draws: int, seed: int, confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Draw alpha tables of one medium from their errors (parametric bootstrap).

    Every run is its own experiment, so cells are independent; the rows beta = -90 and +90 degrees
    are one plate and move together. The same medium and seed give the same draws, so that stages
    which draw apart still agree.

    Parameters
    ----------
    table : pandas.DataFrame
        Alpha table of one medium.
    draws : int
    seed : int
    confidence : float
        Level of the table's intervals.

    Returns
    -------
    alpha_z, alpha_x : numpy.ndarray, shape (draws, 7, 13)
        N/cm^3; NaN in cells without a run.
    """
    from scipy.special import ndtri

    medium = str(table["medium"].iloc[0])
    random = np.random.default_rng([seed, zlib.crc32(medium.encode())])
    result = []
    for component in COMPONENTS:
        centre = grid(table, column(component))
        half = (grid(table, column(component, "_hi")) - grid(table, column(component, "_lo"))) / 2
        # from the interval, not from the standard error: it knows the degrees of freedom
        spread = half / float(ndtri(0.5 + confidence / 2))
        noise = random.standard_normal((draws, *centre.shape))
        noise[:, 0] = noise[:, -1]
        result.append(centre + spread * noise)
    return result[0], result[1]


def interval(draws: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray]:
    """Percentile interval along the first axis.

    Parameters
    ----------
    draws : numpy.ndarray, shape (draws, ...)
    confidence : float

    Returns
    -------
    lo, hi : numpy.ndarray, shape (...)
    """
    tail = (1 - confidence) / 2
    lo, hi = np.quantile(draws, [tail, 1 - tail], axis=0)
    return lo, hi
