"""A campaign whose files are put into its folder one by one."""

import pytest
from campaigns import DIRECTIONS, lay_bench, make_campaign
from paper import few_draws


@pytest.fixture(autouse=True)
def _few_draws():
    with few_draws():
        yield


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """All logs of a small campaign, which nobody changes."""
    root = tmp_path_factory.mktemp("recorded") / "campaign"
    return make_campaign(root, ("poppy_LP",), plates_only=True, directions=DIRECTIONS).root


@pytest.fixture
def bench(recorded, tmp_path):
    """The campaign before its first run: no log is there."""
    return lay_bench(tmp_path / "campaign", recorded)
