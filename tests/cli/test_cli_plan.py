"""`rftfit plan` and `rftfit scale --pushes` give the library's numbers or name wrong input."""

import csv
import json

import pytest
from light_campaign import LABORATORY, SAND, make_campaign, one_cell

import rftfit as program
from rftfit import reference
from rftfit.campaign.tables import pushes_in

PUSHES = """beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3,se_z
0,90,0.35,,0.01
30,45,0.30,0.10,
60,18.43,0.08,0.17,
"""


@pytest.fixture(autouse=True)
def work_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pushes.csv").write_text(PUSHES, "utf-8")
    return tmp_path


def test_scale_writes_the_map_of_its_pushes(rftfit, work_folder):
    output = rftfit("scale --pushes pushes.csv --output sand.csv")
    assert output.out.count("0.000 (by symmetry)") == 4
    expected = program.estimate_map(pushes_in(work_folder / "pushes.csv")[0])
    assert f"zeta {expected.zeta[0]:.4f}" in output.out
    assert "by the paper's routine from (0, 90) deg alone" in output.out
    assert "Agreement with the shape of the known media" in output.out
    assert not output.err
    lines = (work_folder / "sand.csv").read_text().splitlines()
    assert lines[0].startswith("# alpha table written by rftfit scale")
    rows = list(csv.DictReader(lines[3:]))
    table = expected.table()
    assert len(rows) == len(table)
    for row, expected_row in zip(rows, table.to_dict("records"), strict=True):
        assert row["source"] == expected_row["source"]
        for name in ("alpha_z_N_per_cm3", "alpha_x_lo_N_per_cm3", "alpha_z_hi_N_per_cm3"):
            assert float(row[name]) == pytest.approx(expected_row[name], abs=2e-6)
    measured = [(row["beta_deg"], row["gamma_deg"]) for row in rows if row["source"] == "measured"]
    assert measured == [("0.00", "90.00"), ("30.00", "45.00"), ("60.00", "18.43")]


def test_scale_warns_of_a_medium_that_does_not_belong(rftfit, work_folder):
    wrong = PUSHES.replace("0.30,0.10", "0.30,0.60").replace("0.08,0.17", "0.08,0.70")
    (work_folder / "wrong.csv").write_text(wrong, "utf-8")
    output = rftfit("scale --pushes wrong.csv --json")
    assert "does not belong" in output.err
    content = json.loads(output.out)
    assert content["probability_if_it_belongs"] < 0.03
    assert content["pushes"] == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "found neither of --alpha and --pushes"),
        ("--alpha 0.9 --pushes pushes.csv", "found both"),
        ("--pushes pushes.csv --se 0.1", "columns se_z, se_x"),
        ("--pushes none.csv", "none.csv: "),
        ("--pushes bad.csv", "row 2, column gamma_deg: found '190'; allowed: -90 to 90 deg"),
        ("--pushes bad.csv", "row 3, column alpha_z_N_per_cm3: found 'zz'; allowed: a number"),
        ("--pushes up.csv", "up.csv: the pushes meet no resistance"),
        ("--pushes pushes.csv --output pushes.csv", "this file is read"),
    ],
)
def test_scale_refuses(refusal, work_folder, words, message):
    head = PUSHES.splitlines()[0]
    (work_folder / "bad.csv").write_text(f"{head}\n0,190,0.3,0,\n30,45,zz,0.1,\n", "utf-8")
    (work_folder / "up.csv").write_text(f"{head}\n0,90,-0.3,0,\n", "utf-8")
    assert message in refusal("scale", words)


def test_plan_prints_what_the_library_plans(rftfit, work_folder):
    output = rftfit("plan --leg c_leg --pushes pushes.csv --count 4 --json")
    known_map = program.estimate_map(pushes_in(work_folder / "pushes.csv")[0])
    expected = program.plan(program.model_leg("c_leg"), known_map, count=4).table()
    content = json.loads(output.out)
    widths = [row["half_width_percent"] for row in content["pushes"]]
    assert widths == pytest.approx(expected["half_width_percent"].tolist(), rel=1e-6)
    assert [row["beta_deg"] for row in content["pushes"]][1:] == pytest.approx(
        expected["beta_deg"].tolist()[1:]
    )
    assert content["parts"] == ["c_leg, lift", "c_leg, horizontal"]


def test_rows_of_a_plan_are_rows_of_a_run_sheet(rftfit, work_folder):
    output = rftfit("plan --target legs --pairs --count 6 --figure plan.png")
    assert (work_folder / "plan.png").read_bytes().startswith(b"\x89PNG")
    (work_folder / "photo.png").write_bytes(b"of the rig")
    output = rftfit("plan --target legs --count 1 --figure photo.png", code=2)
    assert "not written by rftfit plan" in output.err
    rows = list(csv.DictReader((work_folder / "plan.csv").read_text().splitlines()))
    assert len({row["run_id"] for row in rows}) == len(rows)
    for row in rows:
        gamma = float(row["gamma_deg"])
        assert row["kind"] == "plate"
        assert row["direction"] == ("horizontal" if gamma == 0 else row["direction"])
        assert bool(row["depth_cm"]) == (row["direction"] == "horizontal")
        assert 0 <= gamma <= 90  # the way back is an extraction along the same path
    ways = {row["direction"] for row in rows}
    assert {"intrusion", "extraction"} <= ways


def test_a_plan_goes_on_from_a_campaign(rftfit, work_folder):
    roles = {"full": LABORATORY, "sand": SAND}
    alpha = {"full": reference.alpha_grid("poppy_LP"), "sand": one_cell(0.7)}
    make_campaign(work_folder / "c", roles, alpha)
    output = rftfit("plan --results c --medium sand --count 2 --beta 0,15 --gamma=-45,45,90")
    assert "1 made already" in output.out
    rows = list(csv.DictReader((work_folder / "plan.csv").read_text().splitlines()))
    assert {row["beta_deg"] for row in rows} <= {"0", "15"}
    assert {row["gamma_deg"] for row in rows} <= {"-45", "45", "90"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--target zetta", "did you mean 'zeta'"),
        ("--target map --leg c_leg", "found --target and a body"),
        ("--hip 2", "belong to a body"),
        ("--medium sand", "--results DIR with --medium NAME"),
        ("--beta 0,95", "--beta: found 95; allowed: -90 to 90 degrees"),
        ("--confidence 2", "--confidence: found 2"),
        ("--error-percent 0", "--error-percent: found 0"),
        ("--figure plan.doc", "ends in .png, .pdf or .svg"),
    ],
)
def test_plan_refuses(refusal, words, message):
    assert message in refusal("plan", words)
