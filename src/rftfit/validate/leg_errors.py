"""Measured against predicted force on the legs: peaks, errors over theta, explained variance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.validate.peaks import HALF_WIDTH_DEG, extreme, measured_peak

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from rftfit.conventions import FloatArray

COMPONENTS = ("z", "x")
NUMBERS = ("peak_measured_N", "peak_predicted_N", "peak_predicted_lo_N", "peak_predicted_hi_N",
           "peak_error_percent", "peak_error_lo_percent", "peak_error_hi_percent", "rms_error_N",
           "rms_relative_to_peak", "r2", "theta_from_deg", "theta_to_deg")  # fmt: skip
COLUMNS = ["medium", "leg", "profile", "component", *NUMBERS, "reason"]
FULL_RANGE_DEG = 240.0
"""The published curves span 250 to 260 degrees: a shorter one stopped early."""

_ZERO_DOF = 24
"""Of the zeros of a leg's run and of its tare, twelve each (`measure.autocorrelation`)."""


def leg_errors(
    measured: pd.DataFrame,
    predicted: pd.DataFrame,
    bed_spread: Mapping[str, float] | None = None,
    confidence: float = 0.95,
) -> pd.DataFrame:
    """Compare every predicted curve with its measured one, over the theta that both have.

    Parameters
    ----------
    measured : pandas.DataFrame
        Curves of the leg stage.
    predicted : pandas.DataFrame
        Curves of the prediction stage.
    bed_spread : mapping of str to float, optional
        By how much the force differs from one prepared bed of a medium to the next, as a relative
        standard deviation: a leg is measured in one bed. Default: not known, taken as 0.
    confidence : float, optional
        Level of the interval of the peak error; that of the predicted curves.

    Returns
    -------
    pandas.DataFrame
        One row per medium, leg, profile and component; a predicted curve without a measured one
        has a reason instead of numbers, and one that stopped early near its highest point has no
        peak. The interval of the peak error has the errors of alpha, of
        the leg's readings, of their zero and of the parabola through its peak, and the spread of its
        bed.
    """
    import pandas as pd

    keys = ["medium", "leg"]
    curves = dict(iter(measured.groupby(keys)))
    rows = []
    for (medium, leg, profile), part in predicted.groupby([*keys, "profile"], sort=True):
        own = curves.get((medium, leg))
        name = {"medium": medium, "leg": leg, "profile": profile}
        for component in COMPONENTS:
            spread = (bed_spread or {}).get(str(medium), 0.0)
            found = _compare(own, part, component, spread, confidence)
            rows.append(name | {"component": component} | found)
    return pd.DataFrame(rows, columns=COLUMNS)


def _compare(
    measured: pd.DataFrame | None,
    predicted: pd.DataFrame,
    component: str,
    spread: float,
    confidence: float,
) -> dict[str, float | str]:
    row: dict[str, float | str] = dict.fromkeys(NUMBERS, math.nan) | {"reason": ""}
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
    off = ours - truth
    rms = float(np.sqrt(np.mean(off**2)))
    scatter = float(np.sum((truth - truth.mean()) ** 2))
    row |= {"rms_error_N": rms, "r2": 1 - float(off @ off) / scatter if scatter else math.nan}
    if np.ptp(theta) < FULL_RANGE_DEG:
        row["reason"] = f"the measured curve has only theta {theta.min():g} to {theta.max():g} deg"
        if _at_an_end(theta, ours, component) or _at_an_end(theta, truth, component):
            return row | {"reason": f"{row['reason']}, which may leave out its peak"}
    at, found = extreme(ours, component), measured_peak(theta, truth, component)
    peak, best = found.force_N, float(ours[at])
    ends = [float(both[f"force_{component}_{end}_N"].iloc[at]) for end in ("lo", "hi")]
    zero = float(both[f"zero_se_{component}_N"].iloc[at]) if f"zero_se_{component}_N" in both else 0
    # what a parabola does to the prediction, which has no noise, it does to the measured peak
    shape = (measured_peak(theta, ours, component).force_N / best - 1) * peak if best else 0.0
    error = math.hypot(found.se_N, zero, spread * peak, shape)
    lo, hi = _error_interval(best, ends, peak, error, confidence)
    return row | {
        "peak_measured_N": peak,
        "peak_predicted_N": best,
        "peak_predicted_lo_N": ends[0],
        "peak_predicted_hi_N": ends[1],
        "peak_error_percent": 100 * (best / peak - 1) if peak else math.nan,
        "peak_error_lo_percent": lo,
        "peak_error_hi_percent": hi,
        "rms_relative_to_peak": rms / abs(peak) if peak else math.nan,
    }


def _at_an_end(theta: FloatArray, force: FloatArray, component: str) -> bool:
    """Tell whether a part of a curve is highest where it ends: the whole curve may be higher."""
    top = theta[extreme(force, component)]
    return bool(min(top - theta.min(), theta.max() - top) <= HALF_WIDTH_DEG)


def _error_interval(
    predicted: float, ends: list[float], peak: float, error: float, confidence: float
) -> tuple[float, float]:
    """Interval of 100 (predicted / peak - 1), from the errors of both as independent ones."""
    from rftfit.measure.slope import student_quantile

    if not peak or not predicted:
        return math.nan, math.nan
    ratio = predicted / peak
    # errors of the ratio, relative; the lower end of the ratio has the higher measured peak
    below, above = sorted(end / predicted - 1 for end in ends)
    own = float(student_quantile(confidence, _ZERO_DOF)) * abs(error / peak)
    lo, hi = ratio * (1 - math.hypot(below, own)), ratio * (1 + math.hypot(above, own))
    lo, hi = sorted((lo, hi))
    return 100 * (lo - 1), 100 * (hi - 1)
