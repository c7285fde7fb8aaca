"""Texts of a figure that lie over one another or stick out of it, by the renderer's own boxes."""

import contextlib
import io
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.text import Text

from rftfit.figures import style

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
