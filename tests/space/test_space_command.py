"""`rftfit predict --mesh` gives the library's forces on a moving mesh or names what is wrong."""

import json
import re
import sys

import numpy as np
import pandas as pd
import pytest
from makers import answer_of, refused

import rftfit
from rftfit import Mesh, Motion3D

from .test_space_mesh import BALL, stl

HEAD = "t_s,x_cm,y_cm,z_cm,turn_x_deg,turn_y_deg,turn_z_deg\n"
"""Header of a path in space."""
TIME = np.linspace(0, 1, 5)
PATH = np.column_stack([TIME, TIME, 0.3 * TIME, -1 - 0.5 * TIME, 0 * TIME, 30 * TIME, 0 * TIME])


@pytest.fixture
def command(tmp_path):
    pytest.importorskip("trimesh")
    stl(tmp_path, BALL)
    (tmp_path / "path.csv").write_text(HEAD + "\n".join(",".join(map(str, row)) for row in PATH))
    return lambda line: answer_of("predict", *line.split(), folder=tmp_path)


MESH = "--mesh ball.stl --unit mm --path path.csv"
"""Options of a ball that moves along a path."""


def test_what_is_said_beside_the_numbers(command, tmp_path, monkeypatch):
    (tmp_path / "path.csv").write_text(HEAD + "0,0,0,-20,0,0,0\n0.01,1,0,-21,0,0,0\n")
    stl(tmp_path, rftfit.Mesh(BALL.vertices_cm, BALL.faces[:, ::-1], sheet=True))
    code, _, err = command(f"{MESH} --medium poppy_LP")
    assert code == 0
    for words in (
        "deeper than measured: down to 22.9 cm",
        "faster than quasi-static: up to 141 cm/s",
        "ball.stl: mended, was turned inside out",
    ):
        assert words in err
    monkeypatch.setitem(sys.modules, "trimesh", None)
    code, _, err = command(f"{MESH} --medium poppy_LP")
    assert (code, "pip install 'rftfit[mesh]'" in err) == (2, True)


def test_long_work_is_announced(command, tmp_path, monkeypatch):
    monkeypatch.setattr("rftfit.cli.predict._TRIANGLE_S", 1e-3)
    rftfit.write_profile(
        tmp_path / "sand.json", rftfit.estimate_map(rftfit.published_table("table_s5")[:4])
    )
    code, out, err = command(f"{MESH} --profile-file sand.json --json")
    # draws, poses, triangles and minutes
    numbers = re.findall(r"\b\d+\b", err)
    assert (code, numbers[:3]) == (0, ["1000", "5", str(json.loads(out)["triangles"])])


def test_every_fault_is_told_at_once(command, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text(HEAD + "0,0,0,1,0,0,0\n1,a,0,1,0,0,0\n1,0,,1,0,0,0\n")
    code, _, err = command(f"{MESH} --unit m --medium popy")
    assert code == 2
    for text in (
        "path.csv, row 3, column x_cm: found 'a'",
        "path.csv, row 4, column y_cm",
        "4000 cm long",
        "--medium: found 'popy'",
    ):
        assert text in err
    assert not (tmp_path / "forces.csv").exists()
    path.write_text(HEAD + "0,0,0,1,0,0,0\n2,0,0,1,0,0,0\n2,0,0,1,0,0,0\n")
    code, _, err = command(f"{MESH} --medium poppy_LP")
    assert code == 2
    assert "path.csv, row 4, column t_s: found '2'" in err


WHEEL = "--mesh wheel.stl --unit mm --model-error 0"


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (
            "--mesh ball.stl",
            "--mesh needs --unit, the unit of its coordinates: mm, cm, m or in; and one of --press",
        ),
        (f"{MESH} --leg c_leg --hip 1", "found --leg and --hip with --mesh"),
        ("--mesh ball.stl --unit mm --hip 8", "with --mesh; a mesh turns about a hip along --path"),
        ("--leg c_leg --figure a.png", "found --figure without --mesh"),
        (f"{MESH} --figure a.gif", "allowed: a name that ends in"),
        (f"{WHEEL} --press 0", "a depth above 0 cm wanted, found 0"),
        (f"{WHEEL} --roll 2", "two numbers wanted"),
        (f"{WHEEL} --roll 2,20", "20 % is 0.2"),
        (f"{WHEEL} --roll 13,0.2", "below the diameter of 12.5 cm"),
        (f"{WHEEL} --roll 2,0.2 --press 1", "found --press and --roll; allowed: one of them"),
        (WHEEL, "one of --press DEPTH"),
    ],
)
@pytest.mark.usefixtures("command")
def test_words_that_do_not_go_together_and_motions_that_are_impossible(tmp_path, words, why):
    wheel_file(tmp_path)
    assert why in refused("predict", *words.split(), "--medium", "poppy_LP", folder=tmp_path)


