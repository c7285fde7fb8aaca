"""A run that deviates from the others of its medium is found, and sound runs are not flagged."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from seeds import seeds

from rftfit import published_reference, published_table
from rftfit.compare.peers import compare_runs, may_switch, outlier_differences
from rftfit.directions import TOLERANCE_DEG

MEDIA = published_reference().media
ALPHA = ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]


def fits(rows, depth=math.nan):
    """Runs r0, r1 and so on of beta, gamma, alpha_z, alpha_x, all with the same error."""
    table = pd.DataFrame(rows, columns=["beta_deg", "gamma_deg", *ALPHA])
    errors = {f"alpha_{c}_se_N_per_cm3": 0.003 for c in "zx"}
    return table.assign(run_id=[f"r{n}" for n in range(len(rows))], depth_from_cm=depth, **errors)


def published(medium):
    """Every cell of the table of a medium, as one run each."""
    table = published_table("table_s5")
    table = table[(table["medium"] == medium) & (table["beta_deg"] > -90)]
    return [*table[["beta_deg", "gamma_deg", *ALPHA]].itertuples(index=False, name=None)]


@pytest.mark.parametrize("medium", MEDIA)
def test_nothing_stands_apart_in_the_published_tables(medium):
    peers = compare_runs(fits(published(medium)), medium)
    assert set(peers["beside"]) == {"map"}
    assert np.isfinite(peers["times_spread"]).all()
    assert not peers["apart"].any()


@pytest.mark.statistics
@pytest.mark.parametrize("repeats", [1, 3])
@pytest.mark.parametrize("medium", MEDIA[:2])
def test_what_is_seen_is_what_is_said_to_be_seen(medium, repeats):
    """A run stands apart where it is off by more than the stated share of the largest alpha, and only there."""
    luck = np.random.default_rng(5)
    cells = np.repeat([row for row in published(medium) if row[0] % 60 == 0], repeats, axis=0)
    cells[:, 2:] *= luck.normal(1, 0.05, (len(cells), 1))
    sound = compare_runs(fits(cells), medium)
    assert not sound["apart"].any()
    # where grains may flow to either side, a force across the motion that changes its sign is as large as before
    places = np.flatnonzero(~may_switch(fits(cells), TOLERANCE_DEG))[:: seeds(3, 12)]
    largest = np.abs(cells[:, 2:]).max()
    apart_by_times: dict[float, list[bool]] = {0.6: [], 1.4: []}
    for times, are_apart in apart_by_times.items():
        for place in places:
            row: Any = sound.loc[place]
            off = cells.copy()
            # farther from the others, on the side where it is already
            side = math.copysign(1, row["off_z_ratio"])
            off[place, 2] = (
                row["others_z_N_per_cm3"] + side * times * largest * row["seen_from_ratio"]
            )
            peers = compare_runs(fits(off), medium)
            are_apart.append(bool(peers.loc[place, "apart"]))
    assert not any(apart_by_times[0.6])
    assert all(apart_by_times[1.4])


@pytest.mark.parametrize(
    ("values", "which"),
    [
        ((0.30, 0.31, 0.29), []),
        ((0.30, 0.31, 0.60), ["r2"]),
        ((0.30, 0.10, 0.31), ["r1"]),
        # 5.0 times 6 % of 0.30 off, and 7.7
        ((0.30, 0.30, 0.390), []),
        ((0.30, 0.30, 0.440), ["r2"]),
    ],
)
def test_one_of_three_repeats(values, which):
    peers = compare_runs(fits([(0.0, 90.0, value, 0.0) for value in values]), "m")
    assert set(peers["beside"]) == {"repeats"}
    assert peers["n_others"].tolist() == [2, 2, 2]
    assert peers.loc[peers["apart"], "run_id"].tolist() == which
    other_medians = [np.median(np.delete(values, index)) for index in range(3)]
    np.testing.assert_allclose(peers["others_z_N_per_cm3"], other_medians)
    largest = max(values)
    np.testing.assert_allclose(peers["off_z_ratio"], (np.array(values) - other_medians) / largest)
    # fewer than 24 runs: 6 % of alpha, and of 8 % of the largest
    level = np.hypot(np.median(values), 0.08 * largest)
    times = np.abs(np.array(values) - other_medians) / level / 0.06
    np.testing.assert_allclose(peers["times_spread"], times)
    assert outlier_differences(peers) == {
        run: (values[index] - other_medians[index], 0.0) for run in which for index in [int(run[1])]
    }


@pytest.mark.parametrize(("x", "of_x"), [(0.1, 0.0), (math.nan, math.nan)])
def test_a_component_that_nobody_measured_hides_no_outlier(x, of_x):
    peers = compare_runs(fits([(30.0, 90.0, value, x) for value in (0.30, 0.61, 0.31)]), "m")
    assert peers.loc[peers["apart"], "run_id"].tolist() == ["r1"]
    assert (peers["times_spread"] > 0).all()
    np.testing.assert_allclose(peers["off_x_ratio"], of_x)
    assert np.isfinite(peers["seen_from_ratio"]).all()


def test_too_few_runs_say_nothing():
    peers = compare_runs(fits(published("poppy_LP")[20:25]), "m")
    assert np.isnan(peers["times_spread"]).all()
    assert not peers["apart"].any()
    empty: Any = compare_runs(fits([(0.0, 90.0, math.nan, math.nan)]), "m")
    assert (list(empty), len(empty), outlier_differences(empty)) == (list(peers), 0, {})


def test_level_runs_of_another_depth_are_no_repeats():
    runs = fits([(0.0, 0.0, 0.1, 0.2)] * 4)
    assert (compare_runs(runs.assign(depth_from_cm=2.54), "m")["n_others"] == 3).all()
    deeper = compare_runs(runs.assign(depth_from_cm=[2.54, 2.55, 5.08, 7.62]), "m")
    assert deeper["n_others"].tolist() == [1, 1, 0, 0]


def pairs_of(medium, count=12, spread=0.04, repeats=2):
    """Rows of directions pushed twice or more often, whose beds differ."""
    cells = [cell for cell in published(medium) if math.hypot(*cell[2:]) > 0.1][:: 78 // count][
        :count
    ]
    beds = np.random.default_rng(2).normal(1, spread, (len(cells), repeats))
    return [
        (*cell[:2], bed * cell[2], bed * cell[3])
        for cell, beds_of_cell in zip(cells, beds, strict=True)
        for bed in beds_of_cell
    ]


@pytest.mark.parametrize(("second", "is_apart"), [(0.30, False), (0.38, True)])
def test_a_pair_alone_is_judged_by_the_usual_spread_of_beds(second, is_apart):
    first = 0.25
    peers = compare_runs(fits([(0.0, 90.0, first, 0.0), (0.0, 90.0, second, 0.0)]), "m")
    level = math.hypot((first + second) / 2, 0.08 * second)
    unit = math.sqrt(2 * 0.05**2 + 2 * (0.006 * second / level) ** 2)
    times = (second - first) / level / unit
    assert peers["times_spread"].tolist() == pytest.approx([times] * 2)
    assert peers["apart"].tolist() == [times > 5.0] * 2 == [is_apart] * 2
    seen = 5.0 * unit * level / second
    assert peers["seen_from_ratio"].tolist() == pytest.approx([seen] * 2)


def test_the_two_largest_of_many_pairs_stand_apart_together():
    """Each alone would be no more than chance explains."""
    cells = [(float(beta), 90.0) for beta in range(-80, 81, 10)]
    beds = np.random.default_rng(1).normal(1, 0.035, (len(cells), 2))
    alone, together = beds.copy(), beds.copy()
    alone[4] = together[4] = 1.105, 0.9
    together[10] = 0.9, 1.1
    for factors, pairs in ((alone, []), (together, [4, 10])):
        rows = [
            (*cell, 0.3 * bed, 0.0)
            for cell, beds_of_cell in zip(cells, factors, strict=True)
            for bed in beds_of_cell
        ]
        peers = compare_runs(fits(rows), "m")
        assert 3.3 < peers["times_spread"].max() < 4.5
        expected = [f"r{2 * pair + run}" for pair in pairs for run in (0, 1)]
        assert peers.loc[peers["apart"], "run_id"].tolist() == expected


def test_a_component_that_one_of_two_lacks_parts_no_pair():
    rows = pairs_of("poppy_LP")
    rows[4] = (*rows[4][:3], math.nan)
    peers = compare_runs(fits(rows), "poppy_LP")
    assert not peers["apart"].any()
    assert peers["times_spread"][4] == peers["times_spread"][5] < 3


def test_a_wrong_run_widens_no_limit():
    """Limits rest on a median, which one wrong run does not move."""

    def limits(rows):
        largest = np.abs(np.array(rows)[:, 2:]).max()
        return compare_runs(fits(rows), "poppy_LP")["seen_from_ratio"] * largest

    sound = pairs_of("poppy_LP", 26, repeats=3)
    beta_deg, gamma_deg, *alpha = sound[6]
    wrong = [*sound[:6], (beta_deg, gamma_deg, *(2 * np.array(alpha))), *sound[7:]]
    assert (limits(wrong) < 1.05 * limits(sound)).all()
