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
"""First letter of a load, to its units."""
_SCHEMA = Schema("calibration", (), file="calibration")


@dataclass(frozen=True)
class Calibration:
    """Loads (forces and torques) as weighted sums of gauges.

    `gauges`: Columns of the log. `loads`: Name (F1 to T3), unit, and the factor of each gauge, of each load.
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
    loads: dict[str, tuple[str, tuple[float, ...]]] = {}
    problems: list[str] = []
    for row, cells in enumerate(rows, start=2):
        load, unit, *factor_cells = cells + [""] * (2 - len(cells))
        if load not in _LOADS or load in loads:
            problems.append(f"row {row}: found {load!r}; allowed: each of {', '.join(_LOADS)} once")
            continue
        units = _UNITS[load[0]]
        if unit not in units:
            problems.append(f"row {row}, unit: found {unit!r}; allowed: {', '.join(units)}")
        factors = tuple(map(number_of, factor_cells))
        if len(factors) != len(gauges) or not all(map(math.isfinite, factors)):
            cells_found = ", ".join(factor_cells) or "nothing"
            problems.append(f"row {row}: found {cells_found}; allowed: {len(gauges)} numbers")
        loads[load] = unit, factors
    absent = [load for load in ("F1", "F2", "F3") if load not in loads]
    if absent and not problems:
        problems.append(
            f"no row for {', '.join(absent)}: each of F1, F2 and F3 has one, a channel that nothing measures its unit and zeros"
        )
    if problems:
        raise InputError("; ".join(problems))
    return Calibration(gauges, tuple((load, *loads[load]) for load in loads))
