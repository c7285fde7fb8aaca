"""Everything that `rftfit run TARGET` prints is true of the run that has just ended."""

import random
import re
import shutil

import pytest
from campaigns import Folder, make_campaign, planned_jobs
from seeds import seeds

from rftfit.workflow.closing import closing_lines, failed_checks
from rftfit.workflow.job import do_job
from rftfit.workflow.records import Recorded, record_holds
from rftfit.workflow.state import read_states

pytestmark = pytest.mark.slow

MEDIUM = "poppy_LP"
DIRECTIONS = ((0.0, 90.0), (0.0, -90.0), (30.0, 90.0), (30.0, 45.0), (0.0, 45.0))
EXCLUDED = "poppy_LP_bp30_g45_in"
"""The run that is excluded later."""


@pytest.fixture(scope="module")
def made_before(tmp_path_factory):
    """A campaign that was made whole, and what was printed of it."""
    root = tmp_path_factory.mktemp("targets") / "lab"
    folder = make_campaign(root, (MEDIUM,), plates_only=True, directions=DIRECTIONS)
    folder.run_here()
    return folder, printed(folder)


@pytest.fixture(scope="module")
def outdated(made_before):
    """The campaign after one of its runs was excluded."""
    folder, _ = made_before
    sheet = folder.root / "raw" / "paper" / "runs.csv"
    rows = [line.split(",") for line in sheet.read_text(encoding="utf-8").splitlines()]
    for cells in rows:
        if cells[0] == EXCLUDED:
            cells[rows[0].index("excluded")] = "yes"
            cells[rows[0].index("reason")] = "the plate was loose"
    sheet.write_text("\n".join([*map(",".join, rows), ""]), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def made_whole(outdated, tmp_path_factory):
    """The campaign made whole again, and what was printed of it."""
    folder = Folder(tmp_path_factory.mktemp("whole") / "lab")
    shutil.copytree(outdated.root, folder.root)
    folder.run_here()
    return folder, printed(folder)


def printed(folder):
    recorded = Recorded(read_states(folder.config))
    return [*closing_lines(recorded), *failed_checks(recorded)]


def make(folder, targets):
    """Do the jobs of some targets that are out of date."""
    states = read_states(folder.config)
    for job in planned_jobs(folder.config, targets):
        if not record_holds(folder.root, job.reads, job.writes):
            do_job(states, job.reads, job.writes)


def of_the_campaign(lines):
    """Lines that tell something of the campaign; how many files there are, or are old, is not of it."""
    return {line for line in lines if not re.search(r"\(\d+ files?\)$|^Not up to date", line)}


def test_the_exclusion_changes_what_is_printed(made_before, made_whole):
    assert of_the_campaign(made_before[1]) - of_the_campaign(made_whole[1])


@pytest.fixture(scope="module")
def tables(outdated):
    """Every csv that a job of the campaign writes."""
    written = {path for job in planned_jobs(outdated.config) for path in job.writes}
    return sorted(path for path in written if path.endswith(".csv"))


@pytest.mark.parametrize("seed", range(seeds(12, 3)))
def test_no_number_is_older_than_the_run(outdated, tables, made_whole, tmp_path, seed):
    chance = random.Random(seed)
    folder = Folder(tmp_path / "lab")
    shutil.copytree(outdated.root, folder.root)
    make(folder, chance.sample(tables, chance.choice([1, 1, 2, 3])))
    lines = printed(folder)
    assert of_the_campaign(lines) <= of_the_campaign(made_whole[1])
    assert any(line.startswith("Not up") for line in lines)
    names = [line.strip() for line in lines if line.startswith("  results/") and "(" not in line]
    digests = folder.digests(), made_whole[0].digests()
    # the page shows figures, and `run_here` draws none
    for path in {*names} - {"results/report.html"}:
        name = path.removeprefix("results/")
        assert digests[0][name] == digests[1][name], path


def test_nothing_is_printed_of_results_that_are_all_old(outdated):
    assert of_the_campaign(printed(outdated)) == set()
