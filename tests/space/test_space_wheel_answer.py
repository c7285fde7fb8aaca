"""`rftfit.wheel` and ``rftfit wheel`` answer for a wheel at a load or at a sinkage."""

import json
import warnings

import numpy as np
import pytest

import rftfit
from rftfit.cli.main import main

from .test_space_mesh import stl
from .test_space_rolling import paddles

__all__ = ["paddles"]

SAND = rftfit.scale(0.9)
SMOOTH = rftfit.Mesh.cylinder(6.25, 6, facets=24)


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


WHEEL = ("--mesh", "ball.stl", "--unit", "mm", "--medium", "poppy_LP")


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


@pytest.mark.parametrize(
    ("radius_cm", "load_N", "sinkage_cm", "expected"),
    [
        (12.0, 40.0, 1.0, []),
        (12.0, 400.0, 1.0, ["a load of 400 N"]),
        (60.0, 40.0, 1.0, ["a rim of 60 cm"]),
        (3.0, 2.0, 0.5, ["a rim of 3 cm", "a load of 2 N"]),
        (12.0, 40.0, 11.0, ["deeper than measured: down to 11.0 cm"]),
    ],
)
def test_a_wheel_unlike_the_measured_ones_is_told(radius_cm, load_N, sinkage_cm, expected):
    smooth = rftfit.Mesh.cylinder(radius_cm=radius_cm, width_cm=6, facets=24)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        answer = rftfit.wheel(
            rftfit.published_medium("poppy_LP"), smooth, 0.2, sinkage_cm=sinkage_cm, load_N=load_N
        )
    told = [str(warning.message) for warning in caught]
    assert [warning.category for warning in caught] == [rftfit.LimitWarning] * len(expected)
    assert all(words in text for words, text in zip(expected, told, strict=True))
    assert all(any(text[1:] in note for note in answer.notes) for text in told)
