"""Figures of all plate runs: quality sheets, a small panel a run, up to A3; each run against others of its medium.

Two figures. `plot_quality`: sheets with a panel for each plate run, in rows of beta (attack angle) and columns of gamma
(direction), whose pages are made of `SheetLayout` (where each run stands) and `Sheet` (what is drawn). And
`plot_runs_side_by_side`: alpha of each run minus that of comparable runs. A run is marked if it has flags, or no alpha;
flags that all runs of a medium share mark none and stand in the heading instead. A fit is a row of the table of fits,
one for each run, with its direction, angles, alpha and window.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``flags`` (doubts on runs).
"""

from __future__ import annotations

import textwrap
from collections import defaultdict
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.compare.peers import APART_FROM
from rftfit.directions import number_depths
from rftfit.figures import style
from rftfit.figures.registry import figure, when
from rftfit.figures.traces import (
    DIRECTIONS,
    STRESS_SETTINGS,
    by_run,
    describe_problem,
    measures_x,
    panel_limits,
    stress_of,
    thin,
)
from rftfit.measure.flags import describe_shared
from rftfit.measure.sentences import FLAGS
from rftfit.measure.verdict_words import MAP, PAIR, REPEATS
from rftfit.store.text import count

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.figures.traces import Row, Trace
    from rftfit.measure.flags import Flags, Remark
    from rftfit.results import Results


def _describe_counts(fits: pd.DataFrame, flags: Flags, title: str, noun: str = "run") -> str:
    """Say how many plate runs a medium has, and how many of them are marked for a problem; `fits`: a row for each run."""
    marked = len(_list_problems(fits, flags))
    return f"{title}: {count(len(fits), noun)}, {marked} marked"


def _list_problems(fits: pd.DataFrame, flags: Flags) -> list[str]:
    """Describe the problem of each run that has one, in the order of `fits`."""
    shared = flags.shared(fits)
    problems = (describe_problem(fit, flags, shared) for fit in fits.to_dict("records"))
    return [problem for problem in problems if problem]


def _caption(results: Results, medium: str) -> str:
    """Write the caption: how many runs a medium has, how many are marked, and the reason where it is the same in all."""
    fits, flags, title = results[medium].fits, results[medium].flags, results[medium].title
    reasons = {*_list_problems(fits, flags)}
    return _describe_counts(fits, flags, title) + (
        f": {reasons.pop()}" if len(reasons) == 1 else ""
    )


@figure(
    "{medium}",
    reads=(
        "tared/{medium}.parquet",
        "windows/{medium}.parquet",
        "fits/{medium}.csv",
        "flags/{medium}.csv",
    ),
    settings=STRESS_SETTINGS,
    media=lambda campaign: campaign.media_with_samples(),
    folder="quality",
    section="Measurement",
    caption=_caption,
    lacking=lambda results, medium: (
        () if len(results[medium].fits) else (f"{results.titles[medium]}: no plate run to draw",)
    ),
)
def plot_quality(results: Results, medium: str) -> list[Figure]:
    """Draw the quality sheets of one medium."""
    medium_results = results[medium]
    return draw_quality(
        stress_of(results, medium), medium_results.fits, medium_results.flags, medium_results.title
    )


