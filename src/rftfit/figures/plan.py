"""A plan of pushes: how the interval narrows, and where the pushes lie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures import style
from rftfit.figures.maps import angle_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rftfit.model.planning import Plan
    from rftfit.model.shapes import Map


def draw(found: Plan, known: Map) -> Figure:
    """Half width over the number of pushes, and where they lie."""
    page = style.new_figure(15.0, 7.2)
    left = style.axes_cm(page, 1.5, 0.9, 5.6, 4.9)
    width = [100 * step.typical for step in found.steps]
    left.plot(range(len(width)), width, "o-", color=style.OKABE_ITO["blue"], markersize=3)
    left.set(xlabel="further pushes", ylabel="half width (%)", yscale="log")
    round_numbers = (1, 2, 5, 10, 20, 50, 100, 200)
    left.set_yticks([v for v in round_numbers if min(width) / 2 < v < 2 * max(width)])
    left.yaxis.set_major_formatter("{x:g}")
    left.minorticks_off()
    style.text_cm(page, 1.5, 0.1, found.target, va="top", weight="bold")
    right = style.axes_cm(page, 9.0, 0.9, 5.6, 4.9)
    angle_axes(right)
    if known.measured.any():
        at = np.degrees(known.gamma[known.measured]), np.degrees(known.beta[known.measured])
        right.plot(*at, "s", color="#888888", markersize=4, clip_on=False)
    for number, step in enumerate(found.steps[1:], start=1):
        for way, (beta, gamma) in enumerate(step.directions):
            right.plot(
                gamma,
                beta,
                "o",
                markersize=9,
                fillstyle="none" if way else "full",
                color=style.OKABE_ITO["sky blue"],
                clip_on=False,
            )
            right.text(gamma, beta, str(number), ha="center", va="center", fontsize=6)
    style.text_cm(page, 9.0, 0.1, "where they lie", va="top", weight="bold")
    key = "open: on the way back; square: pushed already"
    style.text_cm(page, 9.0, 0.5, key, va="top", fontsize=6)
    return page
