"""Answer of `rftfit inspect` on a log that no run sheet names yet: as text, and as facts for a script.

What is said here is found by `rftfit.logs.inspect`; this module lays it out. A file may hold columns of several clocks:
each clock then has a `Survey` (columns, rows, times) of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rftfit.errors import InputError
from rftfit.logs.base import LogError
from rftfit.logs.delimited import encoding_of
from rftfit.logs.inspect import (
    Recognised,
    Survey,
    TimeColumn,
    config_block,
    describe_needs,
    join_surveys,
    log_kinds,
    recognised,
    survey_file,
)
from rftfit.logs.registry import read_head
from rftfit.store.text import count, megabytes, table
from rftfit.table.units import TIME_TO_S


@dataclass(frozen=True)
class Inspection:
    """A file that may be a log: how it is read, a survey of each of its clocks, and why it is no log as it stands.

    `recognition`: Its reader, its format as delimited text (None: it is of a dialect), options, and sentences on other
    dialects. `refused`: None: it can be read as one log.
    """

    recognition: Recognised
    surveys: Sequence[Survey]
    refused: LogError | None

    @property
    def whole(self) -> Survey:
        """One survey of the whole file, with all its clocks."""
        return join_surveys(self.surveys)

    @property
    def config(self) -> list[str]:
        """Lines of config.yaml for such logs."""
        reader, text_format, options, _ = self.recognition
        return config_block(self.whole, reader.name, text_format, options)

    def summary(self) -> str:
        """Format for people what the file is, what it lacks, and what the config needs."""
        whole = self.whole
        path = whole.path
        reader, text_format, _, other_dialects = self.recognition
        kind = " and ".join(log_kinds(whole)) or "unknown kind of"
        names = dict.fromkeys(column.name for survey in self.surveys for column in survey.columns)
        head = f"{reader.name}, {reader.describe()}"
        evidence = f"recognised by {reader.evidence}; columns are {', '.join(names)}"
        if text_format is not None:
            head = "none recognises it; read as delimited text"
            shape = ", ".join(f"{key} {setting!r}" for key, setting in text_format.items())
            evidence = f"it looks like {encoding_of(read_head(path))}: {shape}"
        lines = [f"{path}: {kind} log, {megabytes(path.stat().st_size)}", f"dialect: {head}"]
        lines += [f"  {line}" for line in (evidence, *other_dialects)]
        if self.refused is not None:
            why = str(self.refused).removeprefix(f"{path}: ")
            lines += ["", f"refused as one log: {why}", "", "by clock:"]
        for survey in self.surveys:
            lines += ["", *_survey_lines(survey)]
        lines += [
            "",
            "needed beside this file:",
            *(f"  {need}" for need in describe_needs(whole)),
            *_contact_lines(whole),
            "",
            "for config.yaml (quantities are guessed from names and units: check them):",
            *(f"  {line}" for line in self.config),
        ]
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Return the same facts as plain numbers, words and lists; columns are listed clock by clock."""
        return {
            "file": self.whole.path,
            "dialect": self.recognition.reader.name,
            "kinds": log_kinds(self.whole),
            "refused": self.refused and str(self.refused),
            "clocks": [_facts_of(survey) for survey in self.surveys],
            "needed": describe_needs(self.whole),
            "config": self.config,
        }


