"""Alpha at stated depths, for a medium whose stress is no line through zero of depth; the law of such a medium.

Where stress is curved, alpha (stress over depth, N/cm^3) depends on depth. `curved_law` reads from the checks which law
the medium follows, and `alpha_at_depths` makes its table of alpha anew by that law at each depth of ``fit.depths_cm``.

``fits`` is the table of fits, a row a plate run: ``gamma_deg``, ``direction``, ``alpha_z_N_per_cm3``, ``exponent_z``
(of depth), ``offset_cm`` (depth at which a straight line has no stress), ``depth_from_cm``, ``depth_to_cm`` (its
window). ``checks`` is the table of checks, a row a check: ``check`` (its name), ``verdict``, ``code`` (what it found).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.alpha import column
from rftfit.measure.errors import SurfaceError, errors_of
from rftfit.measure.fits import fit_medium
from rftfit.measure.laws import DepthLaw
from rftfit.measure.verdict_words import ACCEPTED, FAILED
from rftfit.store.chosen import chosen

CLEAR_ALPHA: float = chosen("measure", "laws").clear_alpha
"""Number of standard errors above which alpha of a run is clear, so that its law of depth counts."""


def is_steep(fits: pd.DataFrame) -> pd.Series[bool]:
    """Return True for runs whose path is steep enough to show how stress grows with depth: 45 degrees or more."""
    return fits["gamma_deg"].abs() >= 45


def steep_pushes(fits: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of the fits from which the exponent of depth of a medium is estimated: clear, steep pushes."""
    alpha, se = fits[column("z")].abs(), fits[column("z", "_se")]
    is_steep_push = (fits["direction"] == "intrusion") & is_steep(fits)
    return fits[is_steep_push & (alpha > CLEAR_ALPHA * se) & fits["exponent_z"].notna()]


LawName = Literal["free_intercept", "power"]


class CurvedLaw(NamedTuple):
    """Law by which stress of a medium grows with depth, if not a line through zero.

    `law`: A line with a free intercept, or a power of depth.
    `power`: Exponent of depth, median over directions; NaN for a line with an intercept.
    """

    law: LawName
    power: float

    def __str__(self) -> str:
        return "c + alpha depth" if math.isnan(self.power) else f"depth^{self.power:.2f}"


_LAW_OF_CODE: dict[str, LawName] = {
    "linearity": "power",
    "linearity-or-surface": "power",
    "law-power": "power",
    "law-intercept": "free_intercept",
}
"""Codes of the check `linearity` that name a law; a crust has none."""


def median_over_directions(runs: pd.DataFrame, column: str, tolerance_deg: float) -> float:
    """Median over directions of the mean of a `column` over their runs, so that no direction with many runs outweighs.

    `tolerance_deg`: Difference of each angle up to which directions are one.
    """
    return float(runs.groupby(number_rows(runs, tolerance_deg))[column].mean().median())


def curved_law(fits: pd.DataFrame, checks: pd.DataFrame, tolerance_deg: float) -> CurvedLaw | None:
    """Law of a medium that fails the check `linearity`; None for other media.

    `tolerance_deg`: Tolerance of angles of the campaign's grid.
    """
    linearity_rows = checks[
        (checks["check"] == "linearity") & checks["verdict"].isin((FAILED, ACCEPTED))
    ]
    law = _LAW_OF_CODE.get(str(next(iter(linearity_rows["code"]), "")))
    if law is None:
        return None
    power = math.nan
    if law == "power":
        power = median_over_directions(steep_pushes(fits), "exponent_z", tolerance_deg)
    return CurvedLaw(law, power)


def offset_of_law(curved: CurvedLaw, fits: pd.DataFrame) -> FloatArray:
    """Depth at which the straight line fitted to a run reaches zero stress because stress is curved, cm.

    Shape (runs,). Else such an offset would look like a surface that is off. For a power law this is the zero of the
    straight line through depth^p over the window of the run, evenly sampled. For a line with an intercept it is the
    median of the zeros of all runs.
    """
    if curved.law == "free_intercept":
        return np.full(len(fits), float(fits["offset_cm"].median()))
    top, end = (fits[f"depth_{side}_cm"].to_numpy(float) for side in ("from", "to"))
    with np.errstate(invalid="ignore", divide="ignore"):
        # means over the window of depth, depth^2, depth^p and depth^(p + 1)
        powers = 1, 2, curved.power, curved.power + 1
        depth, square, stress, product = (
            (end ** (power + 1) - top ** (power + 1)) / (power + 1) / (end - top)
            for power in powers
        )
        # least squares: covariance of depth and stress over the variance of depth
        slope = (product - depth * stress) / (square - depth**2)
        return np.where(end > top, depth - stress / slope, np.nan)


def alpha_at_depths(
    campaign: Campaign,
    medium: str,
    tables: Mapping[str, pd.DataFrame],
    cells: Callable[[pd.DataFrame, DepthLaw, SurfaceError], pd.DataFrame],
) -> pd.DataFrame:
    """Stress over depth of every cell at each of `fit.depths_cm`, by the curved law of the medium.

    Returns an alpha table with the further column ``depth_cm``, a row a cell and depth; without a curved law it has no
    rows. The part of the runs' offsets that the law explains is not counted as an error of the surface.

    `tables`: ``runs``, ``tares``, ``fits``, ``tared``, ``checks`` and ``alpha`` of the medium.
    `cells`: Function that makes a table of alpha from fits, their law at a depth, and the error of the surface.
    """
    empty_table = tables["alpha"].iloc[:0].copy()
    empty_table.insert(3, "depth_cm", 0.0)
    curved = curved_law(tables["fits"], tables["checks"], campaign.config.grid.angle_tolerance_deg)
    if curved is None:
        return empty_table
    explained_cm = offset_of_law(curved, tables["fits"])
    _, surface = errors_of(tables["fits"], campaign.config, explained_cm)
    tables_of_depths = [empty_table]
    for depth_cm in campaign.config.fit.depths_cm:
        law = DepthLaw(curved.law, depth_cm)
        inputs = tables["runs"], tables["tared"], tables["tares"]
        fits, _, _ = fit_medium(campaign, medium, *inputs, law=law)
        table = cells(fits, law, surface)
        table.insert(3, "depth_cm", depth_cm)
        tables_of_depths.append(table)
    return pd.concat(tables_of_depths, ignore_index=True)
