"""Twenty seconds of random and mutated bytes, told to all readers of text; `make fuzz` takes longer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from foreign_logs import TEXTS
from fuzzing import fuzz

if TYPE_CHECKING:
    from pathlib import Path

SECONDS = 20.0


@pytest.mark.parametrize("name", sorted(TEXTS))
def test_fuzz(name: str, tmp_path: Path) -> None:
    score = fuzz(name, SECONDS / len(TEXTS), 2013, tmp_path / "input.txt")
    assert score.inputs > 50
    assert score.read > 10
    assert score.refused > 1
