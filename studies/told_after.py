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
    from rftfit.lab.plan import Run

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
    at = next(i for i, name in enumerate(lines[head].split(",")) if name.startswith(column))
    rows = [line.split(",") for line in lines[head + 1 :]]
    text = [",".join([*row[:at], value, *row[at + 1 :]]) for row in rows]
    return ("\n".join([*lines[: head + 1], *text]) + "\n").encode()


def logs_of(rig: LiveRig, kind: str, run: Run, others: Iterable[Run]) -> tuple[bytes, bytes]:
    """Force log and motion log of a run, with what goes wrong."""
    if kind == DIRECTION:
        return rig.logs(
            next(one for one in others if one.kind == run.kind and one.gamma_deg != run.gamma_deg)
        )
    if kind == MEDIUM:
        return rig.logs(replace(run, published="glass0.3mm_CP"))
    force, motion = rig.logs(run, BEDS | TURNS.get(kind, {}))
    return with_column(force, "F2", "0.00000") if kind == DEAD else force, motion


def reports(events: Iterable[Event]) -> set[str]:
    """What the watch says to be wrong."""
    found = set()
    for event in events:
        if event.kind == "medium":
            found |= {f"check `{one['check']}`" for one in event.facts["checks"]}
        if event.kind == "push":
            found |= {f"flag `{one['code']}`" for one in event.facts["flags"]}
            found |= set() if event.facts["state"] in (MEASURED, READ) else {"run refused"}
    return found


def with_control(rig: LiveRig, plates: list[Run]) -> list[Run]:
    """Each fourth push is one straight down with the level plate, of a bed of its own."""
    down = next(one for one in rig.plates if one.beta_deg == 0 and one.gamma_deg == 90)
    rod = rig.rods[down.tare_run]
    for at in range(3, MOST, 4):
        own = replace(down, run_id=f"{down.run_id}_{at}", tare_run=f"{rod.run_id}_{at}")
        rig.rods[own.tare_run] = replace(rod, run_id=own.tare_run)
        plates = [*plates[:at], own, *plates[at:]]
    return plates


def told_after(kind: str, seed: int) -> dict[str, int]:
    """Further pushes after which each check or flag comes that was not there before push 12."""
    found, before = dict[str, int](), set[str]()
    with tempfile.TemporaryDirectory() as folder:
        rig = LiveRig(Path(folder), "poppy_LP", 2013 + seed)
        plates = random.Random(seed).sample(rig.plates, len(rig.plates))
        if kind.endswith(CONTROL):
            plates = with_control(rig, plates)
        for number, plate in enumerate(plates[:MOST], start=1):
            is_bad = number == AT or (number > AT and kind not in (DIRECTION, MEDIUM))
            others = [one for each in plates[MOST:] for one in (each, rig.rods[each.tare_run])]
            logs = {
                run: logs_of(rig, kind, run, others) if is_bad else rig.logs(run)
                for run in (rig.rods[plate.tare_run], plate)
            }
            told = reports(rig.record(logs))
            if number < AT:
                before |= told
            else:
                found |= dict.fromkeys(told - before - set(found), number - AT)
    return found


def main() -> None:
    """Print a row for each fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", type=int, default=5)
    orders = parser.parse_args().orders
    print(
        f"| at push {AT} | told in | first by | further pushes: median (largest) |\n|---|---|---|---|"
    )
    for kind in (DEAD, *TURNS, DIRECTION, MEDIUM):
        each = [found for seed in range(orders) if (found := told_after(kind, seed))]
        first = dict.fromkeys(min(found, key=found.__getitem__) for found in each)
        after = sorted(min(found.values()) for found in each)
        times = f"{statistics.median(after):g} ({after[-1]})" if after else f"none in {MOST - AT}"
        print(
            f"| {kind} | {len(each)} of {orders} orders | {', '.join(first) or 'nothing'} "
            f"| {times} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
