"""What `rftfit watch` is worth at a bench: pushes that a stated accuracy takes, and pushes after which a mistake is told.

    python studies/live_bench.py pushes --rows FOLDER    20 repeats of each goal, medium and way
    python studies/live_bench.py faults                  5 random orders of each fault

`pushes`: a push is the published alpha of a medium with the usual error of a prepared bed; the shape that is known beforehand
is that of the other four media. The way `watch` is the planned one from end to end: logs of a re-enacted rig, `rftfit watch`,
and its next push. `faults`: a re-enacted campaign (beds 5 % apart) is put into a folder push by push, in random orders; from
push 12 on a channel is dead or the mount is turned, or push 12 alone has a wrong row.
"""

from __future__ import annotations

import random
import sys
import tempfile
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
import yaml
from frame import Part, Row, Tables, Unit
from paper import disturbed_logs

from rftfit.bench.events import Event
from rftfit.bench.watch import MEASURED, READ, Watch
from rftfit.campaign.config import Config
from rftfit.forces.outlines import model_leg
from rftfit.forces.planning import Rig, Target, peaks, plan
from rftfit.lab.enact import prepare
from rftfit.lab.write import sheet_text
from rftfit.model.profiles import TableProfile
from rftfit.model.shapes import Map, Pushes, estimate, published_shapes, usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from paper import Sizes

    from rftfit.lab.plan import PlannedRun

# --- A re-enacted rig that makes one push after the other, and the watch that looks at its files

CONFIG = frame.PROJECT / "config" / "config.yaml"
BEDS = {"spread-percent": 5.0}
"""Prepared beds differ by so much."""


class LiveRig:
    """The paper's plates in one medium, in the folder `root`; `plates` are all runs that it can make."""

    def __init__(self, root: Path, medium: str, seed: int, target: Target | str = "map") -> None:
        values = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
        values["media"] = {medium: values["media"][medium]}
        del values["robot"]
        self.config, self.seed, self.medium = Config(**values), seed, medium
        runs = prepare(self.config, media=[medium], legs=False).runs
        self.rods = {run.run_id: run for run in runs if run.kind == "rod"}
        self.plates = [run for run in runs if run.kind == "plate"]
        self._rows: list[PlannedRun] = []
        self._raw, self._now = root / "raw" / "paper", 0.0
        (self._raw / medium).mkdir(parents=True)
        self._write_sheet()
        file = root / "config" / "config.yaml"
        file.parent.mkdir()
        file.write_text(yaml.safe_dump(values), encoding="utf-8")
        self.watch = Watch(file, target=target)

    def _write_sheet(self) -> None:
        (self._raw / "runs.csv").write_text(sheet_text(self._rows, {}), encoding="utf-8")

    def logs(self, run: PlannedRun, sizes: Sizes = BEDS) -> tuple[bytes, bytes]:
        """Force log and motion log of a run, with disturbances of some sizes."""
        logs = disturbed_logs(run, self.config, self.seed, sizes)
        return logs[run.force_log] or b"", logs[run.motion_log] or b""

    def record(self, logs: Mapping[PlannedRun, tuple[bytes, bytes]]) -> list[Event]:
        """Write rows and logs of some runs; what the watch says of them."""
        for run, contents in logs.items():
            for name, content in zip((run.force_log, run.motion_log), contents, strict=True):
                (self._raw / name).write_bytes(content)
        self._rows += logs
        self._write_sheet()
        events: list[Event] = []
        for _ in range(8):  # config and sheet first, then logs that are looked at every fourth time
            self._now += 0.5
            events += self.watch.step(self._now)
        return events

    def push(self, plates: Sequence[PlannedRun]) -> list[Event]:
        """Make plate runs, each with its rod-only run."""
        runs = [run for plate in plates for run in (self.rods[plate.tare_run], plate)]
        return self.record({run: self.logs(run) for run in runs})


# --- Pushes to a stated accuracy


MEDIA = ("poppy_LP", "poppy_CP", "glass0.3mm_LP", "glass0.3mm_CP", "glass3mm_CP")
WAYS = ("planned", "random", "paper", "watch")
GOALS = {"lift": 10.0, "map": 5.0}
"""Half width of the interval at which to stop, percent."""
MOST = 40
"""Most pushes of a loop, and of an order with a fault."""


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
        width = 100 * push_plan.steps[0].typical
        if width <= GOALS[goal]:
            break
        direction = push_plan.steps[1].directions[0] if way == "planned" else next(order)
    half_width = push_plan.steps[0].half_width
    return len(pushes), width, share_held(goal, current_map, truth, target, half_width)


def watch_pushes(medium: str, goal: str, _way: str, repeat: int) -> tuple[int, float, float]:
    """The same by a watch of a re-enacted rig, which is asked for the next push."""
    with tempfile.TemporaryDirectory() as folder:
        rig = LiveRig(Path(folder), medium, 2013 + repeat, target_of(goal))
        of_direction: dict[tuple[float, float], list[PlannedRun]] = {}
        for run in rig.plates:
            beta, gamma = float(run.beta_deg or 0), float(run.gamma_deg or 0)
            # a pull back along a path is the push of the mirror image
            if run.direction == "extraction":
                beta, gamma = (beta if beta == 90 else -beta), -gamma
            of_direction.setdefault((round(beta), round(gamma)), []).append(run)
        direction, count = (0.0, 90.0), 0
        while True:
            rig.push(of_direction[round(direction[0]), round(direction[1])])
            state, count = rig.watch.media[medium], count + 1
            if state.width <= GOALS[goal] or count == MOST:
                break
            assert state.plan is not None
            direction = state.plan.steps[1].directions[0]
        assert state.map is not None
        assert state.plan is not None
        truth, half_width = TableProfile.published(medium), state.plan.steps[0].half_width
        return count, state.width, share_held(goal, state.map, truth, rig.watch.target, half_width)


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


