from __future__ import annotations

import pytest

from rftfit.campaign.problems import Place


def test_an_unknown_tare_has_a_nearest(room):
    room.rows["p1"]["tare_run"] = "t_1"
    (found,) = (problem for problem in room.check() if problem.code == "sheet.tare-unknown")
    assert (found.place, found.found) == (Place("runs.csv", 2, "tare_run"), "t_1")
    assert found.nearest == "t1"


@pytest.mark.parametrize(
    ("run", "tare", "text"),
    [
        ("p1", "h1", "a rod run for a plate run; h1 (row 4) is a plate run"),
        ("p1", "p1", "a rod run for a plate run; p1 (row 2) is a plate run"),
        ("p1", "a1", "a rod run for a plate run; a1 (row 7) is a leg_air run"),
        ("c1", "t1", "a leg_air run for a leg run; t1 (row 3) is a rod run"),
    ],
)
def test_a_tare_of_the_wrong_kind(room, run, tare, text):
    room.rows[run]["tare_run"] = tare
    found = [problem for problem in room.check() if problem.severity == "error"]
    assert [problem.code for problem in found] == ["sheet.tare-kind"]
    assert text in found[0].allowed


@pytest.mark.parametrize(
    ("run", "column", "value"),
    [
        ("t1", "medium", "poppy_CP"),
        ("t1", "beta_deg", "-30"),
        ("t1", "gamma_deg", "45.1"),
        ("t1", "direction", "extraction"),
        ("t1", "intruder", "disc"),
        ("th", "depth_cm", "5.08"),
        ("a1", "intruder", "flat_leg"),
    ],
)
def test_the_tare_must_match(room, run, column, value):
    own = room.rows[run][column]
    room.rows[run][column] = value
    problem = room.only(f"sheet.tare-{column.partition('_')[0]}")
    row = 2 + list(room.rows).index(run)
    assert f"{column} is {own} here and {value} in {run} (row {row})" in problem.allowed


def test_several_differences_are_several_messages(room):
    room.rows["t1"].update(medium="poppy_CP", beta_deg="0", gamma_deg="90")
    codes = [problem.code for problem in room.check()]
    assert codes == ["sheet.tare-medium", "sheet.tare-beta", "sheet.tare-gamma"]


@pytest.mark.parametrize(
    ("own", "other"), [("-90", "90"), ("90", "-90.0"), ("18.43", "18.435"), ("3e1", "30")]
)
def test_angles_that_mean_the_same(room, own, other):
    room.rows["p1"]["beta_deg"], room.rows["t1"]["beta_deg"] = own, other
    assert room.check() == []


def test_a_shared_tare_must_be_said_on_each_run(room):
    room.add("p2", "p1", tare_shared="yes")
    problem = room.only("sheet.tare-shared")
    assert problem.place == Place("runs.csv", 2, "tare_shared")
    assert "t1 (rows 2, 8)" in problem.allowed
    room.rows["p1"]["tare_shared"] = "yes"
    assert room.check() == []


def test_an_excluded_run_does_not_make_a_tare_shared(room):
    room.add("p2", "p1", excluded="yes", reason="arm stopped")
    assert room.check() == []


@pytest.mark.parametrize("run", ["p1", "c1"])
def test_no_tare_is_a_warning(room, run):
    room.rows[run]["tare_run"] = ""
    found = {problem.code: problem for problem in room.check()}
    assert set(found) == {"sheet.tare-missing", "sheet.tare-unused"}
    assert found["sheet.tare-missing"].severity == "warning"
    assert "NaN" in found["sheet.tare-missing"].allowed


def test_no_tare_anywhere_is_one_warning(room):
    for name in ("t1", "th", "a1"):
        del room.rows[name]
    for name in ("p1", "h1", "c1"):
        room.rows[name]["tare_run"] = ""
    many = [problem.code for problem in room.check()]
    assert many == ["sheet.tare-missing"] * 3
    plain = room.config
    room.config = plain + "\nfit: {missing_tare: flag}\n"
    problem = room.only("sheet.tare-missing")
    assert problem.allowed.startswith("no tare in any of 3 runs: they will come out with the force")
    # without a rod, as in a simulation, there is nothing to warn of
    room.config = plain + "\nfit: {missing_tare: none}\n"
    assert room.check() == []


def test_an_excluded_run_needs_no_tare(room):
    room.add("p2", "p1", tare_run="", excluded="yes", reason="arm stopped")
    assert room.check() == []


def test_an_excluded_tare_is_a_warning(room):
    room.rows["t1"].update(excluded="yes", reason="hit the wall")
    problem = room.only("sheet.tare-excluded")
    assert "t1 (row 3) is excluded" in problem.allowed
    assert problem.severity == "warning"
