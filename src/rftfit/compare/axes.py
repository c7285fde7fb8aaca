"""Evidence for each set of axes that a configuration can give by mistake, by the shape that known media share.

A plate that is pushed down is pushed up by the grains, and so on in every direction: the shape of known media fits the
right axes and no others. `docs/theory/checks.md` has how often the axes of simulated campaigns are told.
"""

from __future__ import annotations

import math

import numpy as np

from rftfit.compare.chosen import chosen
from rftfit.compare.joint import RunSlopes, prior_of_media
from rftfit.directions import number_directions

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
"""Axes that a configuration can give by mistake: what to do with (z, x) to put them right."""

_CHOSEN = chosen("axes")

_SIZES = np.exp(np.linspace(-1.0, 0.6, 9))
"""Sizes of the medium relative to the size of its alpha, over which the evidence is summed."""


def axes_evidence(runs: RunSlopes, without: tuple[str, ...] = ()) -> dict[str, float]:
    """Compare the marginal likelihood of the medians of the directions in each of `AXES` with that in the given axes.

    The likelihood is a sum over the size of the medium and the share of the rough shape. The departure from the shape has
    the size that known media have: a medium that may depart without bound fits any axes.

    Parameters
    ----------
    runs : RunSlopes
    without : tuple of str, optional
        Published media that are left out of the known shapes.

    Returns
    -------
    dict of str to float
        Logarithm of the Bayes factor by the name of the axes; 0 for the given ones.
    """
    number = number_directions(runs.beta_deg, runs.gamma_deg, tolerance_deg=runs.tolerance_deg)
    first_runs = np.unique(number)
    directions_deg = runs.beta_deg[first_runs], runs.gamma_deg[first_runs]
    alpha = np.stack(
        [np.median(runs.alpha[:, number == direction], axis=1) for direction in first_runs], axis=1
    )
    side = runs.side[first_runs]
    level = np.hypot(*alpha)
    error = np.tile(np.hypot(_CHOSEN.scatter * level, _CHOSEN.of_medium * level.max()), 2)
    evidence = dict.fromkeys(AXES, -math.inf)
    for rough_share in _CHOSEN.rough_shares:
        prior_mean, covariance = prior_of_media(*directions_deg, rough_share, without)
        variances, vectors = np.linalg.eigh(covariance / np.outer(error, error))
        variances = np.maximum(variances, 0)
        mean = vectors.T @ (prior_mean / error)
        for name, matrix in AXES.items():
            alpha_z, alpha_x = np.array(matrix) @ np.stack([alpha[0], side * alpha[1]])
            alpha_in_axes = np.concatenate([alpha_z, side * alpha_x])
            turned = vectors.T @ (alpha_in_axes / error)
            expected_square = prior_mean @ prior_mean + np.trace(covariance)
            size = math.sqrt(alpha_in_axes @ alpha_in_axes / expected_square)
            sizes = (size * _SIZES)[:, None]
            variance = 1 + sizes**2 * variances
            misfit = (np.log(variance) + (turned - sizes * mean) ** 2 / variance).sum(axis=-1)
            total = np.logaddexp.reduce(-0.5 * misfit)
            evidence[name] = float(np.logaddexp(evidence[name], total))
    return {name: value - evidence["as-given"] for name, value in evidence.items()}
