"""``rftfit inspect``: what a log is, before any run sheet names it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rftfit.cli.output import count, megabytes, say, table
from rftfit.errors import InputError
from rftfit.figures import style
from rftfit.figures.style import FORMATS, content
from rftfit.logs.base import Log, join
from rftfit.logs.inspect import GAP_STEPS
from rftfit.store import write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Reader
    from rftfit.logs.inspect import Clock, Survey


# --- All columns of a log against time, one panel each.


MOST_ROWS = 200_000
"""Rows that are drawn of a long log."""

_PANEL_CM = 3.0


@style.styled
def draw_log(log: Log, time_name: str = "time") -> Figure:
    """Draw a log.

    `time_name`: The column that is the time; by default ``time``; rows are counted where there is
    none. Returns one panel for each other column.
    """
    timed = time_name in log.columns
    time = log.columns[time_name] if timed else np.arange(log.size, dtype=float)
    names = [name for name in log.columns if name != time_name] or list(log.columns)
    figure = style.new_figure(style.DOUBLE_CM, _PANEL_CM * len(names) + 1.5)
    figure.set_layout_engine("constrained")
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for panel, name in zip(panels, names, strict=True):
        # counted from the first row: clocks run since midnight
        shown = time - time[0] if time.size else time
        panel.plot(*_broken(shown, log.columns[name]), linewidth=0.7)
        unit = log.units.get(name, "")
        panel.set_ylabel(f"{name} ({unit})" if unit else name)
    unit = log.units.get(time_name, "s" if timed else "rows")
    start = f", counted from {time[0]:.10g} {unit}" if time.size else ""
    panels[-1].set_xlabel(f"time ({unit}){start}")
    panels[0].set_title("; ".join([log.path.name, *(n for n in log.notes if "drawn" in n)]))
    return figure


def _broken(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Break a curve where rows are missing: a line there would be an invention."""
    steps = np.diff(time)
    forward = steps[steps > 0]
    if not forward.size:
        return time, values
    gaps = np.flatnonzero(steps > GAP_STEPS * np.median(forward)) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)


def thinned(blocks: Iterable[Log], rows: int) -> Log:
    """Keep every k-th row of a long log, so that it can be drawn in bounded memory.

    `rows`: Usable rows in all. Returns at most `MOST_ROWS` rows and one a block.
    """
    every = max(1, math.ceil(rows / MOST_ROWS))
    note = (f"every {every}. row is drawn",) if every > 1 else ()
    parts = []
    for log in blocks:
        columns = {name: values[::every].copy() for name, values in log.columns.items()}
        size = next(iter(columns.values())).size
        parts.append(Log(log.path, columns, log.units, size, notes=note))
    return join(parts)


def plot_log(reader: Reader, source: Path, found: Survey, target: Path) -> None:
    """Draw a log into a file.

    `source`: The log. `found`: What is known of it. `target`: Its ending is the format, one of
    `FORMATS`.
    """
    ending = target.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        raise InputError(
            f"{target}: found the ending {target.suffix!r}; allowed: .{', .'.join(FORMATS)}"
        )
    log = thinned(reader.stream(source), found.used)
    figure = draw_log(log, found.quantities.get("time", "time"))
    write_bytes(target, content(figure, ending))


# --- ``rftfit inspect``: what a log is, before any run sheet names it.


_MOST_GAPS = 10


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
) -> None:
    """Show what a log is: dialect, columns and units, clock, resolution, damage, what it lacks.

    The log is only read. The last lines are what config.yaml needs for such logs. Dialects: the
    rig's csv pair, ATI Net F/T, ATI through NI DAQ, rostopic csv, LabVIEW, Instron-style exports,
    xlsx, Parquet and others; any other delimited text is described in the config.
    """
    from rftfit.logs.inspect import survey

    reader, text, others = _reader(log, dialect, option or [])
    found = survey(reader.stream(log))
    say(describe(reader, found, text, others))
    if plot is not None:
        plot_log(reader, log, found, plot)
        say(f"\nDrawing: {plot}")


