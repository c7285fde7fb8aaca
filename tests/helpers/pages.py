"""Reading what people read: figures, sentences of the page, code blocks of the documentation, the dictionary.

python tests/helpers/pages.py figures CAMPAIGN...      draws every figure of campaigns whose workflow has run
python tests/helpers/pages.py sentences FOLDER...      prints what campaigns say of what they do not have
"""

import contextlib
import html
import io
import itertools
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.collections import Collection, LineCollection, PathCollection
from matplotlib.colors import to_rgba
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.offsetbox import DrawingArea, HPacker, TextArea
from matplotlib.patches import Patch
from matplotlib.quiver import Quiver
from matplotlib.spines import Spine
from matplotlib.text import Text

import rftfit
from rftfit.figures import style
from rftfit.figures.plates import stress_runs
from rftfit.figures.registry import figures
from rftfit.page.page import page
from rftfit.results import open_results

# --- Texts of a figure that lie over one another or stick out of it, by the renderer's own boxes ------------------

_SVG_DPI = 72
_EDGE_CM = 0.02
"""Letters may stick out of a figure, and boxes into one another, by this much: boxes are wider than letters."""

_LEADING = 0.18
"""Share of the height of a box that letters leave free above and below."""


@style.styled()  # how many ticks an axis has depends on the style too
def text_faults(figure):
    """Say of every text whether it leaves the figure or lies over another one; empty if none does."""
    with laid_out(figure) as renderer:
        return _faults(figure, renderer)


@contextlib.contextmanager
def laid_out(figure):
    """Let legends and labels of a figure find their places on an svg; yields its renderer."""
    usual, figure.dpi = figure.dpi, _SVG_DPI
    try:
        svg: Any = RendererSVG
        renderer = svg(*figure.bbox.size, io.StringIO(), image_dpi=_SVG_DPI)
        with renderer._draw_disabled():
            figure.draw(renderer)
        yield renderer
    finally:
        figure.dpi = usual


def _faults(figure, renderer):
    texts = list(drawn_texts(figure))
    boxes = np.array([text.get_window_extent(renderer).extents for text in texts]).reshape(-1, 4)
    pixels = _EDGE_CM / 2.54 * figure.dpi
    width, height = figure.bbox.size
    outside = (boxes[:, :2] < -pixels).any(axis=1) | (
        boxes[:, 2:] > np.array([width, height]) + pixels
    ).any(axis=1)
    names = [" ".join(text.get_text().split()) for text in texts]
    # what is written above a figure is saved with it (`rftfit.figures.style.mark`)
    above = [text in figure.texts and text.get_position()[1] > 1 for text in texts]
    faults = [f"{names[i]!r} leaves the figure" for i in np.flatnonzero(outside) if not above[i]]
    free = _LEADING * np.minimum(boxes[:, 3] - boxes[:, 1], boxes[:, 2] - boxes[:, 0])[:, None]
    free = np.maximum(free, pixels)
    low, high = boxes[:, :2] + free, boxes[:, 2:] - free
    over = ((low[:, None] < high[None]) & (low[None] < high[:, None])).all(axis=2)
    pairs = np.argwhere(np.triu(over, 1))
    return faults + [f"{names[i]!r} lies over {names[j]!r}" for i, j in pairs]


def drawn_texts(figure):
    """Every text that is drawn: of ticks only those between the ends of their axis."""
    ticks, shown = set(), []
    for axes in figure.findobj(Axes):
        for axis in (axes.xaxis, axes.yaxis):
            every = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            ticks |= {label for tick in every for label in (tick.label1, tick.label2)}
            if axes.axison and axis.get_visible():
                visible: Any = axis
                shown += [
                    label
                    for tick in visible._update_ticks()
                    for label in (tick.label1, tick.label2)
                ]
            else:
                ticks |= {axis.label, axis.get_offset_text()}
    for text in [
        *(candidate for candidate in figure.findobj(Text) if candidate not in ticks),
        *shown,
    ]:
        if isinstance(text, Text) and text.get_visible() and text.get_text().strip():
            yield text


def words(figure):
    """Every text of a figure that is not empty."""
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


# --- What a reader of a figure cannot find or read: texts, legends, titles of axes, what leaves its axes ----------

