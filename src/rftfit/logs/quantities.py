"""The quantities that the chain wants of a log, and which column is probably which."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from itertools import zip_longest

import numpy as np

from rftfit.campaign.config import QUANTITIES, UNIT_OF_WEIGHT, UNITS_OF, units_of
from rftfit.conventions import FloatArray
from rftfit.logs.base import Log
from rftfit.table.units import split_unit, unique, unit_word

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

_FORCES = {*UNITS_OF["F"]} - {*UNIT_OF_WEIGHT}


# --- Words of names: English, German, French, Spanish; small letters, without accents


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_FORCE = _set("""force forces load loads kraft standardkraft prufkraft last fuerza carga charge
    effort 力 载荷 荷载 负荷 荷重 試験力 试验力""")
_LENGTH = _set("""displacement extension weg standardweg traversenweg crosshead stroke pos position posicion travel
    distance stage deplacement desplazamiento recorrido 位移 変位 行程 ストローク""")
_WORDS = (
    (
        "time",
        _set("""time t timestamp stamp elapsed millis micros zeit prufzeit testzeit laufzeit messzeit uhrzeit clock
    temps heure tiempo hora tempo 时间 時間 時刻"""),
        "v running total test run recording measurement relative standardmessrate ecoule transcurrido",
    ),
    ("arm_moving", _set("moving sync trigger"), "arm line"),
    (
        "z",
        _set(
            "height depth sinkage tiefe hohe einsinkung profondeur enfoncement profundidad 深度 深さ"
        ),
        "",
    ),
    (
        "F3",
        _FORCE,
        """standard normal axial vertical compression compressive of de estandar axiale
     verticale normale kompressions druck sensor cell z tcp actual measured""",
    ),
    (
        "z",
        _LENGTH,
        """standard machine axial vertical traverse actuator axis z plate tool tcp actual
     measured estandar verticale""",
    ),
    (
        "angle",
        _set("angle theta beta pitch winkel angulo"),
        "plate leg blade tool arm tilt attack motor actual measured",
    ),
)
"""Quantity, words that say it, and words that may stand beside them."""
_OTHERWISE = _set("""target desired setpoint command commanded cmd ref reference soll sollwert consigne consigna friction lateral
    shear tangential peak max min mean avg std rms error offset bias limit preload rate speed velocity
    acceleration joint joints finger gripper imu gyro mag orientation quaternion""")
"""Words that make another thing of what stands beside them: no column with one is proposed."""
_OF_ROBOTS = _set("ext hat k o ee base tcp tool sensor actual raw filtered measured")
"""Words between the kind of a vector and its axis: O_F_ext_hat_K[2]."""

_FEET = _set("toe foot tip hoof")
"""What touches the ground at the end of a leg: its place is that of the intruder."""
_PLACE = [*_LENGTH, "translation", "pose", "motion"]
# the efforts of ROS are torques of joints
_KINDS = {
    **dict.fromkeys([*_FORCE - {"effort"}, "f", "wrench"], "F"),
    **dict.fromkeys([*_PLACE, *_FEET], "place"),
    **dict.fromkeys(_set("t m torque torques moment moments momento drehmoment couple"), "T"),
}
_AXES = {"F": ("F1", "F2", "F3"), "T": ("T1", "T2", "T3"), "place": ("x", "", "z")}
_AXIS_LETTERS = ("x", "y", "z")
_BETWEEN = re.compile(r"[\s_\-:,()\[\]{}]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_LAST = re.compile(r"(.*?)([xyz]|\d+)")
_REPEATED = re.compile(r"(.+)_(\d+)")

DOWNWARD = re.compile(
    r"(depth|sinkage|tiefe|einsinkung|profondeur|enfoncement|profundidad|深度|深さ)$"
)
"""End of the name, in small letters, of a column that grows downward."""


def _words(name: str) -> list[list[str]]:
    """Split a name into the parts of its path and each of them into words."""
    plain = unicodedata.normalize("NFKD", _CAMEL.sub(" ", name)).casefold()
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    parts = [[w for w in _BETWEEN.split(section) if w] for section in re.split(r"[./]", plain)]
    return [words for words in parts if words]


def _vector(name: str) -> tuple[str, str, str]:
    """Kind of vector that a column belongs to, which vector it is, and the axis; else empty texts."""
    words = [word for section in _words(name) for word in section]
    axis_match = _LAST.fullmatch(words[-1]) if words else None
    if not axis_match or not _OTHERWISE.isdisjoint(words):
        return "", "", ""
    stem = [*words[:-1], *filter(None, [axis_match[1]])]
    if stem[-1:] == ["column"]:  # of a table, as files of arrays name it
        stem.pop()
    kinds = [word for word in stem if word not in _OF_ROBOTS][-1:]
    if kinds in (["t"], ["m"]) and axis_match[2].isdigit():  # times, temperatures, masses
        return "", "", ""
    return _KINDS.get(kinds[0], "") if kinds else "", " ".join(stem), axis_match[2]


def _of_vector(kind: str, stem: str, axis: str, numbers: Collection[int]) -> str:
    """Quantity of a column of a vector, by its axis; `numbers`: those of all columns of the vector."""
    names: tuple[str, ...] = _AXES[kind]
    if not axis.isdigit():
        return names["xyz".index(axis)]
    start, number, number_set = 0 if 0 in numbers else 1, int(axis), set(numbers)
    is_within_three = kind != "place" and start == 1 and 1 in number_set and number_set <= {1, 2, 3}
    whole = number_set == set(range(start, start + 3))
    if kind == "place":
        # of a joint's positions the numbers are no axes
        whole = "pose" in stem and number_set in (
            {*range(start, start + 6)},
            {*range(start, start + 7)},
        )
    elif kind == "F" and number_set == set(range(start, start + 6)):
        names, whole = (*names, *_AXES["T"]), True
    place = number - start
    return names[place] if (is_within_three or whole) and place < len(names) else ""


def _by_words(name: str, unit: str) -> str:
    """Quantity that the words of a name, and a unit of length beside x or z, say without an axis; empty: none."""
    parts = _words(name)
    if not parts or not _OTHERWISE.isdisjoint(word for section in parts for word in section):
        return ""
    leaf, before = parts[-1], parts[-2] if len(parts) > 1 else []
    if leaf == ["x", "value"]:  # of LabVIEW
        return "time"
    if leaf == ["f"]:
        return "F3"
    joined = re.fullmatch(r"([xz])(pos(?:ition)?)?", "".join(leaf))
    is_place = not before or before[-1] in _PLACE or unit in UNITS_OF["z"]
    if joined and (joined[2] or is_place):
        return joined[1]
    if leaf[0] in ("x", "z") and len(leaf) == 2 and leaf[1] in _LENGTH:
        return leaf[0]
    for quantity, words, beside in _WORDS:
        leaf_words = {word for word in leaf if quantity != "time" or not word.isdigit()}
        if leaf_words & words and leaf_words <= words.union(beside.split()):
            return "" if name == "T" else quantity
    return ""


def guess(name: str, unit: str, numbers: Collection[int] = ()) -> str:
    """Guess which of `QUANTITIES` a column holds from its name and unit; empty: none.

    `numbers`: Of the columns of the file with the same name but for a number at its end.
    """
    quantity = name if name in QUANTITIES else ""
    if name.casefold() in _AXIS_LETTERS and unit in _FORCES:
        return _AXES["F"][_AXIS_LETTERS.index(name.casefold())]
    if not quantity:
        kind, stem, axis = _vector(name)
        quantity = _of_vector(kind, stem, axis, numbers) if kind else _by_words(name, unit)
    # a mass is no force by its unit alone
    fitting_units = {*units_of(quantity)} - {*UNIT_OF_WEIGHT} if quantity else {}
    return "" if unit and fitting_units and unit not in fitting_units else quantity


def guesses(log: Log) -> dict[str, str]:
    """Guess the quantities of all columns of a log: quantity to the first column that it fits.

    Without a name that says time, a column of seconds since 1970 is the time, or one that grows and
    has a unit of time.
    """
    column_by_quantity: dict[str, str] = {}
    numbers: dict[str, set[int]] = {}
    names_in_file = {name: _in_file(name, log.columns) for name in log.columns}
    sets = False  # Force 1, Travel 1, Force 2, Travel 2: specimens, not axes
    for name in names_in_file.values():
        kind, stem, axis = _vector(name)
        if axis.isdigit():
            numbers.setdefault(stem, set()).add(int(axis))
            sets |= kind == "place" and "pose" not in stem
    numbers = {
        stem: number_set for stem, number_set in numbers.items() if 0 in number_set or not sets
    }
    column_by_quantity |= _places_of_foot(names_in_file)
    for name, written in names_in_file.items():
        stem = _vector(written)[1]
        quantity = guess(written, log.units.get(name, ""), numbers.get(stem, ()))
        if quantity:
            column_by_quantity.setdefault(quantity, name)
    if "time" not in column_by_quantity:
        columns = log.columns.items()
        stamps = [name for name, values in columns if _is_epoch(values)]
        of_unit = UNITS_OF["time"]
        growing = [n for n, v in columns if log.units.get(n) in of_unit and _grows(v)]
        if stamps or growing:
            column_by_quantity["time"] = [*stamps, *growing][0]
    return {
        quantity: column_by_quantity[quantity]
        for quantity in QUANTITIES
        if quantity in column_by_quantity
    }


def _places_of_foot(names: Mapping[str, str]) -> dict[str, str]:
    """Columns of x and z of a toe; of a leg in a plane, without z, y is upward."""
    by_axis = {
        axis: name
        for name, written in reversed([*names.items()])
        for kind, stem, axis in [_vector(written)]
        if kind == "place" and not _FEET.isdisjoint(stem.split())
    }
    upward = by_axis.get("z") or by_axis.get("y")
    if upward is None:
        return {}
    return {"z": upward, **({"x": by_axis["x"]} if "x" in by_axis else {})}


def _in_file(name: str, names: Collection[str]) -> str:
    """Return the name that the file gives a column: the second ``Force`` of one is ``Force_2`` here."""
    repeated = _REPEATED.fullmatch(name)
    return repeated[1] if repeated and int(repeated[2]) > 1 and repeated[1] in names else name


def _is_epoch(values: FloatArray) -> bool:
    """Whether values look like times since 1970."""
    return bool(
        values.size > 1
        and epoch_unit(float(values[0]))
        and (np.diff(values) >= 0).all()
        and values[-1] > values[0]
    )


def _grows(values: FloatArray) -> bool:
    values = values[np.isfinite(values)]
    return bool(values.size > 1 and (np.diff(values) > 0).all())


PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Units in which computers count time, and how many of each a second has."""


def epoch_unit(value: float) -> str:
    """Unit in which a number is a time between 2001 and 2065, counted from 1970; empty: in none."""
    return next((unit for unit, scale in PER_SECOND.items() if 1e9 < value / scale < 3e9), "")


def names_and_units(
    cells: Iterable[str], below: Iterable[str] = ()
) -> tuple[tuple[str, ...], list[str]]:
    """Split the cells of a header into names, each once, and units; a row of units `below` goes first.

    A mass is the unit of a column that its name calls a force.
    """
    names: list[str] = []
    units: list[str] = []
    for cell, stated in zip_longest(cells, below):
        if cell is None:
            break
        name, unit = split_unit(cell)
        if not unit:
            weighed, mass = split_unit(cell, _MASSES)
            name, unit = (weighed, mass) if mass and _is_force(weighed) else (name, unit)
        unit = unit or unit_word(stated or "")
        names.append(name)
        units.append(UNIT_OF_WEIGHT[unit] if unit in _MASSES and _is_force(name) else unit)
    return unique(names), units


_MASSES = frozenset(UNIT_OF_WEIGHT)


def _is_force(name: str) -> bool:
    return guess(name, "N")[:1] == "F"
