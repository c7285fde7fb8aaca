"""Recordings as the text of log files, and the run sheet."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rftfit.lab.plan import FloatArray, Run
    from rftfit.lab.rig import Recording


NEWTONS = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605}
_FORCE_DECIMALS = {"N": 5, "mN": 2, "kN": 8, "lbf": 5}
_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
_LENGTH_DECIMALS = {"mm": 2, "cm": 3, "m": 5, "in": 4}

SHEET_COLUMNS = (
    "run_id", "kind", "medium", "intruder", "direction", "beta_deg", "gamma_deg", "depth_cm",
    "force_log", "motion_log", "tare_run", "tare_shared", "surface_z_mm", "excluded", "reason", "note",
    "zero_log",
)  # fmt: skip


def fixed(columns: list[FloatArray], decimals: list[int]) -> str:
    """Format columns of equal length as lines of comma-separated numbers, never minus zero.

    `decimals`: One for each column.
    """
    # + 0.0 turns the -0.0 that rounding makes into 0.0
    table = np.column_stack(
        [np.round(column, places) + 0.0 for column, places in zip(columns, decimals, strict=True)]
    )
    row = ",".join(f"%.{places}f" for places in decimals) + "\n"
    # one formatting of the whole table is several times faster than one for each row
    return (row * len(table)) % tuple(table.ravel().tolist())


def force_text(run: Run, recording: Recording, unit: str) -> str:
    """Text of a force log in N, mN, kN or lbf, as its header says."""
    head = (
        f"# force log of run {run.run_id}, re-enacted from published measurements\n"
        f"# 100 samples/s, clock of the force logger: s since midnight\n"
        f"time_s,arm_moving,F1_{unit},F2_{unit},F3_{unit}\n"
    )
    forces = recording.channels_N / NEWTONS[unit]
    columns = [recording.force_time_s, recording.arm_moving.astype(float), *forces.T]
    return head + fixed(columns, [3, 0, *[_FORCE_DECIMALS[unit]] * 3])


def one_text(run: Run, recording: Recording, unit: str, length: str) -> str:
    """Text of a log that holds force and motion."""
    head = (
        f"# log of run {run.run_id}, re-enacted from published measurements\n"
        f"# 100 samples/s: s since midnight\n"
        f"time_s,arm_moving,F1_{unit},F2_{unit},F3_{unit},x_{length},z_{length},angle_deg\n"
    )
    x, z = recording.x_mm / _MILLIMETRES[length], recording.z_mm / _MILLIMETRES[length]
    columns = [
        recording.force_time_s, recording.arm_moving.astype(float),
        *(recording.channels_N / NEWTONS[unit]).T, x, z, recording.angle_deg,
    ]  # fmt: skip
    places = _LENGTH_DECIMALS[length]
    return head + fixed(columns, [3, 0, *[_FORCE_DECIMALS[unit]] * 3, places, places, 2])


def motion_text(run: Run, recording: Recording, unit: str) -> str:
    """Text of a motion log in mm, cm, m or in."""
    head = (
        f"# motion log of run {run.run_id}, re-enacted from published measurements\n"
        f"# 50 samples/s, clock of the arm controller: s since midnight\n"
        f"time_s,x_{unit},z_{unit},angle_deg\n"
    )
    x, z = recording.x_mm / _MILLIMETRES[unit], recording.z_mm / _MILLIMETRES[unit]
    places = _LENGTH_DECIMALS[unit]
    columns = [recording.motion_time_s, x, z, recording.angle_deg]
    return head + fixed(columns, [3, places, places, 2])


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}".rstrip("0").rstrip(".")


def sheet_text(runs: Iterable[Run], tares: Mapping[str, str]) -> str:
    """Text of the run sheet (csv), one row for each run in the given order.

    `tares`: run_id to the tare_run to be written instead of the run's own.
    """
    buffer = io.StringIO()
    runs = list(runs)
    zeros = any(run.zero_log for run in runs)
    columns = [name for name in SHEET_COLUMNS if zeros or name != "zero_log"]
    sheet = csv.DictWriter(buffer, columns, lineterminator="\n")
    sheet.writeheader()
    for run in runs:
        row = {name: getattr(run, name, "") for name in columns}
        row |= {name: _number(getattr(run, name)) for name in ("beta_deg", "gamma_deg", "depth_cm")}
        row["tare_run"] = tares.get(run.run_id, run.tare_run)
        row["tare_shared"] = "yes" if run.tare_shared else ""
        sheet.writerow(row)
    return buffer.getvalue()
