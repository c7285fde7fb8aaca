"""The robot beside the paper: its statements as rows of the reproduction table, and the leg curvature that runs fastest.

`speed` is the table of simulated runs (``speed.csv`` of a sweep): `medium`, `profile`, ``frequency_Hz``,
``curvature_times_R`` (R'/r of the legs: 1 for the c-leg, 0 flat, -1 reversed), ``phase_turns`` (of the legs at the
start), `outcome` and, where steady, ``speed_cm_per_s``. `errors` are the speeds beside the measured ones, a row a
condition (curvature and frequency) on a profile.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import numpy as np
import pandas as pd

from rftfit.compare.published import (
    CALIBRATED,
    MEASURED,
    TEXT,
    UNJUDGED,
    Item,
    Tolerance,
    compare_numbers,
    same_if,
)
from rftfit.conventions import FloatArray
from rftfit.measure.flags import reason_columns, remark
from rftfit.model.draws import DRAWS
from rftfit.outputs.dictionary import columns_of
from rftfit.robot.intervals import BEST, half_widths
from rftfit.robot.speeds import share_within
from rftfit.robot.sweep import RANGE_IN_VIEW, best_curvature

PAPER_SHARES = {20: 90.0, 35: 100.0}
"""Share of the measured speeds, %, that the paper's simulation meets, by the percentage within which it meets them."""

BEST_HZ, BEST_CURVATURE, BEST_SPEED_CM_PER_S = 5.0, 0.86, 72.0
"""Best curvature R'/r and its speed at this frequency, by the text of the paper on Fig. 4D."""

_WHERE = "text, Fig. 4C"
_TITLES = {"table": "measured table", "generic": "scaled generic", "depth_only": "depth-only"}
_CAUSES = {
    "generic": "nine terms lift a belly that slides level, where the measured table has next to no lift",
    "depth_only": "without the direction of stress they push like c-legs (as the model legs do)",
}
"""Causes of speeds that are too high, by profile. The one of the generic profile was found by exchanging its
ingredients, 2026-11-24 (git history: `studies/ingredients.py`); depth-only lifts the reversed c-leg of the model legs
like a c-leg, too."""

_SPEED = Tolerance(1, "printed to 1 cm/s")
_CURVATURE = Tolerance(0.04, "one step of the paper's sweep")
_SHARE = Tolerance(0, "at least the share that is stated")
_UP_TO = Tolerance(5, "printed to 10 %")
_PHASE = Tolerance(1, "cm/s: what is stated")
_NEAR_ONE = 0.8
"""Least R'/r that counts as near that of a c-leg."""


def robot_claims(errors: pd.DataFrame, optimum: pd.DataFrame, speed: pd.DataFrame) -> list[Item]:
    """Compare the paper's statements on the robot with this campaign, as far as its runs allow.

    `errors`, `speed`: see the module. `optimum`: table of `optima`.
    """
    items: list[Item] = []
    for profile, errors_of_profile in errors.groupby("profile", sort=False):
        items += _compare_shares(errors_of_profile, str(profile))
    best = optimum[np.isclose(optimum["frequency_Hz"], BEST_HZ) & (optimum["profile"] == "table")]
    for row in best.to_dict("records"):
        items += _compare_best(row)
    return (
        items
        + _compare_overturning(speed)
        + _compare_phases(speed)
        + [
            Item(
                "robot: seconds of computing for one of motion",
                "text",
                10,
                "not timed here",
                UNJUDGED,
                TEXT,
                "a time is no result that can be made again; docs/performance.md has it",
            )
        ]
    )


def _compare_overturning(speed: pd.DataFrame) -> list[Item]:
    """Compare whether the robot turns over near the c-leg where forces depend on depth only; one item, or none."""
    near = speed[(speed["profile"] == "depth_only") & (speed["curvature_times_R"] >= _NEAR_ONE)]
    if near.empty:
        return []
    over = int((near["outcome"] == "tipped").sum())
    return [
        Item(
            f"robot, depth-only: runs at R'/r of {_NEAR_ONE} and more that turn over",
            "Fig. S13",
            "it turns over near R'/r = 1",
            over,
            same_if(over > 0),
            TEXT,
            f"{over} of {len(near)} runs",
        )
    ]


def _compare_phases(speed: pd.DataFrame) -> list[Item]:
    """Compare how much the starting phase changes a steady speed: in steady motion nothing of it should be left.

    By the largest range of speeds over the phases at one curvature and frequency; one item.
    """
    steady_runs = speed[(speed["profile"] == "table") & (speed["outcome"] == "steady")]
    grouped = steady_runs.groupby(["curvature_times_R", "frequency_Hz"])["speed_cm_per_s"]
    spread = (grouped.max() - grouped.min())[grouped.size() > 1]
    item, says = "robot: change of speed by the starting phase, largest, cm/s", "far below 1"
    if spread.empty:
        why = "one starting phase in this run; `rftfit sweep` has three"
        return [Item(item, "text", says, "not varied", UNJUDGED, TEXT, why)]
    most = float(spread.max())
    why = f"median {spread.median():.2g} over {len(spread)} conditions"
    return [Item(item, "text", says, most, same_if(most < _PHASE.value), TEXT, why, _PHASE)]


