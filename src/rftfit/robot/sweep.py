"""Many runs at once: which conditions a sweep runs, its table of speeds, and the curvature of the fastest legs.

A condition is a curvature R'/r of the legs (-1 reversed c-leg, 0 flat, 1 c-leg), a stride frequency (Hz) and a starting
phase (turns). The way of a sweep: `conditions_of`, `run_all`, `speed_table` (a row for each run), `mean_speed` (a row
for each curvature and frequency). The best curvature at 5 Hz has runs of its own, `runs_about_best` and `best_of_runs`.

A run that is not steady has no speed, but remarks (`Remark`: a code that becomes a sentence), which stand in the
columns ``reason`` and ``reason_code``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import product
from operator import attrgetter

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.forces.planning import Target, largest_size
from rftfit.measure.flags import REASON, Remark, attach_run, reason_cells, reason_columns, reason_of
from rftfit.model.maps import Map
from rftfit.model.profiles import Profile, TableProfile
from rftfit.outputs.dictionary import columns_of
from rftfit.robot.config import Robot
from rftfit.robot.run import Condition, RobotRun, simulate
from rftfit.store.environment import usable_cores

PHASES_TURNS = (0.0, 1 / 6, 1 / 3)
"""The three starting phases, thirds of half a turn, after which alternating tripods repeat."""

CALIBRATED_ON = {"c-leg": (1.0, 1.954), "flat leg": (0.0, 1.998), "reversed c-leg": (-1.0, 2.246)}
"""R'/r and stride frequency (Hz) of the points of Fig. 4C on which the paper's robot was calibrated."""

RANGE_IN_VIEW = "the range of its unknown lengths was chosen with all these speeds in view"
"""Clause on every share of the speeds on which the paper's robot was not calibrated (docs/theory/robot.md)."""

MOTION = ((1.0, 2.0), (-1.0, 2.2))
"""R'/r and stride frequency (Hz) of the two runs of Fig. 4B, whose motion is shown over time."""


def is_at_condition(
    conditions: Iterable[tuple[float, float]], curvature: float, frequency_Hz: float
) -> bool:
    """Return True if a run or trial is at one of the conditions (R'/r, Hz); its frequency may differ by less than 0.1 Hz.

    Trials of one condition have slightly different frequencies. `frequency_Hz` NaN is at no condition.
    """
    return any(
        abs(curvature - curvature_of_condition) < 1e-6 and abs(frequency_Hz - frequency) < 0.1
        for curvature_of_condition, frequency in conditions
    )


BEST_AT_HZ = 5.0
"""Stride frequency at which the paper states the best curvature."""
BEST_CURVATURES = tuple(round(0.04 * index, 2) for index in range(15, 26))
"""Curvatures R'/r among which the fastest is searched at 5 Hz: 0.6 to 1 in steps of 0.04."""

RUN_COLUMNS = columns_of("robot/runs_table.csv")[2:]
"""Columns of a table of runs, without profile and medium: the condition, speed and its standard deviation between
strides, outcome, reason in words and as code, warning, and numbers of strides run and averaged (`RobotRun`)."""


def paper_conditions(every: int = 1) -> list[Condition]:
    """Return the 3,978 conditions of the paper's sweep: R'/r from -1 to 1 by 0.04, 0 to 5 Hz by 0.2, three phases.

    `every` n: only every n-th curvature and frequency, counted from the flat leg and from 5 Hz; the first and last
    curvature are always included.
    """
    # numbers of the steps; step 25 of either quantity is always included: the flat leg, and 5 Hz
    curvatures = sorted({0, 50, *range(25 % every, 51, every)})
    frequencies = range(25 % every, 26, every)
    return [
        Condition(round(0.2 * frequency, 1), round(0.04 * (curvature - 25), 2), phase)
        for curvature, frequency, phase in product(curvatures, frequencies, PHASES_TURNS)
    ]


def measured_conditions(measured: pd.DataFrame) -> list[Condition]:
    """Return the conditions of measured speeds, each once, with starting phase 0; one without a frequency is left out.

    `measured`: table with a row for each condition, columns ``curvature_times_R`` and ``frequency_Hz``.
    """
    with_frequency = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    pairs = zip(with_frequency["frequency_Hz"], with_frequency["curvature_times_R"], strict=True)
    return [Condition(*pair) for pair in dict.fromkeys(pairs)]


def conditions_of(measured: pd.DataFrame, *, full: bool) -> list[Condition]:
    """Return the conditions of a full or reduced sweep, sorted: its grid, and every measured condition.

    Measured conditions are run at exactly their frequency, so that speeds are compared without interpolation. The
    reduced sweep has one starting phase of three (on the published table the others change no measured speed by 1 %),
    every fourth curvature and frequency, and at 5 Hz every curvature above 0.4, among which is the best curvature of
    the paper. `measured`: as in `measured_conditions`. `full`: True for the grid and the phases of the paper.
    """
    grid = paper_conditions()
    phases = PHASES_TURNS if full else PHASES_TURNS[:1]
    if not full:
        fine = [c for c in grid if c.frequency_Hz == BEST_AT_HZ and c.curvature_times_R > 0.4]
        grid = [c for c in [*paper_conditions(every=4), *fine] if c.phase_turns in phases]
    grid += [
        replace(condition, phase_turns=phase)
        for condition in measured_conditions(measured)
        for phase in phases
    ]
    # a measured condition may be one of the grid: each once
    return sorted({*grid}, key=attrgetter("curvature_times_R", "frequency_Hz", "phase_turns"))


