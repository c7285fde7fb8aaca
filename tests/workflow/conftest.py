"""The whole demonstration campaign is measured once for all tests."""

import pytest
from campaigns import Folder, make_campaign
from waiting import make_once

from rftfit.workflow.state import read_states

LONGEST = ("", "glass0.3mm_CP", "palms29_sieved")
"""Media with the longest titles: of the figures of one medium theirs are looked at, to see if texts have room."""


@pytest.fixture(scope="session")
def whole_campaign(tmp_path_factory):
    """All tables of the demonstration campaign but the robot's; `make run` draws and writes the rest."""
    return Folder(make_once(tmp_path_factory, "whole campaign", measure_demonstration))


def measure_demonstration(root):
    """Make the tables in a new folder, and look at the words of the longest figures."""
    folder = make_campaign(root, robot=False)
    digests_before = folder.raw_digests()
    drawn = read_states(folder.config).figures
    longest = [path.rpartition("/")[2] for path, (_, medium) in drawn.items() if medium in LONGEST]
    folder.run_here("workbooks", longest)
    assert folder.raw_digests() == digests_before, "the workflow wrote into raw/"
