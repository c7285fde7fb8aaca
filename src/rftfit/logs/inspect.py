"""Surveys a log that no run sheet names yet: its columns, clock and quantities, and the config lines for it.

It answers `rftfit inspect FILE`: which dialect (format of a program) reads the file (`recognised`), what is in it
(`survey`), what else is needed to measure with it (`describe_needs`), and the lines of config.yaml by which it can be
read (`config_block`). A *quantity* is what a column means for the measurement: time, arm_moving (the sync line: whether
the arm moves), forces F1 to F3, positions x and z, angle. Quantities are guessed from names and units, and the user is
told so. A log is read in *blocks*, a `Log` of some of its rows each.
"""

from __future__ import annotations

import json
import re
from collections import ChainMap, Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rftfit.campaign.config import TextFormat
from rftfit.campaign.files import BAG
from rftfit.campaign.problems import unknown_word
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.logs.base import NO_VALUE_AT_ALL, Log, LogError, MixedClocksError, Reader
from rftfit.logs.delimited import (
    DelimitedReader,
    encoding_of,
    guess_text_settings,
    read_first_lines,
)
from rftfit.logs.labels import heed_labels
from rftfit.logs.quantities import DOWNWARD, MEANING, epoch_unit, guesses
from rftfit.logs.registry import claimants, dialect, dialects, faults, read_head
from rftfit.logs.rostopic import ECHO, is_echo
from rftfit.store.chosen import chosen
from rftfit.table.parse import add_counts
from rftfit.table.text import is_web_page
from rftfit.table.units import COUNTED_TIMES, TIME_TO_S, units_like

_CHOSEN = chosen("logs", "survey")
GAP_STEPS: float = _CHOSEN.gap_steps
"""A step longer than this many median steps is shown as a gap."""


class ColumnExtreme(NamedTuple):
    """Lowest or highest value of a column: the value, how often it occurs, and the distinct value next to it.

    `inner`: This second lowest or second highest value; NaN where the column has one distinct value. The three show
    whether the extreme is a code for "no data" (`ColumnSummary.codes`).
    """

    value: float
    times: int
    inner: float

    @classmethod
    def of(cls, distinct: FloatArray, times: np.ndarray) -> ColumnExtreme:
        """Make the extreme of distinct values, sorted with the extreme first; `times`: count of each value."""
        inner = float(distinct[1]) if distinct.size > 1 else np.nan
        return cls(float(distinct[0]), int(times[0]), inner)

    def merged(self, next_extreme: ColumnExtreme, sign: int) -> ColumnExtreme:
        """Return the extreme of two parts of a column together; `sign`: -1 for the lowest value, 1 for the highest."""
        # value, to how often it occurs: that is known of the extremes, and needed of no other value
        counts: Counter[float] = Counter()
        for extreme in (self, next_extreme):
            counts.update({extreme.value: extreme.times, extreme.inner: 0})
        stated = [value for value in counts if np.isfinite(value)]
        distinct = np.array(sorted(stated, reverse=sign > 0))
        return ColumnExtreme.of(distinct, np.array([counts[value] for value in distinct]))


@dataclass(frozen=True)
class ColumnSummary:
    """One column of a log; the numbers are NaN if there is no usable row.

    `quantity`: Meaning of the guessed quantity, or "-". `resolution`: Smallest step between two distinct values; NaN
    if there are not two. `values`: Number of rows with a number in this column. `ends`: Its lowest and highest value;
    empty without values.
    """

    name: str
    quantity: str
    unit: str
    lowest: float
    highest: float
    resolution: float
    values: int
    ends: tuple[ColumnExtreme, ...] = ()

    @property
    def codes(self) -> list[float]:
        """Values that seem to mean "no data", as -9999: lowest or highest, repeated, and far from all others."""
        codes = []
        for end, opposite_end in zip(self.ends, reversed(self.ends), strict=True):
            # span of the other values; the opposite end may be a code, too: the smaller span leaves it out
            span = min(abs(end.inner - opposite_end.value), abs(end.inner - opposite_end.inner))
            if end.times > 1 and abs(end.value - end.inner) > max(span, self.resolution):
                codes.append(end.value)
        return codes


