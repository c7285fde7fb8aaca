"""Parts of several figures of legs: the sketch of a leg, panels of forces against theta, looks of profiles and legs.

A leg turns about its axle; theta is the angle from straight down to the line from axle to tip, degrees, negative in
front. Forces are those of the medium on the leg, N: x forward, z up. Tables of forces have a row for each angle:
``medium``, ``leg``, ``theta_deg``, ``force_z_N``, ``force_x_N``; predicted ones also ``profile`` (which alpha was used:
`PROFILE_LOOKS`) and intervals, measured ones ``run_id``. `component`: ``z`` or ``x``.
"""

from __future__ import annotations

import itertools
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import labels, style
from rftfit.figures.traces import with_end_names
from rftfit.forces.outlines import leg_outline
from rftfit.model.draws import model_end_names
from rftfit.reference import LEGS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import pandas as pd
    from matplotlib.axes import Axes

    from rftfit.campaign.config import Leg
    from rftfit.conventions import FloatArray
    from rftfit.results import Results


PROFILE_LOOKS: dict[str, tuple[str, Any, str]] = {
    "table": (style.OKABE_ITO["blue"], style.DASHES["solid"], "o"),
    "map": (style.OKABE_ITO["orange"], style.DASHES["long"], "v"),
    "fourier": (style.OKABE_ITO["vermillion"], style.DASHES["dashed"], "s"),
    "generic": (style.OKABE_ITO["reddish purple"], style.DASHES["dash-dotted"], "^"),
    "depth_only": (style.OKABE_ITO["bluish green"], style.DASHES["dotted"], "D"),
}
"""Colour, line and marker of each profile; line and marker serve grey prints."""

LEG_LOOKS = {
    "c_leg": ("blue", "o"),
    "flat_leg": ("vermillion", "s"),
    "reversed_c_leg": ("bluish green", "D"),
}
"""Colour (a name in `style.OKABE_ITO`) and marker of each leg of the paper; the marker serves grey prints."""
_LOOKS_OF_OTHER_LEGS = (("reddish purple", "^"), ("orange", "v"), ("sky blue", "P"))

PROFILE_TITLES = labels.PROFILE_NAMES | {"generic": r"generic $\times$ $\zeta$"}
"""Names of the profiles in figures."""

THETA_LABEL = r"leg angle $\theta$ (deg)"
THETA_DEG = (-135.0, 135.0)
MEASURED = "#4d4d4d"
"""Label and range of the axis of theta; colour of measured forces beside several predicted ones."""


def leg_title(leg: str) -> str:
    """Return the name of a leg in figures; a leg that is not the paper's keeps its key."""
    return labels.LEG_NAMES.get(leg, style.plain(leg))


def name_of_interval(results: Results) -> str:
    """Name the interval of a force on a leg by its level and the errors that it holds."""
    return f"{style.level(results)} interval of alpha, axle and arc"


def leg_order(tables: Iterable[pd.DataFrame]) -> list[str]:
    """List the legs of tables, the paper's three first; just these three where the tables have none."""
    legs = dict.fromkeys(str(leg) for table in tables for leg in table["leg"].unique())
    paper_legs = [leg for leg in LEGS if leg in legs]
    return paper_legs + [leg for leg in legs if leg not in LEGS] or list(LEGS)


