"""Tared samples as stress, for the figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.rows import Why

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.load import Campaign


def stress_samples(campaign: Campaign, tared: pd.DataFrame, windows: pd.DataFrame) -> pd.DataFrame:
    """Stress of every plate run in the lab frame, and whether it was fitted.

    Parameters
    ----------
    campaign : Campaign
    tared, windows : pandas.DataFrame
        Of one medium, from the tare and slope stages; the same rows.

    Returns
    -------
    pandas.DataFrame
        `run_id, depth_cm, path_cm, stress_z_N_per_cm2, stress_x_N_per_cm2, tare_z_N_per_cm2,
        tare_x_N_per_cm2, in_window`.
    """
    import pandas as pd

    runs = campaign.by_id
    run_id = tared["run_id"].astype("category")
    names = [str(name) for name in run_id.cat.categories]
    # legs have no area and are not drawn here
    area = np.array(
        [
            getattr(campaign.config.intruders[runs[name].intruder], "area_cm2", np.nan)
            for name in names
        ]
    )[run_id.cat.codes.to_numpy()]
    samples = pd.DataFrame(
        {
            "run_id": tared["run_id"].astype(str),
            "depth_cm": tared["depth_cm"],
            "path_cm": tared["path_cm"],
            **{
                f"{what}_{c}_N_per_cm2": tared[f"{column}_{c}_N"] / area
                for what, column in (("stress", "force"), ("tare", "tare"))
                for c in "zx"
            },
            "in_window": windows["why"].to_numpy() == Why.GOOD,
        }
    )
    plates: pd.DataFrame = samples[np.isfinite(area)].reset_index(drop=True)
    return plates
