"""Files at the edge of the rules for logs give the right alpha through all stages, or the true reason for none."""

import shutil

import numpy as np
import pandas as pd
import pytest
from campaigns import Folder, run_rules
from third_party import ALPHA, EDGES, campaign_around, measured, needs

pytestmark = needs(EDGES)

GERMAN = {"time": "Zeit", "F3": "Kraft", "z": "Weg"}
SEMICOLONS = {"delimiter": ";", "decimal": ","}
ARRAYS = {"time": "time", "F3": "force", "z": "z"}
COLUMNS_OF_ARRAY = {"time": "data.time", "F3": "data.Fz", "z": "data.z"}
HALVED = {"F3": {"column": "force", "unit": "N", "factor": 0.5}}
OF_ARRAYS = {"dialect": "arrays"}
LOAD = {"F3": {"column": "Load", "unit": "lbf"}}
OF_ROWS = [
    # file, arguments of campaign_around, code of the flag or reason, words in the reason of a refusal
    ("b1_mux_5.csv", {}, "", "`where: {device: A}`"),
    ("b1_mux_5.csv", {"reads": {"where": {"device": "A"}}}, "gaps", ""),
    ("b2_name_ch.csv", {}, "", "`where: {ch: 1}`"),
    ("b2_name_ch.csv", {"reads": {"where": {"ch": "1"}}}, "", ""),
    ("k05_unit_change.csv", {}, "", "kgf"),
    ("k06_unit_lbf.csv", {"columns": {"F3": {"column": "Load", "unit": "N"}}}, "", "lbf"),
    ("k06_unit_lbf.csv", {"columns": LOAD}, "", ""),
    (
        "k10_de_thousand_int.csv",
        {"text": SEMICOLONS, "columns": GERMAN | {"F3": {"column": "Kraft", "unit": "mN"}}},
        "",
        "",
    ),
    ("k11_excel_text.csv", {}, "", ""),
    (
        "k11_quoted_comma.csv",
        {"text": {"delimiter": ",", "decimal": ","}, "columns": GERMAN},
        "",
        "",
    ),
    ("k11_trailing_minus.csv", {}, "", ""),
    ("k13_clip60.csv", {"range_N": 500.0}, "end-of-amplifier", "saturated"),
    ("k13_hold100.csv", {}, "held-readings", ""),
    ("k13_tare_late.csv", {}, "zero-steps", ""),
    ("k13_zero_run5x10.csv", {}, "readings-away", ""),
    ("n01_colon_ms.csv", {}, "", ""),
    ("n05_dst_autumn.csv", {}, "clock-set-back", ""),
    (
        "n06_excel_days_de.csv",
        {"text": SEMICOLONS, "columns": GERMAN | {"time": {"column": "Time", "unit": "d"}}},
        "",
        "",
    ),
    ("n24_newline_in_name.csv", {}, "", ""),
    ("p02_valid_run.h5", {"reads": OF_ARRAYS, "columns": ARRAYS}, "", ""),
    ("p04_gain.h5", {"reads": OF_ARRAYS, "columns": ARRAYS}, "", "gain"),
    ("p04_gain.h5", {"reads": OF_ARRAYS, "columns": ARRAYS | HALVED}, "", ""),
    ("p06_columns_attr.h5", {"reads": OF_ARRAYS, "columns": COLUMNS_OF_ARRAY}, "", ""),
]


@pytest.mark.parametrize(("name", "settings", "code", "words"), OF_ROWS)
def test_a_file_at_the_edge_gives_the_right_number_or_the_true_reason(
    tmp_path, name, settings, code, words
):
    fit, flags = measured(campaign_around(tmp_path / "lab", EDGES / name, **settings))
    alpha = np.nan if words else ALPHA
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(alpha, rel=1e-3, nan_ok=True), fit["reason"]
    if words:
        assert words in fit["reason"]
    if code:
        assert code in flags


@pytest.mark.parametrize("rows", [5, 10, 25])
def test_stamps_of_arrival_are_spread_over_their_packets(tmp_path, rows):
    """The motion log has the times at which readings were taken."""
    source = pd.read_csv(EDGES / "b4_force_10.csv")
    taken_s = 0.02 * np.arange(len(source))
    packet, place = np.divmod(np.arange(len(source)), rows)
    last = np.minimum((packet + 1) * rows, len(source)) - 1
    source["Time (s)"] = taken_s[last] + 1e-4 * place
    logs = tmp_path / "logs"
    logs.mkdir()
    source.to_csv(logs / "force.csv", index=False)
    folder = campaign_around(tmp_path / "lab", logs / "force.csv")
    shutil.copyfile(EDGES / "b4_motion.csv", folder.root / "raw" / "b4_motion.csv")
    sheet = folder.root / "config" / "runs.csv"
    sheet.write_text(sheet.read_text().rstrip().removesuffix("force.csv") + "b4_motion.csv\n")
    fit, flags = measured(folder)
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=5e-3), fit["reason"]
    assert "stamps-of-arrival" in flags
    assert "gaps" not in flags


@pytest.mark.parametrize(("name", "rows_lost"), [("s10_void.csv", True), ("s5_de.csv", False)])
def test_a_table_of_stress_at_the_edge(tmp_path, name, rows_lost):
    shutil.copyfile(EDGES / name, tmp_path / name)
    Folder(tmp_path).rftfit("init", "lab", "--stress-table", name)
    folder = Folder(tmp_path / "lab")
    run_rules(folder.config, "ingest", "tare", "slopes", "checks")
    (table,) = (path.name for path in (folder.root / "results" / "fits").glob("*.csv"))
    assert folder.table(f"fits/{table}")["alpha_z_N_per_cm3"][0] == pytest.approx(1.2, rel=1e-3)
    assert ("rows-alone" in set(folder.table(f"flags/{table}")["code"])) == rows_lost
