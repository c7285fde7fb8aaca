"""The leg curvature that runs fastest, with its interval, at every stride frequency of a sweep."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.robot.intervals import BEST
from rftfit.robot.sweep import best_curvature

if TYPE_CHECKING:
    from collections.abc import Collection

    import pandas as pd

    from rftfit.conventions import FloatArray

COLUMNS = [
    "medium", "profile", "frequency_Hz", "best_curvature_times_R", "best_curvature_lo",
    "best_curvature_hi", "reading_lo", "reading_hi", "speed_cm_per_s", "fastest_curvature_times_R", "fastest_speed_cm_per_s",
    "curvatures", "calibrated", "reason",
]  # fmt: skip
"""Columns of the table of optima: lo and hi are the interval that follows from the errors of alpha, the
reading is the range within which the points of the sweep leave the top."""

FEWEST_CURVATURES = 5
DRAWS = 1000
WINDOW = 0.2
_SEED = 2013


def optima(
    speed: pd.DataFrame,
    calibrated: Collection[float] = (),
    confidence: float = 0.95,
    widths: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Find the best curvature at every frequency that has enough curvatures.

    The best curvature is the top of the parabola through the points within 0.2 of the fastest one
    (`rftfit.robot.sweep.best_curvature`). Its interval is that of the errors of alpha
    (`rftfit.robot.intervals`), known at 5 Hz. Apart from it stands the range of reading, a bootstrap:
    starting phases are drawn anew at every curvature, and the points' distances from the parabola
    are given random signs. The model is deterministic, so this is no error of measurement but how
    well a top can be read off a curve that is known at some points and starting phases only; it is
    never narrower than half a step of the curvatures to either side. Where the top is a grid point
    itself, it reaches to the neighbouring points.

    Parameters
    ----------
    speed : pandas.DataFrame
        A row a run: `medium, profile`, and the columns of `rftfit.robot.sweep.speed_table`.
    calibrated : collection of float, optional
        Frequencies (Hz) whose optimum, on the profile ``table``, the robot was calibrated on.
    confidence : float, optional
        Of the bootstrap.
    widths : pandas.DataFrame, optional
        Half widths of the intervals, columns `rftfit.robot.intervals.COLUMNS`; without them the
        intervals are empty.

    Returns
    -------
    pandas.DataFrame
        Columns `COLUMNS`.
    """
    import pandas as pd

    half = _half_widths(widths)
    rows = []
    for (medium, profile), whole in speed.groupby(["medium", "profile"], sort=False):
        for frequency in sorted(set(whole["frequency_Hz"].tolist())):
            part = whole[whole["frequency_Hz"] == frequency]
            if part["curvature_times_R"].nunique() < FEWEST_CURVATURES or frequency == 0:
                continue
            near = any(abs(frequency - one) < 1e-6 for one in calibrated)
            told = "yes" if near and profile == "table" else "no"
            wide = half.get((profile, frequency), math.nan)
            rows.append((medium, profile, frequency, *_optimum(part, confidence, told, wide)))
    return pd.DataFrame(rows, columns=COLUMNS)


def _half_widths(widths: pd.DataFrame | None) -> dict[tuple[Any, float], float]:
    if widths is None:
        return {}
    own = widths[widths["quantity"] == BEST]
    keys = zip(own["profile"], own["frequency_Hz"], strict=True)
    return dict(zip(keys, own["half_width"].astype(float), strict=True))


def _optimum(
    part: pd.DataFrame, confidence: float, calibrated: str, half: float
) -> tuple[object, ...]:
    steady = part[part["outcome"] == "steady"]
    groups = [
        (one, steady.loc[steady["curvature_times_R"] == one, "speed_cm_per_s"].to_numpy(float))
        for one in sorted(set(steady["curvature_times_R"].tolist()))
    ]
    lost = part["curvature_times_R"].nunique() - len(groups)
    reason = f"no steady run at {lost} curvatures" if lost else ""
    if not groups:
        return (*(math.nan,) * 8, 0, calibrated, reason)
    curvature = np.array([one for one, _ in groups])
    speeds = [values for _, values in groups]
    mean = np.array([values.mean() for values in speeds])
    best, top_speed = best_curvature(curvature, mean)
    top = int(np.argmax(mean))
    lo, hi = reading(curvature, speeds, best, confidence)
    fastest = (float(curvature[top]), float(mean[top]))
    measured = (best, best - half, best + half)
    return (*measured, lo, hi, top_speed, *fastest, len(groups), calibrated, reason)


def reading(
    curvature: FloatArray, speeds: list[FloatArray], best: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Range within which the best curvature is read, see `optima`.

    Parameters
    ----------
    curvature : numpy.ndarray, shape (n,)
        In order.
    speeds : list of numpy.ndarray
        Of the starting phases, at each curvature.
    best : float
        From `rftfit.robot.sweep.best_curvature`.
    confidence : float, optional

    Returns
    -------
    lo, hi : float
    """
    mean = np.array([values.mean() for values in speeds])
    top = int(np.argmax(mean))
    near = np.flatnonzero(np.abs(curvature - curvature[top]) <= WINDOW + 1e-9)
    beside = curvature[max(top - 1, 0)], curvature[min(top + 1, len(curvature) - 1)]
    if near.size < 4 or best == curvature[top]:
        return float(min(beside[0], best)), float(max(beside[1], best))
    rng = np.random.default_rng(_SEED)
    draws = np.stack(
        [rng.choice(speeds[i], (DRAWS, speeds[i].size)).mean(axis=1) for i in near]
    )  # (points, draws)
    x = curvature[near] - curvature[top]
    design = np.vander(x, 3)
    solve = np.linalg.pinv(design)
    off = mean[near] - design @ (solve @ mean[near])
    # residuals of a fit with three parameters are smaller than what they stand for
    off *= math.sqrt(near.size / (near.size - 3))
    draws += off[:, None] * rng.choice([-1.0, 1.0], draws.shape)
    square, slope, _ = solve @ draws
    place = np.where(
        square < 0, -slope / (2 * np.where(square < 0, square, 1.0)), x[mean[near].argmax()]
    )
    place = np.clip(place, x[0], x[-1]) + curvature[top]
    lo, hi = np.quantile(place, [(1 - confidence) / 2, (1 + confidence) / 2])
    half = float(np.median(np.diff(curvature[near]))) / 2
    return float(min(lo, best - half)), float(max(hi, best + half))