@style.styled()
def draw_quality(
    stress: pd.DataFrame, fits: pd.DataFrame, flags: Flags, medium_title: str
) -> list[Figure]:
    """Draw a panel for each plate run of a medium, in rows of beta and columns of gamma; repeats on pages of their own.

    `stress`: Table of `stress_samples`; a run of `fits` without samples has an empty panel. `fits`: A row for each run.
    """
    fits = fits.assign(run_id=fits["run_id"].astype(str))
    samples = by_run(stress)
    horizontal = set(fits.loc[fits["direction"] == "horizontal", "run_id"])
    # depth at which each horizontal run was made; of other runs it is not used
    depth_cm = fits.set_index("run_id")["depth_from_cm"].astype(float)
    # ends of all runs: at least 1 cm; no path where the medium has no horizontal run
    depths, paths = [1.0], [float(bool(horizontal))]
    for run, trace in samples.items():
        along = trace["path_cm" if run in horizontal else "depth_cm"]
        ends = paths if run in horizontal else depths
        ends.append(float(along[np.isfinite(along)].max(initial=0.0)))
        # a horizontal run without a fit is placed by the depth of its samples
        finite = trace["depth_cm"][np.isfinite(trace["depth_cm"])]
        if run in horizontal and np.isnan(depth_cm[run]) and finite.size:
            depth_cm[run] = float(np.median(finite))
    reach = float(np.ceil(max(depths))), float(np.ceil(max(paths)))
    pages = runs_on_pages(fits, depth_cm)
    fit_by_run = {fit["run_id"]: fit for fit in fits.to_dict("records")}
    shared = flags.shared(fits)
    title = _describe_counts(fits, flags, medium_title, "plate run")
    figures = []
    for i, page in enumerate(pages):
        sheet = Sheet(page, reach, flags, shared)
        for run, place in page.places.items():
            sheet.add_panel(place, samples.get(run, {}), fit_by_run[run])
        sheet.mark_empty_places()
        number = f" (page {i + 1} of {len(pages)})" if pages[1:] else ""
        figures.append(sheet.finish(title + number, _describe_notes(fits, shared)))
    return figures


def _describe_notes(fits: pd.DataFrame, shared: tuple[Remark, ...]) -> str:
    """Write the flags that all runs share, and each note of the run sheet with the number of runs that have it."""
    counts = fits["note"].replace("", np.nan).dropna().value_counts().sort_index()
    notes = [f"{count(runs, 'run')}: {note}" for note, runs in counts.items()]
    return "; ".join([*describe_shared(shared), *notes])


# The place of each run: rows of beta, columns of gamma, direction and depth


MAX_COLUMNS = 15
"""Most columns of a sheet: six extractions, three horizontal depths, six intrusions of the paper's grid."""

MAX_ROWS = 7
"""Most rows of a sheet: the attack angles of the paper's grid."""


@dataclass(frozen=True)
class SheetLayout:
    """Layout of one sheet of paper: a grid of places for runs.

    `row_labels`, `column_labels`: Text beside each row and above each column.
    `places`: Row and column of each run, from 0, by run_id.
    `is_first`: True for a sheet of first runs, where an empty place means that nothing was measured there. On sheets of
        repeated runs it means nothing.
    """

    row_labels: list[str]
    column_labels: list[str]
    places: dict[str, tuple[int, int]]
    is_first: bool


def depth_levels(depth_cm: pd.Series[float]) -> pd.Series[float]:
    """Replace the depths of horizontal runs, cm, by the mean of the level to which each belongs; NaN stays.

    Runs that were meant to be at one depth differ by a little, and shall stand in one column.
    """
    finite = depth_cm.dropna()
    means = finite.groupby(number_depths(np.asarray(finite, dtype=np.float64))).transform("mean")
    return means.reindex(depth_cm.index)


def _format_column_label(gamma_deg: float, direction: str, level_cm: float) -> str:
    """Write gamma, direction and, for horizontal runs, their depth (below 0: unknown) for the head of a column."""
    head = f"\N{GREEK SMALL LETTER GAMMA} = {style.degrees(gamma_deg)}\n{direction}"
    if direction == "horizontal":
        return head + (f"\n{level_cm:.1f} cm deep" if level_cm >= 0 else "\ndepth not known")
    return head


