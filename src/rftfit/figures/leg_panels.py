"""What all figures of legs share: the sketch of a leg, forces against theta."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.figures import style
from rftfit.model.outlines import CURVATURES, leg_outline
from rftfit.reference import LEGS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes

    from rftfit.figures.maps import FloatArray


# --- A leg drawn in the sand at a few angles: the inset that says what theta and the leg's name mean.


SKETCH_DEG = (-60.0, -30.0, 0.0, 30.0, 60.0)
_SAND, _SURFACE = "#efe6d2", "#8a7343"


def model_legs() -> dict[str, Leg]:
    """Make the paper's three legs."""
    return {
        name: Leg(
            shape="leg", curvature_times_R=curvature, max_length_cm=7.62, width_cm=2.54,
            thickness_cm=0.64, hip_height_cm=2.0,
        )
        for name, curvature in CURVATURES.items()
    }  # fmt: skip


def leg_line(leg: Leg, theta_deg: float) -> FloatArray:
    """Points along a leg, from its axle to its tip.

    Returns shape (n, 2): x, z (cm) in the lab frame, the axle over x = 0.
    """
    x, z, tx, tz, half = leg_outline(leg).body.T
    last = [x[-1] + half[-1] * tx[-1], z[-1] + half[-1] * tz[-1]]
    body = np.vstack([np.column_stack([x - half * tx, z - half * tz]), last])
    cos, sin = np.cos(np.radians(theta_deg)), np.sin(np.radians(theta_deg))
    turned = np.column_stack(
        [body[:, 0] * cos + body[:, 1] * sin, body[:, 1] * cos - body[:, 0] * sin]
    )
    turned[:, 1] += leg.hip_height_cm
    return turned


def add_sketch(axes: Axes, leg: Leg | None, theta_deg: Sequence[float] = SKETCH_DEG) -> None:
    """Draw a leg in the sand at some angles, to scale, with a bar of 2 cm.

    `axes`: Emptied of its frame; its aspect becomes equal. `leg`: None where its shape is not
    known, which the panel then says. `theta_deg`: Every other angle is drawn darker, so that
    neighbours stay apart.
    """
    axes.set_axis_off()
    if leg is None:
        axes.text(0.5, 0.5, "shape of this leg not given", ha="center", va="center",
                  transform=axes.transAxes, fontsize=6)  # fmt: skip
        return
    reach, hip = leg.max_length_cm, leg.hip_height_cm
    left, right, bottom, top = -1.6 * reach, 1.6 * reach, hip - 1.35 * reach, hip + 0.38 * reach
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.axhspan(bottom, 0, color=_SAND, linewidth=0)
    axes.axhline(0, color=_SURFACE, linewidth=0.6)
    for theta in theta_deg:
        line = leg_line(leg, theta)
        dark = theta == 0
        colour = "black" if dark else "#7a7a7a"
        axes.plot(*line.T, color=colour, linewidth=1.4 if dark else 0.9, solid_capstyle="round")
        outward = np.array([-np.sin(np.radians(theta)), -np.cos(np.radians(theta))])
        x, z = [0.0, hip] + outward * (1.17 * reach)
        axes.text(x, z, style.degrees(theta), ha="center", va="center", fontsize=5, color=colour)
    axes.plot(0, hip, "o", color="black", markersize=2.5)
    _turn_arrow(axes, reach, hip, -1 if leg.curvature_times_R < 0 else 1)
    x0, z0 = right - 0.42 * reach, bottom + 0.14 * reach
    axes.plot([x0, x0 + 2], [z0, z0], color="black", linewidth=1)
    axes.text(x0 + 1, z0 + 0.06 * reach, "2 cm", ha="center", va="bottom", fontsize=5)
    _frame_arrows(axes, left + 0.12 * reach, hip - 1.25 * reach, 0.3 * reach)


def _turn_arrow(axes: Axes, reach: float, hip: float, side: int) -> None:
    start, end = ((-np.sin(a) * 0.32 * reach, hip - np.cos(a) * 0.32 * reach)
                  for a in np.radians([150.0, 210.0]))  # fmt: skip
    # over the axle, from back to front: the sense in which theta grows below it
    axes.annotate("", xy=end, xytext=start, arrowprops={
        "arrowstyle": "->", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6,
        "connectionstyle": "arc3,rad=-0.5"})  # fmt: skip
    axes.text(
        side * 0.3 * reach, hip + 0.3 * reach, r"$\theta$", ha="center", va="center", fontsize=6
    )


def _frame_arrows(axes: Axes, x: float, z: float, length: float) -> None:
    how = {"arrowstyle": "->", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 5}
    for dx, dz, name in ((length, 0.0, "x"), (0.0, length, "z")):
        axes.annotate("", xy=(x + dx, z + dz), xytext=(x, z), arrowprops=how)
        axes.text(x + 1.35 * dx, z + 1.35 * dz, f"${name}$", ha="center", va="center", fontsize=6)


def sketched(legs: Mapping[str, Leg] | None) -> Mapping[str, Leg]:
    """Shapes to sketch: those of the config, or the paper's three."""
    return model_legs() if legs is None else legs


# --- What all figures of legs share: forces against theta, drawn, missing or beyond the panel.


PROFILE_LOOKS: dict[str, tuple[str, Any, str]] = {
    "table": (style.OKABE_ITO["blue"], "-", "o"),
    "fourier": (style.OKABE_ITO["vermillion"], (0, (4, 1.2)), "s"),
    "generic": (style.OKABE_ITO["reddish purple"], (0, (5, 1.2, 1, 1.2)), "^"),
    "depth_only": (style.OKABE_ITO["bluish green"], (0, (1, 1)), "D"),
}
"""Colour, line and marker of each profile; line and marker serve grey prints."""

