"""How far the machine yields: the curve comes back, and it never extrapolates."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit.measure.compliance import Compliance, ComplianceError, compliance_of


def rigid(curve: str = "linear", noise: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Press 200 N: 1 cm in air, then as far as the machine yields."""
    random = np.random.default_rng(4)
    force = np.concatenate([np.zeros(200), np.linspace(0, 200, 800)])
    yielded = 2e-4 * force if curve == "linear" else 0.05 * (1 - np.exp(-force / 60))
    depth = np.concatenate([np.linspace(0, 1, 200), np.ones(800)]) + yielded
    return depth, force + noise * random.standard_normal(1000) - 3


@pytest.mark.parametrize("curve", ["linear", "stiffening"])
def test_the_curve_comes_back(curve: str) -> None:
    compliance = compliance_of(*rigid(curve), 0.05)
    force = np.linspace(0, 195, 50)
    travel, known = compliance.at(force)
    truth = 2e-4 * force if curve == "linear" else 0.05 * (1 - np.exp(-force / 60))
    assert known.all()
    np.testing.assert_allclose(travel, truth, atol=1e-3)
    assert (np.diff(compliance.travel) >= 0).all()
    if curve == "linear":
        assert compliance.mean_cm_per_N() == pytest.approx(2e-4, rel=0.03)


def test_it_does_not_extrapolate() -> None:
    compliance = Compliance(np.array([0.0, 100.0]), np.array([0.0, 0.02]))
    travel, known = compliance.at(np.array([-5.0, 50.0, 100.0, 101.0]))
    np.testing.assert_allclose(travel, [0, 0.01, 0.02, 0.02])
    assert known.tolist() == [True, True, True, False]


def test_no_contact() -> None:
    depth, force = rigid()
    with pytest.raises(ComplianceError, match="no contact"):
        compliance_of(depth[:200], force[:200], 0.05)
    with pytest.raises(ComplianceError, match="5 readings"):
        compliance_of(depth[:5], force[:5], 0.05)
