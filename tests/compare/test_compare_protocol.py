"""A plan of runs states which shared errors it can detect and which further runs would help."""

from __future__ import annotations

import numpy as np
import pytest
from pushes import plate_run

from rftfit.compare.protocol import PlanPower, scan_plan
from rftfit.measure.flags import remark

DIRECTIONS = [(beta, gamma) for beta in (0, 30, 60) for gamma in (30, 60, 90)]


def planned(directions):
    """Runs of these directions, in this order."""
    return [
        plate_run(
            f"run_{place}",
            medium="sand",
            beta_deg=float(beta),
            gamma_deg=float(gamma),
            row=place + 2,
        )
        for place, (beta, gamma) in enumerate(directions)
    ]


def least_seen(directions, kind="gain", group="from-run"):
    causes = scan_plan(planned(directions))
    rows = causes[(causes["kind"] == kind) & (causes["group"] == group)]
    return float(rows.loc[rows["verdict"] == "not seen", "least_seen"].min())


def test_the_first_push_again_makes_a_sorted_plan_tell_a_change():
    """In a sorted campaign without repeats, order and direction are the same: the cure of the sentence is a cure."""
    once = least_seen(DIRECTIONS)
    first = [DIRECTIONS[0]]
    again = least_seen([*first * 2, *DIRECTIONS[1:4], *first * 2, *DIRECTIONS[4:], *first * 3])
    three_times = least_seen(DIRECTIONS * 3)
    assert np.isfinite(three_times)
    assert np.isnan(once) or once > again
    assert again > three_times
    assert three_times < 0.25


def test_mirror_images_tell_a_turned_mount():
    without = least_seen(DIRECTIONS, "turn", "all")
    images = [(-beta, 90) for beta in (30, 60)]
    with_images = least_seen([*DIRECTIONS, *images], "turn", "all")
    assert np.isnan(without) or without > with_images
    assert with_images < 8


def test_few_runs_tell_nothing_and_say_what_would():
    causes = scan_plan(planned([(0, 90)] * 2))
    assert set(causes["verdict"]) == {"not checked"}
    cures = {("gain", "from-run"): "repeat-first", ("turn", "all"): "push-mirror-image"}
    for (kind, group), cure in cures.items():
        lacks = remark(f"plan-lacks-{kind}", cure=str(remark(cure)))
        assert PlanPower("sand", kind, group, np.nan).sentence == str(lacks)


@pytest.mark.parametrize(("least", "names_cure"), [(0.12, False), (0.34, True)])
def test_a_plan_that_tells_only_large_changes_names_the_cure(least, names_cure):
    sentence = PlanPower("sand", "gain", "from-run", least).sentence
    assert f"{least:.0%}" in sentence
    assert (str(remark("repeat-first")) in sentence) == names_cure
