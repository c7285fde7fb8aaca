"""Quality sheets: every plate run of a medium as a small panel, bad ones marked, on A3 paper.

All panels of a sheet are drawn into one Axes whose unit is the centimetre of paper: ninety Axes
would take half a minute, a few collections of lines take a second.
"""

from __future__ import annotations

import textwrap
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from rftfit.report import labels, style
from rftfit.report.runs import by_run, filed, span, thin, trouble
from rftfit.report.sheet import Page, lay_out

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.report.runs import FloatArray, Trace

WIDTH_CM, HEIGHT_CM = 42.0, 29.7
_LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 1.5, 0.4, 2.5, 1.5, 0.12
_HEAD = 1.0  # text above the trace in a panel, cm
_LARGEST, _NARROWEST = 5.0, 24.0
_DPI = 150  # a point of A3 at 150 dpi is 2 pixels: text of 5 points can still be read

_STRESS = {
    ("tare", "z"): (style.TARE_COLOURS["z"], 0.6),
    ("tare", "x"): (style.TARE_COLOURS["x"], 0.6),
    ("stress", "z"): (style.COMPONENT_COLOURS["z"], 0.7),
    ("stress", "x"): (style.COMPONENT_COLOURS["x"], 0.7),
}
_FIT = ("black", 0.6)
_WINDOW = "#e4e4e4"
_COLUMNS = [
    "depth_cm", "path_cm", "in_window",
    *(f"{name}_{c}_N_per_cm2" for name, c in _STRESS),
]  # fmt: skip


