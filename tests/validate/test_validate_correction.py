"""Correction factors on leg forces are recovered, and count only if they help legs left out."""

import numpy as np
import pandas as pd
import pytest

from rftfit.compare.sands import fit_corrections
from rftfit.measure.flags import remark

ONE_FACTOR, BOTH = "one factor", "factors for z and x"

LEGS = ("c_leg", "flat_leg", "reversed_c_leg")
THETA = np.arange(-130.0, 131.0)


def curves(factor_z, factor_x, noise=0.0):
    """Bell-shaped forces on each leg, times its factors."""
    random = np.random.default_rng(1)
    parts = []
    for number, leg in enumerate(LEGS):
        bell = (2 + number) * np.exp(-(((THETA + 20 * number) / 40) ** 2))
        z = factor_z[leg] * bell + random.normal(0, noise, THETA.size)
        x = factor_x[leg] * 0.5 * bell + random.normal(0, noise, THETA.size)
        parts.append(
            pd.DataFrame(
                {"medium": "sand", "leg": leg, "theta_deg": THETA, "force_z_N": z, "force_x_N": x}
            )
        )
    return pd.concat(parts)


ONE = dict.fromkeys(LEGS, 1.0)
"""A factor of 1 for each leg."""


def result(measured):
    """Factors fitted to measured forces, where all predicted ones have a factor of 1."""
    return fit_corrections(measured, curves(ONE, ONE)).set_index("model")


def few(z, x):
    """Forces of three legs, leg by leg."""
    return pd.concat(
        pd.DataFrame(
            {
                "medium": "sand",
                "leg": leg,
                "theta_deg": range(len(up)),
                "force_z_N": up,
                "force_x_N": along,
            }
        )
        for leg, up, along in zip(LEGS, z, x, strict=True)
    )


@pytest.mark.parametrize("size_N", [1.0, 0.01])
def test_factors_and_errors_by_hand(size_N):
    """One factor for all six forces is (2 + 1 + 2 + 1 + 8 + 4) / (4 + 8), whichever leg is left out."""
    unit, double = [size_N], [2 * size_N]
    predicted = few([unit, unit, double], [unit, unit, double]).assign(force_z_lo_N=np.nan)
    measured = few([double, double, [4 * size_N]], [unit, unit, double])
    table = fit_corrections(measured, predicted).set_index("model")
    numbers = ["factor_z", "factor_x", "rms_fit_N", "rms_cv_N", "gain_cv_percent"]
    half = np.sqrt(0.5)
    expected = {"none": [1, 1, 1, 1, 0], ONE_FACTOR: [1.5, 1.5, half, half, 100 * (1 - half)],
                BOTH: [2, 1, 0, 0, 100]}  # fmt: skip
    for model, row in expected.items():
        actual = table.loc[model, numbers] / [1, 1, size_N, size_N, 1]
        assert list(actual) == pytest.approx(row, abs=1e-12), model
    assert list(table["earns_its_place"]) == [False, True, True]
    assert (table["reason"] == "").all()


@pytest.mark.parametrize(("extra", "worth"), [(0.4, False), (0.6, True)])
def test_a_factor_is_worth_it_from_a_tenth_of_the_error_on(extra, worth):
    """Lifts 1 N off either way, beyond a factor: the error falls by 1 - 1 / sqrt(1 + extra^2)."""
    predicted = few([[1.0, 1.0]] * 3, [[1.0, 1.0]] * 3)
    measured = few([[extra, 2 + extra]] * 3, [[1.0, 1.0]] * 3)
    row = fit_corrections(measured, predicted).set_index("model").loc[BOTH]
    assert row["factor_z"] == pytest.approx(1 + extra)
    assert row["gain_cv_percent"] == pytest.approx(100 * (1 - 1 / np.hypot(1, extra)))
    assert row["earns_its_place"] == worth


def test_noise_earns_nothing():
    table = result(curves(ONE, ONE, noise=0.3))
    assert not table["earns_its_place"].any()
    assert table.loc["none", "gain_cv_percent"] == pytest.approx(0)


def test_legs_that_disagree_earn_nothing():
    """A factor that helps one leg and harms the others is seen through by leaving legs out."""
    measured = curves(dict(zip(LEGS, (1.5, 1.0, 0.6), strict=True)), ONE)
    table = result(measured)
    fitted = table.loc[BOTH]
    assert fitted["rms_fit_N"] < table.loc["none", "rms_fit_N"]
    assert not fitted["earns_its_place"]


def test_two_legs_cannot_be_cross_validated():
    measured = curves(dict.fromkeys(LEGS, 0.7), ONE)
    table = result(measured[measured["leg"] != "c_leg"])
    assert table[["rms_cv_N", "gain_cv_percent"]].isna().all(axis=None)
    assert table.loc[BOTH, "factor_z"] == pytest.approx(0.7)
    assert not table["earns_its_place"].any()
    assert set(table["reason"]) == {str(remark("few-legs", found=2))}
