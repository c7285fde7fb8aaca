"""Alpha of stated depths, where stress is no line: by a power of depth, with its own interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.measure.alpha import column
from rftfit.measure.fits import fit_medium
from rftfit.measure.verdicts import ACCEPTED, FAILED


def steep_pushes(fits: pd.DataFrame) -> pd.DataFrame:
    """Runs by which the check `linearity` tells an exponent of depth."""
    alpha, se = fits[column("z")].abs(), fits[column("z", "_se")]
    steep = (fits["direction"] == "intrusion") & (fits["gamma_deg"].abs() >= 45)
    return fits[steep & (alpha > 3 * se) & fits["exponent_z"].notna()]


def power_of(fits: pd.DataFrame, checks: pd.DataFrame) -> float:
    """Median exponent of depth of a medium that fails the check `linearity`; NaN of others."""
    verdict = checks.loc[checks["check"] == "linearity", "verdict"]
    curved = verdict.isin((FAILED, ACCEPTED)).any()
    return float(steep_pushes(fits)["exponent_z"].median()) if curved else math.nan


def alpha_at_depths(
    campaign: Campaign,
    medium: str,
    tables: Mapping[str, pd.DataFrame],
    cells: Callable[[pd.DataFrame, float], pd.DataFrame],
) -> pd.DataFrame:
    """Stress over depth of every cell at `fit.depths_cm` by a power of depth; no rows where stress is a line.

    `tables`: ``runs``, ``tares``, ``fits``, ``tared``, ``checks`` and ``alpha`` of the medium; `cells`: makes
    a table of alpha from fits, at a depth.
    """
    config = campaign.config
    parts = [tables["alpha"].iloc[:0].copy()]
    parts[0].insert(3, "depth_cm", 0.0)
    curved = math.isfinite(power_of(tables["fits"], tables["checks"]))
    for at in config.fit.depths_cm if curved else ():
        fit = config.fit.model_copy(update={"law": "power", "law_depth_cm": at})
        with_power = replace(campaign, config=config.model_copy(update={"fit": fit}))
        fits = fit_medium(with_power, medium, tables["runs"], tables["tared"], tables["tares"])[0]
        table = cells(fits, at)
        table.insert(3, "depth_cm", at)
        parts.append(table)
    return pd.concat(parts, ignore_index=True)
