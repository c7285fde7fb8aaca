"""The whole demonstration campaign is measured once for the tests of a module."""

import pytest
from campaigns import make_campaign

from rftfit.workflow.state import read_states

LONGEST = ("", "glass0.3mm_CP", "palms29_sieved")
"""Media with the longest titles: of the figures of one medium theirs are looked at, to see if texts have room."""


@pytest.fixture(scope="module")
def whole_campaign(tmp_path_factory):
    """All tables of the demonstration campaign but the robot's; `make run` draws and writes the rest."""
    folder = make_campaign(tmp_path_factory.mktemp("whole") / "campaign", robot=False)
    digests_before = folder.raw_digests()
    drawn = read_states(folder.config)[0].figures
    longest = [path.rpartition("/")[2] for path, (_, medium) in drawn.items() if medium in LONGEST]
    folder.run_here("workbooks", longest)
    assert folder.raw_digests() == digests_before, "the workflow wrote into raw/"
    return folder
