"""Find the hips and the belly that the paper does not give, from five of its figures and no more.

``python studies/calibrate.py`` prints the search and the values that stand in
``config/robot.yaml``. The targets: the best curvature and its speed at 5 Hz, as the paper's text
says them, and the measured speeds of three named conditions of Fig. 4C. Every other measured speed
is left for judging. The search is a fixed grid, so that it always finds the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from rftfit.robot.config import Robot, paper_robot
from rftfit.robot.run import Condition
from rftfit.robot.sweep import BEST_AT_HZ, BEST_CURVATURES, CALIBRATED_ON, best_curvature, run_all

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pandas as pd

    from rftfit.model.profiles import Profile

BEST_CURVATURE, BEST_SPEED_CM_PER_S = 0.86, 72.0
"""Text of the paper, at 5 Hz."""

SPEED_TOLERANCE, CURVATURE_TOLERANCE = 0.1, 0.04
"""What counts as one unit of misfit: a tenth of a speed, one step of the paper's sweep."""


@dataclass(frozen=True)
class Layout:
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


@dataclass(frozen=True)
class Fit:
    """How near one layout comes.

    `misfit`: Root mean square of the five misfits; infinite where a run is not steady.
    `best_curvature`, `best_speed_cm_per_s`: At 5 Hz.
    `speeds_cm_per_s`: In the order of `CALIBRATED_ON`.
    """

    layout: Layout
    misfit: float
    best_curvature: float
    best_speed_cm_per_s: float
    speeds_cm_per_s: tuple[float, ...]


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


def fit(
    robot: Robot,
    profile: Profile,
    layout: Layout,
    speeds: Sequence[float],
    threads: int | None = None,
) -> Fit:
    """Run the targets with one layout, and compare with `speeds`, which were measured."""
    conditions = [
        Condition(frequency, curvature) for curvature, frequency in CALIBRATED_ON.values()
    ]
    conditions += [Condition(BEST_AT_HZ, curvature) for curvature in BEST_CURVATURES]
    runs = run_all(laid_out(robot, layout), profile, conditions, threads)
    simulated_speeds = np.array([run.speed_cm_per_s for run in runs])
    speeds_at_targets = simulated_speeds[: len(CALIBRATED_ON)]
    best, fastest = best_curvature(
        np.array(BEST_CURVATURES), simulated_speeds[len(CALIBRATED_ON) :]
    )
    misses = [(best - BEST_CURVATURE) / CURVATURE_TOLERANCE]
    misses += [(fastest / BEST_SPEED_CM_PER_S - 1) / SPEED_TOLERANCE]
    misses += ((speeds_at_targets / np.array(speeds) - 1) / SPEED_TOLERANCE).tolist()
    misfit = math.sqrt(sum(miss**2 for miss in misses) / len(misses))
    return Fit(
        layout,
        misfit if math.isfinite(misfit) else math.inf,
        best,
        fastest,
        tuple(speeds_at_targets.tolist()),
    )


def search(
    robot: Robot, profile: Profile, speeds: Sequence[float], threads: int | None = None
) -> Iterator[Fit]:
    """Try every layout of the grid."""
    for values in product(*GRID.values()):
        yield fit(robot, profile, Layout(*values), speeds, threads)


def layout_of(robot: Robot) -> Layout:
    """Read the three lengths from a robot of the paper's build."""
    belly = robot.body.plates["belly"].from_cm[1]
    hips = robot.legs.hips
    return Layout(max(hip.x_cm for hip in hips), round(hips[0].z_cm - belly, 9), belly)


def main() -> None:
    """Print every fit, the best one last."""
    from rftfit.model.profiles import TableProfile
    from rftfit.reference import load

    def say(candidate: Fit) -> None:
        lengths = "  ".join(
            f"{getattr(candidate.layout, field.name):6.2f}" for field in fields(Layout)
        )
        speeds = "  ".join(f"{speed:6.2f}" for speed in candidate.speeds_cm_per_s)
        print(
            f"{lengths}  {candidate.misfit:7.3f}  {candidate.best_curvature:5.3f}  "
            f"{candidate.best_speed_cm_per_s:6.2f}  {speeds}",
            flush=True,
        )

    speeds = measured(load("fig_4c"))
    print(
        f"targets: best R'/r {BEST_CURVATURE:g} and {BEST_SPEED_CM_PER_S:g} cm/s at "
        f"{BEST_AT_HZ:g} Hz; {', '.join(f'{n} {s:g} cm/s' for n, s in zip(CALIBRATED_ON, speeds, strict=True))}\n"
        f"{', '.join(GRID)}, misfit, best R'/r, best speed, speeds (cm/s)"
    )
    fits = []
    for candidate in search(paper_robot(), TableProfile.published("poppy_LP"), speeds):
        say(candidate)
        fits.append(candidate)
    print("best:")
    for candidate in sorted(fits, key=lambda candidate: candidate.misfit)[:5]:
        say(candidate)


if __name__ == "__main__":
    main()
