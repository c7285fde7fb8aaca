"""Before the first log `rftfit check` states which shared errors the planned runs would show, and which runs would help."""

import math

import pytest
from makers import answer_of, bench_config, comma_log, json_of, row_of_push, write_campaign

DIRECTIONS = [(beta, gamma) for beta in (0, 30, 60) for gamma in (30, 60, 90)]
FIRST = DIRECTIONS[0]


@pytest.fixture
def rate(tmp_path):
    """Make ratings of the runs of these directions, in this order, by kind of the error."""

    def check(directions):
        force, motion = comma_log(time="time", F3="Fz"), comma_log(time="time", z="z")
        rows = [
            row_of_push(gamma_deg, f"run_{place}", beta_deg=beta_deg)
            for place, (beta_deg, gamma_deg) in enumerate(directions)
        ]
        write_campaign(tmp_path, bench_config(force, motion), rows=rows)
        plan = json_of("check", folder=tmp_path)["plan"]
        printed = answer_of("check", folder=tmp_path)[1]
        assert all(rating["message"] in printed for rating in plan)
        return {rating["kind"]: rating for rating in plan}

    return check


def least_seen(rating):
    return math.inf if rating["least_seen"] is None else rating["least_seen"]


def test_the_first_push_again_makes_a_sorted_plan_tell_a_change(rate):
    """In a sorted campaign without repeats, order and direction are the same: the cure of the sentence is a cure."""
    again = [FIRST] * 2 + DIRECTIONS[1:4] + [FIRST] * 2 + DIRECTIONS[4:] + [FIRST] * 3
    once, repeated, three_times = (
        rate(runs)["gain"] for runs in (DIRECTIONS, again, DIRECTIONS * 3)
    )
    assert math.inf == least_seen(once) > least_seen(repeated) > least_seen(three_times)
    assert f"{three_times['least_seen']:.0%}" in three_times["message"]
    # a plan that tells only large changes names the cure
    assert [
        "push the first direction again" in rating["message"]
        for rating in (once, repeated, three_times)
    ] == [True, True, False]
    assert least_seen(three_times) < 0.2


def test_mirror_images_tell_a_turned_mount(rate):
    images = [(-beta, 90) for beta in (30, 60)]
    without, with_images = (rate(runs)["turn"] for runs in (DIRECTIONS, [*DIRECTIONS, *images]))
    assert least_seen(without) > least_seen(with_images)
    assert least_seen(with_images) < 5
    assert ["push one mirror image" in rating["message"] for rating in (without, with_images)] == [
        True,
        False,
    ]
