"""Bekker's law is recovered with its errors from pushes that obey it, and other pushes are refused.

Bekker's law: pressure = (k_c / b + k_phi) z^n, for a plate of width b at depth z.
"""

import numpy as np
import pandas as pd
import pytest

from rftfit import RftfitError
from rftfit.measure.laws import other_laws
from rftfit.model.bekker import pressure_sinkage

DEPTH_CM = np.linspace(1, 6, 60)
K_C, K_PHI, N = 900.0, 60e3, 1.15
"""N/m^(n+1), N/m^(n+2)."""


def fits_of(widths_cm, gamma_deg=90.0):
    """Fits of pushes by the law, one for each width, as the stage of slopes makes them."""
    rows = []
    for number, width_cm in enumerate(widths_cm):
        stress = (K_C / (width_cm / 100) + K_PHI) * (DEPTH_CM / 100) ** N / 1e4
        laws = other_laws(DEPTH_CM, stress[None], 6.0)
        assert laws is not None
        power, free = laws.power[0], laws.free_intercept[0]
        line = float(stress @ DEPTH_CM / (DEPTH_CM @ DEPTH_CM))
        intercept, slope = np.polynomial.Polynomial.fit(DEPTH_CM, stress, 1).convert().coef
        rows.append(
            {
                "run_id": f"r{number}",
                "beta_deg": 0.0,
                "gamma_deg": gamma_deg,
                "intercept_z_N_per_cm2": intercept,
                "free_slope_z_N_per_cm3": slope,
                "free_stress_z_percent": 100 * (free.alpha / line - 1),
                "power_stress_z_percent": 100 * (power.alpha / line - 1),
                "exponent_z": power.exponent,
                "exponent_z_se": 0.02,
                "depth_from_cm": 1.0,
                "depth_to_cm": 6.0,
            }
        )
    return pd.DataFrame(rows), {f"r{place}": width for place, width in enumerate(widths_cm)}


def test_one_width_tells_the_sum():
    law = pressure_sinkage(*fits_of([3, 3, 3]), 2.0)
    assert law.n == pytest.approx(N, abs=1e-4)
    assert law.k_c == 0
    assert law.k_phi == pytest.approx(K_C / 0.03 + K_PHI, rel=1e-3)
    assert law.widths_m == (0.03,)
    assert law.depth_m == (0.01, 0.06)
    depth = np.array([0.02, 0.05])
    expected = (K_C / 0.03 + K_PHI) * depth**N
    np.testing.assert_allclose(law.pressure_Pa(depth, 0.03), expected, rtol=1e-3)


def test_two_widths_tell_both():
    law = pressure_sinkage(*fits_of([2, 2, 5, 5]), 2.0)
    assert law.k_c == pytest.approx(K_C, rel=1e-2)
    assert law.k_phi == pytest.approx(K_PHI, rel=1e-2)


def test_errors_are_those_of_the_scatter():
    """With beds of 5 % the truth is within 1.96 errors in 91 % of the campaigns of 8 pushes (Student's t)."""
    fits, widths = fits_of([3] * 8)
    inside = []
    for seed in range(300):
        factor = np.random.default_rng(seed).normal(1, 0.05, 8)
        columns = ["intercept_z_N_per_cm2", "free_slope_z_N_per_cm3"]
        beds = fits.assign(**{column: factor * fits[column] for column in columns})
        law = pressure_sinkage(beds, widths, 2.0)
        inside.append(abs(law.k_phi - (K_C / 0.03 + K_PHI)) < 1.96 * law.k_phi_se)
    assert 0.86 < np.mean(inside) < 0.96


def test_one_push_has_the_error_of_its_own_exponent():
    law = pressure_sinkage(*fits_of([3]), 2.0)
    assert law.n_hi - law.n == pytest.approx(1.959964 * 0.02)
    assert np.isnan(law.k_phi_se)


def test_other_directions_are_no_pressure_tests():
    with pytest.raises(RftfitError, match="straight down"):
        pressure_sinkage(*fits_of([3], gamma_deg=45.0), 2.0)
