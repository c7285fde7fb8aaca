"""``rftfit inspect``: what a log is, before any run sheet names it."""

from __future__ import annotations

import math
from pathlib import Path  # noqa: TC003  # typer asks for it at run time
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.output import count, megabytes, say, table

if TYPE_CHECKING:
    from rftfit.cli.inspection import Clock
    from rftfit.logs.base import Dialect, Log

_MOST_GAPS = 10


def inspect_log(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A force log or a motion log.")],
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Draw all columns against time into this file."),
    ] = None,
) -> None:
    """Show what a log is: dialect, columns and units, clock, resolution, damage, what it lacks.

    The log is only read. Dialects: rig (the rig's own pair of csv files).
    """
    from rftfit.cli.inspection import read_log

    reader, content = read_log(log)
    say(describe(reader, content))
    if plot is not None:
        from rftfit.cli.log_plot import plot_log

        plot_log(content, plot)
        say(f"\nDrawing: {plot}")


def describe(reader: Dialect, log: Log) -> str:
    """Everything that `rftfit inspect` prints of a log.

    Parameters
    ----------
    reader : Dialect
        That read it.
    log : Log

    Returns
    -------
    str
    """
    from rftfit.cli.inspection import clock_of, columns_of, lacking

    kind = "force log" if "F1" in log.columns else "motion log"
    used = log.columns["time"].size
    lines = [
        f"{log.path}: {kind}, {megabytes(log.path.stat().st_size)}",
        f"dialect: {reader.name}, {reader.describe()}",
        f"  recognised by its header row, whose columns are {', '.join(log.columns)}",
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
                for c in columns_of(log)
            ],
        ),
        "",
        f"rows: {log.rows}, of which {used} can be read",
        *(f"  {number} dropped: {reason}" for reason, number in log.dropped.items()),
        *_clock_lines(clock_of(log), log.units.get("time", "s")),
        "",
        "needed beside this file:",
        *(f"  {need}" for need in lacking(log)),
    ]
    return "\n".join(lines)


def _clock_lines(clock: Clock, unit: str) -> list[str]:
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
