"""Random and mutated bytes, told to all readers of text; `make fuzz` takes longer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from foreign_logs import TEXTS
from fuzzing import fuzz

if TYPE_CHECKING:
    from pathlib import Path

INPUTS = 150


@pytest.mark.parametrize("name", sorted(TEXTS))
def test_fuzz(name: str, tmp_path: Path) -> None:
    score = fuzz(name, 60, 2013, tmp_path / "input.txt", INPUTS)
    assert score.inputs == INPUTS
    assert score.read > 30
    assert score.refused > 10
