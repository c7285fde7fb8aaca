"""Units in the spellings of log files and run sheets: finds them in names and cells, and converts them.

A unit of this program is one of the names on the left of the tables below, such as ``N m``. First their spellings and
how they are found beside a name; then, below `FORCE_TO_N`, factors, and ratios of units such as ``N/cm^3``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

_SPELLINGS = {
    "N": "n newton newtons",
    "mN": "mn millinewton millinewtons",
    "cN": "cn centinewton centinewtons",
    "daN": "dan dekanewton dekanewtons decanewton decanewtons",
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
    "d": "d day days",
}
"""Unit to its spellings in small letters."""
QUANTITY_UNITS = frozenset(_SPELLINGS)
"""Units of the quantities that the program reads."""
_UNIT_BY_SPELLING = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
# spellings in which the case of a letter decides: Nm is N m and nm is nanometre, M is not m
_EXACT = {"Nm": "N m", "nm": "nm", "MN": "MN", "Mm": "Mm", "S": "S", "M": "M"}
_OTHER_UNITS = "V mV uV A mA Hz kHz Pa kPa MPa GPa bar mbar psi % °C °F K g kg mg J mJ W nm km nN uN MN rpm TS RN"
"""Units of other quantities; with them a row of units is recognised."""

_WIDE = str.maketrans("\uff08\uff09\uff3b\uff3d\u3010\u3011\uff0f\uff1a\u3000", "()[][]/: ")
"""Wide brackets and signs of Chinese and Japanese programs, to those of ASCII."""
_NUMBERED = re.compile(
    r"(?P<head>.*?\S)\s*(?P<unit>[\[(][^\[\]()]*[\])])\s*(?P<number>(?:Run|Trial|Specimen|Series)?\s*[#-]?\s*\d+)",
    re.IGNORECASE,
)
"""``Force (N) Run #2``: a number, of a run or of a repeated name, behind the unit."""
_SINCE = re.compile(r"(\w+) since .*", re.IGNORECASE)
"""Unit of a time in netCDF: ``seconds since 2026-02-03``."""
_NAME_WITH_UNIT = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]\s*$")
_UNIT_IN_BRACKETS = re.compile(r"[\[(][^\[\]()]*[\])]")
_WITH_INDEX = re.compile(r".*(\S\[\d+\]|[\[(][xyzXYZ][\])])\s*")
"""A name that ends with an index or an axis in brackets, which is no unit: ``force[2]``, ``F (z)``."""
_BEFORE_UNIT = re.compile(r"\s*[_/,]\s*|\s+")
_POWER = re.compile(r"(\^-?\d|[²³⁻¹]+|(?<=[a-z])-?[234])$")
"""Power at the end of a unit: ``^2``, ``²``, or ``2`` behind a letter."""


def _without_brackets(text: str) -> str:
    """Return a unit without the brackets around it."""
    text = text.strip()
    return text[1:-1].strip() if text[:1] in "([" and text[-1:] in ")]" else text


def canonical_unit(text: str) -> str:
    """Return a unit in the spelling of this program: ``N`` for ``Newtons`` or ``[newton]``.

    An unknown unit comes back as it is, without brackets; a sign for no unit such as ``?`` as an empty text.
    """
    text = _without_brackets(text.translate(_WIDE))
    if since := _SINCE.fullmatch(text):
        text = since[1]
    if text in {"?", "-", "--", "1", "n/a", "none", "None"}:
        return ""
    if text in _EXACT:
        return _EXACT[text]
    # any sign of a product as *, micro as u
    plain = re.sub(r"[\s·⋅\u00d7]+", "*", text.replace("µ", "u").replace("μ", "u")).casefold()
    return _UNIT_BY_SPELLING.get(plain, text)


def is_unit(text: str) -> bool:
    """Return whether a text spells a unit of this module in any way, or a product or ratio of such units: N/m^2, kg*m/s.

    Names of columns, such as F1, are none.
    """
    text = _without_brackets(text)
    if canonical_unit(text) in _SPELLINGS:
        return True
    factors = re.split(r"[\s·⋅\u00d7*/.]+", text.replace("µ", "u"))
    bases = [_POWER.sub("", factor) for factor in factors]
    # a digit is a power only in a ratio, or as ^2: F1 and M2 are names
    may_have_powers = "/" in text or not any(map(str.isdigit, text.replace("^2", "")))
    return may_have_powers and all(
        base in _OTHER_UNITS.split() or canonical_unit(base) in _SPELLINGS for base in bases
    )


COUNTED_TIMES = ("s", "ms", "us", "ns")
"""Units in which computers count time; as the name of a column, they say that the column holds times."""


@lru_cache(1024)
def split_unit(cell: str, more: frozenset[str] = frozenset()) -> tuple[str, str]:
    """Split ``Force [kN]``, ``Force (kN)``, ``force_kN`` or ``Force / kN`` into name and unit, here ("Force", "kN").

    The unit is in the spelling of this program where it is known, and empty where the cell states none. A unit behind
    a name without brackets must be one of this module, so that ``Axial A`` stays a name. `more`: Further units that may
    stand so.
    """
    cell = cell.translate(_WIDE).strip().strip('"').strip()
    # the number behind the unit belongs to the name
    numbered = _NUMBERED.fullmatch(cell)
    if numbered and is_unit(numbered["unit"]):
        number = " ".join(numbered["number"].split())
        return f"{numbered['head']} {number}", canonical_unit(numbered["unit"])
    # what looks like a unit is a part of the name, or the cell is a unit without a name
    if _WITH_INDEX.fullmatch(cell) or ("/" in cell and is_unit(cell)):
        return cell, ""
    match = _NAME_WITH_UNIT.match(cell)
    if match and match["name"]:
        return match["name"].strip(), canonical_unit(match["unit"])
    for between in _BEFORE_UNIT.finditer(cell):
        name, unit = cell[: between.start()].strip(), cell[between.end() :].strip(" _/,")
        # no product, and none of the other units: in Axial A or Run V the letter is part of the name
        is_clear = canonical_unit(unit) in _SPELLINGS or ("/" in unit and is_unit(unit))
        if name and (is_clear or unit in more):
            return name, canonical_unit(unit)
    # a column of times is often named by its unit alone; but s and min often mean something else
    is_time = len(cell) > 1 and canonical_unit(cell) in COUNTED_TIMES
    return cell, canonical_unit(cell) if is_time else ""


