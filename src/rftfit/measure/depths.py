"""Alpha of stated depths, where stress is no line: by a power of depth, with its own interval."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import errors_of
from rftfit.measure.fits import fit_medium
from rftfit.measure.slopes import CURVED_P

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from rftfit.campaign.load import Campaign

MOST_BENT, LEAST_POWER = 0.5, 0.05
"""Stress of a medium is curved where more than this share of its steep runs shows a curvature that is no noise,
and the median of their exponents differs from 1 by more than this."""


def steep_runs(fits: pd.DataFrame) -> pd.DataFrame:
    """Runs whose windows are long enough to tell an exponent."""
    steep: pd.DataFrame = fits[
        (fits["direction"] != "horizontal")
        & (fits["gamma_deg"].abs() >= 45)
        & fits["exponent_z"].notna()
    ]
    return steep


def power_of(fits: pd.DataFrame) -> float:
    """Median exponent of depth of a medium whose stress is curved; NaN of one whose stress is not."""
    steep = steep_runs(fits)
    power = float(steep["exponent_z"].median()) if len(steep) else 1.0
    bent = float((steep["nonlinear_z_p"] < CURVED_P).mean())
    return power if abs(power - 1) > LEAST_POWER and bent > MOST_BENT else math.nan


def alpha_at_depths(
    campaign: Campaign, medium: str, tables: Mapping[str, pd.DataFrame], like: pd.DataFrame
) -> pd.DataFrame:
    """Stress over depth of every cell at `fit.depths_cm` by a power of depth; no rows where stress is a line.

    `tables`: ``runs``, ``tares``, ``fits`` and ``tared`` of the medium; `like`: its alpha table.
    """
    import pandas as pd

    config = campaign.config
    errors, surface = errors_of(tables["fits"], config)
    level, depths = config.fit.confidence, len(config.fit.horizontal_depths_cm)
    parts = [like.iloc[:0].copy()]
    parts[0].insert(3, "depth_cm", 0.0)
    for at in config.fit.depths_cm if math.isfinite(power_of(tables["fits"])) else ():
        fit = config.fit.model_copy(update={"law": "power", "law_depth_cm": at})
        bent = replace(campaign, config=config.model_copy(update={"fit": fit}))
        fits = fit_medium(bent, medium, tables["runs"], tables["tared"], tables["tares"])[0]
        grid = config.grid_of(medium)
        table = alpha_table(fits, medium, level, depths, errors, grid, surface, at)
        table.insert(3, "depth_cm", at)
        parts.append(table)
    return pd.concat(parts, ignore_index=True)
