"""From recording to result: one run of each kind, as recorded, with its tare, and what it gave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rftfit.errors import InputError
from rftfit.report import curves, labels, style
from rftfit.report.runs import thin

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.report.runs import Trace

_LEFT_CM, _SIDE_CM, _PITCH_CM, _TOP_CM = 1.35, 3.3, 4.35, 1.2
_ROWS_CM = ((0.0, 2.1), (2.35, 2.7), (6.75, 2.9))
"""Top, from the first row's, and height of each row."""

_PHASES = {"pause": "#f3e3b3", "stroke": "#e6e6e6"}
_LETTERS = "ABCDEFGH"
_POINTS = 400
"""Vertices of one line; a run has more samples than a panel has dots."""


@dataclass(frozen=True)
class Protocol:
    """One column of the figure.

    Attributes
    ----------
    kind : {"intrusion", "extraction", "horizontal", "rotation"}
    about : str
        What was moved, and how: the second line of the heading.
    run : dict of str to numpy.ndarray
        The recording in the lab frame, its zero taken off: ``time_s`` (0 where the stroke begins),
        ``force_z_N, force_x_N``, for a plate ``depth_cm, x_cm``, for a leg ``angle_deg``.
    tare : dict of str to numpy.ndarray
        ``time_s, force_z_N, force_x_N`` of the rod alone, or of the leg in air; empty if lost.
    phases : dict of str to (float, float)
        First and last time of ``pause`` and ``stroke``, s.
    result : dict of str to numpy.ndarray
        Of a plate the tared stress as filed, ``depth_cm, path_cm, stress_z_N_per_cm2,
        stress_x_N_per_cm2, in_window``; of a leg ``theta_deg, force_z_N, force_x_N``.
    fit : mapping
        Row of the fit table; empty for a leg.
    """

    kind: str
    about: str
    run: Trace
    tare: Trace
    phases: dict[str, tuple[float, float]]
    result: Trace
    fit: Mapping[Hashable, Any]


@style.styled
def draw_protocol(columns: Sequence[Protocol], title: str, confidence: float = 0.95) -> Figure:
    """Draw runs of several kinds from recording to result, one column each (after Fig. S1).

    Above: position against time. Middle: force on the intruder and of its tare against time, both
    with their own stroke beginning at 0. Below: stress of a plate with the line through zero
    (the steady mean of a horizontal run) and its interval, or the force on a leg against its angle.

    Parameters
    ----------
    columns : sequence of Protocol
        At most eight.
    title : str
        For example the medium's name.
    confidence : float
        Level of the intervals of the fits.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is no run to draw.
    """
    if not columns:
        raise InputError("there is no run of which recording and result could be drawn")
    width = _LEFT_CM + max(len(columns) - 1, 1) * _PITCH_CM + _SIDE_CM + 0.3
    last_top, last_height = _ROWS_CM[-1]
    figure = style.new_figure(width, _TOP_CM + last_top + last_height + 1.75)
    style.text_cm(figure, 0.15, 0.12, labels.plain(title), va="top", weight="bold")
    for i, column in enumerate(columns):
        left = _LEFT_CM + i * _PITCH_CM
        above, middle, below = (
            style.axes_cm(figure, left, _TOP_CM + top, _SIDE_CM, height) for top, height in _ROWS_CM
        )
        _heading(figure, left, f"{_LETTERS[i]}  {column.kind}", column.about)
        _draw_position(above, column)
        _draw_forces(middle, column)
        above.sharex(middle)
        above.tick_params(labelbottom=False)
        middle.set_xlabel("time since stroke began (s)")
        if i == 0:
            middle.set_ylabel("force on intruder (N)")
            for axes in (above, middle, below):
                axes.yaxis.set_label_coords(-0.8 / _SIDE_CM, 0.5)
        note = _draw_leg(below, column) if column.kind == "rotation" else _draw_plate(below, column)
        style.text_cm(
            figure, left, _TOP_CM + last_top - 0.1, note, va="bottom", fontsize=curves.NOTE_PT
        )
        if column.kind == "rotation":
            below.set_ylabel("force, tare taken off (N)")
        elif i == 0:
            below.set_ylabel(f"stress ({labels.PER_CM2})")
    _legend(figure, f"{100 * confidence:.4g} %")
    return figure


def _heading(figure: Figure, left_cm: float, head: str, about: str) -> None:
    style.text_cm(figure, left_cm, _TOP_CM - 0.4, head, va="bottom", weight="bold")
    style.text_cm(figure, left_cm, _TOP_CM - 0.1, about, va="bottom", fontsize=curves.NOTE_PT)


def _shade(axes: Axes, column: Protocol) -> None:
    for name, (first, last) in column.phases.items():
        axes.axvspan(first, last, color=_PHASES[name], linewidth=0)
    axes.axhline(0, color="#808080", linewidth=0.4)


