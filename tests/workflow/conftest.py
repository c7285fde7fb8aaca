"""The whole demonstration campaign is measured once for the tests of a module."""

from __future__ import annotations

import pytest
from campaigns import Folder, make_campaign


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """All tables of the demonstration campaign but the robot's; `make run` draws and writes the rest."""
    folder = make_campaign(tmp_path_factory.mktemp("whole") / "campaign", robot=False)
    before = folder.raw_digests()
    folder.run_here("workbooks")
    assert folder.raw_digests() == before, "the workflow wrote into raw/"
    return folder
