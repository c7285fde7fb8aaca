"""Turn the columns of a log into quantities in the units of the program, by the config and the row of the run sheet.

A *quantity* is what the program needs of a log: time, F1 to F3 (or T1 to T3) and arm_moving of a force log; time, x, z,
angle of a motion log, or ``along``, a position along a straight path. The *section* of the config about a log, here
``source`` (``force_log`` or ``motion_log``), says for each quantity its column and how its numbers are scaled: an
*entry*. The order: `source_of` -> `convert_gauges` -> `map_columns` -> `complete_motion_log` -> `check_complete`.

A quantity leaves in the *chain unit*, the one in which later stages expect it (`chain_units`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, Literal

import numpy as np

from rftfit.campaign.calibration import Calibration
from rftfit.campaign.config import UNIT_OF_WEIGHT, AnyLog, ColumnEntry, Config, ForceLog
from rftfit.campaign.problems import unknown_word
from rftfit.campaign.sheet import LogKind, Run, read_assignments, read_log_columns
from rftfit.conventions import FloatArray, direction
from rftfit.logs.base import Log, LogError
from rftfit.measure.flags import Refused
from rftfit.table.units import ANGLE_TO_DEG, FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S, TORQUE_TO_N_M

ANGLE_TO_RAD = {unit: math.radians(degrees) for unit, degrees in ANGLE_TO_DEG.items()}
_UNIT_FACTORS = dict.fromkeys(("x", "z", "along"), LENGTH_TO_CM)
_UNIT_FACTORS |= {"time": TIME_TO_S, "F": FORCE_TO_N, "T": TORQUE_TO_N_M, "angle": ANGLE_TO_RAD}
"""Factors of the units of a quantity, by its name or, for F1 to T3, by the first letter of that."""


def _factors_of(quantity: str) -> dict[str, float]:
    """Return the factor of each unit of a quantity to N, N m, cm, rad or s; empty for one without a unit."""
    return _UNIT_FACTORS.get(quantity, _UNIT_FACTORS.get(quantity[0], {}))


LogKey = Literal["force_log", "motion_log"]
"""Section of the config about a log, and column of the run sheet with its file."""
FORCE_QUANTITIES, MOTION_QUANTITIES = ("time", "F1", "F2", "F3"), ("time", "x", "z", "angle")
"""Quantities that every force log and every motion log must have in the end."""


def unit_factor(table: dict[str, float], in_file: str, declared: str, quantity: str) -> float:
    """Return the factor to N, cm, rad or s; refuse a log whose unit is not that of the config.

    No unexpected unit is converted silently: a file in lbf where the config says N is as likely a wrong file.

    `table`: Factor of each unit. `in_file`, `declared`: Units in log and config. `quantity`: Name for the message.
    """
    if in_file != declared:
        raise Refused(
            "other-unit", quantity=quantity, found=in_file or "no unit", declared=declared
        )
    if in_file not in table:
        raise Refused("unknown-unit", quantity=quantity, found=in_file, allowed=", ".join(table))
    return table[in_file]


def chain_units(config: Config) -> dict[str, str]:
    """Return the unit of each quantity in which later stages expect a log: that of the config, or a fixed one.

    ``arm_moving`` has none, "".
    """
    force = dict.fromkeys(("F1", "F2", "F3"), config.transducer.force_unit)
    torque = dict.fromkeys(("T1", "T2", "T3"), "N m")
    position = dict.fromkeys(("x", "z", "along"), config.arm.position_unit)
    return {**force, **torque, **position, "time": "s", "angle": "deg", "arm_moving": ""}


def source_of(config: Config, run: Run, key: LogKey) -> AnyLog:
    """Return the section of the config about a log of a run, with what its row of the run sheet replaces."""
    if key == "force_log":
        return _source_of_row(config.force_log, run.force_where, run.force_columns)
    return _source_of_row(config.motion_log, run.motion_where, run.motion_columns)


def _source_of_row(source: AnyLog, where: str, columns: str) -> AnyLog:
    """Return a section of the config about a log, with what a row of the run sheet says in its place.

    `where`: Cell of the row that names the rows of the file, as ``device: A, B`` (in the column device A or B).
    `columns`: Cell of the row that names columns, as ``F1: column name``. Both are empty if they replace nothing.
    """
    if not where and not columns:
        return source
    kind: LogKind = "force" if isinstance(source, ForceLog) else "motion"
    replaced: dict[str, object] = {}
    if where:
        replaced["where"] = {
            name: [word.strip() for word in words.split(",")]
            for name, words in _assignments(where).items()
        }
    if columns:
        entries: dict[Any, ColumnEntry] = {**source.columns}
        for quantity, name in read_log_columns(columns, kind).items():
            column = int(name) if name.isdigit() else name
            stated = entries.get(quantity)
            if stated is None or stated.column is None:
                entries[quantity] = ColumnEntry(column=column)
            else:
                entries[quantity] = stated.model_copy(update={"column": column, "plus": None})
        replaced["columns"] = entries
    return source.model_copy(update=replaced)


_assignments = lru_cache(256)(read_assignments)


def columns_asked(source: AnyLog, gauges: Iterable[str] = ()) -> set[str]:
    """Names of the columns that the config asks for (3 as ``column 3``), and of all quantities of such a log.

    A reader leaves out the others. `gauges`: Names of the columns that a calibration turns into forces.
    """
    names_asked = set()
    for entry in source.columns.values():
        if entry.column is not None:
            names_asked.add(_column_name(entry.column))
        if entry.plus is not None:
            names_asked.add(_column_name(entry.plus.column))
    if isinstance(source, ForceLog):
        return names_asked.union(FORCE_QUANTITIES, gauges, ["arm_moving"])
    return names_asked.union(MOTION_QUANTITIES)


def convert_gauges(log: Log, calibration: Calibration | None, units: Mapping[str, str]) -> Log:
    """Turn the readings of gauges into forces and torques by the calibration; without one, return the log unchanged.

    Each load is a row of the calibration matrix times the gauges. `units`: those of `chain_units`.
    """
    if calibration is None:
        return log
    absent = [name for name in calibration.gauges if name not in log.columns]
    if absent:
        listed = "; ".join(unknown_word("column", name, log.columns) for name in absent)
        raise LogError("columns", f"{log.path}: force_log.calibration: {listed}", log.rows)
    gauges = np.stack([log.columns[name] for name in calibration.gauges])
    columns, units_of_columns = dict(log.columns), dict(log.units)
    for load, unit, row in calibration.loads:
        factors = _factors_of(load)
        columns[load] = factors[unit] / factors[units[load]] * (np.array(row) @ gauges)
        units_of_columns[load] = units[load]
    return replace(log, columns=columns, units=units_of_columns)


def map_columns(log: Log, source: AnyLog, units: Mapping[str, str], key: str) -> Log:
    """Turn the columns of a log into quantities, by the section `key` of the config, `source`.

    A column that the config does not name is kept unchanged if its name is that of a quantity; if the config names no
    column at all, so is the log. All problems are raised together as one `LogError`; how a number was made is noted.

    `units`: Unit of each quantity, of `chain_units`.
    """
    # name of the column in the file, by quantity
    column_of: dict[str, str] = {
        quantity: log.name_of(_column_name(entry.column))
        for quantity, entry in source.columns.items()
    }
    unscaled = [
        f"{key}.columns.{name}: {_describe_unapplied_scaling(name, scaling)}"
        for name, scaling in log.unapplied.items()
        if name in units and name not in column_of and name not in column_of.values()
    ]
    if unscaled:
        raise LogError("columns", f"{log.path}: {'; '.join(unscaled)}", log.rows)
    if not source.columns:
        return log
    columns = {name: values for name, values in log.columns.items() if name in units}
    units_of_columns = {name: log.units.get(name, "") for name in columns}
    notes = list(log.notes)
    problems = []
    # time first: a rate needs it, whatever the file calls it
    for quantity, entry in sorted(source.columns.items(), key=lambda named: named[0] != "time"):
        clock = columns.get("time"), units_of_columns.get("time", "s")
        read = partial(_read_quantity, log, quantity, chain_unit=units[quantity], clock=clock)
        try:
            values, unit = read(entry)
            if entry.plus is not None:
                added = ColumnEntry(column=entry.plus.column, unit=entry.plus.unit)
                added_values, added_unit = read(added)
                factors = _factors_of(quantity)
                values = values + added_values * (factors[added_unit] / factors[unit])
            columns[quantity], units_of_columns[quantity] = values, unit
        except ValueError as error:
            problems.append(f"{key}.columns.{quantity}: {error}")
        notes += _describe_entry(quantity, entry, log.units.get(column_of[quantity], ""))
    if problems:
        raise LogError("columns", f"{log.path}: {'; '.join(problems)}", log.rows)
    # quantities whose column holds times of day, and such columns that were kept under their name
    clock_times = {quantity for quantity, name in column_of.items() if name in log.clock_times}
    clock_times |= log.clock_times & (columns.keys() - column_of.keys())
    return replace(
        log,
        columns=columns,
        units=units_of_columns,
        notes=tuple(map(str.strip, notes)),
        clock_times=frozenset(clock_times),
    )


def _describe_entry(quantity: str, entry: ColumnEntry, unit_in_file: str) -> list[str]:
    """Describe what the config or the unit of the file makes of a quantity, as notes of the log.

    They name units of mass that are taken as weights (kg as kgf), and a constant or a rate that is no measurement.
    """
    notes = []
    if quantity[0] == "F":
        notes += [
            f"{quantity}: {unit} is taken as {UNIT_OF_WEIGHT[unit]}, a weight"
            for unit in dict.fromkeys((entry.unit, unit_in_file))
            if unit in UNIT_OF_WEIGHT
        ]
    if entry.rate is not None:
        notes.append(f"{quantity} changes by {entry.rate:g} {entry.unit or ''}/s by the config")
    elif entry.constant is not None:
        notes.append(f"{quantity} is {entry.constant:g} {entry.unit or ''} by the config")
    return notes


def _describe_unapplied_scaling(name: str, scaling: str) -> str:
    """Describe a scaling of the column `name` that the file states but the program does not apply, and the cure.

    `scaling`: As the file states it.
    """
    return (
        f"the file says of {name}: {scaling}, which is not applied: add `factor:` (and `offset:`), so many units for each "
        "stored number; factor: 1 where the stored numbers are the values"
    )


def _column_name(column: str | int | None) -> str:
    """Name of a column that the config states by its name or by its number."""
    return f"column {column}" if isinstance(column, int) else str(column)


def _read_quantity(
    log: Log,
    quantity: str,
    entry: ColumnEntry,
    chain_unit: str,
    clock: tuple[FloatArray | None, str],
) -> tuple[FloatArray, str]:
    """Return the values of a quantity, shape (n,), and their unit: the chain unit where the config declares one.

    Without a declared unit the values stay as in the file, so that `unit_factor` can refuse an unexpected unit.

    `entry`: Of the config for this quantity: a column or a constant, ``factor``, ``offset``, ``unit``, ``rate`` per s.
    `chain_unit`: Unit in which later stages expect it, of `chain_units`.
    `clock`: Times of the log and their unit, for a quantity that changes at a stated rate; None if it has none.
    """
    if entry.constant is not None:
        values, stated = np.full(log.size, entry.constant), ""
        if entry.rate is not None:
            time, unit = clock
            if quantity == "time" or time is None:
                raise ValueError("a rate needs a time of the log: name its column")
            values += entry.rate * TIME_TO_S.get(unit, 1.0) * (time - time[:1])
    else:
        name = log.name_of(_column_name(entry.column))
        if name not in log.columns:
            raise ValueError(unknown_word("column", name, log.columns))
        values, stated = log.columns[name], log.units.get(name, "")
    # even `factor: 1` states how the numbers of the file are to be scaled
    scaled = not entry.model_fields_set.isdisjoint(("factor", "offset"))
    if entry.constant is None and name in log.unapplied and not scaled:
        raise ValueError(_describe_unapplied_scaling(name, log.unapplied[name]))
    if scaled:
        values = values * entry.factor + entry.offset
    if quantity == "arm_moving":
        return values, ""
    factors = _factors_of(quantity)
    declared: str = entry.unit or ""
    if quantity[0] == "F":
        stated, declared = (UNIT_OF_WEIGHT.get(unit, unit) for unit in (stated, declared))
    if declared and stated and declared != stated:
        if stated in factors:
            raise ValueError(f"the file says {stated}, the config {declared}: change one of them")
        if not scaled:
            raise ValueError(
                f"the file says {stated}, which is no unit of {quantity}: add `factor:`, so many "
                f"{declared} for each {stated}, and `offset:` if there is one"
            )
    unit = declared or stated
    if not unit:
        raise ValueError(f"the file states no unit: add `unit:`, one of {', '.join(factors)}")
    if unit not in factors:
        raise ValueError(f"{unit} is no unit of {quantity}; allowed: {', '.join(factors)}")
    # convert only what the config declares; `unit_factor` refuses any other difference
    if unit != chain_unit and (declared or quantity == "time"):
        return values * (factors[unit] / factors[chain_unit]), chain_unit
    return values, unit


def complete_motion_log(
    log: Log, run: Run, units: Mapping[str, str], middle_cm: float, surface_cm: float
) -> Log:
    """Add to a motion log what the run sheet states: beta, x of a vertical path, or the path of a position along it.

    Many machines log one position alone. Each addition is noted in the log; a quantity that is still lacking is an
    error.

    `middle_cm`, `surface_cm`: x and z of the arm where a path meets the surface. `units`: of `chain_units`.
    """
    columns, units_of_columns, notes = dict(log.columns), dict(log.units), list(log.notes)
    if "along" in columns:
        columns["x"], columns["z"] = _split_along_path(
            columns.pop("along"), run, units["x"], middle_cm, surface_cm
        )
        units_of_columns["x"] = units_of_columns["z"] = units_of_columns.pop("along")
        notes.append("x and z are those of the position along the path, by gamma of the run sheet")
    if not columns.keys() >= {*MOTION_QUANTITIES}:
        if "angle" not in columns and math.isfinite(run.beta_deg):
            columns["angle"], units_of_columns["angle"] = np.full(log.size, run.beta_deg), "deg"
            notes.append("beta is that of the run sheet: the motion log has no angle")
        elif "angle" not in columns and run.kind == "rod":
            # the tare of plates at any angle
            columns["angle"], units_of_columns["angle"] = np.zeros(log.size), "deg"
        if "x" not in columns and run.gamma_deg == 90:
            middle = middle_cm / LENGTH_TO_CM[units["x"]]
            columns["x"], units_of_columns["x"] = np.full(log.size, middle), units["x"]
            notes.append("x is the middle: the motion log has none, and the path is vertical")
        if lacking := [name for name in MOTION_QUANTITIES if name not in columns]:
            raise _missing_column_error(log, lacking, "motion")
        columns = {name: columns[name] for name in MOTION_QUANTITIES}
    return replace(log, columns=columns, units=units_of_columns, notes=tuple(notes))


def _split_along_path(
    along: FloatArray, run: Run, unit: str, middle_cm: float, surface_cm: float
) -> tuple[FloatArray, FloatArray]:
    """Return x and z of a position along the straight path of a run.

    `along` grows on the way in. `unit`: Unit of `along`, x and z. `middle_cm`, `surface_cm`: x and z where the path
    meets the surface, which is where `along` is 0 unless a surface is stated.
    """
    scale = LENGTH_TO_CM[unit]
    inward_gamma_deg = run.gamma_deg if run.gamma_deg >= 0 else run.gamma_deg + 180
    x, z = (float(component) for component in direction(math.radians(inward_gamma_deg)))
    if run.direction == "horizontal":
        return middle_cm / scale + along * x, along * z - run.depth_cm / scale
    along_at_surface = surface_cm / scale / z
    return middle_cm / scale + (along - along_at_surface) * x, along * z


def check_complete(log: Log, run: Run, quantities: tuple[str, ...], kind: str) -> Log:
    """Return the log if it has a column of each quantity; else raise `LogError`.

    Without F1 or x it may be the other log of the run: the message asks whether the two are swapped. `quantities`:
    `FORCE_QUANTITIES` or `MOTION_QUANTITIES`. `kind`: ``force`` or ``motion``, for the message.
    """
    lacking = [name for name in quantities if name not in log.columns]
    if not lacking:
        return log
    if quantities[1] in lacking and run.force_log != run.motion_log:
        message = f"{log.path}: this is not a {kind} log (no column for {quantities[1]})"
        raise LogError("wrong_kind", f"{message}; are the two logs of the run swapped?", log.rows)
    raise _missing_column_error(log, lacking, kind)


def _missing_column_error(log: Log, lacking: list[str], kind: str) -> LogError:
    """Make the error of a log without columns for some quantities; `kind`: ``force`` or ``motion``."""
    message = f"{log.path}: no column for {', '.join(lacking)}; name it under {kind}_log.columns"
    return LogError("columns", f"{message} (`rftfit inspect` shows the columns)", log.rows)
