"""``rftfit inspect``: what a log is, before any run sheet names it."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import check_picture, json_text, print_line
from rftfit.errors import InputError
from rftfit.store.text import count, megabytes, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.logs.base import LogError
    from rftfit.logs.inspect import Recognised, Survey, TimeColumn

_MOST_GAPS = 10
_DRAWN = "drawn by rftfit inspect"


def inspect_log(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A force log or a motion log.")],
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Draw all columns against time into this file."),
    ] = None,
    dialect: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Read it as this dialect, whatever it looks like."),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="An option of the dialect, as in the config."),
    ] = None,
    force: options.Overwrite = False,
    as_json: options.AsJson = False,
) -> None:
    """Show what a log is: dialect, columns and units, clock, resolution, damage, what it lacks.

    The log is only read. The last lines are what config.yaml needs for such logs. Dialects: the
    rig's csv pair, ATI Net F/T, ATI through NI DAQ, rostopic csv, LabVIEW, Instron-style exports,
    xlsx, Parquet and others; any other delimited text is described in the config.
    """
    from rftfit.logs.inspect import recording, survey_file

    log = recording(log)
    ending = check_picture(plot, "--plot", _DRAWN, force) if plot is not None else ""
    recognition = _recognised(log, dialect, option or [])
    surveys, refused = survey_file(recognition.reader, log)
    print_line((_as_json if as_json else _as_text)(recognition, surveys, refused))
    if plot is not None:
        from rftfit.figures.log_plot import plot_log
        from rftfit.figures.style import content
        from rftfit.store import write_bytes

        write_bytes(plot, content(plot_log(recognition.reader, surveys), ending, _DRAWN))
        if as_json:
            return
        print_line(f"\nDrawing: {plot}")


def _recognised(path: Path, name: str | None, options: Sequence[str]) -> Recognised:
    from rftfit.logs.inspect import recognised

    if path.is_dir():
        raise InputError(f"{path}: this is a folder; name one log in it")
    if path.exists() and not path.is_file():
        # a pipe or device would be read for ever
        raise InputError(f"{path}: this is a pipe or device; name a log, a regular file")
    return recognised(path, name, options=dict(map(_option, options)))


def _option(pair: str) -> tuple[str, str | float]:
    key, equals, value = pair.partition("=")
    if not equals:
        raise InputError(f"--option: found {pair!r}; allowed: KEY=VALUE")
    if value.casefold() in ("true", "false"):
        return key, value.casefold() == "true"
    for number in (int, float):
        with suppress(ValueError):
            return key, number(value)
    return key, value


def _as_text(recognition: Recognised, surveys: Sequence[Survey], refused: LogError | None) -> str:
    """Tell what a file is, by the surveys of each of its clocks, and why it is no log as it stands."""
    from rftfit.logs.delimited import encoding_of
    from rftfit.logs.inspect import config_block, kinds, lacking, together
    from rftfit.logs.registry import read_head

    whole = together(surveys)
    path = whole.path
    reader, text, options, other_dialects = recognition
    kind = " and ".join(kinds(whole)) or "unknown kind of"
    names = dict.fromkeys(column.name for survey in surveys for column in survey.columns)
    head = f"{reader.name}, {reader.describe()}"
    evidence = f"recognised by {reader.evidence}; columns are {', '.join(names)}"
    if text is not None:
        head = "none recognises it; read as delimited text"
        shape = ", ".join(f"{key} {value!r}" for key, value in text.items())
        evidence = f"it looks like {encoding_of(read_head(path))}: {shape}"
    lines = [f"{path}: {kind} log, {megabytes(path.stat().st_size)}", f"dialect: {head}"]
    lines += [f"  {line}" for line in (evidence, *other_dialects)]
    if refused is not None:
        why = str(refused).removeprefix(f"{path}: ")
        lines += ["", f"refused as one log: {why}", "", "by clock:"]
    for survey in surveys:
        lines += ["", *_survey_lines(survey)]
    lines += [
        "",
        "needed beside this file:",
        *(f"  {need}" for need in lacking(whole)),
        *_contact_lines(whole),
        "",
        "for config.yaml (quantities are guessed from names and units: check them):",
        *(f"  {line}" for line in config_block(whole, reader.name, text, options)),
    ]
    return "\n".join(lines)


def _as_json(recognition: Recognised, surveys: Sequence[Survey], refused: LogError | None) -> str:
    """What `_as_text` tells, for a script; the columns of each clock for themselves."""
    from rftfit.logs.inspect import config_block, kinds, lacking, together

    whole = together(surveys)
    of_survey: tuple[str, ...] = ("rows", "used", "dropped", "missing", "notes")
    of_survey += ("time_unit", "not_finite", "unread")
    of_clock = ("duration", "rate", "step", "jitter", "gaps", "repeated", "backwards")
    clocks = [
        {
            "columns": [asdict(column) for column in survey.columns],
            **{name: getattr(survey, name) for name in of_survey},
            "clock": survey.clock and {name: getattr(survey.clock, name) for name in of_clock},
        }
        for survey in surveys
    ]
    facts = {
        "file": whole.path,
        "dialect": recognition.reader.name,
        "kinds": kinds(whole),
        "refused": refused and str(refused),
        "clocks": clocks,
        "needed": lacking(whole),
        "config": config_block(
            whole, recognition.reader.name, recognition.text, recognition.options
        ),
    }
    return json_text(facts)


def _contact_lines(survey: Survey) -> list[str]:
    """How the file of a leg that turns, with its force, tells alpha of the ground by itself; none of another log."""
    names = [column.name.casefold() for column in survey.columns]
    turns = [name for name in names if name.startswith("theta")]
    forces = [
        column.name for column in survey.columns if column.quantity.startswith("force, sensor")
    ]
    if not turns or not forces:
        return []
    named = {"theta", "theta_deg"} & {*names} and {"force_z", "force_z_n"} & {*names}
    rename = "" if named else "; its columns named theta_deg, force_z_N, force_x_N"
    return [
        "",
        "or as forces of the ground on a leg, weight and force in air taken off:",
        f"  rftfit scale --contacts {survey.path} --leg NAME{rename}",
    ]


def _survey_lines(survey: Survey) -> list[str]:
    header = ["column", "quantity", "unit", "lowest", "highest", "resolution"]
    rows = []
    for c in survey.columns:
        ends = map(_short, (c.lowest, c.highest, c.resolution))
        rows.append([c.name, c.quantity, c.unit or "-", *ends])
    rows += [[name, "not read", "-", "-", "-", "-"] for name in survey.unread]
    whole = survey.rows + sum(survey.missing.values())
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
            f"  {number} ({number / whole:.1%} of all) missing: {reason}"
            for reason, number in survey.missing.items()
        ),
        *_clock_lines(survey.clock, survey.time_unit or "s"),
        *(f"not read: {name}: {why}" for name, why in survey.unread.items()),
        *(f"note: {note}" for note in survey.notes),
    ]


def _clock_lines(clock: TimeColumn | None, unit: str) -> list[str]:
    if clock is None:
        return ["duration, rate and gaps: unknown, no column looks like a time"]
    lines = [f"duration: {_short(clock.duration)} {unit}"]
    if math.isfinite(clock.step):
        lines.append(
            f"rate: {_short(clock.rate)} rows/{unit} (median step {_short(clock.step)} {unit}, "
            f"median jitter {_short(clock.jitter)} {unit})"
        )
    lines.append(f"gaps: {len(clock.gaps) or 'none'}")
    lines += [
        f"  {_short(length)} {unit} from {start:.10g} {unit} on"
        for start, length in clock.gaps[:_MOST_GAPS]
    ]
    if len(clock.gaps) > _MOST_GAPS:
        lines.append(f"  and {count(len(clock.gaps) - _MOST_GAPS, 'more gap')}")
    lines.append(f"times: {clock.repeated} repeated, {clock.backwards} backwards")
    return lines


def _short(number: float) -> str:
    return f"{number:.6g}" if math.isfinite(number) else "-"
