"""`rftfit.wheel` and ``rftfit wheel`` answer for a wheel at a load or at a sinkage."""

import warnings

import numpy as np
import pytest
from makers import answer_of, json_of, refused

import rftfit

from .test_space_mesh import stl
from .test_space_rolling import PADDLES

SAND = rftfit.scale(0.9)
SMOOTH = rftfit.Mesh.cylinder(6.25, 6, facets=24)


def test_a_load_that_is_not_carried_has_a_reason():
    answer = rftfit.wheel(SAND, SMOOTH, [0.1, 0.3], load_N=[20, 1e5])
    assert answer.table["reason"].map(bool).to_list() == [False, True]
    assert np.isnan(answer.table["drawbar_N"][1])
    assert np.isfinite(answer.table["drawbar_N"][0])
    assert "axle" in answer.summary()


def test_the_error_of_the_model_is_that_of_rigs():
    with_friction, without = (
        rftfit.wheel(SAND, SMOOTH, 0.2, sinkage_cm=1, load_N=10, friction=friction).model_error
        for friction in (0.4, None)
    )
    assert with_friction < without
    plain = rftfit.wheel(SAND, SMOOTH, 0.2, sinkage_cm=1, load_N=10, model_error=0)
    assert "drawbar_model_lo_N" not in plain.table
    wider = rftfit.wheel(SAND, SMOOTH, 0.2, sinkage_cm=1, load_N=10, model_error=0.5).table.iloc[0]
    below = np.hypot(wider["drawbar_N"] - wider["drawbar_lo_N"], 1.959964 * 0.5 * 10)
    assert wider["drawbar_N"] - wider["drawbar_model_lo_N"] == pytest.approx(below)
    nine_terms = rftfit.published_medium("poppy_LP", "fourier")
    assert np.isnan(rftfit.wheel(nine_terms, SMOOTH, 0.2, sinkage_cm=1).model_error)


def test_what_cannot_be_is_refused():
    for words, match in (
        ({"load_N": -1}, "positive"),
        ({"load_N": [1, 2]}, "one for each"),
        ({"sinkage_cm": 1, "friction": -0.1}, "friction"),
        ({"sinkage_cm": 50}, "diameter"),
        ({"load_N": 5, "rim_cm": 1}, "rim"),
    ):
        with pytest.raises(ValueError, match=match):
            rftfit.wheel(SAND, PADDLES, [0.1, 0.2, 0.3], **words)


# --- The command


WHEEL = ("--mesh", "ball.stl", "--unit", "mm", "--medium", "poppy_LP")


@pytest.fixture
def folder(tmp_path):
    """With the file of a wheel and measured points, the second one no number."""
    pytest.importorskip("trimesh")
    stl(tmp_path, PADDLES)
    (tmp_path / "points.csv").write_text("slip,drawbar_N,sinkage_cm\n0.1,1,0.5\n0.3,2,0.9\n")
    (tmp_path / "bad.csv").write_text("slip,drawbar_N\n0.1,one\n")
    return tmp_path


def test_the_command_names_no_rule_and_draws(folder):
    words = ("--slip", "0.1,0.3", "--sinkage", "1", "--load", "15", "--no-track")
    drawn = ("--figure", "w.png", "--measured", "points.csv")
    code, out, _ = answer_of("wheel", *WHEEL, *words, *drawn, folder=folder)
    assert code == 0
    assert "none: every face that leads counts" in out
    assert (folder / "w.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("words", "places"),
    [
        (
            "--slip a --figure w.png --measured bad.csv --friction 9",
            ("--slip", "bad.csv, row 2", "--friction"),
        ),
        ("--slip 0.1", ("--load", "--sinkage")),
    ],
)
def test_faults_are_told_at_once(folder, words, places):
    error = refused("wheel", *WHEEL, *words.split(), folder=folder)
    assert all(place in error for place in places)


def test_predict_names_the_rule_of_a_rolled_wheel(folder):
    words = ("predict", *WHEEL, "--roll", "1,0.2", "--force")
    contents = [
        json_of(*words, *more, folder=folder)
        for more in ((), ("--no-track",), ("--friction", "0.4"))
    ]
    assert [content["rule"].partition(":")[0] for content in contents] == [
        "own-track",
        "none",
        "own-track",
    ]
    assert [content["friction"] for content in contents] == [None, None, 0.4]
    drawbars = [content["mean_of_turn"]["drawbar_N"] for content in contents]
    assert drawbars[0] < drawbars[1]
    assert drawbars[2] != drawbars[0]
    error = refused("predict", *WHEEL, "--press", "1", "--no-track", folder=folder)
    assert "--roll" in error


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
