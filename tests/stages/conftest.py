"""Whole media of the re-enacted lab, measured once per session."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from rigroom import WHOLE, Lab, Results, Room

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def room(tmp_path: Path) -> Room:
    return Room(tmp_path)


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    made = Lab(tmp_path_factory.mktemp("lab"))
    yield made
    made.unlock()


@pytest.fixture(scope="session")
def results(lab: Lab) -> Results:
    """Of the laboratory medium."""
    return lab.results[WHOLE[0]]