def runs_on_pages(fits: pd.DataFrame, depth_cm: pd.Series[float]) -> list[SheetLayout]:
    """Place the runs of one medium on sheets; the k-th repeats of all directions have sheets of their own.

    A column is one gamma, direction (extraction, horizontal, intrusion) and, for horizontal runs, level of depth; a row
    is one beta. A grid that is larger than a sheet is cut into several; one that would be mostly empty is given up, and
    its runs stand in turn. `depth_cm`: Depth of horizontal runs by run_id.
    """
    runs = fits[["run_id", "direction"]].copy()
    for name in ("beta_deg", "gamma_deg"):
        # + 0.0: a negative zero becomes positive
        runs[name] = fits[name].astype(float).round(2) + 0.0
    is_horizontal = runs["direction"] == "horizontal"
    depth = runs["run_id"].map(depth_cm).astype(float).where(is_horizontal)
    # -1 stands for a horizontal run of unknown depth
    runs["level"] = np.where(is_horizontal, depth_levels(depth).fillna(-1.0), 0.0)
    runs["order"] = runs["direction"].map(DIRECTIONS.index)
    keys = ["gamma_deg", "order", "level", "direction"]
    runs = runs.sort_values(["beta_deg", *keys, "run_id"], kind="stable")
    # 0 for the first run in its place, 1 for the second, ...
    runs["repeat"] = runs.groupby(["beta_deg", *keys]).cumcount()
    pages = []
    for repeat, runs_of_repeat in runs.groupby("repeat"):
        # `row`: number of the row of each run; `columns.ngroup()`: number of its column
        betas, row = np.unique(runs_of_repeat["beta_deg"], return_inverse=True)
        columns = runs_of_repeat.groupby(keys)
        keys_of_columns: Any = [key for key, _ in columns]
        heads = [
            _format_column_label(gamma, name, level) for gamma, _, level, name in keys_of_columns
        ]
        grid = zip(runs_of_repeat["run_id"].map(str), row, columns.ngroup(), strict=True)
        places = {run: (int(i), int(j)) for run, i, j in grid}
        # a grid with runs in less than a quarter of its places would be mostly empty
        if 4 * len(places) < len(betas) * len(heads):
            pages += _place_in_turn(list(places))
            continue
        sides = [f"β = {style.degrees(beta)}" for beta in betas]
        # upper left place of each sheet into which the grid is cut
        first_places = product(range(0, len(sides), MAX_ROWS), range(0, len(heads), MAX_COLUMNS))
        for top, left in first_places:
            places_on_page = {
                run: (i - top, j - left)
                for run, (i, j) in places.items()
                if 0 <= i - top < MAX_ROWS and 0 <= j - left < MAX_COLUMNS
            }
            if places_on_page:
                labels = sides[top : top + MAX_ROWS], heads[left : left + MAX_COLUMNS]
                pages.append(SheetLayout(*labels, places_on_page, repeat == 0))
    return pages