@dataclass
class TimeColumn:
    """Steps, gaps and range of the time column of a log, in the unit of the column, added up block by block.

    `step`, `jitter`: Median step between rows that go forward, and the median departure from it, in
    the first block; NaN if it has fewer than two rows. `gaps`: Start and length of the first ten
    thousand steps longer than `GAP_STEPS` median steps. `repeated`, `backwards`: Number of rows whose time
    equals the time of the row before, or is earlier. `first`, `last`: Earliest and latest time; infinite without rows.
    `_before`: Last time of the block before; None: there is none.
    """

    step: float = float("nan")
    jitter: float = float("nan")
    gaps: list[tuple[float, float]] = field(default_factory=list)
    repeated: int = 0
    backwards: int = 0
    first: float = float("inf")
    last: float = float("-inf")
    _before: float | None = None

    @property
    def duration(self) -> float:
        """Time from the earliest to the latest row."""
        return max(self.last - self.first, 0.0)

    @property
    def rate(self) -> float:
        """Rows per unit of time."""
        return 1 / self.step if self.step > 0 else float("nan")

    def add(self, time: FloatArray) -> None:
        """Add the times of the next rows, shape (n,), finite."""
        if time.size == 0:
            return
        if self._before is not None:
            time = np.concatenate([[self._before], time])
        steps = np.diff(time)
        forward = steps[steps > 0]
        if forward.size and not self.step > 0:
            self.step = float(np.median(forward))
            self.jitter = float(np.median(np.abs(forward - self.step)))
        if self.step > 0:
            gaps = np.flatnonzero(steps > GAP_STEPS * self.step)[: _CHOSEN.gaps - len(self.gaps)]
            self.gaps += [(float(time[i]), float(steps[i])) for i in gaps]
        self.repeated += int(np.count_nonzero(steps == 0))
        self.backwards += int(np.count_nonzero(steps < 0))
        self.first = min(self.first, float(time.min()))
        self.last = max(self.last, float(time.max()))
        self._before = float(time[-1])


@dataclass(frozen=True)
class Survey:
    """Facts on a log from one pass over its blocks.

    `units`: Column, to its unit. `clock`: None where no column is the time. `quantities`: Guessed quantity, to its
    column.
    `rows`, `used`: Number of data lines, and of those that can be read. `dropped`, `missing`, `notes`, `not_finite`,
    `unread`: As in `Log`. `moving`: Number of different values of the sync line, at most two; 0 where there is no sync
    line, 1 where it shows no motion.
    """

    path: Path
    columns: list[ColumnSummary]
    units: dict[str, str]
    clock: TimeColumn | None
    quantities: dict[str, str]
    rows: int
    used: int
    dropped: dict[str, int]
    missing: dict[str, int]
    notes: tuple[str, ...]
    moving: int
    not_finite: Mapping[str, int]
    unread: Mapping[str, str]

    @property
    def time_unit(self) -> str:
        """Unit that the file states for the time, or that its numbers suggest; else empty."""
        stated = self.units.get(self.quantities.get("time", ""), "")
        if stated or self.clock is None:
            return stated
        return epoch_unit(self.clock.first) or _unit_of_clock(self.clock)

    @property
    def rate_of_coarse_time(self) -> float | None:
        """Rows a second, Hz, where most rows share a time; 0 with too few times for a rate; None for a fine clock.

        Such a clock, as of whole seconds, cannot align forces with positions, but the number of the row over this rate
        can.
        """
        clock = self.clock
        if clock is None or not clock.repeated * 2 >= self.used > 1:
            return None
        duration = (clock.duration + clock.step) * TIME_TO_S.get(self.time_unit or "s", 1.0)
        stamps = self.used - clock.repeated
        return self.used / duration if stamps >= _CHOSEN.stamps and duration > 0 else 0.0