@pytest.mark.parametrize(("shift_cm", "words"), [(0, "deepest"), (20, "above the surface")])
def test_a_path_says_how_deep_its_lowest_point_gets(command, tmp_path, shift_cm, words):
    path = PATH + shift_cm * np.eye(7)[3]
    (tmp_path / "path.csv").write_text(HEAD + "\n".join(",".join(map(str, row)) for row in path))
    code, out, _ = command(f"{MESH} --medium poppy_LP")
    motion = next(line for line in out.splitlines() if line.startswith("Motion:"))
    radius_cm = np.linalg.norm(BALL.vertices_cm, axis=1).max()
    assert (code, words in motion) == (0, True)
    if not shift_cm:
        depth_cm = float(motion.split("deepest ")[1].removesuffix(" cm"))
        assert depth_cm == pytest.approx(1.5 + radius_cm, rel=0.02)


def wheel_file(folder):
    """Write a wheel of 12.5 cm diameter and 6 cm width, in mm."""
    wheel = Mesh.cylinder(radius_cm=6.25, width_cm=6, facets=24)
    stl(folder, wheel, "wheel.stl")
    return wheel


def test_press_lets_the_lowest_point_reach_the_depth(command, tmp_path):
    wheel = wheel_file(tmp_path)
    code, out, _ = command(f"{WHEEL} --medium poppy_LP --press 3")
    assert code == 0
    forces = pd.read_csv(tmp_path / "forces.csv", comment="#")
    assert forces["depth_cm"].iloc[-1] == pytest.approx(3)
    np.testing.assert_allclose(forces["z_cm"], 6.25 - forces["depth_cm"], rtol=1e-6)
    assert (np.diff(forces["force_z_N"]) > 0).all()
    # symmetry cancels these: rounding is not printed
    assert (forces[["force_x_N", "force_y_N"]] == 0).all(axis=None)
    assert "largest force x" not in out
    assert "e-1" not in out
    assert len(Motion3D.press(wheel, 3).frames) == len(forces)


def test_a_wheel_rolls_as_the_path_of_its_pose_says(command, tmp_path):
    wheel = wheel_file(tmp_path)
    code, out, _ = command(f"{WHEEL} --medium poppy_LP --roll 2,0.2")
    assert code == 0
    forces = pd.read_csv(tmp_path / "forces.csv", comment="#")
    medium = rftfit.published_medium("poppy_LP")
    for row, angle in enumerate(np.radians(forces["wheel_turn_deg"][:4])):
        turned = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        motion = Motion3D([0, 0, 4.25], [0.8, 0, 0], [0, 1 / 6.25, 0], turned)
        expected = rftfit.predict(medium, wheel, motion, model_error=0)
        for name in ("force_x_N", "force_z_N", "moment_y_N_cm"):
            assert forces[name][row] == pytest.approx(expected[name][0], rel=1e-5)
    mean = forces["force_x_N"].mean()
    assert f"drawbar (toward +x) {mean:.4g} N" in out


def test_a_wheel_whose_axle_lies_elsewhere_is_refused():
    wheel = Mesh.cylinder(radius_cm=6.25, width_cm=6)
    standing = Mesh(wheel.vertices_cm[:, [0, 2, 1]], wheel.faces[:, ::-1])
    with pytest.raises(ValueError, match="along y"):
        Motion3D.roll(standing, 2, 0.2)


def test_an_interval_around_0_reaches_to_both_signs_and_the_widest_one_is_drawn(command, tmp_path):
    code, out, _ = command("--mesh ball.stl --unit mm --press 1 --medium poppy_LP --figure f.svg")
    forces = pd.read_csv(tmp_path / "forces.csv", comment="#")
    assert code == 0
    for axis in "xy":
        farthest = (
            forces[[f"force_{axis}_next_{end}_N" for end in ("lo", "hi")]].abs().to_numpy().max()
        )
        assert (
            f"force {axis}: 0, in the interval of a pose up to {farthest:.4g} N either way" in out
        )
    assert "the sign is not known" not in out
    assert "(0, 0, 0) of the mesh" in out
    names_of_bands = re.findall("<!-- .* interval of (.*) -->", (tmp_path / "f.svg").read_text())
    assert [name.partition(" (")[0] for name in names_of_bands] == ["the next bed"]
