"""A sweep has the paper's conditions, does not depend on threads and finds the best curvature.

Sweep: runs of the robot over stride frequency and curvature of the legs.
"""

import math

import numpy as np
from numpy.testing import assert_allclose

from rftfit.robot.run import Condition
from rftfit.robot.sweep import (
    PHASES_TURNS,
    RUN_COLUMNS,
    best_curvature,
    mean_speed,
    paper_conditions,
    run_all,
    speed_table,
)


def test_the_papers_sweep():
    every = paper_conditions()
    assert len(every) == len(set(every)) == 51 * 26 * 3
    curvatures = sorted({c.curvature_times_R for c in every})
    frequencies = sorted({c.frequency_Hz for c in every})
    assert_allclose(curvatures, np.linspace(-1, 1, 51), atol=1e-9)
    assert_allclose(frequencies, np.linspace(0, 5, 26), atol=1e-9)
    assert {c.phase_turns for c in every} == set(PHASES_TURNS)
    for step in (2, 3, 4, 7):  # a part of it
        some = paper_conditions(step)
        assert set(some) <= set(every)
        assert {0.0, 1.0, -1.0} <= {c.curvature_times_R for c in some}
        assert 5.0 in {c.frequency_Hz for c in some}
        assert len(some) < 2 * 3978 / step**2


CONDITIONS = [
    Condition(frequency, curvature, phase)
    for curvature in (1.0, 0.0)
    for frequency in (4.0, 5.0)
    for phase in PHASES_TURNS
]


def test_tables(robot, nine):
    runs_two_threads, runs_one_thread = (
        run_all(robot, nine, CONDITIONS, threads) for threads in (2, 1)
    )
    assert [run.condition for run in runs_two_threads] == CONDITIONS
    assert [run.speed_cm_per_s for run in runs_two_threads] == [
        run.speed_cm_per_s for run in runs_one_thread
    ]
    table = speed_table(runs_two_threads)
    assert tuple(table.columns) == RUN_COLUMNS
    assert (table["outcome"] == "steady").all()
    means = mean_speed(table)
    assert means["phases_steady"].tolist() == [3] * 4
    lo, mean, hi = (means[f"speed{end}_cm_per_s"] for end in ("_lo", "", "_hi"))
    # legs begin at another angle, and end in the same gait
    assert ((lo <= mean) & (mean <= hi) & (hi < 1.02 * lo)).all()
    outcome = np.array(["tipped", *["steady"] * 2, *["buried"] * 3, *["steady"] * 6])
    reason = ["pitch 95 degrees", *[""] * 11]
    speed = table["speed_cm_per_s"].where(outcome == "steady")
    means = mean_speed(table.assign(outcome=outcome, reason=reason, speed_cm_per_s=speed))
    assert means["curvature_times_R"].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert means["frequency_Hz"].tolist() == [4.0, 5.0, 4.0, 5.0]
    assert means["phases_steady"].tolist() == [3, 3, 2, 0]
    assert means["reason_code"].tolist() == ["", "", "tipped", "buried"]
    assert means["reason"][2].endswith(f"0: tipped, {reason[0]}")
    assert_allclose(means["speed_cm_per_s"][2:], [speed[1:3].mean(), np.nan])


def test_best_curvature():
    curvature = np.linspace(-1, 1, 51)
    place, speed = best_curvature(curvature, 70 - 30 * (curvature - 0.61) ** 2)
    assert_allclose([place, speed], [0.61, 70])
    # no top inside: the end itself
    assert best_curvature(curvature, 3 * curvature) == (1.0, 3.0)
    holed = np.where(np.abs(curvature) < 0.5, math.nan, curvature)
    assert best_curvature(curvature, holed) == (1.0, 1.0)
    assert all(map(math.isnan, best_curvature(curvature, np.full(51, math.nan))))
