"""The robot's stages turn tracks into the published speeds and a sweep into tables.

Track: the recorded path of a marker on the robot. What cannot be used is given a reason.
"""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import planned_jobs, run_rules
from makers import read_rows, write_rows
from numpy.testing import assert_allclose

from rftfit import reference
from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.errors import InputError
from rftfit.lab.tracks import plan_trials, track_files
from rftfit.results import open_results
from rftfit.robot.speeds import speed_errors
from rftfit.store import write_text
from rftfit.workflow.robot import robot_measured
from rftfit.workflow.state import States, read_states

PROJECT = Path(__file__).parents[2]
ROBOT = {"medium": "poppy_LP"}
SHEET = (
    "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
    "p1,plate,poppy_LP,plate,intrusion,0,90,p1_f.csv,p1_m.csv\n"
)


@pytest.fixture(scope="module")
def made_once(tmp_path_factory):
    root = tmp_path_factory.mktemp("robot é")
    (root / "config").mkdir()
    shutil.copy(PROJECT / "config" / "config.yaml", root / "config")
    raw = root / "raw" / "paper"
    raw.mkdir(parents=True)
    (raw / "runs.csv").write_text(SHEET, "utf-8")
    config = Config(**yaml.safe_load((root / "config" / "config.yaml").read_text("utf-8")))
    for name, text in track_files(config, 2013).items():
        write_text(raw / name, text)
    return root


@pytest.fixture
def root(made_once, tmp_path):
    return Path(shutil.copytree(made_once, tmp_path / "campaign é"))


def measured(root):
    """Tables of tracks, of speeds and of where the rows went, as they are in the files."""
    assert run_rules(root / "config" / "config.yaml", "robot_measured") == 1
    results = open_results(root)
    names = ("robot/tracks.csv", "robot/measured.csv", "ledger/robot.csv")
    trials, speeds, ledger = (results.table(name) for name in names)
    return trials, speeds, ledger


def test_same_seed_same_tracks(root):
    config = load_campaign(root / "config" / "config.yaml").config
    assert track_files(config, 1) == track_files(config, 1)
    trials = plan_trials(config, 1)
    assert len({trial.run_id for trial in trials}) == 42 * 3
    # the trials of a condition are scattered about its published speed
    speeds = pd.DataFrame(trials).groupby("condition")["speed_cm_per_s"].agg(["mean", "std"])
    figure = reference.load("fig_4c").query("stride_frequency_Hz > 0.01")
    assert_allclose(sorted(speeds["mean"]), sorted(figure["speed_cm_per_s"]))
    assert (speeds["std"] > 0).all()


def test_bad_tracks_are_refused_and_accounted_for(root):
    folder = root / "raw" / "paper" / "robot" / "tracks"
    names = [f"robot_kp100_3_{letter}" for letter in "abc"]
    texts = [(folder / f"{name}.csv").read_text("utf-8").splitlines() for name in names]
    texts[0] = texts[0][:40]
    texts[1][50], texts[1][60] = texts[1][60], texts[1][50]
    texts[2][100] = "nan,nan,nan"
    for name, lines in zip(names, texts, strict=True):
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", "utf-8")
    (folder / "robot_kp100_4_a.csv").unlink()
    rows = read_rows(folder.parent / "runs.csv")
    stated = next(row for row in rows if row["run_id"] == "robot_kp100_4_b")
    stated["frequency_Hz"] = "2.5"
    write_rows(folder.parent / "runs.csv", rows)
    trials, speeds, ledger = measured(root)
    table = trials.set_index("run_id")
    assert table.loc["robot_kp100_4_b", ["frequency_Hz", "frequency_from"]].tolist() == [
        2.5,
        "sheet",
    ]
    assert table.loc["robot_kp100_4_c", "frequency_from"] == "track"
    assert table.loc[names[0], "reason_code"] in ("few-strides", "no-stride")
    assert table.loc[names[1], "reason_code"] == "time-backwards"
    assert table.loc[names[2], "status"] == "used"
    assert table.loc["robot_kp100_4_a", "reason_code"] == "track-unreadable"
    counted = ledger.groupby("run_id")["rows"].sum()
    assert list(counted[names]) == [len(lines) - 3 for lines in texts]
    assert counted["robot_kp100_4_a"] == 0
    assert ledger.query("run_id == @names[2] and fate == 'dropped'")["rows"].tolist() == [1]
    (row,) = speeds.query("condition == 'kp100_3'").to_dict("records")
    assert row["trials"] == 1
    assert names[0] in row["reason"]


def edit(root, **robot):
    path = root / "config" / "config.yaml"
    data = yaml.safe_load(path.read_text("utf-8"))
    del data["robot"]
    path.write_text(yaml.safe_dump(data | ({"robot": robot} if robot else {})), "utf-8")


def test_without_tracks_the_figure_stands_in(root):
    edit(root, medium="poppy_LP")
    trials, speeds, ledger = measured(root)
    assert (len(trials), len(speeds), len(ledger)) == (0, 42, 0)
    assert set(speeds["source"]) == {"Fig. 4C"}
    edit(root, medium="poppy_CP")
    (root / "raw" / "paper" / "runs.csv").write_text(SHEET.replace("_LP", "_CP"), "utf-8")
    assert measured(root)[1].empty


def test_what_the_workflow_reads(root):
    config = root / "config" / "config.yaml"
    states = read_states(config)
    assert states.campaign.robot_medium == "poppy_LP"
    assert len(states.robot_digests) == 1 + 42 * 3
    assert all((root / file).is_file() for file in states.robot_digests)
    track = next(root / file for file in states.robot_digests if "tracks/" in file)
    track.write_bytes(track.read_bytes() + b"# end\n")
    before, after = (
        campaign_states.state_of("robot_measured", "")
        for campaign_states in (states, States(states.campaign))
    )
    assert [what for what in after if after[what] != before[what]] == ["robot files"]
    edit(root)  # a campaign without a robot
    states = read_states(config)
    assert (states.campaign.robot_medium, states.robot_digests) == ("", {})
    assert not [job for job in planned_jobs(config) if job.rule.startswith("robot")]
    with pytest.raises(InputError, match="section robot"):
        robot_measured(open_results(root))


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
    edit(root, **robot)
    with pytest.raises(CampaignError) as error:
        load_campaign(root / "config" / "config.yaml")
    (problem,) = (problem for problem in error.value.problems if problem.severity == "error")
    assert (problem.code, problem.place.key) == (f"config.{code}", key)
    assert value in str(problem)


# --- profiles ------------------------------------------------------------------------------------------


def test_a_robot_that_moves_back():
    place = {"curvature_times_R": [1.0], "frequency_Hz": [2.0], "reason": [""]}
    measured = pd.DataFrame(place).assign(
        condition="c", medium="sand", speed_cm_per_s=-1.0, speed_sd_cm_per_s=0.1, calibrated=False
    )
    speed = pd.DataFrame(place).assign(
        profile="table", speed_cm_per_s=5.0, speed_lo_cm_per_s=4.0, speed_hi_cm_per_s=6.0
    )
    (row,) = speed_errors(measured.assign(trials=3), speed).to_dict("records")
    assert row["reason_code"] == "speed-not-positive"
    assert np.isnan(row["error_percent"])
