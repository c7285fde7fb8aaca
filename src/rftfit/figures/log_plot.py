"""All columns of a log against time, one panel each: the picture of a log that is inspected (`draw_log`)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures import style
from rftfit.logs.base import Log, join_blocks
from rftfit.logs.inspect import GAP_STEPS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Reader
    from rftfit.logs.inspect import Survey


def plot_log(reader: Reader, surveys: Sequence[Survey]) -> Figure:
    """Draw a log from its file, thinned where it is long.

    `reader`: Reader of the file. `surveys`: What was found in it, one for each clock of the file: the columns that run
    on it, how many rows can be used, and which columns were not read.
    """
    logs = []
    for survey in surveys:
        names = [column.name for column in survey.columns]
        survey_reader = reader
        if len(surveys) > 1 or survey.unread:
            survey_reader = reader.only(names, keeps_blanks=True)
        logs.append(thinned(survey_reader.stream(survey.path), survey.used))
    return draw_log(*logs, time_name=surveys[0].quantities.get("time", "time"))


def thinned(blocks: Iterable[Log], rows: int) -> Log:
    """Keep every k-th row, so that a long log can be drawn in bounded memory, and note that it was thinned.

    `blocks`: Successive parts of the log, read one at a time. `rows`: Number of its rows.
    """
    most_rows = 200_000
    row_step = max(1, math.ceil(rows / most_rows))
    note = (f"every {row_step}. row is drawn",) if row_step > 1 else ()
    thin_blocks = []
    for log in blocks:
        columns = {name: values[::row_step].copy() for name, values in log.columns.items()}
        size = next(iter(columns.values())).size
        thin_blocks.append(Log(log.path, columns, log.units, size, notes=note))
    return join_blocks(thin_blocks)


@style.styled()
def draw_log(*logs: Log, time_name: str = "time") -> Figure:
    """Draw one panel for each column of a log, or of the logs of each clock of a file, one below the other.

    `time_name`: Name of the column of time, s; where no column has it, rows are counted.
    """
    drawn_columns = [(log, name) for log in logs for name in _columns_to_draw(log, time_name)]
    figure = style.new_figure(style.DOUBLE_CM, 3.0 * len(drawn_columns) + 1.5)
    figure.set_layout_engine("constrained")
    panels = figure.subplots(len(drawn_columns), 1, sharex=True, squeeze=False)[:, 0]
    # time is counted from the first row, since clocks may count from midnight
    times = _time_of(logs[0], time_name)
    first_time = times[np.isfinite(times)][:1]
    for panel, (log, name) in zip(panels, drawn_columns, strict=True):
        time = _time_of(log, time_name)
        values = log.columns[name]
        is_finite = np.isfinite(time) & np.isfinite(values)
        since_start = (time - first_time if first_time.size else time)[is_finite]
        panel.plot(*_break_at_gaps(since_start, values[is_finite]), linewidth=0.7)
        unit = log.units.get(name, "")
        panel.set_ylabel(f"{name} ({unit})" if unit else name)
    unit = logs[0].units.get(time_name, "s" if time_name in logs[0].columns else "rows")
    start = f", counted from {first_time[0]:.10g} {unit}" if first_time.size else ""
    panels[-1].set_xlabel(f"time ({unit}){start}")
    thinning = [note for note in logs[0].notes if "drawn" in note]
    panels[0].set_title("; ".join([logs[0].path.name, *thinning]))
    return figure


def _columns_to_draw(log: Log, time_name: str) -> list[str]:
    """List the columns without that of the time, unless it is the only one."""
    return [name for name in log.columns if name != time_name] or list(log.columns)


def _time_of(log: Log, name: str) -> FloatArray:
    """Return the column of the time, or numbers of rows where the log has none."""
    return log.columns[name] if name in log.columns else np.arange(log.size, dtype=float)


def _break_at_gaps(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Insert NaN into a curve, shape (n,), where rows are missing, so that no line is drawn over a gap.

    A gap is a step of more than `GAP_STEPS` usual ones.
    """
    steps = np.diff(time)
    forward = steps[steps > 0]
    if not forward.size:
        return time, values
    gaps = np.flatnonzero(steps > GAP_STEPS * np.median(forward)) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)
