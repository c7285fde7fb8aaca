"""Predicted over measured peak lift of every model, leg and medium, with intervals."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import NullLocator

from rftfit.errors import InputError
from rftfit.report import curves, labels, style

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    Row = Mapping[Hashable, Any]

_LEFT_CM, _RIGHT_CM, _TOP_CM, _ROW_CM, _BETWEEN_CM = 2.8, 0.25, 0.5, 0.54, 0.6
_BANDS = {33.0: "#ececec", 10.0: "#cfcfcf"}
"""Errors that the paper states, percent, and their shades."""

_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_PEAKS = {"z": "peak lift", "x": "peak horizontal force"}


@style.styled
def draw_peak_errors(
    errors: pd.DataFrame,
    component: str = "z",
    media: Sequence[str] | None = None,
    titles: Mapping[str, str] | None = None,
    legs: Sequence[str] | None = None,
    confidence: float = 0.95,
) -> Figure:
    """Draw predicted over measured peak force, one panel per leg, one row per medium.

    The axis is logarithmic in the ratio, so that a tenth and ten times too much are alike far off,
    and its ticks say the error in percent of the measured peak.

    Parameters
    ----------
    errors : pandas.DataFrame
        ``results/leg_errors.csv``.
    component : {"z", "x"}
        Peak lift or peak horizontal force.
    media : sequence of str, optional
        Rows; by default all of the table.
    titles : mapping of str to str, optional
        Names of the media.
    legs : sequence of str, optional
        Panels; by default all of the table, the paper's three first.
    confidence : float
        Level of the intervals in `errors`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is no medium to draw.
    """
    rows = errors[errors["component"] == component]
    if media is None:
        media = [str(medium) for medium in rows["medium"].unique()]
    if not media:
        raise InputError(f"no leg errors of component {component!r} to draw")
    names = curves.leg_order([rows], legs)
    found = set(rows["profile"])
    profiles = [profile for profile in curves.PROFILE_LOOKS if profile in found]
    ratios = _ratios(rows)
    height = len(media) * _ROW_CM
    total = _TOP_CM + len(names) * (height + _BETWEEN_CM) + 1.75
    figure = style.new_figure(style.SINGLE_CM, total)
    low, high = _span(ratios)
    for i, leg in enumerate(names):
        top = _TOP_CM + i * (height + _BETWEEN_CM)
        width = style.SINGLE_CM - _LEFT_CM - _RIGHT_CM
        axes = style.axes_cm(figure, _LEFT_CM, top, width, height)
        _prepare(axes, (low, high), [labels.title_of(name, titles) for name in media])
        axes.set_title(curves.leg_title(leg), weight="bold", loc="left")
        for place, medium in enumerate(media):
            own = ratios[(ratios["medium"] == medium) & (ratios["leg"] == leg)]
            _draw_row(axes, place, {str(r["profile"]): r for r in own.to_dict("records")}, profiles)
        axes.tick_params(labelbottom=i == len(names) - 1)
        if i == len(names) - 1:
            axes.set_xlabel(f"error of the predicted {_PEAKS[component]} (% of measured)")
    _legend(figure, profiles, f"{100 * confidence:.4g} %")
    return figure


def _ratios(rows: pd.DataFrame) -> pd.DataFrame:
    """Peak and its interval over the measured peak; NaN where that is no positive number."""
    measured = rows["peak_measured_N"].to_numpy(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        peak, *ends = (
            rows[f"peak_predicted_{part}N"].to_numpy(float) / measured
            for part in ("", "lo_", "hi_")
        )
    # a negative peak turns its interval round
    low, high = np.sort(np.stack(ends), axis=0)
    good = [np.where(np.isfinite(r) & (r > 0), r, np.nan) for r in (peak, low, high)]
    return rows.assign(ratio=good[0], ratio_lo=good[1], ratio_hi=good[2])


def _span(ratios: pd.DataFrame) -> tuple[float, float]:
    every = ratios[["ratio", "ratio_lo", "ratio_hi"]].to_numpy(float)
    found = [0.6, 1.6, *every[np.isfinite(every)].tolist()]
    return min(found) / 1.15, max(found) * 1.15


def _prepare(axes: Axes, span: tuple[float, float], media: Sequence[str]) -> None:
    axes.set_xscale("log")
    for percent, shade in _BANDS.items():
        axes.axvspan(1 - percent / 100, 1 + percent / 100, color=shade, linewidth=0, zorder=0)
    axes.axvline(1, color="black", linewidth=0.5, zorder=0.5)
    ticks = [tick for tick in _TICKS if span[0] <= tick <= span[1]]
    names = [f"{100 * (t - 1):+.0f}" if t != 1 else "0" for t in ticks]
    axes.set_xticks(ticks, [name.replace("-", "\N{MINUS SIGN}") for name in names])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(xlim=span, ylim=(len(media) - 0.5, -0.5))
    axes.set_yticks(range(len(media)), media)
    axes.tick_params(axis="y", length=0)
    for edge in np.arange(len(media) - 1) + 0.5:
        axes.axhline(edge, color="#b0b0b0", linewidth=0.3, zorder=0.5)


def _draw_row(axes: Axes, place: int, own: Mapping[str, Row], profiles: Sequence[str]) -> None:
    missing, points = [], []
    drawn = [profile for profile in profiles if profile in own]
    for i, profile in enumerate(drawn):
        ratio, low, high = (float(own[profile][n]) for n in ("ratio", "ratio_lo", "ratio_hi"))
        if not np.isfinite(ratio):
            missing.append(curves.PROFILE_TITLES[profile])
            continue
        if np.isfinite(high) and not np.isfinite(low):
            low = axes.get_xlim()[0]  # an interval that includes zero has no end on this axis
        points += [ratio, low, high]
        colour, _, marker = curves.PROFILE_LOOKS[profile]
        y = place + 0.74 * ((i + 0.5) / len(drawn) - 0.5)
        axes.hlines(y, low, high, color=colour, linewidth=1.0)
        axes.plot(ratio, y, marker, color=colour, markersize=2.9, markeredgewidth=0)
    if not missing and drawn:
        return
    if points:
        told = f"no value: {', '.join(missing)}"
    else:
        told = "no value" + _why(own[drawn[0]]) if drawn else "nothing predicted"
    # on the side where more room is left
    first, last = axes.get_xlim()
    found = [point for point in points if np.isfinite(point)] or [first]
    right = last / max(found) >= min(found) / first
    axes.text(
        0.985 if right else 0.015, place, "\n".join(textwrap.wrap(told, 52)),
        ha="right" if right else "left", va="center", fontsize=5, color=style.MARK,
        transform=axes.get_yaxis_transform(),
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )  # fmt: skip


def _why(row: Row) -> str:
    reason = row.get("reason")
    return f": {labels.plain(reason)}" if isinstance(reason, str) and reason else ""


def _legend(figure: Figure, profiles: Sequence[str], level: str) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {}
    for profile in profiles:
        colour, _, marker = curves.PROFILE_LOOKS[profile]
        entries[f"{curves.PROFILE_TITLES[profile]}"] = Line2D(
            [], [], color=colour, marker=marker, markersize=2.6
        )
    for percent, shade in reversed(_BANDS.items()):
        entries[f"within {percent:.0f} %"] = Patch(facecolor=shade)
    entries[f"bars: {level} interval"] = Line2D([], [], linestyle="")
    figure.legend(
        list(entries.values()),
        list(entries),
        loc="lower center",
        ncols=3,
        columnspacing=1.2,
        borderaxespad=0.2,
    )