def survey(blocks: Iterable[Log]) -> Survey:
    """Survey a log block by block, so that memory stays bounded; there is at least one block."""
    blocks = iter(blocks)
    first = next(blocks)
    quantities = guesses(first)
    meanings = {column: MEANING[quantity] for quantity, column in quantities.items()}
    clock = TimeColumn()
    columns: list[ColumnSummary] = []
    rows = used = 0
    dropped: dict[str, int] = {}
    missing: dict[str, int] = {}
    not_finite: dict[str, int] = {}
    sync_values: set[float] = set()
    for log in chain([first], blocks):
        of_block = [_summarise_column(log, name, meanings.get(name, "-")) for name in log.columns]
        columns = [*map(_merge_summaries, columns or of_block, of_block)] if columns else of_block
        if "time" in quantities:
            clock.add(finite_values(log.columns[quantities["time"]]))
        if "arm_moving" in quantities and len(sync_values) < 2:
            sync_values.update(finite_values(np.unique(log.columns[quantities["arm_moving"]]))[:2])
        rows, used = rows + log.rows, used + log.size
        dropped, missing = add_counts(dropped, log.dropped), add_counts(missing, log.missing)
        not_finite = add_counts(not_finite, log.not_finite)
    return Survey(
        first.path,
        columns,
        first.units,
        clock if "time" in quantities else None,
        quantities,
        rows,
        used,
        dropped,
        missing,
        first.notes,
        moving=len(sync_values),
        not_finite=not_finite,
        unread=first.unread,
    )


def survey_file(reader: Reader, path: Path) -> tuple[list[Survey], LogError | None]:
    """Survey a file; where it has several clocks, survey each, and return the error by which it is no log, else None.

    Columns without any number are left out, and listed in `Survey.unread`.
    """
    try:
        log_survey = survey(heed_labels(log, reader) for log in reader.stream(path))
        without_numbers = {
            name: "no finite number"
            for name, n in log_survey.not_finite.items()
            if n == log_survey.rows
        }
        without_numbers |= {
            column.name: NO_VALUE_AT_ALL
            for column in log_survey.columns
            if log_survey.used and not column.values
        }
        if without_numbers and len(without_numbers) < len(log_survey.columns):
            # again without the channels that were never connected, which would spoil every row
            names = {column.name for column in log_survey.columns}
            usable_columns = reader.only(names - without_numbers.keys(), keeps_blanks=True)
            log_survey = survey(usable_columns.stream(path))
            log_survey = replace(log_survey, unread={**log_survey.unread, **without_numbers})
        return [log_survey], None
    except MixedClocksError as error:
        readers = [reader.only(group, keeps_blanks=True) for group in error.groups]
        return [s for of_group in readers for s in survey_file(of_group, path)[0]], error


def finite_values(values: FloatArray) -> FloatArray:
    """Return the numbers of a column without its blank cells, which are NaN."""
    return values[np.isfinite(values)]


def join_surveys(surveys: Sequence[Survey]) -> Survey:
    """Join the surveys of a file with several clocks, one each, to one survey of the whole file.

    Only units, quantities, used rows and sync line are joined; all else is that of the first clock.
    """
    # the first clock with a column or quantity counts
    units = ChainMap(*(log_survey.units for log_survey in surveys))
    quantities = ChainMap(*(log_survey.quantities for log_survey in surveys))
    return replace(
        surveys[0],
        units=dict(units),
        quantities=dict(quantities),
        used=min(log_survey.used for log_survey in surveys),
        moving=max(log_survey.moving for log_survey in surveys),
    )


def _summarise_column(log: Log, name: str, quantity: str) -> ColumnSummary:
    """Summarise a column of one block; `quantity`: as in `ColumnSummary`."""
    values, unit = finite_values(log.columns[name]), log.units.get(name, "")
    if values.size == 0:
        return ColumnSummary(name, quantity, unit, np.nan, np.nan, np.nan, 0)
    distinct, times = np.unique(values, return_counts=True)
    steps = np.diff(distinct)
    resolution = float(steps.min()) if steps.size else np.nan
    ends = (ColumnExtreme.of(distinct, times), ColumnExtreme.of(distinct[::-1], times[::-1]))
    lowest, highest = (end.value for end in ends)
    return ColumnSummary(name, quantity, unit, lowest, highest, resolution, values.size, ends)


