"""The alpha table of a medium follows from the fits of its runs as calculated by hand.

Cell: one direction (beta, gamma) of the table.
"""

import math

import numpy as np
import pandas as pd
import pytest
from paper import PAPER

from rftfit.measure.alpha import alpha_table

BIG = 1e9
"""Degrees of freedom of an error that is known exactly."""


def run(name, beta, gamma, z, x=0.0, se=0.001, depth=5.0, dof=BIG, **cells):
    return {
        "run_id": name,
        "beta_deg": beta,
        "gamma_deg": gamma,
        "depth_from_cm": depth,
        "depth_to_cm": depth,
        "alpha_z_N_per_cm3": z,
        "alpha_z_se_N_per_cm3": se,
        "alpha_z_dof": dof,
        "alpha_x_N_per_cm3": x,
        "alpha_x_se_N_per_cm3": 2 * se,
        "alpha_x_dof": dof,
        "reason": "",
        "reason_code": "",
        **cells,
    }


def table(*runs):
    columns = list(run("a", 0, 0, 0))
    return alpha_table(pd.DataFrame(list(runs), columns=columns), "m", 0.95, 3, None, PAPER)


def cell(cells, beta, gamma):
    near = np.isclose(cells["gamma_deg"], gamma, atol=0.1) & (cells["beta_deg"] == beta)
    assert near.sum() == 1
    return cells[near].iloc[0]


def test_beta_of_minus_and_plus_90_are_one_plate():
    cells = table(run("a", 90, 45, 0.2, -0.1), run("b", -90, 45, 0.4, -0.3))
    for beta in (-90, 90):
        cell_row = cell(cells, beta, 45)
        assert cell_row["run_ids"] == "a b"
        assert cell_row["alpha_z_N_per_cm3"] == pytest.approx(0.3)
        assert cell_row["alpha_x_N_per_cm3"] == pytest.approx(-0.2)
    assert cells["n_runs"].sum() == 4


@pytest.mark.parametrize(
    ("depths", "count"),
    [
        ((5.08,), 1),
        ((2.52, 2.56), 1),
        # apart by more than a millimetre
        ((2.0, 2.15), 2),
        ((2.52, 2.56, 5.08), 2),
    ],
)
def test_a_depth_is_reached_to_some_tenths_of_a_millimetre(depths, count):
    """Whatever the digits: repeats of one depth are one depth, of which alone there is no alpha."""
    cells = [
        run(f"{beta} {depth}", beta, 0, 0.1, depth=depth)
        for beta in (-60, -30, 0, 30, 60, 90)
        for depth in depths
    ]
    alpha = table(*cells)
    cell_row = cell(alpha, 60, 0)
    assert cell_row["n_depths"] == count
    numbers = [cell_row["alpha_z_N_per_cm3"], cell_row["alpha_x_hi_N_per_cm3"]]
    if count == 1:
        assert np.isnan(numbers).all()
        assert cell_row["reason_code"] == "too-few-depths"
    else:
        assert numbers[0] == pytest.approx(0.1)
    assert ("repeats" in set(alpha["spread"])) == (len(depths) > count)


@pytest.mark.parametrize("confidence", [0.8, 0.95])
@pytest.mark.parametrize("values", [(0.30, 0.60), (0.30, 0.31, 0.60)])
def test_a_run_that_stands_apart_widens_its_cell_and_no_other(values, confidence):
    """Of two runs the interval reaches the other at any confidence; of three it is that of their scatter."""
    runs = [run(f"a{n}", 0, 90, value) for n, value in enumerate(values)]
    runs += [run(f"{n}{b}", b, 90, 0.2 + 0.01 * n) for b in (30, 60) for n in range(2)]
    columns = pd.DataFrame(runs)
    off = {f"a{len(values) - 1}": (0.30, 0.0)}
    cells = alpha_table(columns, "m", confidence, 3, None, PAPER, None, outliers=off)
    cell_row = cell(cells, 0, 90)
    assert cell_row["alpha_z_N_per_cm3"] == pytest.approx(np.mean(values))
    assert cell_row["alpha_z_lo_N_per_cm3"] <= np.median(values[:-1]) + 1e-9
    if len(values) > 2:
        scatter = np.std(values, ddof=1) / math.sqrt(3)
        assert cell_row["alpha_z_bed_N_per_cm3"] == pytest.approx(scatter)
    without = alpha_table(columns[~columns["run_id"].isin(off)], "m", confidence, 3, None, PAPER)
    names = [f"alpha_z{quantity}_N_per_cm3" for quantity in ("", "_bed", "_lo", "_hi")]
    for beta in (30, 60):
        np.testing.assert_allclose(
            cell(cells, beta, 90)[names].astype(float), cell(without, beta, 90)[names].astype(float)
        )
