"""Published numbers against the numbers of this program, both with intervals: the figure of the validation suite."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import style

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LOOKS = {"inside": (style.OKABE_ITO["blue"], "o"), "outside": (style.OKABE_ITO["vermillion"], "s")}
"""Colour and marker by verdict: the published number lies inside our interval, widened by its own error, or outside."""

_UNITS = {"N/cm^3": style.PER_CM3, "N/cm^2": style.PER_CM2}
"""Units of the table as matplotlib's mathematics; other units stay as they are."""

_NUMBERS = ["published", "published_lo", "published_hi", "ours", "lo", "hi"]
"""Columns of ``verdicts.csv``: both numbers, each with the ends of its interval."""


@style.styled()
def draw_verdicts(verdicts: pd.DataFrame) -> Figure:
    """Draw each published number that was compared against ours; points on the line agree.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        With the columns of ``verdicts.csv``: a row for each number, its ``domain``, ``title``, ``unit``, ``verdict``, and
        the published number and ours, each with the ends of its interval.

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
    """Select the rows that were compared and have a unit, a published number and a number of ours, as floats.

    A verdict on words or counts has no unit, and no place on an axis.
    """
    import pandas as pd

    compared = verdicts[verdicts["verdict"].isin(_LOOKS)].fillna({"unit": ""}).copy()
    for name in _NUMBERS:
        compared[name] = pd.to_numeric(compared[name], errors="coerce")
    return compared[compared["unit"] != ""].dropna(subset=["published", "ours"])


def _draw_panel(axes: Axes, group: pd.DataFrame, title: str, unit: str) -> None:
    """Draw the rows of one quantity: ours over published, both axes with the same range.

    Across two decades or more both axes are logarithmic.
    """
    numbers = group[["published", "ours"]].to_numpy(float)
    is_logarithmic = numbers.min() > 0 and numbers.max() > 100 * numbers.min()
    if is_logarithmic:
        axes.set(xscale="log", yscale="log")
        limits = numbers.min() / 2, numbers.max() * 2
    else:
        with_ends = group[_NUMBERS].to_numpy(float)
        least, most = float(np.nanmin(with_ends)), float(np.nanmax(with_ends))
        margin = 0.06 * (most - least or abs(most) or 1.0)
        limits = least - margin, most + margin
    axes.plot(limits, limits, "--", color=style.GREY, linewidth=0.6, zorder=0)
    for verdict, (colour, marker) in _LOOKS.items():
        rows = group[group["verdict"] == verdict]
        published, published_lo, published_hi, ours, lo, hi = rows[_NUMBERS].to_numpy(float).T
        axes.hlines(ours, published_lo, published_hi, color=colour, linewidth=0.8, alpha=0.6)
        axes.vlines(published, lo, hi, color=colour, linewidth=0.8, alpha=0.6)
        axes.plot(published, ours, marker, color=colour, markersize=3)
    axes.set(xlim=limits, ylim=limits, xlabel=f"published ({unit})", ylabel=f"ours ({unit})")
    axes.set_title(title, fontsize=7)
    axes.set_box_aspect(1)
    if not is_logarithmic:
        for axis in (axes.xaxis, axes.yaxis):
            style.ticks(axis, 4)
