"""Units: factors from their definitions, and no silent guess."""

from __future__ import annotations

import math

import pytest

from rftfit.measure import pairs


def test_factors_are_those_of_the_definitions() -> None:
    inch_cm = 2.54
    pound_kg, standard_gravity = 0.45359237, 9.80665
    assert dict(pairs.FORCE_TO_N) == {
        "N": 1, "mN": 0.001, "kN": 1000, "lbf": pytest.approx(pound_kg * standard_gravity, abs=1e-13)
    }  # fmt: skip
    assert dict(pairs.LENGTH_TO_CM) == {"um": 1e-4, "mm": 0.1, "cm": 1, "m": 100, "in": inch_cm}
    assert dict(pairs.ANGLE_TO_RAD) == {"deg": pytest.approx(2 * math.pi / 360), "rad": 1}
    assert dict(pairs.TIME_TO_S) == {
        "s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60, "h": 60 * 60
    }  # fmt: skip
    assert dict(pairs.TORQUE_TO_N_M) == {"N m": 1, "N mm": 1e-3}


def test_log_and_config_have_to_agree() -> None:
    assert pairs.factor(pairs.LENGTH_TO_CM, "in", "in", "depth") == 2.54
    with pytest.raises(ValueError, match=r"^depth in mm, but the config says in$"):
        pairs.factor(pairs.LENGTH_TO_CM, "mm", "in", "depth")
    with pytest.raises(ValueError, match=r"^depth in no unit, but the config says in$"):
        pairs.factor(pairs.LENGTH_TO_CM, "", "in", "depth")
    with pytest.raises(ValueError, match=r"^torque in lbf in; allowed: N m, N mm$"):
        pairs.factor(pairs.TORQUE_TO_N_M, "lbf in", "lbf in", "torque")
