"""The whole demonstration campaign is run once for the tests of a module."""

from __future__ import annotations

import pytest
from campaigns import Folder, make_campaign


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """The whole demonstration campaign, run."""
    folder = make_campaign(tmp_path_factory.mktemp("whole") / "campaign")
    before = folder.raw_digests()
    folder.run_here()
    assert folder.raw_digests() == before, "the workflow wrote into raw/"
    return folder
