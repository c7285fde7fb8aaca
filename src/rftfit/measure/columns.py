"""From the columns of a file to the quantities of the chain, in the units that the config declares."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.problems import did_you_mean, listed
from rftfit.logs.base import Log, LogError
from rftfit.measure.units import ANGLE_TO_RAD, FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S, TORQUE_TO_N_M

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.campaign.config import Config
    from rftfit.campaign.runs import Run
    from rftfit.campaign.sources import AnyLog, Column
    from rftfit.conventions import FloatArray

_TABLES = {
    "time": TIME_TO_S,
    "F": FORCE_TO_N,
    "T": TORQUE_TO_N_M,
    "x": LENGTH_TO_CM,
    "z": LENGTH_TO_CM,
    "angle": ANGLE_TO_RAD,
}


def chain_units(config: Config) -> dict[str, str]:
    """Return the unit of each quantity in which the chain takes a log.

    Parameters
    ----------
    config : Config

    Returns
    -------
    dict of str to str
    """
    force = dict.fromkeys(("F1", "F2", "F3"), config.transducer.force_unit)
    torque = dict.fromkeys(("T1", "T2", "T3"), "N m")
    position = dict.fromkeys(("x", "z"), config.arm.position_unit)
    return {**force, **torque, **position, "time": "s", "angle": "deg", "arm_moving": ""}


def columns_asked(source: AnyLog) -> set[str]:
    """Names of the columns of a file that the config asks for.

    Parameters
    ----------
    source : ForceLog or MotionLog

    Returns
    -------
    set of str
        Numbers as names: 3 as ``column 3``. The quantities themselves are among them.
    """
    chosen = {_name(c) for c in source.columns.values() if c.column is not None}
    return chosen | {"time", "arm_moving", "F1", "F2", "F3", "x", "z", "angle"}


def mapped(log: Log, source: AnyLog, units: Mapping[str, str], key: str) -> Log:
    """Turn the columns of a log into quantities.

    Columns that the config does not name are taken as they are where their name is a quantity.

    Parameters
    ----------
    log : Log
    source : ForceLog or MotionLog
        The section of the config.
    units : mapping of str to str
        As `chain_units` gives them.
    key : str
        Of the section, for messages.

    Returns
    -------
    Log
        With the columns that are quantities.

    Raises
    ------
    LogError
        If a column is not there, or its unit is not stated anywhere, is another than declared, or
        is none of the quantity. All problems at once.
    """
    if not source.columns:
        return log
    columns = {name: values for name, values in log.columns.items() if name in units}
    found = {name: log.units.get(name, "") for name in columns}
    notes = list(log.notes)
    problems = []
    for quantity, chosen in source.columns.items():
        try:
            columns[quantity], found[quantity] = _column(log, quantity, chosen, units[quantity])
        except ValueError as error:
            problems.append(f"{key}.columns.{quantity}: {error}")
        if chosen.constant is not None:
            notes.append(f"{quantity} is {chosen.constant:g} {chosen.unit or ''} by the config")
    if problems:
        raise LogError("columns", f"{log.path}: {'; '.join(problems)}", log.rows)
    return replace(log, columns=columns, units=found, notes=tuple(map(str.strip, notes)))


def _name(column: Column) -> str:
    return f"column {column.column}" if isinstance(column.column, int) else str(column.column)


def _column(log: Log, quantity: str, chosen: Column, wanted: str) -> tuple[FloatArray, str]:
    """Values of a quantity, and their unit."""
    if chosen.constant is not None:
        values, stated = np.full(log.size, chosen.constant), ""
    else:
        name = _name(chosen)
        if name not in log.columns:
            near = did_you_mean(name, log.columns)
            hint = f"; did you mean {near!r}?" if near else ""
            raise ValueError(f"found no column {name!r}; allowed: {listed(log.columns)}{hint}")
        values, stated = log.columns[name], log.units.get(name, "")
    if chosen.factor != 1:
        values = values * chosen.factor
    if quantity == "arm_moving":
        return values, ""
    if chosen.unit and stated and chosen.unit != stated:
        raise ValueError(f"the file says {stated}, the config {chosen.unit}: which is right?")
    unit = chosen.unit or stated
    table = _TABLES.get(quantity, _TABLES.get(quantity[0], {}))
    if not unit:
        raise ValueError(f"the file states no unit: add `unit:`, one of {', '.join(table)}")
    if unit not in table:
        raise ValueError(f"{unit} is no unit of {quantity}; allowed: {', '.join(table)}")
    if chosen.unit and unit != wanted:
        # a conversion that somebody declared; any other difference is told where units are checked
        return values * (table[unit] / table[wanted]), wanted
    if quantity == "time" and unit != wanted:
        return values * table[unit], wanted
    return values, unit


def completed(log: Log, run: Run, units: Mapping[str, str]) -> Log:
    """Give a motion log what the run sheet knows and the file does not: beta, or x of a vertical path.

    Parameters
    ----------
    log : Log
        With columns named by quantities.
    run : Run
    units : mapping of str to str

    Returns
    -------
    Log
        The same object where nothing is lacking.

    Raises
    ------
    LogError
        If the time, z, or something that the run sheet cannot replace is lacking.
    """
    lacking = [name for name in ("time", "x", "z", "angle") if name not in log.columns]
    if not lacking:
        return log
    columns, found, notes = dict(log.columns), dict(log.units), list(log.notes)
    if "angle" in lacking and run.beta_deg is not None:
        columns["angle"], found["angle"] = np.full(log.size, run.beta_deg), "deg"
        notes.append("beta is that of the run sheet: the motion log has no angle")
        lacking.remove("angle")
    if "x" in lacking and run.gamma_deg == 90:
        columns["x"], found["x"] = np.zeros(log.size), units["x"]
        notes.append("x is 0: the motion log has none, and the path is vertical")
        lacking.remove("x")
    if lacking:
        text = f"{log.path}: no column for {', '.join(lacking)}; name it under motion_log.columns"
        raise LogError("columns", f"{text} (`rftfit inspect` shows the columns)", log.rows)
    order = {name: columns[name] for name in ("time", "x", "z", "angle")}
    return replace(log, columns=order, units=found, notes=tuple(notes))
