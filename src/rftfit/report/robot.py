"""Speed of the robot: measured and simulated, against stride frequency and leg curvature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.errors import InputError
from rftfit.report import labels, style

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PROFILE_TITLES = {
    "table": "measured table",
    "generic": r"generic $\times$ $\zeta$",
    "depth_only": "depth-only",
}

FREQUENCY_LABEL = "stride frequency (Hz)"
CURVATURE_LABEL = r"leg curvature $R'/r$"
SPEED_LABEL = "speed (cm/s)"

_MARKERS = "osD^vP*X<>"
_BACK, _FLAT, _AHEAD = ("#0B3C6F", "#9CC9EA"), "#444444", ("#F2B27A", "#9E2A00")
_LEFT_CM, _GAP_CM, _TOP_CM, _FOOT_CM = 1.25, 0.35, 0.75, 1.15


def curvature_looks(curvatures: Sequence[float]) -> dict[float, tuple[str, str]]:
    """Colour and marker of each curvature: blue for reversed legs, red for c-legs, dark where strong.

    Parameters
    ----------
    curvatures : sequence of float

    Returns
    -------
    dict of float to (str, str)
    """
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    ordered = sorted(set(curvatures))
    back = [one for one in ordered if one < 0]
    ahead = [one for one in ordered if one > 0]
    colours: dict[float, str] = dict.fromkeys([one for one in ordered if one == 0], _FLAT)
    for part, ends in ((back, _BACK), (ahead, _AHEAD)):
        ramp = LinearSegmentedColormap.from_list("", ends)
        places = np.linspace(0, 1, len(part)) if len(part) > 1 else [0.5]
        colours |= {one: to_hex(ramp(at)) for one, at in zip(part, places, strict=True)}
    return {one: (colours[one], _MARKERS[i % len(_MARKERS)]) for i, one in enumerate(ordered)}


@style.styled
def draw_speeds(
    speed: pd.DataFrame, errors: pd.DataFrame, profiles: Sequence[str] | None = None
) -> Figure:
    """Draw speed against stride frequency, one panel a profile (Fig. 4C; with all profiles S13).

    Parameters
    ----------
    speed : pandas.DataFrame
        Simulated runs (``results/robot/speed.csv``).
    errors : pandas.DataFrame
        Measured conditions with what was simulated (``results/robot/errors.csv``). Without any,
        model curves alone are drawn, at the ends and the middle of the curvatures.
    profiles : sequence of str, optional
        Panels; default: all of the tables.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is nothing to draw.
    """
    names = list(profiles or dict.fromkeys(speed["profile"]))
    if speed.empty or not names:
        raise InputError("there is no simulated speed to draw")
    shown = sorted(set(errors["curvature_times_R"]) or {-1.0, 0.0, 1.0})
    looks = curvature_looks(shown)
    single = len(names) == 1
    panel = (
        6.6
        if single
        else (style.DOUBLE_CM - _LEFT_CM - 0.2 - (len(names) - 1) * _GAP_CM) / len(names)
    )
    width = _LEFT_CM + len(names) * panel + (len(names) - 1) * _GAP_CM + 0.2
    height = 5.4 if single else 6.2
    figure = style.new_figure(width, _TOP_CM + height + _FOOT_CM + (1.55 if single else 1.25))
    drawn = speed[speed["profile"].isin(names)]
    # where no run was steady, zero stands in for the speeds
    highest = [drawn["speed_cm_per_s"].max(), errors["measured_cm_per_s"].max()]
    lowest = float(np.nan_to_num(drawn["speed_cm_per_s"].min()))
    top = float(np.nan_to_num(highest).max() * 1.06) or 1.0
    for column, name in enumerate(names):
        left = _LEFT_CM + column * (panel + _GAP_CM)
        axes = style.axes_cm(figure, left, _TOP_CM, panel, height)
        part = errors[errors["profile"] == name]
        _speed_panel(axes, speed[speed["profile"] == name], part, looks)
        axes.set_xlim(0, 5.15)
        axes.set_ylim(min(0.0, lowest * 1.05), top)
        axes.set_xlabel(FREQUENCY_LABEL)
        axes.set_title(f"{PROFILE_TITLES.get(name, labels.plain(name))}", loc="left", fontsize=7.5)
        axes.text(0.03, 0.97, _shares(part), transform=axes.transAxes, va="top", fontsize=6)
        if column == 0:
            axes.set_ylabel(SPEED_LABEL)
        else:
            axes.tick_params(labelleft=False)
    _speed_legend(figure, looks, not errors.empty, 4 if single else len(looks))
    return figure


def _speed_panel(
    axes: Axes, speed: pd.DataFrame, errors: pd.DataFrame, looks: dict[float, tuple[str, str]]
) -> None:
    for curvature, (colour, marker) in looks.items():
        rows = speed[np.isclose(speed["curvature_times_R"], curvature)]
        mean = rows.groupby("frequency_Hz")["speed_cm_per_s"].mean()
        x, y = mean.index.to_numpy(float), mean.to_numpy(float)
        if x.size and x[0] > 0:
            # legs at rest, robot at rest
            x, y = np.append(0.0, x), np.append(0.0, y)
        axes.plot(x, y, color=colour, linewidth=1.0, zorder=2)
        own = errors[np.isclose(errors["curvature_times_R"], curvature)]
        ends = own["simulated_lo_cm_per_s"], own["simulated_hi_cm_per_s"]
        axes.vlines(own["frequency_Hz"], *ends, color=colour, linewidth=3.2, alpha=0.35, zorder=1.5)
        for told, fill in (("no", colour), ("yes", "white")):
            points = own[own["calibrated"] == told]
            axes.errorbar(
                points["frequency_Hz"], points["measured_cm_per_s"],
                yerr=points["measured_sd_cm_per_s"].fillna(0), fmt=marker, color=colour,
                markersize=3.4, markerfacecolor=fill, markeredgewidth=0.7, elinewidth=0.6,
                capsize=1.2, zorder=3,
            )  # fmt: skip


def _shares(errors: pd.DataFrame) -> str:
    from rftfit.robot.errors import share_within

    lines = []
    for percent in (20, 35):
        within, total = share_within(errors, percent)
        if total:
            lines.append(f"within {percent} %: {within} of {total}")
    return "\n".join(lines)


def _speed_legend(
    figure: Figure, looks: dict[float, tuple[str, str]], measured: bool, across: int
) -> None:
    from matplotlib.lines import Line2D

    # shown with the marker where there is one
    marks = [
        Line2D([], [], color=colour, marker=marker if measured else "", markersize=3.4)
        for colour, marker in looks.values()
    ]
    names = [labels.number(one, 2) for one in looks]
    how: dict[str, Any] = {"handlelength": 1.8, "columnspacing": 1.0, "frameon": False}
    figure.legend(
        marks, names, loc="lower center", ncols=across, title=CURVATURE_LABEL,
        bbox_to_anchor=(0.5, 0.06), title_fontsize=6.5, **how,
    )  # fmt: skip
    note = "lines: simulated"
    if measured:
        note += ", bars: interval that follows from alpha's"
        break_at = "\n" if across < len(looks) else "; "
        note += f"{break_at}points: measured (mean and s.d. of trials)"
        break_at = "\n" if across < len(looks) else ", "
        note += f"{break_at}hollow where the robot was calibrated on them"
    height = float(figure.get_size_inches()[1]) / style.CM
    style.text_cm(figure, 0.2, height - 0.12, note, fontsize=5.5, va="bottom")


@style.styled
def draw_optimum(speed: pd.DataFrame, optimum: pd.DataFrame, profile: str = "table") -> Figure:
    """Draw simulated speed over curvature and frequency, with the best curvature (Fig. 4D).

    Parameters
    ----------
    speed : pandas.DataFrame
        Simulated runs.
    optimum : pandas.DataFrame
        Best curvatures (``results/robot/optimum.csv``).
    profile : str, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is nothing to draw.
    """
    own = speed[speed["profile"] == profile]
    best = optimum[optimum["profile"] == profile].sort_values("frequency_Hz")
    frequencies = best["frequency_Hz"].to_numpy(float)
    grid = own[np.isin(own["frequency_Hz"], frequencies)]
    table = grid.pivot_table(
        index="frequency_Hz", columns="curvature_times_R", values="speed_cm_per_s"
    )
    if own.empty:
        raise InputError(f"there is no sweep of profile {profile!r} to draw")
    if table.empty:
        return _without_speed(own, profile)
    figure = style.new_figure(style.DOUBLE_CM, 7.9)
    left = style.axes_cm(figure, 1.25, 0.75, 6.4, 6.1)
    whole = table.dropna(axis="columns")
    image = left.pcolormesh(
        whole.columns.to_numpy(float), whole.index.to_numpy(float), whole.to_numpy(float),
        cmap=style.SEQUENTIAL, shading="nearest", vmin=0,
    )  # fmt: skip
    low = (best["best_curvature_times_R"] - best["reading_lo"]).clip(lower=0)
    high = (best["reading_hi"] - best["best_curvature_times_R"]).clip(lower=0)
    left.errorbar(
        best["best_curvature_times_R"], frequencies, xerr=[low, high], fmt="o-", color="white",
        markersize=3, linewidth=0.8, elinewidth=0.8, capsize=1.5, markeredgecolor="black",
        markeredgewidth=0.4,
    )  # fmt: skip
    left.set_xlim(-1.04, 1.04)
    left.set_xlabel(CURVATURE_LABEL)
    left.set_ylabel(FREQUENCY_LABEL)
    left.set_title(
        "fastest curvature at each frequency, as far as it can be read", loc="left", fontsize=6.5
    )
    bar = style.axes_cm(figure, 7.85, 0.75, 0.3, 6.1)
    figure.colorbar(image, cax=bar, label=SPEED_LABEL)
    right = style.axes_cm(figure, 10.9, 0.75, 7.2, 6.1)
    _curves(right, grid, best)
    return figure


def _without_speed(own: pd.DataFrame, profile: str) -> Figure:
    """Draw, in place of a map, why there is no speed to show."""
    reasons = own["reason"].value_counts()
    why = labels.plain(str(reasons.index[0])) if len(reasons) else "no reason was recorded"
    figure = style.new_figure(style.DOUBLE_CM, 2.4)
    figure.text(
        0.03, 0.5,
        f"{PROFILE_TITLES.get(profile, labels.plain(profile))}: no run of the sweep has a steady "
        f"speed\n{why}", va="center", fontsize=7,
    )  # fmt: skip
    return figure


def _curves(axes: Axes, grid: pd.DataFrame, best: pd.DataFrame) -> None:
    from matplotlib import colormaps

    frequencies = best["frequency_Hz"].to_numpy(float)
    wanted = frequencies[:: max(1, len(frequencies) // 6)] if len(frequencies) > 8 else frequencies
    if frequencies.size and frequencies[-1] not in wanted:
        wanted = np.append(wanted, frequencies[-1])
    ramp = colormaps[style.SEQUENTIAL]
    for at, frequency in enumerate(wanted):
        colour = ramp(0.05 + 0.85 * at / max(1, len(wanted) - 1))
        mean = (
            grid[grid["frequency_Hz"] == frequency]
            .groupby("curvature_times_R")["speed_cm_per_s"]
            .mean()
        )
        axes.plot(mean.index, mean, "-", color=colour, linewidth=1, marker=".", markersize=2.5)
        axes.annotate(
            f"{frequency:g} Hz", (1.0, float(mean.iloc[-1])), textcoords="offset points",
            xytext=(4, 0), va="center", fontsize=6, color=colour, annotation_clip=False,
        )  # fmt: skip
        top = best[best["frequency_Hz"] == frequency].iloc[0]
        axes.plot(
            top["best_curvature_times_R"], top["speed_cm_per_s"], "o", color=colour, markersize=4,
            markeredgecolor="black", markeredgewidth=0.5, zorder=4,
        )  # fmt: skip
    axes.set_xlim(-1.04, 1.3)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.set_xticks(np.arange(-1, 1.01, 0.5))
    axes.set_xlabel(CURVATURE_LABEL)
    axes.set_ylabel(SPEED_LABEL)
    axes.set_title("simulated; circles: fastest curvature", loc="left", fontsize=6.5)