def _place_in_turn(runs: list[str]) -> list[SheetLayout]:
    """Place runs in scattered directions one after the other, on sheets without labels of rows and columns.

    `runs`: Their ids, in the order of placing. An empty place means nothing there.
    """
    pages = []
    most_runs = MAX_ROWS * MAX_COLUMNS
    for start in range(0, len(runs), most_runs):
        runs_on_page = runs[start : start + most_runs]
        columns = min(MAX_COLUMNS, len(runs_on_page))
        places = {run: divmod(i, columns) for i, run in enumerate(runs_on_page)}
        rows = -(-len(runs_on_page) // columns)
        pages.append(SheetLayout([""] * rows, [""] * columns, places, is_first=False))
    return pages


# One sheet: all panels in one Axes whose unit is the centimetre


WIDTH_CM, HEIGHT_CM = 42.0, 29.7
"""Size of A3, the largest sheet."""

LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 1.5, 0.4, 2.5, 1.5, 0.12
"""Margins of a sheet, with room for labels, title and legend, and the gap between panels, cm."""

_HEAD = 1.05
"""Height of the text above the curves in a panel, cm."""

_LARGEST, _NARROWEST = 5.0, 27.5
"""Largest width and height of a panel, and least width of a sheet, whose title and legend need it, cm."""

Pen = tuple[str, float, Any]
"""Colour, width and dashes of a line."""

STRESS: dict[tuple[str, str], tuple[Pen, str]] = {
    ("tare", "z"): (
        (style.PALE_COLOURS["z"], 0.6, style.DASHES["short"]),
        "rod tare as stress (z)",
    ),
    ("tare", "x"): (
        (style.PALE_COLOURS["x"], 0.6, style.DASHES["short"]),
        "rod tare as stress (x)",
    ),
    ("stress", "z"): ((style.COMPONENT_COLOURS["z"], 0.7, "-"), "tared vertical stress (z)"),
    ("stress", "x"): ((style.COMPONENT_COLOURS["x"], 0.7, "-"), "tared horizontal stress (x)"),
}
"""Pen and name of each curve of stress, by quantity and component, in the order of drawing."""

FIT: Pen = ("black", 0.6, (0, (5, 4)))
"""Pen of the line of a fit; dashed, so that it does not hide the samples."""

_WINDOW = "#e4e4e4"
"""Colour of the window of a fit."""


class Sheet:
    """Collects the lines of all panels of a page by pen, then draws all lines of a pen at once, which is fast.

    All panels are drawn in a single matplotlib Axes, since a hundred of them would take minutes. Coordinates are in cm
    from the upper left corner of the paper, up is positive. Call `add_panel` for each run, then `mark_empty_places`,
    then `finish`.

    `layout`: Where each run stands. `reach`: Depth and, for horizontal runs, path that the width of a panel spans, cm.
    `flags`: Flags of the runs. `shared`: Flags that all runs have.
    `width`, `height`: Of a place, a panel with the gap to the next. `paper`: Width and height of the sheet.
    `lines`: Polylines (k, 2) by pen. `windows`, `frames`: Corners (4, 2) of shaded windows, and of frames by colour.
    """

    def __init__(
        self,
        layout: SheetLayout,
        reach: tuple[float, float],
        flags: Flags,
        shared: tuple[Remark, ...],
    ) -> None:
        rows, columns = len(layout.row_labels), len(layout.column_labels)
        self.layout = layout
        self.flags = flags
        self.shared = shared
        self.reach = reach
        self.width = min((WIDTH_CM - LEFT - _RIGHT) / columns, _LARGEST)
        self.height = min((HEIGHT_CM - _TOP - _BOTTOM) / rows, _LARGEST)
        paper_width = max(LEFT + columns * self.width + _RIGHT, _NARROWEST)
        self.paper = paper_width, _TOP + rows * self.height + _BOTTOM
        # a point of A3 at 150 dpi is 2 pixels: text of 5 points can still be read
        self.figure = style.new_figure(*self.paper, dpi=150)
        self.axes: Axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set(xlim=(0, self.paper[0]), ylim=(-self.paper[1], 0))
        self.axes.set_axis_off()
        self.lines: dict[Pen, list[FloatArray]] = defaultdict(list)
        self.windows: list[FloatArray] = []
        self.frames: dict[str, list[FloatArray]] = defaultdict(list)

    def corner(self, row: int, column: int) -> tuple[float, float]:
        """Return left and top of the panel in a row and column, counted from 0, cm."""
        return LEFT + column * self.width, -_TOP - row * self.height

    def add_frame(self, left: float, top: float, colour: str) -> None:
        """Collect the frame of a panel."""
        right, bottom = left + self.width - _GAP, top - self.height + _GAP
        self.frames[colour].append(_corners(left, right, bottom, top))

    def add_panel(self, place: tuple[int, int], trace: Trace, fit: Row) -> None:
        """Collect lines and text of one run; its frame is red if it is marked.

        `place`: Row and column. `trace`: Samples of the run; empty if it has none. `fit`: Its row of the table of fits.
        """
        left, top = self.corner(*place)
        problem = describe_problem(fit, self.flags, self.shared)
        self.add_frame(left, top, style.MARK if problem else "#9a9a9a")
        if trace:
            self._add_curves(left, top, trace, fit)
        self._write_text(left, top, trace, fit, problem)

    def _add_curves(self, left: float, top: float, trace: Trace, fit: Row) -> None:
        """Collect stress, tare, fit and window of a run as lines on the paper; the panel begins at `left` and `top`, cm.

        Across the panel runs depth, of a horizontal run path, with the same scale in all panels; up runs stress, with a
        range of its own.
        """
        is_horizontal = fit["direction"] == "horizontal"
        inner, tall = self.width - _GAP, self.height - _GAP - _HEAD
        lowest, highest = panel_limits(trace)
        # cm on paper for 1 N/cm^2, and height of the line of zero stress
        scale = tall / (highest - lowest)
        zero = top - _HEAD - scale * highest
        depth_reach, path_reach = self.reach
        # cm on paper for a cm of depth or path
        across = inner / (path_reach if is_horizontal else depth_reach)
        along = trace["path_cm" if is_horizontal else "depth_cm"]
        # samples above the surface would lie in the next panel
        along = np.where(along >= 0, along, np.nan)
        x = left + across * along
        window = x[(trace["in_window"] > 0) & np.isfinite(x)]
        if window.size:
            bottom, head = top - _HEAD - tall, top - _HEAD
            self.windows.append(_corners(window.min(), window.max(), bottom, head))
        self.lines["#b0b0b0", 0.4, "-"].append(np.array([(left, zero), (left + inner, zero)]))
        for (quantity, c), (pen, _) in STRESS.items():
            stress = trace[f"{quantity}_{c}_N_per_cm2"]
            if (c == "z" or measures_x(trace)) and (quantity == "stress" or np.any(stress)):
                self.lines[pen] += thin(x, zero + scale * stress)
        if not np.isfinite(x).any():
            return
        ends = np.array([0.0 if is_horizontal else np.nanmin(along), np.nanmax(along)])
        # the line of a fit is alpha times depth: level for a horizontal run, which stays at one depth
        depths = np.full(2, np.nanmedian(trace["depth_cm"])) if is_horizontal else ends
        for c in "zx":
            y = zero + scale * float(fit[f"alpha_{c}_N_per_cm3"]) * depths
            if np.isfinite(y).all() and (c == "z" or measures_x(trace)):
                self.lines[FIT].append(np.column_stack([left + across * ends, y]))

    def _write_text(self, left: float, top: float, trace: Trace, fit: Row, problem: str) -> None:
        """Write name, angles, alpha, range of stress and problem of a run into its panel; `problem`: empty for none."""

        def write(x: float, y: float, text: str, size: float, **properties: str) -> None:
            """Write text into the panel, its top left or right corner at x and y, cm."""
            self.axes.text(x, y, style.plain(text), fontsize=size, va="top", **properties)  # type: ignore[arg-type]

        inner, margin = self.width - _GAP, 0.06
        # a letter of this size is about 0.13 cm wide
        max_letters = int(inner / 0.13)
        run = str(fit["run_id"])
        # names of runs differ at their end: a long name loses its beginning
        run = run if len(run) <= max_letters else "\N{HORIZONTAL ELLIPSIS}" + run[1 - max_letters :]
        beta, gamma = (style.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
        write(left + margin, top - margin, f"{run}\nβ {beta}  γ {gamma}", 5.2)
        for c, x, alignment in (
            ("z", left + margin, "left"),
            ("x", left + inner - margin, "right"),
        ):
            alpha, colour = float(fit[f"alpha_{c}_N_per_cm3"]), style.COMPONENT_COLOURS[c]
            if c == "x" and not measures_x(trace):
                text = "αx 0 by symmetry" if np.isfinite(alpha) else "αx not measured"
                write(x, top - 0.54, text, 5.2, color="#555555", ha=alignment)
            elif np.isfinite(alpha):
                text = f"α{c} {style.format_number(alpha)}"
                write(x, top - 0.54, text, 5.2, color=colour, ha=alignment)
        if trace:
            lowest, highest = (
                f"{end:g}".replace("-", "\N{MINUS SIGN}") for end in panel_limits(trace)
            )
            text = f"stress {lowest} to {highest} N/cm²"
            write(left + margin, top - 0.78, text, 4.8, color="#555555")
        if problem:
            placeholder = " \N{HORIZONTAL ELLIPSIS}"
            lines = textwrap.wrap(problem, max_letters - 1, max_lines=4, placeholder=placeholder)
            y = top - _HEAD - margin if trace else top - 0.55 * self.height + _GAP + margin
            write(left + margin, y, "\n".join(lines), 5.2, color=style.MARK)

    def mark_empty_places(self) -> None:
        """Write "not measured" into each empty place of a sheet of first runs; on others it means nothing."""
        if not self.layout.is_first:
            return
        rows, columns = range(len(self.layout.row_labels)), range(len(self.layout.column_labels))
        for place in sorted({*product(rows, columns)} - {*self.layout.places.values()}):
            left, top = self.corner(*place)
            self.add_frame(left, top, "#dddddd")
            middle = left + (self.width - _GAP) / 2, top - (self.height - _GAP) / 2
            self.axes.text(
                *middle, "not measured", fontsize=5.5, color="#888888", ha="center", va="center"
            )

    def finish(self, title: str, notes: str) -> Figure:
        """Draw everything that was collected, and the labels of rows and columns; `notes` stand below the title."""
        from matplotlib.collections import LineCollection, PolyCollection

        self.axes.add_collection(PolyCollection(self.windows, facecolors=_WINDOW, linewidths=0))
        for (colour, width, dashes), lines in self.lines.items():
            self.axes.add_collection(
                LineCollection(lines, colors=colour, linewidths=width, linestyles=[dashes])
            )
        for colour, boxes in self.frames.items():
            width = 1.4 if colour == style.MARK else 0.4
            self.axes.add_collection(
                PolyCollection(boxes, facecolors="none", edgecolors=colour, linewidths=width)
            )
        for i, label in enumerate(self.layout.row_labels):
            y = self.corner(i, 0)[1] - (self.height - _GAP) / 2
            self.axes.text(LEFT - 0.2, y, label, fontsize=8, ha="right", va="center", rotation=90)
        for i, label in enumerate(self.layout.column_labels):
            x = self.corner(0, i)[0] + (self.width - _GAP) / 2
            self.axes.text(x, -_TOP + 0.12, label, fontsize=7, ha="center", va="bottom")
        self.axes.text(LEFT, -0.35, style.plain(title), fontsize=14, va="top")
        # some flags say how a medium was measured, which is no fault of its runs
        is_fault = any(FLAGS[flag.code].shared != "always" for flag in self.shared)
        colour = style.MARK if is_fault else "#555555"
        self.axes.text(LEFT, -0.98, style.plain(notes), fontsize=8, va="top", color=colour)
        self._add_legend()
        return self.figure

    def _add_legend(self) -> None:
        """Add the legend of the curves that were drawn, and a sentence on what the panels span."""
        curves = [STRESS[quantity, c] for quantity in ("stress", "tare") for c in "zx"]
        entries = {
            name: style.line(pen[0], linewidth=1.2, linestyle=pen[2])
            for pen, name in curves
            if pen in self.lines
        }
        entries["fit through zero"] = style.line(FIT[0], linewidth=0.8, linestyle=FIT[2])
        entries["fit window"] = style.patch(facecolor=_WINDOW)
        if style.MARK in self.frames:
            frame = style.patch(facecolor="none", edgecolor=style.MARK, linewidth=1.4)
            entries["flagged or without alpha"] = frame
        style.legend(
            self.figure,
            entries,
            bbox_to_anchor=(LEFT / self.paper[0], 0.12 / self.paper[1]),
            loc="lower left",
            fontsize=7.5,
            borderaxespad=0,
            columnspacing=1.3,
        )
        depth_cm, path_cm = self.reach
        horizontal = f" (horizontal runs: path from 0 to {path_cm:g} cm)" * (path_cm > 0)
        explanation = (
            f"Across each panel: depth from 0 to {depth_cm:g} cm{horizontal}. Up: stress, from the panel's bottom to its top as written in "
            "it. α in N/cm³. Extractions stand at their angles in the maps."
        )
        self.axes.text(LEFT, -self.paper[1] + 1.05, explanation, fontsize=7.5, va="center")


def _corners(left: float, right: float, bottom: float, top: float) -> FloatArray:
    """Return the corners of a rectangle, shape (4, 2)."""
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])