def _merge_summaries(summary: ColumnSummary, block_summary: ColumnSummary) -> ColumnSummary:
    """Return the summary of a column so far joined with that of the next block."""
    ends = summary.ends or block_summary.ends
    if summary.ends and block_summary.ends:
        pairs = zip(summary.ends, block_summary.ends, (-1, 1), strict=True)
        ends = tuple(first.merged(second, sign) for first, second, sign in pairs)
    return replace(
        summary,
        lowest=float(np.fmin(summary.lowest, block_summary.lowest)),
        highest=float(np.fmax(summary.highest, block_summary.highest)),
        resolution=float(np.fmin(summary.resolution, block_summary.resolution)),
        values=summary.values + block_summary.values,
        ends=ends,
    )


# --- What a log needs beside it, and the lines of config by which `rftfit run` can read it


FORCE = ("time", "F1", "F2", "F3")
MOTION = ("time", "x", "z", "angle")
"""Quantities that a force log and a motion log hold."""

_USUAL_UNITS = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}
"""Quantity, to the unit that the config need not state; of all others N."""


def log_kinds(log_survey: Survey) -> list[str]:
    """Return the kinds of log that a file is, by its quantities and units: ``force``, ``motion``, both, or none."""
    # channels of any name may be in a unit of force
    has_force = _columns_with_unit_of("F1", log_survey) or {*FORCE[1:]} & {*log_survey.quantities}
    has_motion = {*MOTION[1:]} & {*log_survey.quantities}
    return ["force"] * bool(has_force) + ["motion"] * bool(has_motion)


def describe_needs(log_survey: Survey) -> list[str]:
    """Return a sentence for each thing that the measurement needs beyond this file: another log, a unit, a setting."""
    kinds = log_kinds(log_survey)
    needs = [] if "time" in log_survey.quantities else _describe_table_instead(log_survey)
    if kinds == ["force", "motion"]:
        needs.append("a row of the run sheet that names this file as both logs")
    else:
        missing_log = "the motion log of the same run (time, x, z, angle)"
        if kinds == ["motion"]:
            missing_log = "the force log of the same run (time, arm_moving, F1, F2, F3)"
        needs += [missing_log, "a row of the run sheet that names both"]
    if not kinds:
        needs.append("which columns are forces or positions: name them in the config")
    if "time" not in log_survey.quantities:
        needs.append("a time: the column that holds it, or rate_Hz, under text or options")
    elif log_survey.clock is not None and (rate := log_survey.rate_of_coarse_time) is not None:
        by_stamps = f" (its stamps give {rate:.4g})" if rate else ""
        needs.append(
            f"a finer time: {log_survey.clock.repeated} of {log_survey.used} rows have the time of the row before; "
            f"more digits, or no time and the rate of the rows, rate_Hz, under text or options{by_stamps}"
        )
    for kind, quantities in (("force", FORCE), ("motion", MOTION)):
        if kind in kinds:
            missing = [name for name in quantities[1:] if name not in log_survey.quantities]
            needs += [f"{name}: {MEANING[name]}; {_describe_substitute(name)}" for name in missing]
    unknown = [
        column
        for quantity, column in log_survey.quantities.items()
        if quantity != "arm_moving" and not log_survey.units.get(column)
    ]
    if unknown:
        needs.append(f"the unit of {', '.join(unknown)}: the file does not state it")
    if "force" in kinds:
        needs.append("transducer range, axes and turn, in config.yaml")
        needs += _clock_needs(log_survey, one_file="motion" in kinds)
    if "motion" in kinds:
        needs.append("the arm z of the free surface, in config.yaml or the run sheet")
    if log_survey.used < 2:
        needs.append("at least two usable rows")
    return needs


_STRESS = re.compile(r"stress|pressure|sigma|druck|spannung|(?<![a-z])q_?c|[^a-z]res$")
_STRESS_UNIT = re.compile(r"(N/(cm|m|mm)(\^?2|\u00b2)|[kM]?N/m(\^?2|\u00b2)|[kMG]?Pa|psi|bar)")
_DEPTH = re.compile(r"depth|sinkage|penetration|tiefe|dpth")
"""Names of columns, in small letters, of stress or depth; and units of stress."""


