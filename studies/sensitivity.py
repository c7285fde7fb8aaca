"""How far the speed and the best curvature move with what the paper does not say of the robot: one change at a time.

python studies/sensitivity.py    the paper's robot on loosely packed poppy seeds
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import frame
import pandas as pd
from frame import Part, Row, Tables
from pydantic import ValidationError

from rftfit.model.profiles import TableProfile
from rftfit.robot.config import Robot, paper_robot
from rftfit.robot.run import Condition
from rftfit.robot.sweep import BEST_AT_HZ, optimum, run_all

NAMED = (Condition(2.0, 1.0), Condition(2.0, 0.0), Condition(2.0, -1.0))
"""c-leg, flat and reversed c-leg at 2 Hz."""
Data = dict[str, Any]


def move_hips_apart(data: Data, change: float) -> None:
    """Move the outermost hips away from the middle one."""
    hips = data["legs"]["hips"]
    middle = sum(hip["x_cm"] for hip in hips) / len(hips)
    reach = max(abs(hip["x_cm"] - middle) for hip in hips)
    for hip in hips:
        hip["x_cm"] = middle + (hip["x_cm"] - middle) * (reach + change) / reach


def move_hips(data: Data, change: float, axis: str) -> None:
    """Move all hips along an axis."""
    for hip in data["legs"]["hips"]:
        hip[axis] += change


def move_ends(data: Data, change: float, which: Callable[..., float]) -> None:
    """Move the lowest or the highest ends of all plates up."""
    plates = data["body"]["plates"].values()
    level = which(plate[end][1] for plate in plates for end in ("from_cm", "to_cm"))
    for plate in plates:
        for end in ("from_cm", "to_cm"):
            x, z = plate[end]
            plate[end] = (x, z + change * (abs(z - level) < 1e-9))


def move_centre_of_mass(data: Data, change: float) -> None:
    """Move the centre of mass up against hips and plates."""
    move_hips(data, -change, "z_cm")
    for plate in data["body"]["plates"].values():
        for end in ("from_cm", "to_cm"):
            plate[end] = (plate[end][0], plate[end][1] - change)


def widen_plates(data: Data, change: float) -> None:
    """Make all plates wider."""
    for plate in data["body"]["plates"].values():
        plate["width_cm"] += change


CHANGES_CM: dict[str, tuple[Callable[[Data, float], None], tuple[float, ...]]] = {
    "hips_apart_cm": (move_hips_apart, (-1.0, -0.5, 0.5, 1.0)),
    "hips_ahead_cm": (partial(move_hips, axis="x_cm"), (-0.5, 0.5)),
    "hips_up_cm": (partial(move_hips, axis="z_cm"), (-0.5, -0.25, 0.25, 0.5)),
    "belly_up_cm": (partial(move_ends, which=min), (-0.5, -0.25, 0.25, 0.5)),
    "centre_of_mass_up_cm": (move_centre_of_mass, (-0.5, 0.5)),
    "plates_wider_cm": (widen_plates, (-1.0, 1.0)),
    "plates_taller_cm": (partial(move_ends, which=max), (-1.0, 1.0)),
}


def numbers_of(robot: Robot) -> dict[str, float]:
    """Speeds in the named conditions and the best curvature with its speed, cm/s."""
    profile = TableProfile.published("poppy_LP")
    runs = run_all(robot, profile, NAMED)
    numbers = {
        f"speed, R'/r {place.curvature_times_R:g}, {place.frequency_Hz:g} Hz": run.speed_cm_per_s
        for place, run in zip(NAMED, runs, strict=True)
    }
    best, fastest = optimum(robot, profile)
    at = f"at {BEST_AT_HZ:g} Hz"
    return numbers | {f"best R'/r {at}": best, f"best speed {at}": fastest}


@cache
def unchanged() -> dict[str, float]:
    """Numbers of the paper's robot."""
    return numbers_of(paper_robot())


def grade_change(unknown: str, change_cm: float) -> list[Row]:
    """Shift of every number by one change, or why it is not possible."""
    data = paper_robot().model_dump()
    CHANGES_CM[unknown][0](data, change_cm)
    change: Row = {"unknown": unknown, "change_cm": change_cm}
    try:
        robot = Robot.model_validate(data)
    except ValidationError as error:
        return [change | {"quantity": "", "reason": str(error.errors()[0]["msg"])}]
    return [
        change
        | {"quantity": name, "value": value, "shift": value - unchanged()[name], "reason": ""}
        for name, value in numbers_of(robot).items()
    ]


def report(rows: pd.DataFrame) -> Tables:
    """Shifts by change and quantity, the numbers without a change, and what is not possible."""
    places = ["unknown", "change_cm"]
    shifts = rows.pivot_table("shift", places, "quantity", sort=False).reset_index()
    refused = rows.loc[rows["reason"].fillna("") != "", [*places, "reason"]]
    return [
        ("Shift", shifts),
        ("Without a change", pd.DataFrame([unchanged()])),
        ("Not possible", refused),
    ]


UNITS = [(name, change) for name, (_, changes) in CHANGES_CM.items() for change in changes]
PARTS = {"sensitivity": Part(UNITS, grade_change, report)}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
