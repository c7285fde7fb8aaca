"""`rftfit export` writes a profile file from which other commands get the same numbers.

Other commands: `scale`, `plan`, `predict` and `simulate`.
"""

import hashlib
import json
from typing import Any

import numpy as np
import pandas as pd
import pytest
from result_tables import read_output

from rftfit import reference
from rftfit.checks.declared import COLUMNS
from rftfit.measure.verdict_words import UNUSABLE
from rftfit.store import write_csv

from .conftest import MEASURED

PUSHES = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3\n0,90,0.35,0\n60,45,0.2,0.1\n"
"""A csv of two pushes."""


pytestmark = pytest.mark.usefixtures("work_folder")


def content(path):
    fields: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return fields


def test_a_published_medium_goes_round(rftfit, work_folder):
    output = rftfit("export --medium poppy_LP --title Seeds --notes 'as printed'")
    profile = content(work_folder / "profile.json")
    golden = profile["golden"]
    for words in (
        "Directions: 74, 74 with a number, 74 pushed",
        f"({golden['beta_deg']:g}, {golden['gamma_deg']:g}) degrees",
        f"{golden['alpha_z_N_per_cm3']:.6g} N/cm^3",
        "rftfit predict --leg c_leg --profile-file profile.json",
    ):
        assert words in output.out
    assert profile["medium"] == {"name": "poppy_LP", "title": "Seeds", "notes": "as printed"}
    assert profile["validity"]["depth_to_cm"] == 9
    assert profile["origin"]["citation"] == reference.CITATION
    leg = "predict --leg c_leg --output"
    rftfit(leg, "a.csv --profile-file profile.json")
    rftfit(leg, "b.csv --medium poppy_LP")
    of_file, of_medium = (read_output(f"{name}.csv") for name in "ab")
    np.testing.assert_allclose(of_file, of_medium, atol=1e-8)


HEAD = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3,se_z,se_x\n"


def test_scale_and_plan_go_on_from_the_pushes_behind_a_profile(rftfit, work_folder):
    rows = ["0,90,0.35,,0.01,\n", "30,45,0.2,0.1,,\n", "-30,60,0.12,0.02,0.005,0.004\n"]
    (work_folder / "two.csv").write_text(HEAD + "".join(rows[:2]), "utf-8")
    (work_folder / "one.csv").write_text(HEAD + rows[2], "utf-8")
    (work_folder / "all.csv").write_text(HEAD + "".join(rows), "utf-8")
    rftfit("export --pushes two.csv --output p.json")
    assert content(work_folder / "p.json")["pushes"]["alpha_x_N_per_cm3"] == [None, 0.1]
    for name, words in (
        ("a", "--pushes two.csv"),
        ("b", "--profile-file p.json"),
        ("c", "--pushes all.csv"),
        ("d", "--pushes one.csv --profile-file p.json"),
    ):
        rftfit("scale", words, "--output", f"{name}.csv")
        rftfit("plan", words, "--count 2 --output", f"{name}_plan.csv")
    for pushes_name, profile_name in (("a", "b"), ("c", "d")):
        table, profile_table = (
            read_output(work_folder / f"{name}.csv") for name in (pushes_name, profile_name)
        )
        numbers = table.select_dtypes("number").columns
        np.testing.assert_allclose(table[numbers], profile_table[numbers], atol=2e-6)
        assert (table["source"] == profile_table["source"]).all()
        plans = [
            (work_folder / f"{name}_plan.csv").read_text() for name in (pushes_name, profile_name)
        ]
        assert plans[0] == plans[1]
    assert not read_output(work_folder / "a.csv").equals(read_output(work_folder / "c.csv"))


