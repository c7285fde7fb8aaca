"""A wheel from the numbers of its drawing, and a laboratory left out of the model's own error."""

import numpy as np
import pytest
from makers import json_of, refused

import rftfit

ROLLING = ["wheel", "--slip", "0.2,0.5", "--sinkage", "1", "--load", "20"]
"""A wheel that rolls on no medium yet."""
WORDS = [*ROLLING, "--alpha", "0.9"]
DRAWING = "6,4,1,8"


def test_a_drawing_is_the_mesh_of_python(tmp_path):
    answer = json_of(*WORDS, "--drawing", DRAWING, "--rim", "6", folder=tmp_path)
    mesh = rftfit.Mesh.wheel(6, 4, lug_cm=1, lugs=8)
    medium = rftfit.scale(0.9)
    expected = rftfit.wheel(medium, mesh, [0.2, 0.5], sinkage_cm=1, load_N=20, rim_cm=6)
    assert answer["rule"] == "own-track"
    for name in ("drawbar_N", "torque_N_cm"):
        assert [row[name] for row in answer["rows"]] == pytest.approx(list(expected.table[name]))


@pytest.mark.parametrize(("words", "rim"), [("", (6, "given")), ("--rim 7", (7, "given"))])
def test_a_drawing_states_the_rim(words, rim, tmp_path):
    answer = json_of(*WORDS, "--drawing", DRAWING, *words.split(), folder=tmp_path)
    assert (answer["rim_cm"], answer["rim_from"]) == rim


def test_a_wheel_of_its_drawing_has_its_sizes():
    smooth = rftfit.Mesh.wheel(6, 4)
    lugged = rftfit.Mesh.wheel(6, 4, lug_cm=1, lugs=8, thickness_cm=0.8)
    assert smooth.is_convex
    assert not lugged.is_convex
    radius = np.hypot(lugged.vertices_cm[:, 0], lugged.vertices_cm[:, 2])
    assert radius.max() == pytest.approx(7)
    assert np.ptp(lugged.vertices_cm[:, 1]) == pytest.approx(4)
    # eight lugs of their height, thickness and width more than the rim, whose facets are chords
    assert lugged.volume_cm3 - smooth.volume_cm3 == pytest.approx(8 * 1 * 0.8 * 4, rel=0.03)


def test_a_laboratory_is_left_out(tmp_path):
    """Its error is in the default and not in that of the others; a rig alone of its shape leaves none."""
    every = json_of(*WORDS, "--drawing", DRAWING, folder=tmp_path)["model_error"]
    without = {
        name: json_of(*WORDS, "--drawing", DRAWING, "--left-out", name, "--force", folder=tmp_path)[
            "model_error"
        ]
        for name in ("KLS-1", "Rashid-1", "CMU")
    }
    assert without["KLS-1"] < every < without["Rashid-1"]
    assert without["CMU"] == every


@pytest.mark.parametrize(
    "words",
    [
        "--drawing 6",
        "--drawing 6,4,1",
        "--drawing 6,4,1,8.5",
        "--drawing 6,4,0,8",
        "--drawing 6,-4",
        "--drawing 6,4,1,200",
        "--drawing 6,x",
        f"--drawing {DRAWING} --unit mm",
        f"--drawing {DRAWING} --left-out Dings",
        f"--drawing {DRAWING} --left-out Ding --model-error 0.1",
        "--unit mm",
        "--mesh wheel.stl",
    ],
)
def test_what_is_no_wheel(words, tmp_path):
    refused(*ROLLING, "--medium", "poppy_LP", *words.split(), folder=tmp_path)
    assert [*tmp_path.iterdir()] == []
