"""What a stage says when there is nothing to fit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from rftfit.compare import sands


def test_a_sand_without_a_linear_regime() -> None:
    depth = np.linspace(0, 1, 20)
    campaign: Any = SimpleNamespace(config=SimpleNamespace(fit=SimpleNamespace(min_points=50)))
    zero = (np.zeros(1), np.ones(1))
    row = sands._slope(campaign, depth, depth, zero, np.array([1.2, 1.3]))
    assert row["reason"] == "no linear regime with enough samples"
