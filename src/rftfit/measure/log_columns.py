"""Turn the columns of a log into quantities in the units of the program, by the config and the row of the run sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
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
"""Factors of the units of a quantity, by its name or the first letter of that."""
LogKey = Literal["force_log", "motion_log"]
"""Section of the config about a log, and column of the run sheet with its file."""
FORCE_QUANTITIES, MOTION_QUANTITIES = ("time", "F1", "F2", "F3"), ("time", "x", "z", "angle")


def unit_factor(table: dict[str, float], in_file: str, declared: str, quantity: str) -> float:
    """Return the factor to N, cm, rad or s; refuse a log whose unit is not that of the config.

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
    """Return the unit of each quantity in which later stages expect a log: that of the config, or a fixed one."""
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
    """Return how a log is written, with what a row of the run sheet says in place of the config."""
    if not where and not columns:
        return source
    kind: LogKind = "force" if isinstance(source, ForceLog) else "motion"
    changed: dict[str, object] = {}
    if where:
        changed["where"] = {
            name: [word.strip() for word in words.split(",")]
            for name, words in _assignments(where).items()
        }
    if columns:
        columns_of_row: dict[str, ColumnEntry] = {}
        for quantity, name in read_log_columns(columns, kind).items():
            stated = source.columns.get(quantity)  # type: ignore[call-overload]
            as_given = name if not name.isdigit() else int(name)
            if stated is None or stated.column is None:
                columns_of_row[quantity] = ColumnEntry(column=as_given)
            else:
                columns_of_row[quantity] = stated.model_copy(
                    update={"column": as_given, "plus": None}
                )
        every: dict[Any, ColumnEntry] = {**source.columns, **columns_of_row}
        changed["columns"] = every
    return source.model_copy(update=changed)


_assignments = lru_cache(256)(read_assignments)


def columns_asked(source: AnyLog, gauges: Iterable[str] = ()) -> set[str]:
    """Names of the columns that the config asks for (3 as ``column 3``), and of all quantities of such a log."""
    chosen_columns = list(source.columns.values())
    added_columns = [column.plus.column for column in chosen_columns if column.plus is not None]
    names_asked = {
        _column_name(column)
        for column in (*(chosen.column for chosen in chosen_columns), *added_columns)
        if column is not None
    }
    if isinstance(source, ForceLog):
        return names_asked.union(FORCE_QUANTITIES, gauges, ["arm_moving"])
    return names_asked.union(MOTION_QUANTITIES)


def convert_gauges(log: Log, calibration: Calibration | None, units: Mapping[str, str]) -> Log:
    """Turn the readings of gauges into forces and torques by the calibration; `units`: those of `chain_units`."""
    if calibration is None:
        return log
    absent = [name for name in calibration.gauges if name not in log.columns]
    if absent:
        listed = "; ".join(unknown_word("column", name, log.columns) for name in absent)
        raise LogError("columns", f"{log.path}: force_log.calibration: {listed}", log.rows)
    gauges = np.stack([log.columns[name] for name in calibration.gauges])
    columns, units_of_columns = dict(log.columns), dict(log.units)
    for load, unit, row in calibration.loads:
        table = _UNIT_FACTORS[load[0]]
        columns[load] = table[unit] / table[units[load]] * (np.array(row) @ gauges)
        units_of_columns[load] = units[load]
    return replace(log, columns=columns, units=units_of_columns)


