"""Why a comparison has no number."""

from __future__ import annotations

import math

import pandas as pd

from rftfit.compare.legs import _compare
from rftfit.compare.published import DIFFERS, compare


def test_a_number_that_the_campaign_does_not_have() -> None:
    item = compare("zeta", "Table S2", 0.5, math.nan, 0.1)
    assert (item.verdict, item.why) == (DIFFERS, "no number in this campaign")


def test_curves_that_share_no_angle() -> None:
    measured = pd.DataFrame({"theta_deg": [0.0], "force_z_N": [1.0]})
    predicted = pd.DataFrame({"theta_deg": [90.0], "force_z_N": [1.0], "reason": [""]})
    row = _compare(measured, predicted, "z", 0.0, 0.95)
    assert row["reason"] == "measured and predicted curve share no theta"
