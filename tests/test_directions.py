"""Runs are numbered by direction and by repeat in one way, however their angles were typed or measured."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rftfit
from rftfit.directions import (
    TOLERANCE_DEG,
    angles_of_directions,
    is_straight_down,
    number_directions,
)

ANGLES = st.lists(st.sampled_from([-90, -60, 0, 0.3, 0.5, 0.8, 30, 30.2, 89.8, 90]), min_size=1)


def numbered(beta_deg):
    angles_deg = np.array([beta_deg, [45] * len(beta_deg)], dtype=float)
    return number_directions(*angles_deg, TOLERANCE_DEG).tolist()


@pytest.mark.parametrize(
    ("beta_deg", "number"),
    [
        ([0, 0.5, 0.51], [0, 2, 2]),
        # a chain of small steps: the angle that most runs have takes what is near
        ([0, 0.4, 0.8], [0, 2, 2]),
        ([0, 0.4, 0.4, 0.8], [1, 1, 1, 1]),
        ([44.98, 45, 45], [1, 1, 1]),
        # plates at -90 and 90 degrees are one
        ([-90, 90, 89.7], [1, 1, 1]),
    ],
)
def test_directions_within_the_tolerance_are_one(beta_deg, number):
    assert numbered(beta_deg) == number


@given(ANGLES, st.randoms())
def test_the_order_of_runs_parts_no_direction(beta_deg, luck):
    order = list(range(len(beta_deg)))
    luck.shuffle(order)
    plain, shuffled = numbered(beta_deg), numbered([beta_deg[run] for run in order])
    pairs = {(plain[run], shuffled[place]) for place, run in enumerate(order)}
    assert len(pairs) == len(set(plain)) == len(set(shuffled))


@given(ANGLES)
def test_a_direction_has_the_mean_angles_of_its_runs(beta_deg):
    beta_of_run = np.array(beta_deg, dtype=float)
    gamma_of_run = np.linspace(0, 0.4, beta_of_run.size)
    number = number_directions(beta_of_run, gamma_of_run, TOLERANCE_DEG)
    beta, gamma = angles_of_directions(number, beta_of_run, gamma_of_run)
    for direction in set(number.tolist()):
        is_member = number == direction
        off_deg = (beta_of_run[is_member] - beta[is_member][0] + 90) % 180 - 90
        assert abs(off_deg.sum()) < 1e-9
        assert np.ptp(beta[is_member]) < 1e-9
        assert gamma[is_member][0] == pytest.approx(gamma_of_run[is_member].mean())


def test_no_other_place_says_which_rows_are_of_one_direction():
    """Rows grouped by their exact angles would part repeats whose angles were measured."""
    by_angles = re.compile(r"groupby\(\s*\[[^\]]*beta_deg[^\]]*gamma_deg")
    sources = {path: path.read_text("utf-8") for path in Path(rftfit.__file__).parent.rglob("*.py")}
    assert len(sources) > 200
    assert not [path.name for path, source in sources.items() if by_angles.search(source)]
    assert by_angles.search('fits.groupby(["beta_deg", "gamma_deg"])')


@pytest.mark.parametrize(
    ("beta_deg", "gamma_deg", "is_down"),
    [(0, 90, True), (-0.5, 90.5, True), (0.6, 90, False), (180, 90, True), (0, -90, False)],
)
def test_a_level_plate_moves_straight_down_within_the_tolerance(beta_deg, gamma_deg, is_down):
    assert is_straight_down(beta_deg, gamma_deg, TOLERANCE_DEG) == is_down
    assert is_straight_down(1.5, 90, tolerance_deg=2.0)
