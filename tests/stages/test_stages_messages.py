"""What a stage says when there is nothing to fit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from rftfit.campaign.config import Fit, Plate
from rftfit.compare import sands
from rftfit.measure.errors import SurfaceError

SURE = SurfaceError()
PLATE = Plate(shape="plate", length_cm=3.81, width_cm=2.54, thickness_cm=0.64)


def test_a_sand_without_a_linear_regime() -> None:
    depth = np.linspace(0, 1, 20)
    campaign: Any = SimpleNamespace(
        config=SimpleNamespace(fit=SimpleNamespace(min_points=50), table=None)
    )
    zero = (np.zeros(1), np.ones(1))
    row = sands._slope(campaign, PLATE, depth, depth, zero, np.array([1.2, 1.3]), SURE)
    assert row["reason"] == "no linear regime with enough samples"


def test_a_penetration_test_over_too_little_depth() -> None:
    depth = np.linspace(0, 0.3, 60)
    campaign: Any = SimpleNamespace(config=SimpleNamespace(fit=Fit(), table=None))
    row = sands._slope(
        campaign, PLATE, depth, depth, (np.zeros(1), np.ones(1)), np.array([1.2, 1.3]), SURE
    )
    assert str(row["reason"]).startswith(
        "window too short: it covers 0.30 cm of depth, 0.38 cm wanted"
    )