# Runs compared with others of their medium


_LINE_CM = 0.27
"""Height of a line that names an outlier."""

_MOST_NAMED, _LONGEST_NAME = 6, 30
"""Most outliers that are named, and most letters of their names."""

_COMPARED_WITH = {
    REPEATS: ("repeats", "the median of its repeats", "o", True),
    PAIR: ("map", "the map by all other runs; judged by the other of two", "s", False),
    MAP: ("map", "the map by all other runs", "o", False),
}
"""For each content of column ``beside`` of ``results/peers``, which says what a run was compared with: short and full
name of that, marker, and whether the marker is filled."""


def _read_comparisons(results: Results) -> dict[str, pd.DataFrame]:
    """Read the table of compared runs of each medium that has two or more, by medium.

    A row is a run: its alpha, that of the others (``others_z_N_per_cm3``, ...), what these are (``beside``), by how
    many times the usual spread it differs (``times_spread``), and whether that is so far that it is an outlier
    (``apart``).
    """
    table_by_medium = {
        medium: results.table(f"peers/{medium}.csv") for medium in results.laboratory
    }
    return {medium: table for medium, table in table_by_medium.items() if len(table) > 1}


@figure(
    "runs_side_by_side",
    reads=("peers/{laboratory}.csv",),
    media=when(lambda campaign: campaign.of_role("laboratory")),
    section="Measurement",
    caption=(
        "Does each run agree with the others of its medium? Its alpha minus that of its repeats or, where a direction was "
        "pushed once or twice, of the map by all other runs. Good: all points about zero, none red."
    ),
    lacking=lambda results, _: (
        ()
        if _read_comparisons(results)
        else ("no medium has two plate runs with alpha: there is nothing to compare",)
    ),
)
def plot_runs_side_by_side(results: Results) -> Figure:
    """Draw alpha of each run minus that of the others of its medium, a row a medium, a column a component.

    The others are the repeats of the run or, where it has none, the map by all other runs. Outliers are red and
    numbered; above the panels stand their names.
    """
    tables = _read_comparisons(results)
    compared_with = set().union(*(table["beside"] for table in tables.values()))
    comparisons = {
        key: comparison for key, comparison in _COMPARED_WITH.items() if key in compared_with
    }
    # what the axes name: repeats or map, where all runs are compared with the same
    others = next(iter(comparisons.values()))[0] if len(comparisons) == 1 else "others"
    runs_apart_of = {
        medium: table[table["apart"].astype(bool)].sort_values("times_spread", ascending=False)
        for medium, table in tables.items()
    }
    outlier_lines = {
        medium: _describe_outliers(runs_apart) for medium, runs_apart in runs_apart_of.items()
    }
    # the list of outliers stands above the panels, which keep their height
    heights_cm = [3.5 + _LINE_CM * len(lines) for lines in outlier_lines.values()]
    page, panels = style.panels(heights_cm, 2, 9.0)
    for (medium, table), row_of_axes in zip(tables.items(), panels, strict=True):
        runs_apart = runs_apart_of[medium]
        for axes, c in zip(row_of_axes, "zx", strict=True):
            _draw_differences(axes, table, runs_apart, c)
            if medium == [*tables][-1]:
                axes.set_xlabel(f"{others}, {style.alpha_label(c)}")
        row_of_axes[0].set_ylabel(f"run minus {others}\n({style.PER_CM3})")
        title = style.medium_label(results, medium)
        row_of_axes[0].set_title(title, loc="left", weight="bold")
        lines = [_describe_differences(table), *outlier_lines[medium]]
        row_of_axes[1].set_title("\n".join(lines), loc="left", fontsize=5.5)
    entries: dict[str, Any] = {}
    for _, name, marker, is_filled in comparisons.values():
        entries[f"compared with {name}"] = tuple(
            style.line(colour, **_comparison_look(colour, marker, is_filled))
            for colour in style.COMPONENT_COLOURS.values()
        )
    if any(table["apart"].any() for table in tables.values()):
        entries["outlier"] = style.dots(style.MARK, 4)
    style.legend(page, entries)
    return page