def leg_looks(legs: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return colour (a name in `style.OKABE_ITO`) and marker of each leg; the paper's legs look alike in all figures."""
    further = itertools.cycle(_LOOKS_OF_OTHER_LEGS)
    return {leg: LEG_LOOKS.get(leg) or next(further) for leg in legs}


def read_curves(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Read the tables of predicted and of measured forces on legs in all media."""
    return results.table("predicted.csv"), results.joined("legs/{medium}.csv")


# A leg drawn in the sand at a few angles: shows what theta and the name of the leg mean


def leg_line(leg: Leg, theta_deg: float) -> FloatArray:
    """Return points along a leg from axle to tip, shape (n, 2): x, z in cm in the lab frame, the axle over x = 0.

    `leg`: Of the config, with the height of its axle above the surface. `theta_deg`: Its angle.
    """
    # middles, tangents and half lengths of the elements
    x, z, tx, tz, half = leg_outline(leg).body.T
    tip = [x[-1] + half[-1] * tx[-1], z[-1] + half[-1] * tz[-1]]
    body = np.vstack([np.column_stack([x - half * tx, z - half * tz]), tip])
    (x, z), theta = body.T, np.radians(theta_deg)
    turned_x = x * np.cos(theta) + z * np.sin(theta)
    turned_z = z * np.cos(theta) - x * np.sin(theta)
    return np.column_stack([turned_x, turned_z + leg.hip_height_cm])


def add_sketch(axes: Axes, leg: Leg) -> None:
    """Draw a leg in the sand at some angles, to scale, with a bar of 2 cm: shows what theta, leg and axle mean.

    `leg`: Of the config. The hanging leg is black, the others grey.
    """
    axes.set_axis_off()
    reach, hip = leg.max_length_cm, leg.hip_height_cm
    left, right, bottom, top = -1.6 * reach, 1.6 * reach, hip - 1.35 * reach, hip + 0.38 * reach
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    style.draw_sand(axes, bottom)
    for theta in (-60.0, -30.0, 0.0, 30.0, 60.0):
        line = leg_line(leg, theta)
        is_upright = theta == 0
        colour = "black" if is_upright else "#7a7a7a"
        axes.plot(
            *line.T, color=colour, linewidth=1.4 if is_upright else 0.9, solid_capstyle="round"
        )
        # unit vector from the axle to the tip, beyond which the angle is written
        outward = np.array([-np.sin(np.radians(theta)), -np.cos(np.radians(theta))])
        x, z = [0.0, hip] + outward * (1.17 * reach)
        axes.text(x, z, style.degrees(theta), ha="center", va="center", fontsize=5.5, color=colour)
    axes.plot(0, hip, "o", color="black", markersize=2.5)
    _turn_arrow(axes, reach, hip, -1 if leg.curvature_times_R < 0 else 1)
    x0, z0 = right - 0.42 * reach, bottom + 0.14 * reach
    axes.plot([x0, x0 + 2], [z0, z0], color="black", linewidth=1)
    axes.text(x0 + 1, z0 + 0.06 * reach, "2 cm", ha="center", va="bottom", fontsize=5.5)
    style.draw_frame(axes, left + 0.12 * reach, hip - 1.25 * reach, 0.3 * reach)


def _turn_arrow(axes: Axes, reach: float, hip: float, side: int) -> None:
    """Draw an arrow in the direction in which theta grows, above the axle at height `hip`, cm.

    `reach`: Length of the leg, cm, which scales the arrow. `side`: -1 for a letter at its left, 1 at its right.
    """
    angles = np.radians([150.0, 210.0])
    x, z = -0.32 * reach * np.sin(angles), hip - 0.32 * reach * np.cos(angles)
    start, end = zip(x, z, strict=True)
    # theta grows from front to back below the axle, so above it from back to front
    arrow_style = style.ARROW | {"mutation_scale": 6, "connectionstyle": "arc3,rad=-0.5"}
    axes.annotate("", xy=end, xytext=start, arrowprops=arrow_style)
    label_position = side * 0.3 * reach, hip + 0.3 * reach
    axes.text(*label_position, r"$\theta$", ha="center", va="center", fontsize=6)


# Curves of forces against theta, and notes on missing ones


def matching_rows(table: pd.DataFrame, **wanted: str) -> pd.DataFrame:
    """Select rows by the `wanted` content of columns, such as ``leg="c_leg"``, in the order of runs and theta."""
    for name, content in wanted.items():
        table = table[table[name] == content]
    order = [name for name in ("run_id", "theta_deg") if name in table]
    return table.sort_values(order, kind="stable")


def with_gaps(rows: pd.DataFrame, *columns: str) -> list[FloatArray]:
    """Return ``theta_deg`` and `columns` of `matching_rows`, with NaN in each gap and between runs, where lines shall break.

    All arrays have the same length, the number of rows and of the inserted NaN.
    """
    step_deg = np.diff(rows["theta_deg"].to_numpy(float))
    # a step wider than 2.5 degrees is a gap; theta falls where the next run begins
    cuts = np.flatnonzero((step_deg > 2.5) | (step_deg < 0)) + 1
    return [np.insert(rows[name].to_numpy(float), cuts, np.nan) for name in ("theta_deg", *columns)]


MODEL_EDGE: dict[str, Any] = {"linewidth": 0.5, "alpha": 0.6}
"""Look of the ends of the interval with the model's own error, where bands of two components would mix their colours."""


def has_model_error(rows: pd.DataFrame, component: str) -> bool:
    """Return True if any row has an interval with the model's own error; False also if the table has no such columns."""
    return bool(rows.filter(model_end_names(f"force_{component}_N")).notna().to_numpy().any())


def has_force(rows: pd.DataFrame, component: str) -> bool:
    """Return True if any row has a finite force: there is something to draw."""
    return bool(np.isfinite(rows[f"force_{component}_N"].to_numpy(float)).any())


def why_missing(rows: pd.DataFrame) -> str:
    """Return the first reason in the rows, in brackets behind a space; empty where there is none."""
    reasons = [reason for reason in rows.get("reason", ()) if isinstance(reason, str) and reason]
    return labels.in_brackets(style.plain(reasons[0])) if reasons else ""


def add_predicted(
    axes: Axes,
    rows: pd.DataFrame,
    component: str,
    colour: str,
    line: Any = "-",
    *,
    model: str = "",
    of_alpha: bool = True,
) -> FloatArray:
    """Draw a predicted curve of one medium, leg and profile with its interval of alpha.

    `rows`: Of this medium, leg and profile, by theta. `line`: Dashes of the curve, and of ends drawn as lines. `model`:
    How the interval with the model's own error is drawn: ``band`` (paler), ``edges`` (its ends as lines), empty: not.
    `of_alpha`: False where the interval of alpha is withheld. Returns the forces, N, that shall lie in the range of the
    panel: those of the curve and the ends of the intervals drawn.
    """
    quantity = f"force_{component}_N"
    names = with_end_names(quantity)
    if model and has_model_error(rows, component):
        names += model_end_names(quantity)
        theta, low, high = with_gaps(rows, *model_end_names(quantity))
        if model == "band":
            style.draw_band(axes, theta, low, high, colour, style.WIDER_OPACITY)
        else:
            ends = np.transpose([low, high])
            axes.plot(theta, ends, color=colour, linestyle=line, **MODEL_EDGE)
    theta, force, low, high = with_gaps(rows, *with_end_names(quantity))
    if of_alpha:
        style.draw_band(axes, theta, low, high, colour)
    axes.plot(theta, force, color=colour, linestyle=line, linewidth=0.9)
    return rows[names].to_numpy(float).ravel()


def theta_axes(axes: Axes, is_last_row: bool) -> None:
    """Prepare a panel for curves against theta; only one in the last row has the label and numbers of theta."""
    axes.axhline(0, color=style.GREY, linewidth=0.4, zorder=0)
    axes.set(xlim=THETA_DEG, xticks=[-90, -45, 0, 45, 90])
    style.name_below(axes, THETA_LABEL, is_last_row)


def force_range(
    axes: Axes,
    forces: Sequence[FloatArray],
    notes: Sequence[str] = (),
    inset: tuple[float, float] = (0.0, 1.0),
) -> None:
    """Set the range of the axis of force, N, with room above the curves for notes, and write the notes.

    `forces`: Forces that the range holds, with zero. `notes`: Sentences on what is missing. `inset`: Share of the
    panel's height that an inset at the upper right covers, and share of the width that is left of it. A panel without
    any force gets no ticks, and its notes stand in the middle.
    """
    all_forces = np.concatenate([np.zeros(1), *forces])
    low, high = float(np.nanmin(all_forces)), float(np.nanmax(all_forces))
    box = axes.get_window_extent()
    width_pt, height_pt = (size_px * 72 / axes.figure.dpi for size_px in (box.width, box.height))
    # points; larger in an empty panel
    size = style.NOTE_PT + (low == high)
    letters = max(12, style.letters_in(0.94 * inset[1] * width_pt, size))
    lines = [line for note in notes for line in textwrap.wrap(note, letters)]
    note_look: style.Look = {"fontsize": size, "linespacing": 1.25, "zorder": 5}
    if low == high:
        axes.set(ylim=(-1, 1), yticks=[])
        note_look |= {"x": 0.5, "y": 0.5, "ha": "center", "va": "center"}
        lines = lines or ["nothing to draw"]
    else:
        # share of the height of the panel that stays free above the curves
        free = min(0.6, (len(lines) * 1.4 * size + (4 if lines else 0)) / height_pt)
        free = max(free, inset[0])
        margin = 0.06 * (high - low)
        low -= margin
        axes.set_ylim(low, low + (high + margin - low) / (1 - free))
        note_look |= {"x": 0.02, "y": 0.985}
    if lines:
        style.write_note(axes, "\n".join(lines), **note_look)
