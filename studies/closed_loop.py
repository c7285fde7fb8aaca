"""How many pushes a stated accuracy takes, if each push is chosen by what the pushes before have told.

``python studies/closed_loop.py`` prints the table of docs/howto/bench.md; ``--repeats``, ``--goals``, ``--ways``,
``--most`` and ``--rows FILE`` (kept rows are not made again) reduce it. A push is the published alpha of a medium with
the usual error of a prepared bed; the shape that is known beforehand is that of the other four media. The way `watch`
is the planned one from end to end: logs of a re-enacted rig, `rftfit watch`, and its next push.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from live_rig import LiveRig

from rftfit.forces.outlines import model_leg
from rftfit.forces.planning import Rig, Target, peaks, plan
from rftfit.model.profiles import TableProfile
from rftfit.model.shapes import Pushes, estimate, published_shapes, usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rftfit.lab.plan import PlannedRun

MEDIA = ("poppy_LP", "poppy_CP", "glass0.3mm_LP", "glass0.3mm_CP", "glass3mm_CP")
WAYS = ("planned", "random", "paper", "watch")
GOALS = {"lift": 10.0, "map": 5.0}
"""Half width of the interval at which to stop, percent."""
COLUMNS = ("medium", "goal", "way", "repeat", "pushes", "reached", "held")


def target_of(goal: str) -> Target | str:
    """What is to be known: the map, or the peak lift of a c-leg alone."""
    if goal == "map":
        return goal
    leg_peaks = peaks([model_leg("c_leg")])
    return Target(
        "peak lift",
        leg_peaks.parts[:1],
        lambda alpha, current_map: leg_peaks.numbers(alpha, current_map)[..., :1],
    )


def directions(way: str, random: np.random.Generator) -> Iterator[tuple[float, float]]:
    """Directions of the paper's grid, in its order or any; straight down comes first."""
    grid = [(float(b), float(g)) for b, g in product(BETA_DEG, GAMMA_DEG) if b > -90]
    if way == "random":
        random.shuffle(grid)
    yield 0.0, 90.0
    yield from (direction for direction in grid if direction != (0.0, 90.0))


def loop(medium: str, goal: str, way: str, repeat: int, most: int) -> tuple[int, bool, float]:
    """Push until the goal is reached; how often, whether it was, and the share of intervals that hold."""
    random = np.random.default_rng([2013, repeat, MEDIA.index(medium)])
    truth, shapes = TableProfile.published(medium), published_shapes([medium])
    target, order = target_of(goal), directions(way, random)
    direction, pushes = next(order), []
    for _ in range(most):
        alpha = np.array(truth.alpha(*np.radians(direction))).ravel()
        se = usual_error(alpha)
        pushes.append((*direction, *(alpha + se * random.standard_normal(2))))
        beta, gamma, z, x = np.array(pushes).T
        numbers = np.stack([z, x])
        current_map = estimate(
            Pushes.of(beta, gamma, numbers, usual_error(numbers.ravel()).reshape(2, -1)), shapes
        )
        push_plan = plan(target, current_map, Rig(), 1)
        width = 100 * push_plan.steps[0].typical
        if width <= GOALS[goal]:
            break
        direction = push_plan.steps[1].directions[0] if way == "planned" else next(order)
    return (
        len(pushes),
        width <= GOALS[goal],
        held(goal, current_map, truth, target, push_plan.steps[0].half_width),
    )


