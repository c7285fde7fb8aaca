"""Stress over depth of repeated penetrations, one panel a plate, with the fit through zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.report import style

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Protocol

    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray

    class _Named(Protocol):
        @property
        def name(self) -> str: ...


_COLOURS = tuple(
    style.OKABE_ITO[name] for name in ("blue", "vermillion", "bluish green", "reddish purple")
)
_PANEL_CM, _GAP_CM, _LEFT_CM, _TOP_CM = 4.9, 0.5, 1.5, 0.9


@style.styled
def draw_plates(
    stress: Mapping[str, tuple[FloatArray, FloatArray]],
    runs: Mapping[str, Sequence[_Named]],
    alphas: Mapping[str, tuple[float, float, float]],
    sizes: Mapping[str, float],
) -> Figure:
    """Draw the stress of every run within its window and alpha of each plate.

    Parameters
    ----------
    stress : mapping of str to (depth, stress)
        By run: cm, N/cm^2, within the window.
    runs : mapping of str to sequence
        By plate: its runs, each with a ``name``.
    alphas : mapping of str to (alpha, lo, hi)
        By plate, with the ends of its 95 % interval, N/cm^3.
    sizes : mapping of str to float
        cm.

    Returns
    -------
    matplotlib.figure.Figure
    """
    width = _LEFT_CM + len(runs) * (_PANEL_CM + _GAP_CM) + 0.3
    height = _TOP_CM + _PANEL_CM + 2.6
    figure = style.new_figure(width, height)
    names = {run.name for own in runs.values() for run in own}
    tallest = max(float(stress[name][1].max()) for name in names)
    deepest = max(float(stress[name][0].max()) for name in names)
    for place, (plate, own) in enumerate(runs.items()):
        left = _LEFT_CM + place * (_PANEL_CM + _GAP_CM)
        axes = style.axes_cm(figure, left, _TOP_CM, _PANEL_CM, _PANEL_CM)
        for index, run in enumerate(own):
            axes.plot(
                *stress[run.name], ".", markersize=2.5, color=_COLOURS[index % len(_COLOURS)],
                label=run.name,
            )  # fmt: skip
        alpha, lo, hi = alphas[plate]
        depth = np.array([0.0, deepest])
        axes.plot(depth, alpha * depth, color="black", linewidth=0.9, label="fit through zero")
        axes.fill_between(depth, lo * depth, hi * depth, color="0.85", linewidth=0)
        axes.set_xlim(0, deepest * 1.03)
        axes.set_ylim(0, tallest * 1.08)
        axes.set_title(f"{sizes[plate]:g} cm plate", fontsize=9)
        axes.set_xlabel("depth (cm)")
        if place:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("vertical stress (N/cm$^2$)")
        axes.legend(fontsize=6.5, loc="upper left", frameon=False)
    text = (
        "Grey: 95 % interval of alpha. Good: runs of one plate on top of each other; proportional to "
        "depth:\nalong the line; independent of the plate: the same line in each panel."
    )
    figure.text(0.02, 0.25 / height, text, fontsize=7.5, va="bottom")
    return figure
