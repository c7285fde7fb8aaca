"""`rftfit check` reports all problems of a robot's file, trial sheet and tracks at once."""

import json
import shutil
from collections import defaultdict
from pathlib import Path

import pytest
import yaml
from makers import run_command, write_yaml

import rftfit

PROJECT = Path(__file__).parents[2]
RUNS = (
    "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
    "p1,plate,poppy_LP,plate,intrusion,0,90,p1_f.csv,p1_m.csv\n"
)
ROBOT_SHEET = "raw/paper/robot/runs.csv"
HEAD = "run_id,condition,medium,curvature_times_R,frequency_Hz,track\n"
"""Header of the robot's trial sheet."""
TRACK = "raw/paper/robot/tracks/a1.csv"
ROBOT = {"medium": "poppy_LP"}
GOOD = "a1,a,poppy_LP,1,2,tracks/a1.csv\na2,a,poppy_LP,1,,tracks/a2.csv\n"
"""Two rows without a fault."""


@pytest.fixture
def root(tmp_path):
    root = tmp_path / "campaign"
    tracks = root / "raw" / "paper" / "robot" / "tracks"
    tracks.mkdir(parents=True)
    (root / "config").mkdir()
    shutil.copy(PROJECT / "config" / "config.yaml", root / "config")
    (root / "raw" / "paper" / "runs.csv").write_text(RUNS, "utf-8")
    for name in ("a1", "a2"):
        (tracks / f"{name}.csv").write_text("t_s,x_cm,z_cm\n0,0,0\n", "utf-8")
    (tracks.parent / "runs.csv").write_text(HEAD + GOOD, "utf-8")
    return root


def edit(root, **values):
    path = root / "config" / "config.yaml"
    write_yaml(path, yaml.safe_load(path.read_text("utf-8")) | values)


def problems_of(root):
    """Exit code; code, row or line, column or key and nearest word of each problem, by file."""
    checked = run_command(root, "check", "--json")
    problems = defaultdict(list)
    for problem in json.loads(checked.stdout)["problems"]:
        place = problem["place"]
        where = place["row"] or place["line"], place["column"] or place["key"]
        problems[place["file"]].append((problem["code"], *where, problem["nearest"]))
    return checked.returncode, problems


def test_a_good_robot_is_counted(root):
    assert all(file.startswith("raw/paper/runs.csv") for file in problems_of(root)[1])
    assert "poppy_LP: 2 trials" in run_command(root, "check", expected_code=0).stdout


def test_every_problem_of_sheet_file_and_tracks_at_once(root):
    rows = (
        "a1,a,poppy_LP,1,,tracks/a1.csv\n"
        "A1,b,poppy_LP,0,,tracks/b.csv\n"
        "b1,a,poppy_LP,0.5,,tracks/c.csv\n"
        "b2,b,poppy,2,fast,tracks/d.csv\n"
        "b3,,poppy_LP,0,-1,../a1.csv\n"
        "p1,d,poppy_LP,0,,tracks/a1.csv\n"
        "b5,e,poppy_LP,0,,\n"
        "a2,f,poppy_LP,0,200,tracks/a_2.csv\n"
    )
    (root / ROBOT_SHEET).write_text(HEAD + rows, "utf-8")
    for name in "bcd":
        shutil.copy(root / TRACK, (root / TRACK).with_name(f"{name}.csv"))
    text = (PROJECT / "config" / "robot.yaml").read_text("utf-8")
    robot_text = text.replace("mass_g: 150", "mass_g: 0")
    (root / "config" / "mine.yaml").write_text(robot_text, "utf-8")
    robot = {"medium": "poppy_LP", "runs": "paper/robot/runs.csv", "file": "config/mine.yaml"}
    edit(root, robot=robot, raw="raw", run_sheet="raw/paper/runs.csv")
    # the campaign's own sheet is wrong as well: that hides nothing
    campaign_sheet = root / "raw" / "paper" / "runs.csv"
    campaign_sheet.write_text(RUNS.replace("plate,intrusion", "plait,intrusion"), "utf-8")
    code, problems = problems_of(root)
    assert code == 2
    assert problems[ROBOT_SHEET] == [
        ("robot-sheet.repeated", 3, "run_id", None),
        ("robot-sheet.condition", 4, "curvature_times_R", None),
        ("robot-sheet.unknown-word", 5, "medium", "poppy_LP"),
        ("robot-sheet.out-of-range", 5, "curvature_times_R", None),
        ("robot-sheet.not-a-number", 5, "frequency_Hz", None),
        ("robot-sheet.required", 6, "condition", None),
        ("robot-sheet.out-of-range", 6, "frequency_Hz", None),
        ("robot-sheet.path-outside", 6, "track", None),
        ("robot-sheet.repeated", 7, "track", None),
        ("robot-sheet.taken", 7, "run_id", None),
        ("robot-sheet.required", 8, "track", None),
        ("robot-sheet.out-of-range", 9, "frequency_Hz", None),
        ("robot-sheet.track-missing", 9, "track", "tracks/a2.csv"),
    ]
    of_sheet = [problem for problem in rftfit.check(root) if problem.place.file == ROBOT_SHEET]
    assert [problem.found for problem in of_sheet[:5]] == ["A1", "0.5", "poppy", "2", "fast"]
    # where the first one stands
    assert all("row 2" in problem.allowed for problem in of_sheet[:2])
    assert problems["config/mine.yaml"] == [("config.out-of-range", 13, "body.mass_g", None)]
    assert ("sheet.unknown-word", 2, "intruder", "plate") in problems["raw/paper/runs.csv"]


