"""The figure from recording to result shows one run of each kind, or says that there is none."""

from __future__ import annotations

import pytest
from result_tables import Memory

from rftfit.campaign.load import load_campaign
from rftfit.figures.protocol import columns_of
from rftfit.measure.fits import fit_medium

RUNS = (
    "poppy_LP_bp30_g45_in",
    "poppy_LP_bp30_g45_ex",
    "poppy_LP_bp30_g00_h508",
    "poppy_LP_bp30_g00_h762",
    "poppy_LP_bp00_g90_in",
    "poppy_LP_c_leg",
    "poppy_LP_flat_leg",
)


@pytest.fixture
def small(room):
    return room.add(*RUNS)


def results_of(room):
    results = room.chain()
    campaign = load_campaign(room.folder / "config" / "config.yaml")
    _, windows, _ = fit_medium(campaign, "poppy_LP", results.runs, results.tared, results.tares)
    tables = {
        "traces/poppy_LP.parquet": results.traces,
        "tared/poppy_LP.parquet": results.tared,
        "windows/poppy_LP.parquet": windows,
        "fits/poppy_LP.csv": results.fits,
        "alpha/poppy_LP.csv": results.alpha,
        "legs/poppy_LP.csv": results.curves,
    }
    return Memory(campaign, tables)


def columns(room):
    return {column.kind: column for column in columns_of(results_of(room), "poppy_LP")}


def test_one_run_of_each_kind(small):
    columns_by_kind = columns(small)
    assert list(columns_by_kind) == ["intrusion", "extraction", "horizontal", "rotation"]
    # the deepest of the two horizontal runs, the first leg of the config
    assert columns_by_kind["horizontal"].fit["run_id"] == "poppy_LP_bp30_g00_h762"
    assert columns_by_kind["rotation"].about.startswith("c-leg")
    assert "(\u221230\u00b0, \u221245\u00b0)" in columns_by_kind["extraction"].about
    for column in columns_by_kind.values():
        assert column.tare
        first, last = column.phases["stroke"]
        assert first == 0.0
        assert last > 5
    # the tare of an intrusion is small beside its force
    pushed = columns_by_kind["intrusion"]
    assert abs(pushed.tare["force_z_N"]).max() < 0.1 * pushed.run["force_z_N"].max()