PROFILE_TITLES = {
    "table": "interpolated table",
    "fourier": "nine-term fit",
    "generic": r"generic $\times$ $\zeta$",
    "depth_only": "depth-only",
}

_LEG_TITLES = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}

THETA_LABEL = r"leg angle $\theta$ (deg)"
THETA_DEG = (-135.0, 135.0)
GAP_DEG = 2.5
"""A wider step between neighbours is a gap: the line is broken there."""

MEASURED = "#4d4d4d"
NOTE_PT = 5.5


def leg_title(leg: str) -> str:
    """Name of a leg in figures.

    `leg`: Key of the config.
    """
    return _LEG_TITLES.get(leg, style.plain(leg))


def leg_order(tables: Iterable[pd.DataFrame], legs: Sequence[str] | None = None) -> list[str]:
    """Legs to draw: those asked for, or all of the tables, the paper's three first.

    `tables`: With a column ``leg``. Returns the paper's three where the tables have none.
    """
    if legs is not None:
        return list(legs)
    found = dict.fromkeys(str(leg) for table in tables for leg in table["leg"].unique())
    known = [leg for leg in LEGS if leg in found]
    return known + [leg for leg in found if leg not in LEGS] or list(LEGS)


def rows_of(table: pd.DataFrame, **wanted: str) -> pd.DataFrame:
    """Rows of a table whose columns have the wanted values, in the order of theta.

    `**wanted`: Column and value. Returns sorted by ``run_id`` (where there is one) and
    ``theta_deg``.
    """
    for name, value in wanted.items():
        table = table[table[name] == value]
    order = [name for name in ("run_id", "theta_deg") if name in table.columns]
    return table.sort_values(order, kind="stable")


def broken(rows: pd.DataFrame, *columns: str) -> list[FloatArray]:
    """Theta and columns of it, with a NaN in each gap and between runs, so that lines break there.

    `rows`: From `rows_of`. Returns theta (deg) first.
    """
    theta = rows["theta_deg"].to_numpy(float)
    step = np.diff(theta)
    cuts = np.flatnonzero((step > GAP_DEG) | (step < 0)) + 1
    values = [theta, *(rows[name].to_numpy(float) for name in columns)]
    return [np.insert(value, cuts, np.nan) for value in values]


def has_force(rows: pd.DataFrame, component: str) -> bool:
    """Whether there is any finite force in the rows."""
    return bool(np.isfinite(rows[f"force_{component}_N"].to_numpy(float)).any())


def why_missing(rows: pd.DataFrame) -> str:
    """First reason given in the rows, in brackets, or nothing."""
    if "reason" not in rows.columns:
        return ""
    told = (str(reason) for reason in rows["reason"] if isinstance(reason, str) and reason)
    return next((f" ({style.plain(reason)})" for reason in told), "")


def add_predicted(
    axes: Axes, rows: pd.DataFrame, component: str, colour: str, line: Any = "-"
) -> None:
    """Draw a predicted curve with its interval.

    `rows`: Of one medium, leg and profile, from `rows_of`. `line`: A line style of matplotlib.
    """
    names = [f"force_{component}_{part}N" for part in ("", "lo_", "hi_")]
    theta, force, low, high = broken(rows, *names)
    axes.fill_between(theta, low, high, color=colour, alpha=0.3, linewidth=0)
    axes.plot(theta, force, color=colour, linestyle=line, linewidth=0.9)


def peak(rows: pd.DataFrame, component: str = "z") -> float:
    """Largest force; NaN where there is none.

    Returns N.
    """
    force = rows[f"force_{component}_N"].to_numpy(float)
    return float(np.nanmax(force)) if np.isfinite(force).any() else float("nan")


def theta_axes(axes: Axes, name: bool) -> None:
    """Prepare an axes for curves against theta.

    `name`: Write the label and numbers of theta.
    """
    axes.axhline(0, color="#808080", linewidth=0.4, zorder=0)
    axes.set(xlim=THETA_DEG, xticks=[-90, -45, 0, 45, 90])
    axes.tick_params(labelbottom=name)
    if name:
        axes.set_xlabel(THETA_LABEL)


def force_range(axes: Axes, forces: Sequence[FloatArray], notes: Sequence[str] = ()) -> None:
    """Set the range of the forces, with room above them for notes, and write the notes there.

    `forces`: All that must be seen, N. `notes`: Statements on what is missing or beyond the panel,
    one line each.
    """
    every = np.concatenate([np.zeros(1), *forces])
    every = every[np.isfinite(every)]
    low, high = float(every.min()), float(every.max())
    box = axes.get_window_extent()
    width_pt, height_pt = (side * 72 / axes.figure.dpi for side in (box.width, box.height))
    size = NOTE_PT + (low == high)
    # a letter is about 0.55 of its size wide
    across = max(12, int(0.94 * width_pt / (0.55 * size)))
    lines = [line for note in notes for line in textwrap.wrap(note, across)]
    how: dict[str, Any] = {"color": style.MARK, "fontsize": size, "linespacing": 1.25, "zorder": 5}
    if low == high:
        axes.set(ylim=(-1, 1), yticks=[])
        lines = lines or ["nothing to draw"]
        write = axes.text(
            0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes, **how
        )
    else:
        share = min(0.6, (len(lines) * 1.4 * size + (4 if lines else 0)) / height_pt)
        margin = 0.06 * (high - low)
        low -= margin
        axes.set_ylim(low, low + (high + margin - low) / (1 - share))
        write = axes.text(
            0.02, 0.985, "\n".join(lines), ha="left", va="top", transform=axes.transAxes, **how
        )
    # what is cut off runs through the room of the notes
    write.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.6})
