"""Figure of two media compared: alpha of both in each common direction, and the ratio of the two by direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures import style
from rftfit.figures.traces import with_end_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rftfit.compare.contrast import Comparison

_COLOURS = {"a": style.OKABE_ITO["blue"], "b": style.OKABE_ITO["vermillion"]}
"""Colours of the two media, which the comparison calls A and B."""


@style.styled()
def draw_comparison(comparison: Comparison) -> Figure:
    """Draw alpha_z and alpha_x of both media with their intervals, and the ratio of B to A along the force, by direction.

    `comparison`: Its table ``directions`` has a row for each common direction: alpha of both with interval, ``ratio``
    with ``ratio_lo`` and ``ratio_hi``; its own ``ratio`` is that of all directions together. Without a common direction
    the figure says why.
    """
    if comparison.directions.empty:
        return style.missing(comparison.sentence, comparison.notes)
    table = comparison.directions.sort_values(
        ["gamma_deg", "beta_deg", "depth_cm"], ignore_index=True
    )
    page, ((z_axes,), (x_axes,), (axes,)) = style.panels((4.4, 4.4, 5.6), widest_cm=style.DOUBLE_CM)
    # a direction is a place on the horizontal axis, the same in all panels
    place = np.arange(len(table))
    for alpha_axes, c in ((z_axes, "z"), (x_axes, "x")):
        style.zero_line(alpha_axes)
        for medium, aside in (("a", -0.15), ("b", 0.15)):
            middle, low, high = (
                table[name].to_numpy(float)
                for name in with_end_names(f"alpha_{c}_{medium}_N_per_cm3")
            )
            colour = _COLOURS[medium]
            alpha_axes.vlines(place + aside, low, high, color=colour, linewidth=0.8)
            alpha_axes.plot(place + aside, middle, "o", color=colour, markersize=3)
        alpha_axes.set(ylabel=style.alpha_label(c), xlim=(-0.6, len(table) - 0.4), xticks=place)
        alpha_axes.tick_params(labelbottom=False)
    axes.axhspan(comparison.ratio_lo, comparison.ratio_hi, color=style.WINDOW, linewidth=0)
    axes.axhline(comparison.ratio, color="black", linewidth=0.6)
    axes.axhline(1, color=style.GREY, linewidth=0.4)
    middle, low, high = (table[f"ratio{end}"].to_numpy(float) for end in ("", "_lo", "_hi"))
    axes.vlines(place, low, high, color=style.GREY, linewidth=0.8)
    axes.plot(place, middle, "o", color="black", markersize=3)
    most_names = 40
    label_step = -(-len(table) // most_names)
    names = [
        f"{style.degrees(beta)}, {style.degrees(gamma)}"
        for beta, gamma in zip(table["beta_deg"], table["gamma_deg"], strict=True)
    ]
    axes.set(xlabel=r"$\beta$, $\gamma$ (degrees)", ylabel="B/A", xlim=(-0.6, len(table) - 0.4))
    axes.set_xticks(place[::label_step])
    axes.set_xticklabels(names[::label_step], rotation=90, fontsize=5)
    a, b = (style.plain(name) for name in (comparison.a, comparison.b))
    page.suptitle(f"A: {a}    B: {b}", x=0.01, ha="left", weight="bold")
    entries = {
        "A": style.dots(_COLOURS["a"], 4),
        "B": style.dots(_COLOURS["b"], 4),
        "ratio of sizes with its interval": style.patch(facecolor=style.WINDOW),
    }
    style.legend(page, entries, fontsize=7)
    return page
