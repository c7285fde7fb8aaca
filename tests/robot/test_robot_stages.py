"""The robot's stages turn tracks into the published speeds and a sweep into tables.

Track: the recorded path of a marker on the robot. What cannot be used is given a reason.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import planned_jobs, run_rules
from numpy.testing import assert_allclose
from result_tables import LABORATORY, alpha_frame, make_campaign

import rftfit
from rftfit import reference
from rftfit.campaign.config import Config
from rftfit.campaign.load import REENACTED, load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.cli import simulate
from rftfit.errors import InputError
from rftfit.lab.tracks import TRIALS, plan_trials, track_files
from rftfit.model.profiles import TableProfile
from rftfit.results import open_results
from rftfit.robot import PROFILES, sweep
from rftfit.robot.run import Condition
from rftfit.robot.speeds import speed_errors
from rftfit.store import write_csv, write_text
from rftfit.workflow import robot as stages
from rftfit.workflow.robot import profiles_of, robot_measured, robot_profile, robot_runs
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


def test_from_tracks_to_the_published_speeds(root):
    trials, speeds, ledger = measured(root)
    figure = reference.load("fig_4c").query("stride_frequency_Hz > 0.01")
    assert (len(trials), len(speeds)) == (42 * TRIALS, 42)
    assert set(trials["status"]) == {"used"}
    order = speeds.sort_values(["curvature_times_R", "frequency_Hz"])
    assert_allclose(order["speed_cm_per_s"], figure["speed_cm_per_s"], rtol=0.005)
    assert_allclose(order["frequency_Hz"], figure["stride_frequency_Hz"], rtol=0.01)
    assert (speeds["calibrated"] == "yes").sum() == 3
    assert (order["speed_sd_cm_per_s"] > 0).all()
    tracks = (root / "raw" / "paper" / "robot" / "tracks").iterdir()
    lines = [line for path in tracks for line in path.read_text("utf-8").splitlines()]
    assert ledger["rows"].sum() == sum(line[0].isdigit() for line in lines)


def test_a_reenacted_track_has_no_mean_stride(root):
    """The lab makes up how the robot surges within a stride: nobody measured it."""
    for reenacted in (False, True):
        if reenacted:
            write_text(root / "raw" / "paper" / REENACTED, "made by rftfit reenact\n")
        measured(root)
        assert open_results(root).table("robot/strides.csv").empty == reenacted


def test_same_seed_same_tracks(root):
    config = load_campaign(root / "config" / "config.yaml").config
    assert track_files(config, 1) == track_files(config, 1)
    trials = plan_trials(config, 1)
    assert len({trial.run_id for trial in trials}) == 42 * TRIALS
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
    trials, speeds, ledger = measured(root)
    table = trials.set_index("run_id")
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
    states = read_states(config)[0]
    assert states.campaign.robot_medium == "poppy_LP"
    assert len(states.robot_files) == 1 + 42 * TRIALS
    assert all((root / file).is_file() for file in states.robot_files)
    track = next(root / file for file in states.robot_files if "tracks/" in file)
    track.write_bytes(track.read_bytes() + b"# end\n")
    before, after = (
        campaign_states.of("robot_measured", "")
        for campaign_states in (states, States(states.campaign))
    )
    assert [what for what in after if after[what] != before[what]] == ["robot files"]
    edit(root)  # a campaign without a robot
    states = read_states(config)[0]
    assert (states.campaign.robot_medium, states.robot_files) == ("", {})
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


def test_an_own_robot_is_neither_calibrated_nor_compared_with_the_papers(root):
    text = (PROJECT / "config" / "robot.yaml").read_text("utf-8")
    edit(root, medium="poppy_LP", file="config/mine.yaml")
    for old_text, compared in (("elements: 30", 42), ("mass_g: 150", 0)):
        assert old_text in text
        changed = text.replace(old_text, old_text.replace("0", "5"))
        (root / "config" / "mine.yaml").write_text(changed, "utf-8")
        speeds = measured(root)[1]
        assert (len(speeds), {*speeds["calibrated"]} <= {"no"}) == (compared, True)


# --- the sweep ---------------------------------------------------------------------------------------


def with_alpha(root, values=None, **fourier):
    """The campaign with an alpha table of its medium: the paper's, or another."""
    if fourier:
        path = root / "config" / "config.yaml"
        data = yaml.safe_load(path.read_text("utf-8"))
        data["fourier"] |= fourier
        path.write_text(yaml.safe_dump(data), "utf-8")
    table = alpha_frame("poppy_LP", values or reference.alpha_grid("poppy_LP"))
    write_csv(table, root / "results" / "alpha" / "poppy_LP.csv")
    return open_results(root)


