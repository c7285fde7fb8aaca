"""How much alpha differs from run to run: the bed is never prepared twice alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.conventions import FloatArray

LEAST_DOF = 5
"""Fewer repeats than this say too little to speak for the runs of other cells."""

GIVEN_DOF = 1e6
"""Degrees of freedom of a variance that is given, not estimated."""

AS_PREPARED, REPEATS, STATED = "one bed as prepared", "repeats", "stated"


@dataclass(frozen=True)
class Spread:
    """Run-to-run variance of one component of alpha in one medium.

    Parameters
    ----------
    variance : float
        (N/cm^3)^2, beyond what the errors of the single runs explain; 0 if not known.
    dof : float
        Its degrees of freedom.
    source : str
        `REPEATS` of the run sheet, `STATED` in the config, or `AS_PREPARED`: not known, intervals
        are those of one bed as prepared.
    """

    variance: float = 0.0
    dof: float = GIVEN_DOF
    source: str = AS_PREPARED

    @property
    def deviation(self) -> float:
        """Standard deviation, N/cm^3; NaN where it is not known."""
        return math.nan if self.source == AS_PREPARED else math.sqrt(self.variance)


def spread_of_runs(groups: Sequence[tuple[FloatArray, FloatArray]], stated: float | None) -> Spread:
    """Find the run-to-run variance from repeats, else from what is stated.

    Parameters
    ----------
    groups : sequence of (alpha, se)
        Runs of one cell (and depth) each, arrays of shape (n,), N/cm^3; single runs are passed over.
    stated : float or None
        Standard deviation from the config, N/cm^3.

    Returns
    -------
    Spread
        From repeats if they have `LEAST_DOF` degrees of freedom together: mean square between runs
        less the mean square of their own errors, not below 0, with the degrees of freedom of the
        difference (Satterthwaite).
    """
    repeated = [(alpha, se) for alpha, se in groups if alpha.size > 1]
    dof = sum(alpha.size - 1 for alpha, _ in repeated)
    if dof < LEAST_DOF:
        return Spread() if stated is None else Spread(stated**2, GIVEN_DOF, STATED)
    between = sum(float(np.sum((alpha - alpha.mean()) ** 2)) for alpha, _ in repeated) / dof
    own = sum((se.size - 1) * float(np.mean(se**2)) for _, se in repeated) / dof
    variance = max(between - own, 0.0)
    known = dof * (variance / between) ** 2 if variance > 0 else float(dof)
    return Spread(variance, known, REPEATS)


def mean_of_repeats(
    alpha: FloatArray, se: FloatArray, dof: FloatArray, spread: Spread
) -> tuple[float, float, float]:
    """Mean of the runs of one cell, its standard error and degrees of freedom.

    Parameters
    ----------
    alpha, se, dof : numpy.ndarray, shape (n,)
        Of the runs, N/cm^3.
    spread : Spread

    Returns
    -------
    mean, se, dof : float
        Where the spread is not known, the scatter of the cell's own runs counts if it is larger
        than their errors.
    """
    from rftfit.measure.autocorrelation import combine_dof

    n = alpha.size
    mean = float(alpha.mean())
    within = (se / n) ** 2
    if spread.source == AS_PREPARED and n > 1:
        between = float(alpha.var(ddof=1)) / n
        if between > within.sum():
            return mean, math.sqrt(between), n - 1.0
    parts = np.append(within, spread.variance / n)
    dofs = np.append(dof, spread.dof)
    return mean, math.sqrt(float(parts.sum())), float(combine_dof(parts, dofs))
