"""The check of a figure's texts finds each one that leaves the figure or lies over another."""

import pytest
from text_boxes import text_faults

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


def test_texts_apart_are_no_fault():
    assert faults((0.3, 0.5, "here"), (0.6, 0.5, "there"), (0.3, 0.4, "below")) == []


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


def test_numbers_of_an_axis_that_run_together_are_found():
    assert any("lies over" in fault for fault in faults(ticks=40))


def test_what_stands_above_a_figure_belongs_to_it():
    assert faults((0.3, 0.5, "here"), above="poppy seeds: doubtful") == []
    assert faults((0.3, 1.02, "here"), above="poppy seeds: doubtful") != []
