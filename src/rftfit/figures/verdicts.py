"""Published numbers against the numbers of this program, both with their intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import style

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LOOKS = {"inside": (style.OKABE_ITO["blue"], "o"), "outside": (style.OKABE_ITO["vermillion"], "s")}
"""Colour and marker by verdict."""

_UNITS = {"N/cm^3": style.PER_CM3, "N/cm^2": style.PER_CM2}


@style.styled()
def draw_verdicts(verdicts: pd.DataFrame) -> Figure:
    """Draw each published number that was compared against ours; points on the line agree.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        With the columns of ``verdicts.csv``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    drawn = numbers_with_unit(verdicts)
    if drawn.empty:
        return style.missing("No published number was compared.")
    groups = [*drawn.groupby(["domain", "title", "unit"], sort=False)]
    page, panels = style.panels_in_rows(len(groups), 4, 4.9)
    for axes, (names, group) in zip(panels, groups, strict=True):
        domain, title, unit = map(str, names)
        _draw_panel(
            axes, group, style.plain(f"{domain}:\n{title}"), _UNITS.get(unit, style.plain(unit))
        )
    entries: dict[str, Any] = {
        f"{verdict} ({count})": style.dots(colour, 4, marker=marker)
        for verdict, (colour, marker) in _LOOKS.items()
        if (count := int((drawn["verdict"] == verdict).sum()))
    }
    entries["our 95 % interval"] = style.line(style.GREY, linewidth=1.0)
    if (drawn["published_hi"] > drawn["published_lo"]).any():
        entries["across: published error"] = style.line(style.GREY, linewidth=1.0)
    entries["equal"] = style.line(style.GREY, linewidth=0.6, linestyle="--")
    style.legend(page, entries)
    return page


def numbers_with_unit(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Select the rows that were compared and have a unit, a published number and a number of ours."""
    import pandas as pd

    compared = verdicts[verdicts["verdict"].isin(_LOOKS)].fillna({"unit": ""}).copy()
    for name in ("published", "published_lo", "published_hi", "ours", "lo", "hi"):
        compared[name] = pd.to_numeric(compared[name], errors="coerce")
    return compared[compared["unit"] != ""].dropna(subset=["published", "ours"])


def _draw_panel(axes: Axes, group: pd.DataFrame, title: str, unit: str) -> None:
    """Draw the rows of one quantity: ours over published, both axes with the same range."""
    ends = group[["published", "published_lo", "published_hi", "ours", "lo", "hi"]].to_numpy(float)
    least, most = float(np.nanmin(ends)), float(np.nanmax(ends))
    values = group[["published", "ours"]].to_numpy(float)
    is_logarithmic = values.min() > 0 and values.max() > 100 * values.min()
    if is_logarithmic:
        axes.set(xscale="log", yscale="log")
        least, most = values.min() / 2, values.max() * 2
    else:
        room = 0.06 * (most - least or abs(most) or 1.0)
        least, most = least - room, most + room
    axes.plot([least, most], [least, most], "--", color=style.GREY, linewidth=0.6, zorder=0)
    for verdict, (colour, marker) in _LOOKS.items():
        rows = group[group["verdict"] == verdict]
        published, ours = rows["published"].to_numpy(), rows["ours"].to_numpy()
        across = rows["published_lo"].to_numpy(), rows["published_hi"].to_numpy()
        along = rows["lo"].to_numpy(), rows["hi"].to_numpy()
        axes.hlines(ours, *across, color=colour, linewidth=0.8, alpha=0.6)
        axes.vlines(published, *along, color=colour, linewidth=0.8, alpha=0.6)
        axes.plot(published, ours, marker, color=colour, markersize=3)
    axes.set(xlim=(least, most), ylim=(least, most))
    axes.set_title(title, fontsize=7)
    suffix = f" ({unit})" if unit else ""
    axes.set_xlabel(f"published{suffix}")
    axes.set_ylabel(f"ours{suffix}")
    axes.set_box_aspect(1)
    if not is_logarithmic:
        for axis in (axes.xaxis, axes.yaxis):
            style.ticks(axis, 4)
