"""A figure that says why there is nothing to draw."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from rftfit.report import labels, style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

_LINE_CM, _MARGIN_CM = 0.38, 0.4


@style.styled
def draw_missing(what: str, reasons: Sequence[str] = ()) -> Figure:
    """Write what is missing and why, where a figure would stand.

    Parameters
    ----------
    what : str
    reasons : sequence of str, optional
        One line each, broken where it is long.

    Returns
    -------
    matplotlib.figure.Figure
    """
    lines = [line for text in (what, *reasons) for line in textwrap.wrap(text, 110)]
    figure = style.new_figure(style.DOUBLE_CM, 2 * _MARGIN_CM + len(lines) * _LINE_CM)
    for row, line in enumerate(lines):
        top = _MARGIN_CM + row * _LINE_CM
        style.text_cm(figure, _MARGIN_CM, top, labels.plain(line), va="top", fontsize=7)
    return figure
