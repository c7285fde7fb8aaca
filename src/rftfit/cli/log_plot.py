"""All columns of a log against time, one panel each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.cli.inspection import GAP_STEPS
from rftfit.errors import InputError
from rftfit.logs.base import Log, join
from rftfit.report import style
from rftfit.report.saving import FORMATS, content
from rftfit.store import write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from matplotlib.figure import Figure

    from rftfit.cli.inspection import Survey
    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Reader

MOST_ROWS = 200_000
"""Rows that are drawn of a long log."""

_PANEL_CM = 3.0


@style.styled
def draw_log(log: Log, time_name: str = "time") -> Figure:
    """Draw a log.

    Parameters
    ----------
    log : Log
    time_name : str, optional
        The column that is the time; by default ``time``; rows are counted where there is none.

    Returns
    -------
    matplotlib.figure.Figure
        One panel for each other column.
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

    Parameters
    ----------
    blocks : iterable of Log
    rows : int
        Usable rows in all.

    Returns
    -------
    Log
        At most `MOST_ROWS` rows and one a block.
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

    Parameters
    ----------
    reader : Reader
    source : Path
        The log.
    found : Survey
        What is known of it.
    target : Path
        Its ending is the format, one of `FORMATS`.

    Raises
    ------
    InputError
        If the ending is another.
    OutputError
        If the file cannot be written.
    """
    ending = target.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        raise InputError(
            f"{target}: found the ending {target.suffix!r}; allowed: .{', .'.join(FORMATS)}"
        )
    log = thinned(reader.stream(source), found.used)
    figure = draw_log(log, found.quantities.get("time", "time"))
    write_bytes(target, content(figure, ending))
