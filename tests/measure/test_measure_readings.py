"""Wrong single readings, codes for no data and held positions are left out, and true ones are kept.

Held: repeated by the logger until a new value arrives.
"""

from pathlib import Path

import numpy as np
import pytest
from makers import MadePush
from pushes import (
    N_PER_CM,
    RATE_HZ,
    SPEED_CM_PER_S,
    crust,
    irregular_slip,
    push,
    slip_among_stones,
    stick_slip,
    stones,
)
from seeds import seeds

from rftfit.campaign.spikes import (
    find_held,
    find_lone_positions,
    find_plateau,
    find_spikes,
    find_steps,
)
from rftfit.logs.base import Log
from rftfit.measure.readings import without_holds


def log_of(**columns):
    return Log(
        Path("push.csv"), columns, dict.fromkeys(columns, "N"), next(iter(columns.values())).size
    )


BAD = {
    "zeros": lambda _, force: np.zeros(force.size),
    "a code": lambda _, force: np.full(force.size, -99.99),
    "full bits": lambda random, force: 2.0 ** random.integers(12, 24, force.size) / 4200,
    "100 N too much": lambda _, force: force + 100.0,
}
"""Kind of wrong readings to what stands in place of the force."""


def slope_of(height, readings):
    """Slope of the force below 1 cm of depth, relative to the true one."""
    below = height < -1.0
    return float(height[below] @ -readings[below] / (height[below] @ height[below])) / N_PER_CM


def drawn_groups(random, size, rows, share):
    """Rows in groups of so many, until they make a share of all."""
    bad = np.zeros(size, dtype=bool)
    while bad.mean() < share:
        start = int(random.integers(60, size - rows - 3))
        bad[start : start + rows] = True
    return bad


@pytest.mark.parametrize("share", [0.002, 0.03, 0.1])
@pytest.mark.parametrize("kind", sorted(BAD))
def test_single_bad_readings_are_left_out_and_the_slope_is_right(kind, share):
    random = np.random.default_rng(1)
    _, height, force = push(random)
    bad = random.random(force.size) < share
    readings = np.where(bad, BAD[kind](random, force), force)
    alone = find_spikes(readings)
    # of one in ten some stand side by side, as what lasts a little longer does
    some_are_neighbours = share == 0.1 and kind == "100 N too much"
    error = slope_of(height[~alone], readings[~alone]) - 1
    assert abs(error) < (0.03 if some_are_neighbours else 5e-4)
    assert (alone & ~bad).sum() <= 0.1 * bad.sum()
    if share == 0.1:
        # without it the slope is wrong
        assert abs(slope_of(height, readings) - 1) > 0.03


@pytest.mark.parametrize("happens", [stick_slip, crust, stones])
def test_what_sand_does_is_left_in(happens):
    """All of it but a few readings of the shortest bumps, 3 to 5 readings long."""
    shares = []
    for seed in range(seeds(100, 25)):
        random = np.random.default_rng(seed)
        time, _, force = push(random)
        shares.append(find_spikes(force * (1 + happens(random, time))).mean())
    assert np.mean(shares) < 0.002
    assert max(shares) <= 0.01


@pytest.mark.parametrize("rows", [2, 3, 5, 8])
@pytest.mark.parametrize("level_N", [0.0, 100.0])
def test_what_lies_between_groups_of_bad_readings_is_left_in(rows, level_N):
    """The bad readings have noise of their own and are 10 % of all, so that good ones lie between them for less than a second."""
    share_wrong = []
    for seed in range(20):
        random = np.random.default_rng([seed, rows])
        _, _, force = push(random)
        is_bad = drawn_groups(random, force.size, rows, 0.1)
        noise = random.normal(0, 0.02, force.size)
        is_marked = find_spikes(np.where(is_bad, level_N + noise, force), int(RATE_HZ))
        share_wrong.append(np.mean(is_marked & ~is_bad))
    assert np.mean(share_wrong) < 0.02
    assert max(share_wrong) < 0.12


def test_a_stone_loses_no_more_than_its_highest_reading():
    for seed in (5, 122, 167, 195, 273, 428, 863):
        random = np.random.default_rng([seed, 99])
        time, _, force = push(random)
        assert np.count_nonzero(find_spikes(force * (1 + stones(random, time)), int(RATE_HZ))) <= 1


