"""What `rftfit watch` is worth at a bench: pushes that a stated accuracy takes.

    python studies/live_bench.py --rows FOLDER    20 repeats of each goal, medium and way

A push is the published alpha of a medium with the usual error of a prepared bed; the shape that is known beforehand is that of
the other four media. The way `watch` is the planned one from end to end: logs of a re-enacted rig, `rftfit watch`, and its next push.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from campaigns import lay_bench
from frame import Part, Row, Tables, Unit
from paper import enact, paper_values

from rftfit.bench.watch import Watch
from rftfit.forces.outlines import model_leg
from rftfit.forces.planning import Rig, Target, peaks, plan
from rftfit.model.maps import Map, estimate
from rftfit.model.profiles import TableProfile
from rftfit.model.pushes import Pushes, usual_error
from rftfit.model.shapes import published_shapes
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA

if TYPE_CHECKING:
    from collections.abc import Iterator

BEDS = {"spread-percent": 5.0}
"""Prepared beds differ by so much."""
WAYS = ("planned", "random", "paper", "watch")
GOALS = {"lift": 10.0, "map": 5.0}
"""Half width of the interval at which to stop, percent."""
MOST = 40
"""Most pushes of a loop."""


def target_of(goal: str) -> Target | str:
    """What is to be known: the map, or the peak lift of a c-leg alone."""
    if goal == "map":
        return goal
    leg_peaks = peaks([model_leg("c_leg")])
    return Target(
        "peak lift",
        leg_peaks.parts[:1],
        lambda alpha, current_map: leg_peaks.numbers(alpha, current_map)[..., :1],
        np.abs,
        "the peak lift",
    )


def order_directions(way: str, random: np.random.Generator) -> Iterator[tuple[float, float]]:
    """Directions of the paper's grid, in its order or any; straight down comes first."""
    grid = [(float(b), float(g)) for b, g in product(BETA_DEG, GAMMA_DEG) if b > -90]
    if way == "random":
        random.shuffle(grid)
    yield 0.0, 90.0
    yield from (direction for direction in grid if direction != (0.0, 90.0))


def grade_pushes(repeat: int, goal: str, medium: str, way: str) -> list[Row]:
    """Push until the goal is reached: how often, whether it was, and the share of intervals that hold."""
    loop = watch_pushes if way == "watch" else choose_pushes
    count, width, share = loop(medium, goal, way, repeat)
    keys: Row = {"goal": goal, "medium": medium, "way": way}
    return [keys | {"pushes": count, "reached": width <= GOALS[goal], "held": share}]


def choose_pushes(medium: str, goal: str, way: str, repeat: int) -> tuple[int, float, float]:
    """Number of pushes, width at the stop in percent, and share of intervals that hold."""
    random = np.random.default_rng([2013, repeat, MEDIA.index(medium)])
    truth, shapes = TableProfile.published(medium), published_shapes([medium])
    target, order = target_of(goal), order_directions(way, random)
    direction, pushes = next(order), []
    for _ in range(MOST):
        alpha = np.array(truth.alpha(*np.radians(direction))).ravel()
        se = usual_error(alpha)
        pushes.append((*direction, *(alpha + se * random.standard_normal(2))))
        beta, gamma, z, x = np.array(pushes).T
        numbers = np.stack([z, x])
        errors = usual_error(numbers.ravel()).reshape(2, -1)
        current_map = estimate(Pushes.of(beta, gamma, numbers, errors), shapes)
        push_plan = plan(target, current_map, Rig(), 1)
        width = 100 * push_plan.steps[0].overall
        if width <= GOALS[goal]:
            break
        direction = push_plan.steps[1].directions[0] if way == "planned" else next(order)
    half_width = push_plan.steps[0].half_width
    return len(pushes), width, share_held(goal, current_map, truth, target, half_width)


def watch_pushes(medium: str, goal: str, _way: str, repeat: int) -> tuple[int, float, float]:
    """The same by a watch of a re-enacted rig, which is asked for the next push."""
    values = paper_values("robot")
    values["media"] = {medium: values["media"][medium]}
    with TemporaryDirectory() as folder:
        recorded = Path(folder) / "recorded"
        enact(recorded, values, BEDS, seed=2013 + repeat, legs=False)
        bench = lay_bench(Path(folder) / "bench", recorded)
        bench.write_sheet()
        watch = Watch(bench.config, target=target_of(goal))
        runs: dict[tuple[float, float], list[str]] = {}
        for run_id in bench.plates:
            runs.setdefault(direction_of(bench.every[run_id]), []).append(run_id)
        direction, count = (0.0, 90.0), 0
        while True:
            bench.push(*runs[round(direction[0]), round(direction[1])])
            bench.settle(watch)
            state, count = watch.media[medium], count + 1
            assert state.plan is not None
            if state.width <= GOALS[goal] or count == MOST:
                break
            direction = state.plan.steps[1].directions[0]
        assert state.map is not None
        half_width = state.plan.steps[0].half_width
        truth = TableProfile.published(medium)
        return count, state.width, share_held(goal, state.map, truth, watch.target, half_width)


def direction_of(row: dict[str, str]) -> tuple[float, float]:
    """Direction of a row of the run sheet; a pull back along a path is the push of the mirror image."""
    beta, gamma = float(row["beta_deg"]), float(row["gamma_deg"])
    if row["direction"] == "extraction":
        beta, gamma = (beta if beta == 90 else -beta), -gamma
    return round(beta), round(gamma)


def share_held(
    goal: str, current_map: Map, truth: TableProfile, target: Target | str, half_width: np.ndarray
) -> float:
    """Share of the intervals at the stop that hold the published number."""
    true = np.stack(truth.alpha(current_map.beta, current_map.gamma))
    if isinstance(target, str) or goal == "map":
        table = current_map.table()
        lo, hi = (
            table[[f"alpha_{c}{end}_N_per_cm3" for c in "zx"]].to_numpy().T
            for end in ("_lo", "_hi")
        )
        new = ~current_map.measured & (np.abs(true) > 1e-6)
        return float(((lo <= true) & (true <= hi))[new].mean())
    estimated, real = (
        float(target.numbers(alpha, current_map)[..., 0]) for alpha in (current_map.alpha, true)
    )
    return float(abs(estimated - real) <= half_width[0] * abs(estimated))


def report_pushes(rows: pd.DataFrame) -> Tables:
    """Median and largest number of pushes by goal, medium and way, and the share of intervals that hold."""
    pushes = rows["pushes"].where(rows["reached"], MOST + 1)
    groups = rows.assign(pushes=pushes, held=100 * rows["held"])
    table = groups.groupby(["goal", "medium", "way"], sort=False).agg(
        repeats=("pushes", "size"),
        median=("pushes", "median"),
        largest=("pushes", "max"),
        held=("held", "mean"),
    )
    return [(f"Pushes until the goal; {MOST + 1}: not reached", table.reset_index())]


def list_pushes(count: int, _seed: int) -> list[Unit]:
    """Repeats of each goal, medium and way."""
    return [*product(range(count), GOALS, MEDIA, WAYS)]


PARTS = {"pushes": Part(list_pushes, grade_pushes, report_pushes, 20)}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
