"""The check of figures finds each text, legend, axis and curve that a reader cannot read or find."""

from typing import Any

import numpy as np
import pytest
from pages import figure_faults, text_faults

from rftfit.figures import style


@style.styled()
def faults(*texts, above="", ticks=3):
    figure = style.new_figure(8, 5)
    axes = style.axes_cm(figure, 1, 1, 6, 3)
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[i / ticks for i in range(-5, ticks + 1)])
    for x, y, text in texts:
        figure.text(x, y, text)
    if above:
        style.mark(figure, [above])
    style.content(figure, "svg")
    return text_faults(figure)


@pytest.mark.parametrize(
    ("place", "fault"),
    [
        ((0.32, 0.5), "'here' lies over 'there'"),
        ((0.98, 0.7), "'there' leaves the figure"),
        ((0.5, -0.02), "'there' leaves the figure"),
        ((0.05, 0.78), "'there' lies over '1.0'"),
    ],
)
def test_an_overlap_and_an_overflow_are_found(place, fault):
    assert faults((0.3, 0.5, "here"), (*place, "there")) == [fault]


def test_what_stands_above_a_figure_belongs_to_it():
    assert faults((0.3, 0.5, "here"), above="poppy seeds: doubtful") == []
    assert faults((0.3, 1.02, "here"), above="poppy seeds: doubtful") != []


@style.styled()
def plain_figure(entries, xlabel="depth (cm)", ylabel="force (N)"):
    """A blue curve, vermillion dots, a grey band and hatched bars, with a legend."""
    figure = style.new_figure(9, 7)
    axes = style.axes_cm(figure, 1, 1, 6, 3)
    x = np.linspace(0, 1, 11)
    axes.plot(x, x, color=style.OKABE_ITO["blue"])
    axes.plot(x, 1 - x, "o", color=style.OKABE_ITO["vermillion"], alpha=0.7)
    axes.fill_between(x, x / 2, x, color="#888888", alpha=0.4, linewidth=0)
    axes.axvspan(0.2, 0.3, facecolor="white", edgecolor="#222222", hatch="//")
    axes.set(xlabel=xlabel, ylabel=ylabel, xlim=(0, 1.1), ylim=(0, 1.1))
    style.legend(figure, entries)
    return figure


GOOD_ENTRIES: dict[str, Any] = {
    "predicted": style.line(style.OKABE_ITO["blue"]),
    "measured": style.dots(style.OKABE_ITO["vermillion"], 3),
    "interval": style.band(0.4),
    "hatched": style.patch(facecolor="white", edgecolor="#222222", hatch="////"),
}


def test_a_figure_whose_legend_is_drawn_has_no_fault():
    assert figure_faults(plain_figure(GOOD_ENTRIES)) == []


@pytest.mark.parametrize(
    ("handle", "fault"),
    [
        (style.line("black"), "is not drawn"),
        (style.line(style.OKABE_ITO["blue"], linestyle="--"), "is not drawn"),
        (style.dots(style.OKABE_ITO["vermillion"], 3, markerfacecolor="white"), "is not drawn"),
        (style.line(style.OKABE_ITO["vermillion"], marker="s", linestyle=""), "is not drawn"),
        (style.band(0.8), "is not drawn"),
        (style.patch(facecolor="white", edgecolor="#222222", hatch="xx"), "is not drawn"),
        (style.bands(["#888888", "#000000"]), "is not drawn"),
        (style.line("none", linestyle=""), "shows nothing"),
        (style.line("#0072B4"), "looks like"),
    ],
)
def test_an_entry_that_is_not_drawn_or_has_a_double_is_found(handle, fault):
    faults_of_legend = figure_faults(plain_figure({**GOOD_ENTRIES, "further": handle}))
    assert faults_of_legend
    assert all("further" in text for text in faults_of_legend)
    assert any(fault in text for text in faults_of_legend)


@style.styled()
def two_lines(looks, beside=False):
    """Two straight lines, in one axes or in two side by side, with a legend."""
    figure = style.new_figure(16, 7)
    left, right = (style.axes_cm(figure, x, 1, 5, 3) for x in (1, 9))
    for axes, look, rise in zip((left, right if beside else left), looks, (0.5, 0.9), strict=True):
        axes.plot([0, 1], [0, rise], look.get("linestyle", "-"), color=look["color"])
    for axes in (left, right):
        axes.set(xlabel="depth (cm)", ylabel="force (N)", xlim=(0, 1.1), ylim=(0, 1.1))
    style.legend(figure, {name: style.line(**look) for name, look in zip("ab", looks, strict=True)})
    return figure


BLUE, RED = ({"color": style.OKABE_ITO[name]} for name in ("blue", "vermillion"))


@pytest.mark.parametrize(
    ("looks", "beside", "faults_found"),
    [
        ((BLUE, RED), False, 1),
        ((BLUE, RED), True, 0),
        ((BLUE, RED | {"linestyle": "--"}), False, 0),
        (tuple({"color": style.COMPONENT_COLOURS[c]} for c in "zx"), False, 0),
        (tuple({"color": style.PALE_COLOURS[c]} for c in "zx"), False, 0),
    ],
)
def test_lines_of_one_axes_that_a_grey_print_makes_alike_are_found(looks, beside, faults_found):
    told = figure_faults(two_lines(looks, beside))
    assert len(told) == faults_found
    assert all("grey" in fault for fault in told)


@pytest.mark.parametrize(
    ("titles", "faults_found"),
    [
        ({"xlabel": ""}, 1),
        ({"xlabel": "depth"}, 1),
        ({"xlabel": "depth (far)", "ylabel": ""}, 2),
        ({"xlabel": "share (%)"}, 0),
        ({"ylabel": r"half width (10$^{-3}$ N/cm$^3$)"}, 0),
    ],
)
def test_an_axis_without_a_title_or_a_unit_is_found(titles, faults_found):
    assert len(figure_faults(plain_figure(GOOD_ENTRIES, **titles))) == faults_found


@pytest.mark.parametrize(
    ("draw", "side"),
    [
        (lambda axes: axes.plot([0.5, 0.6], [0.5, 1.2], color="black"), "above"),
        (lambda axes: axes.plot([-0.2], [0.5], "o", color="black"), "left"),
        (lambda axes: axes.plot([1.1], [0.5], "o", color="black", clip_on=False), "right"),
        (lambda axes: axes.vlines([0.5], -0.3, 0.4, color="black"), "below"),
        (lambda axes: axes.fill_between([0, 1], [0, 0], [1.3, 0.5]), "above"),
        (lambda axes: axes.scatter([1.2], [0.5]), "right"),
        (lambda axes: axes.axvline(0.5), ""),
        (lambda axes: axes.axhspan(0.2, 0.4), ""),
        (lambda axes: axes.plot([0.0], [0.5], "o", color="black"), ""),
    ],
)
def test_what_leaves_its_axes_is_found(draw, side):
    figure = plain_figure({})
    (axes,) = figure.axes
    draw(axes)
    axes.set(xlim=(0, 1.1), ylim=(0, 1.1))
    sides = [
        text.rpartition(": ")[2] for text in figure_faults(figure) if "leaves the axes" in text
    ]
    assert sides == [side] * bool(side)