def map_columns(log: Log, source: AnyLog, units: Mapping[str, str], key: str) -> Log:
    """Turn the columns of a log into quantities, by the section `key` of the config.

    A column that the config does not name is kept unchanged if its name is that of a quantity.
    `units`: Unit of each quantity, of `chain_units`.
    """
    named = {log.name_of(_column_name(chosen.column)) for chosen in source.columns.values()}
    unscaled = [
        f"{key}.columns.{name}: {_describe_unapplied_scaling(name, what)}"
        for name, what in log.unapplied.items()
        if name in units and name not in named and name not in source.columns
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
    for quantity, chosen in sorted(source.columns.items(), key=lambda entry: entry[0] != "time"):
        clock = columns.get("time"), units_of_columns.get("time", "s")
        try:
            columns[quantity], units_of_columns[quantity] = _read_sum_of_columns(
                log, quantity, chosen, units[quantity], clock
            )
        except ValueError as error:
            problems.append(f"{key}.columns.{quantity}: {error}")
        stated = (
            log.units.get(log.name_of(_column_name(chosen.column)), "") if chosen.column else ""
        )
        if quantity[0] == "F":
            notes += [
                f"{quantity}: {unit} is taken as {UNIT_OF_WEIGHT[unit]}, a weight"
                for unit in dict.fromkeys((chosen.unit, stated))
                if unit in UNIT_OF_WEIGHT
            ]
        if chosen.rate is not None:
            rate = f"{chosen.rate:g} {chosen.unit or ''}/s"
            notes.append(f"{quantity} changes by {rate} by the config")
        elif chosen.constant is not None:
            notes.append(f"{quantity} is {chosen.constant:g} {chosen.unit or ''} by the config")
    if problems:
        raise LogError("columns", f"{log.path}: {'; '.join(problems)}", log.rows)
    return replace(
        log,
        columns=columns,
        units=units_of_columns,
        notes=tuple(map(str.strip, notes)),
        clock_times=frozenset(
            quantity
            for quantity, chosen in source.columns.items()
            if log.name_of(_column_name(chosen.column)) in log.clock_times
        )
        | (log.clock_times & {*columns} - {*source.columns}),
    )


def _describe_unapplied_scaling(name: str, scaling: str) -> str:
    """Describe a scaling that the file states but the program does not apply, and how the config settles it."""
    return (
        f"the file says of {name}: {scaling}, which is not applied: add `factor:` (and `offset:`), so many units for each "
        "stored number; factor: 1 where the stored numbers are the values"
    )


def _column_name(column: str | int | None) -> str:
    """Name of a column that the config states by its name or by its number."""
    return f"column {column}" if isinstance(column, int) else str(column)


def _read_sum_of_columns(
    log: Log,
    quantity: str,
    chosen: ColumnEntry,
    chain_unit: str,
    clock: tuple[FloatArray | None, str],
) -> tuple[FloatArray, str]:
    """Return the values of a quantity and their unit; adds a second column where the config names one."""
    values, unit = _read_quantity(log, quantity, chosen, chain_unit, clock)
    if chosen.plus is None:
        return values, unit
    second = ColumnEntry(column=chosen.plus.column, unit=chosen.plus.unit)
    second_values, second_unit = _read_quantity(log, quantity, second, chain_unit, clock)
    table = _UNIT_FACTORS.get(quantity, _UNIT_FACTORS.get(quantity[0], {}))
    return values + second_values * (table[second_unit] / table[unit]), unit


def _read_quantity(
    log: Log,
    quantity: str,
    chosen: ColumnEntry,
    chain_unit: str,
    clock: tuple[FloatArray | None, str],
) -> tuple[FloatArray, str]:
    """Return the values of a quantity and their unit.

    `chosen`: Entry of the config for this quantity.
    `clock`: Times of the log and their unit, for a quantity that changes at a stated rate; None if not known.
    """
    if chosen.constant is not None:
        values, stated = np.full(log.size, chosen.constant), ""
        if chosen.rate is not None:
            time, unit = clock
            if quantity == "time" or time is None:
                raise ValueError("a rate needs a time of the log: name its column")
            values += chosen.rate * TIME_TO_S.get(unit, 1.0) * (time - time[:1])
    else:
        name = log.name_of(_column_name(chosen.column))
        if name not in log.columns:
            raise ValueError(unknown_word("column", name, log.columns))
        values, stated = log.columns[name], log.units.get(name, "")
    # even `factor: 1` states how the numbers of the file are to be scaled
    scaled = not chosen.model_fields_set.isdisjoint(("factor", "offset"))
    if chosen.constant is None and name in log.unapplied and not scaled:
        raise ValueError(_describe_unapplied_scaling(name, log.unapplied[name]))
    if scaled:
        values = values * chosen.factor + chosen.offset
    if quantity == "arm_moving":
        return values, ""
    table = _UNIT_FACTORS.get(quantity, _UNIT_FACTORS.get(quantity[0], {}))
    declared: str = chosen.unit or ""
    if quantity[0] == "F":
        stated, declared = (UNIT_OF_WEIGHT.get(unit, unit) for unit in (stated, declared))
    if declared and stated and declared != stated:
        if stated in table:
            raise ValueError(f"the file says {stated}, the config {declared}: change one of them")
        if not scaled:
            raise ValueError(
                f"the file says {stated}, which is no unit of {quantity}: add `factor:`, so many "
                f"{declared} for each {stated}, and `offset:` if there is one"
            )
    unit = declared or stated
    if not unit:
        raise ValueError(f"the file states no unit: add `unit:`, one of {', '.join(table)}")
    if unit not in table:
        raise ValueError(f"{unit} is no unit of {quantity}; allowed: {', '.join(table)}")
    # convert only what the config declares; `unit_factor` refuses any other difference
    if unit != chain_unit and (declared or quantity == "time"):
        return values * (table[unit] / table[chain_unit]), chain_unit
    return values, unit


def complete_motion_log(
    log: Log, run: Run, units: Mapping[str, str], middle_cm: float = 0.0
) -> Log:
    """Add to a motion log what the run sheet states: beta, x of a vertical path, or the path of a position along it."""
    columns, units_of_columns, notes = dict(log.columns), dict(log.units), list(log.notes)
    if "along" in columns:
        columns["x"], columns["z"] = _split_along_path(
            columns.pop("along"), run, units["x"], middle_cm
        )
        units_of_columns["x"] = units_of_columns["z"] = units_of_columns.pop("along")
        notes.append("x and z are those of the position along the path, by gamma of the run sheet")
    lacking = [name for name in MOTION_QUANTITIES if name not in columns]
    if not lacking:
        return replace(log, columns=columns, units=units_of_columns, notes=tuple(notes))
    if "angle" in lacking and run.kind == "rod" and not math.isfinite(run.beta_deg):
        # the tare of plates at any angle
        columns["angle"], units_of_columns["angle"] = np.zeros(log.size), "deg"
        lacking.remove("angle")
    if "angle" in lacking and math.isfinite(run.beta_deg):
        columns["angle"], units_of_columns["angle"] = np.full(log.size, run.beta_deg), "deg"
        notes.append("beta is that of the run sheet: the motion log has no angle")
        lacking.remove("angle")
    if "x" in lacking and run.gamma_deg == 90:
        middle = middle_cm / LENGTH_TO_CM[units["x"]]
        columns["x"], units_of_columns["x"] = np.full(log.size, middle), units["x"]
        notes.append("x is the middle: the motion log has none, and the path is vertical")
        lacking.remove("x")
    if lacking:
        raise _missing_column_error(log, lacking, "motion")
    order = {name: columns[name] for name in MOTION_QUANTITIES}
    return replace(log, columns=order, units=units_of_columns, notes=tuple(notes))


def _split_along_path(
    along: FloatArray, run: Run, unit: str, middle_cm: float
) -> tuple[FloatArray, FloatArray]:
    """Return x and z of a position along the straight path of a run.

    `along` is 0 at the surface and grows on the way in. `unit`: Unit of `along`, x and z.
    """
    scale = LENGTH_TO_CM[unit]
    inward_gamma_deg = run.gamma_deg if run.gamma_deg >= 0 else run.gamma_deg + 180
    x, z = (float(component) for component in direction(math.radians(inward_gamma_deg)))
    level = run.depth_cm / scale if run.direction == "horizontal" else 0.0
    return middle_cm / scale + along * x, along * z - level


def check_complete(log: Log, run: Run, quantities: tuple[str, ...], kind: str) -> Log:
    """Return the log if it has a column of each quantity; else raise `LogError`. `kind`: ``force`` or ``motion``."""
    lacking = [name for name in quantities if name not in log.columns]
    if not lacking:
        return log
    if quantities[1] in lacking and run.force_log != run.motion_log:
        text = f"{log.path}: this is not a {kind} log (no column for {quantities[1]})"
        raise LogError("wrong_kind", f"{text}; are the two logs of the run swapped?", log.rows)
    raise _missing_column_error(log, lacking, kind)


def _missing_column_error(log: Log, lacking: list[str], kind: str) -> LogError:
    """Make the error of a log without columns for some quantities; `kind`: ``force`` or ``motion``."""
    text = f"{log.path}: no column for {', '.join(lacking)}; name it under {kind}_log.columns"
    return LogError("columns", f"{text} (`rftfit inspect` shows the columns)", log.rows)
