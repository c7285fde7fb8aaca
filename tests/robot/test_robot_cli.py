"""`rftfit simulate` gives the speed and the pictures of a robot and refuses wrong options.

`rftfit sweep` is called with a wrong option only.
"""

import io
import json
from typing import Any

import numpy as np
import pytest
from makers import answer_of
from PIL import Image

from rftfit.figures.animation import gif_bytes, mp4_bytes

CASE = "simulate --curvature 1 --medium poppy_LP"
"""A command line that lacks the frequency."""
BASE = f"{CASE} --frequency 5 --profile fourier"
"""A whole command line."""


@pytest.fixture
def call(tmp_path):
    return lambda line: answer_of(*line.split(), folder=tmp_path)


def test_animation_and_text(call, tmp_path):
    code, out, _ = call(BASE)
    assert code == 0
    assert "Outcome: steady after" in out
    movie: Any
    with Image.open(tmp_path / "simulation" / "animation.gif") as movie:
        frames = movie.n_frames
        first = np.asarray(movie.convert("RGB"))
        movie.seek(frames // 4)
        later = np.asarray(movie.convert("RGB"))
    assert frames == 50
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


def test_every_kind_of_profile(call):
    speeds = set()
    for kind in ("table", "generic", "depth_only"):
        code, out, _ = call(f"{CASE} --no-animation --frequency 2 --profile {kind} --json")
        assert code == 0
        speeds.add(round(json.loads(out)["speed_cm_per_s"], 3))
    assert len(speeds) == 3


def test_same_pictures_same_bytes():
    shots = [np.full((20, 31, 3), 40 * i, dtype=np.uint8) for i in range(4)]
    assert gif_bytes(shots, 0.05) == gif_bytes(shots, 0.05)
    movie: Any
    with Image.open(io.BytesIO(gif_bytes(shots, 0.05))) as movie:
        assert (movie.n_frames, movie.info["duration"]) == (4, 50)


def test_no_ffmpeg_no_movie(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert mp4_bytes([np.zeros((4, 4, 3), np.uint8)], 0.1) is None
