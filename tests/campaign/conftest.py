import tomllib
from pathlib import Path

import pytest
from campaigns import Room

DATA = Path(__file__).parent / "data"
"""Tables of cases; the first lines of each say what stands in it."""


def cases_of(name):
    """Cases of a table."""
    (cases,) = tomllib.loads((DATA / f"{name}.toml").read_text("utf-8")).values()
    return cases


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path)
