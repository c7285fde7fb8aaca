"""The two logs of a run, read, in the units of the program, with a usable time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from rftfit.campaign.calibration import Calibration
from rftfit.campaign.config import AnyLog, Column, Config, ForceLog
from rftfit.campaign.load import Campaign
from rftfit.campaign.problems import unknown_word
from rftfit.campaign.row_sources import source_of_row
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray, direction
from rftfit.logs.base import Log, LogError, Reader
from rftfit.logs.registry import source_reader
from rftfit.measure.flags import BACKWARDS, DUPLICATE, Refused, Remark, quoted
from rftfit.measure.readings import (
    without_holds,
    without_lone_positions,
    without_missing,
    without_spikes,
)

TORQUE_TO_N_M = {"N m": 1.0, "N mm": 1e-3}
FORCE_TO_N = {
    "N": 1.0,
    "mN": 1e-3,
    "kN": 1e3,
    "lbf": 4.4482216152605,
    "klbf": 4448.2216152605,
    "kgf": 9.80665,
    "gf": 9.80665e-3,
}
LENGTH_TO_CM = {"um": 1e-4, "mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}
ANGLE_TO_RAD = {"deg": math.pi / 180, "rad": 1.0}
TIME_TO_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}


def factor(table: dict[str, float], in_file: str, declared: str, quantity: str) -> float:
    """Return the factor to N, cm, rad or s, if log and config agree on the unit of a `quantity`."""
    if in_file != declared:
        raise Refused(
            "other-unit", quantity=quantity, found=in_file or "no unit", declared=declared
        )
    if in_file not in table:
        raise Refused("unknown-unit", quantity=quantity, found=in_file, allowed=", ".join(table))
    return table[in_file]


_TABLES = dict.fromkeys(("x", "z", "along"), LENGTH_TO_CM)
_TABLES |= {"time": TIME_TO_S, "F": FORCE_TO_N, "T": TORQUE_TO_N_M, "angle": ANGLE_TO_RAD}
LogKey = Literal["force_log", "motion_log"]
_FORCE, _MOTION = ("time", "F1", "F2", "F3"), ("time", "x", "z", "angle")


def chain_units(config: Config) -> dict[str, str]:
    """Return the unit of each quantity in which the chain takes a log."""
    force = dict.fromkeys(("F1", "F2", "F3"), config.transducer.force_unit)
    torque = dict.fromkeys(("T1", "T2", "T3"), "N m")
    position = dict.fromkeys(("x", "z", "along"), config.arm.position_unit)
    return {**force, **torque, **position, "time": "s", "angle": "deg", "arm_moving": ""}


def columns_asked(source: AnyLog, gauges: Iterable[str] = ()) -> set[str]:
    """Names of the columns that the config asks for (3 as ``column 3``), and of all quantities."""
    chosen_columns = list(source.columns.values())
    added_columns = [column.plus.column for column in chosen_columns if column.plus is not None]
    chosen = {
        _name(column)
        for column in (*(chosen.column for chosen in chosen_columns), *added_columns)
        if column is not None
    }
    if isinstance(source, ForceLog):
        return chosen.union(_FORCE, gauges, ["arm_moving"])
    return chosen.union(_MOTION)


def loads(log: Log, calibration: Calibration | None, units: Mapping[str, str]) -> Log:
    """Turn the readings of gauges into the loads that the calibration makes of them."""
    if calibration is None:
        return log
    absent = [name for name in calibration.gauges if name not in log.columns]
    if absent:
        listed = "; ".join(unknown_word("column", name, log.columns) for name in absent)
        raise LogError("columns", f"{log.path}: force_log.calibration: {listed}", log.rows)
    gauges = np.stack([log.columns[name] for name in calibration.gauges])
    columns, units_of_columns = dict(log.columns), dict(log.units)
    for load, unit, row in calibration.loads:
        table = _TABLES[load[0]]
        columns[load] = table[unit] / table[units[load]] * (np.array(row) @ gauges)
        units_of_columns[load] = units[load]
    return replace(log, columns=columns, units=units_of_columns)


def mapped(log: Log, source: AnyLog, units: Mapping[str, str], key: str) -> Log:
    """Turn the columns of a log into quantities, by the section `key` of the config.

    Columns that the config does not name are taken as they are where their name is a quantity.
    `units` are those of `chain_units`.
    """
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
            columns[quantity], units_of_columns[quantity] = _sum_of_columns(
                log, quantity, chosen, units[quantity], clock
            )
        except ValueError as error:
            problems.append(f"{key}.columns.{quantity}: {error}")
        if chosen.rate is not None:
            rate = f"{chosen.rate:g} {chosen.unit or ''}/s"
            notes.append(f"{quantity} changes by {rate} by the config")
        elif chosen.constant is not None:
            notes.append(f"{quantity} is {chosen.constant:g} {chosen.unit or ''} by the config")
    if problems:
        raise LogError("columns", f"{log.path}: {'; '.join(problems)}", log.rows)
    return replace(log, columns=columns, units=units_of_columns, notes=tuple(map(str.strip, notes)))


def _name(column: str | int | None) -> str:
    return f"column {column}" if isinstance(column, int) else str(column)


def _sum_of_columns(
    log: Log, quantity: str, chosen: Column, chain_unit: str, clock: tuple[FloatArray | None, str]
) -> tuple[FloatArray, str]:
    """Values of a quantity, and their unit, with those of a second column where the config names one."""
    values, unit = _column(log, quantity, chosen, chain_unit, clock)
    if chosen.plus is None:
        return values, unit
    second = Column(column=chosen.plus.column, unit=chosen.plus.unit)
    second_values, its_unit = _column(log, quantity, second, chain_unit, clock)
    table = _TABLES.get(quantity, _TABLES.get(quantity[0], {}))
    return values + second_values * (table[its_unit] / table[unit]), unit


def _column(
    log: Log, quantity: str, chosen: Column, chain_unit: str, clock: tuple[FloatArray | None, str]
) -> tuple[FloatArray, str]:
    """Values of a quantity, and their unit; `clock`: time of the log, if it is known, and its unit."""
    if chosen.constant is not None:
        values, stated = np.full(log.size, chosen.constant), ""
        if chosen.rate is not None:
            time, unit = clock
            if quantity == "time" or time is None:
                raise ValueError("a rate needs a time of the log: name its column")
            values += chosen.rate * TIME_TO_S.get(unit, 1.0) * (time - time[:1])
    else:
        name = log.name_of(_name(chosen.column))
        if name not in log.columns:
            raise ValueError(unknown_word("column", name, log.columns))
        values, stated = log.columns[name], log.units.get(name, "")
    # who writes factor: 1 has said that a unit of the file is one of the quantity
    scaled = not chosen.model_fields_set.isdisjoint(("factor", "offset"))
    if scaled:
        values = values * chosen.factor + chosen.offset
    if quantity == "arm_moving":
        return values, ""
    table = _TABLES.get(quantity, _TABLES.get(quantity[0], {}))
    if chosen.unit and stated and chosen.unit != stated:
        if stated in table:
            raise ValueError(f"the file says {stated}, the config {chosen.unit}: which is right?")
        if not scaled:
            raise ValueError(
                f"the file says {stated}, which is no unit of {quantity}: add `factor:`, so many "
                f"{chosen.unit} for each {stated}, and `offset:` if there is one"
            )
    unit = chosen.unit or stated
    if not unit:
        raise ValueError(f"the file states no unit: add `unit:`, one of {', '.join(table)}")
    if unit not in table:
        raise ValueError(f"{unit} is no unit of {quantity}; allowed: {', '.join(table)}")
    # a conversion that somebody declared; any other difference is told where units are checked
    if unit != chain_unit and (chosen.unit or quantity == "time"):
        return values * (table[unit] / table[chain_unit]), chain_unit
    return values, unit


def completed(log: Log, run: Run, units: Mapping[str, str], middle_cm: float = 0.0) -> Log:
    """Give a motion log what the run sheet knows and the file does not: beta, or x of a vertical path."""
    columns, units_of_columns, notes = dict(log.columns), dict(log.units), list(log.notes)
    if "along" in columns:
        columns["x"], columns["z"] = _along_path(columns.pop("along"), run, units["x"], middle_cm)
        units_of_columns["x"] = units_of_columns["z"] = units_of_columns.pop("along")
        notes.append("x and z are those of the position along the path, by gamma of the run sheet")
    lacking = [name for name in _MOTION if name not in columns]
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
        raise _no_column(log, lacking, "motion")
    order = {name: columns[name] for name in _MOTION}
    return replace(log, columns=order, units=units_of_columns, notes=tuple(notes))


def _along_path(
    along: FloatArray, run: Run, unit: str, middle_cm: float
) -> tuple[FloatArray, FloatArray]:
    """X and z of a position along the straight path of a run, which is 0 at the surface and grows on the way in."""
    scale = LENGTH_TO_CM[unit]
    way_in = run.gamma_deg if run.gamma_deg >= 0 else run.gamma_deg + 180
    x, z = (float(share) for share in direction(math.radians(way_in)))
    level = run.depth_cm / scale if run.direction == "horizontal" else 0.0
    return middle_cm / scale + along * x, along * z - level


def clean(log: Log) -> Log:
    """Drop duplicated rows and rows whose time does not increase, and count them."""
    time = log.columns["time"]
    if time.size == 0:
        why = ", ".join(log.dropped)
        text = f"{log.path}: no usable row among {log.rows}{why and f': {why}'}"
        raise LogError("no_good_row", text, log.rows)
    if (time[1:] > time[:-1]).all():
        return log
    values = np.stack(list(log.columns.values()))
    repeated = np.zeros(time.size, dtype=bool)
    repeated[1:] = (values[:, 1:] == values[:, :-1]).all(axis=0)
    log = log.take(~repeated, DUPLICATE)
    time = log.columns["time"]
    latest = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    forward = time > latest
    if np.count_nonzero(forward) * 2 <= forward.size or _starts_again(forward):
        text = f"{log.path}: time does not increase in {np.count_nonzero(~forward)} of {time.size} rows"
        raise LogError("time", f"{text}; {_why_time_stands(time)}", log.rows)
    return log.take(forward, BACKWARDS)


def _why_time_stands(time: FloatArray) -> str:
    """Say what a time that does not grow probably is, and the cure."""
    steps = np.diff(time)
    n_backward = np.count_nonzero(steps < 0)
    if n_backward * 10 > np.count_nonzero(steps == 0):
        wraps = (
            "are several recordings in one file (force_where and motion_where in the run sheet, or `where` in the config, name "
            "the rows of one), or does a counter begin anew (micros() of Arduino)?"
        )
        return f"it runs backwards {n_backward} times: {wraps}"
    distinct = np.unique(time).size
    if distinct < 2:
        symptom = f"all rows have the time {time[0]:.10g}, as of a clock written with few digits"
    else:
        symptom = f"{time.size} rows share {distinct} times: the stamps are coarser than the rows"
    return (
        f"{symptom}; write them with more digits, or leave out the time and state the rate of the rows: "
        "rate_Hz, under text or options"
    )


_LONGEST_BACK = 0.1


def _starts_again(forward: npt.NDArray[np.bool_]) -> bool:
    """Whether time goes back and runs on from there over a tenth of the rows: another recording stands below."""
    edges = np.flatnonzero(np.diff(np.concatenate([[1], forward, [1]])))
    lengths = np.diff(edges)[::2]
    return bool(lengths.max(initial=0) > max(_LONGEST_BACK * forward.size, 20))


_USUAL_STEPS = 1.5
"""A step longer than so many usual ones has lost a reading."""


def gaps(time: FloatArray, longest_s: float) -> FloatArray:
    """Start and end of every step of an increasing time that is too long: (k, 2), s.

    That is longer than `longest_s` and than the steps of this log: a log of ten readings a second
    has no gap because 0.1 s is not exactly 0.1 s.
    """
    steps = np.diff(time)
    usual = float(np.median(steps)) if steps.size else 0.0
    late = np.flatnonzero(steps > max(longest_s, _USUAL_STEPS * usual))
    return np.stack([time[late], time[late + 1]], axis=1)


_AT_A_TIME = 32


@dataclass(frozen=True)
class Pair:
    """Force and motion log of one run, and its log without load; an unusable one is its error."""

    force: Log | LogError
    motion: Log | LogError
    zero: Log | LogError | None = None

    @property
    def problems(self) -> list[Remark]:
        """What is wrong with unusable logs."""
        logs = (self.force, self.motion, self.zero)
        # one file that holds both says it once
        return list(dict.fromkeys(quoted(log) for log in logs if isinstance(log, LogError)))


def load_pairs(campaign: Campaign, runs: Sequence[Run]) -> Iterator[tuple[Run, Pair]]:
    """Read the logs of many runs, in their order; whatever is wrong with them is told, not raised.

    Some runs are read at a time, which is faster than one by one and keeps memory flat.
    """
    config, units = campaign.config, chain_units(campaign.config)
    without_lone_forces = partial(without_spikes, quantities=_FORCE[1:])

    def force(run: Run, log: Log) -> Log:
        log = without_missing(log, config.force_log.missing)
        log = loads(log, campaign.calibration, units)
        source = source_of(config, run, "force_log")
        return _complete(mapped(log, source, units, "force_log"), run, _FORCE, "force")

    def motion(run: Run, log: Log) -> Log:
        log = without_missing(log, config.motion_log.missing)
        log = mapped(log, source_of(config, run, "motion_log"), units, "motion_log")
        if not {"z", "along"}.isdisjoint(log.columns):
            log = completed(log, run, units, config.arm.middle_x_mm / 10)
        return _complete(log, run, _MOTION, "motion")

    zeros: dict[tuple[str, ...], Log | LogError] = {}
    for start in range(0, len(runs), _AT_A_TIME):
        runs_together = runs[start : start + _AT_A_TIME]
        # of several runs with one zero log the first
        run_of_zero = {
            _zero(run): run
            for run in reversed(runs_together)
            if run.zero_log and _zero(run) not in zeros
        }
        zero_files = [run.zero_log for run in run_of_zero.values()]
        zero_logs = _read(campaign, [*run_of_zero.values()], "force_log", zero_files)
        force_logs = _read(
            campaign, runs_together, "force_log", [run.force_log for run in runs_together]
        )
        motion_logs = _read(
            campaign, runs_together, "motion_log", [run.motion_log for run in runs_together]
        )
        for (key, run), log in zip(run_of_zero.items(), zero_logs, strict=True):
            zeros[key] = _usable(
                campaign, run.zero_log, log, partial(force, run), without_lone_forces
            )
        for run, force_log, motion_log in zip(runs_together, force_logs, motion_logs, strict=True):
            loaded = _usable(
                campaign, run.force_log, force_log, partial(force, run), without_lone_forces
            )
            path = _usable(
                campaign, run.motion_log, motion_log, partial(motion, run), without_lone_positions
            )
            path = without_holds(path) if isinstance(path, Log) else path
            yield run, Pair(loaded, path, zeros.get(_zero(run)))


def _zero(run: Run) -> tuple[str, str, str]:
    """The zero log of a run, and which of its rows and columns are the run's."""
    return run.zero_log, run.force_where, run.force_columns


