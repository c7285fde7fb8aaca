from __future__ import annotations

import os

import pytest

from rftfit.campaign.files import plain_path
from rftfit.campaign.problems import Place


def test_a_missing_log_is_a_warning_with_the_nearest_name(room):
    (room.folder / "raw/logs/p1_force.csv").rename(room.folder / "raw/logs/p1_Force.CSV")
    problem = room.only("sheet.log-missing")
    assert problem.place == Place("runs.csv", 2, "force_log")
    assert problem.found == "logs/p1_force.csv"
    assert problem.nearest == "logs/p1_Force.CSV"
    assert problem.severity == "warning"


def test_a_missing_log_of_an_excluded_run_needs_no_word(room):
    room.rows["p1"].update(excluded="yes", reason="log lost")
    (room.folder / "raw/logs/p1_force.csv").unlink()
    assert room.check() == []


@pytest.mark.parametrize(
    ("path", "code", "part"),
    [
        ("../runs.csv", "sheet.path-outside", "without .."),
        ("logs/../logs/p1_force.csv", "sheet.path-outside", "without .."),
        ("/etc/hosts", "sheet.path-outside", "not an absolute one"),
        ("~/p1.csv", "sheet.path-outside", "not an absolute one"),
        ("C:/logs/p1.csv", "sheet.path-outside", "not an absolute one"),
        (r"logs\p1_force.csv", "sheet.backslash", "did you mean 'logs/p1_force.csv'?"),
        ("logs/p1\x00.csv", "sheet.path", "control characters"),
        ("logs", "sheet.log-not-a-file", "this is a folder"),
        (".", "sheet.log-not-a-file", "this is a folder"),
        ("pipe", "sheet.log-not-a-file", "no regular file"),
        ("out/secret.csv", "sheet.path-outside", "a link leads out"),
        ("out.csv", "sheet.path-outside", "a link leads out"),
        ("loop.csv", "sheet.log-missing", "a file that exists"),
        ("x" * 5000, "sheet.log-missing", "a file that exists"),
    ],
)
def test_log_paths(room, path, code, part, tmp_path_factory):
    far = tmp_path_factory.mktemp("far")
    (far / "secret.csv").write_text("", encoding="utf-8")
    raw = room.folder / "raw"
    (raw / "out").symlink_to(far)
    (raw / "out.csv").symlink_to(far / "secret.csv")
    (raw / "loop.csv").symlink_to(raw / "loop.csv")
    os.mkfifo(raw / "pipe")
    room.rows["p1"]["force_log"] = path
    problem = room.only(code)
    assert problem.place == Place("runs.csv", 2, "force_log")
    assert part in str(problem)


def test_a_link_within_raw_is_a_log(room):
    (room.folder / "raw/other").symlink_to(room.folder / "raw/logs")
    room.rows["p1"]["force_log"] = "other/p1_force.csv"
    assert room.check() == []


SAME_CLOCK = "clock: {method: same_clock}\n"


@pytest.mark.parametrize("path", ["logs/p1_motion.csv", "logs/./p1_motion.csv"])
def test_one_file_for_force_and_motion_needs_one_clock(room, path):
    room.rows["p1"]["force_log"] = path
    for method in ("sync_line", "estimate"):
        room.config += f"clock: {{method: {method}}}\n"
        (found,) = room.check()
        assert (found.code, found.place) == ("sheet.one-file", Place("runs.csv", 2, "motion_log"))
        assert found.allowed.endswith(f"found {method}")
        room.config = room.config.replace(f"clock: {{method: {method}}}\n", "")
    room.config += SAME_CLOCK
    run = room.campaign().by_id["p1"]
    assert run.force_log == run.motion_log == "logs/p1_motion.csv"


@pytest.mark.parametrize("path", ["logs/p1_force.csv", "logs/./p1_force.csv"])
def test_one_file_of_the_rigid_contact_needs_one_clock_too(room, path):
    contact = f"rigid_contact: {{force_log: logs/p1_force.csv, motion_log: {path}}}\n"
    room.config += contact
    problem = room.only("config.one-file")
    assert problem.place.key == "rigid_contact.motion_log"
    assert problem.found == path
    room.config += SAME_CLOCK
    assert room.check() == []


