"""`rftfit.wheel` and ``rftfit wheel`` answer for a wheel at a load or at a sinkage."""

import csv
import json

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import rftfit
from rftfit.cli.main import main

from .test_space_mesh import stl
from .test_space_rolling import paddles

__all__ = ["paddles"]

SAND = rftfit.scale(0.9)
SMOOTH = rftfit.Mesh.cylinder(6.25, 6, facets=24)


def test_a_load_and_a_sinkage_need_an_alpha(paddles):
    answer = rftfit.wheel(SAND, paddles, 0.3, sinkage_cm=1.5, load_N=20, friction=0.4)
    row = answer.table.iloc[0]
    assert (row["load_N"], answer.rule, answer.friction) == (20, "own-track", 0.4)
    carried = rftfit.wheel(
        rftfit.scale(row["alpha_of_load_N_per_cm3"]), paddles, 0.3, sinkage_cm=1.5, friction=0.4
    ).table.iloc[0]
    assert carried["load_N"] == pytest.approx(20, rel=1e-3)
    assert carried["drawbar_N"] == pytest.approx(row["drawbar_N"], rel=1e-3)
    # the strength of the sand has no part in what is known of the drawbar
    weaker = rftfit.wheel(
        rftfit.scale(0.3), paddles, 0.3, sinkage_cm=1.5, load_N=20, friction=0.4
    ).table.iloc[0]
    ends = ["drawbar_N", "drawbar_lo_N", "drawbar_hi_N"]
    assert_allclose(weaker[ends].astype(float), row[ends].astype(float), rtol=1e-3)
    every_face = rftfit.wheel(SAND, paddles, 0.3, sinkage_cm=1.5, load_N=20, track=False)
    assert every_face.table["drawbar_N"][0] > row["drawbar_N"]


def test_a_load_alone_solves_the_sinkage(paddles):
    answer = rftfit.wheel(SAND, paddles, [0.1, 0.4], load_N=[1, 2])
    assert answer.slip_sinkage == (0.2, 1.2)
    for row in answer.as_dict()["rows"]:
        again = rftfit.wheel(SAND, paddles, row["slip"], sinkage_cm=row["sinkage_cm"]).table.iloc[0]
        assert again["load_N"] == pytest.approx(row["load_N"], rel=1e-4)
        assert row["sinkage_lo_cm"] <= row["sinkage_cm"] < row["sinkage_hi_cm"]
        # with a fifth of alpha the wheel sinks farther in
        dug = rftfit.wheel(rftfit.scale(0.25 * 0.9), paddles, row["slip"], load_N=row["load_N"])
        assert row["sinkage_cm"] < dug.table["sinkage_cm"][0] < row["sinkage_hi_cm"]


def test_a_load_that_is_not_carried_has_a_reason():
    answer = rftfit.wheel(SAND, SMOOTH, [0.1, 0.3], load_N=[20, 1e5])
    assert answer.table["reason"].map(bool).to_list() == [False, True]
    assert np.isnan(answer.table["drawbar_N"][1])
    assert np.isfinite(answer.table["drawbar_N"][0])
    assert "axle" in answer.summary()


def test_the_error_of_the_model_is_that_of_rigs():
    errors = {
        (friction, mesh.is_convex): rftfit.wheel(
            SAND, mesh, 0.2, sinkage_cm=1, load_N=10, friction=friction
        ).model_error
        for friction in (None, 0.4)
        for mesh in (SMOOTH,)
    }
    assert errors[0.4, True] < errors[None, True]
    plain = rftfit.wheel(SAND, SMOOTH, 0.2, sinkage_cm=1, load_N=10, model_error=0)
    assert "drawbar_model_lo_N" not in plain.table
    wider = rftfit.wheel(SAND, SMOOTH, 0.2, sinkage_cm=1, load_N=10, model_error=0.5).table.iloc[0]
    below = np.hypot(wider["drawbar_N"] - wider["drawbar_lo_N"], 1.959964 * 0.5 * 10)
    assert wider["drawbar_N"] - wider["drawbar_model_lo_N"] == pytest.approx(below)
    nine_terms = rftfit.published_medium("poppy_LP", "fourier")
    assert np.isnan(rftfit.wheel(nine_terms, SMOOTH, 0.2, sinkage_cm=1).model_error)


