"""Every log that a run sheet names must lie in raw/ and serve one run, or a problem names its cell.

Two runs may share a log only where they are different strokes of it (column `stroke`).
"""

import os
import re

import pytest


def test_a_missing_log_is_a_warning_with_the_nearest_name(room):
    (room.folder / "raw/logs/p1_force.csv").rename(room.folder / "raw/logs/p1_Force.CSV")
    problem = room.only("sheet.log-missing")
    assert (problem.place.row, problem.place.column) == (2, "force_log")
    assert (problem.found, problem.nearest) == (FORCE, "logs/p1_Force.CSV")
    assert problem.severity == "warning"


@pytest.mark.parametrize("target", ["p1_force.csv", "gone.csv"])
def test_a_link_that_leads_nowhere_is_no_name_that_was_meant(room, target):
    log = room.folder / "raw/logs/p1_force.csv"
    log.unlink()
    log.symlink_to(target)
    assert room.only("sheet.log-missing").nearest != "logs/p1_force.csv"


def test_a_missing_log_of_an_excluded_run_needs_no_word(room):
    room.rows["p1"].update(excluded="yes", reason="log lost")
    (room.folder / "raw/logs/p1_force.csv").unlink()
    assert room.check() == []


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("../runs.csv", "sheet.path-outside"),
        ("logs/../logs/p1_force.csv", "sheet.path-outside"),
        ("/etc/hosts", "sheet.path-outside"),
        ("~/p1.csv", "sheet.path-outside"),
        ("C:/logs/p1.csv", "sheet.path-outside"),
        (r"logs\p1_force.csv", "sheet.backslash"),
        ("logs/p1\x00.csv", "sheet.path"),
        ("logs", "sheet.log-not-a-file"),
        (".", "sheet.log-not-a-file"),
        ("pipe", "sheet.log-not-a-file"),
        ("out/secret.csv", "sheet.path-outside"),
        ("out.csv", "sheet.path-outside"),
        ("loop.csv", "sheet.log-missing"),
        ("x" * 5000, "sheet.log-missing"),
    ],
)
def test_log_paths(room, path, code, tmp_path_factory):
    outside_folder = tmp_path_factory.mktemp("far")
    (outside_folder / "secret.csv").write_text("", "utf-8")
    raw = room.folder / "raw"
    (raw / "out").symlink_to(outside_folder)
    (raw / "out.csv").symlink_to(outside_folder / "secret.csv")
    (raw / "loop.csv").symlink_to(raw / "loop.csv")
    os.mkfifo(raw / "pipe")
    room.rows["p1"]["force_log"] = path
    problem = room.only(code)
    assert (problem.place.row, problem.place.column) == (2, "force_log")
    assert code != "sheet.backslash" or problem.nearest == FORCE


ONE, SYNC, ESTIMATE = (
    f"clock: {{method: {method}}}\n" for method in ("same_clock", "sync_line", "estimate")
)
"""Lines of the config, each with another method for the clocks."""
F, M, S = "force_log", "motion_log", "stroke"
"""Columns of the run sheet: the two logs of a run, and the number of its stroke in them."""
FORCE, MOTION, UPPER = "logs/p1_force.csv", "logs/p1_motion.csv", "logs/P1_FORCE.csv"
"""Paths of logs below raw/."""
BOTH = {F: FORCE, M: MOTION, "tare_run": ""}


def contact(path):
    return f"rigid_contact: {{force_log: {FORCE}, motion_log: {path}}}\n"


def stroke(number, gamma, direction="intrusion"):
    return BOTH | {S: number, "gamma_deg": gamma, "direction": direction}