def is_units_row(cells: Sequence[str], width: int) -> bool:
    """Return whether a row above data of `width` columns holds units: all in brackets, or most of them known.

    The others must be short and without digits, as units of other quantities are; a row of names is thus ruled out.
    """
    filled = [cell.strip() for cell in cells if cell.strip()]
    if not filled or not width - 1 <= len(cells) <= width + 1:
        return False
    if all(_UNIT_IN_BRACKETS.fullmatch(cell) for cell in filled):
        return True
    unknown_cells = [cell for cell in filled if not is_unit(cell)]
    short = all(len(cell) <= 10 and not any(map(str.isdigit, cell)) for cell in unknown_cells)
    return short and len(unknown_cells) * 2 < len(filled) and len(filled) * 2 > width


# --- Factors that convert a unit to the unit of this program, and the unit that a header or a cell states.
# Each table of factors is of one dimension; the last two have ratios, which `canonical_unit` does not know.


FORCE_TO_N = {
    "N": 1.0,
    "mN": 1e-3,
    "cN": 1e-2,
    "daN": 10.0,
    "kN": 1e3,
    "lbf": 4.4482216152605,
    "klbf": 4448.2216152605,
    "kgf": 9.80665,
    "gf": 9.80665e-3,
}
TORQUE_TO_N_M = {"N m": 1.0, "N mm": 1e-3}
LENGTH_TO_CM = {"um": 1e-4, "mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}
ANGLE_TO_DEG = {"deg": 1.0, "rad": math.degrees(1)}
TIME_TO_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0}
STRESS_TO_N_PER_CM2 = {
    "N/cm^2": 1.0,
    "Pa": 1e-4,
    "kPa": 0.1,
    "MPa": 100.0,
    "psi": 0.6894757293168361,
}
ALPHA_TO_N_PER_CM3 = {
    "N/cm^3": 1.0,
    "N/m^3": 1e-6,
    "Pa/m": 1e-6,
    "kPa/m": 1e-3,
    "MPa/m": 1.0,
    "kPa/cm": 0.1,
}
_DIMENSIONS = (
    FORCE_TO_N,
    TORQUE_TO_N_M,
    LENGTH_TO_CM,
    ANGLE_TO_DEG,
    TIME_TO_S,
    STRESS_TO_N_PER_CM2,
    ALPHA_TO_N_PER_CM3,
)
_OTHER_RATIOS = {
    "n/m2": "Pa",
    "kn/m2": "kPa",
    "n/mm2": "MPa",
    "mn/m2": "MPa",
    "lbf/in2": "psi",
    "kn/m3": "kPa/m",
    "mn/m3": "MPa/m",
}
"""Ratio in the spelling of `_plain_ratio`, to the unit that it equals."""
_DIGITS = str.maketrans("\u00b2\u00b3\u2074\u207b", "234-")


def units_like(unit: str) -> dict[str, float]:
    """Return all units of the same dimension, each to its factor in `unit`; empty for an unknown unit.

    ``units_like("mm")["cm"]`` is 10: a number in cm times 10 is in mm.
    """
    for dimension in _DIMENSIONS:
        if spelling := unit_among(unit, dimension):
            return {name: factor / dimension[spelling] for name, factor in dimension.items()}
    return {}


def unit_among(text: str, units: Mapping[str, float]) -> str | None:
    """Return the unit among the keys of `units` that a text spells in any way; None where there is none."""
    word = canonical_unit(text)
    if word in units:
        return word
    # case is ignored only for ratios and pressures: mN and MN differ by case alone, and no millipascal is used
    plain = _plain_ratio(text)
    plain = _OTHER_RATIOS.get(plain, plain).casefold()
    is_ratio = "/" in plain or plain.endswith(("pa", "psi"))
    return next((unit for unit in units if is_ratio and plain == _plain_ratio(unit)), None)


@lru_cache(4096)
def _plain_ratio(unit: str) -> str:
    """Spell a unit in small letters, as a ratio, without spaces and ``^``: ``n/cm3`` for ``N cm⁻³``."""
    unit = unit.strip(" )]").casefold().translate(_DIGITS)
    with_slash = re.sub(r"[\s_]per[\s_]", "/", unit)
    # a negative power is below the line
    as_ratio = re.sub(r"[\s*·]*\b([a-z]+)\^?-(\d)", r"/\1\2", with_slash)
    return re.sub(r"/m1$", "/m", re.sub(r"[\s^]", "", as_ratio))


def cut_header(header: str) -> Iterator[tuple[str, str]]:
    """Yield each way to cut a header into a name, in the spelling of `folded_name`, and a text that may be a unit.

    The caller knows the names and units that may stand in the table: ``rod depth_cm`` gives ("rod", "depth_cm") and
    ("rod_depth", "cm").
    """
    header = header.translate(_WIDE)
    for between in re.finditer(r"[\s_/,(\[]+", header):
        yield folded_name(header[: between.start()]), header[between.end() :].strip(" )]")


def folded_name(name: str) -> str:
    """Spell a name in small letters, with one underscore between words."""
    return re.sub(r"[\s_]+", "_", name.strip().casefold())
