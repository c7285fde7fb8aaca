"""After how many pushes a watch tells what goes wrong at push 12.

``python studies/told_after.py`` prints the table of docs/howto/bench.md. A re-enacted campaign (beds 5 % apart) is
put into a folder push by push, in an order of chance; from push 12 on a channel is dead or the mount is turned, or push
12 alone is filed under another direction.
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from rftfit.bench.watch import MEASURED, Watch
from rftfit.campaign.config import Config
from rftfit.lab.enact import prepare, run_logs
from rftfit.lab.write import sheet_text

if TYPE_CHECKING:
    from rftfit.lab.plan import Run

CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"
MEDIUM = "poppy_LP"
AT, MOST = 12, 40
BEDS = {"spread-percent": 5.0}


def dead(content: bytes) -> bytes:
    """A force log whose channel F2 (horizontal) shows nothing."""
    lines = content.decode().splitlines()
    head = next(place for place, line in enumerate(lines) if line.startswith("time_s"))
    at = next(i for i, name in enumerate(lines[head].split(",")) if name.startswith("F2"))
    rows = [line.split(",") for line in lines[head + 1 :]]
    text = [",".join([*row[:at], "0.00000", *row[at + 1 :]]) for row in rows]
    return ("\n".join([*lines[: head + 1], *text]) + "\n").encode()


def logs_of(kind: str, run: Run, number: int, config: Config) -> dict[str, bytes | None]:
    """Logs of push `number` (from 1), with what goes wrong."""
    late = number >= AT
    sizes = BEDS | ({"turn": 5.0} if kind == "mount turned by 5 deg" and late else {})
    logs = run_logs(run, config, 2013, sizes=sizes)
    if kind == "channel F2 dead" and late:
        logs[run.force_log] = dead(logs[run.force_log] or b"")
    return logs


def told_at(kind: str, seed: int) -> dict[str, int]:
    """Number of the push at which each check or flag is told first, from push 12 on."""
    values = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    values["media"] = {MEDIUM: values["media"][MEDIUM]}
    del values["robot"]
    config, found = Config(**values), dict[str, int]()
    runs = prepare(config, media=[MEDIUM], legs=False).runs
    rods = {run.run_id: run for run in runs if run.kind == "rod"}
    plates = [run for run in runs if run.kind == "plate"]
    random.Random(seed).shuffle(plates)
    other = next(one for one in plates[MOST:] if one.direction == plates[AT - 1].direction)
    with tempfile.TemporaryDirectory() as folder:
        raw, file = Path(folder, "raw", "paper"), Path(folder, "config", "config.yaml")
        file.parent.mkdir()
        file.write_text(yaml.safe_dump(values), encoding="utf-8")
        Path(raw, MEDIUM).mkdir(parents=True)
        Path(raw, "runs.csv").write_text(sheet_text([], {}), encoding="utf-8")
        watch, now, before = Watch(file), 0.0, set[str]()
        for number, plate in enumerate(plates[:MOST], start=1):
            swapped = kind == "push filed under another direction" and number == AT
            for run in (rods[plate.tare_run], plate):
                of = (rods[other.tare_run] if run.kind == "rod" else other) if swapped else run
                logs = logs_of(kind, of, number, config)
                for own, there in ((run.force_log, of.force_log), (run.motion_log, of.motion_log)):
                    Path(raw, own).write_bytes(logs[there] or b"")
            done = [one for each in plates[:number] for one in (rods[each.tare_run], each)]
            Path(raw, "runs.csv").write_text(sheet_text(done, {}), encoding="utf-8")
            told = set[str]()
            for _ in range(8):
                now += 0.5
                for event in watch.step(now):
                    if event.kind == "medium":
                        told |= {f"check {one['check']}" for one in event.facts["checks"]}
                    if event.kind == "push":
                        told |= {f"flag {one['code']}" for one in event.facts["flags"]}
                        told |= (
                            {"refused"} if event.facts["state"] not in (MEASURED, "read") else set()
                        )
            if number >= AT:
                for one in told - before:
                    found.setdefault(one, number)
            else:
                before |= told
    return found


def main() -> None:
    """Print a row for each fault."""
    kinds: tuple[str, ...] = (
        "channel F2 dead",
        "mount turned by 5 deg",
        "push filed under another direction",
    )
    print(
        "| at push 12 | told first | further pushes | also told (further pushes) |\n|---|---|---|---|"
    )
    for kind in kinds:
        found = sorted(told_at(kind, 1).items(), key=lambda item: item[1])
        first, *others = [(what, number - AT) for what, number in found] or [("nothing", MOST - AT)]
        print(
            f"| {kind} | {first[0]} | {first[1]} | {', '.join(f'{w} ({n})' for w, n in others)} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