def _reader(
    path: Path, name: str | None, options: Sequence[str]
) -> tuple[Reader, dict[str, Any] | None, list[str]]:
    """Find the reader of a file; its format where it is just delimited text; who else claims it."""
    from rftfit.errors import InputError
    from rftfit.logs.inspect import as_text, refusal, tried
    from rftfit.logs.registry import claimants, dialect, head_of

    if path.is_dir():
        raise InputError(f"{path}: this is a folder; name one log in it")
    if path.exists() and not path.is_file():
        # a pipe or device would be read for ever
        raise InputError(f"{path}: this is a pipe or device; name a log, a regular file")
    head = head_of(path)
    text: dict[str, Any] | None = None
    others: list[str] = []
    if name is not None:
        reader = dialect(name)
    elif found := claimants(head):
        reader, others = found[0], [f"also claimed by: {other.name}" for other in found[1:]]
    elif (described := as_text(head)) is not None:
        (reader, text), others = described, tried()
    else:
        raise refusal(path, head)
    if options:
        try:
            reader = reader.with_options(dict(_option(pair) for pair in options))
        except ValueError as error:
            raise InputError(f"--option: {error}") from None
    return reader, text, others


def _option(pair: str) -> tuple[str, str | float]:
    key, equals, value = pair.partition("=")
    if not equals:
        raise ValueError(f"found {pair!r}; allowed: KEY=VALUE")
    try:
        return key, float(value)
    except ValueError:
        return key, value


def describe(
    reader: Reader, found: Survey, text: dict[str, Any] | None = None, others: Sequence[str] = ()
) -> str:
    """Everything that `rftfit inspect` prints of a log.

    `reader`: That read it. `text`: Its format, where no dialect knows it and it was read as
    delimited text. `others`: Which other dialects claim it, or were tried.
    """
    from rftfit.logs.delimited import encoding_of
    from rftfit.logs.inspect import config_block, kinds, lacking
    from rftfit.logs.registry import head_of

    path = found.first.path
    kind = " and ".join(kinds(found)) or "unknown kind of"
    known = [
        f"dialect: {reader.name}, {reader.describe()}",
        f"  recognised by {reader.evidence}; columns are {', '.join(found.first.columns)}",
    ]
    if text is not None:
        shape = ", ".join(f"{key} {value!r}" for key, value in text.items())
        known = [
            "dialect: none recognises it; read as delimited text",
            f"  it looks like {encoding_of(head_of(path))}: {shape}",
        ]
    lines = [
        f"{path}: {kind} log, {megabytes(path.stat().st_size)}",
        *known,
        *(f"  {line}" for line in others),
        "",
        table(
            ["column", "quantity", "unit", "lowest", "highest", "resolution"],
            [
                [
                    c.name,
                    c.quantity,
                    c.unit or "-",
                    *(_short(number) for number in (c.lowest, c.highest, c.resolution)),
                ]
                for c in found.columns
            ],
        ),
        "",
        f"rows: {found.rows}, of which {found.used} can be read",
        *(f"  {number} dropped: {reason}" for reason, number in found.dropped.items()),
        *(f"  {number} missing: {reason}" for reason, number in _shares(found)),
        *_clock_lines(found.clock, found.time_unit or "s"),
        *(f"note: {note}" for note in found.notes),
        "",
        "needed beside this file:",
        *(f"  {need}" for need in lacking(found)),
        "",
        "for config.yaml (quantities are guessed from names and units: check them):",
        *(f"  {line}" for line in config_block(found, reader.name, text)),
    ]
    return "\n".join(lines)


def _shares(found: Survey) -> list[tuple[str, str]]:
    whole = found.rows + sum(found.missing.values())
    return [
        (reason, f"{number} ({number / whole:.1%} of all)")
        for reason, number in found.missing.items()
    ]


def _clock_lines(clock: Clock | None, unit: str) -> list[str]:
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
