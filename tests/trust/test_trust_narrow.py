"""A copy of a run never narrows an interval; any other mistake does so only with a flag or a failed check.

`make reliability ARGS="--kinds narrow"` is the same with the whole list of mistakes in two media.
"""

from functools import cache

import pytest
from campaigns import FEW
from mistakes import EQUAL, enacted, judged, stated, with_mistake

from rftfit.measure.alpha import column

CURVED = ((0.0, 90.0), (0.0, -90.0), (0.0, 45.0), (30.0, 90.0), (30.0, 45.0))


@cache
def sound(errors, curved):
    """A campaign without a mistake: of curved stress, once a direction, or three times."""
    cells, repeats, sizes = (CURVED, 1, {"power": 1.3}) if curved else (FEW[:10], 3, {})
    made = enacted("poppy_CP", 1, stated() if errors == "stated" else None, cells, repeats, sizes)
    return made, judged(made)


@pytest.mark.parametrize("errors", ["stated", "default"])
@pytest.mark.parametrize(
    "name", ["copies", "copies, 5 rows cut", "copies, last digit", "copies, times 1.0001"]
)
def test_a_copy_of_a_run_narrows_no_interval(errors, name):
    """Neither of alpha nor at stated depths: that of five copies of a push was 0.6 times as wide there."""
    base, before = sound(errors, curved=True)
    after = judged(with_mistake(base, name, 1)[0])
    assert len(before.at_depth) == 3 * len(before.alpha)
    assert "same_logs" in after.failed
    assert after.narrower(before, EQUAL).empty


@pytest.mark.parametrize(
    ("errors", "name", "narrows"),
    [
        ("default", "z dead", True),
        ("default", "x and z exchanged", True),
        ("default", "z gain 0.3, 60% stretch", True),
        ("stated", "one run in lbf", False),
        ("stated", "surface +3 mm", False),
    ],
)
def test_no_mistake_narrows_an_interval_in_silence(errors, name, narrows):
    base, before = sound(errors, curved=False)
    after = judged(with_mistake(base, name, 1)[0])
    assert not before.failed
    assert after.failed
    assert (len(after.narrower(before)) > 0) == narrows
    assert after.silently(before).empty


def test_a_run_that_stands_apart_does_not_widen_other_cells_at_depths():
    """It does not tell how beds differ; the interval of its own cell reaches what the others say."""
    base = enacted("poppy_CP", 1, None, FEW[:10], 3, {"power": 1.3})
    before, (made, runs) = judged(base), with_mistake(base, "one run in lbf", 1)
    after = judged(made)
    assert "repeats" in after.failed
    both = after.at_depth.merge(
        before.at_depth, on=["beta_deg", "gamma_deg", "depth_cm"], suffixes=("", "_old")
    )
    lo, hi = (both[column("z", end)] for end in ("_lo", "_hi"))
    old_lo, old_hi = (both[column("z", end) + "_old"] for end in ("_lo", "_hi"))
    own = both["run_ids"].str.contains(rf"\b{runs[0]}\b")
    assert own.sum() == 3
    assert ((hi - lo) < 1.5 * (old_hi - old_lo))[~own & lo.notna()].all()
    assert (hi >= (old_lo + old_hi) / 2)[own & lo.notna()].all()