@pytest.mark.parametrize(
    ("head", "rows", "faults"),
    [
        (
            HEAD.replace("curvature_times_R", "curvature_tmes_R"),
            GOOD,
            [
                ("unknown-column", 1, "curvature_tmes_R", "curvature_times_R"),
                ("missing-column", 1, "curvature_times_R", None),
            ],
        ),
        (HEAD, "", [("empty", None, None, None)]),
        (
            HEAD.replace("frequency_Hz", "track"),
            "a1,a,poppy_LP,1,tracks/a1.csv,tracks/a1.csv\n",
            [("duplicate-column", 1, "track", None)],
        ),
    ],
)
def test_columns_of_the_sheet(root, head, rows, faults):
    (root / ROBOT_SHEET).write_text(head + rows, "utf-8")
    problems = problems_of(root)[1][ROBOT_SHEET]
    assert problems == [(f"robot-sheet.{code}", *place) for code, *place in faults]


def test_a_missing_track_is_a_warning_and_a_link_out_of_raw_an_error(root, tmp_path):
    track = root / "raw" / "paper" / "robot" / "tracks" / "a2.csv"
    track.unlink()
    code, problems = problems_of(root)
    assert code == 0
    assert problems[ROBOT_SHEET] == [("robot-sheet.track-missing", 3, "track", "tracks/a1.csv")]
    (tmp_path / "elsewhere.csv").write_text("t_s,x_cm,z_cm\n", "utf-8")
    try:
        track.symlink_to(tmp_path / "elsewhere.csv")
    except OSError:
        pytest.skip("links cannot be made here")
    code, problems = problems_of(root)
    assert code == 2
    assert problems[ROBOT_SHEET] == [("robot-sheet.path-outside", 3, "track", None)]


def test_without_a_robot_or_its_medium_there_is_nothing_to_check(root):
    (root / "raw" / "paper" / "robot" / "runs.csv").write_text("nonsense\n", "utf-8")
    sheet = root / "raw" / "paper" / "runs.csv"
    assert ROBOT_SHEET in problems_of(root)[1]
    sheet.write_text(RUNS.replace("poppy_LP", "poppy_CP"), "utf-8")
    assert ROBOT_SHEET not in problems_of(root)[1]


@pytest.mark.parametrize(
    ("robot", "code", "key", "value"),
    [
        ({"medium": "poppy"}, "inconsistent", "robot", "'poppy'; allowed: "),
        ({"medium": "yuma"}, "inconsistent", "robot", "'yuma'; allowed: "),
        (ROBOT | {"runs": "robot/rums.csv"}, "robot-file", "robot.runs", "'robot/runs.csv'?"),
        (ROBOT | {"file": "../robot.yaml"}, "robot-file", "robot.file", "'../robot.yaml'; "),
        (ROBOT | {"fil": "x"}, "unknown-key", "robot.fil", "'file'?"),
    ],
)
def test_bad_sections_of_the_config(root, robot, code, key, value):
    edit(root, robot=robot)
    (problem,) = (
        problem
        for problem in rftfit.check(root)
        if problem.severity == "error" and problem.code.startswith("config.")
    )
    assert (problem.code, problem.place.key) == (f"config.{code}", key)
    assert value in str(problem)