def _compare_shares(errors: pd.DataFrame, profile: str) -> list[Item]:
    """Compare the shares of speeds within some errors, which the paper states for the measured table alone.

    Conditions that the robot was calibrated on do not count. `errors`: rows of one `profile`.
    """
    items = []
    predicted = errors[errors["calibrated"] == "no"]
    title = _TITLES.get(profile, profile)
    for percent, paper in PAPER_SHARES.items():
        within, total = share_within(predicted, percent)
        if not total:
            continue
        ours = 100 * within / total
        why = f"{title}, within {percent} %: {within} of {total} conditions that the robot was not calibrated on"
        if len(predicted) < len(errors):
            within_all, total_all = share_within(errors, percent)
            why += f"; {within_all} of all {total_all}; {RANGE_IN_VIEW}"
        if within < total:
            why += f"; {_describe_outside(predicted, percent, profile)}"
        name = f"robot, {title}: speeds within {percent} %, % of conditions"
        if profile == "table":
            items.append(
                Item(name, _WHERE, paper, ours, same_if(ours >= paper), MEASURED, why, _SHARE)
            )
        elif percent < max(PAPER_SHARES):
            continue
        elif profile == "generic":
            says = "reasonable accuracy"
            items.append(Item(name, "text, Fig. S13", says, ours, UNJUDGED, MEASURED, why))
        else:
            most = float(predicted["error_percent"].abs().max())
            name = f"robot, {title}: largest error of speed, %"
            items.append(
                compare_numbers(name, "text, Fig. S13", 150, most, _UP_TO, MEASURED, note=why)
            )
    return items


def _describe_outside(errors: pd.DataFrame, percent: float, profile: str) -> str:
    """Name the worst conditions outside `percent`, and what most of them have in common; `errors`: rows of a profile."""
    off = errors["error_percent"].to_numpy(float)
    rows = errors[~(np.abs(off) <= percent) & np.isfinite(errors["measured_cm_per_s"])]
    # a condition without a predicted speed is the worst
    order = rows["error_percent"].abs().sort_values(ascending=False, na_position="first").index
    worst = []
    for row in rows.loc[order[:3]].to_dict("records"):
        percent_off = float(row["error_percent"])
        error = f"{percent_off:+.0f} %" if math.isfinite(percent_off) else row["reason"]
        worst.append(f"R'/r {row['curvature_times_R']:g} at {row['frequency_Hz']:.3g} Hz {error}")
    rest = f" and {len(rows) - 3} more" if len(rows) > 3 else ""
    fast = rows[(rows["curvature_times_R"] < 0) & (rows["error_percent"] > 0)]
    cause = ""
    if profile in _CAUSES and 2 * len(fast) >= len(rows):
        cause = f"; {len(fast)} are reversed legs that run too fast: {_CAUSES[profile]}"
    return f"outside: {', '.join(worst)}{rest}{cause}"


def _compare_best(row: dict[Any, Any]) -> list[Item]:
    """Compare the best curvature and its speed, two items; `row`: of `optima`, by the measured table at `BEST_HZ`."""
    where = "text, Fig. 4D"
    calibrated = row["calibrated"] == "yes"
    note = "the robot was calibrated on this number" if calibrated else ""
    evidence = CALIBRATED if calibrated else MEASURED
    best, speed = float(row["best_curvature_times_R"]), float(row["speed_cm_per_s"])
    of_best, of_speed = "best curvature R'/r at 5 Hz", "speed at the best curvature, 5 Hz, cm/s"
    return [
        compare_numbers(f"robot: {item}", where, paper, ours, tolerance, evidence, note=note)
        for item, paper, ours, tolerance in (
            (of_best, BEST_CURVATURE, best, _CURVATURE),
            (of_speed, BEST_SPEED_CM_PER_S, speed, _SPEED),
        )
    ]


COLUMNS = columns_of("robot/optimum.csv")
"""Columns of the table of optima: from_alpha is the interval by the errors of alpha alone, the
reading is the range that the points of the sweep leave for the top."""

FEWEST_CURVATURES = 5
"""Fewest curvatures at one frequency among which a best one is looked for."""
WINDOW = 0.2
"""Largest distance of R'/r from the fastest one, of points that the parabola is fitted to."""
_SEED = 2013


