import pytest
from few_draws import few_draws
from rigroom import RigRoom


@pytest.fixture(autouse=True)
def _few_draws():
    with few_draws():
        yield


@pytest.fixture
def room(tmp_path):
    return RigRoom(tmp_path)
