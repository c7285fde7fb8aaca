"""The robot on the page: its tables for the template, its curves and pictures for the script."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.errors import InputError
from rftfit.page.tables import PROFILES, percent, span, text, value
from rftfit.robot.speeds import share_within
from rftfit.store import read_csv

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import pandas as pd


DIGITS = 5


@dataclass(frozen=True)
class RobotTables:
    """What the stages of the robot made.

    `speed`, `errors`, `optimum`: As in ``results/robot``.
    `frames`: Geometry and poses of a few runs, from ``results/robot/frames.json``.
    """

    speed: pd.DataFrame
    errors: pd.DataFrame
    optimum: pd.DataFrame
    frames: dict[str, Any]


def read_robot_tables(paths: Sequence[Path]) -> RobotTables | None:
    """Read the results of the robot.

    `paths`: ``speed.csv``, ``errors.csv``, ``optimum.csv`` and ``frames.json`` in this order, or
    nothing. Returns none where there are none.
    """
    if not paths:
        return None
    *tables, frames = paths
    try:
        shown = json.loads(frames.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{frames}: cannot be read: {error}") from error
    speed, errors, optimum = (read_csv(path) for path in tables)
    return RobotTables(speed, errors, optimum, shown)


def robot_tables(robot: RobotTables | None) -> dict[str, Any] | None:
    """Make the tables of the section, of ready text.

    Returns ``shares`` (a row a profile), ``best`` (a row a profile, at the highest frequency) and
    ``rows`` (a row a measured condition).
    """
    if robot is None:
        return None
    shares, best = [], []
    for name, part in robot.errors.groupby("profile", sort=False):
        predicted = part[part["calibrated"] == "no"]
        row: dict[str, Any] = {"profile": PROFILES.get(str(name), str(name))}
        for percents in (20, 35):
            within, total = share_within(part, percents)
            others, of = share_within(predicted, percents)
            row[f"all_{percents}"] = f"{within} of {total}"
            row[f"new_{percents}"] = f"{others} of {of}"
        shares.append(row)
    for name, part in robot.optimum.groupby("profile", sort=False):
        top = part.iloc[int(np.argmax(part["frequency_Hz"].to_numpy(float)))]
        ends = float(top["best_curvature_lo"]), float(top["best_curvature_hi"])
        best.append(
            {
                "profile": PROFILES.get(str(name), str(name)),
                "frequency": value(float(top["frequency_Hz"]), 1),
                "curvature": value(float(top["best_curvature_times_R"]), 2),
                "span": span(*ends, 2),
                "speed": value(float(top["speed_cm_per_s"]), 1),
                "calibrated": text(top["calibrated"]),
            }
        )
    return {"shares": shares, "best": best, "rows": _rows(robot.errors)}


def _rows(errors: pd.DataFrame) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    keys = ["curvature_times_R", "frequency_Hz"]
    for _, part in errors.sort_values(keys, kind="stable").groupby("condition", sort=False):
        first = part.iloc[0]
        sd = float(first["measured_sd_cm_per_s"])
        rows.append(
            {
                "curvature": value(float(first["curvature_times_R"]), 2),
                "frequency": value(float(first["frequency_Hz"]), 2),
                "measured": value(float(first["measured_cm_per_s"]), 1),
                "sd": f"s.d. {value(sd, 1)}" if np.isfinite(sd) else "",
                "calibrated": text(first["calibrated"]),
                "simulated": {
                    str(row["profile"]): {
                        "speed": value(float(row["simulated_cm_per_s"]), 1),
                        "span": span(row["simulated_lo_cm_per_s"], row["simulated_hi_cm_per_s"], 1),
                        "error": percent(float(row["error_percent"])),
                        "reason": text(row["reason"]),
                    }
                    for row in part.to_dict("records")
                },
            }
        )
    return rows


def robot_data(robot: RobotTables | None) -> dict[str, Any] | None:
    """Collect the curves and pictures that the script draws.

    Returns of what JSON can write; NaN is None.
    """
    if robot is None:
        return None
    measured = robot.errors.drop_duplicates("condition")
    curvatures = sorted(set(measured["curvature_times_R"].tolist()) or {-1.0, 0.0, 1.0})
    curves: dict[str, list[dict[str, Any]]] = {}
    for name, part in robot.speed.groupby("profile", sort=False):
        curves[str(name)] = []
        for curvature in curvatures:
            own = part[np.isclose(part["curvature_times_R"], curvature)]
            mean = own.groupby("frequency_Hz")["speed_cm_per_s"].mean()
            curves[str(name)].append(
                {
                    "curvature": curvature,
                    "f": _plain(mean.index.to_numpy(float)),
                    "v": _plain(mean.to_numpy(float)),
                }
            )
    names = ("curvature_times_R", "frequency_Hz", "measured_cm_per_s", "measured_sd_cm_per_s")
    points = {name: _plain(measured[name].to_numpy(float)) for name in names}
    points["calibrated"] = [word == "yes" for word in measured["calibrated"]]
    titles = {name: PROFILES.get(name, name) for name in curves}
    return {"profiles": titles, "curves": curves, "measured": points, "frames": robot.frames}


def _plain(values: np.ndarray) -> list[float | None]:
    return [float(f"{one:.{DIGITS}g}") if np.isfinite(one) else None for one in values.tolist()]