def _describe_table_instead(log_survey: Survey) -> list[str]:
    """Return a sentence if the file has force or stress against depth and no time: it is a table of stress, no log."""
    quantities = log_survey.quantities
    force = quantities.get("F3") or quantities.get("F1") or quantities.get("F2", "")
    stress = next(
        (
            column.name
            for column in log_survey.columns
            if _STRESS.search(column.name.casefold()) or _STRESS_UNIT.fullmatch(column.unit)
        ),
        "",
    )
    depth = quantities.get("z") or next(
        (column.name for column in log_survey.columns if _DEPTH.search(column.name.casefold())), ""
    )
    if not depth or not (force or stress):
        return []
    what = stress or f"{force} over the area of the plate"
    sentence = (
        f"{stress or force} against {depth} without a time is no log but a table of stress: all pushes in one "
        f"file of the columns beta_deg, gamma_deg, depth_mm ({depth}), stress_z_kPa ({what}), then "
        "rftfit init DIR --stress-table FILE; as a log it needs:"
    )
    return [sentence]


def _clock_needs(log_survey: Survey, *, one_file: bool) -> list[str]:
    """Return, in a list, a sentence if the clocks of force and motion cannot be aligned as the file stands; else none.

    `one_file`: Whether the file holds both.
    """
    if one_file:
        return ["clock.method same_clock in config.yaml: force and motion are columns of one file"]
    if "arm_moving" not in log_survey.quantities:
        need = "no sync line: set clock.method in config.yaml to estimate, or to same_clock where "
        return [f"{need}force and motion have one clock"]
    if log_survey.moving == 1:
        return ["a change of arm_moving: without one the two clocks cannot be joined"]
    return []


def _describe_substitute(name: str) -> str:
    """Return the words on what the user can do without a column of the quantity `name`, a force, position or angle."""
    if name == "angle":
        return "without it beta is taken from the run sheet"
    if name == "x":
        return (
            "without it only vertical paths can be used; a stage that moves along a slanted path has one position: "
            "name it along, in place of x and z"
        )
    if name == "z":
        return "name its column"
    return "a channel that nobody measured: {constant: 0, unit: N}, and its direction counts for 0"


def config_block(
    log_survey: Survey,
    dialect: str,
    text: Mapping[str, Any] | None = None,
    options: Mapping[str, object] | None = None,
) -> list[str]:
    """Return the lines of config for a log, as YAML, with comments on what the user has to check.

    `dialect`: Its name. `text`: Format of a log of the dialect ``delimited``, as keys of `text` in the config; None: of
    another dialect. `options`: Options of any other dialect.
    """
    if dialect == "rig":
        return ["dialect: rig"]
    lines = []
    kinds = log_kinds(log_survey)
    settings = dict((options or {}) if text is None else text)
    by_rate = "rate_Hz" in settings
    in_two_columns = bool(_nanoseconds_column(log_survey.quantities.get("time", ""), log_survey))
    rate = None if by_rate or in_two_columns else log_survey.rate_of_coarse_time
    if rate is not None:
        # a time so coarse would be refused: the rate of the rows replaces it
        by_rate = True
        kept = {name: column for name, column in log_survey.quantities.items() if name != "time"}
        log_survey = replace(log_survey, quantities=kept)
        if rate and (text is not None or "rate_Hz" in dialects()[dialect].takes):
            settings["rate_Hz"] = float(f"{rate:.4g}")
            lines.append("# rate_Hz: by the stamps of the file, coarser than its rows: check")
        else:
            lines.append(
                "# rate_Hz: the stamps of the file are coarser than its rows: state it, under text or options"
            )
    if not kinds:
        lines.append("# force_log: for a log of forces; write motion_log: for one of positions")
    for kind in kinds or ["force"]:
        lines.append(f"{kind}_log:")
        if text is None:
            lines.append(f"  dialect: {dialect}")
        if settings:
            listed = ", ".join(f"{key}: {format_scalar(value)}" for key, value in settings.items())
            lines.append(f"  {'options' if text is None else 'text'}: {{{listed}}}")
        quantities: tuple[str, ...] = FORCE if kind == "force" else MOTION
        if by_rate:
            quantities = quantities[1:]  # without time, which follows from the rate
        if kind == "force" and "arm_moving" in log_survey.quantities:
            quantities = (*quantities, "arm_moving")
        lines += _missing_line(log_survey, quantities)
        # where one file is both logs, the config has to name the columns of each
        is_both = len(kinds) == 2
        column_lines = [
            line for name in quantities for line in _column_line(log_survey, name, always=is_both)
        ]
        if any(not line.lstrip().startswith("#") for line in column_lines):
            lines.append("  columns:")
        elif column_lines:
            # a section of comments alone would be read as null
            lines.append("  columns: {} # quantity: column, a line each")
        lines += column_lines
    if len(kinds) == 2:
        lines.append("clock: {method: same_clock}")
    return lines


