"""Many runs at once: the paper's sweep of curvature, stride frequency and starting phase."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.forces.planning import Target
from rftfit.measure.flags import REASON, Remark, attach_run, reason_cells, reason_of
from rftfit.model.profiles import Profile, TableProfile
from rftfit.model.shapes import Map
from rftfit.robot.config import Robot
from rftfit.robot.run import Condition, RobotRun, simulate
from rftfit.store.environment import usable_cores

PHASES_TURNS = (0.0, 1 / 6, 1 / 3)
"""The three starting phases: alternating tripods repeat every half turn, of which these are thirds."""

CALIBRATED_ON = {"c-leg": (1.0, 1.954), "flat leg": (0.0, 1.998), "reversed c-leg": (-1.0, 2.246)}
"""R'/r and stride frequency (Hz) of the points of Fig. 4C that the paper's robot was calibrated on."""

MOTION = ((1.0, 2.0), (-1.0, 2.2))
"""R'/r and stride frequency (Hz) of the runs whose motion is shown over time: those of Fig. 4B."""

MOTION_NEAR_HZ = 0.1
"""A measured trial that is no farther from one of them is of that run."""


def is_of_motion(curvature: float, frequency_Hz: float) -> bool:
    """Whether this is one of the runs whose motion is shown over time."""
    return any(
        abs(curvature - product) < 1e-6 and abs(frequency_Hz - frequency) < MOTION_NEAR_HZ
        for product, frequency in MOTION
    )


BEST_AT_HZ = 5.0
BEST_CURVATURES = tuple(round(0.04 * index, 2) for index in range(15, 26))
"""Where the best curvature R'/r is looked for: 0.6 to 1 by 0.04, at 5 Hz."""

RUN_COLUMNS = (
    "curvature_times_R",
    "frequency_Hz",
    "phase_turns",
    "speed_cm_per_s",
    "speed_sd_cm_per_s",
    "outcome",
    *REASON,
    "warning",
    "strides",
    "averaged",
)


def paper_conditions(every: int = 1) -> list[Condition]:
    """Conditions of the paper's sweep: R'/r from -1 to 1 by 0.04, 0 to 5 Hz by 0.2, three phases.

    3,978 of them, in this order. `every`: Only every so many of the curvatures and frequencies,
    counted from the flat leg and from 5 Hz, and the ends of the curvatures always.
    """
    # both have their 25th step in common: the flat leg, and 5 Hz
    curvatures = sorted({0, 50, *range(25 % every, 51, every)})
    places = product(curvatures, range(25 % every, 26, every), PHASES_TURNS)
    return [
        Condition(round(0.2 * frequency, 1), round(0.04 * (index - 25), 2), phase)
        for index, frequency, phase in places
    ]


EVERY = 4
"""The reduced sweep takes every fourth curvature and frequency."""

_FINE_FROM = 0.4


def conditions_of(measured: pd.DataFrame, *, full: bool) -> list[Condition]:
    """Conditions of a sweep: its grid, and every measured condition.

    The reduced sweep has one starting phase of three (on the published table the others change no
    measured speed by 1 %), every fourth curvature and frequency, and at 5 Hz every curvature above 0.4,
    where the paper's best one lies.
    """
    grid = paper_conditions()
    phases = PHASES_TURNS if full else PHASES_TURNS[:1]
    if not full:
        fine = [
            c for c in grid if c.frequency_Hz == BEST_AT_HZ and c.curvature_times_R > _FINE_FROM
        ]
        grid = [c for c in [*paper_conditions(EVERY), *fine] if c.phase_turns in phases]
    with_frequency = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    places = zip(with_frequency["frequency_Hz"], with_frequency["curvature_times_R"], strict=True)
    grid += [Condition(hz, curvature, phase) for hz, curvature in places for phase in phases]
    order = {(c.curvature_times_R, c.frequency_Hz, c.phase_turns): c for c in grid}
    return [order[place] for place in sorted(order)]


def run_all(
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition],
    threads: int | None = None,
    settled_runs: Sequence[RobotRun] | None = None,
) -> list[RobotRun]:
    """Run every condition, several at a time: the compiled stepper lets other threads run meanwhile.

    `settled_runs`: One of each condition in nearly the same medium; where it is steady, the run starts as it ends.
    """
    starts: list[FloatArray | None] = [None] * len(conditions)
    if settled_runs is not None:
        starts = [run.end_state if run.outcome == "steady" else None for run in settled_runs]

    def run(index: int) -> RobotRun:
        condition = conditions[index]
        return simulate(
            robot,
            profile,
            condition.frequency_Hz,
            condition.curvature_times_R,
            condition.phase_turns,
            start=starts[index],
        )

    # slow frequencies take longest: begin with them, so that no core idles at the end
    slow = [abs(condition.frequency_Hz) or math.inf for condition in conditions]
    order = sorted(range(len(conditions)), key=slow.__getitem__)
    with ThreadPoolExecutor(threads or usable_cores()) as pool:
        runs = dict(zip(order, pool.map(run, order), strict=True))
    return [runs[index] for index in range(len(conditions))]