class _Sheet:
    """Collects the lines of all panels of a page by kind, then draws each kind at once."""

    def __init__(self, page: Page, reach: tuple[float, float]) -> None:
        rows, columns = len(page.row_labels), len(page.column_labels)
        self.page = page
        self.reach = reach
        self.width = min((WIDTH_CM - _LEFT - _RIGHT) / columns, _LARGEST)
        self.height = min((HEIGHT_CM - _TOP - _BOTTOM) / rows, _LARGEST)
        self.paper = (
            max(_LEFT + columns * self.width + _RIGHT, _NARROWEST),
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
        return _LEFT + column * self.width, -_TOP - row * self.height

    def box(self, left: float, top: float, height: float) -> FloatArray:
        right, bottom = left + self.width - _GAP, top - height
        return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])

    def panel(self, place: tuple[int, int], trace: Trace, fit: Mapping[str, Any]) -> None:
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
        self, left: float, top: float, trace: Trace, fit: Mapping[str, Any], flat: bool
    ) -> None:
        name = "path_cm" if flat and "path_cm" in trace else "depth_cm"
        inner, tall = self.width - _GAP, self.height - _GAP - _HEAD
        least, most = span(trace)
        scale = tall / (most - least)
        zero = top - _HEAD - scale * most
        across = inner / (self.reach[1] if flat else self.reach[0])
        x = left + across * trace[name]
        window = x[(trace["in_window"] > 0) & np.isfinite(x)]
        if window.size:
            low, high = window.min(), window.max()
            ends = top - _HEAD - tall, top - _HEAD
            self.windows.append(np.array([(a, b) for a, b in zip(
                (low, high, high, low), (ends[0], ends[0], ends[1], ends[1]), strict=True)]))  # fmt: skip
        self.lines["#b0b0b0", 0.4].append(np.array([(left, zero), (left + inner, zero)]))
        for (kind, c), pen in _STRESS.items():
            column = f"{kind}_{c}_N_per_cm2"
            if column in trace:
                self.lines[pen] += thin(x, zero + scale * trace[column])
        depth = trace["depth_cm"]
        if np.isfinite(x).any():
            start = 0.0 if flat else float(np.nanmin(depth))
            stop = float(np.nanmax(trace[name]))
            levels = [float(np.nanmedian(depth))] * 2 if flat else [start, stop]
            for c in "zx":
                alpha = float(fit[f"alpha_{c}_N_per_cm3"])
                y = zero + scale * alpha * np.array(levels)
                if np.isfinite(alpha):
                    self.lines[_FIT].append(
                        np.column_stack([left + across * np.array([start, stop]), y])
                    )

    def _words(
        self, left: float, top: float, trace: Trace, fit: Mapping[str, Any], bad: str
    ) -> None:
        def write(x: float, y: float, text: str, size: float, **how: str) -> None:
            self.axes.text(x, y, labels.plain(text), fontsize=size, **how)  # type: ignore[arg-type]

        inner, margin = self.width - _GAP, 0.06
        room = int(inner / 0.105)
        run = str(fit["run_id"])
        # the end of a run's name tells runs apart
        run = run if len(run) <= room else "\N{HORIZONTAL ELLIPSIS}" + run[1 - room :]
        beta, gamma = (labels.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
        write(left + margin, top - margin, f"{run}\nβ {beta}  γ {gamma}", 5.2, va="top")  # noqa: RUF001
        for c, x, side in (("z", left + margin, "left"), ("x", left + inner - margin, "right")):
            alpha, colour = float(fit[f"alpha_{c}_N_per_cm3"]), style.COMPONENT_COLOURS[c]
            if np.isfinite(alpha):
                text = f"α{c} {labels.number(alpha)}"  # noqa: RUF001
                write(x, top - 0.62, text, 5.2, color=colour, va="top", ha=side)
        bottom = top - self.height + _GAP + margin
        if trace:
            least, most = (f"{end:g}".replace("-", "\N{MINUS SIGN}") for end in span(trace))
            text = f"{least}\N{HORIZONTAL ELLIPSIS}{most}"
            write(
                left + inner - margin, top - 0.27, text, 4.8, color="#555555", va="top", ha="right"
            )
        if bad:
            lines = textwrap.wrap(
                bad, room - 1, max_lines=4, placeholder=" \N{HORIZONTAL ELLIPSIS}"
            )
            y, va = (top - _HEAD - margin, "top") if trace else (bottom + self.height * 0.45, "top")
            write(left + margin, y, "\n".join(lines), 5.2, color=style.MARK, va=va)

    def empty_places(self) -> None:
        taken = set(self.page.places.values())
        for row in range(len(self.page.row_labels)):
            for column in range(len(self.page.column_labels)):
                if (row, column) not in taken and self.page.first:
                    left, top = self.corner(row, column)
                    self.frames["#dddddd"].append(self.box(left, top, self.height - _GAP))
                    middle = left + (self.width - _GAP) / 2, top - (self.height - _GAP) / 2
                    self.axes.text(*middle, "not measured", fontsize=5.5, color="#888888",
                                   ha="center", va="center")  # fmt: skip

    def finish(self, title: str) -> Figure:
        self.axes.add_collection(PolyCollection(self.windows, facecolors=_WINDOW, linewidths=0))
        for (colour, width), lines in self.lines.items():
            self.axes.add_collection(
                LineCollection(
                    lines,
                    colors=colour,
                    linewidths=width,
                    # gaps, so that the fit does not hide what it was fitted to
                    linestyles=[(0, (5, 4))] if (colour, width) == _FIT else "solid",
                )
            )
        for colour, boxes in self.frames.items():
            width = 1.4 if colour == style.MARK else 0.4
            self.axes.add_collection(
                PolyCollection(boxes, facecolors="none", edgecolors=colour, linewidths=width)
            )
        for i, label in enumerate(self.page.row_labels):
            y = self.corner(i, 0)[1] - (self.height - _GAP) / 2
            self.axes.text(_LEFT - 0.2, y, label, fontsize=8, ha="right", va="center", rotation=90)
        for i, label in enumerate(self.page.column_labels):
            x = self.corner(0, i)[0] + (self.width - _GAP) / 2
            self.axes.text(x, -_TOP + 0.12, label, fontsize=7, ha="center", va="bottom")
        self.axes.text(_LEFT, -0.35, labels.plain(title), fontsize=14, va="top")
        return self.figure


def _legend(sheet: _Sheet) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    names = {
        ("stress", "z"): "tared vertical stress (z)",
        ("stress", "x"): "tared horizontal stress (x)",
        ("tare", "z"): "rod tare as stress (z)",
        ("tare", "x"): "rod tare as stress (x)",
    }
    entries: dict[str, Line2D | Patch] = {
        name: Line2D([], [], color=_STRESS[key][0], linewidth=1.2) for key, name in names.items()
    }
    entries["fit through zero"] = Line2D(
        [], [], color=_FIT[0], linewidth=0.8, linestyle=(0, (5, 4))
    )
    entries["fit window"] = Patch(facecolor=_WINDOW)
    entries["flagged or without alpha"] = Patch(
        facecolor="none", edgecolor=style.MARK, linewidth=1.4
    )
    place = (_LEFT / sheet.paper[0], 0.12 / sheet.paper[1])
    sheet.figure.legend(
        list(entries.values()), list(entries), loc="lower left", bbox_to_anchor=place,
        ncols=len(entries), fontsize=7.5, borderaxespad=0, columnspacing=1.3,
    )  # fmt: skip
    text = (
        f"Across each panel: depth from 0 to {sheet.reach[0]:g} cm (horizontal runs: path from 0 to "
        f"{sheet.reach[1]:g} cm). Up: stress, from the panel's bottom to its top as written, such as "
        "\N{MINUS SIGN}0.2\N{HORIZONTAL ELLIPSIS}0.5 N/cm²; α in N/cm³. "  # noqa: RUF001
        "Extractions as filed."
    )
    sheet.axes.text(_LEFT, -sheet.paper[1] + 1.05, text, fontsize=7.5, va="center")


@style.styled
def draw_quality(traces: pd.DataFrame, fits: pd.DataFrame, medium_title: str) -> list[Figure]:
    """Quality sheets of one medium: a panel for each plate run, ordered by beta and gamma.

    Each panel shows the tared stress, the rod's tare as stress, the fit window and the fit; its
    vertical scale is its own and printed in its corner. A run that is flagged or has no alpha has
    a red frame and says why. Extractions are drawn as filed (`rftfit.report.runs.filed`).

    Parameters
    ----------
    traces : pandas.DataFrame
        Samples in the lab frame, in time order within a run: ``run_id, depth_cm,
        stress_z_N_per_cm2, stress_x_N_per_cm2, tare_z_N_per_cm2, tare_x_N_per_cm2, in_window``
        and, for horizontal runs, ``path_cm``. A run of `fits` without samples has an empty panel.
    fits : pandas.DataFrame
        Fit table of the medium.
    medium_title : str

    Returns
    -------
    list of matplotlib.figure.Figure
        Pages of at most 15 by 7 runs; repeated runs stand on pages of their own.
    """
    samples = by_run(filed(traces, fits), _COLUMNS)
    rows = fits.drop_duplicates("run_id").set_index("run_id", drop=False)
    flat = set(rows.index[rows["direction"] == "horizontal"])
    depth = rows["depth_from_cm"].astype(float)
    for run in flat & set(samples):
        finite = samples[run]["depth_cm"][np.isfinite(samples[run]["depth_cm"])]
        if np.isnan(depth[run]) and finite.size:
            depth[run] = float(np.median(finite))
    ends = {True: [1.0], False: [1.0]}
    for run, trace in samples.items():
        values = trace["path_cm" if run in flat and "path_cm" in trace else "depth_cm"]
        ends[run in flat].append(float(values[np.isfinite(values)].max(initial=0.0)))
    reach = float(np.ceil(max(ends[False]))), float(np.ceil(max(ends[True])))
    pages = lay_out(rows.reset_index(drop=True), depth)
    fit_of = {str(fit["run_id"]): fit for fit in rows.to_dict("records")}
    marked = sum(bool(trouble(fit)) for fit in fit_of.values())
    title = f"{medium_title}: {len(rows)} plate runs, {marked} marked"
    figures = []
    for i, page in enumerate(pages):
        sheet = _Sheet(page, reach)
        for run, place in page.places.items():
            sheet.panel(place, samples.get(run, {}), fit_of[run])
        sheet.empty_places()
        _legend(sheet)
        figures.append(
            sheet.finish(title + (f" (page {i + 1} of {len(pages)})" if pages[1:] else ""))
        )
    return figures
