"""Which harmonics an information criterion would keep, for comparison with the 0.05 A00 rule."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rftfit.profile.symmetry import check_grid, symmetrise

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.conventions import FloatArray

ORDER_BETA = 2
ORDER_GAMMA = 2


@dataclass(frozen=True)
class Harmonic:
    """One term that the symmetry allows: function of m 2 beta + n gamma.

    Parameters
    ----------
    name : str
        As in Table S2: letter, m, n; a leading minus of m written as m.
    component : str
        ``z`` or ``x``.
    m, n : int
        Multiples of 2 beta and of gamma.
    sine : bool
        Sine or cosine.
    """

    name: str
    component: str
    m: int
    n: int
    sine: bool

    def values(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Value of the term.

        Parameters
        ----------
        beta, gamma : numpy.ndarray
            rad; shapes broadcast.

        Returns
        -------
        numpy.ndarray
        """
        phase = 2 * self.m * beta + self.n * gamma
        function: Callable[[FloatArray], FloatArray] = np.sin if self.sine else np.cos
        return function(phase)


def harmonics(component: str) -> list[Harmonic]:
    """Terms up to second order in beta and gamma that obey the mirror symmetry.

    Under (beta, gamma) to (-beta, pi - gamma) alpha_z keeps its sign and alpha_x turns it: alpha_z
    takes cosines of even and sines of odd n, alpha_x the others.

    Parameters
    ----------
    component : str
        ``z`` or ``x``.

    Returns
    -------
    list of Harmonic
        The constant first.
    """
    found = []
    for n in range(ORDER_GAMMA + 1):
        for m in range(-ORDER_BETA, ORDER_BETA + 1):
            if n == 0 and m < 0:
                continue
            sine = (n % 2 == 1) == (component == "z")
            if sine and m == 0 and n == 0:
                continue
            letter = {("z", False): "A", ("z", True): "B", ("x", False): "C", ("x", True): "D"}
            sign = f"m{-m}" if m < 0 else str(m)
            name = f"{letter[component, sine]}{sign}{n}"
            found.append(
                Harmonic(name.replace("Bm11", "Bm1").replace("Cm11", "Cm1"), component, m, n, sine)
            )
    return found


def select_bic(
    beta: FloatArray, gamma: FloatArray, alpha_z: FloatArray, alpha_x: FloatArray
) -> dict[str, bool]:
    """Keep the harmonics that lower the Bayesian information criterion (forward and backward).

    Parameters
    ----------
    beta, gamma : numpy.ndarray, shape (nb,), (ng,)
        rad, the measured grid from -90 to 90 degrees.
    alpha_z, alpha_x : numpy.ndarray, shape (nb, ng)
        N/cm^3; NaN where not measured.

    Returns
    -------
    dict of str to bool
        Name of every candidate term to whether it is kept.

    Raises
    ------
    ValueError
        If the grid is not symmetric.
    """
    check_grid(beta, gamma)
    alpha_z, alpha_x = symmetrise(alpha_z, alpha_x)
    # beta = -90 degrees is the same plate as +90: one of them
    rows = np.flatnonzero(~np.isclose(beta, -np.pi / 2))
    b, g = np.meshgrid(beta[rows], gamma, indexing="ij")
    kept: dict[str, bool] = {}
    for component, alpha in (("z", alpha_z), ("x", alpha_x)):
        candidates = harmonics(component)
        values = alpha[rows].ravel()
        there = np.isfinite(values)
        columns = np.stack([term.values(b, g).ravel()[there] for term in candidates], axis=1)
        chosen = _best_subset(columns, values[there])
        kept.update({term.name: index in chosen for index, term in enumerate(candidates)})
    return kept


def _bic(columns: FloatArray, values: FloatArray) -> float:
    solution, *_ = np.linalg.lstsq(columns, values, rcond=None)
    rest = values - columns @ solution
    n = values.size
    # a table that the terms describe exactly leaves rounding, not zero
    noise = max(float(rest @ rest) / n, 1e-18)
    return float(n * np.log(noise) + columns.shape[1] * np.log(n))


def _best_subset(columns: FloatArray, values: FloatArray) -> set[int]:
    """Add or drop one or exchange two terms as long as that lowers the criterion."""
    everything = range(columns.shape[1])
    chosen: set[int] = {0}
    best = _bic(columns[:, [0]], values)
    while True:
        trials = [chosen ^ {index} for index in everything]
        trials += [
            chosen ^ {a, b}
            for a, b in combinations(everything, 2)
            if (a in chosen) != (b in chosen)
        ]
        scored = [
            (_bic(columns[:, sorted(trial)], values), sorted(trial)) for trial in trials if trial
        ]
        lowest = min(scored)
        if lowest[0] >= best - 1e-9:
            return chosen
        best, chosen = lowest[0], set(lowest[1])
