"""A valid campaign loads with all its runs, and an invalid one raises an error with every problem.

`room` is a small valid campaign on disk (tests/helpers/campaigns.py). Also tested: how a
problem reads as text, and what is suggested for a misspelled word.
"""

import math
import subprocess
import sys

import pytest
from makers import answer_of, write_campaign

import rftfit
from rftfit.campaign.load import check_campaign


def test_a_right_campaign_has_no_problem_and_all_its_runs(room):
    campaign = room.campaign()
    assert room.check() == []
    assert [run.run_id for run in campaign.runs] == list(room.rows)
    run, air = campaign.by_id["p1"], campaign.by_id["a1"]
    assert (run.beta_deg, run.gamma_deg, run.row) == (30.0, 45.0, 2)
    assert campaign.by_id["h1"].depth_cm == 2.54
    assert (air.medium, air.surface_z_mm) == ("", None)
    assert all(map(math.isnan, (run.depth_cm, air.beta_deg, air.gamma_deg)))
    root = room.folder.resolve()
    assert (campaign.root, campaign.raw, campaign.sheet) == (root, root / "raw", root / "runs.csv")
    # outside of a folder `config`
    moved, problems = check_campaign(room.path.rename(room.folder / "mine.yaml"))
    assert problems == []
    assert moved is not None
    assert moved.root == root


def test_runs_of_a_medium_are_sorted_and_bring_their_air_runs(room):
    def ids(campaign, medium):
        return [run.run_id for run in campaign.runs_of(medium)]

    room.add("q1", "p1", medium="poppy_CP", tare_run="")
    campaign = room.campaign()
    assert ids(campaign, "poppy_LP") == ["a1", "c1", "h1", "p1", "t1", "th"]
    assert ids(campaign, "poppy_CP") == ["q1"]
    assert campaign.media_with_runs == ("poppy_LP", "poppy_CP")
    room.rows = dict(reversed(room.rows.items()))
    assert ids(room.campaign(), "poppy_LP") == ids(campaign, "poppy_LP")
    with pytest.raises(KeyError):
        campaign.runs_of("sand")


def test_an_air_run_without_a_leg_is_unclaimed_and_warned_about(room):
    room.add("a2", "a1")
    problem = room.only("sheet.tare-unused")
    assert (problem.place.row, problem.place.column, problem.found) == (8, "run_id", "a2")
    assert [run.run_id for run in room.campaign().unassigned_air_runs] == ["a2"]


def test_a_run_is_refused_with_every_problem_a_line_each(room):
    room.config = room.config.replace("title:", "titel:", 1)
    room.rows["p1"]["medium"] = "popy_LP"
    room.rows["h1"]["beta_deg"] = "100"
    room.rows["c1"]["note"] = "x"
    room.rows["t1"]["reason"] = "y"
    nearest = {problem.nearest for problem in room.check()}
    assert nearest == {"title", "poppy_LP", "-80", None}
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.run(room.folder)
    lines = str(caught.value).splitlines()
    assert lines[0] == "4 errors:"
    assert lines[-2] == "1 warning:"
    assert len(lines) == 2 + 5


def test_the_sheet_is_checked_even_when_the_config_is_wrong(room):
    room.config = room.config.replace("width_cm: 22,", "width_cm: wide,")
    room.rows["p1"]["medium"] = "popy_LP"
    problems = room.check()
    assert {problem.code for problem in problems} == {"config.wrong-type", "sheet.unknown-word"}
    assert [str(problem).partition("; allowed")[0] for problem in problems] == [
        "config/config.yaml, line 8, key container.width_cm: found 'wide'",
        "runs.csv, row 2, column medium: found 'popy_LP'",
    ]


def test_what_is_wrong_alike_in_many_rows_or_columns_is_one_line(room):
    for run_id in ("p1", "t1", "h1", "c1"):
        room.rows[run_id]["medium"] = "mud"
    room.write()
    lines = answer_of("check", folder=room.folder)[1].splitlines()
    start = "runs.csv, rows 2 to 4, 6, column medium: found 'mud'; allowed: "
    assert sum(line.strip().startswith(start) for line in lines) == 1
    config = {"title": "t", "raw": "raw", "run_sheet": "raw/a.csv", "table": {"holds": "alpha"}}
    config |= {"media": {"sand": {"title": "sand"}}}
    table = "beta,gamma,alpha_z,alpha_x,colour,flagged,alfa_z\n0,90,1,0,a,b,c\n"
    write_campaign(room.folder / "table", config, logs={"a.csv": table})
    printed = answer_of("check", folder=room.folder / "table")[1]
    assert "raw/a.csv, columns colour, flagged, row 1: " in printed
    assert "raw/a.csv, row 1, column alfa_z: " in printed


@pytest.mark.parametrize(
    ("word", "meant"), [("popy_LP", "; did you mean 'poppy_LP'?"), ("mud", "")]
)
def test_an_unknown_word_of_a_call(word, meant):
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.published_medium(word)
    allowed = ", ".join(rftfit.published_table("table_s5")["medium"].unique())
    expected = f"medium: found '{word}'; allowed: {allowed}{meant} (published media)"
    assert str(caught.value) == expected


@pytest.mark.parametrize(
    ("word", "expected"), [("popy_LP", "poppy_LP"), ("POPPY-cp", "poppy_CP"), ("glass", None)]
)
def test_did_you_mean(room, word, expected):
    room.rows["p1"]["medium"] = word
    assert room.only("sheet.unknown-word").nearest == expected


@pytest.mark.parametrize(
    ("cell", "shown"),
    [("a\x1b[31m\nb", r"a\x1b[31m\nb"), ("ö", "ö"), ("x" * 1000, "x" * 77 + "...")],
)
def test_shown_text_has_no_control_characters_and_an_end(room, cell, shown):
    room.rows["p1"]["medium"] = cell
    assert f"found '{shown}';" in str(room.only("sheet.unknown-word"))


def test_loading_needs_no_heavy_library(room):
    room.write()
    code = (
        "import sys; from pathlib import Path; from rftfit.campaign.load import load_campaign; "
        f"load_campaign(Path({str(room.path)!r})); "
        "print([m for m in ('openpyxl', 'matplotlib', 'scipy', 'numba') if m in sys.modules])"
    )
    command = [sys.executable, "-c", code]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "[]"
