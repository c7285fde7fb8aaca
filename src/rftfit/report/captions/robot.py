"""What captions say about the robot: how near its speed comes, its best curvature, its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures.robot import leg_name
from rftfit.page.tables import profile_name, span, value
from rftfit.report.captions.words import quantile, rst
from rftfit.robot.speeds import share_within

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.page.page import PageInputs
    from rftfit.report.captions.words import Row


def speeds(inputs: PageInputs) -> Row:
    """Sum up the simulated speeds, profile by profile, beside the measured ones.

    Returns ``title`` (of the medium)``, conditions, calibrated, runs, not_steady, warned``
    (numbers) and ``profiles``: a list of ``profile, of, within_20, within_35, new, new_20,
    new_35`` (numbers; new: not calibrated on)``, half, half_most`` (half width of the intervals of
    the simulated speed: median and largest, cm/s). Empty numbers where the campaign has no robot.
    """
    robot = inputs.robot
    counts = dict.fromkeys(("conditions", "calibrated", "runs", "not_steady", "warned"), 0)
    if robot is None:
        return {"title": "", **counts, "profiles": []}
    errors, runs = robot.errors, robot.speed
    rows = []
    for name, part in errors.groupby("profile", sort=False):
        predicted = part[part["calibrated"] == "no"]
        half = (part["simulated_hi_cm_per_s"] - part["simulated_lo_cm_per_s"]).to_numpy(float) / 2
        (near, of), (far, _) = (share_within(part, percent) for percent in (20, 35))
        (new_near, new), (new_far, _) = (share_within(predicted, percent) for percent in (20, 35))
        rows.append(
            {
                "profile": rst(profile_name(str(name))), "of": of, "within_20": near,
                "within_35": far, "new": new, "new_20": new_near, "new_35": new_far,
                "half": quantile(half, 0.5, 2), "half_most": quantile(half, 1, 2),
            }
        )  # fmt: skip
    once = errors.drop_duplicates("condition")
    medium = str(runs["medium"].iloc[0]) if len(runs) else ""
    counts |= {
        "conditions": len(once),
        "calibrated": int((once["calibrated"] == "yes").sum()),
        "runs": len(runs),
        "not_steady": int((runs["outcome"] != "steady").sum()),
        "warned": _told(runs, "warning"),
    }
    return {"title": rst(inputs.titles.get(medium, medium)), **counts, "profiles": rows}


def best_legs(inputs: PageInputs) -> list[Row]:
    """Name the fastest curvature at the highest frequency, profile by profile.

    Returns ``profile, frequency`` (Hz)``, curvature`` (R'/r)``, span`` (its interval)``, reading``
    (as far as it can be read)``, speed`` (cm/s)``, calibrated`` ("yes" or "no").
    """
    if inputs.robot is None:
        return []
    rows = []
    for name, part in inputs.robot.optimum.groupby("profile", sort=False):
        top = part.iloc[int(np.argmax(part["frequency_Hz"].to_numpy(float)))]
        rows.append(
            {
                "profile": rst(profile_name(str(name))),
                "frequency": value(top["frequency_Hz"], 1),
                "curvature": value(top["best_curvature_times_R"], 2),
                "span": span(top["best_curvature_lo"], top["best_curvature_hi"], 3),
                "reading": span(top["reading_lo"], top["reading_hi"], 2),
                "speed": value(top["speed_cm_per_s"], 1),
                "calibrated": str(top["calibrated"]),
            }
        )
    return rows


def strides(motion: pd.DataFrame, profile: str = "") -> list[Row]:
    """Sum up the last strides of the model legs.

    `motion`: ``results/robot/motion.csv``; may be empty. `profile`: Only this one. Returns
    ``profile, leg, frequency`` (Hz)``, speed`` (mean, cm/s)``, rise`` (of the centre of mass, from
    lowest to highest, cm)``, pitch`` (range, degrees)``, lift`` (largest of the first tripod, N).
    """
    rows = []
    for _, part in motion.groupby(["profile", "curvature_times_R"], sort=False):
        name, curvature = part["profile"].iloc[0], float(part["curvature_times_R"].iloc[0])
        if profile and name != profile:
            continue
        time, x = (part[key].to_numpy(float) for key in ("time_s", "x_cm"))
        rows.append(
            {
                "profile": rst(profile_name(str(name))),
                "leg": rst(leg_name(curvature)),
                "frequency": value(part["frequency_Hz"].iloc[0], 1),
                "speed": value((x[-1] - x[0]) / (time[-1] - time[0]), 1),
                "rise": value(np.ptp(part["z_cm"].to_numpy(float)), 2),
                "pitch": value(np.ptp(part["pitch_deg"].to_numpy(float)), 1),
                "lift": value(part["force_z_tripod_1_N"].max(), 2),
            }
        )
    return rows


def _told(runs: pd.DataFrame, column: str) -> int:
    if column not in runs:
        return 0
    return int(runs[column].fillna("").astype(str).str.strip().astype(bool).sum())
