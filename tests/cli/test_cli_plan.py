"""`rftfit plan` writes rows of a run sheet, in directions that the rig can push."""

import csv

import pytest

pytestmark = pytest.mark.usefixtures("work_folder")


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


def test_a_plan_keeps_to_the_angles_of_the_rig(rftfit, work_folder):
    rftfit("plan --count 3 --beta 0,15 --gamma=-45,45,90")
    rows = list(csv.DictReader((work_folder / "plan.csv").read_text().splitlines()))
    assert {row["beta_deg"] for row in rows} <= {"0", "15"}
    assert {row["gamma_deg"] for row in rows} <= {"-45", "45", "90"}
