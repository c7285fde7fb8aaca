"""What the paper says of the robot, beside what this campaign gives."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.robot.errors import share_within
from rftfit.validate.comparison import DIFFERS, SAME, Item, compare

if TYPE_CHECKING:
    import pandas as pd

PAPER_SHARES = {20: 90.0, 35: 100.0}
"""Share of the measured speeds, %, that the paper's simulation meets within so many per cent."""

BEST_HZ, BEST_CURVATURE, BEST_SPEED_CM_PER_S = 5.0, 0.86, 72.0

_WHERE = "text, Fig. 4C"
_TITLES = {"table": "measured table", "generic": "scaled generic", "depth_only": "depth-only"}
_CAUSES = {
    "generic": "nine terms lift a belly that slides level, where the measured table has next to no lift",
    "depth_only": "without the direction of stress they push like c-legs (as the model legs do)",
}
"""Of the generic profile by exchanging its ingredients (`rftfit.robot.ingredients`); of depth-only as on
the model legs, whose reversed c-leg it lifts like a c-leg."""

_SPEED_TOLERANCE, _CURVATURE_TOLERANCE = 0.1, 0.04


def robot_claims(errors: pd.DataFrame, optimum: pd.DataFrame) -> list[Item]:
    """Compare the paper's statements on the robot with this campaign.

    Parameters
    ----------
    errors : pandas.DataFrame
        Of the robot's tables: a row a condition and profile.
    optimum : pandas.DataFrame
        Best curvature by profile and frequency.

    Returns
    -------
    list of Item
        None where nothing was measured and the sweep has no 5 Hz.
    """
    items: list[Item] = []
    for profile, part in errors.groupby("profile", sort=False):
        items += _shares(part, str(profile))
    best = optimum[np.isclose(optimum["frequency_Hz"], BEST_HZ) & (optimum["profile"] == "table")]
    for row in best.to_dict("records"):
        items += _best(row)
    return items


def _shares(errors: pd.DataFrame, profile: str) -> list[Item]:
    items = []
    predicted = errors[errors["calibrated"] == "no"]
    used = len(errors) - len(predicted)
    for percent, paper in PAPER_SHARES.items():
        within, total = share_within(errors, percent)
        if not total:
            continue
        ours = 100 * within / total
        others, of = share_within(predicted, percent)
        why = f"{within} of {total} conditions"
        if used:
            why += f"; {others} of the {of} that the robot was not calibrated on"
        if within < total:
            why += f"; {_outside(errors, percent, profile)}"
        name = f"robot, {_TITLES.get(profile, profile)}: speeds within {percent} %, % of conditions"
        # the paper speaks of its own profile; it says of depth-only that it does not do
        same = ours >= paper if profile != "depth_only" else ours < PAPER_SHARES[20]
        where = _WHERE if profile == "table" else f"{_WHERE}, S13"
        paper_says: float | str = paper if profile != "depth_only" else "not met"
        items.append(
            Item(name, where, paper_says, ours, math.nan, math.nan, SAME if same else DIFFERS, why)
        )
    return items


def _outside(errors: pd.DataFrame, percent: float, profile: str) -> str:
    """Name the worst conditions, and what most of them have in common."""
    off = errors["error_percent"].to_numpy(float)
    rows = errors[~(np.abs(off) <= percent) & np.isfinite(errors["measured_cm_per_s"])]
    order = rows["error_percent"].abs().sort_values(ascending=False, na_position="first").index
    told = []
    for row in rows.loc[order[:3]].to_dict("records"):
        value = float(row["error_percent"])
        how = f"{value:+.0f} %" if math.isfinite(value) else str(row["reason"])
        told.append(f"R'/r {row['curvature_times_R']:g} at {row['frequency_Hz']:.3g} Hz {how}")
    more = f" and {len(rows) - 3} more" if len(rows) > 3 else ""
    fast = rows[(rows["curvature_times_R"] < 0) & (rows["error_percent"] > 0)]
    cause = ""
    if profile in _CAUSES and 2 * len(fast) >= len(rows):
        cause = f"; {len(fast)} are reversed legs that run too fast: {_CAUSES[profile]}"
    return f"outside: {', '.join(told)}{more}{cause}"


def _best(row: dict[Any, Any]) -> list[Item]:
    where = "text, Fig. 4D"
    told = "the robot was calibrated on this number" if row["calibrated"] == "yes" else ""
    best, lo, hi = (float(row[f"best_curvature_{end}"]) for end in ("times_R", "lo", "hi"))
    speed = float(row["speed_cm_per_s"])
    curvature = compare(
        "robot: best curvature R'/r at 5 Hz", where, BEST_CURVATURE, best, _CURVATURE_TOLERANCE,
        (lo, hi), told,
    )  # fmt: skip
    fastest = compare(
        "robot: speed at the best curvature, 5 Hz, cm/s", where, BEST_SPEED_CM_PER_S, speed,
        _SPEED_TOLERANCE * BEST_SPEED_CM_PER_S, note=told,
    )  # fmt: skip
    return [curvature, fastest]