def watched(medium: str, goal: str, repeat: int, most: int) -> tuple[int, bool, float]:
    """The same by a watch of a re-enacted rig, which is asked for the next push."""
    with tempfile.TemporaryDirectory() as folder:
        rig = LiveRig(Path(folder), medium, 2013 + repeat, target_of(goal))
        of_direction: dict[tuple[float, float], list[PlannedRun]] = {}
        for run in rig.plates:
            beta, gamma = float(run.beta_deg or 0), float(run.gamma_deg or 0)
            # a pull back along a path is the push of the mirror image
            cell = (
                (beta if beta == 90 else -beta, -gamma)
                if run.direction == "extraction"
                else (beta, gamma)
            )
            of_direction.setdefault((round(cell[0]), round(cell[1])), []).append(run)
        direction, count = (0.0, 90.0), 0
        while True:
            rig.push(of_direction[round(direction[0]), round(direction[1])])
            medium_state, count = rig.watch.media[medium], count + 1
            if medium_state.width <= GOALS[goal] or count == most:
                break
            assert medium_state.plan is not None
            direction = medium_state.plan.steps[1].directions[0]
        assert medium_state.map is not None
        assert medium_state.plan is not None
        truth = TableProfile.published(medium)
        share = held(
            goal, medium_state.map, truth, rig.watch.target, medium_state.plan.steps[0].half_width
        )
    return count, medium_state.width <= GOALS[goal], share


def held(goal, current_map, truth, target, half_width) -> float:
    """Share of the intervals at the stop that hold the published number."""
    true = np.stack(truth.alpha(current_map.beta, current_map.gamma))
    if goal == "map":
        table = current_map.table()
        ends = [
            table[[f"alpha_{c}{e}_N_per_cm3" for c in "zx"]].to_numpy().T for e in ("_lo", "_hi")
        ]
        new = ~current_map.measured & (np.abs(true) > 1e-6)
        return float(((ends[0] <= true) & (true <= ends[1]))[new].mean())
    estimated, real = (
        float(target.numbers(alpha, current_map)[..., 0]) for alpha in (current_map.alpha, true)
    )
    return float(abs(estimated - real) <= half_width[0] * abs(estimated))


def main() -> None:
    """Make the rows that are missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--most", type=int, default=40)
    parser.add_argument("--rows", type=Path, default=Path("benchmarks/results/closed_loop.csv"))
    parser.add_argument("--goals", nargs="*", default=[*GOALS])
    parser.add_argument("--ways", nargs="*", default=[*WAYS])
    words = parser.parse_args()
    words.rows.parent.mkdir(exist_ok=True)
    old_rows = list(csv.DictReader(words.rows.open())) if words.rows.exists() else []
    done = {tuple(row[name] for name in COLUMNS[:4]) for row in old_rows}
    with words.rows.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if not old_rows:
            writer.writerow(COLUMNS)
        for repeat, goal, medium, way in product(
            range(words.repeats), words.goals, MEDIA, words.ways
        ):
            if (medium, goal, way, str(repeat)) not in done:
                pushes, reached, share = (
                    watched(medium, goal, repeat, words.most)
                    if way == "watch"
                    else loop(medium, goal, way, repeat, words.most)
                )
                writer.writerow((medium, goal, way, repeat, pushes, int(reached), f"{share:.3f}"))
                file.flush()
    rows = pd.read_csv(words.rows)
    print(table(rows, words.most))


def table(rows: pd.DataFrame, most: int) -> str:
    """Median and largest number of pushes by goal, medium and way, and the share of intervals that hold."""
    lines = [
        "| goal | medium | planned | random | the paper's order | planned by a watch of logs | held (planned) | held (watch) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (goal, medium), rows_of_medium in rows.groupby(["goal", "medium"], sort=False):
        cells = []
        for way in WAYS:
            rows_of_way = rows_of_medium[rows_of_medium["way"] == way]
            count = rows_of_way["pushes"].where(rows_of_way["reached"] == 1, most + 1)
            middle, worst = count.median(), count.max()
            shown = [f"{v:g}" if v <= most else f"> {most}" for v in (middle, worst)]
            cells.append(f"{shown[0]} ({shown[1]})" if len(rows_of_way) else "")
        for way in ("planned", "watch"):
            share = 100 * rows_of_medium.loc[rows_of_medium["way"] == way, "held"].mean()
            cells.append(f"{share:.0f} %" if np.isfinite(share) else "")
        lines.append(f"| {goal} within {GOALS[str(goal)]:g} % | {medium} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
