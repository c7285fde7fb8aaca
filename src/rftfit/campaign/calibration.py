"""Reads the calibration matrix of a transducer, which makes forces and torques of the readings of its gauges.

The file is a csv of the columns ``load`` (F1 to T3), ``unit``, and one for each gauge by its name in the log. A row is
a load: the sum of reading x factor over the gauges, in the unit of the row.
"""

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
"""Forces F1 to F3 and torques T1 to T3."""
_UNITS = {"F": FORCE_TO_N, "T": TORQUE_TO_N_M}
"""First letter of a load, to the units that it can have."""
_SCHEMA = Schema("calibration", (), file="calibration")


@dataclass(frozen=True)
class Calibration:
    """Loads (forces and torques) as weighted sums of gauges.

    `gauges`: Names of their columns in the log. `loads`: For each load its name (F1 to T3), its unit, and a factor for
    each gauge, in the order of `gauges`: unit of the load over unit of the reading.
    """

    gauges: tuple[str, ...]
    loads: tuple[tuple[str, str, tuple[float, ...]], ...]


def read_calibration(path: Path) -> Calibration:
    """Read the table of a calibration, each load at most once; raises InputError with all problems."""
    _, lines = next(read_sheets(path, _SCHEMA))
    (header_row, header), *rows = lines or [(1, [])]
    gauges = tuple(header[2:])
    if header[:2] != ["load", "unit"] or not gauges or len(set(gauges)) < len(gauges):
        raise InputError(
            f"row {header_row}: found {', '.join(header) or 'nothing'}; allowed: load, unit, and the name of each "
            "gauge once"
        )
    loads: dict[str, tuple[str, tuple[float, ...]]] = {}
    problems: list[str] = []
    for row, cells in rows:
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
    # all three forces are needed to turn them into the lab frame
    absent = [load for load in ("F1", "F2", "F3") if load not in loads]
    if absent and not problems:
        problems.append(
            f"no row for {', '.join(absent)}: each of F1, F2 and F3 has one, a channel that nothing measures its unit and zeros"
        )
    if problems:
        raise InputError("; ".join(problems))
    return Calibration(gauges, tuple((load, *loads[load]) for load in loads))
