"""Find the hips and the belly that the paper does not give, from five of its figures and no more.

``python studies/calibrate.py`` prints the best layouts, the first of which stands in
``config/robot.yaml``. The targets: the best curvature and its speed at 5 Hz, as the paper's text
says them, and the measured speeds of three named conditions of Fig. 4C. Every other measured speed
is left for judging. The search is a fixed grid, so that it always finds the same.
"""

from __future__ import annotations

import sys
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import frame
import numpy as np
import pandas as pd
from frame import Part, Row, Tables

from rftfit import published_medium, published_table
from rftfit.robot.config import Robot, paper_robot
from rftfit.robot.run import Condition
from rftfit.robot.sweep import BEST_AT_HZ, BEST_CURVATURES, CALIBRATED_ON, best_curvature, run_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.model.profiles import Profile

BEST_CURVATURE, BEST_SPEED_CM_PER_S = 0.86, 72.0
"""Text of the paper, at 5 Hz."""

SPEED_TOLERANCE, CURVATURE_TOLERANCE = 0.1, 0.04
"""What counts as one unit of misfit: a tenth of a speed, one step of the paper's sweep."""


class Layout(NamedTuple):
    """The three lengths that are searched for.

    `hip_spacing_cm`: From the middle hips to those in front and behind.
    `hip_height_cm`: Of all hips above the belly.
    `belly_z_cm`: Of the belly above the centre of mass: negative.
    """

    hip_spacing_cm: float
    hip_height_cm: float
    belly_z_cm: float


GRID: dict[str, tuple[float, ...]] = {
    "hip_spacing_cm": (4.0, 4.5, 5.0, 5.5, 6.0, 6.5),
    "hip_height_cm": (0.0, 0.25, 0.5, 0.75, 1.0),
    "belly_z_cm": (-2.0, -1.5, -1.0, -0.5),
}


def laid_out(robot: Robot, layout: Layout) -> Robot:
    """Give a robot of the paper's build (belly, front, rear; three hips a side) a layout.

    Front and rear plates keep their height.
    """
    data = robot.model_dump()
    plates, hips = data["body"]["plates"], data["legs"]["hips"]
    up = layout.belly_z_cm - plates["belly"]["from_cm"][1]
    for plate in plates.values():
        for end in ("from_cm", "to_cm"):
            plate[end] = (plate[end][0], plate[end][1] + up)
    for hip in hips:
        hip["x_cm"] = layout.hip_spacing_cm * float(np.sign(hip["x_cm"]))
        hip["z_cm"] = layout.belly_z_cm + layout.hip_height_cm
    return Robot.model_validate(data)


def measured(fig_4c: pd.DataFrame) -> tuple[float, ...]:
    """Speeds (cm/s) of Fig. 4C in the conditions of `CALIBRATED_ON`."""
    by_place = fig_4c.set_index(["curvature_times_Rprime", "stride_frequency_Hz"])
    speeds = by_place["speed_cm_per_s"]
    return tuple(float(speeds.loc[place]) for place in CALIBRATED_ON.values())


def grade_robot(robot: Robot, profile: Profile, speeds: Sequence[float]) -> dict[str, float]:
    """Run the targets with a robot, and compare with `speeds`, which were measured.

    `misfit`: root mean square of the five misfits; infinite where a run is not steady.
    """
    conditions = [
        Condition(frequency, curvature) for curvature, frequency in CALIBRATED_ON.values()
    ]
    conditions += [Condition(BEST_AT_HZ, curvature) for curvature in BEST_CURVATURES]
    runs = run_all(robot, profile, conditions)
    simulated = np.array([run.speed_cm_per_s for run in runs])
    at_targets, by_curvature = np.split(simulated, [len(CALIBRATED_ON)])
    best, fastest = best_curvature(np.array(BEST_CURVATURES), by_curvature)
    misses = [(best - BEST_CURVATURE) / CURVATURE_TOLERANCE]
    misses += [(fastest / BEST_SPEED_CM_PER_S - 1) / SPEED_TOLERANCE]
    misses += ((at_targets / np.array(speeds) - 1) / SPEED_TOLERANCE).tolist()
    misfit = float(np.sqrt(np.mean(np.square(misses))))
    row = {"misfit": misfit if np.isfinite(misfit) else np.inf}
    row |= {"best_curvature": best, "best_speed_cm_per_s": fastest}
    return row | dict(zip(CALIBRATED_ON, at_targets.tolist(), strict=True))


def layout_of(robot: Robot) -> Layout:
    """Read the three lengths from a robot of the paper's build."""
    belly = robot.body.plates["belly"].from_cm[1]
    hips = robot.legs.hips
    return Layout(max(hip.x_cm for hip in hips), round(hips[0].z_cm - belly, 9), belly)


def grade_layout(*lengths: float) -> list[Row]:
    """How near one layout comes to the targets on loosely packed poppy seeds."""
    layout = Layout(*lengths)
    robot = laid_out(paper_robot(), layout)
    speeds = measured(published_table("fig_4c"))
    return [layout._asdict() | grade_robot(robot, published_medium("poppy_LP"), speeds)]


def report(rows: pd.DataFrame) -> Tables:
    """The best five layouts."""
    speeds = ", ".join(f"{speed:g}" for speed in measured(published_table("fig_4c")))
    title = f"Best; targets: {BEST_CURVATURE:g}, {BEST_SPEED_CM_PER_S:g}, {speeds} cm/s"
    return [(title, rows.nsmallest(5, "misfit").drop(columns="unit"))]


PARTS = {"layouts": Part([*product(*GRID.values())], grade_layout, report)}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
