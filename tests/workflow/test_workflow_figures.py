"""A figure that has nothing to show says so in words and has no caption."""

import numpy as np
import pytest
from text_boxes import words

import rftfit
from rftfit.figures.registry import Declared, figures
from rftfit.results import Results

pytestmark = pytest.mark.slow

CAN_LACK = [
    figure
    for figure in figures()
    if figure.lacking is not Declared.lacking and not figure.on_demand
]
"""Figures that can lack their input."""


@pytest.fixture
def without_rows(small_made):
    """Results of a campaign, the tables that a figure reads without their rows; only read."""
    results_of_all = rftfit.open(small_made.root)

    def empty(declared):
        results = Results(results_of_all.campaign)
        places = {
            "media": results_of_all.media,
            "laboratory": results_of_all.laboratory,
            "sands": results_of_all.sands,
        }
        for path in declared.reads:
            word = path.partition("{")[2].partition("}")[0]
            for name in (
                places.get(word, declared.media(results_of_all.campaign)) if word else ("",)
            ):
                table = path.replace(f"{{{word}}}", name)
                results.hold(table, emptied(results_of_all.table(table)))
        return results

    def emptied(table):
        alpha = [name for name in table if str(name).startswith("alpha_")]
        # an alpha table has a row for each direction of the grid, with or without a number
        return table.assign(**dict.fromkeys(alpha, np.nan)) if "n_runs" in table else table[:0]

    return empty


def test_most_figures_can_lack_their_input():
    assert len(CAN_LACK) >= 15


@pytest.mark.parametrize("declared", CAN_LACK, ids=lambda figure: figure.name)
def test_what_is_lacking_is_drawn_and_has_no_caption(declared, without_rows):
    results = without_rows(declared)
    if not (media := declared.media(results.campaign)):
        pytest.skip("the campaign has no such figure")
    medium_words = [media[0]] if media[0] else []
    lacking = declared.lacking(results, media[0])
    assert lacking
    drawn = declared.draw(results, *medium_words)
    assert lacking[0] in " ".join(words(drawn))
    assert declared.caption_of(results, media[0]) == ""
    results_of_all = rftfit.open(results.root)
    assert bool(declared.caption_of(results_of_all, media[0])) != bool(
        declared.lacking(results_of_all, media[0])
    )