_POINT = 1 / 72
_OVER_PT = 0.8
"""What is drawn may pass the frame of its axes by this much: half of a line."""

_APART_LAB = 8.0
"""Least distance of two colours of a legend, CIELAB."""

_GREYS_APART = 12.0
"""Least distance of two lightnesses of a legend, CIELAB: entries of one form and one dash or symbol must differ in a grey print."""

_UNITS = r"number|N|cm|mm|s|Hz|deg|degrees|%|dimensionless|rows"
_WITH_UNIT = re.compile(rf"\((10\$\^[^$]*\$ )?({_UNITS})\b|\(%|\d %")
"""A unit in brackets; of a residual per cent."""


@style.styled()  # ticks and letters depend on the style
def figure_faults(figure):
    """Say what a reader of a figure cannot find or read; empty if there is nothing."""
    faults = text_faults(figure)
    with laid_out(figure):
        shown_axes = [axes for axes in figure.findobj(Axes) if axes.get_visible()]
        for axes in shown_axes:
            faults += _untitled(axes, shown_axes, figure)
            faults += _leaving(axes)
        looks_by_axes = [[*_looks_of_axes(axes)] for axes in shown_axes]
        for legend in _legends(figure):
            faults += _legend_faults(legend, looks_by_axes)
    return faults


def _untitled(axes, shown_axes, figure):
    """Say which axis has numbers and neither a title of its own nor one in its row or column."""
    if not axes.axison:
        return []
    faults = []
    for name in "xy":
        axis = getattr(axes, f"{name}axis")
        labels = [label for label in _tick_labels(axis) if label.get_text().strip()]
        if not labels or not any(_is_number(label.get_text()) for label in labels):
            continue  # names need no unit
        title = _title_of(axes, name, shown_axes, figure)
        if not title:
            faults.append(f"{_name_of(axes)}: the {name} axis has numbers and no title")
        elif not _WITH_UNIT.search(title):
            faults.append(f"{_name_of(axes)}: no unit in the title of the {name} axis: {title!r}")
    return faults


def _title_of(axes, name, shown_axes, figure):
    """Title of an axis: its own, that of the axes in its row or column, that of the figure or of the head of a map."""
    for titled_axes in [axes, *shown_axes]:
        if titled_axes is axes or _share_place(axes, titled_axes, name):
            title = getattr(titled_axes, f"get_{name}label")()
            if title:
                return " ".join(title.split())
    title = getattr(figure, f"get_sup{name}label")()
    if not title and getattr(axes, "_colorbar", None):
        return _head_of_map(axes, shown_axes, figure)
    return title


def _share_place(axes, titled_axes, name):
    """Whether two axes stand in one row (for y) or one column (for x)."""
    if getattr(titled_axes, "_colorbar", None) or getattr(axes, "_colorbar", None):
        return False
    ends = [box.get_position() for box in (axes, titled_axes)]
    sides = ("y0", "y1") if name == "y" else ("x0", "x1")
    return all(abs(getattr(ends[0], side) - getattr(ends[1], side)) < 0.01 for side in sides)


def _head_of_map(bar, shown_axes, figure):
    """What stands above the map that a bar of colours belongs to: its title, or the head of its column."""
    box = bar.get_position()
    maps = [axes for axes in shown_axes if not getattr(axes, "_colorbar", None)]
    own_map = max(
        (axes for axes in maps if axes.get_position().x1 <= box.x0 + 1e-6
         and abs(axes.get_position().y0 - box.y0) < 0.01),
        key=lambda axes: axes.get_position().x1,
        default=None,
    )  # fmt: skip
    if own_map is None:
        return ""
    title = own_map.get_title() or own_map.get_title(loc="left")
    if title:
        return title
    middle = (own_map.get_position().x0 + own_map.get_position().x1) / 2
    heads = [
        text.get_text()
        for text in figure.texts
        if abs(text.get_position()[0] - middle) < 0.02 and text.get_position()[1] > box.y1
    ]
    return " ".join(" ".join(heads).split())


def _tick_labels(axis):
    return [
        label
        for tick in axis._update_ticks()
        for label in (tick.label1, tick.label2)
        if label.get_visible()
    ]


