from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from rftfit.campaign.reading import plain_path

if TYPE_CHECKING:
    from .conftest import Room


def test_a_missing_log_is_a_warning_with_the_nearest_name(room: Room) -> None:
    (room.folder / "raw/logs/p1_force.csv").rename(room.folder / "raw/logs/p1_Force.CSV")
    text = room.only("sheet.log-missing")
    assert text == (
        "runs.csv, row 2, column force_log: found 'logs/p1_force.csv'; allowed: a file that exists "
        "in the raw folder; this run will be dropped; did you mean 'logs/p1_Force.CSV'?"
    )
    assert room.check()[0].severity == "warning"


def test_a_missing_log_of_an_excluded_run_needs_no_word(room: Room) -> None:
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
def test_log_paths(
    room: Room, path: str, code: str, part: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    far = tmp_path_factory.mktemp("far")
    (far / "secret.csv").write_text("", encoding="utf-8")
    raw = room.folder / "raw"
    (raw / "out").symlink_to(far)
    (raw / "out.csv").symlink_to(far / "secret.csv")
    (raw / "loop.csv").symlink_to(raw / "loop.csv")
    os.mkfifo(raw / "pipe")
    room.rows["p1"]["force_log"] = path
    text = room.only(code)
    assert "row 2, column force_log" in text
    assert part in text


def test_a_link_within_raw_is_a_log(room: Room) -> None:
    (room.folder / "raw/other").symlink_to(room.folder / "raw/logs")
    room.rows["p1"]["force_log"] = "other/p1_force.csv"
    assert room.check() == []


@pytest.mark.parametrize(
    "path", ["logs/p1_motion.csv", "./logs//P1_Motion.csv", "logs/./p1_motion.csv"]
)
def test_one_file_named_twice_in_a_row(room: Room, path: str) -> None:
    room.rows["p1"]["force_log"] = path
    found = [problem for problem in room.check() if problem.code == "sheet.shared-file"]
    assert len(found) == 1
    assert "row 2, column motion_log" in str(found[0])
    assert "force_log of this row names this one" in str(found[0])


def test_one_file_named_by_two_runs(room: Room) -> None:
    room.rows["t1"]["force_log"] = room.rows["p1"]["force_log"]
    text = room.only("sheet.shared-file")
    assert text == (
        "runs.csv, row 3, column force_log: found 'logs/p1_force.csv'; allowed: a file of its own; "
        "force_log of row 2 names this one"
    )


def test_paths_are_kept_in_their_plain_form(room: Room) -> None:
    room.rows["p1"]["force_log"] = "./logs//p1_force.csv"
    assert room.campaign().by_id["p1"].force_log == "logs/p1_force.csv"


def test_names_with_blanks_and_accents_are_fine(room: Room) -> None:
    room.rows["p1"]["force_log"] = "Läufe im Mai/p 1.csv"
    room.touch("Läufe im Mai/p 1.csv")
    assert room.check() == []
    assert plain_path("a..b/c") == ("a..b/c", "", None)
