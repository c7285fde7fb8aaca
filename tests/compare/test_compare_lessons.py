"""Forces on a leg in some media improve the prediction of it in a medium that was left out.

Lesson: what a prediction learned from: plates, another leg, or the same leg in other media. Also
tested: a leg is learned from only where the config names it.
"""

import numpy as np
import pytest
import yaml
from paper import few_draws
from result_tables import LABORATORY, SAND, make_campaign, one_cell

import rftfit
from rftfit import reference
from rftfit.compare.lessons import lesson_rows

LEGS = ("c_leg", "reversed_c_leg")
ROLES = {"poppy_LP": LABORATORY, "glass3mm_CP": LABORATORY, "yuma": SAND}
"""Role of each medium of the campaign."""


def campaign(root):
    alpha = {name: reference.alpha_grid(name) for name in ROLES if name != "yuma"}
    alpha["yuma"] = one_cell(0.5)
    results = rftfit.open(make_campaign(root, ROLES, alpha))
    for name in ROLES:
        table = reference.load("fig_s12" if name == "yuma" else "fig_s5")
        table = table[(table["medium"] == name) & table["leg"].isin(LEGS)]
        results.hold(f"legs/{name}.csv", table.iloc[::5].reset_index(drop=True))
    return results


def test_the_same_leg_elsewhere_predicts_better_than_plates_alone(tmp_path):
    with few_draws():
        lessons = lesson_rows(campaign(tmp_path))
    means = lessons.groupby("lesson")[["rms_relative_to_peak", "inside_percent"]].mean()
    rms = means["rms_relative_to_peak"]
    assert rms["same-leg-elsewhere"] < 0.85 * rms["plates"]
    assert means["inside_percent"]["same-leg-elsewhere"] > 85


def test_a_curve_of_one_pose_has_a_reason_and_no_number(tmp_path):
    stopped = campaign(tmp_path)
    one_pose = stopped.table("legs/yuma.csv").query("leg == 'c_leg'").iloc[40:41]
    stopped.hold("legs/yuma.csv", one_pose)
    with few_draws():
        rows = lesson_rows(stopped).query("medium == 'yuma'")
    assert [*rows["component"]] == ["z", "x"]
    assert (rows["reason_code"] == "few-poses").all()
    assert rows["peak_error_percent"].isna().all()
    with pytest.raises(rftfit.RftfitError, match=r"c_leg: .*1 pose"):
        stopped["yuma"].contact("c_leg")


def test_a_teacher_must_be_a_leg(tmp_path):
    campaign(tmp_path)
    file = tmp_path / "config" / "config.yaml"
    config = yaml.safe_load(file.read_text())
    file.write_text(yaml.safe_dump(config | {"maps": {"use_legs": ["plate"]}}))
    with pytest.raises(rftfit.RftfitError, match="use_legs"):
        rftfit.open(tmp_path / "results").config.maps  # noqa: B018


def test_a_turn_is_planned_where_it_narrows_more_than_a_push():
    leg, motion = rftfit.model_leg("reversed_c_leg"), rftfit.rotation(np.arange(-110.0, 111, 10))
    plain = rftfit.plan(leg, count=2)
    weighed = rftfit.plan(leg, count=2, turns=[(leg, motion)])
    assert weighed.steps[2].turn == "reversed_c_leg"
    assert weighed.steps[2].overall < plain.steps[2].overall
    assert "turn" not in plain.table()
    assert [*weighed.table()["turn"]] == ["", "", "reversed_c_leg"]
