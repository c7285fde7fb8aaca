"""What a log still lacks, and the lines of config that make it fit for ingest."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from rftfit.logs.quantities import MEANING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.cli.inspection import Survey

FORCE = ("time", "F1", "F2", "F3")
MOTION = ("time", "x", "z", "angle")
_USUAL = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_./ ]*[A-Za-z0-9_]|[A-Za-z]")
_WORDS = frozenset({"y", "n", "yes", "no", "on", "off", "true", "false", "null"})


def kinds(found: Survey) -> list[str]:
    """Tell what sort of log a file is.

    Parameters
    ----------
    found : Survey

    Returns
    -------
    list of str
        Of ``force``, ``motion``; both for a file that holds both, none where nothing tells.
    """
    force = any(f"F{number}" in found.quantities for number in (1, 2, 3))
    motion = any(name in found.quantities for name in ("x", "z", "angle"))
    return [kind for kind, there in (("force", force), ("motion", motion)) if there]


def lacking(found: Survey) -> list[str]:
    """Say what the measurement chain needs beyond this file.

    Parameters
    ----------
    found : Survey

    Returns
    -------
    list of str
        A sentence each; the first names the other half of the pair.
    """
    sorts = kinds(found)
    needs = []
    if sorts != ["force", "motion"]:
        other = "the motion log of the same run (time, x, z, angle)"
        if sorts == ["motion"]:
            other = "the force log of the same run (time, arm_moving, F1, F2, F3)"
        needs.append(other)
    needs.append("a row of the run sheet that names both")
    if not sorts:
        needs.append("which columns are forces or positions: name them in the config")
    if "time" not in found.quantities:
        needs.append("a time: the column that holds it, or the rate (text: {rate_Hz: ...})")
    for kind, wanted in (("force", FORCE), ("motion", MOTION)):
        if kind in sorts:
            gone = [name for name in wanted[1:] if name not in found.quantities]
            needs += [f"{name}: {MEANING[name]}; {_instead(name)}" for name in gone]
    unknown = [
        column
        for quantity, column in found.quantities.items()
        if quantity != "arm_moving" and not found.first.units.get(column)
    ]
    if unknown:
        needs.append(f"the unit of {', '.join(unknown)}: the file does not state it")
    if "force" in sorts:
        needs.append("transducer range, axes and turn, in config.yaml")
        if "arm_moving" not in found.quantities:
            needs.append(
                "no sync line: set clock.method in config.yaml to estimate, or to same_clock where "
                "force and motion have one clock"
            )
        elif found.moving == 1:
            needs.append("a change of arm_moving: without one the two clocks cannot be joined")
    if "motion" in sorts:
        needs.append("the arm z of the free surface, in config.yaml or the run sheet")
    if found.used < 2:
        needs.append("at least two usable rows")
    return needs


def _instead(name: str) -> str:
    if name == "angle":
        return "without it beta is taken from the run sheet"
    if name == "x":
        return "without it only vertical paths can be used"
    if name.startswith("F"):
        return (
            "a channel that nobody measured: {constant: 0, unit: N}, and its direction counts for 0"
        )
    return "name its column"


def config_block(found: Survey, dialect: str, text: Mapping[str, Any] | None = None) -> list[str]:
    """Write the lines of config for a log.

    Parameters
    ----------
    found : Survey
    dialect : str
    text : mapping, optional
        Format, where the dialect is ``delimited``.

    Returns
    -------
    list of str
        Lines of YAML; what is a guess says so.
    """
    if dialect == "rig":
        return ["dialect: rig"]
    lines = []
    sorts = kinds(found)
    if not sorts:
        lines.append("# force_log: for a log of forces; write motion_log: for one of positions")
    for kind in sorts or ["force"]:
        lines.append(f"{kind}_log:")
        if text is None:
            lines.append(f"  dialect: {dialect}")
        else:
            inside = ", ".join(f"{key}: {scalar(value)}" for key, value in text.items())
            lines.append(f"  text: {{{inside}}}")
        begin = len(lines)
        wanted: tuple[str, ...] = FORCE if kind == "force" else MOTION
        if kind == "force" and "arm_moving" in found.quantities:
            wanted = (*wanted, "arm_moving")
        lines += [line for name in wanted for line in _line(found, name)]
        chosen = [line for line in lines[begin:] if not line.lstrip().startswith("#")]
        if chosen or begin < len(lines):
            # a section of comments only would be an empty one
            example = "  columns:" if chosen else "  columns: {} # quantity: column, a line each"
            lines.insert(begin, example)
    return lines


def _line(found: Survey, quantity: str) -> list[str]:
    column = found.quantities.get(quantity)
    if column is None:
        return [f"    # {quantity}: no column looks like it"]
    unit = found.first.units.get(column, "")
    if column == quantity and (unit or quantity == "arm_moving"):
        return []
    number = re.fullmatch(r"column (\d+)", column)
    name = number[1] if number else scalar(column)
    if unit or quantity == "arm_moving":
        declared = f", unit: {unit}" if _converted(quantity, unit) else ""
        return [
            f"    {quantity}: {{column: {name}{declared}}}"
            if declared
            else f"    {quantity}: {name}"
        ]
    usual = _USUAL.get(quantity, "N")
    return [f"    {quantity}: {{column: {name}, unit: {usual}}} # the file states no unit: check"]


def _converted(quantity: str, unit: str) -> bool:
    """Whether the unit is another than the chain's usual one: then it has to be declared."""
    return quantity not in ("time", "arm_moving") and unit != _USUAL.get(quantity, "N")


def scalar(value: object) -> str:
    """Write a value as YAML.

    Parameters
    ----------
    value : object

    Returns
    -------
    str
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        plain = _PLAIN.fullmatch(value) and value.casefold() not in _WORDS
        return value if plain else json.dumps(value, ensure_ascii=False)
    return str(value)