def _comparison_look(colour: str, marker: str, is_filled: bool) -> style.Look:
    """Return the look of points for one sort of comparison, without their size."""
    face = colour if is_filled else "none"
    return {"marker": marker, "linestyle": "", "markerfacecolor": face, "markeredgewidth": 0.5}


def _draw_differences(axes: Axes, table: pd.DataFrame, runs_apart: pd.DataFrame, c: str) -> None:
    """Draw one component of alpha of the runs of a medium minus that of the others, against that of the others.

    Both components have the same range, so that they can be compared. `runs_apart`: Rows of outliers, the worst first;
    each has its number in this order, in the panel of the component in which it differs most. `c`: The component drawn.
    """
    style.zero_line(axes)
    differences = {
        component: table[f"alpha_{component}_N_per_cm3"] - table[f"others_{component}_N_per_cm3"]
        for component in "zx"
    }
    alpha_of_others, difference = table[f"others_{c}_N_per_cm3"], differences[c]
    colour = style.COMPONENT_COLOURS[c]
    is_crowded = len(table) >= 200
    size = 1.8 if is_crowded else 3
    for comparison, (_, _, marker, is_filled) in _COMPARED_WITH.items():
        rows = table["beside"] == comparison
        look: style.Look = {"color": colour, "markersize": size, "alpha": 0.7}
        look |= _comparison_look(colour, marker, is_filled)
        axes.plot(alpha_of_others[rows], difference[rows], **look)
    points = zip(
        alpha_of_others[runs_apart.index],
        difference[runs_apart.index],
        runs_apart.to_dict("records"),
        strict=True,
    )
    for number, (x, y, run) in enumerate(points, 1):
        axes.plot(x, y, "o", markersize=4, color=style.MARK)
        if number <= _MOST_NAMED and _component_apart(run) == c:
            axes.annotate(
                f"{number}",
                (x, y),
                (3, 2),
                textcoords="offset points",
                fontsize=5.5,
                color=style.MARK,
            )
    limit = 1.15 * float(np.nanmax(np.abs([*differences.values()]), initial=1e-4))
    axes.set_ylim(-limit, limit)
    axes.margins(x=0.08)
    for axis in (axes.xaxis, axes.yaxis):
        style.ticks(axis, 5)


