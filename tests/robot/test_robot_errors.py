"""Errors of robot speed, best curvature and verdicts on the paper agree with hand calculation."""

import math

import numpy as np
import pandas as pd
import pytest

from rftfit.compare.robot import optima, optimum_interval, robot_claims
from rftfit.robot.speeds import measured_speeds, published_speeds, share_within, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON

PLACES = list(CALIBRATED_ON.values())
"""Conditions on which the robot was calibrated."""


def trials():
    rows = [
        ("a", "c1", "poppy_LP", 1.0, 1.95, 20.0, "used", ""),
        ("b", "c1", "poppy_LP", 1.0, 1.96, 22.0, "used", ""),
        ("c", "c1", "poppy_LP", 1.0, math.nan, math.nan, "refused", "2 strides"),
        ("d", "c2", "poppy_LP", 0.6, 1.95, 10.0, "used", ""),
        ("e", "c3", "poppy_LP", 0.0, math.nan, math.nan, "refused", "no light"),
    ]
    names = [
        "run_id",
        "condition",
        "medium",
        "curvature_times_R",
        "frequency_Hz",
        "speed_cm_per_s",
        "status",
        "reason",
    ]
    return pd.DataFrame(rows, columns=names)


def simulated(factor, profile="table"):
    table = published_speeds("poppy_LP")
    speed = table["speed_cm_per_s"] * factor
    return pd.DataFrame(
        {
            "profile": profile,
            "curvature_times_R": table["curvature_times_R"],
            "frequency_Hz": table["frequency_Hz"],
            "speed_cm_per_s": speed,
            "speed_lo_cm_per_s": speed - 1,
            "speed_hi_cm_per_s": speed + 1,
            "reason": "",
        }
    )


def test_a_condition_that_was_not_measured_is_not_counted():
    measured, runs = measured_speeds(trials()), simulated(1.0)
    assert speed_errors(measured, runs.iloc[:0]).empty
    runs = runs.iloc[:1].assign(curvature_times_R=0.6, frequency_Hz=1.95, speed_cm_per_s=10.5)
    errors = speed_errors(measured, runs)
    assert share_within(errors, 20) == (1, 2)
    assert "e: no light" in errors["reason"].iloc[2]
    assert errors["reason_code"].iloc[2] == "speed-unmeasured"


def sweep(top, frequency=5.0, step=0.04, noise=0.0):
    rng = np.random.default_rng(3)
    curvatures = np.round(np.arange(-1, 1 + step / 2, step), 2)
    rows = [
        (
            "poppy_LP",
            "table",
            k,
            frequency,
            phase,
            70 - 40 * (k - top) ** 2 + rng.normal(0, noise),
            "steady",
        )
        for k in curvatures
        for phase in (0.0, 1 / 6, 1 / 3)
    ]
    names = [
        "medium",
        "profile",
        "curvature_times_R",
        "frequency_Hz",
        "phase_turns",
        "speed_cm_per_s",
        "outcome",
    ]
    return pd.DataFrame(rows, columns=names)


def test_the_top_of_a_parabola_comes_back():
    exact, rough = (optima(sweep(0.43, noise=noise), [5.0]).iloc[0] for noise in (0.0, 3.0))
    assert exact["best_curvature_times_R"] == pytest.approx(0.43, abs=1e-6)
    assert exact["speed_cm_per_s"] == pytest.approx(70, abs=1e-6)
    assert exact["calibrated"] == "yes"
    # exact points: half a step to either side; scatter makes it wider
    assert exact["reading_hi"] - exact["reading_lo"] == pytest.approx(0.04)
    assert rough["reading_hi"] - rough["reading_lo"] > 0.08
    for optimum in (exact, rough):
        assert optimum["reading_lo"] <= 0.43 <= optimum["reading_hi"]


def test_a_top_at_the_end_or_on_a_coarse_grid():
    end = optima(sweep(1.4)).iloc[0]
    assert (end["best_curvature_times_R"], end["reading_hi"]) == (1.0, 1.0)
    assert end["reading_lo"] <= 0.96
    coarse = optima(sweep(0.43, step=0.2)).iloc[0]
    assert coarse["reading_lo"] <= 0.43 <= coarse["reading_hi"]
    lo, hi = optimum_interval(
        np.array([0.0, 0.5, 1.0]), [np.ones(1), np.full(1, 2.0), np.ones(1)], 0.5
    )
    assert (lo, hi) == (0.0, 1.0)


def test_runs_that_are_not_steady_are_left_out():
    table = sweep(0.43)
    table.loc[table["curvature_times_R"] > 0.5, ["outcome", "speed_cm_per_s"]] = "tipped", 500.0
    optimum = optima(table).iloc[0]
    assert optimum["fastest_speed_cm_per_s"] < 71
    assert optimum["reason_code"] == "no-steady-run"
    assert " 13 " in optimum["reason"]
    assert optima(table[table["curvature_times_R"] > 0.9]).empty


def test_a_trial_within_a_tenth_of_a_hertz_is_of_the_condition():
    frequency_Hz = trials()["frequency_Hz"] + 0.07
    measured = measured_speeds(trials().assign(frequency_Hz=frequency_Hz), PLACES)
    assert measured["calibrated"].tolist() == ["yes", "no", "no"]
    assert measured_speeds(trials(), [(1.0, 2.06)])["calibrated"].tolist() == ["no"] * 3


def test_conditions_that_it_was_calibrated_on_do_not_count():
    measured, runs = published_speeds("poppy_LP", PLACES), simulated(1.1)
    calibrated = (measured["calibrated"] == "yes").to_numpy()
    runs.loc[calibrated, "speed_cm_per_s"] *= 2
    items = robot_claims(speed_errors(measured, runs), optima(sweep(0.86)), sweep(0.86))
    assert next(item.ours for item in items if "within 20 %" in item.item) == 100