def test_what_cannot_be_is_refused(paddles):
    for words, match in (
        ({}, "neither sinkage nor load"),
        ({"load_N": -1}, "positive"),
        ({"load_N": [1, 2]}, "one for each"),
        ({"sinkage_cm": 1, "friction": -0.1}, "friction"),
        ({"sinkage_cm": 50}, "diameter"),
        ({"load_N": 5, "rim_cm": 1}, "rim"),
    ):
        with pytest.raises(ValueError, match=match):
            rftfit.wheel(SAND, paddles, [0.1, 0.2, 0.3], **words)


# --- The command


@pytest.fixture
def command(tmp_path, monkeypatch, capfd, paddles):
    pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    stl(tmp_path, paddles)
    return lambda *words: (main(["wheel", *words]), *capfd.readouterr())


WHEEL = ("--mesh", "ball.stl", "--unit", "mm", "--alpha", "0.9")


def test_the_command_says_what_the_library_says(command, tmp_path, paddles):
    words = ("--slip", "0.1,0.3", "--load", "2", "--friction", "0.4", "--rim", "3")
    code, out, _ = command(*WHEEL, *words, "--json")
    content = json.loads(out)
    expected = rftfit.wheel(SAND, paddles, [0.1, 0.3], load_N=2, friction=0.4, rim_cm=3)
    assert code == 0
    assert (content["rule"], content["friction"], content["rim_cm"]) == ("own-track", 0.4, 3)
    assert content["given"] == "load"
    columns = [name for name in expected.table if name != "reason"]
    rows = pd.DataFrame(content["rows"])
    # an STL file has seven digits
    assert_allclose(rows[columns].astype(float), expected.table[columns].astype(float), rtol=1e-3)
    lines = (tmp_path / "wheel.csv").read_text().splitlines()
    assert any("own-track" in line for line in lines if line[0] == "#")
    written = [*csv.DictReader(line for line in lines if line[0] != "#")]
    assert [float(row["drawbar_N"]) for row in written] == pytest.approx([*rows["drawbar_N"]])


def test_the_command_names_no_rule_and_draws(command, tmp_path):
    (tmp_path / "points.csv").write_text("slip,drawbar_N,sinkage_cm\n0.1,1,0.5\n0.3,2,0.9\n")
    words = ("--slip", "0.1,0.3", "--sinkage", "1", "--load", "15", "--no-track")
    code, out, _ = command(*WHEEL, *words, "--figure", "w.png", "--measured", "points.csv")
    assert code == 0
    assert "none: every face that leads counts" in out
    assert (tmp_path / "w.png").read_bytes()[:4] == b"\x89PNG"


def test_faults_are_told_at_once(command, tmp_path):
    (tmp_path / "points.csv").write_text("slip,drawbar_N\n0.1,one\n")
    words = ("--slip", "a", "--figure", "w.png", "--measured", "points.csv", "--friction", "9")
    code, _, err = command(*WHEEL, *words)
    assert code == 2
    for place in ("--slip", "points.csv, row 2", "--friction"):
        assert place in err
    code, _, err = command(*WHEEL, "--slip", "0.1")
    assert (code, "--load" in err, "--sinkage" in err) == (2, True, True)


@pytest.mark.usefixtures("command")
def test_predict_names_the_rule_of_a_rolled_wheel(capfd):
    words = ["predict", *WHEEL, "--roll", "1,0.2"]
    contents = []
    for more in ([], ["--no-track"], ["--friction", "0.4"]):
        assert main([*words, *more, "--json"]) == 0
        contents.append(json.loads(capfd.readouterr().out))
    assert [content["rule"].partition(":")[0] for content in contents] == [
        "own-track",
        "none",
        "own-track",
    ]
    assert [content["friction"] for content in contents] == [None, None, 0.4]
    drawbars = [content["mean_of_turn"]["drawbar_N"] for content in contents]
    assert drawbars[0] < drawbars[1]
    assert drawbars[2] != drawbars[0]
    assert main(["predict", *WHEEL, "--press", "1", "--no-track"]) == 2
    assert "--roll" in capfd.readouterr().err


def test_a_predicted_load_has_no_error_of_the_model_and_says_so():
    mesh = rftfit.Mesh.cylinder(radius_cm=5, width_cm=3, facets=24)
    at_sinkage = rftfit.wheel(SAND, mesh, 0.2, sinkage_cm=1)
    at_load = rftfit.wheel(SAND, mesh, 0.2, sinkage_cm=1, load_N=5)
    for answer in (at_sinkage, at_load):
        assert "drawbar_model_lo_N" in answer.table
        assert "load_model_lo_N" not in answer.table
    told = [
        sum("rigs whose load was given" in note for note in a.notes) for a in (at_sinkage, at_load)
    ]
    assert told == [1, 0]
