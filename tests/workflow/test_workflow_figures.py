"""A figure that has nothing to show says so in words and has no caption."""

import re
import shutil

import numpy as np
import pytest
from campaigns import Folder
from pages import words

import rftfit
from rftfit import Results
from rftfit.figures.registry import figures
from rftfit.workflow.state import read_states

pytestmark = pytest.mark.slow

CAN_LACK = [
    figure
    for figure in figures()
    if figure.lacking is not type(figure).lacking and not figure.on_demand
]
"""Figures that can lack their input."""


@pytest.fixture
def without_rows(small_made):
    """Results of a campaign, the tables that a figure reads without their rows; only read."""
    results_of_all = rftfit.open(small_made.root)

    def empty(declared):
        results = Results(results_of_all.campaign)
        places = {
            "media": results_of_all.media,
            "laboratory": results_of_all.laboratory,
            "sands": results_of_all.sands,
        }
        for path in declared.reads:
            word = path.partition("{")[2].partition("}")[0]
            for name in (
                places.get(word, declared.media(results_of_all.campaign)) if word else ("",)
            ):
                table = path.replace(f"{{{word}}}", name)
                results.hold(table, emptied(results_of_all.table(table)))
        return results

    def emptied(table):
        alpha = [name for name in table if str(name).startswith("alpha_")]
        # an alpha table has a row for each direction of the grid, with or without a number
        return table.assign(**dict.fromkeys(alpha, np.nan)) if "n_runs" in table else table[:0]

    return empty


def test_most_figures_can_lack_their_input():
    assert len(CAN_LACK) >= 15


@pytest.mark.parametrize("declared", CAN_LACK, ids=lambda figure: figure.name)
def test_what_is_lacking_is_drawn_and_has_no_caption(declared, without_rows):
    results = without_rows(declared)
    if not (media := declared.media(results.campaign)):
        pytest.skip("the campaign has no such figure")
    medium_words = [media[0]] if media[0] else []
    lacking = declared.lacking(results, media[0])
    assert lacking
    drawn = declared.draw(results, *medium_words)
    assert lacking[0] in " ".join(words(drawn))
    assert declared.caption_of(results, media[0]) == ""
    results_of_all = rftfit.open(results.root)
    assert bool(declared.caption_of(results_of_all, media[0])) != bool(
        declared.lacking(results_of_all, media[0])
    )


def test_figures_for_a_paper_are_drawn_on_demand(small_made, tmp_path):
    folder = Folder(tmp_path / "copy")
    shutil.copytree(small_made.root, folder.root)
    printed = read_states(folder.config).paper_files
    assert len(printed) > 10
    assert not any((folder.root / path).exists() for path in printed)

    def planned(*words):
        plan = folder.rftfit("run", *words, "--dry-run").stdout
        return sum(int(jobs) for jobs in re.findall(r"_pdf +([0-9]+)", plan))

    assert planned() == 0
    assert planned("--print") == len(printed)
    path = next(path for path in printed if path.endswith("legs_poppy_LP.pdf"))
    assert planned(path) == 1
    made = folder.rftfit("run", path)
    assert made.returncode == 0, made.stderr
    assert (folder.root / path).read_bytes().startswith(b"%PDF")
    # it is none of what every run makes, and told apart where it is old
    assert planned() == 0
    assert planned("--print") == len(printed) - 1
    (folder.root / path).write_bytes(b"")
    later = folder.rftfit("run")
    assert re.search(r"1 file; rftfit run --print", later.stdout)


def test_a_run_of_a_part_keeps_the_records_of_the_campaign(small_made, tmp_path):
    folder = Folder(tmp_path / "copy")
    shutil.copytree(small_made.root, folder.root)
    assert folder.rftfit("run").returncode == 0
    records = folder.digests()
    results = int(folder.rftfit("verify").stdout.split()[0])
    printed = "results/figures/linearity.pdf"
    misspelled = folder.rftfit("run", "results/figures/linearty.png")
    assert misspelled.returncode == 4
    for target in (printed, "results/figures/linearity.png", "results/coefficients.csv"):
        (folder.root / target).unlink(missing_ok=True)
        made = folder.rftfit("run", target)
        assert made.returncode == 0, made.stderr
        assert "Not made by this campaign" not in made.stdout
        verified = folder.rftfit("verify")
        # the figure for a paper is compared too
        assert verified.stdout.startswith(f"{results + 1} results: all as recorded"), verified
        assert verified.returncode == 0
    now = folder.digests()
    assert {name for name in now if now[name] != records.get(name)} == {
        "figures/linearity.pdf",
        "records/figure_pdf/linearity.json",
        "state/figure_pdf/linearity.json",
    }
    assert folder.rftfit("verify", printed).returncode == 0
    content = (folder.root / printed).read_bytes()
    (folder.root / printed).write_bytes(content + b" ")
    edited = folder.rftfit("verify")
    assert edited.returncode == 5
    assert f"result {printed}: edited or damaged" in edited.stdout
    assert f"1 of {results + 1} results not as recorded; `rftfit run` with their" in edited.stdout
    # one that was deleted goes to no paper
    (folder.root / printed).unlink()
    assert folder.rftfit("verify").stdout.startswith(f"{results} results: all as recorded")
    (folder.root / printed).write_bytes(content)
    # what no target needs stays recorded, and is told to be old
    text = folder.config.read_text("utf-8")
    folder.config.write_text(text.replace("title: ", "title: A ", 1), "utf-8")
    (folder.root / printed).unlink()
    for arguments in (("--dry-run", "results/figures/penetration.pdf"), (printed,)):
        made = folder.rftfit("run", *arguments)
        assert made.returncode == 0, made.stderr
        assert "Not made by this campaign" not in made.stdout
        assert "never finished" not in folder.rftfit("verify").stdout
    assert re.search(r"Not up to date.*rftfit run makes", made.stdout)
    assert folder.rftfit("run").returncode == 0
    assert folder.rftfit("verify").returncode == 0