def _is_number(label):
    digits = re.sub(r"\\mathdefault|[${}^]", "", label).strip()
    return bool(re.fullmatch(r"[+\N{MINUS SIGN}-]?[\d.,\N{MINUS SIGN}-]+%?", digits))


def _name_of(axes):
    """What a reader would call an axes: its title or the title of an axis, and its place."""
    names = (axes.get_title(), axes.get_title(loc="left"), axes.get_ylabel(), axes.get_xlabel())
    left, below, *_ = axes.get_position().bounds
    return f"{next(filter(None, names), 'axes')!r} at {left:.2f}, {below:.2f}"


def _leaving(axes):
    """Say which lines, bands and points pass the frame of their axes by more than half of a line."""
    frame, over = axes.bbox.extents, _OVER_PT * _POINT * axes.figure.dpi
    faults = []
    for artist in [*axes.lines, *axes.collections, *axes.patches]:
        if not artist.get_visible():
            continue
        points = _display_points(artist)
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            continue
        reach = _radius(artist)
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        passed = (*(low < frame[:2] - over), *(high > frame[2:] + over))
        sides = [*itertools.compress(("left", "below", "right", "above"), passed)]
        if sides:
            faults.append(f"{_name_of(axes)}: {artist} leaves the axes: {', '.join(sides)}")
    return faults


def _display_points(artist):
    """Every corner of what is drawn, pixels (n, 2)."""
    if isinstance(artist, Line2D):
        return artist.get_transform().transform(artist.get_xydata())
    if isinstance(artist, Patch):
        return artist.get_transform().transform(artist.get_path().vertices)
    paths = [path for path in artist.get_paths() if len(path.vertices)]
    transform = artist.get_transform()
    if isinstance(artist, Quiver):
        places = artist.get_offset_transform().transform(artist.XY)
        return np.concatenate(
            [transform.transform(path.vertices) + place
             for path, place in zip(artist.get_paths(), places, strict=True)]
        )  # fmt: skip
    if isinstance(artist, PathCollection):
        return artist.get_offset_transform().transform(np.ma.filled(artist.get_offsets(), np.nan))
    if hasattr(artist, "get_coordinates"):  # a mesh
        return transform.transform(np.asarray(artist.get_coordinates()).reshape(-1, 2))
    vertices = [path.vertices for path in paths]
    return transform.transform(np.concatenate(vertices)) if vertices else np.empty((0, 2))


def _radius(artist):
    """How far a mark that is not cut by the frame reaches from its middle, pixels."""
    if artist.get_clip_on():
        return 0.0
    if isinstance(artist, Line2D):
        has_marker = artist.get_marker() not in ("", "None", None)
        size = artist.get_markersize() if has_marker else artist.get_linewidth()
    elif isinstance(artist, PathCollection):
        size = float(np.sqrt(np.max(artist.get_sizes())))
    else:
        return 0.0
    return size / 2 * _POINT * artist.figure.dpi


@dataclass(frozen=True)
class Look:
    """How one thing looks.

    `form`: ``line``, ``mark`` or ``area``. `colour`: Red, green, blue and opacity; of an area without a fill that of its
    edge. `detail`: Dashes, symbol with its fill, or hatching.
    """

    form: str
    colour: tuple[float, float, float, float]
    detail: str

    def is_like(self, drawn):
        """Whether a reader takes what is drawn for this."""
        near = np.abs(np.subtract(self.colour, drawn.colour)) < (0.02, 0.02, 0.02, 0.1)
        if self.form != "area":
            near[3] = True  # thin curves may be paler than their entry
        return self.form == drawn.form and self.detail == drawn.detail and bool(near.all())


def _legend_faults(legend, looks_by_axes):
    looks_by_entry = dict(_entries(legend))
    drawn_looks = [look for looks in looks_by_axes for look in looks]
    faults = []
    for name, looks in looks_by_entry.items():
        faults += [
            f"legend: {name!r} shows a {look} that is not drawn"
            for look in looks
            if not any(look.is_like(drawn) for drawn in drawn_looks)
        ]
        if not looks:
            faults.append(f"legend: {name!r} shows nothing")
    for (name, looks), (other_name, other_looks) in itertools.combinations(
        looks_by_entry.items(), 2
    ):
        if looks and other_looks and not _differ(looks, other_looks):
            faults.append(f"legend: {name!r} looks like {other_name!r}")
        elif not _differ_in_grey(looks, other_looks, looks_by_axes):
            faults.append(f"legend: {name!r} looks like {other_name!r} in a grey print")
    return faults


