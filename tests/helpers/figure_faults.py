"""What a reader of a figure cannot find or read: texts, legends, titles of axes, what leaves its axes.

python tests/helpers/figure_faults.py CAMPAIGN...      draws every figure of campaigns whose workflow has run
"""

import itertools
import re
import sys
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, PathCollection
from matplotlib.colors import to_rgba
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.offsetbox import DrawingArea, HPacker, TextArea
from matplotlib.patches import Patch
from matplotlib.quiver import Quiver
from matplotlib.spines import Spine
from text_boxes import laid_out, text_faults

import rftfit
from rftfit.figures import style
from rftfit.figures.registry import figures

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


# Titles of axes


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
    """What a reader would call an axes: its title or the title of an axis, else its place."""
    names = (axes.get_title(), axes.get_title(loc="left"), axes.get_ylabel(), axes.get_xlabel())
    name = next((" ".join(name.split()) for name in names if name), "")
    box = axes.get_position()
    return f"{name or 'axes'} at {box.x0:.2f}, {box.y0:.2f}"


# What leaves its axes


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
        sides = [
            side
            for side, passes in zip(
                ("left", "below", "right", "above"),
                (*(low < frame[:2] - over), *(high > frame[2:] + over)),
                strict=True,
            )
            if passes
        ]
        if sides:
            faults.append(
                f"{_name_of(axes)}: {type(artist).__name__} in {_colour_name(artist)} leaves the axes: {', '.join(sides)}"
            )
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


def _colour_name(artist):
    colour = (
        artist.get_color()
        if isinstance(artist, Line2D)
        else next(iter([*artist.get_facecolor(), *artist.get_edgecolor()]), None)
        if isinstance(artist, Collection)
        else artist.get_facecolor()
    )
    if colour is None:
        return "no colour"
    red, green, blue, _ = to_rgba(colour)
    return "#" + "".join(f"{round(255 * part):02x}" for part in (red, green, blue))


# Legends: each entry is drawn, and looks unlike the others


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
        missing = [look for look in looks if not any(look.is_like(drawn) for drawn in drawn_looks)]
        faults += [
            f"legend: {name!r} shows a {look.form} {look.detail} {_hex(look)} that is not drawn"
            for look in missing
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


def _hex(look):
    red, green, blue, opacity = look.colour
    return (
        "#"
        + "".join(f"{round(255 * part):02x}" for part in (red, green, blue))
        + f" ({opacity:.2f})"
    )


def _differ(looks, other_looks):
    """Whether two entries can be told apart by form, detail or colour."""
    if {(look.form, look.detail) for look in looks} != {
        (look.form, look.detail) for look in other_looks
    }:
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


def main(campaigns):
    """Print every fault of the figures of some campaigns; the exit status says whether there is one."""
    count = 0
    for folder in campaigns:
        results = rftfit.open(folder)
        for figure in figures():
            for medium in figure.media(results.campaign):
                if figure.on_demand:
                    continue
                drawn = figure.draw(results, *filter(None, [medium]))
                faults = [
                    f
                    for page in (drawn if isinstance(drawn, list) else [drawn])
                    for f in figure_faults(page)
                ]
                count += len(faults)
                for fault, repeats in sorted({f: faults.count(f) for f in faults}.items()):
                    print(
                        f"{figure.file(medium)}: {fault}{f' ({repeats} times)' if repeats > 1 else ''}"
                    )
    print(f"{count} faults")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
