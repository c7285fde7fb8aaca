"""Correction factors on leg forces are recovered, and count only if they help legs left out."""

import numpy as np
import pandas as pd
import pytest

from rftfit.compare.sands import fit_corrections

ONE_FACTOR, BOTH = "one factor", "factors for z and x"

LEGS = ("c_leg", "flat_leg", "reversed_c_leg")


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


def test_two_legs_cannot_be_cross_validated():
    curves = few([[1.0, 2.0]] * 3, [[1.0, 0.5]] * 3).query("leg != 'c_leg'")
    forces = ["force_z_N", "force_x_N"]
    measured = curves.assign(**0.7 * curves[forces])
    table = fit_corrections(measured, curves).set_index("model")
    assert table[["rms_cv_N", "gain_cv_percent"]].isna().all(axis=None)
    assert table.loc[BOTH, "factor_z"] == pytest.approx(0.7)
    assert not table["earns_its_place"].any()
    assert set(table["reason_code"]) == {"few-legs"}