def _describe_differences(table: pd.DataFrame) -> str:
    """Say how many runs were compared, how many are apart (outliers), and how far runs differ; two lines.

    `table`: Of compared runs. ``times_spread`` is the difference of a run in units of the usual spread; NaN where too
    few runs show this spread.
    """
    times = table["times_spread"]
    if times.isna().all():
        return f"{count(len(table), 'run')}: too few to estimate how much runs differ"
    differences = (table[f"alpha_{c}_N_per_cm3"] - table[f"others_{c}_N_per_cm3"] for c in "zx")
    medians = [style.format_number(difference.abs().median(), 4) for difference in differences]
    farthest = style.format_number(float(times.max()), 1)
    limit = min(APART_FROM[beside] for beside in table.loc[times.notna(), "beside"])
    return (
        f"{len(table)} runs, {int(table['apart'].sum())} of {times.notna().sum()} apart, the farthest by {farthest} times the spread "
        f"(limit: {limit:g})\n"
        f"half of the differences within {medians[0]} (z) and {medians[1]} (x) {style.PER_CM3}"
    )


def _component_apart(run: Row) -> str:
    """Return the component in which a run, a row of the table of compared runs, differs most from the others."""
    return "x" if abs(run["off_x_ratio"]) > abs(run["off_z_ratio"]) else "z"


def _describe_outliers(runs_apart: pd.DataFrame) -> list[str]:
    """Write a line for each outlier: its name, its alpha and that of the others, in the component that differs most.

    `runs_apart`: Rows of outliers, the worst first. Of many only the first `_MOST_NAMED` are named.
    """
    lines = []
    for number, run in enumerate(runs_apart.to_dict("records")[:_MOST_NAMED], 1):
        c = _component_apart(run)
        alpha_of_run, alpha_of_others = (
            style.format_number(run[f"{name}_{c}_N_per_cm3"]) for name in ("alpha", "others")
        )
        name = str(run["run_id"])
        name = (
            name
            if len(name) <= _LONGEST_NAME
            else "\N{HORIZONTAL ELLIPSIS}" + name[1 - _LONGEST_NAME :]
        )
        lines.append(
            rf"{number}  {style.plain(name)}: $\alpha_{c}$ {alpha_of_run} beside {alpha_of_others}"
        )
    return lines + [f"and {len(runs_apart) - _MOST_NAMED} more"] * (len(runs_apart) > _MOST_NAMED)
