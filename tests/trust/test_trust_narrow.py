"""A copied run narrows no interval, and other mistakes do so only with a flag or a failed check."""

from functools import cache

import pytest
from campaigns import FEW
from mistakes import EQUAL, enacted, judged, stated, with_mistake
from mistakes import MISTAKES as EVERY_MISTAKE
from seeds import seeds

CURVED = ((0.0, 90.0), (0.0, -90.0), (0.0, 45.0), (30.0, 90.0), (30.0, 45.0))
"""Directions of a campaign of curved stress."""
COPIES = ["copies", "copies, 5 rows cut", "copies, last digit", "copies, times 1.0001"]
MISTAKES = [
    ("default", "z dead", True),
    ("default", "x and z exchanged", True),
    ("default", "z gain 0.3, 60% stretch", True),
    ("stated", "one run in lbf", False),
    ("stated", "surface +3 mm", False),
]
"""How errors are given, the mistake, and whether it narrows an interval, which a failed check then says."""


@cache
def sound(errors, curved):
    """A campaign without a mistake: of curved stress, once a direction, or three times."""
    cells, repeats, sizes = (CURVED, 1, {"power": 1.3}) if curved else (FEW[:10], 3, {})
    campaign = enacted(
        "poppy_CP", 1, stated() if errors == "stated" else None, cells, repeats, sizes
    )
    return campaign, judged(campaign)


@pytest.mark.statistics
@pytest.mark.parametrize("errors", seeds(["stated", "default"], ["default"]))
@pytest.mark.parametrize("name", seeds(COPIES, COPIES[-1:]))
def test_a_copy_of_a_run_narrows_no_interval(errors, name):
    """Neither of alpha nor at stated depths: that of five copies of a push was 0.6 times as wide there."""
    base, judged_before = sound(errors, curved=True)
    judged_after = judged(with_mistake(base, name, 1)[0])
    assert len(judged_before.at_depth) == 3 * len(judged_before.alpha)
    assert "same_logs" in judged_after.failed
    assert judged_after.narrower(judged_before, EQUAL).empty


@pytest.mark.statistics
@pytest.mark.parametrize("errors", seeds(["stated", "default"], ["default"]))
@pytest.mark.parametrize("name", seeds([*EVERY_MISTAKE], ["x dead"]))
def test_no_mistake_of_the_list_narrows_an_interval_in_silence(errors, name):
    base, judged_before = sound(errors, curved=False)
    judged_after = judged(with_mistake(base, name, 1)[0])
    assert judged_after.silently(judged_before).empty


@pytest.mark.statistics
@pytest.mark.parametrize(("errors", "name", "narrows"), seeds(MISTAKES, MISTAKES[2:4]))
def test_no_mistake_narrows_an_interval_in_silence(errors, name, narrows):
    base, judged_before = sound(errors, curved=False)
    judged_after = judged(with_mistake(base, name, 1)[0])
    assert not judged_before.failed
    assert judged_after.failed
    assert (len(judged_after.narrower(judged_before)) > 0) == narrows
    assert judged_after.silently(judged_before).empty


def test_a_run_that_stands_apart_does_not_widen_other_cells_at_depths():
    """It does not tell how beds differ; the interval of its own cell reaches what the others say."""
    base = enacted("poppy_CP", 1, None, FEW[:10], 3, {"power": 1.3})
    judged_before, (mistaken, runs) = judged(base), with_mistake(base, "one run in lbf", 1)
    judged_after = judged(mistaken)
    assert "repeats" in judged_after.failed
    merged = judged_after.at_depth.merge(
        judged_before.at_depth, on=["beta_deg", "gamma_deg", "depth_cm"], suffixes=("", "_old")
    )
    lo, hi = (merged[f"alpha_z_{end}_N_per_cm3"] for end in ("lo", "hi"))
    old_lo, old_hi = (merged[f"alpha_z_{end}_N_per_cm3_old"] for end in ("lo", "hi"))
    is_own_cell = merged["run_ids"].str.contains(rf"\b{runs[0]}\b")
    assert is_own_cell.sum() == 3
    assert ((hi - lo) < 1.5 * (old_hi - old_lo))[~is_own_cell & lo.notna()].all()
    assert (hi >= (old_lo + old_hi) / 2)[is_own_cell & lo.notna()].all()
