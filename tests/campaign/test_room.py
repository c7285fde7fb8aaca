"""A valid campaign loads with all its runs, and an invalid one raises an error with every problem.

`room` is a small valid campaign on disk (tests/helpers/campaigns.py). Also tested: how a
problem reads as text, and what is suggested for a misspelled word.
"""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import rftfit
from rftfit import reference
from rftfit.campaign.load import check_campaign, load_campaign
from rftfit.campaign.problems import CampaignError, Place, Problem, in_lines
from rftfit.errors import InputError


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
    assert (problem.place, problem.found) == (Place("runs.csv", 8, "run_id"), "a2")
    assert [run.run_id for run in room.campaign().unassigned_air_runs] == ["a2"]


def test_load_raises_with_every_problem_a_line_each(room):
    room.config = room.config.replace("title:", "titel:", 1)
    room.rows["p1"]["medium"] = "popy_LP"
    room.rows["h1"]["beta_deg"] = "100"
    room.rows["c1"]["note"] = "x"
    room.rows["t1"]["reason"] = "y"
    room.write()
    with pytest.raises(CampaignError) as caught:
        load_campaign(room.path)
    lines = str(caught.value).splitlines()
    assert lines[0] == "4 errors:"
    assert lines[-2] == "1 warning:"
    assert len(lines) == 2 + 5 == 2 + len(caught.value.problems)
    nearest = {problem.nearest for problem in caught.value.problems}
    assert nearest == {"title", "poppy_LP", "-80", None}
    assert isinstance(caught.value, InputError)


def test_the_sheet_is_checked_even_when_the_config_is_wrong(room):
    room.config = room.config.replace("width_cm: 22,", "width_cm: wide,")
    room.rows["p1"]["medium"] = "popy_LP"
    assert {problem.code for problem in room.check()} == {"config.wrong-type", "sheet.unknown-word"}


def test_problem_reads_as_a_sentence():
    place = Place("runs.csv", 14, "medium")
    problem = Problem("sheet.unknown-word", place, "popy_LP", "one of poppy_LP", "poppy_LP")
    assert str(problem) == (
        "runs.csv, row 14, column medium: found 'popy_LP'; allowed: one of poppy_LP; "
        "did you mean 'poppy_LP'?"
    )
    assert str(Place("c.yaml", line=3, key="media.x")) == "c.yaml, line 3, key media.x"
    assert str(Place("c.yaml", line=3, column="9")) == "c.yaml, line 3, column 9"
    assert str(Problem("x.y", Place(""), None, "nothing here")) == "nothing here"


def test_what_is_wrong_alike_in_many_rows_is_one_line():
    problem = Problem("sheet.unknown-word", Place("runs.csv", 1, "medium"), "mud", "sand")
    rows = (4, 2, 3, 9, 9)
    alike = [replace(problem, place=replace(problem.place, row=row)) for row in rows]
    other = Problem("sheet.empty", Place("runs.csv", 3, "kind"), None, "a word")
    assert in_lines([*alike, other]) == [
        "runs.csv, rows 2 to 4, 9, column medium: found 'mud'; allowed: sand",
        str(other),
    ]
    assert in_lines(alike[:1]) == [str(alike[0])]


def test_what_is_wrong_alike_in_many_columns_is_one_line():
    unread = Problem("alpha.unknown-column", Place("a.csv", 1, "n_runs"), None, "not read")
    named = replace(unread, place=replace(unread.place, column="alfa_z"), nearest="alpha_z")
    other = replace(unread, place=replace(unread.place, column="flagged"))
    assert in_lines([unread, named, other]) == [
        "a.csv, columns n_runs, flagged, row 1: not read",
        "a.csv, row 1, column alfa_z: not read; did you mean 'alpha_z'?",
    ]


@pytest.mark.parametrize(
    ("word", "meant"), [("popy_LP", "; did you mean 'poppy_LP'?"), ("mud", "")]
)
def test_an_unknown_word_of_a_call(word, meant):
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.published_medium(word)
    allowed = ", ".join(reference.MEDIA)
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
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == "[]"


def test_the_demonstration_config_is_right(pytestconfig):
    path: Path = pytestconfig.rootpath / "config" / "config.yaml"
    codes = {problem.code for problem in check_campaign(path)[1] if problem.severity == "error"}
    # its logs and sheet are made by `rftfit reenact`
    assert codes <= {"config.raw-missing", "sheet.missing"}
