"""Whole media of the re-enacted lab, measured once per session."""

from __future__ import annotations

import pytest
from rigroom import WHOLE, Lab, Room


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path)


@pytest.fixture(scope="session")
def lab(tmp_path_factory):
    made = Lab(tmp_path_factory.mktemp("lab"))
    yield made
    made.unlock()


@pytest.fixture(scope="session")
def results(lab):
    """Of the laboratory medium."""
    return lab.results[WHOLE[0]]