def test_noise_and_steps_of_a_sensor_are_left_in():
    random = np.random.default_rng(3)
    assert not find_spikes(random.normal(size=20_000)).any()
    assert not find_spikes(np.round(random.normal(size=20_000))).any()
    assert find_spikes(random.standard_t(3, 20_000)).mean() < 0.002
    assert not find_spikes(np.repeat([0.0, 5.0, 0.0], 100)).any()
    assert not find_spikes(np.zeros(100)).any()
    assert not find_spikes(np.array([1.0, 9.0])).any()


def test_a_log_of_which_nobody_knows_the_good_readings_is_refused(measure_push):
    random = np.random.default_rng(4)
    rows = np.flatnonzero(random.random(380) < 0.33)
    results = measure_push(MadePush(faults={"spike": {row: 500 * random.random() for row in rows}}))
    assert list(results.runs["reason_code"]) == ["spikes"]


def motion_of(time, way, moving="z"):
    """Motion log of an arm that goes along one axis."""
    still = dict.fromkeys(("x", "z", "angle"), np.zeros(time.size))
    return log_of(time=time, **still | {moving: way})


@pytest.mark.parametrize(
    ("rows", "moving"), [(3, "z"), (5, "z"), (10, "z"), (25, "z"), (5, "x"), (5, "angle")]
)
def test_a_position_that_is_read_seldom_counts_when_it_is_new(rows, moving):
    random = np.random.default_rng(rows)
    time, height, _ = push(random)
    # an arm never moves quite steadily
    height = height + 0.02 * np.sin(2.3 * time) * (time > 1)
    held = height[np.arange(height.size) // rows * rows]
    new = without_holds(motion_of(time, held, moving)).columns
    assert np.median(np.diff(new["time"])) == pytest.approx(rows / RATE_HZ)
    during = (time > 2) & (time < 13)
    between = np.interp(time[during], new["time"], new[moving])
    assert np.abs(between - height[during]).mean() < 0.1 * SPEED_CM_PER_S * rows / RATE_HZ / 2
    # the rest in air is one, not a slow way down
    assert np.interp(0.8, new["time"], new[moving]) == pytest.approx(1.0)


@pytest.mark.parametrize("zero_cm", [0.0, 0.037])
def test_a_coarse_sensor_is_no_position_that_is_held(zero_cm):
    time, height, _ = push(np.random.default_rng(5))
    motion = motion_of(time, np.round(height, 1) + zero_cm)
    assert without_holds(motion) is motion


@pytest.mark.parametrize("noise_cm", [0.0, 0.005, 0.02])
def test_positions_that_stand_alone_are_found_and_no_others(noise_cm):
    """Of an arm that goes down and back, rests in between, and does not move along x."""
    random = np.random.default_rng(5)
    way = np.interp(np.arange(900) / 50, [0, 2, 8, 9, 15, 18], [0, 0, 3, 3, 0, 0])
    x, z = (axis_way + random.normal(0, noise_cm, way.size) for axis_way in (0 * way, -way))
    assert not find_lone_positions(x, z).any()
    bad = [0, 40, 260, 402, 898]
    x[bad[::2]] += 0.6
    z[bad[1::2]] -= 0.6
    np.testing.assert_array_equal(np.flatnonzero(find_lone_positions(x, z)), bad)


def test_what_arms_do_leaves_no_position_alone():
    ways = {
        "turns at once": [0.0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5],
        "is polled late": [0.0, 1, 2, 3, 3, 3, 3, 3, 8, 9, 10, 11, 12, 13],
        "has a coarse sensor": [0.0, 1, 0, 0, 1, 1, 2, 1, 2, 2, 3, 4, 3, 4, 5],
        "starts and stops": [0.0, 0, 0, 0, 2, 4, 6, 8, 10, 10, 10, 10, 10],
    }
    for way in ways.values():
        assert not find_lone_positions(np.array(way), np.zeros(len(way))).any()


def test_noise_that_was_interpolated_leaves_no_position_alone():
    """As in a table of the force's rows, with positions that were logged half as often."""
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0, 0.02, 900)
        often = np.interp(np.arange(1799) / 2, np.arange(900), noise)
        assert not find_lone_positions(np.round(often, 2)).any()


GROUPS = {
    "zeros": lambda force, _: np.zeros(force.size),
    "zeros with noise": lambda force, random: random.normal(0, 0.02, force.size),
    "a code": lambda force, _: np.full(force.size, -999.0),
    "the sign lost": lambda force, _: -force,
}
"""Kind of wrong readings, in groups, to what a logger writes in place of the force."""


