"""Alpha of stated depths, where stress is no line through zero: by its own law, with its own interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import pandas as pd

from rftfit.campaign.config import Law
from rftfit.campaign.load import Campaign
from rftfit.measure.alpha import column
from rftfit.measure.fits import fit_medium
from rftfit.measure.verdicts import ACCEPTED, FAILED


def steep_pushes(fits: pd.DataFrame) -> pd.DataFrame:
    """Runs by which the check `linearity` tells an exponent of depth."""
    alpha, se = fits[column("z")].abs(), fits[column("z", "_se")]
    steep = (fits["direction"] == "intrusion") & (fits["gamma_deg"].abs() >= 45)
    return fits[steep & (alpha > 3 * se) & fits["exponent_z"].notna()]


class CurvedLaw(NamedTuple):
    """Law by which stress of a medium grows with depth where that is no line through zero.

    `law`: as of `fit.law`. `power`: exponent of depth, median over directions; NaN of a line with an intercept.
    """

    law: Law
    power: float

    def __str__(self) -> str:
        return "c + alpha depth" if math.isnan(self.power) else f"depth^{self.power:.2f}"


LAW_OF_CODE: dict[str, Law] = {
    "linearity": "power",
    "linearity-or-surface": "power",
    "law-power": "power",
    "law-intercept": "free_intercept",
}
"""Codes of the check `linearity` that name a law; a crust has none."""


def median_over_directions(runs: pd.DataFrame, column: str) -> float:
    """Median over directions of the mean of their runs."""
    return float(runs.groupby(["beta_deg", "gamma_deg"])[column].mean().median())


def curved_law(fits: pd.DataFrame, checks: pd.DataFrame) -> CurvedLaw | None:
    """Law of a medium that fails the check `linearity`; None of others."""
    linearity_rows = checks[
        (checks["check"] == "linearity") & checks["verdict"].isin((FAILED, ACCEPTED))
    ]
    law = LAW_OF_CODE.get(str(next(iter(linearity_rows["code"]), "")))
    if law is None:
        return None
    power = median_over_directions(steep_pushes(fits), "exponent_z") if law == "power" else math.nan
    return CurvedLaw(law, power)


def alpha_at_depths(
    campaign: Campaign,
    medium: str,
    tables: Mapping[str, pd.DataFrame],
    cells: Callable[[pd.DataFrame, float], pd.DataFrame],
) -> pd.DataFrame:
    """Stress over depth of every cell at `fit.depths_cm` by the law that was told; no rows where stress is a line.

    `tables`: ``runs``, ``tares``, ``fits``, ``tared``, ``checks`` and ``alpha`` of the medium; `cells`: makes
    a table of alpha from fits, at a depth.
    """
    config = campaign.config
    parts = [tables["alpha"].iloc[:0].copy()]
    parts[0].insert(3, "depth_cm", 0.0)
    curved = curved_law(tables["fits"], tables["checks"])
    if curved is None:
        return parts[0]
    for depth_cm in config.fit.depths_cm:
        fit = config.fit.model_copy(update={"law": curved.law, "law_depth_cm": depth_cm})
        by_law = replace(campaign, config=config.model_copy(update={"fit": fit}))
        fits = fit_medium(by_law, medium, tables["runs"], tables["tared"], tables["tares"])[0]
        table = cells(fits, depth_cm)
        table.insert(3, "depth_cm", depth_cm)
        parts.append(table)
    return pd.concat(parts, ignore_index=True)
