"""Variance of a weighted sum of autocorrelated residuals, without believing they are independent.

Transducer samples at 100 Hz are correlated over many samples, so the textbook standard error of a
slope is several times too small. The long-run variance is estimated here by equally weighted
cosines (a fixed number of low frequencies, hence a Student t with that many degrees of freedom)
after prewhitening by a fifth-order autoregression; see Andrews and Monahan, Econometrica 60, 953
(1992) and Lazarus, Lewis, Stock and Watson, J. Bus. Econ. Stat. 36, 541 (2018). Weighted cosines
overlap with one another and with what was fitted: they are made orthonormal and orthogonal to it,
else the fit would already have eaten part of the scatter that they measure.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

COSINES = 12
ORDER = 5
_MAX_SUM = 0.98


@lru_cache(maxsize=512)
def _cosines(n: int, count: int) -> FloatArray:
    """First `count` cosine modes over `n` samples, orthonormal, shape (count, n)."""
    order = np.arange(1, count + 1)
    modes: FloatArray = np.sqrt(2 / n) * np.cos(np.pi * np.outer(order, np.arange(n) + 0.5) / n)
    return modes


def weighted_sum_variance(
    residual: FloatArray, weight: FloatArray, fitted: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """Variance of sum(weight x error) from the residuals of a linear fit.

    Parameters
    ----------
    residual : numpy.ndarray, shape (k, n)
        k series of n residuals each, equally spaced.
    weight : numpy.ndarray, shape (n,)
    fitted : numpy.ndarray, shape (p, n), optional
        What was fitted, linearly independent; by default the weight alone.

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
    memory = _autoregression(residual, min(ORDER, n // 8))
    order = memory.shape[1]
    white = residual[:, order:].copy()
    for lag in range(1, order + 1):
        white -= memory[:, lag - 1, None] * residual[:, order - lag : n - lag]
    inner = weight[order:]
    count = min(COSINES, inner.size // 4)
    level = _level(white, inner, weight[None, :] if fitted is None else fitted, count)
    growth, gain = _growth(weight, memory)
    effective = n / growth
    # one parameter was fitted, at the cost of one of the effectively independent samples
    loss = effective / np.maximum(effective - 1, 0.5)
    return level * gain * growth * (weight @ weight) * loss, float(count)


def _level(white: FloatArray, weight: FloatArray, fitted: FloatArray, count: int) -> FloatArray:
    """Variance of white residuals as their slow, weighted modes show it, shape (k,)."""
    modes = weight * _cosines(weight.size, count)
    basis = _orthonormal(fitted[:, -weight.size :])
    shadow = modes @ basis
    overlap = modes @ modes.T - shadow @ shadow.T
    sums = white @ modes.T - (white @ basis) @ shadow.T
    level: FloatArray = np.einsum("ij,ji->i", sums, np.linalg.solve(overlap, sums.T)) / count
    return level


def _orthonormal(rows: FloatArray) -> FloatArray:
    """Orthonormal columns that span the same as some rows."""
    if len(rows) == 1:
        # by hand: the general way costs more than all the rest of `_level`
        single: FloatArray = rows.T / np.sqrt(rows[0] @ rows[0])
        return single
    return np.linalg.qr(rows.T)[0]


def _autoregression(residual: FloatArray, order: int) -> FloatArray:
    """Coefficients of an autoregression of each series by Yule and Walker, shape (k, order)."""
    n = residual.shape[1]
    lags = [
        np.einsum("ij,ij->i", residual[:, lag:], residual[:, : n - lag]) for lag in range(order + 1)
    ]
    power: FloatArray = np.where(lags[0] > 0, lags[0], 1.0)
    rho = np.stack(lags, axis=1) / power[:, None]
    # a little more than 1, so that a series of zeros has a solution too
    rho[:, 0] = 1 + 1e-9
    apart = np.abs(np.subtract.outer(np.arange(order), np.arange(order)))
    memory = np.asarray(np.linalg.solve(rho[:, apart], rho[:, 1:, None])[..., 0], dtype=float)
    total = memory.sum(axis=1)
    # biased low by (1 + 3 rho) / n, as is the sample autocorrelation (Kendall 1954)
    raised = np.minimum(total + (1 + 3 * np.clip(total, 0, 1)) / n, _MAX_SUM)
    memory[:, 0] += raised - total
    return memory


def _growth(weight: FloatArray, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variance of the weighted sum over that for independent errors; that of errors over white."""
    # twice as long as the weights, so that the ends do not meet
    size = 1 << (2 * weight.size - 1).bit_length()
    filters = np.concatenate([np.ones((len(memory), 1)), -memory], axis=1)
    power = 1 / np.abs(np.fft.rfft(filters, size)) ** 2
    twice = np.full(size // 2 + 1, 2 / size)
    twice[[0, -1]] = 1 / size
    gain: FloatArray = power @ twice
    spread: FloatArray = (power * np.abs(np.fft.rfft(weight, size)) ** 2) @ twice
    return spread / (gain * (weight @ weight)), gain


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