@pytest.mark.parametrize(
    ("change", "config", "codes"),
    [
        # force and motion in one file need one clock
        *(
            ({"p1": {F: path}}, clock, [("one-file", 2, M)])
            for path in (MOTION, "logs/./p1_motion.csv")
            for clock in (SYNC, ESTIMATE)
        ),
        *(({"p1": {F: path}}, ONE, []) for path in (MOTION, "logs/./p1_motion.csv")),
        *(
            ({}, contact(path), [("rigid_contact.motion_log", "one-file")])
            for path in (FORCE, "logs/./p1_force.csv")
        ),
        *(({}, contact(path) + ONE, []) for path in (FORCE, "logs/./p1_force.csv")),
        ({}, contact(UPPER), [("rigid_contact.motion_log", "shared-file")]),
        ({"p1": {F: MOTION}}, "clock: {method: same}\n", [("clock.method", "unknown-word")]),
        ({"p1": {F: "./logs//P1_Motion.csv"}}, ONE, [("log-missing", 2, F), ("shared-file", 2, M)]),
        # no two runs have a log in common
        ({"t1": {F: FORCE}}, "", [("shared-file", 3, F)]),
        ({"p1": {M: FORCE}, "t1": {F: FORCE}}, ONE, [("shared-file", 3, F)]),
        (
            {"p1": {M: FORCE}, "t1": {F: FORCE, M: FORCE}},
            ONE,
            [("shared-file", 3, F), ("shared-file", 3, M)],
        ),
        # but for strokes of one log that cannot be taken for one another
        (
            {"b<p1": BOTH | {"direction": "extraction"}},
            "",
            [("shared-file", 8, F), ("shared-file", 8, M)],
        ),
        ({"p1": {S: "1"}, "b<p1": stroke("1", "45", "extraction")}, "", []),
        ({"p1": {S: "1"}, "p2<p1": stroke("1", "90")}, "", []),
        (
            {"p1": {S: "1"}, "p2<p1": stroke("2", "45"), "p3<p1": stroke("1", "45", "extraction")},
            "",
            [],
        ),
        (
            {"p1": {S: "1"}, "p2<p1": stroke("1", "48")},
            "",
            [("shared-file", 8, F), ("shared-file", 8, M)],
        ),
        # the default tolerance of the arm holds where the config has an error
        (
            {"p1": {S: "1"}, "p2<p1": stroke("1", "48")},
            "clock: {method: same}\n",
            [("clock.method", "unknown-word"), ("shared-file", 8, F), ("shared-file", 8, M)],
        ),
        (
            {"p1": stroke("1", "90", "extraction"), "p2<p1": stroke("1", "-90", "extraction")},
            "",
            [("shared-file", 8, F), ("shared-file", 8, M)],
        ),
        (
            {"p1": {S: "1"}, "p2<p1": stroke("2", "45"), "p3<p1": stroke("2", "45")},
            "",
            [("shared-file", 9, F), ("shared-file", 9, M)],
        ),
    ],
)
def test_logs_of_rows(room, change, config, codes):
    room.touch(UPPER)
    room.put(change)
    room.config += config
    places, problems = room.list_problems()
    of_config = [(problem.place.key, problem.code[7:]) for problem in problems if problem.place.key]
    of_sheet = [(code[6:], *place) for code, *place in places if code.startswith("sheet")]
    tares = ("tare-missing", "tare-unused")
    assert of_config + [entry for entry in of_sheet if entry[0] not in tares] == codes
    for problem in problems:
        if problem.code == "sheet.shared-file":
            assert re.search("; (force|motion)_log of (row [28]|this row) ", problem.allowed)
        if problem.code.endswith("one-file"):
            assert problem.allowed.endswith(
                f"found {'estimate' if config == ESTIMATE else 'sync_line'}"
            )


@pytest.mark.parametrize(
    ("log", "kept", "config"),
    [
        ("logs/./p1_motion.csv", "logs/p1_motion.csv", ONE),
        ("./logs//p1_force.csv", "logs/p1_force.csv", ""),
        ("Läufe im Mai/a..b/p 1.csv", "Läufe im Mai/a..b/p 1.csv", ""),
        # a link within raw
        ("other/p1_force.csv", "other/p1_force.csv", ""),
    ],
)
def test_paths_are_kept_in_their_plain_form(room, log, kept, config):
    (room.folder / "raw/other").symlink_to(room.folder / "raw/logs")
    room.touch(kept)
    room.put({"p1": {F: log}})
    room.config += config
    assert room.campaign().by_id["p1"].force_log == kept
    assert room.check() == []
