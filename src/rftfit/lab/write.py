"""Columns, units and decimals of re-enacted logs, from recordings; the text of their run sheet, from planned runs.

A log is a list of `LogColumn` and some lines for its head, from which `rftfit.lab.dialects` makes the bytes of a file.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from rftfit.campaign.columns import COLUMNS, LABELS, OF_SOURCES
from rftfit.lab.plan import FloatArray, PlannedRun
from rftfit.lab.rig import Recording

_FORCE_UNITS = {"N": (1.0, 5), "mN": (1e-3, 2), "kN": (1e3, 8), "lbf": (4.4482216152605, 5)}
_LENGTH_UNITS = {"mm": (1.0, 2), "cm": (10.0, 3), "m": (1000.0, 5), "in": (25.4, 4)}
"""Size of each unit in newtons or millimetres, and the number of decimals that are written."""

SHEET_COLUMNS = tuple(column.name for column in COLUMNS)
"""All columns of a run sheet, in the order in which the program reads them."""


def format_numbers(columns: list[FloatArray], decimals: list[int]) -> str:
    """Format columns, shape (n,) each, as n lines of comma-separated numbers; zero has no minus sign.

    `decimals`: Number of decimals of each column.
    """
    # + 0.0 turns -0.0, which rounding may make, into 0.0
    pairs = zip(columns, decimals, strict=True)
    table = np.column_stack([np.round(*pair) for pair in pairs]) + 0.0
    row = ",".join(f"%.{places}f" for places in decimals) + "\n"
    # one formatting of the whole table is several times faster than one for each row
    return (row * len(table)) % tuple(table.ravel().tolist())


class LogColumn(NamedTuple):
    """One column of a log: its quantity and unit, values, and number of decimals that are written."""

    name: str
    unit: str
    values: FloatArray
    decimals: int


def force_log_columns(recording: Recording, unit: str) -> list[LogColumn]:
    """Make the columns of a force log in a `unit`: N, mN, kN or lbf: time, the sync line arm_moving, F1 to F3."""
    size, places = _FORCE_UNITS[unit]
    channels = enumerate(recording.channels_N.T / size, start=1)
    return [
        LogColumn("time", "s", recording.force_time_s, 3),
        LogColumn("arm_moving", "", recording.arm_moving.astype(float), 0),
        *(LogColumn(f"F{number}", unit, force, places) for number, force in channels),
    ]


def motion_columns(recording: Recording, unit: str) -> list[LogColumn]:
    """Make the columns of a motion log in a `unit`: mm, cm, m or in: time, x, z, angle."""
    size, places = _LENGTH_UNITS[unit]
    return [
        LogColumn("time", "s", recording.motion_time_s, 3),
        LogColumn("x", unit, recording.x_mm / size, places),
        LogColumn("z", unit, recording.z_mm / size, places),
        LogColumn("angle", "deg", recording.angle_deg, 2),
    ]


def log_header(run: PlannedRun, kind: str, rate: str) -> list[str]:
    """Make the two lines at the head of a log that describe it.

    `kind`: ``force log``, ``motion log`` or ``log`` (both in one). `rate`: Samples per second, and clock.
    """
    return [f"{kind} of run {run.run_id}, re-enacted from published measurements", rate]


def _format_number(value: float | None) -> str:
    """Format a number without trailing zeros; empty for None."""
    return "" if value is None else f"{value:.4f}".rstrip("0").rstrip(".")


def sheet_text(runs: Iterable[PlannedRun], tares: Mapping[str, str]) -> str:
    """Make the text of the run sheet (csv): a row for each stroke of each run, in the given order.

    `tares`: Wrong tare_run to be written, by run_id.
    """
    buffer = io.StringIO()
    runs = list(runs)
    used = {"zero_log": any(run.zero_log for run in runs)}
    used["stroke"] = any(run.cycles > 1 for run in runs)
    used |= dict.fromkeys((*LABELS, *OF_SOURCES), False)
    columns = [name for name in SHEET_COLUMNS if used.get(name, True)]
    sheet = csv.DictWriter(buffer, columns, lineterminator="\n")
    sheet.writeheader()
    for run in runs:
        row = {name: getattr(run, name, "") for name in columns}
        row |= {
            name: _format_number(getattr(run, name))
            for name in ("beta_deg", "gamma_deg", "depth_cm")
        }
        row["tare_run"] = tares.get(run.run_id, run.tare_run)
        row["tare_shared"] = "yes" if run.tare_shared else ""
        if used["stroke"]:
            row["stroke"] = 1
        sheet.writerow(row)
        for cycle in range(2, run.cycles + 1):
            ids_of_cycle = {
                key: f"{row[key]}_{cycle}" for key in ("run_id", "tare_run") if row[key]
            }
            sheet.writerow(row | ids_of_cycle | {"stroke": cycle})
    return buffer.getvalue()
