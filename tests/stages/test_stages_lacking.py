"""The tables and figures of a campaign that lacks runs say what is missing."""

from __future__ import annotations

import numpy as np
import pytest
from campaigns import run_rules

import rftfit

TEST = "yuma_bp00_g90_in"
"""The penetration test of a natural sand."""


STAGES = ("ingest", "tare", "slopes", "checks", "legs", "fourier", "scaling", "legs_predicted")


@pytest.mark.parametrize(
    ("cells", "code"),
    [({"excluded": "yes", "reason": "dust"}, "excluded"), ({"tare_run": ""}, "no-tared-stroke")],
)
def test_a_penetration_test_that_gave_nothing(room, cells, code):
    room.add(TEST).set(TEST, **cells)
    run_rules(room.write(), *STAGES, "natural_sands")
    row = rftfit.open(room.folder).table("sands.csv").iloc[0]
    assert (row["medium"], row["run_id"]) == ("yuma", TEST)
    assert np.isnan(row["zeta"])
    assert row["reason_code"] == code
