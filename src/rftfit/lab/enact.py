"""Re-enact the campaign: write every log and the run sheet."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.lab.faults import Fault, resolve
from rftfit.lab.plan import media_of, plan_runs
from rftfit.lab.tracks import write_tracks
from rftfit.lab.worker import Job, write_all
from rftfit.lab.write import sheet_text
from rftfit.store import write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.campaign.config import Config


@dataclass(frozen=True)
class Summary:
    """What was written.

    Attributes
    ----------
    n_runs : int
        Rows of the run sheet.
    n_files : int
        Logs, the run sheet, and the robot's tracks with theirs.
    bytes : int
        Size of these files together.
    seconds : float
        Time that planning and writing took.
    faults : tuple of Fault
        Those put in, in the order asked for.
    """

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
    faults: Sequence[str] = (),
    workers: int = 2,
    spread: float = 0.0,
) -> Summary:
    """Write the logs that the paper's lab would have recorded, and their run sheet.

    The granular force in them is the published measurement: Table S5 times depth times area for
    plates, Figs. S5 and S12 for legs, Fig. S11 for sand penetration.

    Parameters
    ----------
    config : Config
        Read for transducer, arm, container, intruders, media and horizontal depths.
    raw : Path
        Folder of the logs: ``<raw>/<medium>/<run_id>_force.csv`` and ``_motion.csv``.
    sheet : Path
        The run sheet, csv; its log paths are relative to `raw`.
    seed : int
        The same seed gives the same bytes, run by run, whatever `media`, `workers` and order.
    media : sequence of str, optional
        Only these media of the config (and the legs in air).
    faults : sequence of str
        ``NAME`` or ``NAME:run_id``, names from `FAULTS`.
    workers : int
        Processes that write at once.
    spread : float
        Standard deviation of alpha from one prepared bed to the next, N/cm^3. By default every bed
        is the same, so that Table S5 comes back as it is.

    Returns
    -------
    Summary

    Raises
    ------
    InputError
        If a medium, fault or run is unknown, or plate and container leave no room for the paths.
    OutputError
        If a file cannot be written.
    """
    began = time.perf_counter()
    raw, chosen = Path(raw).resolve(), media_of(config, media)
    runs = plan_runs(config, media)
    found = resolve(faults, {run.run_id: run for run in runs}, chosen[0] if chosen else "")
    damaged = {run.run_id: tuple(f.name for f in found if f.changed == run.run_id) for run in runs}
    job = Job(config, raw, seed, tuple((run, damaged[run.run_id]) for run in runs), spread)
    n_files, n_bytes = write_all(job, workers)
    if config.robot is not None and config.robot.medium in chosen:
        tracks = write_tracks(config, raw, seed)
        n_files += len(tracks)
        n_bytes += sum(path.stat().st_size for path in tracks)
    tares = {fault.run_id: fault.other_tare for fault in found if fault.other_tare}
    text = sheet_text(runs, tares)
    # last, so that a sheet never names logs that were not written
    write_text(sheet, text)
    seconds = time.perf_counter() - began
    return Summary(len(runs), n_files + 1, n_bytes + len(text.encode()), seconds, tuple(found))
