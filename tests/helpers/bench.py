"""A campaign that grows, and a watch that looks at it in a time of its own."""

from __future__ import annotations

import csv
import io

from rftfit.bench.watch import Watch

DIRECTIONS = ((0.0, 90.0), (30.0, 45.0), (-30.0, 45.0), (60.0, 90.0), (30.0, -45.0), (0.0, 0.0))
MEDIUM = "poppy_LP"


class Bench:
    """Rows and logs of `recorded` are put into `root`; `rows` are those of the run sheet, by run_id."""

    def __init__(self, root, recorded):
        self.root, self.config, self.recorded = root, root / "config" / "config.yaml", recorded
        text = (recorded / "raw" / "paper" / "runs.csv").read_text(encoding="utf-8")
        self.every = {row["run_id"]: row for row in csv.DictReader(io.StringIO(text))}
        self.rows = {}
        self.raw, self.time = root / "raw" / "paper", 0.0
        self.sheet = self.raw / "runs.csv"

    @property
    def plates(self):
        return [name for name, row in self.every.items() if row["kind"] == "plate"]

    def write_sheet(self):
        buffer = io.StringIO()
        sheet = csv.DictWriter(buffer, [*next(iter(self.every.values()))], lineterminator="\n")
        sheet.writeheader()
        sheet.writerows(self.rows.values())
        self.sheet.write_text(buffer.getvalue(), encoding="utf-8")

    def logs(self, name):
        return [self.every[name][f"{kind}_log"] for kind in ("force", "motion")]

    def content(self, log):
        return (self.recorded / "raw" / "paper" / log).read_bytes()

    def put(self, log, content=None):
        path = self.raw / log
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(self.content(log) if content is None else content)

    def push(self, *names, tare=True):
        """Record runs whole: their rows, their logs, and those of their tares."""
        for name in names:
            for run_id in [self.every[name]["tare_run"]] * tare + [name]:
                self.rows[run_id] = dict(self.every[run_id])
                for log in self.logs(run_id):
                    self.put(log)
        self.write_sheet()

    def watch(self):
        self.write_sheet()
        return Watch(self.config)

    def collect_events(self, watch, times=1):
        """Let half a second pass before each look; all events."""
        events = []
        for _ in range(times):
            self.time += 0.5
            events += watch.step(self.time)
        return events

    def settle(self, watch):
        """Look until everything is still: config and sheet, then logs that are asked every fourth time."""
        return self.collect_events(watch, 10)