def test_logs_of_the_rigid_contact_that_some_disks_take_for_the_same(room):
    room.touch("logs/P1_FORCE.csv")
    room.config += "rigid_contact: {force_log: logs/p1_force.csv, motion_log: logs/P1_FORCE.csv}\n"
    assert room.only("config.shared-file").place.key == "rigid_contact.motion_log"


def test_a_broken_config_leaves_the_question_of_clocks_open(room):
    room.rows["p1"]["force_log"] = room.rows["p1"]["motion_log"]
    room.config += "clock: {method: same}\n"
    assert [problem.place.file for problem in room.check()] == ["config/config.yaml"]


def test_names_of_one_row_that_some_disks_take_for_the_same(room):
    room.config += SAME_CLOCK
    room.rows["p1"]["force_log"] = "./logs//P1_Motion.csv"
    found = [problem for problem in room.check() if problem.code == "sheet.shared-file"]
    assert [problem.place for problem in found] == [Place("runs.csv", 2, "motion_log")]


@pytest.mark.parametrize("both", [True, False])
def test_one_file_of_two_runs_is_refused_on_one_clock_too(room, *, both):
    room.config += SAME_CLOCK
    for name in ("p1", "t1") if both else ("p1",):
        room.rows[name]["motion_log"] = room.rows["p1"]["force_log"]
    room.rows["t1"]["force_log"] = room.rows["p1"]["force_log"]
    found = room.check()
    assert {problem.code for problem in found} == {"sheet.shared-file"}
    assert {problem.place.row for problem in found} == {3}


def test_a_push_and_its_pull_back_may_be_one_file(room):
    """Both are the first stroke along their own path; without the stroke it is taken for a slip."""
    room.add("p1_back", "p1", direction="extraction", tare_run="")
    room.rows["p1_back"] |= {name: room.rows["p1"][name] for name in ("force_log", "motion_log")}
    assert {problem.code for problem in room.check()} >= {"sheet.shared-file"}
    for name in ("p1", "p1_back"):
        room.rows[name]["stroke"] = "1"
    assert {problem.code for problem in room.check()} == {"sheet.tare-missing"}


@pytest.mark.parametrize(
    ("rows", "refused"),
    [([("1", "intrusion", "45"), ("1", "intrusion", "90")], []),
     ([("1", "intrusion", "45"), ("2", "intrusion", "45"), ("1", "extraction", "45")], []),
     # both would be found along either way
     ([("1", "intrusion", "45"), ("1", "intrusion", "48")], ["p2"]),
     ([("1", "extraction", "90"), ("1", "extraction", "-90")], ["p2"]),
     ([("1", "intrusion", "45"), ("2", "intrusion", "45"), ("2", "intrusion", "45")], ["p3"])],
)  # fmt: skip
def test_strokes_of_one_log(room, rows, refused):
    first, names = room.rows["p1"], [f"p{k}" for k in range(1, len(rows) + 1)]
    del room.rows["t1"]
    for name, (stroke, direction, gamma) in zip(names, rows, strict=True):
        if name != "p1":
            room.add(name, "p1")
        room.rows[name] |= {one: first[one] for one in ("force_log", "motion_log")}
        room.rows[name] |= {
            "stroke": stroke,
            "direction": direction,
            "gamma_deg": gamma,
            "tare_run": "",
        }
    found = {one.place.row for one in room.check() if one.code == "sheet.shared-file"}
    assert found == {2 + list(room.rows).index(name) for name in refused}


def test_one_file_named_by_two_runs(room):
    room.rows["t1"]["force_log"] = room.rows["p1"]["force_log"]
    problem = room.only("sheet.shared-file")
    assert (problem.place, problem.found) == (
        Place("runs.csv", 3, "force_log"),
        "logs/p1_force.csv",
    )
    assert "force_log of row 2" in problem.allowed


def test_paths_are_kept_in_their_plain_form(room):
    room.rows["p1"]["force_log"] = "./logs//p1_force.csv"
    assert room.campaign().by_id["p1"].force_log == "logs/p1_force.csv"


def test_names_with_blanks_and_accents_are_fine(room):
    room.rows["p1"]["force_log"] = "Läufe im Mai/p 1.csv"
    room.touch("Läufe im Mai/p 1.csv")
    assert room.check() == []
    assert plain_path("a..b/c") == "a..b/c"
