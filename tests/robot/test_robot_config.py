"""A robot file describes any robot, and everything wrong in it is named by line and key."""

import re

import pytest
from paper import PROJECT

import rftfit
from rftfit.robot.config import main

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


def simulate(path):
    """Run the robot of a file."""
    sand = rftfit.published_medium("poppy_LP")
    return rftfit.simulate(sand, 2.0, 1.0, path, samples_per_stride=10)


def wrong(folder, text):
    path = folder / "robot.yaml"
    path.write_text(text, "utf-8")
    return problems_of(path)


def problems_of(path):
    with pytest.raises(rftfit.RftfitError) as caught:
        simulate(path)
    assert caught.value.exit_code == 2
    return list(getattr(caught.value, "problems", ()))


def test_any_robot(tmp_path):
    (tmp_path / "robot.yaml").write_text(GOOD, "utf-8")
    series = simulate(tmp_path / "robot.yaml").series
    assert series is not None
    # legs of one phase are one group
    assert tuple(series.force_z_N) == ("belly", "front", "tripod_1", "tripod_2")
    # flat on the ground, or on the tips of legs that hang 3 cm down
    assert series.z_cm[0] == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("mass", ["0", "-150", ".nan", ".inf", '"150"', "heavy", "[1]", "true"])
def test_bad_mass(tmp_path, mass):
    (problem,) = wrong(tmp_path, GOOD.replace("mass_g: 100", f"mass_g: {mass}"))
    assert (problem.place.line, problem.place.key) == (3, "body.mass_g")
    assert problem.code in ("config.wrong-type", "config.out-of-range")


def test_all_problems_at_once(tmp_path):
    text = GOOD.replace("inertia_g_cm2: 500", "inertia: 500")
    text = text.replace("width_cm: 0.8", "width_cm: -1").replace("{x_cm: 3,", "{x_cm: 30,")
    text = text.replace("phase_turns: 0.25", "phase_turns: 1").replace("method: rk4", "method: rk5")
    problems = wrong(tmp_path, text)
    assert [
        (problem.place.line, problem.place.key, problem.code, problem.nearest or "")
        for problem in problems
    ] == [
        (2, "body.inertia_g_cm2", "config.missing-key", ""),
        (4, "body.inertia", "config.unknown-key", "inertia_g_cm2"),
        (10, "legs.width_cm", "config.out-of-range", ""),
        (12, "legs.hips.1", "config.inconsistent", ""),
        (13, "legs.hips.2.phase_turns", "config.out-of-range", ""),
        (14, "numerics.method", "config.unknown-word", "rk4"),
    ]
    assert re.search(" x = 30, z = 0 cm .* -4 to 4 .* -1 to 1 cm", problems[3].allowed)


@pytest.mark.parametrize(
    ("old", "new", "place", "code", "words"),
    [
        (
            "{x_cm: -3, z_cm: 0.5,",
            "{x_cm: -3, z_cm: 1.5,",
            (13, "legs.hips.2"),
            "inconsistent",
            "x = -3, z = 1.5 cm",
        ),
        (
            "to_cm: [4, 1]",
            "to_cm: [4, -1]",
            (7, "body.plates.front"),
            "inconsistent",
            "must differ",
        ),
        ("to_cm: [4, 1]", "to_cm: [4]", (7, "body.plates.front.to_cm"), "wrong-type", "2 numbers"),
        ("front:", "Belly:", (2, "body"), "inconsistent", "differ by case only"),
        ("numerics:", "numeric:", (14, "numeric"), "unknown-key", "numerics"),
        ("step_s: 0.0002", "step_s: 0.1", (14, "numerics.step_s"), "out-of-range", "at most 0.01"),
        ("title: small", "title: small\ntitle: big", (2, "title"), "duplicate-key", "line 1"),
    ],
)
def test_single_problems(tmp_path, old, new, place, code, words):
    problem, *_ = wrong(tmp_path, GOOD.replace(old, new))
    assert ((problem.place.line, problem.place.key), problem.code) == (place, f"config.{code}")
    assert words in problem.allowed


@pytest.mark.parametrize("text", ["", "- 1\n- 2\n", "{", "body: 3\n", "legs: {hips: 3}\n"])
def test_no_robot_at_all(tmp_path, text):
    assert wrong(tmp_path, text)
    assert [problem.code for problem in problems_of(tmp_path / "none.yaml")] == ["config.missing"]


def test_schema_in_step(tmp_path):
    main(tmp_path)
    written = (tmp_path / "robot.schema.json").read_text("utf-8")
    kept = PROJECT / "config" / "robot.schema.json"
    assert written == kept.read_text("utf-8"), (
        "the models have changed: run python -m rftfit.robot.config"
    )
    assert kept.name in kept.with_name("robot.yaml").read_text("utf-8").splitlines()[0]
