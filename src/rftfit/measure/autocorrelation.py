"""Variance of a weighted sum of autocorrelated residuals, without believing they are independent.

Transducer samples at 100 Hz are correlated over many samples, so the textbook standard error of a
slope is several times too small. The long-run variance is estimated here by equally weighted
cosines (a fixed number of low frequencies, hence a Student t with that many degrees of freedom)
after prewhitening by a first-order autoregression; see Andrews and Monahan, Econometrica 60, 953
(1992) and Lazarus, Lewis, Stock and Watson, J. Bus. Econ. Stat. 36, 541 (2018).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

COSINES = 12
_MAX_RHO = 0.98


@lru_cache(maxsize=512)
def _cosines(n: int, count: int) -> FloatArray:
    """First `count` cosine modes over `n` samples, orthonormal, shape (count, n)."""
    order = np.arange(1, count + 1)
    modes: FloatArray = np.sqrt(2 / n) * np.cos(np.pi * np.outer(order, np.arange(n) + 0.5) / n)
    return modes


def weighted_sum_variance(residual: FloatArray, weight: FloatArray) -> tuple[FloatArray, float]:
    """Variance of sum(weight x error) from the residuals of a one-parameter fit.

    Parameters
    ----------
    residual : numpy.ndarray, shape (k, n)
        k series of n residuals each, equally spaced.
    weight : numpy.ndarray, shape (n,)

    Returns
    -------
    variance : numpy.ndarray, shape (k,)
        Square of the unit of ``weight * residual``.
    dof : float
        Degrees of freedom of the estimate, for a Student t.

    Raises
    ------
    ValueError
        If there are fewer than 8 samples.
    """
    n = weight.size
    if n < 8:
        raise ValueError(f"{n} samples are too few to tell their autocorrelation; at least 8")
    power = np.einsum("ij,ij->i", residual, residual)
    power = np.where(power > 0, power, 1.0)
    rho = np.einsum("ij,ij->i", residual[:, 1:], residual[:, :-1]) / power
    # the sample autocorrelation is biased low by (1 + 3 rho) / n (Kendall 1954)
    rho = np.clip(rho + (1 + 3 * np.clip(rho, 0, 1)) / n, 0.0, _MAX_RHO)
    white = (residual[:, 1:] - rho[:, None] * residual[:, :-1]) * weight[1:]
    count = min(COSINES, n // 4)
    level = np.mean((white @ _cosines(n - 1, count).T) ** 2, axis=1)
    level = level * (n - 1) / (weight[1:] @ weight[1:])
    growth = _growth(weight, rho)
    effective = n / growth
    # one parameter was fitted, at the cost of one of the effectively independent samples
    loss = effective / np.maximum(effective - 1, 0.5)
    return level / (1 - rho**2) * growth * (weight @ weight) * loss, float(count)


def _growth(weight: FloatArray, rho: FloatArray) -> FloatArray:
    """How much larger the variance of the weighted sum is than for independent errors."""
    lags = np.correlate(weight, weight, "full")[weight.size - 1 :]
    powers = rho[:, None] ** np.arange(weight.size)
    growth: FloatArray = (2 * powers @ lags - lags[0]) / lags[0]
    return growth


def combine_dof(variances: FloatArray, dofs: FloatArray) -> FloatArray:
    """Degrees of freedom of a sum of independent variance estimates (Welch and Satterthwaite).

    Parameters
    ----------
    variances, dofs : numpy.ndarray, shape (m, ...)
        The parts lie along the first axis.

    Returns
    -------
    numpy.ndarray, shape (...)
    """
    total = variances.sum(axis=0)
    parts = (variances**2 / dofs).sum(axis=0)
    safe = np.where(parts > 0, parts, 1.0)
    result: FloatArray = np.where(parts > 0, total**2 / safe, np.max(dofs, axis=0))
    return result
