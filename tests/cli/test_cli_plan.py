"""`rftfit plan` and `rftfit scale --pushes` give the library's numbers or name wrong input."""

import csv

import pytest
from result_tables import LABORATORY, SAND, make_campaign, one_cell

from rftfit import reference

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
