"""What is said of the robot's sheet, tracks and speeds."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from rftfit.campaign.problems import Place
from rftfit.cli.simulate import sweep
from rftfit.errors import InputError, RftfitError
from rftfit.robot.speeds import speed_errors
from rftfit.robot.tracks import read_trials
from rftfit.workflow import robot as stage


def test_a_column_that_stands_twice(tmp_path):
    path = tmp_path / "runs.csv"
    path.write_text(
        "run_id,condition,medium,curvature_times_R,track,track\na,c,sand,1,a.csv,b.csv\n"
    )
    _, problems = read_trials(path, "runs.csv", "sand")
    assert [problem.code for problem in problems] == ["robot-sheet.duplicate-column"]
    assert problems[0].place == Place("runs.csv", 1, "track")


def test_a_robot_that_moves_back():
    measured = pd.DataFrame(
        {"condition": ["c"], "medium": ["sand"], "curvature_times_R": [1.0], "frequency_Hz": [2.0],
         "speed_cm_per_s": [-1.0], "speed_sd_cm_per_s": [0.1], "trials": [3], "calibrated": [False],
         "reason": [""]}
    )  # fmt: skip
    speed = pd.DataFrame(
        {"profile": ["table"], "curvature_times_R": [1.0], "frequency_Hz": [2.0],
         "speed_cm_per_s": [5.0], "speed_lo_cm_per_s": [4.0], "speed_hi_cm_per_s": [6.0],
         "reason": [""], "calibrated": [False]}
    )  # fmt: skip
    (row,) = speed_errors(measured, speed).to_dict("records")
    assert row["reason"] == "no share of a measured speed that is not positive"
    assert np.isnan(row["error_percent"])


def test_rows_of_a_track_that_do_not_add_up(tmp_path, monkeypatch):
    trial: Any = SimpleNamespace(
        run_id="a", condition="c", medium="sand", curvature_times_R=1.0, frequency_Hz=2.0,
        track="a.csv",
    )  # fmt: skip
    track = SimpleNamespace(rows=10, dropped={"no number for x": 1}, time_s=np.arange(8.0))
    monkeypatch.setattr(stage, "read_track", lambda _: track)
    monkeypatch.setattr(stage, "mean_stride_speed", lambda *_: SimpleNamespace(flags=()))
    with pytest.raises(
        RftfitError, match=r"the rows of a.csv do not add up: 9 counted, 10 in the file"
    ):
        stage._measure(trial, tmp_path, 2)


def test_a_sweep_on_a_medium_without_runs(tmp_path):
    from light_campaign import LABORATORY, make_campaign

    media = {"a": LABORATORY}
    make_campaign(tmp_path / "none", media, {})
    with pytest.raises(InputError, match="there is no section robot"):
        sweep(config=tmp_path / "none" / "config" / "config.yaml")
    make_campaign(tmp_path / "other", media, {}, {"robot": {"medium": "b"}}, ["b"])
    with pytest.raises(InputError, match=r"key robot.medium: b has no runs"):
        sweep(config=tmp_path / "other" / "config" / "config.yaml")
