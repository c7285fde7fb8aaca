"""Units and quantities as log files spell them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.config import QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Log

_SPELLINGS = {
    "N": "n newton newtons",
    "mN": "mn millinewton millinewtons",
    "kN": "kn kilonewton kilonewtons",
    "lbf": "lbf lb lbs pound pounds",
    "klbf": "klbf kip kips",
    "kgf": "kgf kp kilogram-force kilopond",
    "gf": "gf gram-force pond",
    "N m": "nm n*m n.m n-m newtonmeter newtonmeters newton-meter newton-meters",
    "N mm": "nmm n*mm n.mm n-mm",
    "mm": "mm millimeter millimeters millimetre millimetres",
    "cm": "cm centimeter centimeters centimetre centimetres",
    "m": "m meter meters metre metres",
    "um": "um micron microns micrometer micrometers",
    "in": "in inch inches",
    "deg": "deg degs degree degrees °",
    "rad": "rad rads radian radians",
    "s": "s sec secs second seconds",
    "ms": "ms msec msecs millisecond milliseconds",
    "us": "us usec usecs microsecond microseconds",
    "ns": "ns nsec nsecs nanosecond nanoseconds",
    "min": "min mins minute minutes",
    "h": "h hr hrs hour hours",
}
_KNOWN = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
# M is not m and nm is not N m where the case says so
_EXACT = {"Nm": "N m", "nm": "nm", "MN": "MN", "Mm": "Mm", "S": "S", "M": "M"}

_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]\s*$")
_BEHIND = re.compile(r"^(?P<name>.+?)\s*(?:[_/,]|\s)\s*(?P<unit>[A-Za-z°µμ*.\- ]{1,12})$")


def unit_word(text: str) -> str:
    """Return a unit in the program's own spelling; unknown ones as they are, ``?`` as nothing."""
    text = text.strip()
    if text[:1] in "([" and text[-1:] in ")]":
        text = text[1:-1].strip()
    if text in {"?", "-", "--", "1", "n/a", "none", "None"}:
        return ""
    if text in _EXACT:
        return _EXACT[text]
    plain = re.sub(r"[\s·⋅\u00d7]+", "*", text.replace("µ", "u").replace("μ", "u")).casefold()
    return _KNOWN.get(plain, text)


def known_unit(text: str) -> bool:
    """Tell whether a text is the spelling of a unit that this module knows."""
    return unit_word(text) in _SPELLINGS


def split_unit(cell: str) -> tuple[str, str]:
    """Split ``Force [kN]``, ``Force (kN)``, ``force_kN``, ``Force / kN`` into name and unit."""
    cell = cell.strip().strip('"').strip()
    match = _BRACKETS.match(cell)
    if match and match["name"]:
        return match["name"].strip(), unit_word(match["unit"])
    match = _BEHIND.match(cell)
    if match and known_unit(match["unit"]):
        return match["name"].strip(" _/,"), unit_word(match["unit"])
    return cell, ""


def unique(names: list[str]) -> tuple[str, ...]:
    """Give each column its own name: the second ``Mz`` becomes ``Mz_2``, a blank one ``column 3``."""
    used: set[str] = set()
    result = []
    for place, name in enumerate(names, start=1):
        base = " ".join(name.split()) or f"column {place}"
        own, number = base, 2
        while own in used:
            own, number = f"{base}_{number}", number + 1
        used.add(own)
        result.append(own)
    return tuple(result)


def names_and_units(cells: Iterable[str]) -> tuple[tuple[str, ...], list[str]]:
    """Split the cells of a header into names, each once, and units."""
    split = [split_unit(cell) for cell in cells]
    return unique([name for name, _ in split]), [unit for _, unit in split]


# --- The quantities that the chain wants of a log, and which column is probably which


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

_AXES = {"x": "1", "y": "2", "z": "3"}

