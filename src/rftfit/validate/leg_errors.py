"""Measured against predicted force on the legs: peaks, errors over theta, explained variance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray

COMPONENTS = ("z", "x")
FULL_RANGE_DEG = 240.0
"""The published curves span 250 to 260 degrees: a shorter one stopped early."""


def leg_errors(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Compare every predicted curve with its measured one, over the theta that both have.

    Parameters
    ----------
    measured : pandas.DataFrame
        Curves of the leg stage.
    predicted : pandas.DataFrame
        Curves of the prediction stage.

    Returns
    -------
    pandas.DataFrame
        One row per medium, leg, profile and component; a predicted curve without a measured one
        has a reason instead of numbers.
    """
    import pandas as pd

    keys = ["medium", "leg"]
    curves = dict(iter(measured.groupby(keys)))
    rows = []
    for (medium, leg, profile), part in predicted.groupby([*keys, "profile"], sort=True):
        own = curves.get((medium, leg))
        name = {"medium": medium, "leg": leg, "profile": profile}
        for component in COMPONENTS:
            rows.append(name | {"component": component} | _compare(own, part, component))
    return pd.DataFrame(rows)


def _compare(
    measured: pd.DataFrame | None, predicted: pd.DataFrame, component: str
) -> dict[str, float | str]:
    names = ("peak_measured_N", "peak_predicted_N", "peak_predicted_lo_N", "peak_predicted_hi_N",
             "peak_error_percent", "rms_error_N", "rms_relative_to_peak", "r2", "theta_from_deg",
             "theta_to_deg")  # fmt: skip
    row: dict[str, float | str] = dict.fromkeys(names, math.nan) | {"reason": ""}
    if measured is None:
        return row | {"reason": "no measured curve"}
    both = measured.merge(predicted, on="theta_deg", suffixes=("_measured", ""))
    ours = both[f"force_{component}_N"].to_numpy(float)
    truth = both[f"force_{component}_N_measured"].to_numpy(float)
    theta = both["theta_deg"].to_numpy(float)
    if theta.size == 0:
        return row | {"reason": "measured and predicted curve share no theta"}
    row |= {"theta_from_deg": float(theta.min()), "theta_to_deg": float(theta.max())}
    if not np.isfinite(ours).all():
        why = [str(reason) for reason in both["reason"].unique() if str(reason)]
        return row | {"reason": "; ".join(why) or "the prediction has no number"}
    if np.ptp(theta) < FULL_RANGE_DEG:
        row["reason"] = f"the measured curve has only theta {theta.min():g} to {theta.max():g} deg"
    at, peak = _peak(ours, component), float(truth[_peak(truth, component)])
    off = ours - truth
    rms = float(np.sqrt(np.mean(off**2)))
    spread = float(np.sum((truth - truth.mean()) ** 2))
    return row | {
        "peak_measured_N": peak,
        "peak_predicted_N": float(ours[at]),
        "peak_predicted_lo_N": float(both[f"force_{component}_lo_N"].iloc[at]),
        "peak_predicted_hi_N": float(both[f"force_{component}_hi_N"].iloc[at]),
        "peak_error_percent": 100 * (float(ours[at]) / peak - 1) if peak else math.nan,
        "rms_error_N": rms,
        "rms_relative_to_peak": rms / abs(peak) if peak else math.nan,
        "r2": 1 - float(off @ off) / spread if spread else math.nan,
    }


def _peak(force: FloatArray, component: str) -> int:
    """Place of the largest lift, or of the largest horizontal force of either sign."""
    return int(np.argmax(force if component == "z" else np.abs(force)))
