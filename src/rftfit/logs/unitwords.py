"""Units as log files spell them, in the program's own spelling."""

from __future__ import annotations

import re

_SPELLINGS = {
    "N": "n newton newtons",
    "mN": "mn millinewton millinewtons",
    "kN": "kn kilonewton kilonewtons",
    "lbf": "lbf lb lbs pound pounds",
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
_EXACT = {"Nm": "N m", "nm": "nm", "MN": "MN", "Mm": "Mm", "S": "S", "M": "M"}
# M is not m and nm is not N m where the case says so

_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]\s*$")
_BEHIND = re.compile(r"^(?P<name>.+?)\s*(?:[_/,]|\s)\s*(?P<unit>[A-Za-z°µμ*.\- ]{1,12})$")


def unit_word(text: str) -> str:
    """Return a unit in the program's own spelling.

    Parameters
    ----------
    text : str
        As in a file, with or without brackets around it.

    Returns
    -------
    str
        As it is, without brackets and blanks, where the unit is not known; empty for ``?`` and ``-``.
    """
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
    """Tell whether a text is the spelling of a unit that this module knows.

    Parameters
    ----------
    text : str

    Returns
    -------
    bool
    """
    return unit_word(text) in _SPELLINGS


def split_unit(cell: str) -> tuple[str, str]:
    """Split the cell of a header row into name and unit.

    Parameters
    ----------
    cell : str
        ``Force [kN]``, ``Force (kN)``, ``force_kN``, ``Force / kN``, or a bare name.

    Returns
    -------
    name : str
    unit : str
        Empty where there is none.
    """
    cell = cell.strip().strip('"').strip()
    match = _BRACKETS.match(cell)
    if match and match["name"]:
        return match["name"].strip(), unit_word(match["unit"])
    match = _BEHIND.match(cell)
    if match and known_unit(match["unit"]):
        return match["name"].strip(" _/,"), unit_word(match["unit"])
    return cell, ""


def unique(names: list[str]) -> tuple[str, ...]:
    """Give each column its own name: the second ``Mz`` becomes ``Mz_2``, a blank one ``column 3``.

    Parameters
    ----------
    names : list of str

    Returns
    -------
    tuple of str
    """
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