# --- profiles ------------------------------------------------------------------------------------------


def test_profiles_from_the_tables(root):
    results = with_alpha(root)
    angles = np.radians([0.0, 30.0]), np.radians([90.0, 45.0])
    table, fourier, generic, depth_only = (
        robot_profile(results, kind).alpha(*angles)
        for kind in ("table", "fourier", "generic", "depth_only")
    )
    assert_allclose(table, TableProfile.published("poppy_LP").alpha(*angles))
    # of one medium alone, the generic profile is its own
    assert_allclose(generic, fourier, rtol=1e-6)
    assert depth_only[1][0] == pytest.approx(0)
    with pytest.raises(
        InputError, match="found 'tabel'; allowed: table, map, fourier, generic, dep"
    ):
        robot_profile(results, "tabel")


def test_the_map_is_run_on_where_the_table_has_holes(root, monkeypatch):
    assert "map" not in profiles_of(with_alpha(root))
    results = with_alpha(root, holed(*WIDE))
    assert profiles_of(results) == PROFILES
    monkeypatch.setattr(sweep, "conditions_of", lambda *_, **__: [Condition(2.0, 1.0, 0.0)])
    write_csv(robot_measured(results)[1], root / "results" / "robot" / "measured.csv")
    lost, on_map = (robot_runs(results, f"runs_{name}", 1).iloc[0] for name in ("table", "map"))
    assert np.isnan(lost["speed_cm_per_s"])
    truth = rftfit.simulate(rftfit.published_medium("poppy_LP"), 2.0).speed_cm_per_s
    assert on_map["speed_cm_per_s"] == pytest.approx(truth, rel=0.15)


def test_its_pictures_are_of_the_profile_that_it_runs_on(root, monkeypatch):
    for name in ("simulate", "tail_of", "stance_of"):
        monkeypatch.setattr(stages, name, lambda *_, **__: pd.DataFrame({"n": [1]}))
    monkeypatch.setattr(stages, "frames_of", lambda _, profile: {"reason": profile.reason})
    motion, _, frames = stages.robot_motion(with_alpha(root, holed(*WIDE)))
    assert set(motion["profile"]) == {"map"}
    assert json.loads(frames) == {"reason": "", "medium": "poppy_LP", "profile": "map"}


def holed(*cells):
    """The published alpha without some cells."""
    alpha = np.array(reference.alpha_grid("poppy_LP"))
    alpha[:, *cells] = np.nan
    return alpha[0], alpha[1]


WIDE = slice(1, 6, 2), slice(4, 9)


def test_a_missing_fit_is_a_reason_not_a_number(root):
    lost = robot_profile(with_alpha(root, holed(2, 3), method="dft-index"), "generic")
    assert np.isnan(lost.alpha(0, 1)[0])
    assert "1 of 91 cells" in lost.reason


def test_a_dropped_term_is_not_in_the_profile(root):
    less, full = (
        robot_profile(with_alpha(root, threshold=threshold), "fourier") for threshold in (0.9, 0.0)
    )
    assert len(set(less.parameters[0].ravel()) - {0.0}) < 9
    assert less.alpha(0, np.pi / 2)[0] != pytest.approx(full.alpha(0, np.pi / 2)[0])


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


def test_a_sweep_on_a_medium_without_runs(tmp_path):
    media = {"a": LABORATORY}
    make_campaign(tmp_path / "none", media, {})
    make_campaign(tmp_path / "other", media, {}, {"robot": {"medium": "b"}}, ["b"])
    for name, match in (("none", "section robot"), ("other", "robot.medium: b ")):
        with pytest.raises(InputError, match=match):
            simulate.sweep(config=tmp_path / name / "config" / "config.yaml")
