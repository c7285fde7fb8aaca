"""After how many pushes a watch reports what goes wrong at push 12.

``python studies/told_after.py`` prints the table of docs/howto/bench.md. A re-enacted campaign (beds 5 % apart) is
put into a folder push by push, in several random orders; from push 12 on a channel is dead or the mount is turned, or
push 12 alone has a wrong row.
"""

from __future__ import annotations

import argparse
import random
import statistics
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from live_rig import BEDS, LiveRig

from rftfit.bench.watch import MEASURED, READ

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.bench.watch import Event
    from rftfit.lab.plan import PlannedRun

AT, MOST = 12, 40
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
        return rig.logs(
            next(
                later_run
                for later_run in later_runs
                if later_run.kind == run.kind and later_run.gamma_deg != run.gamma_deg
            )
        )
    if kind == MEDIUM:
        return rig.logs(replace(run, published="glass0.3mm_CP"))
    force, motion = rig.logs(run, BEDS | TURNS.get(kind, {}))
    return with_column(force, "F2", "0.00000") if kind == DEAD else force, motion


def reports(events: Iterable[Event]) -> set[str]:
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


def told_after(kind: str, seed: int) -> dict[str, int]:
    """Further pushes after which each check or flag comes that was not there before push 12."""
    pushes_by_finding, before = dict[str, int](), set[str]()
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
            findings = reports(rig.record(logs))
            if number < AT:
                before |= findings
            else:
                pushes_by_finding |= dict.fromkeys(
                    findings - before - set(pushes_by_finding), number - AT
                )
    return pushes_by_finding


def main() -> None:
    """Print a row for each fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", type=int, default=5)
    orders = parser.parse_args().orders
    print(
        f"| at push {AT} | told in | first by | further pushes: median (largest) |\n|---|---|---|---|"
    )
    for kind in (DEAD, *TURNS, DIRECTION, MEDIUM):
        pushes_of_orders = [
            pushes_by_finding
            for seed in range(orders)
            if (pushes_by_finding := told_after(kind, seed))
        ]
        first_findings = dict.fromkeys(
            min(pushes_by_finding, key=pushes_by_finding.__getitem__)
            for pushes_by_finding in pushes_of_orders
        )
        after = sorted(min(pushes_by_finding.values()) for pushes_by_finding in pushes_of_orders)
        times = f"{statistics.median(after):g} ({after[-1]})" if after else f"none in {MOST - AT}"
        print(
            f"| {kind} | {len(pushes_of_orders)} of {orders} orders | {', '.join(first_findings) or 'nothing'} "
            f"| {times} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
