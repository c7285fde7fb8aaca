"""How far the speed and the best curvature move with what the paper does not say of the robot.

``python -m rftfit.robot.sensitivity`` prints it for the paper's robot on loosely packed poppy seeds.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from rftfit.robot.perturbations import changed
from rftfit.robot.run import Condition
from rftfit.robot.sweep import best_curvature, run_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot

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

BEST_AT_HZ = 5.0
CURVATURES = tuple(round(0.04 * index, 2) for index in range(15, 26))
"""Among which the best is looked for: 0.6 to 1 by 0.04."""


def optimum(robot: Robot, profile: Profile, threads: int | None = None) -> tuple[float, float]:
    """Best curvature at 5 Hz, and its speed."""
    runs = run_all(robot, profile, [Condition(BEST_AT_HZ, value) for value in CURVATURES], threads)
    return best_curvature(np.array(CURVATURES), np.array([run.speed_cm_per_s for run in runs]))


def sensitivity(
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition] = NAMED,
    changes_cm: dict[str, tuple[float, ...]] | None = None,
    threads: int | None = None,
) -> pd.DataFrame:
    """Change one unknown at a time and see how far speeds and optimum move.

    `changes_cm`: Of `rftfit.robot.perturbations.UNKNOWNS`; `CHANGES_CM` by default. Returns
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
            *reasons, "", "",
        ]  # fmt: skip

    reference, _ = values(robot)
    rows = []
    for unknown, changes in changes_cm.items():
        for change in changes:
            try:
                found, reasons = values(changed(robot, {unknown: change}))
            except ValueError as error:
                found, reasons = [math.nan] * len(names), [str(error)] * len(names)
            for (name, unit), value, before, why in zip(
                names, found, reference, reasons, strict=True
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
    sys.stdout.write(wide.round(2).to_string() + "\n")
    for name, value in table.drop_duplicates("quantity")[["quantity", "reference"]].to_numpy():
        sys.stdout.write(f"{name}: {value:.3g} without a change\n")
    for row in table[table["reason"] != ""].drop_duplicates(["unknown", "change_cm"]).itertuples():
        sys.stdout.write(f"{row.unknown} {row.change_cm}: {row.reason}\n")


if __name__ == "__main__":
    main()