def _differ(looks, other_looks):
    """Whether two entries can be told apart by form, detail or colour."""
    forms, other_forms = (
        {(look.form, look.detail) for look in entry} for entry in (looks, other_looks)
    )
    if forms != other_forms:
        return True
    pairs = zip(looks, other_looks, strict=False)
    return len(looks) != len(other_looks) or any(
        np.linalg.norm(_lab(look.colour) - _lab(other.colour)) > _APART_LAB for look, other in pairs
    )


def _differ_in_grey(looks, other_looks, looks_by_axes):
    """Whether what two entries show can be told apart without colours wherever both are drawn in one axes.

    An entry of several colours stands for what is drawn beside something else; each colour is judged with that.
    """
    if len(looks) != 1 or len(other_looks) != 1:
        return True
    (look,), (other,) = looks, other_looks
    if (look.form, look.detail) != (other.form, other.detail):
        return True
    are_together = any(
        all(any(entry.is_like(drawn) for drawn in drawn_looks) for entry in (look, other))
        for drawn_looks in looks_by_axes
    )
    lightness, other_lightness = (_lab(entry.colour)[0] for entry in (look, other))
    return not are_together or abs(lightness - other_lightness) > _GREYS_APART


@cache
def _lab(colour):
    """A colour over white paper in CIELAB."""
    *rgb, opacity = colour
    over_white = np.array(rgb) * opacity + 1 - opacity
    linear = np.where(
        over_white > 0.04045, ((over_white + 0.055) / 1.055) ** 2.4, over_white / 12.92
    )
    xyz = (
        np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
        @ linear
    )
    x, y, z = np.cbrt(np.maximum(xyz / [0.9505, 1.0, 1.089], 0.0089))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def _legends(figure):
    return figure.findobj(Legend)


def _entries(legend):
    """Name of each entry of a legend and how its handles look."""
    for row in legend.findobj(HPacker):
        parts = row.get_children()
        if len(parts) == 2 and isinstance(parts[0], DrawingArea) and isinstance(parts[1], TextArea):
            looks = [
                look
                for artist in parts[0].get_children()
                for look in _looks_of(artist, drawn=False)
            ]
            yield parts[1].get_text(), looks


def _looks_of_axes(axes):
    for artist in [*axes.lines, *axes.collections, *axes.patches]:
        if artist.get_visible() and not isinstance(artist, Spine):
            yield from _looks_of(artist)


def _looks_of(artist, drawn=True):
    """Yield how an artist looks; of one on axes without a finite point nothing."""
    opacity = artist.get_alpha()

    def coloured(colour):
        red, green, blue, strength = to_rgba(colour)
        return red, green, blue, float(opacity) if isinstance(opacity, (int, float)) else strength

    if isinstance(artist, Line2D):
        yield from _looks_of_line(artist, coloured, drawn)
    elif isinstance(artist, Patch):
        fill: Any = artist.get_facecolor()
        is_filled = artist.get_fill() and fill[3] > 0
        hatch = _strokes(artist.get_hatch())
        yield Look(
            "area",
            coloured(fill if is_filled else artist.get_edgecolor()),
            hatch or ("" if is_filled else "frame"),
        )
    elif isinstance(artist, ContourSet):
        for hatch in artist.hatches or ():
            if hatch:
                yield Look("area", (1.0, 1.0, 1.0, 1.0), _strokes(hatch))
        for colour in artist.get_edgecolor()[:1]:
            yield Look("line", coloured(colour), "solid")
    elif isinstance(artist, LineCollection):
        dashes = [_dashes(pattern) for pattern in _dash_patterns(artist)] or ["solid"]
        for colour, dash in itertools.product(
            np.unique(artist.get_edgecolor(), axis=0), set(dashes)
        ):
            yield Look("line", coloured(colour), dash)
    elif isinstance(artist, PathCollection):
        for colour in np.unique(artist.get_facecolor(), axis=0)[:20]:
            yield Look("mark", coloured(colour), "o filled")
    elif isinstance(artist, Collection) and not hasattr(artist, "get_coordinates"):
        for colour in np.unique(artist.get_facecolor(), axis=0):
            yield Look("area", coloured(colour), _strokes(artist.get_hatch()))
            if isinstance(artist, Quiver):
                yield Look("line", coloured(colour), "solid")
                yield Look("mark", coloured(colour), "> filled")
        if not len(artist.get_facecolor()):
            for colour in np.unique(artist.get_edgecolor(), axis=0):
                yield Look("area", coloured(colour), "frame")


