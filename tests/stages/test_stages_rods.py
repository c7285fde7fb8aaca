"""One rod run may be the tare of plates at several angles, and its rows are counted once."""

import re

import pandas as pd
import pytest
from campaigns import make_campaign, run_rules
from log_files import told

from rftfit.campaign.load import check_campaign

MEDIUM = "poppy_LP"
DIRECTIONS = ((0.0, 90.0), (30.0, 90.0), (-30.0, 90.0))


def read_sheet(folder):
    return pd.read_csv(folder.root / "raw/paper/runs.csv", dtype=str, keep_default_na=False)


def write_sheet(folder, table):
    table.to_csv(folder.root / "raw/paper/runs.csv", index=False)


def assert_counted_once(folder, ledger):
    """Rows of the ledger hold each line of their log once, but for those of the header."""
    file = ledger["file"].iloc[0]
    lines = (folder.root / "raw" / "paper" / file).read_text(encoding="utf-8").splitlines()
    assert 0 <= len(lines) - ledger.loc[ledger["file"] == file, "rows"].sum() < 20


def assert_same_alpha(after, before):
    for name in ("alpha_z_N_per_cm3", "alpha_x_N_per_cm3"):
        assert after[name].to_numpy() == pytest.approx(before[name].to_numpy(), abs=0.01)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Three plates at different angles and the rod run of the level one."""
    root = tmp_path_factory.mktemp("rods") / "lab"
    folder = make_campaign(root, (MEDIUM,), plates_only=True, directions=DIRECTIONS)
    run_rules(folder.config, "ingest", "tare", "slopes")
    before = folder.table(f"fits/{MEDIUM}.csv")
    sheet = read_sheet(folder)
    plates, rods = (sheet["kind"] == kind for kind in ("plate", "rod"))
    assert (plates.sum(), rods.sum()) == (3, 3)
    rod = sheet.loc[plates & (sheet["beta_deg"].astype(float) == 0), "tare_run"].iloc[0]
    sheet.loc[plates, "tare_run"] = rod
    sheet.loc[sheet["run_id"] == rod, "beta_deg"] = ""
    write_sheet(folder, sheet[plates | (sheet["run_id"] == rod)])
    return folder, before, rod


def test_a_rod_without_an_angle_is_the_tare_of_every_plate(campaign):
    folder, before, rod = campaign
    checked = folder.rftfit("check")
    assert "0 errors" in checked.stdout, checked.stdout
    run_rules(folder.config, "ingest", "tare", "slopes")
    after = folder.table(f"fits/{MEDIUM}.csv")
    assert_same_alpha(after, before)
    assert (after["tare_run"] == rod).all()


def test_its_rows_are_counted_once(campaign):
    folder, _, rod = campaign
    run_rules(folder.config, last="ledger")
    ledger = folder.table("ledger.csv")
    assert_counted_once(folder, ledger[ledger["run_id"] == rod])


def test_a_rod_with_an_angle_still_is_that_of_its_own_plate(campaign):
    folder, _, rod = campaign
    sheet = read_sheet(folder)
    sheet.loc[sheet["run_id"] == rod, "beta_deg"] = "0"
    write_sheet(folder, sheet)
    problems = check_campaign(folder.config)[1]
    sheet.loc[sheet["run_id"] == rod, "beta_deg"] = ""
    write_sheet(folder, sheet)
    expected = {f"sheet.tare-beta {row} tare_run {rod!r}" for row in (2, 5)}
    assert expected <= {*told(problems)}


@pytest.fixture
def rows_of_one_log(campaign):
    """The sheet with a rod row for each angle, all of which name one log."""
    folder, _, rod = campaign
    kept = read_sheet(folder)
    rods = kept.loc[[kept.index[kept["run_id"] == rod][0]] * len(DIRECTIONS)]
    betas = [f"{beta:g}" for beta, _ in DIRECTIONS]
    rods = rods.assign(run_id=[f"rod_{beta}" for beta in betas], beta_deg=betas)
    plates = kept[kept["kind"] == "plate"]
    tares = [f"rod_{float(beta):g}" for beta in plates["beta_deg"]]
    write_sheet(folder, pd.concat([rods, plates.assign(tare_run=tares)]))
    yield folder
    write_sheet(folder, kept)


def test_rows_that_name_one_rod_log_are_one_run(campaign, rows_of_one_log):
    _, before, _ = campaign
    folder = rows_of_one_log
    output = folder.rftfit("check").stdout
    assert "0 errors" in output, output
    run_rules(folder.config, last="ledger")
    after = folder.table(f"fits/{MEDIUM}.csv")
    assert (after["tare_run"] == "rod_0").all()
    assert_same_alpha(after, before)
    ledger = folder.table("ledger.csv")
    of_rods = ledger[ledger["kind"] == "rod"]
    assert set(of_rods["run_id"]) == {"rod_0"}
    assert_counted_once(folder, of_rods)


@pytest.mark.parametrize(
    ("changes", "differs"),
    [({"gamma_deg": "45"}, "gamma_deg"), ({"excluded": "yes", "reason": "bent"}, "excluded")],
)
def test_rows_of_one_rod_log_must_describe_one_run(rows_of_one_log, changes, differs):
    folder = rows_of_one_log
    sheet = read_sheet(folder)
    sheet.loc[sheet["run_id"] == "rod_30", [*changes]] = [*changes.values()]
    write_sheet(folder, sheet)
    problem = check_campaign(folder.config)[1][0]
    assert told([problem]) == [f"sheet.shared-file 3 force_log {problem.found!r}"]
    assert re.search(rf"force_log of row 2 .* {differs}$", problem.allowed)
