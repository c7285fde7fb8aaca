"""Units of logs to the program's own: N, cm, rad. Converted once, when a log comes in."""

from __future__ import annotations

import math

TORQUE_TO_N_M = {"N m": 1.0, "N mm": 1e-3}
FORCE_TO_N = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605}
LENGTH_TO_CM = {"um": 1e-4, "mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}
ANGLE_TO_RAD = {"deg": math.pi / 180, "rad": 1.0}
TIME_TO_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}


def factor(table: dict[str, float], found: str, declared: str, what: str) -> float:
    """Return the factor to the program's own unit, if log and config agree on the unit.

    Parameters
    ----------
    table : dict of str to float
        Unit to factor.
    found, declared : str
        Unit in the log's header, and in the config.
    what : str
        The quantity, for the message.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If they differ or the unit is unknown; the message says both.
    """
    if found != declared:
        raise ValueError(f"{what} in {found or 'no unit'}, but the config says {declared}")
    if found not in table:
        raise ValueError(f"{what} in {found}; allowed: {', '.join(table)}")
    return table[found]