def _dash_patterns(lines: Any):
    """Dashes of a collection of lines, as they were asked for."""
    return lines._us_linestyles


def _looks_of_line(artist, coloured, drawn):
    if drawn and not np.isfinite(np.asarray(artist.get_xydata(), dtype=float)).all(axis=1).any():
        return
    if artist.get_linestyle() not in ("None", "", " ") and (
        not drawn or len(artist.get_xdata()) > 1
    ):
        yield Look("line", coloured(artist.get_color()), _dashes(artist._unscaled_dash_pattern))
    marker: Any = artist.get_marker()
    if marker not in ("None", "", None, " "):
        fill: Any = artist.get_markerfacecolor()
        symbol = "o" if marker == "." else str(marker)
        edge: Any = artist.get_markeredgecolor()
        if (isinstance(fill, str) and fill == "none") or np.allclose(to_rgba(fill)[:3], 1):
            yield Look("mark", coloured(edge), f"{symbol} hollow")
        else:
            is_stroke = marker in ("x", "+", "|", "_")
            yield Look("mark", coloured(edge if is_stroke else fill), f"{symbol} filled")


def _strokes(hatch):
    return "".join(sorted(set(hatch or "")))


def _dashes(pattern):
    _, lengths = pattern
    return "solid" if not lengths else " ".join(f"{length:g}" for length in lengths)


def print_figure_faults(campaigns):
    """Print every fault of the figures of some campaigns; the exit status says whether there is one."""
    count = 0
    for folder in campaigns:
        results = rftfit.open(folder)
        for figure in figures():
            for medium in () if figure.on_demand else figure.media(results.campaign):
                drawn = figure.draw(results, *filter(None, [medium]))
                for drawn_page in drawn if isinstance(drawn, list) else [drawn]:
                    faults = figure_faults(drawn_page)
                    count += len(faults)
                    for fault in faults:
                        print(f"{figure.file(medium)}: {fault}")
    print(f"{count} faults")
    return int(count > 0)


# --- Sentences of page, Methods and captions beside the records they rest on --------------------------------------


def texts(results):
    """Prose of the page, its Methods, and captions of all figures, by name."""
    has_page = results.has("report.html")
    whole = results.path("report.html").read_text(encoding="utf-8") if has_page else page(results)
    body = whole.partition("<main>")[2].partition('<script type="application/json"')[0]
    body, _, methods = body.partition('<section id="methods"')
    # tables and controls are no sentences; the calculator tells of what the user will type
    body = re.sub(
        r"<(table|figcaption|svg|form|noscript)\b.*?</\1>"
        r'|<section id="(calculator|reproduction)".*?</section>',
        "",
        body,
        flags=re.DOTALL,
    )
    parts = {"page": body, "methods": methods.partition("<ol>")[0]}
    prose = {name: html.unescape(re.sub(r"<[^>]+>", "", text)) for name, text in parts.items()}
    return prose | {
        figure.file(medium): figure.caption_of(results, medium)
        for figure in figures()
        if not figure.on_demand
        for medium in figure.media(results.campaign)
    }


