"""Quality sheets: every plate run of a medium as a small panel, bad ones marked, on A3 paper."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from rftfit.figures import style
from rftfit.figures.plates import DIRECTIONS, by_run, filed, span, thin, trouble

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Mapping

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.figures.plates import DrawnTrace


# --- Where each run stands on a quality sheet: rows of beta, columns of gamma, direction and depth.


MAX_COLUMNS = 15
"""Six extractions, three horizontal depths, six intrusions."""

MAX_ROWS = 7

_SAME_DEPTH_CM = 0.5


@dataclass(frozen=True)
class Page:
    """One sheet of paper.

    `places`: Row and column of each run.
    `first`: Whether an empty place means that nothing was measured there; on later pages, which
        hold repeated runs, it means nothing.
    """

    row_labels: list[str]
    column_labels: list[str]
    places: dict[str, tuple[int, int]]
    first: bool


def depth_levels(depth_cm: pd.Series[float]) -> pd.Series[float]:
    """Gather the depths of horizontal runs into the depths that were meant.

    `depth_cm`: NaN where it is not known. Returns the mean of the depths less than half a
    centimetre from one another; NaN stays.
    """
    ordered = depth_cm.sort_values()
    group = (ordered.diff() > _SAME_DEPTH_CM).cumsum()
    means = ordered.groupby(group).transform("mean")
    return means.where(ordered.notna()).reindex(depth_cm.index)


def _column_label(gamma: float, direction: str, level: float) -> str:
    head = f"\N{GREEK SMALL LETTER GAMMA} = {style.degrees(gamma)}\n{direction}"
    if direction == "horizontal":
        return head + (f"\n{level:.1f} cm deep" if level >= 0 else "\ndepth not known")
    return head


def _chunks(count: int, most: int) -> Iterator[range]:
    for start in range(0, count, most):
        yield range(start, min(start + most, count))


def lay_out(fits: pd.DataFrame, depth_cm: pd.Series[float]) -> list[Page]:
    """Order the runs of one medium on pages; the k-th repeat of a run stands on its own page.

    `fits`: Fit table of one medium, angles as filed. `depth_cm`: Depth of each horizontal run, by
    run id.
    """
    runs = fits[["run_id", "beta_deg", "gamma_deg", "direction"]].copy()
    runs["beta_deg"] = runs["beta_deg"].astype(float).round(2) + 0.0
    runs["gamma_deg"] = runs["gamma_deg"].astype(float).round(2) + 0.0
    flat = runs["direction"] == "horizontal"
    depth = runs["run_id"].map(depth_cm).astype(float).where(flat)
    # -1: a horizontal run of which no depth is known; inf would hide in labels
    runs["level"] = np.where(flat, depth_levels(depth).fillna(-1.0), 0.0)
    runs["order"] = runs["direction"].map({name: i for i, name in enumerate(DIRECTIONS)})
    keys = ["gamma_deg", "order", "level", "direction"]
    runs = runs.sort_values(["beta_deg", *keys, "run_id"], kind="stable")
    runs["repeat"] = runs.groupby(["beta_deg", *keys]).cumcount()
    pages = []
    for repeat, part in runs.groupby("repeat"):
        columns = part[keys].drop_duplicates().sort_values(keys[:3])
        column_of = {key: i for i, key in enumerate(columns.itertuples(index=False, name=None))}
        betas = sorted(part["beta_deg"].unique())
        place = {
            str(run): (betas.index(beta), column_of[tuple(key)])
            for run, beta, *key in part[["run_id", "beta_deg", *keys]].itertuples(
                index=False, name=None
            )
        }
        heads = [_column_label(gamma, name, level) for gamma, _, level, name in column_of]
        for rows in _chunks(len(betas), MAX_ROWS):
            for across in _chunks(len(heads), MAX_COLUMNS):
                here = {
                    run: (i - rows.start, j - across.start)
                    for run, (i, j) in place.items()
                    if i in rows and j in across
                }
                if here:
                    names = [
                        f"\N{GREEK SMALL LETTER BETA} = {style.degrees(betas[i])}" for i in rows
                    ]
                    above = [heads[j] for j in across]
                    pages.append(Page(names, above, here, repeat == 0))
    return pages


# --- Drawing one page of a quality sheet: all panels in one Axes whose unit is the centimetre.


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

    `reach`: Depth and, for horizontal runs, path that a panel's width stands for, cm.
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

        `row`, `column`: Place of the panel on the page, from 0 at the upper left. Returns `left`,
        `top`: cm from the paper's upper left corner; up is positive, so that `top` is negative.
        """
        return LEFT + column * self.width, -_TOP - row * self.height

    def box(self, left: float, top: float, height: float) -> FloatArray:
        """Return the corners of a box as wide as a panel.

        `left`, `top`: Upper left corner, cm, as from `corner`. `height`: cm. Returns shape (4, 2):
        x and y of each corner, cm, once around.
        """
        right, bottom = left + self.width - _GAP, top - height
        return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])

    def panel(self, place: tuple[int, int], trace: DrawnTrace, fit: Mapping[Hashable, Any]) -> None:
        """Collect what belongs to one run.

        `place`: Row and column on the page. `trace`: Samples by column; empty if the run has none.
        `fit`: Row of the fit table.
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
        self, left: float, top: float, trace: DrawnTrace, fit: Mapping[Hashable, Any], flat: bool
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
        self, left: float, top: float, trace: DrawnTrace, fit: Mapping[Hashable, Any], bad: str
    ) -> None:
        def write(x: float, y: float, text: str, size: float, **how: str) -> None:
            self.axes.text(x, y, style.plain(text), fontsize=size, **how)  # type: ignore[arg-type]

        inner, margin = self.width - _GAP, 0.06
        room = int(inner / 0.13)
        run = str(fit["run_id"])
        # the end of a run's name tells runs apart
        run = run if len(run) <= room else "\N{HORIZONTAL ELLIPSIS}" + run[1 - room :]
        beta, gamma = (style.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
        write(left + margin, top - margin, f"{run}\nβ {beta}  γ {gamma}", 5.2, va="top")  # noqa: RUF001
        for c, x, side in (("z", left + margin, "left"), ("x", left + inner - margin, "right")):
            alpha, colour = float(fit[f"alpha_{c}_N_per_cm3"]), style.COMPONENT_COLOURS[c]
            if np.isfinite(alpha):
                text = f"α{c} {style.number(alpha)}"  # noqa: RUF001
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

        `notes`: A smaller line below the title.
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
        self.axes.text(LEFT, -0.35, style.plain(title), fontsize=14, va="top")
        self.axes.text(LEFT, -0.98, style.plain(notes), fontsize=8, va="top", color=style.MARK)
        return self.figure


# --- Quality sheets: every plate run of a medium as a small panel, bad ones marked, on A3 paper.


_COLUMNS = [
    "depth_cm", "path_cm", "in_window",
    *(f"{name}_{c}_N_per_cm2" for name, c in STRESS),
]  # fmt: skip


def _legend(sheet: Sheet) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    names = {
        ("stress", "z"): "tared vertical stress (z)",
        ("stress", "x"): "tared horizontal stress (x)",
        ("tare", "z"): "rod tare as stress (z)",
        ("tare", "x"): "rod tare as stress (x)",
    }
    entries: dict[str, Line2D | Patch] = {
        name: Line2D([], [], color=STRESS[key][0], linewidth=1.2) for key, name in names.items()
    }
    entries["fit through zero"] = Line2D([], [], color=FIT[0], linewidth=0.8, linestyle=(0, (5, 4)))
    entries["fit window"] = Patch(facecolor=WINDOW)
    entries["flagged or without alpha"] = Patch(
        facecolor="none", edgecolor=style.MARK, linewidth=1.4
    )
    place = (LEFT / sheet.paper[0], 0.12 / sheet.paper[1])
    sheet.figure.legend(
        list(entries.values()), list(entries), loc="lower left", bbox_to_anchor=place,
        ncols=len(entries), fontsize=7.5, borderaxespad=0, columnspacing=1.3,
    )  # fmt: skip
    text = (
        f"Across each panel: depth from 0 to {sheet.reach[0]:g} cm (horizontal runs: path from 0 to "
        f"{sheet.reach[1]:g} cm). Up: stress, from the panel's bottom to its top as written in it. "
        "α in N/cm³. "  # noqa: RUF001
        "Extractions as filed."
    )
    sheet.axes.text(LEFT, -sheet.paper[1] + 1.05, text, fontsize=7.5, va="center")


@style.styled
def _notes(fits: pd.DataFrame) -> str:
    """List the notes on runs, each with the number of runs that carry it."""
    if "note" not in fits.columns:
        return ""
    counts = fits["note"].replace("", np.nan).dropna().value_counts().sort_index()
    return "; ".join(f"{count} runs: {note}" for note, count in counts.items())


@style.styled
def draw_quality(traces: pd.DataFrame, fits: pd.DataFrame, medium_title: str) -> list[Figure]:
    """Draw the quality sheets of one medium: a panel for each plate run, ordered by beta and gamma.

    Each panel shows the tared stress, the rod's tare as stress, the fit window and the fit; its
    vertical scale is its own and printed in it. A run that is flagged or has no alpha has
    a red frame and says why. Extractions are drawn as filed (`rftfit.figures.plates.filed`).

    `traces`: Samples in the lab frame, in time order within a run: ``run_id, depth_cm,
    stress_z_N_per_cm2, stress_x_N_per_cm2, tare_z_N_per_cm2, tare_x_N_per_cm2, in_window`` and,
    for horizontal runs, ``path_cm``. A run of `fits` without samples has an empty panel. `fits`:
    Fit table of the medium. Returns pages of at most 15 by 7 runs; repeated runs stand on pages of
    their own.
    """
    fits = fits.assign(run_id=fits["run_id"].astype(str))
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
        sheet = Sheet(page, reach)
        for run, place in page.places.items():
            sheet.panel(place, samples.get(run, {}), fit_of[run])
        sheet.empty_places()
        _legend(sheet)
        figures.append(
            sheet.finish(
                title + (f" (page {i + 1} of {len(pages)})" if pages[1:] else ""), _notes(rows)
            )
        )
    return figures
