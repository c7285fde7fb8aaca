"""The covariance of alpha equals that of simulated runs for each error that runs have in common."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rftfit.campaign.config import ErrorSettings
from rftfit.measure.alpha import alpha_table, column
from rftfit.measure.errors import surface_error
from rftfit.model.common_errors import covariance_of

NONE = ErrorSettings(
    surface_run_mm=0, surface_session_mm=0, angle_deg=0, turn_deg=0, tare_percent=0, bed_percent=0
)
"""All errors stated to be zero."""
LEVER, TARE = 0.2, 0.004
"""Relative change of a slope by a shift of the surface, 1/cm; error of a tare, N/cm^3."""
RUNS = [
    # direction, alpha_z and alpha_x as filed, slope of the rod as filed, mirrored, rod
    ((0.0, 90.0), (0.30, 0.01), (0.05, 0.02), False, "rod_a"),
    ((0.0, 90.0), (0.30, 0.01), (0.05, 0.02), False, "rod_a"),
    ((30.0, 45.0), (0.20, 0.12), (0.03, -0.03), False, "rod_a"),
    ((30.0, 45.0), (0.20, 0.12), (0.03, -0.03), False, "rod_b"),
    ((-30.0, -45.0), (-0.04, 0.06), (-0.01, 0.02), True, "rod_a"),
    ((-30.0, -90.0), (-0.05, -0.02), (-0.02, 0.01), True, "rod_b"),
]
CELLS = sorted({run[0] for run in RUNS})
ALPHA, RODS = (np.array([run[k] for run in RUNS]) for k in (1, 2))
# what points toward +x in the laboratory does so in a run that is filed as its mirror image with the other sign
SIDE = np.where([run[3] for run in RUNS], -1.0, 1.0)


def surface_of(run_mm, session_mm):
    """Stated error of the surface from run to run, and that of all runs alike."""
    stated = ErrorSettings(surface_run_mm=run_mm, surface_session_mm=session_mm)
    return surface_error(np.zeros(3), np.zeros(3), stated)


def table_of(errors=NONE, surface=None, tare=0.0, noise=0.0):
    """Alpha table of the runs with stated errors."""
    rows = []
    for number, ((beta, gamma), alpha, rod, mirrored, tare_run) in enumerate(RUNS):
        row = {"run_id": f"r{number}", "beta_deg": beta, "gamma_deg": gamma, "reason": ""}
        row |= {"depth_from_cm": 1.0, "depth_to_cm": 8.0, "lever_per_cm": LEVER}
        row |= {"mirrored": mirrored, "tare_run": tare_run}
        for c, value, slope in zip("zx", alpha, rod, strict=True):
            row |= {column(c): value, column(c, "_rod"): slope, column(c, "_tare"): tare}
            row |= {column(c, "_se"): math.hypot(tare, noise), f"alpha_{c}_dof": 1e6}
        rows.append(row)
    return alpha_table(pd.DataFrame(rows), "m", 0.95, 3, errors, None, surface)


def turned(draws):
    """Error of the runs where the mount is turned by so many radians: shape (draws, runs, 2)."""
    up, along = ALPHA[:, 0], SIDE * ALPHA[:, 1]
    moved = [-draws[:, None] * along, SIDE * draws[:, None] * up]
    return np.stack(moved, axis=-1)


def of_rods(random, draws):
    """Error of the runs where each rod's own force errs, up and along the laboratory's x, on its own."""
    names = sorted({run[4] for run in RUNS})
    number = [names.index(run[4]) for run in RUNS]
    force = TARE * random.standard_normal((draws, len(names), 2))[:, number]
    return -force * np.stack([np.ones_like(SIDE), SIDE], axis=-1)


SIMULATED: dict[str, tuple[Any, dict[str, Any]]] = {
    "turn": (
        lambda random, n: turned(math.radians(2) * random.standard_normal(n)),
        {"errors": NONE.model_copy(update={"turn_deg": 2.0})},
    ),
    "session": (
        lambda random, n: 0.3 * LEVER * random.standard_normal((n, 1, 1)) * ALPHA,
        {"surface": surface_of(0, 3)},
    ),
    "rod": (
        lambda random, n: -0.1 * random.standard_normal((n, 1, 1)) * RODS,
        {"errors": NONE.model_copy(update={"tare_percent": 10.0})},
    ),
    "tare": (of_rods, {"tare": TARE}),
}


@pytest.mark.parametrize("error", SIMULATED)
def test_covariance_by_one_common_error(error):
    """Signs, sizes and which cells: runs err alike, each to its own side, and cells are their means."""
    make, stated = SIMULATED[error]
    moved = make(np.random.default_rng(3), 40_000)
    in_cell = np.array([[run[0] == cell for run in RUNS] for cell in CELLS], dtype=float)
    share = in_cell / in_cell.sum(axis=1, keepdims=True)
    # x, then z of each cell
    cells = np.einsum("cr,drk->dck", share, moved[..., ::-1]).reshape(len(moved), -1)
    expected = np.cov(cells.T)
    covariance = covariance_of(table_of(**stated))
    assert list(covariance.index) == [(*cell, c) for cell in CELLS for c in "xz"]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert_allclose(covariance.to_numpy() / scale, expected / scale, atol=0.02)
    # it is not all of the diagonal
    assert np.abs(expected / scale - np.eye(len(expected))).max() > 0.5


def whole_table():
    """Every kind of error, a plate that stands in the table twice, and a cell that has no number."""
    errors = ErrorSettings(bed_percent=3, tare_percent=20, turn_deg=1)
    table = table_of(errors, surface_of(1, 2), tare=TARE, noise=0.003)
    upright = table.iloc[[0, 0]].assign(beta_deg=[-90.0, 90.0])
    nothing = table.iloc[[0]].assign(gamma_deg=10.0, **{column(c, "_se"): np.nan for c in "zx"})
    return pd.concat([table, upright, nothing], ignore_index=True)


def test_covariance_is_that_of_the_standard_errors():
    table = whole_table()
    covariance = covariance_of(table)
    names = ["beta_deg", "gamma_deg", "component"]
    assert list(covariance.index.names) == list(covariance.columns.names) == names
    with_error = table.dropna(subset=[column("z", "_se")]).sort_values(["beta_deg", "gamma_deg"])
    assert len(covariance) == 2 * len(with_error) == 2 * (len(table) - 1)
    se = with_error[[column(c, "_se") for c in "xz"]].to_numpy(float).ravel()
    assert_allclose(np.sqrt(np.diag(covariance)), se, rtol=1e-12)
    assert_array_equal(covariance, covariance.T)
    values = np.linalg.eigvalsh(covariance)
    assert values.min() > -1e-12 * values.max()
    # one plate has one error
    left, right = (covariance.xs((beta, -90.0)) for beta in (-90.0, 90.0))
    assert_allclose(left, right, rtol=1e-12)