def _missing_line(log_survey: Survey, quantities: Iterable[str]) -> list[str]:
    """Return, in a list, the line of config with values that seem to mean "no data"; no line where there are none.

    Only columns of the `quantities` are searched, or all where no quantity is known.
    """
    column_names = {
        log_survey.quantities[name] for name in quantities if name in log_survey.quantities
    }
    columns = [
        column for column in log_survey.columns if column.name in column_names or not column_names
    ]
    codes = sorted({code for column in columns for code in column.codes})
    if not codes:
        return []
    listed = ", ".join(f"{code:.10g}" for code in codes)
    return [f"  missing: [{listed}] # outside of all others, several times: no data? check"]


_SECONDS = re.compile(r"(?i)(.*?)(s|secs?|seconds?)$")


def _nanoseconds_column(column: str, log_survey: Survey) -> str:
    """Return the column of nanoseconds that belongs to a column of whole seconds, as in ROS; empty where there is none.

    `column`: Name of the column of seconds.
    """
    match = _SECONDS.fullmatch(column)
    if match is None:
        return ""
    # stamp.nanosec for stamp.sec
    pattern = re.compile(rf"(?i){re.escape(match[1])}n(ano)?_?(s|secs?|seconds?)")
    names = (summary.name for summary in log_survey.columns)
    return next(filter(pattern.fullmatch, names), "")


_CLOCKS_OF_BOARDS = {"millis": "ms", "micros": "us"}
"""Function of Arduino that counts time, to its unit."""


def _column_line(log_survey: Survey, quantity: str, *, always: bool) -> list[str]:
    """Return, in a list, the line of config that says which column a quantity is.

    No line where name and unit of the column are already as expected, unless `always`; a comment where no column is it.
    """
    column = log_survey.quantities.get(quantity)
    if column is None:
        candidates = _columns_with_unit_of(quantity, log_survey)
        hint = f"; with such a unit: {', '.join(candidates)}" if candidates else ""
        return [f"    # {quantity}: no column looks like it{hint}"]
    unit = log_survey.units.get(column, "")
    has_unit = bool(unit) or quantity == "arm_moving"  # which needs none
    usual = _USUAL_UNITS.get(quantity, "N")
    is_usual_unit = quantity == "arm_moving" or unit == usual
    if column == quantity and is_usual_unit and (not always or quantity == "time"):
        return []
    number = re.fullmatch(r"column (\d+)", column)
    name = number[1] if number else format_scalar(column)
    if quantity in ("x", "z") and "pose" in column.casefold():
        usual = "m"  # robots state poses in metres
    if quantity == "time" and not has_unit:
        lowest = next(summary.lowest for summary in log_survey.columns if summary.name == column)
        of_board = _CLOCKS_OF_BOARDS.get(column.casefold(), "")
        usual = epoch_unit(lowest) or of_board or _unit_of_clock(log_survey.clock) or usual
    down = ", factor: -1" if quantity == "z" and DOWNWARD.search(column.casefold()) else ""
    if quantity == "time" and (nanoseconds := _nanoseconds_column(column, log_survey)):
        return [
            f"    time: {{column: {name}, unit: s, plus: {{column: {format_scalar(nanoseconds)}, unit: ns}}}}"
        ]
    if has_unit and not down and (quantity in ("time", "arm_moving") or unit == usual):
        return [f"    {quantity}: {name}"]
    # a unit that is missing, or is not the default of the quantity, has to be declared
    why = ""
    if not has_unit:
        unit, why = usual, " # the file states no unit: check"
    elif down:
        why = " # z points up: check"
    return [f"    {quantity}: {{column: {name}, unit: {unit}{down}}}{why}"]


