"""All columns of a log against time, one panel each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.report import style
from rftfit.store import atomic_path

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from rftfit.logs.base import Log

FORMATS = ("png", "pdf", "svg")

_PANEL_CM = 3.0


@style.styled
def draw_log(log: Log) -> Figure:
    """Draw a log.

    Parameters
    ----------
    log : Log
        With a column ``time``.

    Returns
    -------
    matplotlib.figure.Figure
        One panel for each other column.
    """
    time = log.columns["time"]
    names = [name for name in log.columns if name != "time"]
    figure = style.new_figure(style.DOUBLE_CM, _PANEL_CM * len(names) + 1.5)
    figure.set_layout_engine("constrained")
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for panel, name in zip(panels, names, strict=True):
        # counted from the first row: clocks run since midnight
        panel.plot(time - time[0] if time.size else time, log.columns[name], linewidth=0.7)
        unit = log.units.get(name, "")
        panel.set_ylabel(f"{name} ({unit})" if unit else name)
    unit = log.units.get("time", "s")
    start = f", counted from {time[0]:.10g} {unit}" if time.size else ""
    panels[-1].set_xlabel(f"time ({unit}){start}")
    panels[0].set_title(log.path.name)
    return figure


def plot_log(log: Log, target: Path) -> None:
    """Draw a log into a file.

    Parameters
    ----------
    log : Log
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
    figure = draw_log(log)
    with style.context(), atomic_path(target) as path:
        figure.savefig(path, format=ending)
