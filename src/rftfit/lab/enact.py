"""Re-enact the campaign: plan it, and write every log, the tracks of the robot and the run sheet.

`prepare` plans a campaign as a `Reenactment`, which writes it at once (`write`) or run by run as a rig does (`live`).
`run_logs` makes the files of one run: record, damage by faults, encode in a dialect (the format of a program).

The folder ``raw`` holds the logs; the marker in it lists all files that were re-enacted.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rftfit.campaign.config import Config
from rftfit.campaign.files import read_text
from rftfit.lab.dialects import WRITERS, dialect_of
from rftfit.lab.marker import remove, write_marker
from rftfit.lab.plan import PlannedRun, media_of, plan_runs
from rftfit.lab.protocols import PAPER, as_recorded, check_protocol, in_one_log, with_files
from rftfit.lab.rig import (
    AS_PUBLISHED,
    Fault,
    Lab,
    LabStroke,
    Recording,
    damage_bytes,
    damage_recording,
    record,
    resolve,
)
from rftfit.lab.tracks import plan_trials, track_files
from rftfit.lab.write import force_log_columns, log_header, motion_columns, sheet_text
from rftfit.store import open_growing, write_bytes, write_text
from rftfit.store.links import refuse_links, refuse_target_by_link
from rftfit.version import __version__


@dataclass(frozen=True)
class Reenactment:
    """A planned campaign, whose logs are still to be written.

    `seed`: Of all random numbers.
    `media`: Media in the order of the config.
    `runs`: All runs. `faults`: Faults in some of them.
    `protocol`: Way of recording, see `PROTOCOLS`.
    `lab`: Lab whose forces and noise the logs have.
    `made_by`: Version and options, for the marker file.
    """

    config: Config
    seed: int
    media: tuple[str, ...]
    runs: tuple[PlannedRun, ...]
    faults: tuple[Fault, ...]
    protocol: str
    lab: Lab
    made_by: str

    @property
    def trials(self) -> int:
        """Number of trials of the robot, whose tracks are written too; 0 without a robot in these media."""
        robot = self.config.robot
        has_robot = robot is not None and robot.medium in self.media
        return len(plan_trials(self.config, self.seed)) if has_robot else 0

    def write(self, raw: Path, sheet: Path) -> list[int]:
        """Write logs, tracks, run sheet and marker; return the number of bytes of each file except the marker.

        The marker is written first, without sizes, so that a broken-off re-enactment is known as one. `raw`: Folder of
        the logs. `sheet`: Path of the run sheet.
        """
        raw = raw.resolve()
        tracks = self._tracks()
        files = self._list_files(raw, sheet, tracks)
        write_marker(raw, files, self.made_by, complete=False)
        n_bytes = []
        for run in self.runs:
            for name, content in self.logs(run).items():
                if content is None:
                    remove(raw / name)
                    continue
                write_bytes(raw / name, content)
                n_bytes.append(len(content))
        # sheets are written last, so that they never name logs that were not written
        texts = {raw / name: text for name, text in tracks.items()}
        texts[sheet] = self.sheet(self.runs)
        for path, text in texts.items():
            write_text(path, text)
            n_bytes.append(len(text.encode()))
        write_marker(raw, files, self.made_by, complete=True)
        return n_bytes

    def _tracks(self) -> dict[str, str]:
        """Make the texts of the robot's tracks and of their sheet, by path relative to raw; empty without a robot."""
        return track_files(self.config, self.seed) if self.trials else {}

    def _list_files(self, raw: Path, sheet: Path, tracks: Iterable[str]) -> list[Path]:
        """List all files of the campaign; `tracks`: paths relative to raw."""
        logs = set[str]().union(*(run.logs for run in self.runs))
        return [*(raw / name for name in (*logs, *tracks)), sheet]

    def logs(self, run: PlannedRun, *extra_faults: str) -> dict[str, bytes | None]:
        """Make the logs of a run (see `run_logs`), with its planned faults and `extra_faults` (names in `FAULTS`)."""
        faults = (
            *(fault.name for fault in self.faults if fault.changed == run.run_id),
            *extra_faults,
        )
        return run_logs(run, self.config, self.seed, faults, self.protocol, self.lab)

    def sheet(self, runs: Iterable[PlannedRun]) -> str:
        """Make the text of the run sheet with some runs; a planned fault may have put a wrong tare into it."""
        tares = {fault.run_id: fault.other_tare for fault in self.faults if fault.other_tare}
        return sheet_text(runs, tares)

    def live(self, raw: Path, sheet: Path, pace_s: float, bad_share: float) -> Iterator[str]:
        """Write the campaign run by run, as a rig does: first the row of a run, then its logs, which grow in parts.

        Yields a sentence for each run.

        `pace_s`: Time for each run, s; the logs grow for half of it.
        `bad_share`: Share of the plate runs that get a fault at random.
        """
        random, raw = np.random.default_rng(self.seed), raw.resolve()
        # a tare gets no fault, as it would spoil many runs
        tares = {run.tare_run for run in self.runs}
        # a tare is recorded before the first run that names it
        has_tare = "plate", "leg"
        order = sorted(
            self.runs, key=lambda run: (run.tare_run or run.run_id, run.kind in has_tare)
        )
        tracks = self._tracks()
        files = self._list_files(raw, sheet, tracks)
        write_marker(raw, files, self.made_by, complete=False)
        for name, text in tracks.items():
            write_text(raw / name, text)
        for n_written, run in enumerate(order, start=1):
            is_bad = run.run_id not in tares and random.random() < bad_share
            fault = (str(random.choice(_LIVE_FAULTS)),) if is_bad and run.kind == "plate" else ()
            write_text(sheet, self.sheet(order[:n_written]))
            logs = {raw / name: log for name, log in self.logs(run, *fault).items() if log}
            with ExitStack() as stack:
                files_of_run = {path: stack.enter_context(open_growing(path)) for path in logs}
                for part in range(_PARTS):
                    for path, log in logs.items():
                        begin, end = (k * len(log) // _PARTS for k in (part, part + 1))
                        files_of_run[path].write(log[begin:end])
                    time.sleep(pace_s / 2 / _PARTS)
            yield f"{run.run_id} recorded" + (f", with the fault {fault[0]}" if fault else "")
            time.sleep(pace_s / 2)
        write_marker(raw, files, self.made_by, complete=True)


_LIVE_FAULTS = ("saturated", "gap", "nan_cells", "truncated", "never_touches")
"""Faults that `Reenactment.live` puts into runs at random."""
_PARTS = 5
"""Number of parts in which a log grows."""


def prepare(
    config: Config,
    *,
    seed: int = 2013,
    media: Sequence[str] | None = None,
    directions: Sequence[tuple[float, float]] | None = None,
    faults: Sequence[str] = (),
    protocol: str = PAPER,
    tare: bool = True,
    legs: bool = True,
    lab: Lab = AS_PUBLISHED,
) -> Reenactment:
    """Plan the logs that the paper's lab would have recorded; `Reenactment.write` writes them.

    The granular force in them is the published measurement: Table S5 times depth times area for plates,
    Figs. S5 and S12 for legs, Fig. S11 for sand penetration. The same seed gives the same bytes, run by
    run, independent of `media` and of the order of runs.

    `media`: Media to re-enact; default: all published ones of the config.
    `directions`: (beta, gamma) of the plates, deg; default: those of the config's grid, or else of the paper.
    `faults`: ``NAME`` or ``NAME:run_id``, as on the command line.
    `protocol`: Way of recording, see `PROTOCOLS`.
    `tare`, `legs`: False leaves out tare runs, or legs.
    `lab`: Lab whose forces and noise the logs have.
    """
    chosen = media_of(config.media, media)
    is_included = {"plate": True, "rod": tare, "leg": legs, "leg_air": tare and legs}
    runs = [run for run in plan_runs(config, media, directions) if is_included[run.kind]]
    if not tare:
        runs = [replace(run, tare_run="", tare_shared=False) for run in runs]
    check_protocol(protocol, config, runs)
    suffix = WRITERS[dialect := dialect_of(config)].suffix
    runs = [replace(run, suffix=suffix) for run in with_files(runs, protocol)]
    resolved_faults = resolve(
        faults, {run.run_id: run for run in runs}, chosen[0] if chosen else ""
    )
    facts = {
        "media": ", ".join(chosen),
        "faults": ", ".join(faults) or "none",
        "grid": ",".join(f"{beta:g}:{gamma:g}" for beta, gamma in directions or ()),
        "protocol": "" if protocol == PAPER else protocol,
        "dialect": "" if dialect == "rig" else dialect,
        "tare": "" if tare else "none",
        "legs": "" if legs else "none",
    }
    made_by = ", ".join(f"{name}: {fact}" for name, fact in facts.items() if fact)
    made_by = f"rftfit {__version__}, rftfit reenact, seed {seed}, {made_by}"
    return Reenactment(
        config, seed, tuple(chosen), tuple(runs), tuple(resolved_faults), protocol, lab, made_by
    )


def run_logs(
    run: PlannedRun,
    config: Config,
    seed: int,
    faults: tuple[str, ...] = (),
    protocol: str = PAPER,
    lab: Lab = AS_PUBLISHED,
) -> dict[str, bytes | None]:
    """Make the logs of a run: bytes by path relative to raw, None for a file that a fault removes.

    `faults`: Names in `FAULTS`. Some change the recording (`damage_recording`), some the bytes of the force log
    (`damage_bytes`), and ``never_touches``, ``wrong_unit`` and ``missing_tare`` are made here.
    """
    raised, pause = "never_touches" in faults, protocol != "no-pause"

    def record_cycle(cycle: int) -> tuple[Recording, Recording | None]:
        """Record one stroke of the run, and the log without load before it if the protocol has one."""
        stroke = LabStroke(run, config, seed, cycle)
        return as_recorded(record(stroke, raised, pause, lab), protocol)

    recording, unloaded = record_cycle(0)
    if run.cycles > 1:
        recording = in_one_log([recording, *(record_cycle(k)[0] for k in range(1, run.cycles))])
    if faults:
        recording = damage_recording(faults, recording, config.transducer)
    unit, length = config.transducer.force_unit, config.arm.position_unit
    if "wrong_unit" in faults:
        unit = "N" if unit == "lbf" else "lbf"
    dialect = dialect_of(config)
    encode = WRITERS[dialect].encode
    forces, motions = force_log_columns(recording, unit), motion_columns(recording, length)
    head = log_header(
        run, "force log", "100 samples/s, clock of the force logger: s since midnight"
    )
    logs: dict[str, bytes | None] = {}
    if run.one_file:
        head = log_header(run, "log", "100 samples/s: s since midnight")
        forces += [] if protocol == "constant-speed" else motions[1:]
    else:
        rate = "50 samples/s, clock of the arm controller: s since midnight"
        logs[run.motion_log] = encode(motions, log_header(run, "motion log", rate))
    if unloaded:
        logs[run.zero_log] = encode(force_log_columns(unloaded, unit), head)
    logs[run.force_log] = damage_bytes(faults, encode(forces, head), dialect)
    return logs | ({run.motion_log: None} if "missing_tare" in faults else {})


def copy_config(config: Path, live: Path) -> Path:
    """Copy the config into the folder `live`, if it has none, and return its path there.

    A campaign that is written run by run has a folder of its own.
    """
    refuse_target_by_link(live)
    refuse_links(live, ["config/config.yaml"])
    live_config = live / "config" / "config.yaml"
    if not live_config.is_file():
        write_text(live_config, read_text(config, config.as_posix(), "config", 1_000_000))
    return live_config