def run_all(
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition],
    threads: int | None = None,
    settled_runs: Sequence[RobotRun] | None = None,
) -> list[RobotRun]:
    """Run every condition, several at a time in threads, which the compiled stepper allows; runs in the same order.

    `threads`: how many at a time; None: as many as there are cores. `settled_runs`: one run of each condition in nearly
    the same medium; if it is steady, the new run starts in its last state, without a transient from rest. None: all
    from rest.
    """
    starts: list[FloatArray | None] = [None] * len(conditions)
    if settled_runs is not None:
        starts = [run.end_state if run.outcome == "steady" else None for run in settled_runs]

    def run(index: int) -> RobotRun:
        """Run the condition with this index."""
        condition = conditions[index]
        return simulate(
            robot,
            profile,
            condition.frequency_Hz,
            condition.curvature_times_R,
            condition.phase_turns,
            start=starts[index],
        )

    # runs of low frequencies take longest: they begin, so that no core is idle at the end; 0 Hz comes last
    frequencies = [abs(condition.frequency_Hz) or math.inf for condition in conditions]
    order = sorted(range(len(conditions)), key=frequencies.__getitem__)
    with ThreadPoolExecutor(threads or usable_cores()) as pool:
        runs = dict(zip(order, pool.map(run, order), strict=True))
    return [runs[index] for index in range(len(conditions))]


def speed_table(runs: Iterable[RobotRun]) -> pd.DataFrame:
    """Return the table of runs, one row for each, with the columns `RUN_COLUMNS`."""
    # each row has further fields of `RobotRun`, which `columns` leaves out
    rows = [vars(run.condition) | vars(run) | reason_columns(run.why) for run in runs]
    return pd.DataFrame(rows, columns=RUN_COLUMNS)


def mean_speed(table: pd.DataFrame) -> pd.DataFrame:
    """Return mean, least and greatest speed (cm/s) over the starting phases whose runs are steady; NaN if none is.

    `table`: as from `speed_table`. One row for each curvature and frequency: ``speed_cm_per_s`` with ``_lo`` and
    ``_hi``, how many phases are steady and how many were run, and for each other phase its outcome and why.
    """
    rows = []
    for condition, phases in table.groupby(["curvature_times_R", "frequency_Hz"]):
        # as records: selections of a table take longer
        runs = phases.to_dict("records")
        speeds = np.array([run["speed_cm_per_s"] for run in runs if run["outcome"] == "steady"])
        reason: list[Remark] = []
        for run in runs:
            if run["outcome"] == "steady":
                continue
            # the outcome as a remark, whose code is its words with hyphens
            outcome = Remark(run["outcome"].replace(" ", "-"), words=run["outcome"])
            reason += attach_run(f"phase {run['phase_turns']:.3g}", (outcome, *reason_of(run)))
        numbers = (speeds.mean(), speeds.min(), speeds.max()) if speeds.size else (math.nan,) * 3
        rows.append((*condition, *numbers, speeds.size, len(phases), *reason_cells(reason)))
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
    """Return the curvature R'/r of the highest speed at one frequency, and this speed (cm/s); both NaN if no run is steady.

    `curvature`, `speed`: shape (runs,); NaN for a run without a steady speed. Speed has a flat top over curvature, on
    which the fastest point wanders with small errors; so it is the maximum of a parabola fitted to the points within
    0.2 of the fastest point; the fastest point itself if these are fewer than four or the parabola has no maximum among
    them.
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
            maximum = -slope / (2 * square)
            if curvature[near].min() <= maximum <= curvature[near].max():
                return float(maximum), float(level - slope**2 / (4 * square))
    return float(curvature[top]), float(speed[top])


def runs_about_best(
    robot: Robot,
    profile: Profile,
    threads: int | None = None,
    settled_runs: Sequence[RobotRun] | None = None,
) -> list[RobotRun]:
    """Run the robot at 5 Hz with each of `BEST_CURVATURES`, in this order, as `best_of_runs` expects them.

    `threads`, `settled_runs`: as in `run_all`.
    """
    conditions = [Condition(BEST_AT_HZ, value) for value in BEST_CURVATURES]
    return run_all(robot, profile, conditions, threads, settled_runs)


def best_of_runs(runs: Iterable[RobotRun]) -> tuple[float, float]:
    """Return the best curvature R'/r from the runs of `runs_about_best`, and its speed (cm/s)."""
    speeds = np.array([run.speed_cm_per_s for run in runs])
    return best_curvature(np.array(BEST_CURVATURES), speeds)


def speed_target(robot: Robot, conditions: Sequence[tuple[float, float]]) -> Target:
    """Return the target for planning pushes: the robot's speed at pairs of (curvature R'/r, stride frequency in Hz).

    A plan of pushes (`rftfit.forces.planning`) looks for those that narrow the interval of a target most. How far an
    error of alpha moves a speed is found by simulation on tables of alpha.
    """

    def simulate_speeds(alpha: FloatArray, medium_map: Map) -> FloatArray:
        """Return the speeds (..., conditions), cm/s, for alpha (..., 2, n): z and x at the n nodes of a map, N/cm^3."""
        speeds = []
        for z, x in alpha.reshape(-1, 2, medium_map.beta.size):
            table = TableProfile(z, x, medium_map.beta, medium_map.gamma)
            runs = (simulate(robot, table, hz, curvature) for curvature, hz in conditions)
            speeds.append([run.speed_cm_per_s for run in runs])
        return np.array(speeds).reshape(*alpha.shape[:-2], len(conditions))

    # names of the conditions in the plan
    parts = tuple(f"R'/r = {curvature:g}, {frequency:g} Hz" for curvature, frequency in conditions)
    return Target(
        "speed of the robot",
        parts,
        simulate_speeds,
        largest_size,
        "the largest speed",
        linear=False,
    )
