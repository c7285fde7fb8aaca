"""Wrong single readings, codes for no data and held positions are left out, and true ones are kept.

Held: repeated by the logger until a new value arrives.
"""

from pathlib import Path

import numpy as np
import pytest
from one_stroke import N_PER_CM, RATE_HZ, SPEED_CM_PER_S, crust, push, stick_slip, stones
from seeds import seeds

from rftfit.campaign.spikes import MOST_SHARE, find_lone_positions, find_spikes
from rftfit.logs.base import Log, LogError
from rftfit.measure.readings import (
    find_holds,
    moving_axis,
    without_holds,
    without_missing,
    without_spikes,
)


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


@pytest.mark.parametrize("share", [0.002, 0.03, 0.1])
@pytest.mark.parametrize("kind", sorted(BAD))
def test_single_bad_readings_are_left_out_and_the_slope_is_right(kind, share):
    random = np.random.default_rng(1)
    _, height, force = push(random)
    bad = random.random(force.size) < share
    readings = np.where(bad, BAD[kind](random, force), force)
    alone = find_spikes(readings)
    below = height < -1.0

    def slope(kept):
        depth = -height[below & kept]
        return float(depth @ readings[below & kept] / (depth @ depth))

    # of one in ten some stand side by side, as what lasts a little longer does
    some_are_neighbours = share == 0.1 and kind == "100 N too much"
    assert slope(~alone) == pytest.approx(N_PER_CM, rel=0.03 if some_are_neighbours else 5e-4)
    assert (alone & ~bad).sum() <= 0.1 * bad.sum()
    if share == 0.1:
        assert (
            abs(slope(np.ones_like(alone)) / N_PER_CM - 1) > 0.03
        )  # without it the slope is wrong


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


def test_noise_and_steps_of_a_sensor_are_left_in():
    random = np.random.default_rng(3)
    assert not find_spikes(random.normal(size=20_000)).any()
    assert not find_spikes(np.round(random.normal(size=20_000))).any()
    assert find_spikes(random.standard_t(3, 20_000)).mean() < 0.002
    assert not find_spikes(np.repeat([0.0, 5.0, 0.0], 100)).any()
    assert not find_spikes(np.zeros(100)).any()
    assert not find_spikes(np.array([1.0, 9.0])).any()


def test_a_log_of_which_nobody_knows_the_good_readings_is_refused():
    random = np.random.default_rng(4)
    time, _, force = push(random)
    bad = random.random(force.size) < MOST_SHARE + 0.08
    log = log_of(
        time=time, F3=np.where(bad & (force > 5), force + 500 * random.random(force.size), force)
    )
    with pytest.raises(LogError, match=r" 700 .* F3 .*: 25%") as caught:
        without_spikes(log, ["F1", "F3"])
    assert caught.value.code == "spikes"


def test_rows_with_a_code_for_no_data_are_counted():
    log = log_of(time=np.arange(5.0), F3=np.array([1.0, -9999, 2, -9999, 3]))
    kept = without_missing(log, [-9999])
    assert kept.columns["F3"].tolist() == [1.0, 2.0, 3.0]
    assert [*kept.dropped.values()] == [2]
    assert without_missing(log, []) is log


def held(position, rows):
    """A position that is read every so many rows."""
    return position[np.arange(position.size) // rows * rows]


@pytest.mark.parametrize("rows", [3, 5, 10, 25])
def test_a_position_that_is_read_seldom_counts_when_it_is_new(rows):
    random = np.random.default_rng(rows)
    time, height, _ = push(random)
    # an arm never moves quite steadily
    height = height + 0.02 * np.sin(2.3 * time) * (time > 1)
    motion = log_of(
        time=time, x=np.zeros(time.size), z=held(height, rows), angle=np.zeros(time.size)
    )
    holds = find_holds(motion.columns["z"])
    assert (holds.rows, holds.is_regular) == (rows, False)
    new = without_holds(motion)
    moving = (time > 2) & (time < 13)
    between = np.interp(time[moving], new.columns["time"], new.columns["z"])
    assert np.abs(between - height[moving]).mean() < 0.1 * SPEED_CM_PER_S * rows / RATE_HZ / 2
    # the rest in air is one, not a slow way down
    assert np.interp(0.8, new.columns["time"], new.columns["z"]) == pytest.approx(1.0)


def test_a_coarse_sensor_is_no_position_that_is_held():
    time, height, _ = push(np.random.default_rng(5))
    motion = log_of(
        time=time, x=np.zeros(time.size), z=np.round(height, 1), angle=np.zeros(time.size)
    )
    assert find_holds(motion.columns["z"]).is_regular
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


@pytest.mark.parametrize("moving", ["x", "z", "angle"])
def test_the_axis_that_moves_most_shows_the_holds(moving):
    ramp = np.linspace(0, 3, 50)
    still = dict.fromkeys(("x", "z"), np.ones(50))
    columns = {**still, "angle": 2 * ramp, moving: ramp}
    if moving != "angle":
        columns["x" if moving == "z" else "z"] = 0.1 * ramp
    assert moving_axis(log_of(**columns)) is columns[moving]