def _columns_with_unit_of(quantity: str, log_survey: Survey) -> list[str]:
    """Return the columns without a guessed quantity whose stated unit fits this quantity: any of them may be it."""
    units = units_like(_USUAL_UNITS.get(quantity, "N"))
    guessed = log_survey.quantities.values()
    return [
        column
        for column, unit in log_survey.units.items()
        if unit in units and column not in guessed
    ]


def _unit_of_clock(clock: TimeColumn | None) -> str:
    """Return the unit in which a time column without a stated unit has a usual rate, as ``ms``; empty: none.

    Only for whole numbers, such as milliseconds or microseconds of a board.
    """
    if clock is None or not clock.step >= 1 or clock.step % 1:
        return ""
    steps_s = ((unit, clock.step * TIME_TO_S[unit]) for unit in COUNTED_TIMES)
    return next((unit for unit, step_s in steps_s if step_s < _CHOSEN.longest_step_s), "")


_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_./ ]*[A-Za-z0-9_]|[A-Za-z]")
"""Text that YAML reads as a text without quotes, unless it is one of the next words."""
_YAML_WORDS = frozenset({"y", "n", "yes", "no", "on", "off", "true", "false", "null"})


def format_scalar(value: object) -> str:
    """Return a value of a key as YAML, a text in quotes where YAML would read it as something else."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        plain = _PLAIN.fullmatch(value) and value.casefold() not in _YAML_WORDS
        return value if plain else json.dumps(value, ensure_ascii=False)
    return str(value)


# --- The reader of a file, and a refusal with advice where no dialect reads it


_EXPORTS = {
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls), or another file of Microsoft Office: save it as .xlsx",
    b"PK\x03\x04": "a zip archive: unpack it, and name the file inside",
    b"7z\xbc\xaf": "a 7z archive: unpack it, and name the file inside",
    b"Rar!": "a rar archive: unpack it, and name the file inside",
    b"\xfd7zXZ": "packed by xz: unpack it, or pack it by gzip, which is read",
    b"BZh": "packed by bzip2: unpack it, or pack it by gzip, which is read",
    b"\x28\xb5\x2f\xfd": "packed by zstd: unpack it, or pack it by gzip, which is read",
    b"{": "JSON: export a table of it (Python: pandas.read_json(FILE).to_csv(...))",
    b"[": "JSON: export a table of it (Python: pandas.read_json(FILE).to_csv(...))",
    b"\x80": "a pickle of Python, which may run any program: save its arrays by numpy.savez",
    b"%PDF": "a PDF: export the numbers from the program that drew it",
}
"""First bytes of a file of another kind, to the advice how to make a readable file of it."""
# bytes near the beginning of a workbook of LibreOffice
_OPEN_DOCUMENT = b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet"


class Recognised(NamedTuple):
    """The reader of a file, and how it was found.

    `text`: Format of the file as keys of `text` in the config, where no dialect fits or the caller gave it; else None.
    `options`: Options of its dialect. `other_dialects`: Sentences on the dialects that also claim the file, or were
    tried.
    """

    reader: Reader
    text: dict[str, Any] | None
    options: dict[str, object]
    other_dialects: list[str]


def recording(path: Path) -> Path:
    """Return the file to read for a log: for a folder of rosbag2 its metadata.yaml, else the path itself."""
    return path / BAG if path.is_dir() and (path / BAG).is_file() else path


def recognised(
    path: Path,
    name: str | None = None,
    text: Mapping[str, object] | None = None,
    options: Mapping[str, object] | None = None,
) -> Recognised:
    """Find the reader of a file: by the `name` of a dialect, by a format `text`, or else by the content of the file.

    `text`: Keys of `text` in the config, to their values. `options`: Options of the dialect, or further keys of `text`.
    Raises InputError if nothing reads the file, or an option is wrong.
    """
    settings = dict(options or {})
    other_dialects: list[str] = []
    if text is None and name in (None, DelimitedReader.name):
        head = read_head(path)
        # by content: first the dialects that claim the file, then a guess of its format
        if name is None and (readers := claimants(head)):
            name, *other_names = (reader.name for reader in readers)
            other_dialects = [f"also claimed by: {other}" for other in other_names]
        elif is_echo(head) or (text := guess_text_settings(head)) is None:
            raise refusal(path, head)
        else:
            other_dialects = describe_tried_dialects()
    try:
        if text is None:
            reader = dialect(str(name)).with_options(settings)
            return Recognised(reader, None, settings, other_dialects)
        text_format = {**text, **settings}
        reader = DelimitedReader(_text_format(text_format))
        return Recognised(reader, text_format, {}, other_dialects)
    except ValueError as error:
        key = "options" if text is None else "text"
        raise InputError(f"{key}: {' '.join(str(error).split())}") from error


def _text_format(text: Mapping[str, object]) -> TextFormat:
    """Return the checked keys of `text`; raises ValueError, worded as the config words it, for a wrong one."""
    for name in text:
        if name not in TextFormat.model_fields:
            raise ValueError(unknown_word("option", name, TextFormat.model_fields))
    try:
        return TextFormat.model_validate(text)
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        key = ".".join(map(str, wrong["loc"]))
        allowed = wrong["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
        raise ValueError(f"{key}: found {wrong['input']!r}; allowed: {allowed}") from None


def describe_tried_dialects() -> list[str]:
    """Return sentences on the dialects that were tried, and on those that could not be loaded."""
    names = ", ".join(name for name in dialects() if name != "delimited")
    return [f"tried: {names}", *(f"not tried: {fault}" for fault in faults())]


def refusal(path: Path, head: bytes) -> InputError:
    """Make the error, to be raised, for a file that no dialect reads: the cure, and the first lines of the file.

    `head`: First 64 kB of the file.
    """
    if not head:
        return InputError(f"{path}: the file is empty")
    advice = next((a for mark, a in _EXPORTS.items() if head.lstrip().startswith(mark)), "")
    if is_web_page(head):
        advice = "a web page, whatever its name is: open it in a spreadsheet and save it as .xlsx or .csv"
    elif _OPEN_DOCUMENT in head[: 2 * len(_OPEN_DOCUMENT)]:
        advice = "a workbook of LibreOffice (.ods): save it as .xlsx or .csv"
    if is_echo(head):
        cure = ECHO[0].upper() + ECHO[1:]
    elif advice:
        cure = f"It is {advice}"
    elif encoding_of(head) != "binary":
        cure = (
            "No delimiter gives two rows of numbers below each other. If it is a table, describe it "
            "in the config: force_log: {text: {delimiter: ..., skip_lines: ...}}"
        )
    else:
        cure = "Export it as text, as a workbook (.xlsx), or as plain arrays"
    lines = [f"{path}: no dialect reads this file. {cure}"]
    lines.append(f"It looks like: {encoding_of(head)}; it begins with")
    lines += [f"  {line}" for line in read_first_lines(head)]
    # a small file is tried as a rig log, to name the first thing wrong with it
    small = path.stat().st_size <= _CHOSEN.tried_bytes
    if small and not advice and encoding_of(head) != "binary":
        lines.append(f"not rig: {_reason_of_refusal(dialect('rig'), path)}")
    return InputError("\n".join([*lines, *describe_tried_dialects()]))


def _reason_of_refusal(reader: Reader, path: Path) -> str:
    """Return why a reader refuses a file, without its path; empty if it does not."""
    try:
        reader.load(path)
    except LogError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""
