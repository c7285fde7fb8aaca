"""Figure of a rolling wheel over slip: drawbar, torque, sinkage or load, with intervals and measured points.

Drawbar is the horizontal force of the medium on the wheel, toward the way it rolls. Slip is 1 less the speed of travel
over that of the rim. Of sinkage and load one is given, and the other is drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rftfit.figures import style
from rftfit.forces.rolling import describe_friction

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.forces.wheel import WheelAnswer

_PANELS = {
    "drawbar_N": ("drawbar (N)", "blue"),
    "torque_N_cm": ("torque of the drive (N cm)", "vermillion"),
    "sinkage_cm": ("sinkage of the rim (cm)", "bluish green"),
    "load_N": ("load (N)", "bluish green"),
}
"""Label and colour of each quantity, by its column in tables of wheels."""


@style.styled()
def draw_wheel(answer: WheelAnswer, measured: pd.DataFrame | None = None) -> Figure:
    """Draw drawbar, torque, and sinkage or load over slip, with their intervals.

    Parameters
    ----------
    answer : WheelAnswer
        What `wheel` returns.
    measured : pandas.DataFrame, optional
        Points drawn beside: ``slip`` and any of ``drawbar_N``, ``torque_N_cm``, ``sinkage_cm``, ``load_N``.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import rftfit
    >>> smooth = rftfit.Mesh.cylinder(radius_cm=6.25, width_cm=6, facets=24)
    >>> answer = rftfit.wheel(rftfit.published_medium("poppy_LP"), smooth, [0.1, 0.3], sinkage_cm=2)
    >>> len(rftfit.draw_wheel(answer).axes)
    3
    """
    # the quantity that was not given
    last = "load_N" if answer.given == "sinkage" else "sinkage_cm"
    page, panels = style.panels([6.0], columns=3, widest_cm=6.0)
    for axes, column in zip(panels[0], ("drawbar_N", "torque_N_cm", last), strict=True):
        _draw_quantity(axes, answer.table, column)
        if measured is not None and column in measured:
            axes.plot(measured["slip"], measured[column], "o", color="black", markersize=3)
    entries: dict[str, Any] = {"predicted": style.line("black")}
    percent = f"{100 * answer.confidence:g} %"
    if any(end in answer.table for end in ("drawbar_lo_N", "sinkage_lo_cm")):
        of_alpha = f"of {answer.interval_of}"
        entries[f"{percent} interval {of_alpha}"] = style.band()
    if "drawbar_model_lo_N" in answer.table:
        entries["with the model's own error on wheels"] = style.band(style.WIDER_OPACITY)
    if measured is not None:
        entries["measured"] = style.dots("black", 3)
    style.legend(page, entries)
    friction = describe_friction(answer.friction).partition(",")[0].partition(":")[0]
    panels[0][0].set_title(
        style.plain(f"{answer.mesh}; rule: {answer.rule}; friction: {friction}"),
        loc="left",
        fontsize=7,
    )
    return page


def _draw_quantity(axes: Axes, table: pd.DataFrame, column: str) -> None:
    """Draw one quantity over slip with its intervals: bands, or bars where there is a single slip.

    `column`: Its column in the table of the answer, a key of `_PANELS`.
    """
    label, colour_name = _PANELS[column]
    colour = style.OKABE_ITO[colour_name]
    quantity, _, unit = column.partition("_")
    table = table.sort_values("slip")
    slip = table["slip"].to_numpy()
    for end, opacity in (("model_", style.WIDER_OPACITY), ("", style.INTERVAL_OPACITY)):
        # such as drawbar_model_lo_N
        names = [f"{quantity}_{end}{side}_{unit}" for side in ("lo", "hi")]
        if names[0] not in table:
            continue
        lo, hi = table[names].to_numpy(float).T
        if len(table) == 1:
            axes.vlines(slip, lo, hi, color=colour, alpha=3 * opacity, linewidth=8 * opacity)
        else:
            style.draw_band(axes, slip, lo, hi, colour, opacity)
    axes.plot(slip, table[column].to_numpy(), color=colour, marker=".", markersize=3)
    if column in ("drawbar_N", "torque_N_cm"):
        style.zero_line(axes)
    if column == "sinkage_cm":
        axes.invert_yaxis()
    style.ticks(axes.yaxis, 5)
    style.ticks(axes.xaxis, 4)
    axes.set(xlabel="slip", ylabel=label)
