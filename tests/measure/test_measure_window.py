"""The fit window has the limits that are computed by hand for the paper's plate and container."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from paper import paper_config

from rftfit.campaign.config import Fit
from rftfit.measure.fits import classify_samples
from rftfit.measure.ledger import RowStatus

CONFIG = paper_config()
PLATE, BOX = CONFIG.intruders["plate"], CONFIG.container
EDGE = 1e-6
"""A little more or less than a limit, cm."""

# by hand, of a plate of 3.81 cm by 0.64 cm in a box of 24 cm by 15 cm: half length 1.905, half thickness 0.32; bottom 15 - 6 = 9, wall 12 - 6 = 6
HAND = [
    (0, 0.32, 8.68, 4.095),
    (30, 1.229628, 7.770372, 4.190222),
    (-30, 1.229628, 7.770372, 4.190222),
    (90, 1.905, 7.095, 5.68),
    (-90, 1.905, 7.095, 5.68),
]
"""Beta, least and greatest depth, greatest distance from the middle, cm."""


def whys(depth, x, beta_deg, fit, direction="intrusion", path=0.0, to=None, plate=PLATE):
    depth, x, path = (values + np.zeros(len(depth)) for values in map(np.array, (depth, x, path)))
    run: Any = SimpleNamespace(beta_deg=beta_deg, direction=direction)
    stroke: Any = SimpleNamespace(depth=depth, x=x, path=path)
    codes = classify_samples(run, stroke, plate, BOX, fit, to)
    return [RowStatus(code).name for code in codes]


@pytest.mark.parametrize(("beta_deg", "shallow", "deep", "wide"), HAND)
def test_slanted(beta_deg, shallow, deep, wide):
    depth = [shallow - EDGE, shallow + EDGE, deep - EDGE, deep + EDGE]
    assert whys(depth, [0] * 4, beta_deg, Fit()) == ["ABOVE", "GOOD", "GOOD", "BOTTOM"]
    across = [-wide - EDGE, -wide + EDGE, wide - EDGE, wide + EDGE]
    assert whys([4.0] * 4, across, beta_deg, Fit()) == ["WALL", "GOOD", "GOOD", "WALL"]


def test_above_counts_before_wall_and_bottom():
    assert whys([-1.0, 9.0], [9.0, 9.0], 0, Fit()) == ["ABOVE", "BOTTOM"]


def test_overrides():
    fit = Fit(submergence_cm=2.0, max_depth_cm=5.0)
    assert whys([1.9, 2.1, 4.9, 5.1], [0] * 4, 90, fit) == [
        "TOO_SHALLOW",
        "GOOD",
        "GOOD",
        "TOO_DEEP",
    ]
    # who states a greatest depth knows how near the bottom it may be
    assert whys([8.9, 9.1], [0, 0], 0, Fit(max_depth_cm=9.0)) == ["GOOD", "TOO_DEEP"]
    assert whys([8.9, 9.1], [0, 0], 0, Fit(submergence_cm=2.0)) == ["BOTTOM", "BOTTOM"]
    near = Fit(wall_clearance_cm=2.0)
    assert whys([12.67, 12.69], [0, 0], 0, near) == ["GOOD", "BOTTOM"]
    assert whys([4, 4], [8.09, 8.1], 0, near) == ["GOOD", "WALL"]


def test_horizontal():
    x, travel = [4.0, 2.0, 2.0, -4.1, 4.1], [0.0, 1.99, 2.01, 7.0, 1.0]
    statuses = whys([5.0] * 5, x, 0, Fit(), "horizontal", travel)
    assert statuses == ["STARTUP", "STARTUP", "GOOD", "WALL", "STARTUP"]


def test_linear_regime_of_a_sand():
    assert whys([-0.01, 0, 2.0, 2.01], 0.0, 0, Fit(), to=2.0) == [
        "ABOVE",
        "GOOD",
        "GOOD",
        "NONLINEAR",
    ]


def test_a_sand_keeps_to_the_stated_window():
    stated = Fit(submergence_cm=0.5, max_depth_cm=1.5)
    statuses = whys([0.4, 0.6, 1.4, 1.6, 2.1], 0.0, 0, stated, to=2.0)
    assert statuses == ["TOO_SHALLOW", "GOOD", "GOOD", "TOO_DEEP", "TOO_DEEP"]


def test_the_clearance_is_kept_and_the_plate_submerged_at_the_very_ends():
    # numbers that binary fractions hold: half length 2, half thickness 0.25; wall 12 - 6 - 2
    plate = PLATE.model_copy(update={"length_cm": 4.0, "thickness_cm": 0.5})
    ends = [0.25, 8.75, 4.0, 4.0], [0.0, 0.0, -4.0, 4.0]
    assert whys(*ends, 0, Fit(), plate=plate) == ["GOOD", "GOOD", "GOOD", "GOOD"]
    level = whys([4.0, 4.0], [-4.0, 4.0], 0, Fit(), "horizontal", 2.0, plate=plate)
    assert level == ["GOOD", "GOOD"]
    assert whys([0.5, 1.5], 0.0, 0, Fit(submergence_cm=0.5, max_depth_cm=1.5), to=2.0) == [
        "GOOD",
        "GOOD",
    ]
