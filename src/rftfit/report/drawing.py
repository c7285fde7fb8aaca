"""Drawing one page of a quality sheet: all panels in one Axes whose unit is the centimetre.

Ninety Axes would take half a minute, a few collections of lines take a second.
"""

from __future__ import annotations

import textwrap
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from rftfit.report import labels, style
from rftfit.report.runs import span, thin, trouble

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.report.runs import FloatArray, Trace
    from rftfit.report.sheet import Page

WIDTH_CM, HEIGHT_CM = 42.0, 29.7
LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 1.5, 0.4, 2.5, 1.5, 0.12
_HEAD = 1.05  # text above the trace in a panel, cm
_LARGEST, _NARROWEST = 5.0, 27.5
_DPI = 150  # a point of A3 at 150 dpi is 2 pixels: text of 5 points can still be read

STRESS = {
    ("tare", "z"): (style.TARE_COLOURS["z"], 0.6),
    ("tare", "x"): (style.TARE_COLOURS["x"], 0.6),
    ("stress", "z"): (style.COMPONENT_COLOURS["z"], 0.7),
    ("stress", "x"): (style.COMPONENT_COLOURS["x"], 0.7),
}
FIT = ("black", 0.6)
WINDOW = "#e4e4e4"


class Sheet:
    """Collects the lines of all panels of a page by kind, then draws each kind at once.

    Parameters
    ----------
    page : Page
    reach : (float, float)
        Depth and, for horizontal runs, path that a panel's width stands for, cm.
    """

    def __init__(self, page: Page, reach: tuple[float, float]) -> None:
        rows, columns = len(page.row_labels), len(page.column_labels)
        self.page = page
        self.reach = reach
        self.width = min((WIDTH_CM - LEFT - _RIGHT) / columns, _LARGEST)
        self.height = min((HEIGHT_CM - _TOP - _BOTTOM) / rows, _LARGEST)
        self.paper = (
            max(LEFT + columns * self.width + _RIGHT, _NARROWEST),
            _TOP + rows * self.height + _BOTTOM,
        )
        self.figure = style.new_figure(*self.paper, dpi=_DPI)
        self.axes: Axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set(xlim=(0, self.paper[0]), ylim=(-self.paper[1], 0))
        self.axes.set_axis_off()
        self.lines: dict[tuple[str, float], list[FloatArray]] = defaultdict(list)
        self.windows: list[FloatArray] = []
        self.frames: dict[str, list[FloatArray]] = defaultdict(list)

    def corner(self, row: int, column: int) -> tuple[float, float]:
        """Return the upper left corner of a panel.

        Parameters
        ----------
        row, column : int
            Place of the panel on the page, from 0 at the upper left.

        Returns
        -------
        left, top : float
            cm from the paper's upper left corner; up is positive, so that `top` is negative.
        """
        return LEFT + column * self.width, -_TOP - row * self.height

    def box(self, left: float, top: float, height: float) -> FloatArray:
        """Return the corners of a box as wide as a panel.

        Parameters
        ----------
        left, top : float
            Upper left corner, cm, as from `corner`.
        height : float
            cm.

        Returns
        -------
        numpy.ndarray, shape (4, 2)
            x and y of each corner, cm, once around.
        """
        right, bottom = left + self.width - _GAP, top - height
        return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])

    def panel(self, place: tuple[int, int], trace: Trace, fit: Mapping[Hashable, Any]) -> None:
        """Collect what belongs to one run.

        Parameters
        ----------
        place : (int, int)
            Row and column on the page.
        trace : dict of str to numpy.ndarray
            Samples by column; empty if the run has none.
        fit : mapping
            Row of the fit table.
        """
        left, top = self.corner(*place)
        flat = fit["direction"] == "horizontal"
        bad = trouble(fit)
        self.frames[style.MARK if bad else "#9a9a9a"].append(
            self.box(left, top, self.height - _GAP)
        )
        if trace:
            self._trace(left, top, trace, fit, flat)
        self._words(left, top, trace, fit, bad)

    def _trace(
        self, left: float, top: float, trace: Trace, fit: Mapping[Hashable, Any], flat: bool
    ) -> None:
        name = "path_cm" if flat and "path_cm" in trace else "depth_cm"
        inner, tall = self.width - _GAP, self.height - _GAP - _HEAD
        least, most = span(trace)
        scale = tall / (most - least)
        zero = top - _HEAD - scale * most
        across = inner / (self.reach[1] if flat else self.reach[0])
        # what was recorded above the surface would stand in the next panel
        along = np.where(trace[name] >= 0, trace[name], np.nan)
        x = left + across * along
        window = x[(trace["in_window"] > 0) & np.isfinite(x)]
        if window.size:
            low, high = window.min(), window.max()
            ends = top - _HEAD - tall, top - _HEAD
            self.windows.append(np.array([(a, b) for a, b in zip(
                (low, high, high, low), (ends[0], ends[0], ends[1], ends[1]), strict=True)]))  # fmt: skip
        self.lines["#b0b0b0", 0.4].append(np.array([(left, zero), (left + inner, zero)]))
        for (kind, c), pen in STRESS.items():
            column = f"{kind}_{c}_N_per_cm2"
            if column in trace:
                self.lines[pen] += thin(x, zero + scale * trace[column])
        depth = trace["depth_cm"]
        if np.isfinite(x).any():
            start = 0.0 if flat else float(np.nanmin(along))
            stop = float(np.nanmax(along))
            levels = [float(np.nanmedian(depth))] * 2 if flat else [start, stop]
            for c in "zx":
                alpha = float(fit[f"alpha_{c}_N_per_cm3"])
                y = zero + scale * alpha * np.array(levels)
                if np.isfinite(alpha):
                    self.lines[FIT].append(
                        np.column_stack([left + across * np.array([start, stop]), y])
                    )

    def _words(
        self, left: float, top: float, trace: Trace, fit: Mapping[Hashable, Any], bad: str
    ) -> None:
        def write(x: float, y: float, text: str, size: float, **how: str) -> None:
            self.axes.text(x, y, labels.plain(text), fontsize=size, **how)  # type: ignore[arg-type]

        inner, margin = self.width - _GAP, 0.06
        room = int(inner / 0.13)
        run = str(fit["run_id"])
        # the end of a run's name tells runs apart
        run = run if len(run) <= room else "\N{HORIZONTAL ELLIPSIS}" + run[1 - room :]
        beta, gamma = (labels.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
        write(left + margin, top - margin, f"{run}\nβ {beta}  γ {gamma}", 5.2, va="top")  # noqa: RUF001
        for c, x, side in (("z", left + margin, "left"), ("x", left + inner - margin, "right")):
            alpha, colour = float(fit[f"alpha_{c}_N_per_cm3"]), style.COMPONENT_COLOURS[c]
            if np.isfinite(alpha):
                text = f"α{c} {labels.number(alpha)}"  # noqa: RUF001
                write(x, top - 0.54, text, 5.2, color=colour, va="top", ha=side)
        bottom = top - self.height + _GAP + margin
        if trace:
            least, most = (f"{end:g}".replace("-", "\N{MINUS SIGN}") for end in span(trace))
            text = f"stress {least} to {most} N/cm²"
            write(left + margin, top - 0.78, text, 4.8, color="#555555", va="top")
        if bad:
            lines = textwrap.wrap(
                bad, room - 1, max_lines=4, placeholder=" \N{HORIZONTAL ELLIPSIS}"
            )
            y, va = (top - _HEAD - margin, "top") if trace else (bottom + self.height * 0.45, "top")
            write(left + margin, y, "\n".join(lines), 5.2, color=style.MARK, va=va)

    def empty_places(self) -> None:
        """Say in each empty place of a first page that nothing was measured there."""
        taken = set(self.page.places.values())
        for row in range(len(self.page.row_labels)):
            for column in range(len(self.page.column_labels)):
                if (row, column) not in taken and self.page.first:
                    left, top = self.corner(row, column)
                    self.frames["#dddddd"].append(self.box(left, top, self.height - _GAP))
                    middle = left + (self.width - _GAP) / 2, top - (self.height - _GAP) / 2
                    self.axes.text(*middle, "not measured", fontsize=5.5, color="#888888",
                                   ha="center", va="center")  # fmt: skip

    def finish(self, title: str, notes: str = "") -> Figure:
        """Draw everything that was collected.

        Parameters
        ----------
        title : str
        notes : str, optional
            A smaller line below the title.

        Returns
        -------
        matplotlib.figure.Figure
        """
        self.axes.add_collection(PolyCollection(self.windows, facecolors=WINDOW, linewidths=0))
        for (colour, width), lines in self.lines.items():
            self.axes.add_collection(
                LineCollection(
                    lines,
                    colors=colour,
                    linewidths=width,
                    # gaps, so that the fit does not hide what it was fitted to
                    linestyles=[(0, (5, 4))] if (colour, width) == FIT else "solid",
                )
            )
        for colour, boxes in self.frames.items():
            width = 1.4 if colour == style.MARK else 0.4
            self.axes.add_collection(
                PolyCollection(boxes, facecolors="none", edgecolors=colour, linewidths=width)
            )
        for i, label in enumerate(self.page.row_labels):
            y = self.corner(i, 0)[1] - (self.height - _GAP) / 2
            self.axes.text(LEFT - 0.2, y, label, fontsize=8, ha="right", va="center", rotation=90)
        for i, label in enumerate(self.page.column_labels):
            x = self.corner(0, i)[0] + (self.width - _GAP) / 2
            self.axes.text(x, -_TOP + 0.12, label, fontsize=7, ha="center", va="bottom")
        self.axes.text(LEFT, -0.35, labels.plain(title), fontsize=14, va="top")
        self.axes.text(LEFT, -0.98, labels.plain(notes), fontsize=8, va="top", color=style.MARK)
        return self.figure
