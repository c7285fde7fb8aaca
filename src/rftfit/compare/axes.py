"""Evidence for axes of the force, or signs of beta, that a configuration states by mistake, by the shape of known media.

A plate that is pushed down is pushed up by the grains, and so on in every direction: the shape of known media fits the
right axes and no others. The evidence for other axes is a logarithm of a Bayes factor: of how many times more likely
they make the measured alpha than the given axes do. `docs/theory/checks.md` states how often the mistakes of simulated
campaigns are found. n is the number of directions; arrays of shape (2 n,) have alpha_z of all, then alpha_x of all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rftfit.compare.joint import RunSlopes, prior_of_media
from rftfit.conventions import FloatArray
from rftfit.directions import has_sign, number_directions
from rftfit.measure.verdict_words import BETA_AND_X_REVERSED, BETA_REVERSED, PULLS
from rftfit.store.chosen import chosen

AXES = {
    "as-given": ((1, 0), (0, 1)),
    "x-reversed": ((1, 0), (0, -1)),
    "z-reversed": ((-1, 0), (0, 1)),
    "both-reversed": ((-1, 0), (0, -1)),
    "exchanged": ((0, 1), (1, 0)),
    "exchanged-z-reversed": ((0, -1), (1, 0)),
    "exchanged-x-reversed": ((0, 1), (-1, 0)),
    "exchanged-both-reversed": ((0, -1), (-1, 0)),
}
"""Mistakes with the axes by name, each with the matrix that turns (z, x) as stated into the right (z, x)."""

_CHOSEN = chosen("compare", "axes")

_SIZES = np.exp(np.linspace(*_CHOSEN.log_sizes))
"""Sizes of the medium (factors on the known shape) relative to a first estimate, over which the evidence is summed."""


def axes_evidence(runs: RunSlopes) -> dict[str, float]:
    """Find the evidence for each of `AXES`, and for the other sign of beta: logarithms of Bayes factors.

    Each direction counts once, by the median of its runs. The likelihood is a sum over the size of the medium and the
    share of the rough shape (`rftfit.model.prior`). The departure from the shape has the size that known media have: a
    medium that may depart without bound fits any axes.

    Parameters
    ----------
    runs : RunSlopes
        All runs of a medium that have both components.

    Returns
    -------
    dict of str to float
        Logarithm of the Bayes factor by the name of the axes; 0 for the given ones. `BETA_REVERSED` and `BETA_AND_X_REVERSED` where
        plates are slanted, `PULLS` where there are pulls of these.
    """
    number = number_directions(runs.beta_deg, runs.gamma_deg, tolerance_deg=runs.tolerance_deg)
    first_runs = np.unique(number)
    beta_deg, gamma_deg = runs.beta_deg[first_runs], runs.gamma_deg[first_runs]
    alpha = np.stack(
        [np.median(runs.alpha[:, number == direction], axis=1) for direction in first_runs], axis=1
    )
    side = runs.side[first_runs]
    level = np.hypot(*alpha)
    error = np.tile(np.hypot(_CHOSEN.scatter * level, _CHOSEN.of_medium * level.max()), 2)
    # by the sign of beta that is right: mistakes, each with the axes that are right with it
    axes_by_sign = {1: {name: name for name in AXES}}
    is_slanted = has_sign(beta_deg, runs.tolerance_deg)
    if is_slanted.any():
        axes_by_sign[-1] = {BETA_REVERSED: "as-given"}
    if (is_slanted & has_sign(gamma_deg, runs.tolerance_deg)).any():
        # a mirror image, which on a vertical path is as right as what it mirrors
        axes_by_sign[-1][BETA_AND_X_REVERSED] = "x-reversed"
    evidence: dict[str, float] = {}
    for sign, axes_of_mistakes in axes_by_sign.items():
        alphas = []
        for axes in axes_of_mistakes.values():
            # axes turn the force as it was measured, before alpha_x of pulls got the other sign
            alpha_z, alpha_x = np.array(AXES[axes]) @ np.stack([alpha[0], side * alpha[1]])
            alphas.append(np.concatenate([alpha_z, side * alpha_x]))
        sums = _log_evidence(sign * beta_deg, gamma_deg, alphas, error)
        evidence |= zip(axes_of_mistakes, sums, strict=True)
    factors = {name: log_sum - evidence["as-given"] for name, log_sum in evidence.items()}
    return factors | _evidence_for_pulls(beta_deg, gamma_deg, alpha, runs.tolerance_deg)


def _evidence_for_pulls(
    beta_deg: FloatArray, gamma_deg: FloatArray, alpha: FloatArray, tolerance_deg: float
) -> dict[str, float]:
    """Find the evidence that beta of pulls has the other sign; empty where no pull has a beta that could be reversed.

    Pulls are weak beside pushes, so the departure of a medium from the shape is taken in proportion to alpha of each
    direction. `alpha`: z and x, N/cm^3, shape (2, n). Returned by the name of the mistake, `PULLS`.
    """
    is_pull = (gamma_deg < -1) & has_sign(beta_deg, tolerance_deg)
    if not is_pull.any():
        return {}
    level = np.hypot(*alpha)
    least = _CHOSEN.least_of_direction * level.max()
    error = np.tile(np.hypot(_CHOSEN.of_direction * level, least), 2)
    as_stated, reversed_sign = (
        _log_evidence(signed_beta_deg, gamma_deg, [alpha.ravel()], error)[0]
        for signed_beta_deg in (beta_deg, np.where(is_pull, -beta_deg, beta_deg))
    )
    return {PULLS: reversed_sign - as_stated}


def _log_evidence(
    beta_deg: FloatArray, gamma_deg: FloatArray, alphas: Sequence[FloatArray], error: FloatArray
) -> list[float]:
    """Return the logarithm of the likelihood of each alpha at n directions, summed over size and share of the rough shape.

    `beta_deg`, `gamma_deg`: (n,). `alphas`: alpha by each set of axes, of shape (2 n,). `error`: the standard error of
    each, (2 n,), which includes what a medium has of its own.
    """
    by_share = []
    for rough_share in _CHOSEN.rough_shares:
        shape = _KnownShape(*prior_of_media(beta_deg, gamma_deg, rough_share), error)
        by_share.append([shape.log_evidence(alpha) for alpha in alphas])
    return [float(log_sum) for log_sum in np.logaddexp.reduce(by_share, axis=0)]


class _KnownShape:
    """Normal distribution of alpha of a medium of size 1 at n directions, with an error of the directions.

    `mean`, `covariance`: of alpha, shape (2 n,) and (2 n, 2 n). `error`: standard error of the measured alpha, (2 n,).
    All is turned once into the eigenvectors of the covariance in units of the error, in which numbers are independent,
    so that many sizes and sets of axes take little time.
    """

    def __init__(self, mean: FloatArray, covariance: FloatArray, error: FloatArray) -> None:
        """Turn mean and covariance; `variances`, `mean`: along the eigenvectors, the columns of `vectors`, (2 n,)."""
        self.error = error
        # expected sum of the squares of alpha
        self.square = float(mean @ mean + np.trace(covariance))
        variances, self.vectors = np.linalg.eigh(covariance / np.outer(error, error))
        self.variances = np.maximum(variances, 0)
        self.mean = self.vectors.T @ (mean / error)

    def log_evidence(self, alpha: FloatArray) -> float:
        """Logarithm of the likelihood of alpha, shape (2 n,), summed over the size s of the medium, up to a constant.

        In units of the error and along the eigenvectors of the covariance each number is independent, with the mean s m
        and the variance 1 + s^2 v.
        """
        turned = self.vectors.T @ (alpha / self.error)
        # first estimate, by the squares alone, which no axes change
        size = math.sqrt(alpha @ alpha / self.square)
        sizes = (size * _SIZES)[:, None]
        variance = 1 + sizes**2 * self.variances
        misfit = (np.log(variance) + (turned - sizes * self.mean) ** 2 / variance).sum(axis=-1)
        return float(np.logaddexp.reduce(-0.5 * misfit))
