"""Where stress is curved, alpha at stated depths has intervals that contain the true force."""

import pandas as pd
import pytest
from coverage_levels import forces_held
from seeds import seeds

from rftfit.measure.depths import curved_law


@pytest.mark.statistics
def test_intervals_hold_the_force_at_stated_depths():
    coverage = forces_held("poppy_LP", seeds(10, 4), 5, {"power": 1.3})
    assert list(coverage["cells"]) == [156, 132, 108]
    assert coverage["inside"].between(*seeds((0.92, 0.98), (0.88, 1))).all()
    assert (coverage["width"] < seeds(1.3, 2)).all()


@pytest.mark.parametrize(
    ("verdict", "code", "law"),
    [
        ("failed", "linearity", "depth^1.20"),
        ("accepted", "law-power", "depth^1.20"),
        ("failed", "law-intercept", "c + alpha depth"),
        ("failed", "law-crust", "None"),
        ("passed", "linearity", "None"),
        ("not checked", "law-open", "None"),
    ],
)
def test_the_check_of_linearity_decides_what_is_curved(verdict, code, law):
    """By steep pushes that are clear; the last three runs are none."""
    fits = pd.DataFrame({
        "direction": ["intrusion"] * 5 + ["extraction"], "gamma_deg": [90.0, 60, 45, 30, 90, -90],
        "beta_deg": [0.0, 0, 0, 0, 30, 0],
        "exponent_z": [1.1, 1.2, 1.3, 2, 2, 2], "alpha_z_se_N_per_cm3": [0.01] * 4 + [0.2, 0.01],
        "alpha_z_N_per_cm3": 0.3,
    })  # fmt: skip
    checks = pd.DataFrame(
        {
            "check": ["surface", "linearity"],
            "verdict": ["failed", verdict],
            "code": ["surface-off", code],
        }
    )
    assert str(curved_law(fits, checks, 0.5)) == law
