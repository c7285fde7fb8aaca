import pytest
from campaigns import RigRoom
from paper import few_draws


@pytest.fixture(autouse=True)
def _few_draws():
    with few_draws():
        yield


@pytest.fixture
def room(tmp_path):
    return RigRoom(tmp_path)
