"""From recording to result: one run of each kind, its tare, its clocks and its surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rftfit.errors import NothingToDraw
from rftfit.figures import leg_panels, style
from rftfit.figures.plates import thin

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.figures.plates import DrawnTrace
    from rftfit.measure.alignment import Alignment
    from rftfit.measure.ingest import Trace
    from rftfit.measure.surface import Surface


# --- The plot of one tare: what the rod and the mount alone felt, and where that may be used.


POSITIONS = {
    "depth_cm": "depth (cm)",
    "path_cm": "distance along the path (cm)",
    "angle_deg": r"leg angle $\theta$ (degrees)",
}
"""Columns that a tare may be a function of, and their labels."""


@style.styled
def draw_tare(tare: pd.DataFrame, title: str) -> Figure:
    """Draw the force of one tare against position, its valid range shaded.

    `tare`: One of the columns of `POSITIONS`, ``force_z_N, force_x_N`` and ``valid`` (bool: the
    tare may be used there; elsewhere it refuses). `title`: For example the run's name.
    """
    column = next((name for name in POSITIONS if name in tare.columns), None)
    if column is None:
        raise ValueError(f"a tare needs one of the columns {', '.join(POSITIONS)}")
    position = tare[column].to_numpy(float)
    valid = tare["valid"].to_numpy(bool) & np.isfinite(position)
    figure = style.new_figure(style.SINGLE_CM, 5.7)
    axes = style.axes_cm(figure, 1.35, 0.55, style.SINGLE_CM - 1.65, 3.6)
    if valid.any():
        low, high = position[valid].min(), position[valid].max()
        axes.axvspan(low, high, color="#e6e6e6", linewidth=0, label="valid range")
    axes.axhline(0, color="#808080", linewidth=0.4)
    for c, name in (("z", "vertical"), ("x", "horizontal")):
        force = tare[f"force_{c}_N"].to_numpy(float)
        axes.plot(
            position,
            force,
            color=style.COMPONENT_COLOURS[c],
            label=f"{name} $F_{c}$",
            linewidth=0.7,
        )
    axes.set(xlabel=POSITIONS[column], ylabel="force on rod and mount (N)")
    if not valid.any():
        axes.text(0.5, 0.5, "valid nowhere", color=style.MARK, ha="center", va="center",
                  transform=axes.transAxes)  # fmt: skip
    axes.set_title(style.plain(title), loc="left")
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=3, borderaxespad=0.3)
    return figure


# --- How well the clocks were brought together and the surface found, drawn from the estimates' own details.


_ROW_CM, _HEAD_CM, _FOOT_CM = 4.3, 0.9, 2.5
_LEFT_CM, _WIDTH_CM, _STEP_CM = 1.3, 4.3, 5.85
_BLUE, _RED = style.OKABE_ITO["blue"], style.OKABE_ITO["vermillion"]
_GOOD = (
    "Good: one clear lowest point at the offset (left, log scale); readings on one curve (middle); "
    "force flat above\nand growing from the surface on (right). Bands: 95 % intervals."
)


@style.styled
def draw_clocks(traces: Sequence[Trace]) -> Figure:
    """Draw a row of three panels for each run whose clocks were estimated.

    Left: the share of the force's variance that no smooth function of depth explains, over the lags
    that were tried. Middle: force over depth at the estimated offset, and that function. Right: the
    force next to the surface, the model there, and the surface.

    `traces`: Runs without an estimate are left out.
    """
    rows = [(trace, trace.alignment) for trace in traces if trace.alignment is not None]
    if not rows:
        raise NothingToDraw("no run whose clocks were estimated")
    height = _HEAD_CM + len(rows) * _ROW_CM + _FOOT_CM - 1.2
    figure = style.new_figure(style.DOUBLE_CM, height, dpi=150)
    for place, (trace, alignment) in enumerate(rows):
        top = _HEAD_CM + place * _ROW_CM
        panels = [
            style.axes_cm(figure, _LEFT_CM + column * _STEP_CM, top, _WIDTH_CM, _ROW_CM - 1.5)
            for column in range(3)
        ]
        _lags(panels[0], alignment)
        panels[0].set_title(trace.run.run_id, loc="left", fontsize=8, fontweight="bold")
        panels[1].set_title(_offset(alignment), loc="left", fontsize=7.5)
        _curve(panels[1], alignment)
        _contact(panels[2], trace.surface)
        if place == len(rows) - 1:
            for panel, label in zip(
                panels,
                (
                    "lag from the estimate (s)",
                    "depth from the arm's zero (cm)",
                    "depth below surface (cm)",
                ),
                strict=True,
            ):
                panel.set_xlabel(label, fontsize=7.5)
    figure.text(0.02, 0.35 / height, _GOOD, fontsize=7.5, va="bottom")
    return figure


def _offset(alignment: Alignment) -> str:
    hours = f"{alignment.hours:+d} h " if alignment.hours else ""
    rest = alignment.offset_s - 3600 * (alignment.hours or 0)
    return f"clocks {hours}{rest:+.3f} s ± {alignment.offset_se_s:.3f} s"


def _lags(axes: Axes, alignment: Alignment) -> None:
    lag = alignment.profile.lag - alignment.offset_s
    axes.semilogy(lag, np.maximum(alignment.profile.unexplained, 1e-6), color=_BLUE, linewidth=0.9)
    axes.axvspan(*_ends(alignment.offset_se_s), color=_RED, alpha=0.4, linewidth=0)
    axes.set_ylabel("unexplained share", fontsize=7.5)
    axes.set_xlim(-10, 10)
    axes.minorticks_off()
    axes.tick_params(labelsize=7)


def _ends(se: float) -> tuple[float, float]:
    return -1.96 * se, 1.96 * se


def _curve(axes: Axes, alignment: Alignment) -> None:
    start = float(np.median(alignment.force[:8]))
    rising = alignment.depth > alignment.depth.max() - 6
    order = np.argsort(alignment.depth[rising])
    axes.plot(
        alignment.depth[rising], alignment.force[rising] - start, ".", color=_BLUE, markersize=2
    )
    axes.plot(
        alignment.depth[rising][order], alignment.fitted[rising][order] - start,
        color=_RED, linewidth=0.8,
    )  # fmt: skip
    axes.set_ylabel("lift (N)", fontsize=7.5)
    axes.tick_params(labelsize=7)


def _contact(axes: Axes, surface: Surface | None) -> None:
    axes.tick_params(labelsize=7)
    if surface is None:
        axes.text(0.5, 0.5, "surface as given", transform=axes.transAxes, ha="center", fontsize=7.5)
        return
    depth = surface.depth - surface.depth_cm
    order = np.argsort(depth)
    axes.plot(depth, surface.force - surface.air_N, ".", color=_BLUE, markersize=2)
    axes.plot(depth[order], surface.fitted[order] - surface.air_N, color=_RED, linewidth=0.8)
    lo, hi = surface.interval()
    axes.axvspan(lo - surface.depth_cm, hi - surface.depth_cm, color=_RED, alpha=0.3, linewidth=0)
    axes.set_xlim(-0.6, 0.6)
    near = np.abs(depth) < 0.6
    axes.set_ylim(-1, float((surface.force - surface.air_N)[near].max()) * 1.05 + 1)
    axes.set_title(f"surface ± {10 * surface.se_cm:.2f} mm", loc="left", fontsize=7.5)


# --- From recording to result: one run of each kind, as recorded, with its tare, and what it gave.


_PROTOCOL_LEFT_CM, _SIDE_CM, _PITCH_CM, _TOP_CM = 1.35, 3.3, 4.35, 1.2
_ROWS_CM = ((0.0, 2.1), (2.35, 2.7), (6.75, 2.9))
"""Top, from the first row's, and height of each row."""

