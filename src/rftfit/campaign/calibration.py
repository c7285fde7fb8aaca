"""Reads the calibration matrix of a transducer, which makes forces and torques of the readings of its gauges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from rftfit.campaign.config import ForceQuantity
from rftfit.campaign.rows import Schema, read_sheets
from rftfit.errors import InputError
from rftfit.table.numbers import number_of
from rftfit.table.units import FORCE_TO_N, TORQUE_TO_N_M

_LOADS = tuple(name for name in get_args(ForceQuantity) if name[0] in "FT")
_UNITS = {"F": FORCE_TO_N, "T": TORQUE_TO_N_M}
_SCHEMA = Schema("calibration", (), file="calibration")


@dataclass(frozen=True)
class Calibration:
    """Loads (forces and torques) as weighted sums of gauges.

    `gauges`: Columns of the log. `loads`: Quantity, its unit, and the factor of each gauge.
    """

    gauges: tuple[str, ...]
    loads: tuple[tuple[str, str, tuple[float, ...]], ...]


def read_calibration(path: Path) -> Calibration:
    """Read a csv of the columns ``load``, ``unit``, and one for each gauge; raises InputError with all problems."""
    _, lines = next(read_sheets(path, _SCHEMA))
    header, *rows = [cells for _, cells in lines] or [[]]
    gauges = tuple(header[2:])
    if header[:2] != ["load", "unit"] or not gauges or len(set(gauges)) < len(gauges):
        raise InputError(
            f"row 1: found {', '.join(header) or 'nothing'}; allowed: load, unit, and the name of each "
            "gauge once"
        )
    loads: list[tuple[str, str, tuple[float, ...]]] = []
    problems: list[str] = []
    for number, row in enumerate(rows, start=2):
        name, unit, *cells = [*row, "", ""][: max(len(row), 2)]
        if name not in _LOADS or name in (load for load, _, _ in loads):
            problems.append(
                f"row {number}: found {name!r}; allowed: each of {', '.join(_LOADS)} once"
            )
            continue
        if unit not in _UNITS[name[0]]:
            allowed = ", ".join(_UNITS[name[0]])
            problems.append(f"row {number}, unit: found {unit!r}; allowed: {allowed}")
        values = tuple(map(number_of, cells))
        if len(values) != len(gauges) or not all(map(math.isfinite, values)):
            problems.append(
                f"row {number}: found {', '.join(cells) or 'nothing'}; allowed: {len(gauges)} numbers"
            )
        loads.append((name, unit, values))
    absent = [name for name in ("F1", "F2", "F3") if name not in (load for load, _, _ in loads)]
    if absent and not problems:
        problems.append(
            f"no row for {', '.join(absent)}: each of F1, F2 and F3 has one, a channel that nothing measures its unit and zeros"
        )
    if problems:
        raise InputError("; ".join(problems))
    return Calibration(gauges, tuple(loads))