def source_of(config: Config, run: Run, key: LogKey) -> AnyLog:
    """Return how a log of a run is written: as the config says, or the row of the run sheet."""
    if key == "force_log":
        return source_of_row(config.force_log, run.force_where, run.force_columns)
    return source_of_row(config.motion_log, run.motion_where, run.motion_columns)


def _read(
    campaign: Campaign, runs: Sequence[Run], key: LogKey, files: Sequence[str]
) -> list[Log | LogError]:
    """Read one log of each run, those that are written alike together."""
    kind = key.removesuffix("_log")
    indexes_by_form: dict[tuple[str, str], list[int]] = {}
    for index, run in enumerate(runs):
        form = getattr(run, f"{kind}_where"), getattr(run, f"{kind}_columns")
        indexes_by_form.setdefault(form, []).append(index)
    logs: dict[int, Log | LogError] = {}
    for indexes in indexes_by_form.values():
        reader = _reader(campaign, source_of(campaign.config, runs[indexes[0]], key), key)
        paths = [campaign.raw / files[index] for index in indexes]
        logs |= zip(indexes, reader.load_many(paths), strict=True)
    return [logs[index] for index in range(len(runs))]


def same_table(config: Config, run: Run) -> bool:
    """Tell whether force and motion of a run are the same rows of one table: a line may hold both."""

    def table(key: LogKey) -> tuple[object, ...]:
        source = source_of(config, run, key)
        dialect = source.dialect or config.dialect
        return source.text, dialect, source.options, source.where_words

    return run.force_log == run.motion_log and table("force_log") == table("motion_log")


