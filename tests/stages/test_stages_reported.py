"""Files as people report them, through the chain: the right number, or the true reason."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from one_push import ALPHA, REPORTED, campaign_around, measured, truth

pytestmark = pytest.mark.skipif(not REPORTED.is_dir(), reason="the reported files are not here")

COUNTS = {
    "time": {"column": "millis", "unit": "ms"},
    "F3": {"column": "raw", "unit": "N", "factor": 1 / 4200, "offset": -81234 / 4200},
    "z": {"column": "pos", "unit": "mm"},
}


@pytest.mark.parametrize(
    ("log", "settings", "flag"),
    [
        ("e1_zeros_0.1.csv", {}, "lone-readings"),
        ("e3_pos_1.csv", {}, "lone-readings"),
        ("m05_hx711.csv", {"columns": COUNTS}, "lone-readings"),
        ("m05_hx711.csv", {"columns": COUNTS, "range_N": 500.0}, "lone-readings"),
        ("m05_hx711_clean.csv", {"columns": COUNTS}, ""),
        ("g5_pos_noise_0.3mm.csv", {}, ""),
        ("g3_clock_step_0.5s.csv", {}, "gap"),
    ],
)
def test_a_reported_file_gives_the_right_number(tmp_path, log, settings: dict[str, Any], flag):
    fit, flags = measured(campaign_around(tmp_path / "lab", log, **settings))
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=1e-3), fit["reason"]
    assert {*flags} - {"no-tare"} == ({flag} if flag else set())


def test_one_of_two_sensors_in_a_long_table(tmp_path):
    columns = {"time": {"column": "time", "unit": "s"}, "F3": "Fz", "z": "z"}
    where: dict[str, Any] = {"where": {"sensor": "ft_plate"}}
    folder = campaign_around(tmp_path / "one", "m50_long_format.csv", columns, reads=where)
    fit, flags = measured(folder)
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=1e-3), fit["reason"]
    assert {*flags} == {"no-tare"}
    fit, _ = measured(campaign_around(tmp_path / "both", "m50_long_format.csv", columns))
    assert np.isnan(fit["alpha_z_N_per_cm3"])
    assert "`where: {sensor: ft_other}`" in fit["reason"]


def test_a_position_in_whole_steps_is_flagged_and_the_interval_holds_the_truth(tmp_path):
    fit, flags = measured(campaign_around(tmp_path / "lab", "g8_pos_held_10.csv"))
    assert "position-in-steps" in flags
    low, high = (fit[f"alpha_z_{end}_N_per_cm3"] for end in ("lo", "hi"))
    assert low < ALPHA < high


@pytest.mark.parametrize("rate_Hz", [10, 5, 2])
def test_a_position_that_is_polled_is_used_where_it_is_new(tmp_path, rate_Hz):
    """Of an arm that does not move quite steadily, so that nobody takes it for a coarse sensor."""
    time, height, _ = truth()
    height = height - 0.4 * np.sin(1.9 * (time - 1)) * (time > 1)
    force = np.clip(-2.0 * height, 0, None) + np.random.default_rng(1).normal(0, 0.02, time.size)
    rows = round(50 / rate_Hz)
    polled = height[np.arange(time.size) // rows * rows]
    path = tmp_path / "polled.csv"
    lines = [f"{t:.4f},{f:.4f},{z:.4f}" for t, f, z in zip(time, force, polled, strict=True)]
    path.write_text("\n".join(["Time (s),Force (N),z (mm)", *lines, ""]), encoding="utf-8")
    fit, flags = measured(campaign_around(tmp_path / "lab", path))
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=5e-3), fit["reason"]
    assert "held-positions" in flags


def test_a_code_for_no_data_that_the_config_names(tmp_path):
    """Many in a row, which do not stand alone."""
    time, height, force = truth()
    force = np.where((time > 6) & (time < 9), -999.25, force)
    path = tmp_path / "coded.csv"
    lines = [f"{t:.4f},{f:.4f},{z:.4f}" for t, f, z in zip(time, force, height, strict=True)]
    path.write_text("\n".join(["Time (s),Force (N),z (mm)", *lines, ""]), encoding="utf-8")
    folder = campaign_around(tmp_path / "lab", path, reads={"missing": [-999.25]})
    fit, flags = measured(folder)
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=1e-3)
    assert "no-data" in flags
    ledger = folder.table("ledger/ingest/bed.csv")
    assert ledger.loc[ledger["reason_code"] == "no-data", "rows"].sum() == 149