def inspect_file(path: Path, dialect: str | None, options: Mapping[str, str | float]) -> Inspection:
    """Find out how a file is read, and read it through; raises InputError for a file that is no log.

    `dialect`: Name of the dialect to read it as; None: found by its content. `options`: Options of the dialect.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; name one log in it")
    if path.exists() and not path.is_file():
        # a pipe or device would be read for ever
        raise InputError(f"{path}: this is a pipe or device; name a log, a regular file")
    recognition = recognised(path, dialect, options=options)
    return Inspection(recognition, *survey_file(recognition.reader, path))


def _facts_of(survey: Survey) -> dict[str, Any]:
    """Return a survey as a dictionary for scripts, with the names of the fields of `Survey`.

    ``clock`` is None where no column is the time.
    """
    survey_fields = (
        "rows",
        "used",
        "dropped",
        "missing",
        "notes",
        "time_unit",
        "not_finite",
        "unread",
    )
    clock_fields = ("duration", "rate", "step", "jitter", "gaps", "repeated", "backwards")
    return {
        "columns": [asdict(column) for column in survey.columns],
        **{name: getattr(survey, name) for name in survey_fields},
        "clock": survey.clock and {name: getattr(survey.clock, name) for name in clock_fields},
    }


def _contact_lines(survey: Survey) -> list[str]:
    """Return lines that name `rftfit scale --contacts`, for a file of a leg angle (theta) and forces; else none."""
    names = {column.name.casefold() for column in survey.columns}
    has_force = any(column.quantity.startswith("force, sensor") for column in survey.columns)
    if not has_force or not any(name.startswith("theta") for name in names):
        return []
    has_names_of_contacts = {"theta", "theta_deg"} & names and {"force_z", "force_z_n"} & names
    rename = "" if has_names_of_contacts else "; its columns named theta_deg, force_z_N, force_x_N"
    return [
        "",
        "or as forces of the ground on a leg, weight and force in air taken off:",
        f"  rftfit scale --contacts {survey.path} --leg NAME{rename}",
    ]


def _survey_lines(survey: Survey) -> list[str]:
    """Return the lines for people on one clock: table of columns, rows, clock, notes."""
    header = ["column", "quantity", "unit", "lowest", "highest", "resolution"]
    rows = []
    for c in survey.columns:
        ends = map(_format_number, (c.lowest, c.highest, c.resolution))
        rows.append([c.name, c.quantity, c.unit or "-", *ends])
    rows += [[name, "not read", "-", "-", "-", "-"] for name in survey.unread]
    expected_rows = survey.rows + sum(survey.missing.values())
    return [
        table(header, rows),
        "",
        f"rows: {survey.rows}, of which {survey.used} can be read",
        *(f"  {number} dropped: {reason}" for reason, number in survey.dropped.items()),
        *(f"    NaN or infinite in {name}: {number}" for name, number in survey.not_finite.items()),
        *(
            f"  no value in {c.name}: {survey.used - c.values}, left out where this column is used"
            for c in survey.columns
            if c.values < survey.used
        ),
        *(
            f"  {number} ({number / expected_rows:.1%} of all) missing: {reason}"
            for reason, number in survey.missing.items()
        ),
        *_clock_lines(survey.clock, survey.time_unit or "s"),
        *(f"not read: {name}: {why}" for name, why in survey.unread.items()),
        *_voltage_lines(survey),
        *(f"note: {note}" for note in survey.notes),
    ]


def _voltage_lines(survey: Survey) -> list[str]:
    """Return, in a list, the line on columns in volts, which are readings of gauges and no forces yet; else none."""
    gauges = ", ".join(column.name for column in survey.columns if column.unit in ("V", "mV", "uV"))
    cure = "force_log.calibration names a csv that converts them to forces and torques"
    return [f"in volts: {gauges}; {cure}"] if gauges else []


def _clock_lines(clock: TimeColumn | None, unit: str) -> list[str]:
    """Return the lines for people on duration, rate and gaps; `unit`: unit of the time."""
    if clock is None:
        return ["duration, rate and gaps: unknown, no column looks like a time"]
    lines = [f"duration: {_format_number(clock.duration)} {unit}"]
    if math.isfinite(clock.step):
        rows_per_s = clock.rate / TIME_TO_S.get(unit, 1.0)
        lines.append(
            f"rate: {_format_number(rows_per_s)} rows/s (median step {_format_number(clock.step)} {unit}, "
            f"median jitter {_format_number(clock.jitter)} {unit})"
        )
    lines.append(f"gaps: {len(clock.gaps) or 'none'}")
    most = 10
    lines += [
        f"  {_format_number(length)} {unit} from {start:.10g} {unit} on"
        for start, length in clock.gaps[:most]
    ]
    if len(clock.gaps) > most:
        lines.append(f"  and {count(len(clock.gaps) - most, 'more gap')}")
    lines.append(f"times: {clock.repeated} repeated, {clock.backwards} backwards")
    return lines


def _format_number(number: float) -> str:
    """Format a number with six digits; "-" where it is not finite."""
    return f"{number:.6g}" if math.isfinite(number) else "-"