def speed_table(runs: Iterable[RobotRun]) -> pd.DataFrame:
    """Table of runs, with columns `RUN_COLUMNS`."""
    rows = [
        (
            run.condition.curvature_times_R,
            run.condition.frequency_Hz,
            run.condition.phase_turns,
            run.speed_cm_per_s,
            run.speed_sd_cm_per_s,
            run.outcome,
            *reason_cells(run.why),
            run.warning,
            run.strides,
            run.averaged,
        )
        for run in runs
    ]
    return pd.DataFrame(rows, columns=list(RUN_COLUMNS))


def mean_speed(table: pd.DataFrame) -> pd.DataFrame:
    """Mean, least and greatest speed over the starting phases whose runs are steady; NaN where none is."""
    rows = []
    for place, phases in table.groupby(["curvature_times_R", "frequency_Hz"]):
        runs = phases.to_dict("records")
        steady = np.array([run["speed_cm_per_s"] for run in runs if run["outcome"] == "steady"])
        lost = [run for run in runs if run["outcome"] != "steady"]
        words = [
            (Remark(run["outcome"].replace(" ", "-"), words=run["outcome"]), *reason_of(run))
            for run in lost
        ]
        reason = [
            remark_of_run
            for run, why in zip(lost, words, strict=True)
            for remark_of_run in attach_run(f"phase {run['phase_turns']:.3g}", why)
        ]
        ends = (steady.mean(), steady.min(), steady.max()) if steady.size else (math.nan,) * 3
        rows.append((*place, *ends, steady.size, len(runs), *reason_cells(reason)))
    names = [
        "curvature_times_R",
        "frequency_Hz",
        "speed_cm_per_s",
        "speed_lo_cm_per_s",
        "speed_hi_cm_per_s",
        "phases_steady",
        "phases",
        *REASON,
    ]
    return pd.DataFrame(rows, columns=names)


def best_curvature(curvature: np.ndarray, speed: np.ndarray) -> tuple[float, float]:
    """Curvature of the highest speed at one frequency, and that speed; NaN where nothing is steady.

    It is the top of the parabola fitted to the points within 0.2 of the fastest one; the fastest
    point itself where these are fewer than four or have no top among them.
    """
    is_finite = np.isfinite(speed)
    if not is_finite.any():
        return math.nan, math.nan
    curvature, speed = curvature[is_finite], speed[is_finite]
    top = int(np.argmax(speed))
    near = np.abs(curvature - curvature[top]) <= 0.2 + 1e-9
    if near.sum() >= 4:
        square, slope, level = np.polyfit(curvature[near], speed[near], 2)
        if square < 0:
            place = -slope / (2 * square)
            if curvature[near].min() <= place <= curvature[near].max():
                return float(place), float(level - slope**2 / (4 * square))
    return float(curvature[top]), float(speed[top])


def runs_about_best(
    robot: Robot,
    profile: Profile,
    threads: int | None = None,
    settled_runs: Sequence[RobotRun] | None = None,
) -> list[RobotRun]:
    """Runs at 5 Hz with the curvatures among which the best is looked for; `settled_runs` as in `run_all`."""
    conditions = [Condition(BEST_AT_HZ, value) for value in BEST_CURVATURES]
    return run_all(robot, profile, conditions, threads, settled_runs)


def best_of_runs(runs: Iterable[RobotRun]) -> tuple[float, float]:
    """Best curvature R'/r of `runs_about_best`, and its speed (cm/s)."""
    speeds = np.array([run.speed_cm_per_s for run in runs])
    return best_curvature(np.array(BEST_CURVATURES), speeds)


def speed_target(robot: Robot, conditions: Sequence[tuple[float, float]]) -> Target:
    """Speed at pairs of (curvature R'/r, stride frequency in Hz), as what pushes are planned for."""

    def numbers(alpha: FloatArray, medium_map: Map) -> FloatArray:
        speeds = []
        for z, x in alpha.reshape(-1, 2, medium_map.beta.size):
            table = TableProfile(z, x, medium_map.beta, medium_map.gamma)
            runs = (simulate(robot, table, hz, curvature) for curvature, hz in conditions)
            speeds.append([run.speed_cm_per_s for run in runs])
        return np.array(speeds).reshape(*alpha.shape[:-2], len(conditions))

    parts = tuple(f"R'/r = {curvature:g}, {frequency:g} Hz" for curvature, frequency in conditions)
    return Target("speed of the robot", parts, numbers, linear=False)
