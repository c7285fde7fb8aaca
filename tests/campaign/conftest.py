import pytest
from campaigns import Room


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path)
