"""Why a comparison has no number."""

from __future__ import annotations

import math

import pandas as pd

from rftfit.compare.legs import leg_errors
from rftfit.compare.published import MEASURED, NOT_MEASURED, Tolerance, compare


def test_a_number_that_the_campaign_does_not_have():
    item = compare("zeta", "Table S2", 0.5, math.nan, Tolerance(0.1, "rounded"), MEASURED)
    assert (item.verdict, item.why) == (NOT_MEASURED, "no number in this campaign")


def test_curves_that_share_no_angle():
    names = {"medium": "sand", "leg": "flat", "force_z_N": 1.0, "force_x_N": 1.0}
    measured = pd.DataFrame([{**names, "theta_deg": 0.0}])
    predicted = pd.DataFrame([{**names, "theta_deg": 90.0, "profile": "table", "reason": ""}])
    for row in leg_errors(measured, predicted).to_dict("records"):
        assert row["reason"] == "measured and predicted curve share no theta"
        assert math.isnan(row["rms_error_N"])
