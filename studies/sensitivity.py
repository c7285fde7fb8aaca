"""How far the speed and the best curvature move with what the paper does not say of the robot.

``python studies/sensitivity.py`` prints it for the paper's robot on loosely packed poppy seeds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rftfit.robot.config import Robot
from rftfit.robot.run import Condition
from rftfit.robot.sweep import BEST_AT_HZ, optimum, run_all

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pandas as pd

    from rftfit.model.profiles import Profile

CHANGES_CM: dict[str, tuple[float, ...]] = {
    "hips_apart_cm": (-1.0, -0.5, 0.5, 1.0),
    "hips_ahead_cm": (-0.5, 0.5),
    "hips_up_cm": (-0.5, -0.25, 0.25, 0.5),
    "belly_up_cm": (-0.5, -0.25, 0.25, 0.5),
    "centre_of_mass_up_cm": (-0.5, 0.5),
    "plates_wider_cm": (-1.0, 1.0),
    "plates_taller_cm": (-1.0, 1.0),
}

NAMED = (Condition(2.0, 1.0), Condition(2.0, 0.0), Condition(2.0, -1.0))
"""c-leg, flat and reversed c-leg at 2 Hz."""


def _hips_apart(data: dict[str, Any], change: float) -> None:
    hips = data["legs"]["hips"]
    middle = sum(hip["x_cm"] for hip in hips) / len(hips)
    reach = max(abs(hip["x_cm"] - middle) for hip in hips)
    for hip in hips:
        hip["x_cm"] = middle + (hip["x_cm"] - middle) * ((reach + change) / reach if reach else 1)


def _hips_ahead(data: dict[str, Any], change: float) -> None:
    for hip in data["legs"]["hips"]:
        hip["x_cm"] += change


def _hips_up(data: dict[str, Any], change: float) -> None:
    for hip in data["legs"]["hips"]:
        hip["z_cm"] += change


def _ends_up(data: dict[str, Any], change: float, which: Callable[[list[float]], float]) -> None:
    ends = [
        (plate, end) for plate in data["body"]["plates"].values() for end in ("from_cm", "to_cm")
    ]
    level = which([plate[end][1] for plate, end in ends])
    for plate, end in ends:
        x, z = plate[end]
        if abs(z - level) < 1e-9:
            plate[end] = (x, z + change)


def _belly_up(data: dict[str, Any], change: float) -> None:
    _ends_up(data, change, min)


def _plates_taller(data: dict[str, Any], change: float) -> None:
    _ends_up(data, change, max)


def _centre_of_mass_up(data: dict[str, Any], change: float) -> None:
    _hips_up(data, -change)
    for plate in data["body"]["plates"].values():
        for end in ("from_cm", "to_cm"):
            plate[end] = (plate[end][0], plate[end][1] - change)


def _plates_wider(data: dict[str, Any], change: float) -> None:
    for plate in data["body"]["plates"].values():
        plate["width_cm"] += change


PERTURBATIONS: dict[str, Callable[[dict[str, Any], float], None]] = {
    "hips_apart_cm": _hips_apart,
    "hips_ahead_cm": _hips_ahead,
    "hips_up_cm": _hips_up,
    "belly_up_cm": _belly_up,
    "centre_of_mass_up_cm": _centre_of_mass_up,
    "plates_wider_cm": _plates_wider,
    "plates_taller_cm": _plates_taller,
}
"""What can be moved: the outermost hips away from the middle one; all hips forward; all hips up;
the belly (lowest ends of all plates) up against hips and centre of mass; the centre of mass up against
both; all plates wider; the highest ends of all plates up."""


def changed(robot: Robot, changes: dict[str, float]) -> Robot:
    """Return the robot with some of `PERTURBATIONS`, in cm."""
    data = robot.model_dump()
    for name, change in changes.items():
        PERTURBATIONS[name](data, change)
    try:
        return Robot.model_validate(data)
    except ValidationError as error:
        texts = [str(detail["msg"]) for detail in error.errors(include_url=False)]
        raise ValueError("; ".join(texts).replace("Value error, ", "")) from error


def sensitivity(
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition] = NAMED,
    changes_cm: dict[str, tuple[float, ...]] | None = None,
    threads: int | None = None,
) -> pd.DataFrame:
    """Change one unknown at a time and see how far speeds and optimum move.

    `changes_cm`: of `PERTURBATIONS`; `CHANGES_CM` by default. Returns columns
    `unknown, change_cm, quantity, unit, value, reference, shift, reason`: quantity one of ``speed,
    R'/r 1, 2 Hz`` and the like, ``best R'/r at 5 Hz``, ``best speed at 5 Hz``. A change that is
    not possible has NaN and the reason.
    """
    import pandas as pd

    changes_cm = CHANGES_CM if changes_cm is None else changes_cm
    names = [
        (f"speed, R'/r {c.curvature_times_R:g}, {c.frequency_Hz:g} Hz", "cm/s") for c in conditions
    ]
    names += [(f"best R'/r at {BEST_AT_HZ:g} Hz", ""), (f"best speed at {BEST_AT_HZ:g} Hz", "cm/s")]

    def values(of: Robot) -> tuple[list[float], list[str]]:
        runs = run_all(of, profile, conditions, threads)
        reasons = ["" if run.outcome == "steady" else run.reason for run in runs]
        return [*(run.speed_cm_per_s for run in runs), *optimum(of, profile, threads)], [
            *reasons,
            "",
            "",
        ]

    reference, _ = values(robot)
    rows = []
    for unknown, changes in changes_cm.items():
        for change in changes:
            try:
                changed_values, reasons = values(changed(robot, {unknown: change}))
            except ValueError as error:
                changed_values, reasons = [math.nan] * len(names), [str(error)] * len(names)
            for (name, unit), value, before, why in zip(
                names, changed_values, reference, reasons, strict=True
            ):
                rows.append((unknown, change, name, unit, value, before, value - before, why))
    head = ["unknown", "change_cm", "quantity", "unit", "value", "reference", "shift", "reason"]
    return pd.DataFrame(rows, columns=head)


def main() -> None:
    """Print the shifts of speeds (cm/s) and of the best curvature."""
    from rftfit.model.profiles import TableProfile
    from rftfit.robot.config import paper_robot

    table = sensitivity(paper_robot(), TableProfile.published("poppy_LP"))
    wide = table.pivot_table(
        index=["unknown", "change_cm"], columns="quantity", values="shift", sort=False
    )
    print(wide.round(2).to_string())
    for name, value in table.drop_duplicates("quantity")[["quantity", "reference"]].to_numpy():
        print(f"{name}: {value:.3g} without a change")
    for row in table[table["reason"] != ""].drop_duplicates(["unknown", "change_cm"]).itertuples():
        print(f"{row.unknown} {row.change_cm}: {row.reason}")


if __name__ == "__main__":
    main()