def optima(
    speed: pd.DataFrame,
    calibrated: Collection[float] = (),
    confidence: float = 0.95,
    widths: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Find the leg curvature that runs fastest at every stride frequency with enough curvatures; a row of `COLUMNS` each.

    The best curvature is the top of the parabola through the points within 0.2 of the fastest one
    (`rftfit.robot.sweep.best_curvature`). Its interval is that of the errors of alpha, by `widths`
    (`rftfit.robot.intervals`, known at 5 Hz), else empty. The range of reading has columns of its own:
    a bootstrap draws starting phases anew at every curvature, and the points' distances from the parabola
    are multiplied by random signs. The model is deterministic, so this range is no error of measurement: it
    states how well a top can be read off a curve that is known at some points and starting phases only. It is
    never narrower than half a step of the curvatures to either side. Where the top is a grid point
    itself, the range reaches to the neighbouring points. `calibrated`: frequencies (Hz) whose optimum, on the
    profile ``table``, the robot was calibrated on. `confidence`: level of the ranges. `widths`: half widths by the
    errors of alpha; None: not known.
    """
    half_width_of = half_widths(widths, BEST)
    rows = []
    groups = speed.groupby(["medium", "profile"], sort=False)
    for (medium, profile), runs_of_profile in groups:
        by_frequency: dict[Any, pd.DataFrame] = dict(iter(runs_of_profile.groupby("frequency_Hz")))
        for frequency, runs in by_frequency.items():
            if runs["curvature_times_R"].nunique() < FEWEST_CURVATURES or frequency == 0:
                continue
            is_calibrated = profile == "table" and bool(
                np.isclose([*calibrated], frequency, rtol=0, atol=1e-6).any()
            )
            row = {
                "medium": medium,
                "profile": profile,
                "frequency_Hz": frequency,
                "calibrated": "yes" if is_calibrated else "no",
            }
            half_width = half_width_of.get((profile, frequency), math.nan)
            rows.append(row | _optimum(runs, confidence, half_width))
    return pd.DataFrame(rows, columns=COLUMNS)


def _optimum(runs: pd.DataFrame, confidence: float, half_width: float) -> dict[str, object]:
    """Return the columns of `optima` on the best curvature of the runs of one frequency, profile and medium.

    `half_width`: of the interval of the best curvature by the errors of alpha; NaN where it is not known.
    """
    steady = runs[runs["outcome"] == "steady"].astype({"speed_cm_per_s": float})
    # speeds of the starting phases by curvature, increasing
    groups = dict(iter(steady.groupby("curvature_times_R")["speed_cm_per_s"]))
    lost = runs["curvature_times_R"].nunique() - len(groups)
    row: dict[str, object] = {"curvatures": len(groups)}
    row |= reason_columns([remark("no-steady-run", count=lost)] if lost else [])
    if not groups:
        return row
    curvature = np.array([*groups], dtype=float)
    speeds = [speeds_of_phases.to_numpy() for speeds_of_phases in groups.values()]
    mean = np.array([speeds_of_phases.mean() for speeds_of_phases in speeds])
    best, top_speed = best_curvature(curvature, mean)
    fastest = int(np.argmax(mean))
    lo, hi = optimum_interval(curvature, speeds, mean, best, confidence)
    return row | {
        "best_curvature_times_R": best,
        "best_curvature_from_alpha_lo": best - half_width,
        "best_curvature_from_alpha_hi": best + half_width,
        "reading_lo": lo,
        "reading_hi": hi,
        "speed_cm_per_s": top_speed,
        "fastest_curvature_times_R": curvature[fastest],
        "fastest_speed_cm_per_s": mean[fastest],
    }


def optimum_interval(
    curvature: FloatArray,
    speeds: list[FloatArray],
    mean: FloatArray,
    best: float,
    confidence: float,
) -> tuple[float, float]:
    """Find the range of reading of the `best` curvature (see `optima`): its lower and upper end.

    `curvature`: increasing, shape (n,). `speeds`: at each curvature, those of the starting phases, cm/s; `mean`: the
    mean of these, (n,).
    """
    fastest = int(np.argmax(mean))
    # points that the parabola is fitted to
    near = np.flatnonzero(np.abs(curvature - curvature[fastest]) <= WINDOW + 1e-9)
    if near.size < 4 or best == curvature[fastest]:
        # the neighbours of the fastest point
        below, above = curvature[max(fastest - 1, 0)], curvature[fastest : fastest + 2][-1]
        return float(min(below, best)), float(max(above, best))
    rng = np.random.default_rng(_SEED)
    # mean speed by starting phases that are drawn anew, shape (points, draws)
    draws = np.stack(
        [rng.choice(speeds[point], (DRAWS, speeds[point].size)).mean(axis=1) for point in near]
    )
    x = curvature[near] - curvature[fastest]
    design = np.vander(x, 3)
    coefficients_by_speed = np.linalg.pinv(design)
    residual = mean[near] - design @ (coefficients_by_speed @ mean[near])
    # residuals of a fit with three parameters are smaller than the errors that they stand for
    residual *= math.sqrt(near.size / (near.size - 3))
    draws += residual[:, None] * rng.choice([-1.0, 1.0], draws.shape)
    # top of each parabola square x^2 + slope x + constant; the fastest point where it opens upward
    square, slope, _ = coefficients_by_speed @ draws
    has_top, highest = square < 0, x[mean[near].argmax()]
    tops = np.where(has_top, -slope / (2 * np.where(has_top, square, 1.0)), highest)
    tops = np.clip(tops, x[0], x[-1]) + curvature[fastest]
    lo, hi = np.quantile(tops, [(1 - confidence) / 2, (1 + confidence) / 2])
    half_step = float(np.median(np.diff(curvature[near]))) / 2
    return float(min(lo, best - half_step)), float(max(hi, best + half_step))