# --- Pushes until a mistake is told


AT = 12
TURNS = {f"mount turned by {angle}° from here on": {"turn": float(angle)} for angle in (5, 10, 20)}
CONTROL = ", each fourth push straight down"
TURNS |= {name + CONTROL: sizes for name, sizes in TURNS.items()}
DEAD = "channel of the horizontal force dead from here on"
DIRECTION = "this push filed under another direction of motion"
MEDIUM = "this push made in another medium (0.3 mm glass spheres, close)"


def with_column(content: bytes, column: str, value: str) -> bytes:
    """A log with one value in the whole of a column."""
    lines = content.decode().splitlines()
    head = next(place for place, line in enumerate(lines) if line.startswith("time_s"))
    index = next(i for i, name in enumerate(lines[head].split(",")) if name.startswith(column))
    rows = [line.split(",") for line in lines[head + 1 :]]
    text = [",".join([*row[:index], value, *row[index + 1 :]]) for row in rows]
    return ("\n".join([*lines[: head + 1], *text]) + "\n").encode()


def logs_of(
    rig: LiveRig, kind: str, run: PlannedRun, later_runs: Iterable[PlannedRun]
) -> tuple[bytes, bytes]:
    """Force log and motion log of a run, with what goes wrong."""
    if kind == DIRECTION:
        other = next(
            later
            for later in later_runs
            if later.kind == run.kind and later.gamma_deg != run.gamma_deg
        )
        return rig.logs(other)
    if kind == MEDIUM:
        return rig.logs(replace(run, published="glass0.3mm_CP"))
    force, motion = rig.logs(run, BEDS | TURNS.get(kind, {}))
    return with_column(force, "F2", "0.00000") if kind == DEAD else force, motion


def findings_of(events: Iterable[Event]) -> set[str]:
    """What the watch says to be wrong."""
    findings = set()
    for event in events:
        if event.kind == "medium":
            findings |= {f"check `{check['check']}`" for check in event.facts["checks"]}
        if event.kind == "push":
            findings |= {f"flag `{flag['code']}`" for flag in event.facts["flags"]}
            findings |= set() if event.facts["state"] in (MEASURED, READ) else {"run refused"}
    return findings


def with_control(rig: LiveRig, plates: list[PlannedRun]) -> list[PlannedRun]:
    """Each fourth push is one straight down with the level plate, of a bed of its own."""
    down = next(plate for plate in rig.plates if plate.beta_deg == 0 and plate.gamma_deg == 90)
    rod = rig.rods[down.tare_run]
    for index in range(3, MOST, 4):
        control = replace(down, run_id=f"{down.run_id}_{index}", tare_run=f"{rod.run_id}_{index}")
        rig.rods[control.tare_run] = replace(rod, run_id=control.tare_run)
        plates = [*plates[:index], control, *plates[index:]]
    return plates


def grade_fault(kind: str, seed: int) -> list[Row]:
    """First check or flag that was not there before push 12, and the further pushes after which it comes."""
    before = set[str]()
    with tempfile.TemporaryDirectory() as folder:
        rig = LiveRig(Path(folder), "poppy_LP", 2013 + seed)
        plates = random.Random(seed).sample(rig.plates, len(rig.plates))
        if kind.endswith(CONTROL):
            plates = with_control(rig, plates)
        for number, plate in enumerate(plates[:MOST], start=1):
            is_bad = number == AT or (number > AT and kind not in (DIRECTION, MEDIUM))
            later_runs = [
                later_run
                for later_plate in plates[MOST:]
                for later_run in (later_plate, rig.rods[later_plate.tare_run])
            ]
            logs = {
                run: logs_of(rig, kind, run, later_runs) if is_bad else rig.logs(run)
                for run in (rig.rods[plate.tare_run], plate)
            }
            findings = findings_of(rig.record(logs))
            if number < AT:
                before |= findings
            elif findings - before:
                first = ", ".join(sorted(findings - before))
                return [{"fault": kind, "first": first, "further": number - AT}]
    return [{"fault": kind, "first": "", "further": np.nan}]


def report_faults(rows: pd.DataFrame) -> Tables:
    """Orders in which each fault is told, by what, and after how many further pushes."""
    table = rows.groupby("fault", sort=False).agg(
        orders=("further", "size"),
        told=("further", "count"),
        first=("first", lambda names: "; ".join(dict.fromkeys(names.dropna()))),
        median=("further", "median"),
        largest=("further", "max"),
    )
    return [(f"At push {AT}; further pushes", table.reset_index())]


def list_pushes(count: int, _seed: int) -> list[Unit]:
    """Repeats of each goal, medium and way."""
    return [*product(range(count), GOALS, MEDIA, WAYS)]


def list_orders(count: int, _seed: int) -> list[Unit]:
    """Random orders of each fault."""
    return [*product((DEAD, *TURNS, DIRECTION, MEDIUM), range(count))]


PARTS = {
    "pushes": Part(list_pushes, grade_pushes, report_pushes, 20),
    "faults": Part(list_orders, grade_fault, report_faults, 5),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
