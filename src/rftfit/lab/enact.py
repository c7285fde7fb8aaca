"""Re-enact the campaign: write every log and the run sheet."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rftfit import __version__
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


@dataclass(frozen=True)
class Summary:
    """What was written: rows of the run sheet; files and bytes of logs, sheet and the robot's tracks."""

    n_runs: int
    n_files: int
    bytes: int
    seconds: float
    faults: tuple[Fault, ...] = ()


def reenact(
    config: Config,
    raw: Path,
    sheet: Path,
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
) -> Summary:
    """Write the logs that the paper's lab would have recorded, their run sheet, and what says so.

    The granular force in them is the published measurement: Table S5 times depth times area for plates,
    Figs. S5 and S12 for legs, Fig. S11 for sand penetration. The same seed gives the same bytes, run by
    run, whatever `media` and order.

    `directions`: (beta, gamma) of the plates, deg; default: of the paper. `spread`: Standard deviation of
    alpha from one prepared bed to the next, N/cm^3; without it Table S5 comes back as it is. `faults`,
    `disturb`: As on the command line.
    """
    began = time.perf_counter()
    raw, chosen = raw.resolve(), media_of(config, media)
    sizes = sizes_of(disturb)
    runs = planned(config, media, directions, protocol, tare=tare, legs=legs)
    found = resolve(faults, {run.run_id: run for run in runs}, chosen[0] if chosen else "")
    damaged = {run.run_id: tuple(f.name for f in found if f.changed == run.run_id) for run in runs}
    logs = [
        raw / name for run in runs for name in (run.force_log, run.motion_log, run.zero_log) if name
    ]
    robot = config.robot
    tracks = track_files(config, seed) if robot is not None and robot.medium in chosen else {}
    logs += [raw / name for name in tracks]
    facts = {
        "media": ", ".join(chosen), "faults": ", ".join(faults) or "none",
        "grid": ",".join(f"{beta:g}:{gamma:g}" for beta, gamma in directions or ()),
        "protocol": "" if protocol == PAPER else protocol,
        "dialect": "" if (dialect := dialect_of(config)) == "rig" else dialect,
        "tare": "" if tare else "none", "legs": "" if legs else "none",
        "run-to-run spread": f"{spread:g} N/cm^3" if spread else "", "disturbed": described(sizes),
    }  # fmt: skip
    made_by = ", ".join(f"{name}: {fact}" for name, fact in facts.items() if fact)
    made_by = f"rftfit {__version__}, rftfit reenact, seed {seed}, {made_by}"
    write_marker(raw, [*logs, sheet], made_by, complete=False)
    n_files = n_bytes = 0
    for run in runs:
        written = run_logs(run, config, seed, damaged[run.run_id], spread, protocol, sizes)
        for name, content in written.items():
            if content is None:
                remove(raw / name)
                continue
            write_bytes(raw / name, content)
            n_files, n_bytes = n_files + 1, n_bytes + len(content)
    for name, text in tracks.items():
        write_text(raw / name, text)
        n_files, n_bytes = n_files + 1, n_bytes + len(text.encode())
    tares = {fault.run_id: fault.other_tare for fault in found if fault.other_tare}
    text = sheet_text(runs, tares, described(sizes))
    # last, so that a sheet never names logs that were not written
    write_text(sheet, text)
    write_marker(raw, [*logs, sheet], made_by, complete=True)
    n_runs, n_bytes = sum(run.cycles for run in runs), n_bytes + len(text.encode())
    return Summary(n_runs, n_files + 1, n_bytes, time.perf_counter() - began, tuple(found))


def planned(
    config: Config,
    media: Sequence[str] | None,
    directions: Sequence[tuple[float, float]] | None,
    protocol: str,
    *,
    tare: bool,
    legs: bool,
) -> list[Run]:
    """Runs with their files; what the config would not read is refused."""
    there = {"plate": True, "rod": tare, "leg": legs, "leg_air": tare and legs}
    runs = [run for run in plan_runs(config, media, directions) if there[run.kind]]
    if not tare:
        runs = [replace(run, tare_run="", tare_shared=False) for run in runs]
    check_protocol(protocol, config, runs)
    suffix = WRITERS[dialect_of(config)].suffix
    return [replace(run, suffix=suffix) for run in with_files(runs, protocol)]


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
        recording = damage_recording(faults, recording, config)
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