def _draw_position(axes: Axes, column: Protocol) -> None:
    _shade(axes, column)
    run, time = column.run, column.run["time_s"]
    if column.kind == "rotation":
        for line in thin(time, run["angle_deg"], _POINTS):
            axes.plot(*line.T, color="black")
        axes.set_yticks(range(-90, 91, 90))
        axes.set_ylabel(r"$\theta$ (degrees)")
        return
    for values, colour, dashes in ((-run["depth_cm"], "black", "-"), (run["x_cm"], "black", "--")):
        for line in thin(time, values, _POINTS):
            axes.plot(*line.T, color=colour, linestyle=dashes, linewidth=0.9)
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.set_ylabel("position (cm)", labelpad=1)


def _draw_forces(axes: Axes, column: Protocol) -> None:
    _shade(axes, column)
    for trace, colours in (
        (column.tare, style.TARE_COLOURS),
        (column.run, style.COMPONENT_COLOURS),
    ):
        if not trace:
            axes.text(0.03, 0.95, "no tare", transform=axes.transAxes, va="top", color=style.MARK)
            continue
        for c in "zx":
            for line in thin(trace["time_s"], trace[f"force_{c}_N"], _POINTS):
                axes.plot(*line.T, color=colours[c], linewidth=0.6)
    time = column.run["time_s"]
    axes.set_xlim(np.nanmin(time), np.nanmax(time))
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))


def _draw_plate(axes: Axes, column: Protocol) -> str:
    flat = column.kind == "horizontal"
    trace, fit = column.result, column.fit
    place = trace["path_cm" if flat else "depth_cm"]
    window = (trace["in_window"] > 0) & np.isfinite(place)
    begin = end = np.nan
    if window.any():
        begin, end = float(place[window].min()), float(place[window].max())
        axes.axvspan(begin, end, color="#e6e6e6", linewidth=0)
    axes.axhline(0, color="#808080", linewidth=0.4)
    # along a horizontal run the depth is one number, and the stress that fits it is a constant
    scale = float(np.nanmean(trace["depth_cm"])) if flat else 1.0
    notes = []
    for c in "zx":
        colour = style.COMPONENT_COLOURS[c]
        for line in thin(place, trace[f"stress_{c}_N_per_cm2"], _POINTS):
            axes.plot(*line.T, color=colour, linewidth=0.6, alpha=0.75)
        alpha, low, high = (float(fit[f"alpha_{c}_{part}N_per_cm3"]) for part in ("", "lo_", "hi_"))
        if np.isfinite([alpha, end]).all():
            ends = np.array([begin, end]) if flat else np.array([0.0, end])
            shape = scale * np.ones(2) if flat else ends
            axes.fill_between(ends, low * shape, high * shape, color=colour, alpha=0.35)
            axes.plot(ends, alpha * shape, "-" if c == "z" else "--", color="black")
        notes.append(_value(f"\\alpha_{c}", alpha, (high - low) / 2, labels.PER_CM3))
    axes.set_xlim(0, None)
    axes.set_xlabel("distance travelled (cm)" if flat else "depth (cm)")
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    return "\n".join(notes)


def _value(symbol: str, value: float, half: float, unit: str) -> str:
    text = labels.number(value, 4)
    if np.isfinite(half):
        text += f" \N{PLUS-MINUS SIGN} {labels.number(half, 4)}"
    return rf"${symbol}$ = {text} {unit}"


def _draw_leg(axes: Axes, column: Protocol) -> str:
    axes.axhline(0, color="#808080", linewidth=0.4)
    notes = []
    theta = column.result["theta_deg"]
    for c in "zx":
        force = column.result[f"force_{c}_N"]
        axes.plot(theta, force, ".", color=style.COMPONENT_COLOURS[c], markersize=1.4)
        if np.isfinite(force).any():
            peak = int(np.nanargmax(np.abs(force)))
            notes.append(
                rf"peak $F_{c}$ = {labels.number(float(force[peak]), 2)} N at "
                rf"$\theta$ = {labels.degrees(float(theta[peak]))}"
            )
        else:
            notes.append(f"no force $F_{c}$")
    axes.set(xlim=curves.THETA_DEG, xticks=range(-90, 91, 45), xlabel=curves.THETA_LABEL)
    axes.xaxis.set_major_formatter(lambda at, _: f"{at:.0f}".replace("-", "\N{MINUS SIGN}"))
    return "\n".join(notes)


def _legend(figure: Figure, level: str) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    colours, tares = style.COMPONENT_COLOURS, style.TARE_COLOURS
    entries: dict[str, Line2D | Patch] = {
        "height $z$": Line2D([], [], color="black"),
        "distance $x$": Line2D([], [], color="black", linestyle="--"),
        "vertical, run": Line2D([], [], color=colours["z"]),
        "vertical, tare": Line2D([], [], color=tares["z"]),
        "horizontal, run": Line2D([], [], color=colours["x"]),
        "horizontal, tare": Line2D([], [], color=tares["x"]),
        "pause": Patch(facecolor=_PHASES["pause"]),
        "stroke; below: window of the fit": Patch(facecolor=_PHASES["stroke"]),
        "fit, vertical": Line2D([], [], color="black"),
        "fit, horizontal": Line2D([], [], color="black", linestyle="--"),
        f"{level} interval of a fit": Patch(facecolor="#888888", alpha=0.5),
    }
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", columnspacing=1.2,
        ncols=6 if figure.get_size_inches()[0] > 14 * style.CM else 3, borderaxespad=0.2,
    )  # fmt: skip
