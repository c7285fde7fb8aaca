"""A robot's wrong sheet, speed, track or medium is refused or marked with its reason."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from light_campaign import LABORATORY, make_campaign

from rftfit.campaign.problems import Place
from rftfit.cli.simulate import sweep
from rftfit.errors import InputError, RftfitError
from rftfit.robot import tracks
from rftfit.robot.speeds import speed_errors, trial_row
from rftfit.robot.tracks import read_trials


def test_a_column_that_stands_twice(tmp_path):
    path = tmp_path / "runs.csv"
    path.write_text(
        "run_id,condition,medium,curvature_times_R,track,track\na,c,sand,1,a.csv,b.csv\n"
    )
    _, problems = read_trials(path, "runs.csv", "sand")
    assert [problem.code for problem in problems] == ["robot-sheet.duplicate-column"]
    assert problems[0].place == Place("runs.csv", 1, "track")


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


def test_rows_of_a_track_that_do_not_add_up(tmp_path, monkeypatch):
    trial: Any = SimpleNamespace(
        run_id="a",
        condition="c",
        medium="sand",
        curvature_times_R=1.0,
        frequency_Hz=2.0,
        track="a.csv",
    )
    track = SimpleNamespace(rows=10, dropped={"no number for x": 1}, time_s=np.arange(8.0))
    monkeypatch.setattr(tracks, "read_track", lambda _: track)
    monkeypatch.setattr(tracks, "mean_stride_speed", lambda *_: SimpleNamespace(flags=()))
    with pytest.raises(RftfitError, match=r" a\.csv .* 9 .* 10 "):
        trial_row(trial, tmp_path, 2)


def test_a_sweep_on_a_medium_without_runs(tmp_path):
    media = {"a": LABORATORY}
    make_campaign(tmp_path / "none", media, {})
    make_campaign(tmp_path / "other", media, {}, {"robot": {"medium": "b"}}, ["b"])
    for name, match in (("none", "no section robot"), ("other", "key robot.medium: b has no runs")):
        with pytest.raises(InputError, match=match):
            sweep(config=tmp_path / name / "config" / "config.yaml")
