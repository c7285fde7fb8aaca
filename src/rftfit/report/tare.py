"""The plot of one tare: what the rod and the mount alone felt, and where that may be used."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.report import labels, style

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

POSITIONS = {
    "depth_cm": "depth (cm)",
    "path_cm": "distance along the path (cm)",
    "angle_deg": r"leg angle $\theta$ (degrees)",
}
"""Columns that a tare may be a function of, and their labels."""


@style.styled
def draw_tare(tare: pd.DataFrame, title: str) -> Figure:
    """Draw the force of one tare against position, its valid range shaded.

    Parameters
    ----------
    tare : pandas.DataFrame
        One of the columns of `POSITIONS`, ``force_z_N, force_x_N`` and ``valid`` (bool: the tare
        may be used there; elsewhere it refuses).
    title : str
        For example the run's name.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is no position column.
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
    axes.set_title(labels.plain(title), loc="left")
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=3, borderaxespad=0.3)
    return figure
