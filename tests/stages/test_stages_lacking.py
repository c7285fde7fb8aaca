"""The tables and figures of a campaign that lacks runs say what is missing."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from campaigns import run_rules

import rftfit
from rftfit.store import read_csv, write_csv

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


def test_a_table_without_rows_joins_as_numbers(tmp_path):
    """Else theta of every other medium would become words, which no stage can join by."""
    rows = pd.DataFrame({"medium": ["m"], "theta_deg": [1.5], "force_z_N": [2.0]})
    for name, table in {"some": rows, "none": rows.iloc[:0]}.items():
        write_csv(table, tmp_path / name)
    kinds = {"medium": "text"}
    joined = pd.concat(
        [
            read_csv(tmp_path / name, lambda column: kinds.get(column, ""))
            for name in ("some", "none")
        ]
    )
    assert joined["theta_deg"].dtype == np.float64
    assert list(joined["medium"]) == ["m"]
