"""The peak of a measured curve is exact for a parabola and has the error that its scatter shows.

Also tested: the interval of the relative error of a predicted peak.
"""

import math

import numpy as np
import pandas as pd
import pytest

from rftfit.compare.legs import leg_errors, measured_peak

THETA = np.arange(-135.0, 136.0)


def parabola(top_N, centre_deg, theta=THETA):
    return np.asarray(top_N * (1 - ((theta - centre_deg) / 40) ** 2))


@pytest.mark.parametrize("centre", [0.0, 0.5, 17.25, -60.4, 2.6])
def test_the_top_of_a_parabola_is_exact_between_readings(centre):
    peak = measured_peak(THETA, parabola(8.0, centre), "z")
    # the fine grid has steps of 0.1 degrees: 0.05 off is 8 (0.05 / 40)^2 N
    assert peak.force_N == pytest.approx(8, abs=2e-5)
    pull = parabola(-8.0, centre).clip(max=0)
    assert measured_peak(THETA, pull, "x").force_N == pytest.approx(-8, abs=2e-5)


def test_horizontal_force_peaks_with_either_sign():
    bell = np.exp(-((THETA / 30) ** 2))
    curve = -4 * bell + 2 * np.exp(-(((THETA - 90) / 30) ** 2))
    assert measured_peak(THETA, curve, "x").force_N == pytest.approx(-4, abs=0.01)
    assert measured_peak(THETA, curve, "z").force_N == pytest.approx(2, abs=0.01)


def test_one_spike_is_not_the_peak():
    curve = parabola(8.0, 30.0).clip(0)
    curve[THETA == -60] = 9.0
    assert measured_peak(THETA, curve, "z").force_N == pytest.approx(8, abs=2e-5)
    short = np.array(8.0 * (1 - ((np.arange(15.0) - 7) / 8) ** 2))
    short[0] = 9.0
    assert measured_peak(np.arange(15.0), short, "z").force_N == pytest.approx(8, abs=1e-9)


def test_a_peak_at_the_end_is_not_beyond_it():
    rising = 2.0 + 0.01 * THETA
    assert measured_peak(THETA, rising, "z").force_N == pytest.approx(rising[-1])
    assert measured_peak(THETA, rising[::-1], "z").force_N == pytest.approx(rising[-1])


def test_few_readings_give_the_highest_without_an_error():
    five = np.array([1.0, 4.0, 9.0, 3.0, 1.0])
    peak = measured_peak(np.arange(5.0), five, "z")
    assert peak.force_N == 9
    assert math.isnan(peak.se_N)
    six = parabola(3.0, 2.0, np.arange(6.0))
    assert measured_peak(np.arange(6.0), six, "z").force_N == pytest.approx(3)
    sparse = np.arange(-120.0, 121.0, 5.0)  # three readings within 5 degrees
    assert measured_peak(sparse, parabola(3.0, 1.0, sparse), "z").force_N == pytest.approx(
        3 * (1 - 1 / 1600)
    )


@pytest.mark.parametrize("length", [33, 36])
def test_scatter_needs_twelve_blocks_of_three(length):
    noise = np.random.default_rng(2).normal(0, 0.1, length)
    theta = np.arange(float(length))
    peak = measured_peak(theta, parabola(5.0, length / 2, theta) + noise, "z")
    assert math.isnan(peak.se_N) == (length < 36)


T = 2.0639
"""Student's factor of 95 % for 24 degrees of freedom."""


def curves(measured, predicted):
    """Two tables with the same curve for z and x; the prediction is known within 0.1 N."""
    names = {"theta_deg": THETA, "medium": "m", "leg": "c_leg", "reason": ""}
    ends = {
        f"force_{c}_{end}_N": predicted + sign * 0.1
        for c in "zx"
        for end, sign in (("lo", -1), ("hi", 1))
    }
    forces = ({"force_z_N": values, "force_x_N": values} for values in (measured, predicted))
    ours, theirs = (pd.DataFrame(names | force) for force in forces)
    return ours, theirs.assign(profile="table", **ends)


def wide(top_N):
    """A parabola that stays positive: its peak is exact, and its scatter is 0."""
    return np.asarray(top_N * (1 - (THETA / 150) ** 2))