def test_pushes_of_a_profile_that_do_not_belong_together(rftfit, refusal, work_folder):
    (work_folder / "field.csv").write_text(PUSHES, "utf-8")
    rftfit("export --pushes field.csv --output p.json")
    profile = content(work_folder / "p.json")
    profile["pushes"]["se_x"].pop()
    (work_folder / "p.json").write_text(json.dumps(profile), "utf-8")
    err = refusal("scale --profile-file p.json")
    assert "pushes.se_x" in err
    assert "2 entries, as beta_deg has" in err
    err = refusal("scale --profile-file p.json --alpha 0.3")
    assert {"--alpha", "--pushes"} <= set(err.split())


def test_media_of_a_campaign(rftfit, refusal, work_folder, results):
    rftfit("export --results", results, "--medium poppy_LP")
    profile = content(work_folder / "profile.json")
    alpha = results / "alpha" / "poppy_LP.csv"
    assert profile["origin"]["made_from"] == {
        "results/alpha/poppy_LP.csv": hashlib.sha256(alpha.read_bytes()).hexdigest()
    }
    assert profile["origin"]["kind"] == "table"
    assert (profile["validity"]["depth_from_cm"], profile["validity"]["depth_to_cm"]) == (1, 9)
    # a natural sand is known by one push: it has no table, but a map
    rftfit("export --results", results, "--medium sand --output s.json")
    sand = content(work_folder / "s.json")
    assert (sand["origin"]["kind"], sand["origin"]["pushes"]) == ("map", 1)
    assert "too few directions" in refusal(
        "export --results", results, "--medium sand --profile table"
    )


def test_marks_are_handed_on(rftfit, work_folder, results):

    for name in (*MEASURED, "sand"):
        bad = name == "poppy_LP"
        row = {
            "medium": name,
            "check": "work",
            "verdict": "failed" if bad else "passed",
            "effect": UNUSABLE if bad else "",
            "sentence": "x",
        }
        table = pd.DataFrame([row]).reindex(columns=COLUMNS)
        write_csv(table, results / "checks" / f"{name}.csv")
    output = rftfit("export --results", results, "--medium poppy_LP")
    mark = content(work_folder / "profile.json")["validity"]["marks"]
    assert mark.startswith("unusable: ")
    assert f"warning: poppy_LP is {mark}" in output.err


def test_pushes_become_a_map(rftfit, work_folder):
    (work_folder / "field.csv").write_text(PUSHES, "utf-8")
    output = rftfit("export --pushes field.csv --output field.json")
    profile = content(work_folder / "field.json")
    assert profile["medium"]["name"] == "field"
    digest = hashlib.sha256((work_folder / "field.csv").read_bytes()).hexdigest()
    assert profile["origin"]["made_from"] == {"field.csv": digest}
    assert "standard error" in output.out
    output = rftfit("predict --leg flat_leg --profile-file field.json --json")
    facts = json.loads(output.out)
    assert facts["profile"].startswith("map of field from 2 pushes")
    lift = facts["peaks"]["lift"]
    assert lift["lo"] < lift["force_z_N"] < lift["hi"]


def test_one_push_is_the_same_by_alpha_and_by_a_table(rftfit, work_folder):
    (work_folder / "one.csv").write_text(HEAD + "0,90,0.55,,,\n", "utf-8")
    for name, words in (("a", "--alpha 0.55"), ("b", "--pushes one.csv")):
        rftfit("export", words, "--output", f"{name}.json")
        rftfit("predict --leg reversed_c_leg", words, "--output", f"{name}.csv")
        rftfit("scale", words, "--output", f"{name}_scaled.csv")
    of_alpha, of_pushes = (content(work_folder / f"{name}.json") for name in "ab")
    assert of_alpha["directions"] == of_pushes["directions"]
    assert of_alpha["errors"] == of_pushes["errors"]
    for alpha_file, pushes_file in (("a.csv", "b.csv"), ("a_scaled.csv", "b_scaled.csv")):
        table, second_table = (
            read_output(work_folder / name) for name in (alpha_file, pushes_file)
        )
        pd.testing.assert_frame_equal(table, second_table)
    rftfit("predict --leg reversed_c_leg --profile-file a.json --output c.csv")
    table, second_table = (read_output(work_folder / f"{name}.csv") for name in "ac")
    off = (table - second_table).abs().max() / table.abs().max().clip(lower=1e-9)
    assert off.max() < 5e-6


