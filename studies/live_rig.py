"""A re-enacted rig that makes one push after the other, and the watch that looks at its files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import yaml
from paper import disturbed_logs

from rftfit.bench.events import Event
from rftfit.bench.watch import Watch
from rftfit.campaign.config import Config
from rftfit.lab.enact import prepare
from rftfit.lab.write import sheet_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from paper import Sizes

    from rftfit.forces.planning import Target
    from rftfit.lab.plan import PlannedRun

CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"
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