_AXIS = re.compile(
    r"(?:^|[^a-z])(?P<kind>f|t|m|force|torque|moment|kraft)[\s._-]?(?P<axis>[xyz123])$"
)
_OF_TABLE = re.compile(
    r"(?:^|[^a-z])(?P<kind>f|forces?|loads?|torques?|moments?) column (?P<axis>[123])$"
)
_WORDS = (
    ("time", re.compile(r"^(time|t|x_value|timestamp|stamp|elapsed.*|zeit|temps|tiempo|tempo)$")),
    ("arm_moving", re.compile(r"^(arm_?moving|moving|sync|sync_?line|trigger)$")),
    ("angle", re.compile(r"^(angle|theta|beta|pitch|winkel|.*[\s._]angle)$")),
    ("F3", re.compile(r"^(force|load|kraft|last|fuerza|charge|.*\b(force|load))$")),
    (
        "z",
        re.compile(
            r"^(z|pos(ition)?[\s._]?z|.*position\.z|z[\s._]?pos(ition)?|height|depth|tiefe|weg[\s._]?z)$"
        ),
    ),
    ("z", re.compile(r"^(displacement|extension|weg|crosshead|stroke|pos|position|travel)$")),
    ("x", re.compile(r"^(x|pos(ition)?[\s._]?x|.*position\.x|x[\s._]?pos(ition)?|weg[\s._]?x)$")),
)
DOWNWARD = re.compile(r"(depth|tiefe)$")
"""End of the name, in small letters, of a column that grows downward."""
_LENGTHS = {"um", "mm", "cm", "m", "in"}
_FITTING_UNITS = {
    "time": {"s", "ms", "us", "ns", "min", "h"},
    "F": {"N", "mN", "kN", "lbf", "klbf", "kgf", "gf"},
    "T": {"N m", "N mm"},
    "x": _LENGTHS,
    "z": _LENGTHS,
    "angle": {"deg", "rad"},
}


def guess(name: str, unit: str) -> str:
    """Guess which of `QUANTITIES` a column holds from its name and unit; empty: none."""
    if name in QUANTITIES:
        return name if _fits(name, unit) else ""
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).casefold().strip()
    match = _AXIS.search(plain) or _OF_TABLE.search(plain)
    if match:
        kind = "F" if match["kind"][0] in "flk" else "T"
        quantity = kind + _AXES.get(match["axis"], match["axis"])
        return quantity if _fits(quantity, unit) else ""
    for word in dict.fromkeys((plain, plain.rpartition(".")[2])):
        for quantity, pattern in _WORDS:
            if pattern.match(word) and _fits(quantity, unit):
                return quantity
    return ""


def _fits(quantity: str, unit: str) -> bool:
    """Whether a unit can be one of the quantity."""
    wanted = _FITTING_UNITS.get(quantity, _FITTING_UNITS.get(quantity[0]))
    return not unit or wanted is None or unit in wanted


def guesses(log: Log) -> dict[str, str]:
    """Guess the quantities of all columns of a log: quantity to the first column that it fits.

    Without a name that says time, a column of seconds since 1970 is the time.
    """
    found: dict[str, str] = {}
    for name in log.columns:
        found.setdefault(guess(name, log.units.get(name, "")), name)
    if "time" not in found:
        stamps = [name for name, values in log.columns.items() if _is_epoch(values)]
        if stamps:
            found["time"] = stamps[0]
    return {quantity: found[quantity] for quantity in QUANTITIES if quantity in found}


def _is_epoch(values: FloatArray) -> bool:
    """Whether values look like times since 1970."""
    return bool(
        values.size > 1
        and epoch_unit(float(values[0]))
        and (np.diff(values) >= 0).all()
        and values[-1] > values[0]
    )


def epoch_unit(value: float) -> str:
    """Unit in which a number is a time between 2001 and 2065, counted from 1970; empty: in none."""
    scales = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
    return next((unit for unit, scale in scales.items() if 1e9 < value / scale < 3e9), "")
