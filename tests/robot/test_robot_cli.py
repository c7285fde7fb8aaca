"""`rftfit simulate` gives the speed and the pictures of a robot and refuses wrong options.

`rftfit sweep` is called with a wrong option only.
"""

import json
from typing import Any

import numpy as np
import pytest
from makers import answer_of
from PIL import Image

BASE = "simulate --curvature 1 --medium poppy_LP --frequency 5 --profile fourier"
"""A whole command line."""


@pytest.fixture
def call(tmp_path):
    return lambda line: answer_of(*line.split(), folder=tmp_path)


def test_animation_and_text(call, tmp_path, monkeypatch):
    """Without ffmpeg there is no mp4."""
    monkeypatch.setenv("PATH", str(tmp_path))
    code, out, _ = call(BASE)
    assert code == 0
    assert "Outcome: steady after" in out
    assert not (tmp_path / "simulation" / "animation.mp4").exists()
    movie: Any
    with Image.open(tmp_path / "simulation" / "animation.gif") as movie:
        frames, frame_ms = movie.n_frames, movie.info["duration"]
        first = np.asarray(movie.convert("RGB"))
        movie.seek(frames // 4)
        later = np.asarray(movie.convert("RGB"))
    assert (frames, frame_ms % 10) == (50, 0)
    assert (first != later).any(axis=-1).mean() > 0.01
    # arrows are red
    assert ((first[..., 0] > 150) & (first[..., 1] < 80) & (first[..., 2] < 80)).sum() > 20
    # a second run may overwrite its own files
    assert call(f"{BASE} --no-animation")[0] == 0


def test_files_of_others_stay(call, tmp_path):
    (tmp_path / "simulation").mkdir()
    for name in ("motion.png", "motion.csv"):
        (tmp_path / "simulation" / name).write_bytes(b"mine")
        code, out, err = call(f"{BASE} --no-animation")
        assert (code, out) == (2, "")
        assert "add --force" in err or "overwritten" in err
        assert (tmp_path / "simulation" / name).read_bytes() == b"mine"
    assert call(f"{BASE} --no-animation --force")[0] == 0


def test_a_robot_that_does_not_get_going(call, tmp_path):
    robot = tmp_path / "heavy.yaml"
    text = (
        "title: anvil\nbody:\n  mass_g: 90000\n  inertia_g_cm2: 2000000\n  plates:\n"
        "    belly: {from_cm: [-6.5, -1.0], to_cm: [6.5, -1.0], width_cm: 2}\n"
        "legs:\n  max_length_cm: 4.1\n  width_cm: 1.0\n  hips:\n"
        "    - {x_cm: 0, z_cm: -1, phase_turns: 0}\n"
    )
    robot.write_text(text, "utf-8")
    code, out, err = call(f"{BASE} --no-animation --robot heavy.yaml --json")
    assert code == 0
    answer = json.loads(out)
    assert answer["outcome"] in ("buried", "tipped")
    assert answer["speed_cm_per_s"] is None
    assert f"no steady speed: {answer['outcome']}" in err