def error_of(row):
    """Middle and half width of the interval of a peak's error, percent."""
    lo, hi = row["peak_error_lo_percent"], row["peak_error_hi_percent"]
    return (lo + hi) / 2, (hi - lo) / 2


def test_peak_errors_have_the_errors_they_are_told_of():
    measured, predicted = curves(wide(10.0), wide(12.0))
    for spread in ({}, {"another": 0.04}):
        row = leg_errors(measured, predicted, spread).iloc[0]
        assert error_of(row) == pytest.approx((20, 1))
    with_zero_error = measured.assign(zero_se_z_N=0.3, zero_se_x_N=0.0)
    table = leg_errors(with_zero_error, predicted, {"m": 0.04})
    for (_, row), off in zip(table.iterrows(), (math.hypot(0.3, 0.4), 0.4), strict=True):
        half = 120 * math.hypot(0.1 / 12, T * off / 10)
        assert error_of(row) == pytest.approx((20, half), rel=1e-4)
    # of 80 % by Student's factor for that
    row = leg_errors(with_zero_error, predicted, confidence=0.8).iloc[0]
    half = 120 * math.hypot(0.1 / 12, 1.3178 * 0.03)
    assert error_of(row) == pytest.approx((20, half), rel=1e-4)


def test_what_a_parabola_does_to_a_corner_is_in_the_interval():
    corner = np.asarray(10.0 * (1 - np.abs(THETA) / 150))
    row = leg_errors(*curves(corner, corner)).iloc[0]
    peak = measured_peak(THETA, corner, "z")
    lost = 1 - peak.force_N / 10
    assert 0.005 < lost < 0.02  # a corner of 5 degrees either side, cut off
    relative_error = T * math.hypot(peak.se_N / peak.force_N, lost)
    half = 100 * 10 / peak.force_N * math.hypot(0.1 / 10, relative_error)
    assert row["peak_error_hi_percent"] - row["peak_error_percent"] == pytest.approx(half, rel=1e-4)


def test_no_force_has_no_relative_error():
    table = leg_errors(*curves(0 * THETA, wide(12.0)))
    empty = ["peak_error_percent", "peak_error_lo_percent", "rms_relative_to_peak", "r2"]
    assert table[empty].isna().all(axis=None)
    assert (table["peak_measured_N"] == 0).all()
    assert np.isfinite(table["rms_error_N"]).all()


def test_a_prediction_without_number_or_reason_says_so():
    table = leg_errors(*curves(wide(10.0), np.full(THETA.size, np.nan)))
    assert set(table["reason_code"]) == {"not-predicted"}


def test_a_leg_that_stops_early_has_a_peak_where_it_was_passed():
    """Lift is highest at -75 degrees, with more suction at the end; thrust still rises there."""
    lift = 3 * np.exp(-(((THETA + 75) / 15) ** 2)) - 5 * np.exp(-(((THETA + 20) / 10) ** 2))
    thrust = np.exp(-((THETA / 60) ** 2))
    measured, predicted = curves(lift, 0.9 * lift)
    for table, force in ((measured, thrust), (predicted, 0.9 * thrust)):
        table["force_x_N"] = force
    errors = leg_errors(measured[measured["theta_deg"] <= -20], predicted).set_index("component")
    assert dict(errors["reason_code"]) == {"z": "short-curve", "x": "short-at-peak"}
    assert errors.loc["z", "peak_error_percent"] == pytest.approx(-10, abs=1)
    numbers = ["peak_measured_N", "peak_predicted_N", "peak_error_percent"]
    assert errors.loc["x", numbers].isna().all()
    assert (errors["rms_error_N"] > 0).all()


@pytest.mark.parametrize(
    ("factor", "verdict"), [(1.32, "within"), (0.66, "off"), (2.02, "far-off"), (0.49, "far-off")]
)
def test_a_verdict_on_the_model_is_that_of_the_error_of_a_peak(factor, verdict):
    table = leg_errors(*curves(wide(10.0), wide(10.0 * factor)))
    assert set(table["verdict"]) == {verdict}