class Records:
    """What a campaign has."""

    def __init__(self, results):
        campaign, self.results = results.campaign, results
        fits, legs = (results.joined(f"{name}/{{medium}}.csv") for name in ("fits", "legs"))
        self.fits = fits
        self.robot = bool(campaign.robot_medium)
        self.legs_stated = bool(results.config.legs)
        self.legs = len(legs) > 0
        flags = results.joined("flags/{medium}.csv")
        with_tare = {run.run_id for run in campaign.runs if run.tare_run}
        with_tare -= {*flags.loc[flags["code"] == "no-tare", "run_id"]}
        self.leg_tare = not with_tare.isdisjoint(legs["run_id"])
        self.tare = not with_tare.isdisjoint(fits["run_id"])
        self.alpha = results.joined("alpha/{medium}.csv")["alpha_z_N_per_cm3"].notna().any()
        self.recorded = not campaign.reenacted
        self.container = results.config.table is None
        self.sands = bool(results.sands)
        self.scaled = self._zeta().isin(results.sands).any()
        fitted = results.table("coefficients.csv")
        fitted = fitted[fitted["method"] == results.config.fourier.method]
        fitted = fitted[fitted["value_N_per_cm3"].notna()]
        self.nine = len(fitted) > 0
        self.dropped_terms = not fitted["kept"].all()
        self.several = fitted["medium"].nunique() > 2
        predicted = results.table("predicted.csv")
        ends = [
            results.joined("alpha/{medium}.csv")["alpha_z_lo_N_per_cm3"],
            predicted["force_z_lo_N"],
        ]
        self.intervals = any(column.notna().any() for column in ends)
        speed = self.of_robot("speed")
        simulated = speed[speed["speed_cm_per_s"].notna()]["profile"] if len(speed) else ()
        curves = predicted.groupby(["profile", "medium", "leg"])["force_z_N"]
        complete_curves = (curve for curve, force_N in curves if force_N.notna().all())
        self.profiles = {*(profile for profile, *_ in complete_curves), *simulated}
        errors = results.table("leg_errors.csv")
        errors = errors[errors["peak_error_percent"].notna()]
        self.errors = set(errors["profile"])
        self.of_alpha = not errors["peak_errors"].str.contains("hip|arc").any()
        robot_errors = self.of_robot("errors")
        self.calibrated = len(robot_errors) > 0 and bool(
            (robot_errors["calibrated"] == "yes").any()
        )
        self.measured_robot = len(robot_errors) > 0 and bool(
            robot_errors["measured_cm_per_s"].notna().any()
        )
        self.tipped = len(speed) > 0 and bool((speed["outcome"] == "tipped").any())
        self.trials = len(self.of_robot("tracks")) > 0
        self.strides = self.recorded and len(self.of_robot("strides")) > 0

    def _zeta(self):
        table = self.results.table("penetration.csv")
        return table.loc[table["zeta"].notna(), "medium"]

    def of_robot(self, name):
        return self.results.table(f"robot/{name}.csv") if self.robot else self.fits.iloc[:0]

    def moved(self, direction, where):
        """Whether there are plate runs of a direction in what a text is about."""
        fits = self.fits
        if where == "figures/stress_of_runs":
            fits = fits[fits["run_id"].isin(stress_runs(self.results.campaign))]
        medium = [name for name in self.results.media if where.endswith(f"_{name}")]
        fits = fits[fits["medium"] == medium[0]] if medium else fits
        return bool((fits["direction"] == direction).any())


SENTENCES: dict[str, Callable[[Records, str], object]] = {
    r"\brobot\b": lambda a, _: a.robot,
    r"[Hh]ollow points|unknown lengths": lambda a, _: a.calibrated,
    r"upside down|turns? .{0,12}over": lambda a, _: a.tipped,
    r"trials of the robot|deviation of trials": lambda a, _: a.trials,
    r"marker track, of four": lambda a, _: a.strides,
    r"\d measured conditions|[Pp]oints: measured|within 35 %": lambda a, _: a.measured_robot,
    r"lines through the points": lambda a, where: a.measured_robot or "robot" not in where,
    r"\blegs?\b": lambda a, _: a.legs_stated or a.robot,
    r"turned through|turned at|in air at|leg turned in air": lambda a, _: a.legs,
    r"in air at the same angle was sub|leg turned in air": lambda a, _: a.leg_tare,
    r"[Ee]xtraction": lambda a, where: a.moved("extraction", where),
    r"[Hh]orizontal (run\b|motion)": lambda a, where: a.moved("horizontal", where),
    r"without a plate, was|rod and the mount alone|(?<!No )(?<!no )(?<!no plate run has a )\btares?\b": lambda a, _: (
        a.tare
    ),
    r"wholly submerged|walls and bottom|container": lambda a, _: a.container,
    r"(?<!No )(?<!no )[Nn]ine([- ]term| terms| Fourier)": lambda a, _: a.nine,
    r"Terms in brackets": lambda a, _: a.dropped_terms,
    r"generic coefficients are the mean|all media lie": lambda a, _: a.several,
    r"(?<!No )(?<!no )depth-only": lambda a, where: (
        "depth_only" in a.profiles or "depth_only" in where
    ),
    r"map of alpha|by the map|[Tt]he map (is|pre)|with the map": lambda a, _: "map" in a.profiles,
    r"[Pp]redicted with the measured": lambda a, _: "table" in a.errors,
    r"[Pp]redicted with the map": lambda a, _: "map" in a.errors,
    r"interpolated (measured )?table|the measured table": lambda a, _: "table" in a.profiles,
    r"natural sand|Natural sands": lambda a, _: a.sands,
    r"further medium was scaled|sands were scaled": lambda a, _: a.scaled,
    r"error of peak lift|peak lift predicted|Error of the pred": lambda a, _: a.errors,
    r"shapes? of the legs": lambda a, _: "table" in a.profiles,
    r"follow from (those|the intervals) of": lambda a, _: a.of_alpha,
    r"\d % intervals": lambda a, _: a.intervals,
    r"were measured in": lambda a, _: a.recorded,
}
"""Words, and whether a campaign has what they tell of, by its records and the text that they stand in."""

