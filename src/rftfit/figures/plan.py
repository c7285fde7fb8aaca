"""Figure of a plan of pushes: how each push narrows the interval, and the directions of the pushes."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures import style
from rftfit.figures.maps import angle_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rftfit.forces.planning import Plan
    from rftfit.model.maps import Map


@style.styled()
def draw_plan(plan: Plan, medium_map: Map) -> Figure:
    """Draw the half width of the interval over the number of pushes (left), and the directions of the pushes (right).

    `plan`: Its first step is the state before any further push; ``typical`` is the half width as a share of the plan's
    divisor, ``directions`` the pairs (beta, gamma), degrees, of a step: a push, and its way back where that is used,
    too. `medium_map`: The map that the plan starts from, with the directions already pushed.
    """
    page, ((left_axes, right_axes),) = style.panels([7.0], 2, 7.5)
    widths = [100 * step.overall for step in plan.steps]
    left_axes.plot(range(len(widths)), widths, "o-", color=style.OKABE_ITO["blue"], markersize=3)
    left_axes.set(
        xlabel="further pushes", ylabel=f"half width\n(% of {plan.divisor_name})", yscale="log"
    )
    round_numbers = np.array([1, 2, 5, 10, 20, 50, 100, 200])
    is_near = (round_numbers > min(widths) / 2) & (round_numbers < 2 * max(widths))
    left_axes.set_yticks(round_numbers[is_near])
    left_axes.yaxis.set_major_formatter("{x:g}")
    left_axes.minorticks_off()
    left_axes.xaxis.get_major_locator().set_params(integer=True)
    style.name_column(left_axes, plan.target)
    angle_axes(right_axes)
    # a line without points that is not clipped has no box, and the layout fails
    if medium_map.measured.any():
        pushed_deg = np.degrees([medium_map.gamma, medium_map.beta])[:, medium_map.measured]
        # larger than the circle of a planned push in the same direction
        right_axes.plot(*pushed_deg, "s", color="#bbbbbb", markersize=12, clip_on=False)
    numbers_by_direction = defaultdict(list)
    for number, step in enumerate(plan.steps[1:], start=1):
        for is_way_back, direction in enumerate(step.directions):
            numbers_by_direction[direction, is_way_back].append(str(number))
    for ((beta, gamma), is_way_back), numbers in numbers_by_direction.items():
        right_axes.plot(
            gamma,
            beta,
            "o",
            markersize=9,
            fillstyle="none" if is_way_back else "full",
            color=style.OKABE_ITO["sky blue"],
            clip_on=False,
        )
        # a direction that is repeated has its numbers below one another
        right_axes.text(gamma, beta, "\n".join(numbers), ha="center", va="center", fontsize=6)
    markers = {
        "open: on the way back": any(len(step.directions) > 1 for step in plan.steps),
        "square: pushed already": medium_map.measured.any(),
    }
    key = "; ".join(marker for marker, is_drawn in markers.items() if is_drawn)
    right_axes.set_title(key, loc="left", fontsize=6)
    style.name_column(right_axes, "where they lie")
    return page
