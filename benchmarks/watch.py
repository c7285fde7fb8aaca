"""How fast `rftfit watch` tells, what it costs while nothing happens, and whether its memory stays flat.

Media of 50, 200 and 1,000 runs are re-enacted; then a log changes, again and again. Stated is what comes after
the time for which a file must be still: to the verdict of the push, and to map and plan. Wall-clock seconds,
and processor seconds, which other programs on the machine touch less.
"""

from __future__ import annotations

import argparse
import csv
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import yaml
from paper import NOTHING, reenact_disturbed

from rftfit.bench.watch import Watch
from rftfit.campaign.config import Config

RESULT = Path(__file__).parent / "results" / "watch.md"
CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"
MEDIUM = "poppy_LP"


def campaign(root: Path, runs: int) -> Path:
    """Re-enact a medium with so many runs, each direction several times where the grid has fewer."""
    values = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    values["media"] = {MEDIUM: values["media"][MEDIUM]}
    del values["robot"]
    (root / "config").mkdir(parents=True)
    config = root / "config" / "config.yaml"
    config.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    sheet = root / "raw" / "paper" / "runs.csv"
    reenact_disturbed(Config(**values), sheet.parent, sheet, NOTHING, 0.005, legs=False)
    with sheet.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    row_of_run = {row["run_id"]: row for row in rows}
    plates = [row for row in rows if row["kind"] == "plate"]
    new_rows: dict[str, dict[str, str]] = {}
    for number in range((runs + 1) // 2):
        plate = plates[number % len(plates)]
        for row in (row_of_run[plate["tare_run"]], plate):
            end = f"_r{number // len(plates)}" if number >= len(plates) else ""
            new = row | {key: row[key] and row[key] + end for key in ("run_id", "tare_run")}
            for key in ("force_log", "motion_log"):
                new[key] = row[key].replace(".csv", f"{end}.csv")
                if end:
                    text = (sheet.parent / row[key]).read_bytes()
                    (sheet.parent / new[key]).write_bytes(text)
            new_rows[new["run_id"]] = new
    with sheet.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(new_rows.values())
    return config


def memory_mb() -> float:
    """Memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def changes(watch: Watch, times: int) -> list[tuple[float, float, float, float]]:
    """Change a log so often; wall clock to verdict and to map and plan, and the same of the processor."""
    rows = [row for row in watch.rows[MEDIUM].values() if row.run.kind == "plate"]
    now, latencies = 1e6, []
    for number in range(times):
        path = Path(rows[number % len(rows)].files[0])
        path.write_bytes(path.read_bytes())
        now += 10
        # asked every fourth time; then it must be still
        for step in range(4):
            list(watch.step(now + 0.1 * step))
        wall, processor_start = time.perf_counter(), time.process_time()
        latency_by_kind: dict[str, tuple[float, float]] = {}
        for event in watch.step(now + 5):
            latency_by_kind.setdefault(
                event.kind, (time.perf_counter() - wall, time.process_time() - processor_start)
            )
        latencies.append(
            (
                latency_by_kind["push"][0],
                latency_by_kind["medium"][0],
                latency_by_kind["push"][1],
                latency_by_kind["medium"][1],
            )
        )
    return latencies


def main() -> None:
    """Print a table of latencies, the share of a core while nothing happens, and memory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=[50, 200, 1000])
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--events", type=int, default=2000)
    words = parser.parse_args()
    lines = [
        "| runs | to the verdict: median (worst), s | to map and plan | verdict, processor | map and plan, processor | idle, % of a core |",
        "|---|---|---|---|---|---|",
    ]
    for runs in words.sizes:
        with tempfile.TemporaryDirectory() as folder:
            watch = Watch(campaign(Path(folder) / "campaign", runs))
            for step in range(4):
                list(watch.step(float(step)))
            changes(watch, 1)
            columns = zip(*changes(watch, words.times), strict=True)
            cells = [f"{statistics.median(column):.2f} ({max(column):.2f})" for column in columns]
            began, looks = time.process_time(), 200
            for step in range(looks):
                list(watch.step(2e6 + 0.5 * step))
            idle = 100 * (time.process_time() - began) / (0.5 * looks)
        lines.append(f"| {runs} | {' | '.join(cells)} | {idle:.2f} |")
        print(lines[-1], flush=True)
    with tempfile.TemporaryDirectory() as folder:
        watch = Watch(campaign(Path(folder) / "campaign", 20))
        for step in range(4):
            list(watch.step(float(step)))
        parts = 4
        grown = []
        for _ in range(parts if words.events else 0):
            changes(watch, words.events // parts)
            grown.append(f"{memory_mb():.0f}")
    lines += ["", f"Memory after each quarter of {words.events} events: {', '.join(grown)} MB."]
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