METHODS: dict[str, Callable[[Records], object]] = {
    r"A legged robot": lambda a: a.robot and "table" in a.profiles,
    r"The map is α": lambda a: "map" in a.profiles,
    r"known beforehand": lambda a: "map" in a.profiles,
    r"turned at": lambda a: a.legs,
    r"nine-term": lambda a: a.nine,
    r"without a plate, was": lambda a: a.tare and a.alpha,
    r"interpolated from the measured table": lambda a: "table" in a.profiles,
}
"""Words that Methods have wherever the records have what they tell of."""


def untrue(results):
    """Sentences on what a campaign does not have, and what its Methods lack."""
    records, written = Records(results), texts(results)
    faults = [
        f"{name}: {' '.join(text[max(0, match.start() - 60) : match.end() + 40].split())!r}"
        for name, text in written.items()
        for words, condition in SENTENCES.items()
        if (match := re.search(words, text)) and not condition(records, name)
    ]
    return faults + [
        f"methods: no word of {words!r}"
        for words, condition in METHODS.items()
        if condition(records) and not re.search(words, written["methods"])
    ]


# --- Code blocks of the documentation, and what becomes of each of them -------------------------------------------
# A block of one of `LANGUAGES` is run, or checked, or says in a comment in front of it why not:
#
# - ``<!-- file: NAME -->``: it is the content of a file, which is there for the blocks below;
# - ``<!-- fails: CODE -->``: its last command ends with this exit code;
# - ``<!-- from: top -->``: it is run in the folder in which the page began;
# - ``<!-- output: above -->``: it is what the block above prints (``make gallery`` writes it anew);
# - ``<!-- run by: TEST FILE -->``: another test runs these commands;
# - ``<!-- not run: REASON -->``: one of `REASONS`.

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = ("sh", "bash", "console", "python", "yaml", "toml")
OTHERS = ("text", "powershell")
"""Languages of blocks that show something and are not meant for a reader to run here."""
SITE = "<!-- site"
"""First line of a comment with a directive for the build of the site (``docs/_ext/plain_sources.py``)."""
REASONS = ("needs root", "takes minutes", "network")

_FENCE = re.compile(r"^(`{3,}|~{3,})[ ]*(\{?[\w-]*\}?)(.*)$")
_ANY_FENCE = re.compile(r"^\s*(`{3,}|~{3,})")
_MARK = re.compile(r"^<!-- (file|fails|from|output|run by|not run): (.+?) -->$")


@dataclass(frozen=True)
class Block:
    """One fenced block."""

    page: str
    line: int
    language: str
    text: str
    marks: dict[str, str] = field(default_factory=dict)

    @property
    def place(self):
        return f"{self.page}, line {self.line}"