@pytest.mark.parametrize("rows", [1, 2, 4, 5, 8, 20, 45, 60, 100])
@pytest.mark.parametrize("kind", sorted(GROUPS))
def test_groups_of_wrong_readings_are_left_out_or_their_steps_are_seen(kind, rows):
    """Up to a second, which is 50 rows here; two groups may stand side by side."""
    for seed in range(seeds(20, 4)):
        random = np.random.default_rng([seed, rows])
        _, height, force = push(random)
        bad = drawn_groups(random, force.size, rows, (0.01, 0.03, 0.06, 0.1)[seed % 4])
        readings = np.where(bad, GROUPS[kind](force, random), force)
        kept = ~find_spikes(readings, round(RATE_HZ))
        error = slope_of(height[kept], readings[kept]) - 1
        steps = find_steps(readings[kept], round(RATE_HZ))
        assert abs(error) < 0.005 or steps, (seed, error)


@pytest.mark.parametrize("rows", [5, 20, 100])
def test_a_reading_that_is_held_until_a_jump_counts_once(rows):
    random = np.random.default_rng(rows)
    _, height, force = push(random)
    readings = force.copy()
    readings[400 : 400 + rows] = readings[400]
    held = find_held(readings)
    assert held.sum() in (0, rows - 1) if rows == 5 else held.sum() == rows - 1
    assert slope_of(height[~held], readings[~held]) == pytest.approx(1, abs=1e-3)
    assert not find_held(np.round(force)).any()
    assert not find_held(np.repeat(force[::10], 10)).any()


@pytest.mark.parametrize(("factor", "more_N"), [(1.0, 3.0), (0.5, 0.0), (2.0, 0.0)])
def test_a_step_that_stays_is_found_where_it_is(factor, more_N):
    for seed in range(seeds(50, 8)):
        random = np.random.default_rng(seed)
        _, _, force = push(random)
        row = int(random.integers(250, 640))
        force[row:] = factor * force[row:] + more_N
        assert [step.row for step in find_steps(force, round(RATE_HZ))] == [row]


@pytest.mark.parametrize(
    ("happens", "most_told"),
    [
        (None, 0.0),
        (stick_slip, 0.0),
        (stones, 0.0),
        (slip_among_stones, 0.05),
        (irregular_slip, 0.15),
    ],
)
def test_what_sand_does_is_hardly_a_step(happens, most_told):
    steps = []
    for seed in range(seeds(100, 25)):
        random = np.random.default_rng(seed)
        time, _, force = push(random)
        readings = force * (1 + happens(random, time)) if happens else force
        assert not find_held(readings).any()
        assert not find_plateau(readings[time > 1]).any()
        # before the sand there is nothing but noise
        steps.append(sum(time[s.row] > 3 for s in find_steps(readings, round(RATE_HZ))))
    assert np.mean(np.array(steps) > 0) <= most_told


@pytest.mark.parametrize("size_N", [-30.0, 30.0])
def test_a_step_larger_than_the_slips_around_it_is_found(size_N):
    found = []
    for seed in range(seeds(50, 20)):
        random = np.random.default_rng(seed)
        time, _, force = push(random)
        row = int(random.integers(400, 640))
        readings = force * (1 + 0.1 * stick_slip(random, time))
        readings[row:] += size_N
        found.append(row in [step.row for step in find_steps(readings, round(RATE_HZ))])
    assert np.mean(found) >= 0.9


@pytest.mark.parametrize("noise_N", [0.0, 0.02, 0.5])
def test_the_end_of_an_amplifier_is_found_with_noise_and_without(noise_N):
    for seed in range(seeds(50, 8)):
        random = np.random.default_rng(seed)
        time, _, force = push(random)
        end_N = random.uniform(20, 90)
        readings = np.minimum(force, end_N) + random.normal(0, noise_N, force.size)
        is_at_end = find_plateau(readings[time > 1])
        wanted = np.count_nonzero(force >= end_N)
        assert abs(is_at_end.sum() - wanted) <= 5 + 40 * noise_N


@pytest.mark.parametrize("code", [-999999.0, 0.0])
def test_a_code_in_the_last_row_of_a_table_is_seen_and_a_step_at_the_end_of_a_log_is_left_in(code):
    stress = np.arange(50) * 0.12 + np.random.default_rng(1).normal(0, 0.003, 50)
    stress[-1] = code
    assert np.flatnonzero(find_spikes(stress, 10, ends_in_push=True)).tolist() == [49]
    assert find_spikes(stress, 10).any() == (code < -1)
