"""The quantities that the chain wants of a log, and which column is probably which."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.sources import QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Log

MEANING = {
    "time": "time",
    "arm_moving": "whether the arm moves (1) or rests (0)",
    "F1": "force, sensor channel F1",
    "F2": "force, sensor channel F2",
    "F3": "force, sensor channel F3",
    "T1": "torque, sensor channel T1",
    "T2": "torque, sensor channel T2",
    "T3": "torque, sensor channel T3",
    "x": "horizontal position of the intruder, arm coordinates",
    "z": "vertical position of the intruder, arm coordinates",
    "angle": "angle of the plate (beta) or of the leg (theta)",
}
"""What each quantity is, in words."""

_FORCE_UNITS = frozenset({"N", "mN", "kN", "lbf"})
_LENGTH_UNITS = frozenset({"um", "mm", "cm", "m", "in"})
_TORQUE_UNITS = frozenset({"N m", "N mm"})
_ANGLE_UNITS = frozenset({"deg", "rad"})
_TIME_UNITS = frozenset({"s", "ms", "us", "ns", "min", "h"})
_AXES = {"x": "1", "y": "2", "z": "3"}

_AXIS = re.compile(r"(?:^|[^a-z])(?P<kind>f|t|m|force|torque|moment)[\s._-]?(?P<axis>[xyz123])$")
_WORDS = (
    ("time", re.compile(r"^(time|t|x_value|timestamp|stamp|elapsed.*|zeit|temps|tiempo|tempo)$")),
    ("arm_moving", re.compile(r"^(arm_?moving|moving|sync|sync_?line|trigger)$")),
    ("angle", re.compile(r"^(angle|theta|beta|pitch|winkel|.*[\s._]angle)$")),
    ("F3", re.compile(r"^(force|load|kraft|last|fuerza|charge|.*\b(force|load))$")),
    ("z", re.compile(r"^(z|pos(ition)?[\s._]?z|.*position\.z|z[\s._]?pos(ition)?|height|depth)$")),
    ("z", re.compile(r"^(displacement|extension|weg|crosshead|stroke|position|travel)$")),
    ("x", re.compile(r"^(x|pos(ition)?[\s._]?x|.*position\.x|x[\s._]?pos(ition)?)$")),
)
_FITS = {
    "time": _TIME_UNITS,
    "F": _FORCE_UNITS,
    "T": _TORQUE_UNITS,
    "x": _LENGTH_UNITS,
    "z": _LENGTH_UNITS,
    "angle": _ANGLE_UNITS,
}


def guess(name: str, unit: str) -> str:
    """Guess which quantity a column holds.

    Parameters
    ----------
    name : str
        Of the column, without its unit.
    unit : str
        As `unitwords.unit_word` spells it; empty where the file does not say.

    Returns
    -------
    str
        One of `QUANTITIES`, or empty.
    """
    if name in QUANTITIES:
        return name if _fits(name, unit) else ""
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).casefold().strip()
    match = _AXIS.search(plain)
    if match:
        kind = "F" if match["kind"][0] == "f" else "T"
        quantity = kind + _AXES.get(match["axis"], match["axis"])
        return quantity if _fits(quantity, unit) else ""
    for quantity, pattern in _WORDS:
        if pattern.match(plain) and _fits(quantity, unit):
            return quantity
    return ""


def _fits(quantity: str, unit: str) -> bool:
    """Whether a unit can be one of the quantity."""
    wanted = _FITS.get(quantity, _FITS.get(quantity[0]))
    return not unit or wanted is None or unit in wanted


def guesses(log: Log) -> dict[str, str]:
    """Guess the quantities of all columns of a log.

    Parameters
    ----------
    log : Log

    Returns
    -------
    dict of str to str
        Quantity to column, each quantity once: the first column that it fits. Without a name that
        says time, a column of seconds since 1970 is the time.
    """
    found: dict[str, str] = {}
    for name in log.columns:
        quantity = guess(name, log.units.get(name, ""))
        if quantity:
            found.setdefault(quantity, name)
    if "time" not in found:
        stamps = [name for name, values in log.columns.items() if _is_epoch(values)]
        if stamps:
            found["time"] = stamps[0]
    return {quantity: found[quantity] for quantity in _in_order(found)}


def _is_epoch(values: FloatArray) -> bool:
    """Whether values look like seconds since 1970, between 2001 and 2065."""
    return bool(
        values.size > 1
        and values[0] > 1e9
        and values[-1] < 3e9
        and (np.diff(values) >= 0).all()
        and values[-1] > values[0]
    )


def _in_order(quantities: Iterable[str]) -> list[str]:
    return [quantity for quantity in QUANTITIES if quantity in set(quantities)]
