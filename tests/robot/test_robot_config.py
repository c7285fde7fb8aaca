"""The robot's file: the default one, and everything that can be wrong with one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rftfit.campaign.problems import CampaignError
from rftfit.robot.body import assemble
from rftfit.robot.config import json_schema, main, paper_robot, paper_robot_path, read_robot

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.robot.config import Robot

GOOD = """\
title: small
body:
  mass_g: 100
  inertia_g_cm2: 500
  plates:
    belly: {from_cm: [-4, -1], to_cm: [4, -1], width_cm: 2}
    front: {from_cm: [4, -1], to_cm: [4, 1], width_cm: 2}
legs:
  max_length_cm: 3
  width_cm: 0.8
  hips:
    - {x_cm: 3, z_cm: 0, phase_turns: 0}
    - {x_cm: -3, z_cm: 0.5, phase_turns: 0.25}
numerics: {method: rk4, step_s: 0.0002}
"""


def read(folder: Path, text: str) -> Robot:
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    return read_robot(path)


def wrong(folder: Path, text: str) -> list[str]:
    with pytest.raises(CampaignError) as caught:
        read(folder, text)
    return [str(problem).split("robot.yaml, ", 1)[-1] for problem in caught.value.problems]


def test_the_papers_robot() -> None:
    robot = paper_robot()
    assert (robot.body.mass_g, robot.body.inertia_g_cm2) == (150, 2080)
    assert (robot.legs.max_length_cm, robot.legs.width_cm) == (4.1, 1.0)
    belly = robot.body.plates["belly"]
    assert (belly.to_cm[0] - belly.from_cm[0], belly.width_cm) == (13, 2)
    parts = assemble(robot, 1.0)
    assert parts.names == ("belly", "front", "rear", "tripod_1", "tripod_2")
    assert (len(parts.group), parts.bodies.shape[1]) == (9, 30)
    # the two tripods stand on the same places in the plane
    places = [sorted(parts.hips[parts.group == tripod, 0]) for tripod in (3, 4)]
    assert places[0] == places[1]
    text = paper_robot_path().read_text(encoding="utf-8")
    for mark in ("given", "calibrated", "assumed", "studies/calibrate.py"):
        assert mark in text


def test_any_robot(tmp_path: Path) -> None:
    robot = read(tmp_path, GOOD)
    assert robot.numerics.method == "rk4"
    assert assemble(robot, 0.0).names == ("belly", "front", "tripod_1", "tripod_2")
    assert assemble(robot, 0.0).reach_cm == pytest.approx(3)
    for curvature in (-1.0, 0.4, 1.0):
        assert 2.9 < assemble(robot, curvature).reach_cm < 3.1


@pytest.mark.parametrize("mass", ["0", "-150", ".nan", ".inf", '"150"', "heavy", "[1]", "true"])
def test_bad_mass(tmp_path: Path, mass: str) -> None:
    (found,) = wrong(tmp_path, GOOD.replace("mass_g: 100", f"mass_g: {mass}"))
    assert found.startswith("line 3, key body.mass_g: found '")
    assert "mass of the whole robot, g" in found


def test_all_problems_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("inertia_g_cm2: 500", "inertia: 500")
    text = text.replace("width_cm: 0.8", "width_cm: -1").replace("{x_cm: 3,", "{x_cm: 30,")
    text = text.replace("phase_turns: 0.25", "phase_turns: 1").replace("method: rk4", "method: rk5")
    found = wrong(tmp_path, text)
    assert [line.split(":")[0] for line in found] == [
        "line 2, key body.inertia_g_cm2",
        "line 4, key body.inertia",
        "line 10, key legs.width_cm",
        "line 12, key legs.hips.1",
        "line 13, key legs.hips.2.phase_turns",
        "line 14, key numerics.method",
    ]
    text = "\n".join(found)
    for words in (
        "this key is missing", "did you mean 'inertia_g_cm2'?", "allowed: above 0",
        "hip 1 at x = 30, z = 0 cm lies outside the body, which spans x from -4 to 4 and z from -1",
        "allowed: below 1", "did you mean 'rk4'?",
    ):  # fmt: skip
        assert words in text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("{x_cm: -3, z_cm: 0.5,", "{x_cm: -3, z_cm: 1.5,", "hip 2 at x = -3, z = 1.5 cm"),
        ("to_cm: [4, 1]", "to_cm: [4, -1]", "two ends of a plate must differ"),
        ("to_cm: [4, 1]", "to_cm: [4]", "this key is missing"),
        ("front:", "Belly:", "differ by case only"),
        ("numerics:", "numeric:", "did you mean 'numerics'?"),
        ("step_s: 0.0002", "step_s: 0.1", "at most 0.01"),
        ("title: small", "title: small\ntitle: big", "title"),
    ],
)
def test_single_problems(tmp_path: Path, old: str, new: str, words: str) -> None:
    found = wrong(tmp_path, GOOD.replace(old, new))
    assert words in "\n".join(found)


@pytest.mark.parametrize("text", ["", "- 1\n- 2\n", "{", "body: 3\n", "legs: {hips: 3}\n"])
def test_no_robot_at_all(tmp_path: Path, text: str) -> None:
    assert wrong(tmp_path, text)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="does not exist"):
        read_robot(tmp_path / "none.yaml")


def test_schema_in_step(tmp_path: Path) -> None:
    main(tmp_path)
    written = (tmp_path / "robot.schema.json").read_text(encoding="utf-8")
    beside = paper_robot_path().with_name("robot.schema.json")
    assert written == json_schema() == beside.read_text(encoding="utf-8"), (
        "the models have changed: run python -m rftfit.robot.config"
    )
    assert "robot.schema.json" in paper_robot_path().read_text(encoding="utf-8").splitlines()[0]
