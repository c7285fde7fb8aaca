"""The alpha table of a medium follows from the fits of its runs as calculated by hand.

Cell: one direction (beta, gamma) of the table.
"""

import math

import numpy as np
import pandas as pd
import pytest
from paper import PAPER

from rftfit.measure.alpha import alpha_table, column, flags_of_cells
from rftfit.measure.flags import Flags, codes_of

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


def table(*runs, depths=3):
    columns = list(run("a", 0, 0, 0))
    return alpha_table(pd.DataFrame(list(runs), columns=columns), "m", 0.95, depths, None, PAPER)


def cell(cells, beta, gamma):
    near = np.isclose(cells["gamma_deg"], gamma, atol=0.1) & (cells["beta_deg"] == beta)
    assert near.sum() == 1
    return cells[near].iloc[0]


def test_beta_of_minus_and_plus_90_are_one_plate():
    cells = table(run("a", 90, 45, 0.2, -0.1), run("b", -90, 45, 0.4, -0.3))
    for beta in (-90, 90):
        cell_row = cell(cells, beta, 45)
        assert cell_row["run_ids"] == "a b"
        assert cell_row[column("z")] == pytest.approx(0.3)
        assert cell_row[column("x")] == pytest.approx(-0.2)
    assert cells["n_runs"].sum() == 4


def test_a_bad_run_does_not_spoil_its_repeat():
    cells = table(
        run("a", 0, 90, 0.3),
        run("b", 0, 90, math.nan, math.nan, reason="spoilt", reason_code="window-saturated"),
        run("c", 30, 90, math.nan, math.nan, reason="gone", reason_code="missing"),
    )
    cell_row = cell(cells, 0, 90)
    assert (cell_row["n_runs"], cell_row["run_ids"]) == (1, "a")
    assert cell_row[column("z")] == pytest.approx(0.3)
    assert (cell_row["reason"], cell_row["reason_code"]) == ("b: spoilt", "window-saturated")
    lost = cell(cells, 30, 90)
    assert math.isnan(lost[column("z")])
    assert (lost["n_runs"], lost["reason_code"]) == (0, "missing")


@pytest.mark.parametrize(
    ("depths", "planned", "code"),
    [
        ((2.54, 7.62), 3, "few-depths"),
        ((5.08,), 3, "too-few-depths"),
        ((5.08,), 2, "too-few-depths"),
        # depths apart by more than a millimetre are two
        ((2.0, 2.15), 3, "few-depths"),
    ],
)
def test_horizontal_runs_at_too_few_depths(depths, planned, code):
    runs = [run(f"h{depth}", 60, 0, 0.1, depth=depth) for depth in depths]
    cells = table(*runs, depths=planned)
    cell_row = cell(cells, 60, 0)
    flags = flags_of_cells(cells, Flags(), planned)
    assert (codes_of(flags) or cell_row["reason_code"]) == code
    assert {flag.cell for flag in flags} <= {(60.0, 0.0)}
    numbers = [cell_row[column("z")], cell_row[column("x", "_hi")]]
    assert np.isnan(numbers).all() == (code == "too-few-depths")
    if code == "few-depths":
        assert numbers[0] == pytest.approx(0.1)


def in_six_cells(rows):
    """The same runs with each plate."""
    return [
        {**row, "beta_deg": beta, "run_id": f"{beta} {row['run_id']}"}
        for beta in (-60, -30, 0, 30, 60, 90)
        for row in rows
    ]


@pytest.mark.parametrize("nominal", [2.54, 2.55, 2.5])
def test_a_depth_is_reached_to_some_tenths_of_a_millimetre(nominal):
    """Whatever the digits: repeats of one depth are one depth, and a depth that lacks is told."""
    near = [run(n, 60, 0, 0.1, depth=nominal + off) for n, off in (("a", -0.02), ("b", 0.02))]
    cell_row = cell(table(*near), 60, 0)
    assert math.isnan(cell_row[column("z")])
    assert cell_row["reason_code"] == "too-few-depths"
    cell_row = cell(table(*near, run("c", 60, 0, 0.1, depth=2 * nominal)), 60, 0)
    assert cell_row[column("z")] == pytest.approx(0.1)
    assert cell_row["n_depths"] == 2
    assert set(table(*in_six_cells(near))["spread"]) == {"repeats"}


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
    assert cell_row[column("z")] == pytest.approx(np.mean(values))
    assert cell_row[column("z", "_lo")] <= np.median(values[:-1]) + 1e-9
    if len(values) > 2:
        scatter = np.std(values, ddof=1) / math.sqrt(3)
        assert cell_row[column("z", "_bed")] == pytest.approx(scatter)
    without = alpha_table(columns[~columns["run_id"].isin(off)], "m", confidence, 3, None, PAPER)
    names = [column("z", quantity) for quantity in ("", "_bed", "_lo", "_hi")]
    for beta in (30, 60):
        np.testing.assert_allclose(
            cell(cells, beta, 90)[names].astype(float), cell(without, beta, 90)[names].astype(float)
        )
