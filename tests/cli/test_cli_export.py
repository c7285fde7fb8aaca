"""`rftfit export` writes a profile file from which other commands get the same numbers.

Other commands: `scale`, `plan`, `predict` and `simulate`.
"""

import json
from typing import Any

import numpy as np
import pytest
from result_tables import read_output

pytestmark = pytest.mark.usefixtures("work_folder")


def content(path):
    fields: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return fields


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