def readers(campaign: Campaign, run: Run | None = None) -> tuple[Reader, Reader]:
    """Return the readers of force and of motion logs, of the columns only that the config names.

    `run`: Whose row of the run sheet may name others.
    """
    config = campaign.config
    keys: tuple[LogKey, LogKey] = ("force_log", "motion_log")
    force, motion = (
        getattr(config, key) if run is None else source_of(config, run, key) for key in keys
    )
    return _reader(campaign, force, "force_log"), _reader(campaign, motion, "motion_log")


def _reader(campaign: Campaign, source: AnyLog, key: LogKey) -> Reader:
    calibration = campaign.calibration
    gauges = calibration.gauges if calibration is not None else ()
    reader = source_reader(source, campaign.config.dialect, key)
    asks = source.columns or (gauges and key == "force_log")
    return reader.only(columns_asked(source, gauges)) if asks else reader


def _complete(log: Log, run: Run, quantities: tuple[str, ...], kind: str) -> Log:
    lacking = [name for name in quantities if name not in log.columns]
    if not lacking:
        return log
    if quantities[1] in lacking and run.force_log != run.motion_log:
        text = f"{log.path}: this is not a {kind} log (no column for {quantities[1]})"
        raise LogError("wrong_kind", f"{text}; are the two logs of the run swapped?", log.rows)
    raise _no_column(log, lacking, kind)


def _no_column(log: Log, lacking: list[str], kind: str) -> LogError:
    text = f"{log.path}: no column for {', '.join(lacking)}; name it under {kind}_log.columns"
    return LogError("columns", f"{text} (`rftfit inspect` shows the columns)", log.rows)


def _usable(
    campaign: Campaign,
    file: str,
    log: Log | LogError,
    quantities: Callable[[Log], Log],
    without_lone: Callable[[Log], Log],
) -> Log | LogError:
    """Clean a log and leave out its lone readings, or say why it cannot be used, by the name in the run sheet."""
    try:
        if isinstance(log, LogError):
            raise log
        return without_lone(clean(quantities(log)))
    except LogError as error:
        # the folder of the raw data is the reader's business, not the ledger's
        text = str(error).replace(str(campaign.raw / file), file)
        return LogError(error.code, text, error.rows)
