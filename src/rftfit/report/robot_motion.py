"""How the robot moves in a stride: speed, height, pitch, and the ground's reaction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.report import labels, style
from rftfit.report.robot import PROFILE_TITLES

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEGS = {1.0: "c-leg", 0.0: "flat leg", -1.0: "reversed c-leg"}
_LEFT_CM, _GAP_CM, _TOP_CM, _FOOT_CM = 1.6, 0.35, 0.95, 0.6
_PANEL_CM, _PITCH_CM = 2.6, 2.95

_KINEMATICS = (
    ("velocity_x_cm_per_s", "forward velocity\n(cm/s)"),
    ("z_cm", "height\n(cm)"),
    ("pitch_deg", "pitch, nose up\n(deg)"),
)
_PROFILE_LOOKS = {
    "table": (style.OKABE_ITO["blue"], "-"),
    "generic": (style.OKABE_ITO["reddish purple"], (0, (5, 1.2, 1, 1.2))),
    "depth_only": (style.OKABE_ITO["bluish green"], (0, (1.5, 1))),
}
_GROUPS = (
    style.OKABE_ITO["blue"],
    style.OKABE_ITO["vermillion"],
    style.OKABE_ITO["bluish green"],
    "#888888",
    style.OKABE_ITO["yellow"],
    style.OKABE_ITO["sky blue"],
)


def leg_name(curvature: float) -> str:
    """Name of a leg by its curvature.

    Parameters
    ----------
    curvature : float
        R'/r.

    Returns
    -------
    str
    """
    return _LEGS.get(curvature, f"R'/r = {labels.number(curvature, 2)}")


@style.styled
def draw_motion(motion: pd.DataFrame, profile: str = "table") -> Figure:
    """Draw forward velocity, height, pitch, lift and thrust over two strides (after Fig. 4B).

    Parameters
    ----------
    motion : pandas.DataFrame
        ``results/robot/motion.csv``: `profile, curvature_times_R, frequency_Hz, stride`, and the
        columns of `rftfit.robot.series.Series.table`.
    profile : str, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the profile was not simulated.
    """
    own = motion[motion["profile"] == profile]
    if own.empty:
        raise InputError(f"there is no motion of profile {profile!r} to draw")
    curvatures = sorted(set(own["curvature_times_R"]), reverse=True)
    rows = len(_KINEMATICS) + 2
    figure, panels = _panels(len(curvatures), rows)
    groups = group_names(own)
    for column, curvature in enumerate(curvatures):
        part = own[own["curvature_times_R"] == curvature].sort_values("stride")
        stride = part["stride"].to_numpy(float)
        for row, (name, label) in enumerate(_KINEMATICS):
            axes = panels[row][column]
            # the tables' angles turn from z toward x: nose down is positive there
            sign = -1 if name == "pitch_deg" else 1
            axes.plot(stride, sign * part[name], color="black", linewidth=1)
            if column == 0:
                axes.set_ylabel(label)
        mean = _mean_speed(part)
        panels[0][column].axhline(mean, color="#888888", linewidth=0.7, linestyle=(0, (4, 2)))
        panels[0][column].set_title(
            f"{leg_name(curvature)}, {part['frequency_Hz'].iloc[0]:g} Hz: {mean:.3g} cm/s",
            fontsize=7,
        )
        for row, component, label in (
            (rows - 2, "z", "lift by group\n(N)"),
            (rows - 1, "x", "thrust by group\n(N)"),
        ):
            axes = panels[row][column]
            for group, colour in zip(groups, _GROUPS, strict=False):
                axes.plot(stride, part[f"force_{component}_{group}_N"], color=colour, linewidth=0.9)
            axes.axhline(0, color="black", linewidth=0.4)
            if column == 0:
                axes.set_ylabel(label)
    _share_ranges(panels)
    _legend(figure, [g.replace("_", " ") for g in groups], list(_GROUPS))
    return figure


@style.styled
def draw_reaction(motion: pd.DataFrame) -> Figure:
    """Draw lift and thrust of the first tripod by every profile (after Fig. S14).

    Parameters
    ----------
    motion : pandas.DataFrame
        As for `draw_motion`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If nothing was simulated.
    """
    if motion.empty:
        raise InputError("there is no motion to draw")
    curvatures = sorted(set(motion["curvature_times_R"]), reverse=True)
    profiles = list(dict.fromkeys(motion["profile"]))
    figure, panels = _panels(len(curvatures), 3)
    quantities = (
        ("force_z_tripod_1_N", "lift of a tripod\n(N)"),
        ("force_x_tripod_1_N", "thrust of a tripod\n(N)"),
        ("velocity_x_cm_per_s", "forward velocity\n(cm/s)"),
    )
    for column, curvature in enumerate(curvatures):
        for profile in profiles:
            chosen = (motion["curvature_times_R"] == curvature) & (motion["profile"] == profile)
            part = motion[chosen].sort_values("stride")
            colour, line = _PROFILE_LOOKS.get(profile, ("black", "-"))
            for row, (name, label) in enumerate(quantities):
                axes = panels[row][column]
                axes.plot(part["stride"], part[name], color=colour, linestyle=line, linewidth=1)
                axes.axhline(0, color="black", linewidth=0.4)
                if column == 0:
                    axes.set_ylabel(label)
        frequency = motion["frequency_Hz"].iloc[0]
        panels[0][column].set_title(f"{leg_name(curvature)}, {frequency:g} Hz", fontsize=7)
    _share_ranges(panels)
    names = [PROFILE_TITLES.get(name, labels.plain(name)) for name in profiles]
    looks = [_PROFILE_LOOKS.get(name, ("black", "-")) for name in profiles]
    _legend(figure, names, [look[0] for look in looks], [look[1] for look in looks])
    return figure


def group_names(motion: pd.DataFrame) -> list[str]:
    """Find the groups of elements in a table of motion: tripods first, then plates.

    Parameters
    ----------
    motion : pandas.DataFrame

    Returns
    -------
    list of str
    """
    found = [
        name.removeprefix("force_z_").removesuffix("_N")
        for name in motion.columns
        if name.startswith("force_z_")
    ]
    return sorted(found, key=lambda name: (not name.startswith("tripod"), found.index(name)))


def _mean_speed(part: pd.DataFrame) -> float:
    time, x = part["time_s"].to_numpy(float), part["x_cm"].to_numpy(float)
    return float((x[-1] - x[0]) / (time[-1] - time[0]))


def _panels(columns: int, rows: int) -> tuple[Figure, list[list[Axes]]]:
    panel = (style.DOUBLE_CM - _LEFT_CM - 0.2 - (columns - 1) * _GAP_CM) / columns
    panel = min(panel, 7.5)
    width = _LEFT_CM + columns * panel + (columns - 1) * _GAP_CM + 0.2
    figure = style.new_figure(width, _TOP_CM + rows * _PITCH_CM + _FOOT_CM)
    panels = []
    for row in range(rows):
        top = _TOP_CM + row * _PITCH_CM
        line = [
            style.axes_cm(figure, _LEFT_CM + c * (panel + _GAP_CM), top, panel, _PANEL_CM)
            for c in range(columns)
        ]
        for axes in line:
            axes.tick_params(labelbottom=row == rows - 1)
            axes.margins(x=0)
        line[0].yaxis.set_label_coords(-0.78 / panel, 0.5)
        panels.append(line)
    for axes in panels[-1]:
        axes.set_xlabel("strides")
    return figure, panels


def _share_ranges(panels: list[list[Axes]]) -> None:
    """One range for each row, named at its left only."""
    for line in panels:
        ends = np.array([axes.get_ylim() for axes in line])
        for column, axes in enumerate(line):
            axes.set_ylim(ends[:, 0].min(), ends[:, 1].max())
            axes.tick_params(labelleft=column == 0)


def _legend(
    figure: Figure, names: list[str], colours: list[str], lines: list[object] | None = None
) -> None:
    from matplotlib.lines import Line2D

    shown = [
        Line2D([], [], color=colours[i], linestyle=lines[i] if lines else "-")  # type: ignore[arg-type]
        for i in range(len(names))
    ]
    figure.legend(
        shown, names, loc="upper center", ncols=len(names), frameon=False, borderaxespad=0.1
    )
