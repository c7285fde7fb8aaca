"""What all figures of legs share: forces against theta, drawn, missing or beyond the panel."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.reference import LEGS
from rftfit.report import labels, style

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import pandas as pd
    from matplotlib.axes import Axes

    from rftfit.report.grid import FloatArray

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

_LEG_TITLES = {
    "c_leg": "c-leg",
    "flat_leg": "flat leg",
    "reversed_c_leg": "reversed c-leg",
}

THETA_LABEL = r"leg angle $\theta$ (deg)"
THETA_DEG = (-135.0, 135.0)
GAP_DEG = 2.5
"""A wider step between neighbours is a gap: the line is broken there."""

MEASURED = "#4d4d4d"
NOTE_PT = 5.5


def leg_title(leg: str) -> str:
    """Name of a leg in figures.

    Parameters
    ----------
    leg : str
        Key of the config.

    Returns
    -------
    str
    """
    return _LEG_TITLES.get(leg, labels.plain(leg))


def leg_order(tables: Iterable[pd.DataFrame], legs: Sequence[str] | None = None) -> list[str]:
    """Legs to draw: those asked for, or all of the tables, the paper's three first.

    Parameters
    ----------
    tables : iterable of pandas.DataFrame
        With a column ``leg``.
    legs : sequence of str, optional

    Returns
    -------
    list of str
        The paper's three where the tables have none.
    """
    if legs is not None:
        return list(legs)
    found = dict.fromkeys(str(leg) for table in tables for leg in table["leg"].unique())
    known = [leg for leg in LEGS if leg in found]
    return known + [leg for leg in found if leg not in LEGS] or list(LEGS)


def rows_of(table: pd.DataFrame, **wanted: str) -> pd.DataFrame:
    """Rows of a table whose columns have the wanted values, in the order of theta.

    Parameters
    ----------
    table : pandas.DataFrame
    **wanted : str
        Column and value.

    Returns
    -------
    pandas.DataFrame
        Sorted by ``run_id`` (where there is one) and ``theta_deg``.
    """
    for name, value in wanted.items():
        table = table[table[name] == value]
    order = [name for name in ("run_id", "theta_deg") if name in table.columns]
    return table.sort_values(order, kind="stable")


def broken(rows: pd.DataFrame, *columns: str) -> list[FloatArray]:
    """Theta and columns of it, with a NaN in each gap and between runs, so that lines break there.

    Parameters
    ----------
    rows : pandas.DataFrame
        From `rows_of`.
    *columns : str

    Returns
    -------
    list of numpy.ndarray
        Theta (deg) first.
    """
    theta = rows["theta_deg"].to_numpy(float)
    step = np.diff(theta)
    cuts = np.flatnonzero((step > GAP_DEG) | (step < 0)) + 1
    values = [theta, *(rows[name].to_numpy(float) for name in columns)]
    return [np.insert(value, cuts, np.nan) for value in values]


def has_force(rows: pd.DataFrame, component: str) -> bool:
    """Whether there is any finite force in the rows.

    Parameters
    ----------
    rows : pandas.DataFrame
    component : {"z", "x"}

    Returns
    -------
    bool
    """
    return bool(np.isfinite(rows[f"force_{component}_N"].to_numpy(float)).any())


def why_missing(rows: pd.DataFrame) -> str:
    """First reason given in the rows, in brackets, or nothing.

    Parameters
    ----------
    rows : pandas.DataFrame

    Returns
    -------
    str
    """
    if "reason" not in rows.columns:
        return ""
    told = (str(reason) for reason in rows["reason"] if isinstance(reason, str) and reason)
    return next((f" ({labels.plain(reason)})" for reason in told), "")


def add_predicted(
    axes: Axes, rows: pd.DataFrame, component: str, colour: str, line: Any = "-"
) -> None:
    """Draw a predicted curve with its interval.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    rows : pandas.DataFrame
        Of one medium, leg and profile, from `rows_of`.
    component : {"z", "x"}
    colour : str
    line : optional
        A line style of matplotlib.
    """
    names = [f"force_{component}_{part}N" for part in ("", "lo_", "hi_")]
    theta, force, low, high = broken(rows, *names)
    axes.fill_between(theta, low, high, color=colour, alpha=0.3, linewidth=0)
    axes.plot(theta, force, color=colour, linestyle=line, linewidth=0.9)


def peak(rows: pd.DataFrame, component: str = "z") -> float:
    """Largest force; NaN where there is none.

    Parameters
    ----------
    rows : pandas.DataFrame
    component : {"z", "x"}

    Returns
    -------
    float
        N.
    """
    force = rows[f"force_{component}_N"].to_numpy(float)
    return float(np.nanmax(force)) if np.isfinite(force).any() else float("nan")


def theta_axes(axes: Axes, name: bool) -> None:
    """Prepare an axes for curves against theta.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    name : bool
        Write the label and numbers of theta.
    """
    axes.axhline(0, color="#808080", linewidth=0.4, zorder=0)
    axes.set(xlim=THETA_DEG, xticks=[-90, -45, 0, 45, 90])
    axes.tick_params(labelbottom=name)
    if name:
        axes.set_xlabel(THETA_LABEL)


def force_range(axes: Axes, forces: Sequence[FloatArray], notes: Sequence[str] = ()) -> None:
    """Set the range of the forces, with room above them for notes, and write the notes there.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    forces : sequence of numpy.ndarray
        All that must be seen, N.
    notes : sequence of str
        Statements on what is missing or beyond the panel, one line each.
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