@pytest.mark.parametrize("words", ["--alpha 0.55", "--pushes one.csv"])
def test_a_flat_foot_pressed_straight_down_gives_its_own_push_back(words, rftfit, work_folder):
    (work_folder / "one.csv").write_text(HEAD + "0,90,0.55,,,\n", "utf-8")
    (work_folder / "foot.csv").write_text("x_cm,z_cm\n-4,0\n4,0\n")
    (work_folder / "press.csv").write_text("t_s,x_cm,z_cm,angle_deg\n0,0,0,0\n5,0,-5,0\n")
    foot = "predict --outline foot.csv --width 5 --path press.csv --json"
    facts = json.loads(rftfit(foot, words).out)
    assert facts["peaks"]["lift"]["force_z_N"] == pytest.approx(110, rel=0.01)


def test_the_robot_walks_on_it(rftfit):
    rftfit("export --medium poppy_LP")
    walk = "simulate --frequency 2 --curvature 1 --no-animation --json --output"
    medium_walk, profile_walk = (
        json.loads(rftfit(walk, words).out)
        for words in ("a --medium poppy_LP", "b --profile-file profile.json")
    )
    assert medium_walk["outcome"] == "steady"
    assert profile_walk["speed_cm_per_s"] == pytest.approx(medium_walk["speed_cm_per_s"], rel=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "found no medium; allowed: one of --medium NAME"),
        ("--medium poppy_LP --pushes p.csv", "found --medium and --pushes; allowed: one of"),
        ("--medium popy_LP", "did you mean 'poppy_LP'?"),
        ("--medium poppy_LP --profile fourier", "allowed: table, map"),
        ("--pushes p.csv --profile table", "--profile: found 'table'; allowed: map"),
        ("--pushes p.csv --results r", "r: no config/config.yaml there"),
        ("--pushes none.csv", "none.csv: "),
        ("--pushes p.csv --output p.csv --force", "p.csv: this file is read"),
        ("--medium poppy_LP --results none", "no config/config.yaml there"),
        ("--medium poppy_LP --title \x1b[2J", "title: text without control characters"),
    ],
)
def test_words_that_do_not_go_together(words, message, refusal, work_folder):
    (work_folder / "p.csv").write_text(PUSHES, "utf-8")
    assert message in refusal("export", words)
    assert (work_folder / "p.csv").read_text() == PUSHES
    assert not (work_folder / "profile.json").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--medium poppy_LP", "found --medium and --profile-file; allowed: one of"),
        ("--alpha 0.9", "found --alpha and --profile-file; allowed: one of"),
        ("--profile table", "found --profile with --profile-file"),
        ("--results r", "found --results with --profile-file"),
        ("--method lsq", "found --method with --profile-file"),
    ],
)
@pytest.mark.parametrize("command", ["predict --leg c_leg", "simulate --frequency 2 --curvature 1"])
def test_one_medium_only(command, words, message, refusal):
    assert message in refusal(command, "--profile-file profile.json", words)


def test_a_damaged_file_is_refused_by_every_reader(rftfit, refusal, work_folder):
    rftfit("export --medium poppy_LP")
    profile = content(work_folder / "profile.json")
    profile["golden"]["alpha_x_N_per_cm3"] *= -1
    (work_folder / "profile.json").write_text(json.dumps(profile), "utf-8")
    for command in ("predict --leg c_leg", "simulate --frequency 2 --curvature 1"):
        assert "the golden value alpha_x_N_per_cm3" in refusal(
            command, "--profile-file profile.json"
        )
    # the forces never overwrite the file that is read
    rftfit("export --medium poppy_LP --output q.json")
    assert "this file is read" in refusal(
        "predict --leg c_leg --profile-file q.json --output q.json --force"
    )
