"""Judge by which law stress grows with depth, where the surface is not checked: a line, another power, an intercept.

Part of the check `linearity` (`rftfit.checks.surface`). `pushes` are rows of the table of fits: intrusions on paths of 45
degrees or steeper with a clear slope. Of each it has three laws of stress z over depth: the line through zero; a power,
with its `exponent_z`; a line with a free intercept, ``intercept_z_N_per_cm2``, which is 0 at the depth `offset_cm`.
``power_misfit_z_ratio`` is below 1 where the power fits better than this line. `tolerance_deg`: as in
`MediumMeasurements`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.checks.declared import Check, Sentences
from rftfit.checks.runs import SURE
from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.depths import median_over_directions
from rftfit.measure.flags import Flags
from rftfit.measure.laws import PATCHES, exponent_lever
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "law")

TOLERATED: float = _CHOSEN.tolerated
"""Largest difference of an exponent from 1 that is tolerated."""

MOST_EXPONENT: float = _CHOSEN.most_departure
"""Largest difference of an exponent from 1 that may stay undetected; if errors hide more, nothing was checked."""

BEFOREHAND_DOF: float = _CHOSEN.beforehand_dof
"""Degrees of freedom of the known errors when they are combined with the scatter of directions."""


class Estimate(NamedTuple):
    """Median of a quantity over directions, `value`, and its standard error `se`, in the unit of the quantity."""

    value: float
    se: float


LINE_POWERS = "depth^{least:.2f} to depth^{most:.2f}"
"""Powers of depth that count as a line, in sentences."""
_LAW_ALLOWED = (
    f"{LINE_POWERS}, and a begin {{start_most_mm:.1f}} mm from the surface of either sign"
)
LAW_OUTCOMES = {
    "law-line": Sentences(
        "stress of pushes grows as depth^{power:.2f}, or begins {start_mm:.1f} mm {side} the surface",
        _LAW_ALLOWED,
    ),
    "law-open": Sentences(
        "stress of pushes grows as depth^{power:.2f}; a power would be told only beyond "
        + LINE_POWERS
    ),
    "law-power": Sentences(
        "stress of pushes grows as depth^{power:.2f}",
        _LAW_ALLOWED,
        "{found}: a line through zero is up to {off:.0%} off within its window, so alpha depends on the window; results/"
        "alpha_at_depth has stress over depth at stated depths.",
    ),
    "law-crust": Sentences(
        "stress of {count} of {size} pushes has a peak near the surface, {above:.0%} (median) above the line through the deeper part",
        "less than half of the pushes",
        "{found}: a crust that breaks. A line through zero holds below it at most: fit.submergence_cm leaves out what lies above.",
    ),
    "law-intercept": Sentences(
        "stress of pushes is c + alpha depth with c = {intercept:.3g} N/cm^2 (median), as if it began {start_mm:.1f} mm {side} the "
        "surface",
        _LAW_ALLOWED,
        "{found}: cohesion or a crust, or another surface than stated (surface_z_mm). A line through zero is up to "
        "{off:.0%} off within its window.",
    ),
}
"""Sentences of the check `linearity` where the surface is not checked, by code of the outcome."""


def judge_law_alone(
    pushes: pd.DataFrame, run_cm: float, session_cm: float, tolerance_deg: float
) -> Check:
    """Judge whether stress of pushes is proportional to depth, where the surface cannot be checked.

    Each direction counts once, with the mean of its repeats. The law that fits most pushes better decides what is
    judged: the exponent, or where the line with a free intercept begins.

    `run_cm`, `session_cm`: Standard deviations of the free surface, from run to run and common to all runs.
    """
    pushes = pushes.dropna(subset=["exponent_z"])
    if pushes.empty:
        return Check.skip("linearity", "linearity-few")
    power = exponent_of(pushes, session_cm, tolerance_deg)
    start_error_cm = np.hypot(np.nan_to_num(pushes["offset_se_cm"].to_numpy(float)), run_cm)
    start = combine_directions(pushes, "offset_cm", start_error_cm, session_cm, tolerance_deg)
    intercept = median_over_directions(pushes, "intercept_z_N_per_cm2", tolerance_deg)
    is_power = float(np.nanmedian(pushes["power_misfit_z_ratio"])) < 1
    most_departure = TOLERATED + SURE * power.se
    most_start_cm = _CHOSEN.tolerated_start_cm + SURE * start.se
    values: dict[str, Any] = {
        "power": power.value,
        "least": 1 - most_departure,
        "most": 1 + most_departure,
        "off": largest_departure(pushes),
        "start_mm": 10 * abs(start.value),
        "side": "above" if start.value < 0 else "below",
        "start_most_mm": 10 * most_start_cm,
        "intercept": intercept,
    }
    if is_power and abs(power.value - 1) > most_departure:
        return Check.judge("linearity", False, code="law-power", **values)
    if not is_power and abs(start.value) > most_start_cm:
        return Check.judge("linearity", False, code="law-intercept", **values)
    if most_departure > MOST_EXPONENT:
        return Check.skip("linearity", "law-open", **values)
    return Check.judge("linearity", True, code="law-line", **values)


def judge_crust(flags: Flags, pushes: pd.DataFrame) -> Check | None:
    """Fail the medium if half of the pushes or more break a crust; else return None.

    `flags`: Of the logs, with ``crust`` on a push whose stress has a peak near the surface.
    """
    broken = flags.runs_with("crust")
    run_ids = set(pushes["run_id"])
    # peak above the line through the deeper part, relative to it, of each push that breaks a crust
    excess = [flag.values["percent"] / 100 for run_id, flag in broken.items() if run_id in run_ids]
    if not excess or 2 * len(excess) < len(pushes):
        return None
    return Check.judge(
        "linearity",
        False,
        code="law-crust",
        above=float(np.median(excess)),
        count=len(excess),
        size=len(pushes),
    )


def exponent_of(pushes: pd.DataFrame, session_cm: float, tolerance_deg: float) -> Estimate:
    """Estimate the exponent of depth that all directions share.

    `session_cm`: Error of the surface that all runs of the session share.
    """
    pushes = pushes.dropna(subset=["exponent_z"])
    ends = zip(pushes["depth_from_cm"], pushes["depth_to_cm"], strict=True)
    # change of the exponent per cm by which the surface is wrong; rounded windows are found in the cache
    levers = np.array(
        [exponent_lever(round(float(top), 2), round(float(end), 2)) for top, end in ends]
    )
    levers *= pushes["exponent_z"].to_numpy(float)
    # the error of the session is common to all runs, so it is added after averaging; the scatter is never below that
    # of an uneven bed
    run_variance = pushes["exponent_z_se"].to_numpy(float) ** 2 - (levers * session_cm) ** 2
    scatter = np.sqrt(np.fmax(run_variance, PATCHES**2))
    session_error = float(levers.mean()) * session_cm
    return combine_directions(pushes, "exponent_z", scatter, session_error, tolerance_deg)


def combine_directions(
    pushes: pd.DataFrame, column: str, scatter: FloatArray, session: float, tolerance_deg: float
) -> Estimate:
    """Estimate the median of a quantity over directions; its error combines known errors and the scatter of directions.

    The known errors alone would be too small where a bed is more uneven than usual, the scatter of a few directions
    alone is too uncertain. `column`: Column of `pushes` with the quantity. `scatter`: Known standard deviation of each
    run, shape (n,). `session`: Standard deviation that all runs share.
    """
    runs = pd.DataFrame({"quantity": pushes[column].to_numpy(float), "variance": scatter**2})
    directions = runs.groupby(number_rows(pushes, tolerance_deg))
    means = directions["quantity"].mean().to_numpy(float)
    weights = 1 / (directions["variance"].mean() / directions.size()).to_numpy(float)
    middle = median_over_directions(pushes, column, tolerance_deg)
    chi_square = float(weights @ (means - middle) ** 2)
    # of the variance: 1 by the known errors, chi square per degree of freedom by the scatter
    factor = (BEFOREHAND_DOF + chi_square) / (BEFOREHAND_DOF + means.size - 1)
    # the median of three numbers or more has a larger error than their mean
    factor *= math.pi / 2 if means.size > 2 else 1.0
    return Estimate(middle, math.sqrt(factor / float(weights.sum()) + session**2))


def largest_departure(pushes: pd.DataFrame) -> float:
    """Largest relative difference of the better law from the line through zero in a window, median over pushes.

    This is how far off a line is somewhere in its window. Depths shallower than a tenth of the end of the window do not
    count, as stress there is mostly noise.
    """
    departures = []
    for row in pushes.to_dict("records"):
        depth = np.linspace(max(row["depth_from_cm"], 0.1 * row["depth_to_cm"]), row["depth_to_cm"])
        if row["power_misfit_z_ratio"] < 1:
            stress = depth ** row["exponent_z"]
        else:
            stress = row["intercept_z_N_per_cm2"] + row["free_slope_z_N_per_cm3"] * depth
        # least squares through zero
        line = float(stress @ depth / (depth @ depth)) * depth
        departures.append(float(np.abs(stress / line - 1).max()))
    return float(np.median(departures))
