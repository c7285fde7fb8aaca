"""Files reported by users give the right alpha through all stages, or the true reason for none."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import Folder, run_rules
from log_files import told
from makers import write_yaml
from third_party import (
    ALPHA,
    REPORTED,
    REPORTED_PUSHES,
    campaign_around,
    measured,
    needs,
    truth,
    write_table,
)

from rftfit.campaign.load import check_campaign

MEASURE = ("ingest", "tare", "slopes", "checks")
"""Stages up to alpha."""
LOG_NAMES, STRESS_NAMES = (
    "Time (s),Force (N),z (mm)",
    "beta_deg,gamma_deg,depth_cm,stress_z,stress_x",
)

pytestmark = needs(REPORTED)


def write_log(path, *columns, names=LOG_NAMES):
    """Write columns of numbers below these names."""
    rows = [",".join(f"{value:.4f}" for value in row) for row in zip(*columns, strict=True)]
    return write_table(path, names, rows)


def change_config(folder, **sections):
    """Change keys of sections of the config."""
    config = yaml.safe_load(folder.config.read_text(encoding="utf-8"))
    for name, keys in sections.items():
        config.setdefault(name, {}).update(keys)
    write_yaml(folder.config, config)


def campaign_of_stress(folder, names, rows):
    """Make a campaign of a table of stress."""
    write_table(folder / "stress.csv", names, rows)
    Folder(folder).rftfit("init", "lab", "--stress-table", "stress.csv")
    return Folder(folder / "lab")


def tables_of_stress(folder):
    """Fits, flags and ledger of the only medium of a table of stress."""
    run_rules(folder.config, *MEASURE)
    (name,) = (path.name for path in (folder.root / "results" / "fits").glob("*.csv"))
    return [folder.table(f"{stage}/{name}") for stage in ("fits", "flags", "ledger/ingest")]


@pytest.mark.parametrize("push", REPORTED_PUSHES, ids=str)
def test_a_reported_file_gives_the_right_number_or_the_true_reason(tmp_path, push):
    fit, flags = measured(campaign_around(tmp_path / "lab", push.log, **push.settings))
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(push.alpha, rel=1e-3, nan_ok=True), fit[
        "reason"
    ]
    if push.words:
        assert push.words in fit["reason"]
    else:
        assert {*flags} - {"no-tare"} == ({push.code} if push.code else set())


def test_a_position_in_whole_steps_is_flagged_and_the_interval_holds_the_truth(tmp_path):
    fit, flags = measured(campaign_around(tmp_path / "lab", "g8_pos_held_10.csv"))
    assert "position-in-steps" in flags
    low, high = (fit[f"alpha_z_{end}_N_per_cm3"] for end in ("lo", "hi"))
    assert low < ALPHA < high


@pytest.mark.parametrize("rate_Hz", [10, 5, 2])
def test_a_position_that_is_polled_is_used_where_it_is_new(tmp_path, rate_Hz):
    """Of an arm that does not move quite steadily, so that nobody takes it for a coarse sensor."""
    time, height = (truth()[name] for name in ("t", "z"))
    height = height - 0.4 * np.sin(1.9 * (time - 1)) * (time > 1)
    force = np.clip(-2.0 * height, 0, None) + np.random.default_rng(1).normal(0, 0.02, time.size)
    rows = round(50 / rate_Hz)
    polled = height[np.arange(time.size) // rows * rows]
    path = write_log(tmp_path / "polled.csv", time, force, polled)
    fit, flags = measured(campaign_around(tmp_path / "lab", path))
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=5e-3), fit["reason"]
    assert "held-positions" in flags


def test_a_code_for_no_data_that_the_config_names(tmp_path):
    """Many in a row, which do not stand alone."""
    time, height, force = (truth()[name] for name in ("t", "z", "F"))
    force = np.where((time > 6) & (time < 9), -999.25, force)
    path = write_log(tmp_path / "coded.csv", time, force, height)
    folder = campaign_around(tmp_path / "lab", path, reads={"missing": [-999.25]})
    fit, flags = measured(folder)
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=1e-3)
    assert "no-data" in flags
    ledger = folder.table("ledger/ingest/bed.csv")
    assert ledger.loc[ledger["reason_code"] == "no-data", "rows"].sum() == 149


def test_a_table_of_one_load_cell_has_no_stress_along_x(tmp_path):
    """As penetrometers, bevameters and plate load tests write it; slanted pushes then have no alpha_x."""
    completed = Folder(tmp_path).rftfit(
        "init", "lab", "--stress-table", str(REPORTED / "pressure_sinkage_table.csv")
    )
    assert completed.returncode in (0, 2), completed.stderr
    folder = Folder(tmp_path / "lab")
    table = next((folder.root / "raw").glob("*.csv"))
    slanted = [f"30,45,{depth},{0.8 * depth:.3f}" for depth in range(1, 40)]
    table.write_text(
        table.read_text(encoding="utf-8") + "\n".join([*slanted, ""]), encoding="utf-8"
    )
    columns = {"stress_z_N_per_cm2": "sigma"}
    change_config(folder, table={"holds": "stress", "columns": columns, "stress_unit": "kPa"})
    fits, flags, _ = tables_of_stress(folder)
    fits = fits.set_index("beta_deg")
    assert fits.loc[0, "alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=1e-3)
    assert fits.loc[0, "alpha_x_N_per_cm3"] == 0
    assert fits.loc[30, "alpha_z_N_per_cm3"] == pytest.approx(0.8, rel=1e-3)
    assert np.isnan(fits.loc[30, "alpha_x_N_per_cm3"])
    assert (flags["code"] == "no-force-x").sum() == 1


def problems_of(folder):
    return told(check_campaign(folder / "lab" / "config" / "config.yaml")[1])


def test_a_table_with_stress_along_x_in_some_rows_of_a_run_is_refused(tmp_path):
    rows = [f"0,90,{depth},{depth},{'' if depth == 3 else 0}" for depth in range(1, 9)]
    campaign_of_stress(tmp_path, STRESS_NAMES, rows)
    assert problems_of(tmp_path) == ["stress-table.blank 2 stress_x_N_per_cm2"]


@pytest.mark.parametrize(
    ("bad_row", "depth_mm", "problem"),
    [
        (12, 55.0, "stands-alone 13 depth_cm '5.5 cm'"),
        (20, 0.0, "stands-alone 21 depth_cm '0 cm'"),
        (33, -1e6, "negative-depth 34 depth_cm '-100000 cm'"),
    ],
)
def test_one_wrong_depth_of_a_table_is_left_out(tmp_path, bad_row, depth_mm, problem):
    rows = [f"0,90,{depth_mm if row == bad_row else row},{0.1 * row:.4f}" for row in range(1, 50)]
    folder = campaign_of_stress(tmp_path, "beta_deg,gamma_deg,depth_mm,stress_z", rows)
    assert problems_of(tmp_path) == [f"stress-table.{problem}"]
    if depth_mm < 0:
        return
    fits, flags, _ = tables_of_stress(folder)
    assert fits["alpha_z_N_per_cm3"][0] == pytest.approx(1.0, rel=1e-6), fits["reason"]
    assert "rows-alone" in set(flags["code"])


def test_rows_without_data_of_a_table_are_counted_and_disturb_nothing(tmp_path):
    """Many in a row, of one run some, of another all."""
    rows = [f"0,90,{depth},{-9999 if 10 <= depth < 20 else depth},0,push" for depth in range(1, 40)]
    rows += [f"30,90,-9999,{depth},0,lost" for depth in range(1, 9)]
    folder = campaign_of_stress(tmp_path, f"{STRESS_NAMES},run_id", rows)
    change_config(folder, table={"missing": [-9999]})
    assert problems_of(tmp_path) == [
        "stress-table.no-data 11 depth_cm",
        "stress-table.run-without-data 41 depth_cm",
    ]
    assert "18 rows" in folder.rftfit("check").stdout
    fits, flags, ledger = tables_of_stress(folder)
    assert fits["alpha_z_N_per_cm3"][0] == pytest.approx(1.0, rel=1e-6), fits["reason"]
    assert ledger.loc[ledger["reason_code"] == "no-data", "rows"].sum() == 10
    assert "no-data" in set(flags["code"])


def test_seconds_and_nanoseconds_in_two_columns_are_proposed_as_one_time(tmp_path):
    printed = Folder(tmp_path).rftfit("inspect", str(REPORTED / "m03_sec_nanosec.csv")).stdout
    assert "time: {column: sec, unit: s, plus: {column: nanosec, unit: ns}}" in printed


@pytest.mark.parametrize(
    ("direction", "gamma_deg", "depth_cm", "at_surface_mm"),
    [
        ("intrusion", 45, "", 0.0),
        ("intrusion", 20, "", 0.0),
        ("intrusion", 45, "", 70.0),
        ("horizontal", 0, "2", 0.0),
    ],
)
def test_a_position_along_a_slanted_stage(tmp_path, direction, gamma_deg, depth_cm, at_surface_mm):
    """One column gives both: x and z by gamma of the sheet, from where the path meets the stated surface."""
    time, height = (truth()[name] for name in ("t", "z"))
    along = -height  # mm, from where the plate's centre is at the surface
    angle = np.radians(gamma_deg)
    depth = np.clip(along * np.sin(angle), 0, None) if gamma_deg else 20.0 * (along > 0)
    force = 1.5 * depth + np.random.default_rng(1).normal(0, 0.02, time.size)
    path = tmp_path / "slanted.csv"
    write_log(path, time, force, along + at_surface_mm, names="Time (s),Force (N),Stage (mm)")
    surface_mm = -at_surface_mm * np.sin(angle)
    row = {"direction": direction, "gamma_deg": str(gamma_deg), "depth_cm": depth_cm}
    row["surface_z_mm"] = f"{surface_mm:.6g}"
    folder = campaign_around(tmp_path / "lab", path, row=row)
    config = yaml.safe_load(folder.config.read_text(encoding="utf-8"))
    del config["motion_log"]["columns"]["z"]
    config["motion_log"]["columns"]["along"] = "Stage"
    config["fit"]["horizontal_depths_cm"] = [2]
    config["zero"] = {"method": "stated", "sd_N": 0.02}
    folder.config.write_text(yaml.safe_dump(config), encoding="utf-8")
    fit, _ = measured(folder)
    area_cm2 = np.pi * 2.5**2
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(15 / area_cm2, rel=0.01), fit["reason"]
    trace = pd.read_parquet(folder.root / "results" / "traces" / "bed.parquet")
    moving = trace[trace["depth_cm"] > 1]
    if gamma_deg:
        np.testing.assert_allclose(moving["x_cm"], -moving["depth_cm"] / np.tan(angle), atol=0.01)


def test_runs_side_by_side_in_one_file(tmp_path):
    """The row of the sheet names its own columns; units and the rest are those of the config."""
    rows = [
        {
            "run_id": f"run{number}",
            "force_columns": f"time=Time Run #{number}; F3=Force Run #{number}",
            "motion_columns": f"time=Time Run #{number}; z=Position Run #{number}",
        }
        for number in (1, 2, 3)
    ]
    columns = {"time": "Time Run #1", "F3": "Force Run #1", "z": "Position Run #1"}
    folder = campaign_around(tmp_path / "lab", "m15_pasco.csv", columns, row=rows)
    run_rules(folder.config, *MEASURE)
    fits = folder.table("fits/bed.csv").set_index("run_id")
    assert fits["alpha_z_N_per_cm3"].to_dict() == pytest.approx(
        {"run1": 1.0186, "run2": 1.5279, "run3": 0.8149}, rel=2e-3
    ), fits["reason"].tolist()


def test_runs_below_one_another_in_one_file(tmp_path):
    time, height, force = (truth()[name] for name in ("t", "z", "F"))
    both = [np.column_stack([number + 0 * time, time, force / number, height]) for number in (1, 2)]
    path = write_log(tmp_path / "all.csv", *np.concatenate(both).T, names=f"Push,{LOG_NAMES}")
    rows = [
        {"run_id": f"p{number}", "force_where": where, "motion_where": where}
        for number, where in ((1, "Push=1.0000"), (2, "Push=2.0000"))
    ]
    folder = campaign_around(tmp_path / "lab", path, row=rows)
    run_rules(folder.config, *MEASURE)
    fits = folder.table("fits/bed.csv").set_index("run_id")
    assert fits["alpha_z_N_per_cm3"].to_dict() == pytest.approx(
        {"p1": ALPHA, "p2": ALPHA / 2}, rel=1e-3
    ), fits["reason"].tolist()


def test_runs_below_one_another_are_never_read_as_one(tmp_path):
    """The second is longer: what is left of it would be read as the end of the first."""
    row = np.append(np.arange(300), np.arange(500))
    force = row * np.repeat([0.1, 0.3], [300, 500])
    path = write_log(tmp_path / "both.csv", row / 50, force, 10 - row / 5)
    fit, _ = measured(campaign_around(tmp_path / "lab", path))
    assert np.isnan(fit["alpha_z_N_per_cm3"])
    assert fit["reason_code"] == "time"
    assert "force_where" in fit["reason"]


@pytest.mark.parametrize(
    ("column", "cell", "bad_word"),
    [
        ("force_where", "Push 1", "'Push 1'"),
        ("force_columns", "F4=Force", "'F4'"),
        ("motion_columns", "z=z; z=Z", "z"),
    ],
)
def test_a_cell_that_names_rows_or_columns_wrongly_is_told(tmp_path, column, cell, bad_word):
    folder = campaign_around(tmp_path / "lab", "e3_pos_1.csv", row={column: cell})
    wrong = check_campaign(folder.config)[1][-1]
    assert told([wrong]) == [f"sheet.assignment 2 {column} {cell!r}"]
    assert f"found {bad_word}" in wrong.allowed
