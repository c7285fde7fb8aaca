"""Guesses which column of a log holds which quantity (time, forces, positions), from names, units and values.

The quantities are those of `MEANING`. A name is judged first as one axis of a *vector* ("F" force, "T" torque, "place"
position: ``wrench.force.x``, ``Fx``, ``F_2``), by kind, name (the *stem*) and axis of the vector; then by its words
(``Standardkraft``). Guesses are proposed to the user by `rftfit inspect`, who checks them.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from itertools import chain, islice, repeat

import numpy as np

from rftfit.campaign.config import QUANTITIES, UNIT_OF_WEIGHT, UNITS_OF, units_of
from rftfit.conventions import FloatArray
from rftfit.logs.base import Log
from rftfit.table.text import unique_names
from rftfit.table.units import COUNTED_TIMES, TIME_TO_S, canonical_unit, split_unit

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
"""Quantity, to its meaning for the user."""

_FORCES = {*UNITS_OF["F"]} - {*UNIT_OF_WEIGHT}
"""Units of force alone, without kg and g."""


# --- Words of names: English, German, French, Spanish; small letters, without accents


def _word_set(words: str) -> frozenset[str]:
    """Return the words of a text: a text is easier to read and to extend than a set of words in quotes."""
    return frozenset(words.split())


_FORCE = _word_set("""force forces load loads kraft standardkraft prufkraft last fuerza carga charge
    effort 力 载荷 荷载 负荷 荷重 試験力 试验力""")
_LENGTH = _word_set("""displacement extension weg standardweg traversenweg crosshead stroke pos position posicion travel
    distance stage deplacement desplazamiento recorrido 位移 変位 行程 ストローク""")
_WORDS = (
    (
        "time",
        _word_set("""time t timestamp stamp elapsed millis micros zeit prufzeit testzeit laufzeit messzeit uhrzeit clock
    temps heure tiempo hora tempo 时间 時間 時刻"""),
        "v running total test run recording measurement relative standardmessrate ecoule transcurrido",
    ),
    ("arm_moving", _word_set("moving sync trigger"), "arm line"),
    (
        "z",
        _word_set(
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
        _word_set("angle theta beta pitch winkel angulo"),
        "plate leg blade tool arm tilt attack motor actual measured",
    ),
)
"""Quantity, words that name it, and words that may stand beside such a word."""
_EXCLUDED = _word_set("""target desired setpoint command commanded cmd ref reference soll sollwert consigne consigna friction lateral
    shear tangential peak max min mean avg std rms error offset bias limit preload rate speed velocity
    acceleration joint joints finger gripper imu gyro mag orientation quaternion""")
"""Words that change the meaning, as in "target force": a column with such a word is not proposed."""
_SKIPPED_WORDS = _word_set("ext hat k o ee base tcp tool sensor actual raw filtered measured")
"""Words between the kind of a vector and its axis, as in O_F_ext_hat_K[2]; they are skipped."""

_FOOT_WORDS = _word_set("toe foot tip hoof")
"""Words for the end of a leg, whose position is that of the intruder."""
_PLACE = [*_LENGTH, "translation", "pose", "motion"]
"""Words for a position."""
# word to the kind of vector; without effort, which is a torque of a joint in ROS
_VECTOR_KINDS = {
    **dict.fromkeys([*_FORCE - {"effort"}, "f", "wrench"], "F"),
    **dict.fromkeys([*_PLACE, *_FOOT_WORDS], "place"),
    **dict.fromkeys(_word_set("t m torque torques moment moments momento drehmoment couple"), "T"),
}
# kind of vector, to the quantity of each axis x, y and z; y of a position is none
_AXES = {"F": ("F1", "F2", "F3"), "T": ("T1", "T2", "T3"), "place": ("x", "", "z")}
_AXIS_LETTERS = ("x", "y", "z")
_WORD_ENDS = re.compile(r"[\s_\-:,()\[\]{}]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_AXIS_AT_END = re.compile(r"(.*?)([xyz]|\d+)")
_REPEATED = re.compile(r"(.+)_(\d+)")

DOWNWARD = re.compile(
    r"(depth|sinkage|tiefe|einsinkung|profondeur|enfoncement|profundidad|深度|深さ)$"
)
"""End of the name, in small letters, of a column that grows downward."""


def _split_words(name: str) -> list[list[str]]:
    """Split the name of a column at dots and slashes into parts, and each part into words in small letters.

    Accents are removed, and CamelCase is split, too.
    """
    plain = unicodedata.normalize("NFKD", _CAMEL.sub(" ", name)).casefold()
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    parts = [[w for w in _WORD_ENDS.split(section) if w] for section in re.split(r"[./]", plain)]
    return [words for words in parts if words]


def _parse_vector(name: str) -> tuple[str, str, str]:
    """Return kind ("F", "T", "place"), name and axis of the vector that a column belongs to; else an empty kind.

    ("F", "wrench force", "x") for ``wrench.force.x``; the axis may be a number. Name and axis may be set without a
    kind.
    """
    words = [word for section in _split_words(name) for word in section]
    axis_match = _AXIS_AT_END.fullmatch(words[-1]) if words else None
    if not axis_match or not _EXCLUDED.isdisjoint(words):
        return "", "", ""
    # all words but the axis, which may be the end of the last word
    stem = [*words[:-1], *filter(None, [axis_match[1]])]
    if stem[-1:] == ["column"]:  # "force column 2" of a file of arrays
        stem.pop()
    # the last word that means something, in a list, says the kind
    kinds = [word for word in stem if word not in _SKIPPED_WORDS][-1:]
    # T1 may be a time or temperature, M1 a mass
    if kinds in (["t"], ["m"]) and axis_match[2].isdigit():
        return "", "", ""
    return _VECTOR_KINDS.get(kinds[0], "") if kinds else "", " ".join(stem), axis_match[2]


def _vector_quantity(kind: str, stem: str, axis: str, numbers: Collection[int]) -> str:
    """Return the quantity of a column of a vector, by its axis; empty: none.

    `kind`, `stem`, `axis`: Kind, name and axis of the vector. `numbers`: Numbers of all columns of the vector, where
    the axes are numbers: 0, 1, 2 or 1, 2, 3 are x, y, z.
    """
    names: tuple[str, ...] = _AXES[kind]
    if not axis.isdigit():
        return names["xyz".index(axis)]
    start, number_set = 0 if 0 in numbers else 1, set(numbers)  # number of the first axis

    def are_first(count: int) -> bool:
        """Return whether the numbers are the first ones, `count` of them, without a gap."""
        return number_set == {*range(start, start + count)}

    if kind == "place":
        # numbered positions are axes only in a pose (x, y, z and 3 or 4 numbers of the turn): else they number joints
        are_axes = "pose" in stem and (are_first(6) or are_first(7))
    elif kind == "F" and are_first(6):
        # six numbers are three forces, then three torques
        names, are_axes = (*names, *_AXES["T"]), True
    else:
        # also an incomplete vector, such as channels 1 and 3 of a transducer
        are_axes = are_first(3) or (1 in number_set and number_set <= {1, 2, 3})
    axis_index = int(axis) - start
    return names[axis_index] if are_axes and axis_index < len(names) else ""


def _quantity_by_words(name: str, unit: str) -> str:
    """Return the quantity by the words of a name, and for x or z alone by a unit of length; empty: none.

    `unit`: Of the column; empty: not stated.
    """
    parts = _split_words(name)
    if not parts or not _EXCLUDED.isdisjoint(word for section in parts for word in section):
        return ""
    # the last part of the name, and the part before: of wrench.force.x the words of x, and of force
    leaf, before = parts[-1], parts[-2] if len(parts) > 1 else []
    if leaf == ["x", "value"]:  # X_Value of LabVIEW
        return "time"
    if leaf == ["f"]:
        return "F3"
    joined = re.fullmatch(r"([xz])(pos(?:ition)?)?", "".join(leaf))
    is_place = not before or before[-1] in _PLACE or unit in UNITS_OF["z"]
    if joined and (joined[2] or is_place):
        return joined[1]
    if leaf[0] in ("x", "z") and len(leaf) == 2 and leaf[1] in _LENGTH:
        return leaf[0]
    for quantity, words, further_words in _WORDS:
        leaf_words = {word for word in leaf if quantity != "time" or not word.isdigit()}
        if leaf_words & words and leaf_words <= words.union(further_words.split()):
            # T may be a temperature or a torque
            return "" if name == "T" else quantity
    return ""


def guess(name: str, unit: str, numbers: Collection[int] = ()) -> str:
    """Guess which of `QUANTITIES` a column holds from its name and unit; empty: none.

    `numbers`: Numbers at the end of all columns of the file with otherwise the same name.
    """
    if name.casefold() in _AXIS_LETTERS and unit in _FORCES:
        return _AXES["F"][_AXIS_LETTERS.index(name.casefold())]
    quantity = name if name in QUANTITIES else ""
    if not quantity:
        kind, stem, axis = _parse_vector(name)
        quantity = (
            _vector_quantity(kind, stem, axis, numbers) if kind else _quantity_by_words(name, unit)
        )
    # a mass is no force by its unit alone
    fitting_units = {*units_of(quantity)} - {*UNIT_OF_WEIGHT} if quantity else {}
    return "" if unit and fitting_units and unit not in fitting_units else quantity


def guesses(log: Log) -> dict[str, str]:
    """Guess the quantities of all columns of a log: quantity, to the first column that fits, if any does.

    Where no name says time, a column of seconds since 1970 is the time, or a column that grows and
    has a unit of time.
    """
    # name of a vector, to the numbers of its columns, which show whether they are axes
    numbers_by_stem: dict[str, set[int]] = {}
    names_in_file = {name: _name_in_file(name, log.columns) for name in log.columns}
    # Force 1, Travel 1, Force 2, Travel 2: the numbers count specimens, not axes
    are_specimens = False
    for name in names_in_file.values():
        kind, stem, axis = _parse_vector(name)
        if axis.isdigit():
            numbers_by_stem.setdefault(stem, set()).add(int(axis))
            are_specimens |= kind == "place" and "pose" not in stem
    column_by_quantity = _columns_of_foot(names_in_file)
    for name, written in names_in_file.items():
        numbers = numbers_by_stem.get(_parse_vector(written)[1], set())
        if are_specimens and 0 not in numbers:
            numbers = set()
        if quantity := guess(written, log.units.get(name, ""), numbers):
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


def _columns_of_foot(names: Mapping[str, str]) -> dict[str, str]:
    """Return quantity x and z, to the column, of a toe or foot; where it has no z, the leg is plane and y is upward.

    The end of a leg is the intruder, whatever other positions the log has. `names`: Column, to its name in the file.
    """
    by_axis = {
        axis: name
        for name, written in reversed([*names.items()])
        for kind, stem, axis in [_parse_vector(written)]
        if kind == "place" and not _FOOT_WORDS.isdisjoint(stem.split())
    }
    upward = by_axis.get("z") or by_axis.get("y")
    if upward is None:
        return {}
    return {"z": upward, **({"x": by_axis["x"]} if "x" in by_axis else {})}


def _name_in_file(name: str, names: Collection[str]) -> str:
    """Return the name of a column in the file: ``Force`` for ``Force_2``, as a second ``Force`` is called here."""
    repeated = _REPEATED.fullmatch(name)
    return repeated[1] if repeated and int(repeated[2]) > 1 and repeated[1] in names else name


def _is_epoch(values: FloatArray) -> bool:
    """Return whether values, shape (n,), are probably times since 1970: large enough, and never decreasing."""
    return bool(
        values.size > 1
        and epoch_unit(float(values[0]))
        and (np.diff(values) >= 0).all()
        and values[-1] > values[0]
    )


def _grows(values: FloatArray) -> bool:
    """Return whether each finite value is larger than the one before, as times are."""
    values = values[np.isfinite(values)]
    return bool(values.size > 1 and (np.diff(values) > 0).all())


def epoch_unit(value: float) -> str:
    """Return the unit in which a number is a time since 1970, between the years 2001 and 2065; empty: none."""
    return next((unit for unit in COUNTED_TIMES if 1e9 < value * TIME_TO_S[unit] < 3e9), "")


_MASSES = frozenset(UNIT_OF_WEIGHT)
"""Units of mass, which in a column of forces mean a weight."""


def units_by_name(
    cells: Iterable[str], below: Iterable[str] = (), width: int | None = None
) -> dict[str, str]:
    """Split the cells of a header into unique names and their units: name, to unit, in the order of the columns.

    `below`: Cells of a row of units below the names; used where the name has no unit. A unit of mass (kg) becomes
    one of weight (kgf) where the name says that the column is a force. `width`: Number of columns; None: as many as
    cells. A unit is empty where none is stated.
    """
    names: list[str] = []
    units: list[str] = []
    if width is not None:
        cells = islice(chain(cells, repeat("")), width)
    for cell, unit_below in zip(cells, chain(below, repeat("")), strict=False):
        name, unit = split_unit(cell)
        if not unit:
            name_before_mass, mass = split_unit(cell, _MASSES)
            if mass and _is_force(name_before_mass):
                name, unit = name_before_mass, mass
        unit = unit or (canonical_unit(unit_below) if unit_below else "")
        names.append(name)
        units.append(UNIT_OF_WEIGHT[unit] if unit in _MASSES and _is_force(name) else unit)
    return dict(zip(unique_names(names), units, strict=True))


def _is_force(name: str) -> bool:
    """Return whether the name of a column says that it holds a force."""
    return guess(name, "N")[:1] == "F"
