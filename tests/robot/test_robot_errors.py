"""The best curvature of a sweep agrees with hand calculation; a speed that has no error in percent says why."""

import numpy as np
import pandas as pd
import pytest

from rftfit.compare.robot import optima, robot_claims
from rftfit.robot.speeds import published_speeds, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON


def sweep(top, frequency=5.0, step=0.04, noise=0.0):
    rng = np.random.default_rng(3)
    curvatures = np.round(np.arange(-1, 1 + step / 2, step), 2)
    grid = pd.MultiIndex.from_product([curvatures, (0.0, 1 / 6, 1 / 3)]).to_frame(index=False)
    grid.columns = pd.Index(["curvature_times_R", "phase_turns"])
    speed = 70 - 40 * (grid["curvature_times_R"] - top) ** 2 + rng.normal(0, noise, len(grid))
    return grid.assign(
        medium="poppy_LP",
        profile="table",
        frequency_Hz=frequency,
        speed_cm_per_s=speed,
        outcome="steady",
    )


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


def test_runs_that_are_not_steady_are_left_out():
    table = sweep(0.43)
    table.loc[table["curvature_times_R"] > 0.5, ["outcome", "speed_cm_per_s"]] = "tipped", 500.0
    optimum = optima(table).iloc[0]
    assert optimum["fastest_speed_cm_per_s"] < 71
    assert optimum["reason_code"] == "no-steady-run"
    assert " 13 " in optimum["reason"]
    assert optima(table[table["curvature_times_R"] > 0.9]).empty


def test_a_robot_that_moves_back_has_no_error_in_percent():
    place = {"curvature_times_R": [1.0], "frequency_Hz": [2.0], "reason": [""]}
    measured = pd.DataFrame(place).assign(
        condition="c", medium="sand", speed_cm_per_s=-1.0, speed_sd_cm_per_s=0.1, calibrated=False
    )
    speed = pd.DataFrame(place).assign(
        profile="table", speed_cm_per_s=5.0, speed_lo_cm_per_s=4.0, speed_hi_cm_per_s=6.0
    )
    (row,) = speed_errors(measured.assign(trials=3), speed).to_dict("records")
    assert row["reason_code"] == "speed-not-positive"
    assert np.isnan(row["error_percent"])


def test_conditions_that_it_was_calibrated_on_do_not_count():
    """These are simulated twice as fast as measured, the others 10 % too fast."""
    measured = published_speeds("poppy_LP", list(CALIBRATED_ON.values()))
    factor = np.where(measured["calibrated"] == "yes", 2.0, 1.1)
    ends = ("speed_cm_per_s", "speed_lo_cm_per_s", "speed_hi_cm_per_s")
    speed = measured[["curvature_times_R", "frequency_Hz"]].assign(
        profile="table", reason="", **dict.fromkeys(ends, factor * measured["speed_cm_per_s"])
    )
    items = robot_claims(speed_errors(measured, speed), optima(sweep(0.86)), sweep(0.86))
    assert next(item.ours for item in items if "within 20 %" in item.item) == 100
