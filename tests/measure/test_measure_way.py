"""One push goes from its log to alpha through few source files, in a documented order.

Each file of that order opens with its main function.
"""

import sys
from pathlib import Path

import pytest
from campaigns import RigRoom

import rftfit
from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import alpha_table
from rftfit.measure.fits import fit_medium
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.tare import tare_medium

MEDIUM, PUSH = "poppy_LP", "poppy_LP_bp00_g90_in"
MOST_FILES = 35
"""Files of the package that a push may pass through."""
WAY = {
    "measure/read.py": "read_logs",
    "measure/trace.py": "trace_run",
    "measure/tare.py": "tare_medium",
    "measure/fits.py": "fit_medium",
    "measure/alpha.py": "alpha_table",
    "checks/medium.py": "check_medium",
}
"""Modules in the order in which a student reads them, and their main functions."""

PACKAGE = Path(rftfit.__file__).parent


def measure_push(campaign):
    """Alpha of the one push of a campaign."""
    traces, runs, _ = ingest_medium(campaign, MEDIUM)
    tared, tares, _ = tare_medium(campaign, MEDIUM, traces, runs)
    fits, _, _ = fit_medium(campaign, MEDIUM, runs, tared, tares)
    return alpha_table(fits, MEDIUM, confidence=0.95, depths=1)


@pytest.fixture(scope="module")
def files_entered(tmp_path_factory):
    """Files of the package in which a function ran from the log of one push and its rod to alpha.

    What a process reads once, as its constants, was read before, whichever tests ran in it.
    """
    room = RigRoom(tmp_path_factory.mktemp("way")).add(PUSH).write()
    measure_push(load_campaign(room))
    campaign = load_campaign(room)
    files = set()

    def note_file(frame, event, _):
        if event == "call" and frame.f_code.co_name != "<module>":
            files.add(Path(frame.f_code.co_filename))

    before = sys.getprofile()
    sys.setprofile(note_file)
    try:
        alpha = measure_push(campaign)
    finally:
        sys.setprofile(before)
    # the way was gone to its end
    assert alpha["alpha_z_N_per_cm3"].notna().sum() == 1
    return {file.relative_to(PACKAGE) for file in files if file.is_relative_to(PACKAGE)}


def test_a_push_enters_few_files(files_entered):
    assert len(files_entered) <= MOST_FILES, sorted(map(str, files_entered))


def test_the_modules_of_the_way_are_entered(files_entered):
    # checks judge many runs: a single push has nothing for them
    entered = {file.as_posix() for file in files_entered}
    assert entered >= WAY.keys() - {"checks/medium.py"}


@pytest.mark.parametrize(("name", "main_function"), WAY.items())
def test_a_module_of_the_way_opens_with_its_main_function(name, main_function):
    text = (PACKAGE / name).read_text(encoding="utf-8")
    definitions = [line for line in text.splitlines() if line.startswith(("def ", "class "))]
    assert definitions[0].startswith(f"def {main_function}(")