def pages():
    """Pages of the documentation and the README, from the project's folder."""
    paths = (path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
    return ["README.md", *sorted(name for name in paths if not name.startswith("docs/_"))]


def blocks_of(page, text=None):
    """Blocks of a page, in order; a fence that cannot be understood is an error."""
    lines = (ROOT / page).read_text(encoding="utf-8") if text is None else text
    blocks: list[Block] = []
    marks: dict[str, str] = {}
    opened: tuple[int, str, str] | None = None
    body: list[str] = []
    for number, line in enumerate(lines.splitlines(), start=1):
        if opened is not None:
            if line.strip() == opened[1]:
                blocks.append(Block(page, opened[0], opened[2], "\n".join(body) + "\n", marks))
                opened, marks, body = None, {}, []
            else:
                body.append(line)
        elif fence := _FENCE.match(line):
            opened = (number, fence[1], fence[2])
        elif _ANY_FENCE.match(line):
            raise AssertionError(f"{page}, line {number}: an indented fence escapes the tests")
        elif mark := _MARK.match(line):
            marks[mark[1]] = mark[2]
        elif line.startswith("<!--") and line != SITE:
            raise AssertionError(f"{page}, line {number}: no such mark: {line}")
        elif line.strip() and marks:
            raise AssertionError(f"{page}, line {number}: a mark without a block")
    assert opened is None, f"{page}: a block without end"
    return blocks


def fate(block):
    """What becomes of a block: run, checked, file, run by, not run, shown; empty if it escapes."""
    if block.language.startswith("{") or block.language in OTHERS:
        return "file" if "file" in block.marks else "shown"
    if block.language not in LANGUAGES:
        return ""
    for mark in ("not run", "run by", "file"):
        if mark in block.marks:
            return mark
    return "run" if block.language in ("sh", "bash", "console", "python") else "checked"


def without_progress(text):
    """What a page shows of what a command printed: no lines of progress."""
    return re.sub(r"(?m)^\[ *\d+/\d+\].*\n", "", text).strip()


def comparable(text):
    """A text without what differs from one run or computer to the next: seconds and commits."""
    return re.sub(r"\b\d+\.\d s\b|\b[0-9a-f]{12}\b\+?", "...", without_progress(text))


class Reader:
    """Somebody who follows a page from top to bottom, in a folder of their own.

    `scripts`: folder of the commands of Python packages. `programs`: PATH of all others.
    """

    def __init__(self, folder, scripts=None, programs=None):
        self.top = self.folder = folder / "work"
        self.folder.mkdir()
        self._state = folder / "here"
        scripts = scripts or Path(sys.executable).parent
        (self.folder / ".venv").mkdir()
        (self.folder / ".venv" / "bin").symlink_to(scripts, target_is_directory=True)
        path = f"{scripts}{os.pathsep}{programs or os.environ['PATH']}"
        self._env = {**os.environ, "PATH": path, "MPLBACKEND": "Agg"}
        self.transcript = self.printed = ""

    def follow(self, block):
        if "file" in block.marks:
            target = self.folder / block.marks["file"]
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
            return
        if "from" in block.marks:
            self.folder = self.top
        if block.language == "python":
            command = [sys.executable, "-c", block.text]
        else:
            text = re.sub(r"^\$ ", "", block.text, flags=re.MULTILINE)
            script = f"trap 'pwd > \"{self._state}\"' EXIT\n{text}"
            command = ["bash", "-euo", "pipefail", "-c", script]
        completed = subprocess.run(
            command,
            cwd=self.folder,
            env=self._env,
            check=False,
            text=True,
            encoding="utf-8",
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self.printed = completed.stdout
        self.transcript += completed.stdout
        expected_code = int(block.marks.get("fails", "0"))
        assert completed.returncode == expected_code, f"{block.place}:\n{completed.stdout}"
        assert "Traceback" not in completed.stdout, f"{block.place}:\n{completed.stdout}"
        if block.language != "python":
            self.folder = Path(self._state.read_text(encoding="utf-8").strip())


def print_faults(words):
    """Print what readers cannot find in figures, or what campaigns say of what they do not have."""
    subject, *folders = words
    if subject == "figures":
        return print_figure_faults(folders)
    for folder in folders:
        print(folder, *untrue(open_results(folder)), sep="\n    ")
    return 0


if __name__ == "__main__":
    sys.exit(print_faults(sys.argv[1:]))
