"""Runs are numbered by direction and by repeat in one way, however their angles were typed or measured."""

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rftfit
from rftfit.directions import (
    TOLERANCE_DEG,
    angles_of_directions,
    is_straight_down,
    number_depths,
    number_directions,
    number_rows,
    same_direction,
)

ANGLES = st.lists(st.sampled_from([-90, -60, 0, 0.3, 0.5, 0.8, 30, 30.2, 89.8, 90]), min_size=1)


def numbered(beta_deg, gamma_deg=None, tolerance_deg=TOLERANCE_DEG, **options):
    gamma_deg = [45] * len(beta_deg) if gamma_deg is None else gamma_deg
    angles_deg = np.array([beta_deg, gamma_deg], dtype=float)
    return number_directions(*angles_deg, tolerance_deg, **options).tolist()


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


def test_a_campaign_states_its_own_tolerance():
    assert numbered([0, 0.8], tolerance_deg=1.0) == [1, 1]
    assert numbered([0, 0.2], tolerance_deg=0.1) == [0, 1]
    assert same_direction(0, 0, 0.5, -0.5, TOLERANCE_DEG)
    assert not same_direction(0, 0, 0.5, -0.6, TOLERANCE_DEG)


def test_depth_parts_level_runs_alone():
    gamma_deg, depth_cm = [0, 0, 0, 0.2, 90, 90], [2.0, 5.0, 2.05, 5.0, 2.0, 5.0]
    assert numbered([30] * 6, gamma_deg, depth_cm=depth_cm) == [0, 1, 0, 1, 4, 4]
    assert numbered([30] * 6, gamma_deg) == [0, 0, 0, 0, 4, 4]
    assert numbered([30, 30], [0, 0], depth_cm=[math.nan, 2.0]) == [0, 1]
    assert numbered([30, 30, 30], [0, 0, 0], depth_cm=[2.0, math.nan, math.nan]) == [0, 1, 1]
    assert number_depths(np.array([5.0, 2.0, 2.1, 2.19])).tolist() == [1, 0, 0, 0]


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


def test_rows_are_numbered_as_their_angles_are():
    table = pd.DataFrame(
        {"beta_deg": [0.0, 30.1, 30.0, 30.0], "gamma_deg": [90.0, 44.8, 45.0, 45.0]}
    )
    assert number_rows(table, TOLERANCE_DEG).tolist() == [0, 2, 2, 2]
    assert number_rows(table, tolerance_deg=0.1).tolist() == [0, 1, 2, 2]


@pytest.mark.parametrize(
    ("beta_deg", "gamma_deg", "is_down"),
    [(0, 90, True), (-0.5, 90.5, True), (0.6, 90, False), (180, 90, True), (0, -90, False)],
)
def test_a_level_plate_moves_straight_down_within_the_tolerance(beta_deg, gamma_deg, is_down):
    assert is_straight_down(beta_deg, gamma_deg, TOLERANCE_DEG) == is_down
    assert is_straight_down(1.5, 90, tolerance_deg=2.0)
