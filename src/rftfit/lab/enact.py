"""Re-enact the campaign: write every log and the run sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rftfit.campaign.config import Config
from rftfit.lab.dialects import WRITERS, dialect_of
from rftfit.lab.disturb import NOTHING, Sizes, described, sizes_of
from rftfit.lab.marker import remove, write_marker
from rftfit.lab.plan import Run, media_of, plan_runs
from rftfit.lab.protocols import PAPER, as_recorded, check_protocol, in_one_log, with_files
from rftfit.lab.rig import Fault, damage_bytes, damage_recording, record, resolve
from rftfit.lab.tracks import track_files
from rftfit.lab.write import force_columns, head_of, motion_columns, sheet_text
from rftfit.store import write_bytes, write_text
from rftfit.version import __version__


@dataclass(frozen=True)
class Reenactment:
    """Logs that are to be written, all words of the user understood.

    `media`: In the order of the config. `made_by`: Version and options, for the marker.
    """

    config: Config
    seed: int
    media: tuple[str, ...]
    runs: tuple[Run, ...]
    faults: tuple[Fault, ...]
    spread: float
    sizes: Sizes
    protocol: str
    made_by: str

    def write(self, raw: Path, sheet: Path) -> list[int]:
        """Write logs, run sheet and marker; return the bytes of each file but the marker."""
        raw, config = raw.resolve(), self.config
        paths = [
            name for run in self.runs for name in (run.force_log, run.motion_log, run.zero_log)
        ]
        robot = config.robot
        tracks = track_files(config, self.seed) if robot and robot.medium in self.media else {}
        files = [*(raw / name for name in (*paths, *tracks) if name), sheet]
        write_marker(raw, files, self.made_by, complete=False)
        n_bytes = []
        for run in self.runs:
            faults = tuple(fault.name for fault in self.faults if fault.changed == run.run_id)
            written = run_logs(
                run, config, self.seed, faults, self.spread, self.protocol, self.sizes
            )
            for name, content in written.items():
                if content is None:
                    remove(raw / name)
                    continue
                write_bytes(raw / name, content)
                n_bytes.append(len(content))
        # last, so that a sheet never names logs that were not written
        tares = {fault.run_id: fault.other_tare for fault in self.faults if fault.other_tare}
        texts = {raw / name: text for name, text in tracks.items()}
        texts[sheet] = sheet_text(self.runs, tares, described(self.sizes))
        for path, text in texts.items():
            write_text(path, text)
            n_bytes.append(len(text.encode()))
        write_marker(raw, files, self.made_by, complete=True)
        return n_bytes


def prepare(
    config: Config,
    *,
    seed: int = 2013,
    media: Sequence[str] | None = None,
    directions: Sequence[tuple[float, float]] | None = None,
    faults: Sequence[str] = (),
    spread: float = 0.0,
    disturb: Sequence[str] = (),
    protocol: str = PAPER,
    tare: bool = True,
    legs: bool = True,
) -> Reenactment:
    """Plan the logs that the paper's lab would have recorded; `Reenactment.write` writes them.

    The granular force in them is the published measurement: Table S5 times depth times area for plates,
    Figs. S5 and S12 for legs, Fig. S11 for sand penetration. The same seed gives the same bytes, run by
    run, whatever `media` and order.

    `directions`: (beta, gamma) of the plates, deg; default: of the paper. `spread`: Standard deviation of
    alpha from one prepared bed to the next, N/cm^3; without it Table S5 comes back as it is. `faults`,
    `disturb`: As on the command line.
    """
    chosen, sizes = media_of(config.media, media), sizes_of(disturb)
    there = {"plate": True, "rod": tare, "leg": legs, "leg_air": tare and legs}
    runs = [run for run in plan_runs(config, media, directions) if there[run.kind]]
    if not tare:
        runs = [replace(run, tare_run="", tare_shared=False) for run in runs]
    check_protocol(protocol, config, runs)
    suffix = WRITERS[dialect := dialect_of(config)].suffix
    runs = [replace(run, suffix=suffix) for run in with_files(runs, protocol)]
    found = resolve(faults, {run.run_id: run for run in runs}, chosen[0] if chosen else "")
    facts = {
        "media": ", ".join(chosen), "faults": ", ".join(faults) or "none",
        "grid": ",".join(f"{beta:g}:{gamma:g}" for beta, gamma in directions or ()),
        "protocol": "" if protocol == PAPER else protocol,
        "dialect": "" if dialect == "rig" else dialect,
        "tare": "" if tare else "none", "legs": "" if legs else "none",
        "run-to-run spread": f"{spread:g} N/cm^3" if spread else "", "disturbed": described(sizes),
    }  # fmt: skip
    made_by = ", ".join(f"{name}: {fact}" for name, fact in facts.items() if fact)
    made_by = f"rftfit {__version__}, rftfit reenact, seed {seed}, {made_by}"
    return Reenactment(
        config, seed, tuple(chosen), tuple(runs), tuple(found), spread, sizes, protocol, made_by
    )


def reenact(config: Config, raw: Path, sheet: Path, **options: Any) -> list[int]:
    """Prepare and write a re-enactment: `options` of `prepare`."""
    return prepare(config, **options).write(raw, sheet)


def run_logs(
    run: Run,
    config: Config,
    seed: int,
    faults: tuple[str, ...] = (),
    spread: float = 0.0,
    protocol: str = PAPER,
    sizes: Sizes = NOTHING,
) -> dict[str, bytes | None]:
    """Make the logs of a run: content by path relative to raw, None where a fault takes it away."""
    raised, pause = "never_touches" in faults, protocol != "no-pause"
    recorded = [
        as_recorded(record(run, config, seed, raised, spread, pause, cycle, sizes), protocol)
        for cycle in range(run.cycles)
    ]
    recording, unloaded = recorded[0]
    if run.cycles > 1:
        recording = in_one_log([one for one, _ in recorded])
    if faults:
        recording = damage_recording(faults, recording, config.transducer)
    unit, length = config.transducer.force_unit, config.arm.position_unit
    if "wrong_unit" in faults:
        unit = "N" if unit == "lbf" else "lbf"
    dialect = dialect_of(config)
    written = WRITERS[dialect].content
    forces, motions = force_columns(recording, unit), motion_columns(recording, length)
    head = head_of(run, "force log", "100 samples/s, clock of the force logger: s since midnight")
    logs: dict[str, bytes | None] = {}
    if run.one_file:
        head = head_of(run, "log", "100 samples/s: s since midnight")
        forces += [] if protocol == "constant-speed" else motions[1:]
    else:
        what = "50 samples/s, clock of the arm controller: s since midnight"
        logs[run.motion_log] = written(motions, head_of(run, "motion log", what))
    if unloaded:
        logs[run.zero_log] = written(force_columns(unloaded, unit), head)
    logs[run.force_log] = damage_bytes(faults, written(forces, head), dialect)
    return logs | ({run.motion_log: None} if "missing_tare" in faults else {})