_PHASES = {"pause": "#f3e3b3", "stroke": "#e6e6e6"}
_LETTERS = "ABCDEFGH"
_POINTS = 400
"""Vertices of one line; a run has more samples than a panel has dots."""


@dataclass(frozen=True)
class Protocol:
    """One column of the figure.

    `about`: What was moved, and how: the second line of the heading.
    `run`: The recording in the lab frame, its zero taken off: ``time_s`` (0 where the stroke
        begins), ``force_z_N, force_x_N``, for a plate ``depth_cm, x_cm``, for a leg ``angle_deg``.
    `tare`: ``time_s, force_z_N, force_x_N`` of the rod alone, or of the leg in air; empty if lost.
    `phases`: First and last time of ``pause`` and ``stroke``, s.
    `result`: Of a plate the tared stress as filed, ``depth_cm, path_cm, stress_z_N_per_cm2,
        stress_x_N_per_cm2, in_window``; of a leg ``theta_deg, force_z_N, force_x_N``.
    `fit`: Row of the fit table; empty for a leg.
    """

    kind: str
    about: str
    run: DrawnTrace
    tare: DrawnTrace
    phases: dict[str, tuple[float, float]]
    result: DrawnTrace
    fit: Mapping[Hashable, Any]


@style.styled
def draw_protocol(columns: Sequence[Protocol], title: str, confidence: float = 0.95) -> Figure:
    """Draw runs of several kinds from recording to result, one column each (after Fig. S1).

    Above: position against time. Middle: force on the intruder and of its tare against time, both
    with their own stroke beginning at 0. Below: stress of a plate with the line through zero
    (the steady mean of a horizontal run) and its interval, or the force on a leg against its angle.

    `columns`: At most eight. `title`: For example the medium's name. `confidence`: Level of the
    intervals of the fits.
    """
    if not columns:
        raise NothingToDraw("there is no run of which recording and result could be drawn")
    width = _PROTOCOL_LEFT_CM + max(len(columns) - 1, 1) * _PITCH_CM + _SIDE_CM + 0.3
    last_top, last_height = _ROWS_CM[-1]
    figure = style.new_figure(width, _TOP_CM + last_top + last_height + 1.75)
    style.text_cm(figure, 0.15, 0.12, style.plain(title), va="top", weight="bold")
    for i, column in enumerate(columns):
        left = _PROTOCOL_LEFT_CM + i * _PITCH_CM
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
            figure, left, _TOP_CM + last_top - 0.1, note, va="bottom", fontsize=leg_panels.NOTE_PT
        )
        if column.kind == "rotation":
            below.set_ylabel("force, tare taken off (N)")
        elif i == 0:
            below.set_ylabel(f"stress ({style.PER_CM2})")
    _legend(figure, f"{100 * confidence:.4g} %")
    return figure


def _heading(figure: Figure, left_cm: float, head: str, about: str) -> None:
    style.text_cm(figure, left_cm, _TOP_CM - 0.4, head, va="bottom", weight="bold")
    style.text_cm(figure, left_cm, _TOP_CM - 0.1, about, va="bottom", fontsize=leg_panels.NOTE_PT)


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
        notes.append(_value(f"\\alpha_{c}", alpha, (high - low) / 2, style.PER_CM3))
    axes.set_xlim(0, None)
    axes.set_xlabel("distance travelled (cm)" if flat else "depth (cm)")
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    return "\n".join(notes)


def _value(symbol: str, value: float, half: float, unit: str) -> str:
    text = style.number(value, 4)
    if np.isfinite(half):
        text += f" \N{PLUS-MINUS SIGN} {style.number(half, 4)}"
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
                rf"peak $F_{c}$ = {style.number(float(force[peak]), 2)} N at "
                rf"$\theta$ = {style.degrees(float(theta[peak]))}"
            )
        else:
            notes.append(f"no force $F_{c}$")
    axes.set(xlim=leg_panels.THETA_DEG, xticks=range(-90, 91, 45), xlabel=leg_panels.THETA_LABEL)
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
