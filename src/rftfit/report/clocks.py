"""How well the clocks were brought together and the surface found, drawn from the estimates' own details."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.report import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.measure.alignment import Alignment
    from rftfit.measure.ingest import Trace
    from rftfit.measure.surface import Surface

_ROW_CM, _HEAD_CM, _FOOT_CM = 4.3, 0.9, 2.5
_LEFT_CM, _WIDTH_CM, _STEP_CM = 1.3, 4.3, 5.85
_BLUE, _RED = style.OKABE_ITO["blue"], style.OKABE_ITO["vermillion"]
_GOOD = (
    "Good: one clear lowest point at the offset (left, log scale); readings on one curve (middle); "
    "force flat above\nand growing from the surface on (right). Bands: 95 % intervals."
)


@style.styled
def draw_clocks(traces: Sequence[Trace]) -> Figure:
    """Draw a row of three panels for each run whose clocks were estimated.

    Left: the share of the force's variance that no smooth function of depth explains, over the lags
    that were tried. Middle: force over depth at the estimated offset, and that function. Right: the
    force next to the surface, the model there, and the surface.

    Parameters
    ----------
    traces : sequence of Trace
        Runs without an estimate are left out.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If no run has an estimate.
    """
    rows = [(trace, trace.alignment) for trace in traces if trace.alignment is not None]
    if not rows:
        raise ValueError("no run whose clocks were estimated")
    height = _HEAD_CM + len(rows) * _ROW_CM + _FOOT_CM - 1.2
    figure = style.new_figure(style.DOUBLE_CM, height, dpi=150)
    for place, (trace, alignment) in enumerate(rows):
        top = _HEAD_CM + place * _ROW_CM
        panels = [
            style.axes_cm(figure, _LEFT_CM + column * _STEP_CM, top, _WIDTH_CM, _ROW_CM - 1.5)
            for column in range(3)
        ]
        _lags(panels[0], alignment)
        panels[0].set_title(trace.run.run_id, loc="left", fontsize=8, fontweight="bold")
        panels[1].set_title(_offset(alignment), loc="left", fontsize=7.5)
        _curve(panels[1], alignment)
        _contact(panels[2], trace.surface)
        if place == len(rows) - 1:
            for panel, label in zip(
                panels,
                (
                    "lag from the estimate (s)",
                    "depth from the arm's zero (cm)",
                    "depth below surface (cm)",
                ),
                strict=True,
            ):
                panel.set_xlabel(label, fontsize=7.5)
    figure.text(0.02, 0.35 / height, _GOOD, fontsize=7.5, va="bottom")
    return figure


def _offset(alignment: Alignment) -> str:
    hours = f"{alignment.hours:+d} h " if alignment.hours else ""
    rest = alignment.offset_s - 3600 * (alignment.hours or 0)
    return f"clocks {hours}{rest:+.3f} s ± {alignment.offset_se_s:.3f} s"


def _lags(axes: Axes, alignment: Alignment) -> None:
    lag = alignment.profile.lag - alignment.offset_s
    axes.semilogy(lag, np.maximum(alignment.profile.unexplained, 1e-6), color=_BLUE, linewidth=0.9)
    axes.axvspan(*_ends(alignment.offset_se_s), color=_RED, alpha=0.4, linewidth=0)
    axes.set_ylabel("unexplained share", fontsize=7.5)
    axes.set_xlim(-10, 10)
    axes.minorticks_off()
    axes.tick_params(labelsize=7)


def _ends(se: float) -> tuple[float, float]:
    return -1.96 * se, 1.96 * se


def _curve(axes: Axes, alignment: Alignment) -> None:
    start = float(np.median(alignment.force[:8]))
    rising = alignment.depth > alignment.depth.max() - 6
    order = np.argsort(alignment.depth[rising])
    axes.plot(
        alignment.depth[rising], alignment.force[rising] - start, ".", color=_BLUE, markersize=2
    )
    axes.plot(
        alignment.depth[rising][order], alignment.fitted[rising][order] - start,
        color=_RED, linewidth=0.8,
    )  # fmt: skip
    axes.set_ylabel("lift (N)", fontsize=7.5)
    axes.tick_params(labelsize=7)


def _contact(axes: Axes, surface: Surface | None) -> None:
    axes.tick_params(labelsize=7)
    if surface is None:
        axes.text(0.5, 0.5, "surface as given", transform=axes.transAxes, ha="center", fontsize=7.5)
        return
    depth = surface.depth - surface.depth_cm
    order = np.argsort(depth)
    axes.plot(depth, surface.force - surface.air_N, ".", color=_BLUE, markersize=2)
    axes.plot(depth[order], surface.fitted[order] - surface.air_N, color=_RED, linewidth=0.8)
    lo, hi = surface.interval()
    axes.axvspan(lo - surface.depth_cm, hi - surface.depth_cm, color=_RED, alpha=0.3, linewidth=0)
    axes.set_xlim(-0.6, 0.6)
    near = np.abs(depth) < 0.6
    axes.set_ylim(-1, float((surface.force - surface.air_N)[near].max()) * 1.05 + 1)
    axes.set_title(f"surface ± {10 * surface.se_cm:.2f} mm", loc="left", fontsize=7.5)
