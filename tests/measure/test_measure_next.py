"""About 95 % of further pushes fall into the interval that is stated for the next push.

The pushes are of a medium that no code of the program makes. By hand: which errors a further push
has anew, and which it shares with the runs before.
"""

import math
from functools import partial

import numpy as np
import pandas as pd
import pytest

from rftfit.campaign.config import ErrorSettings
from rftfit.measure.alpha import alpha_table, column
from rftfit.measure.errors import SurfaceError

DIRECTIONS = [(beta, gamma) for beta in (-30.0, 0.0, 30.0) for gamma in (-60.0, 30.0, 60.0, 90.0)]
NOISE, NOISE_DOF, BED = 0.004, 12, 0.05
"""Noise of a push, N/cm^3, its degrees of freedom, and the relative spread of beds."""
near = partial(pytest.approx, rel=1e-5)

EXACT = {"angle_deg": 0, "turn_deg": 0, "tare_percent": 0}
"""Errors stated to be zero."""


def truth(beta, gamma):
    """alpha_z and alpha_x of a smooth medium, N/cm^3."""
    b, g = math.radians(beta), math.radians(gamma)
    return 0.2 + 0.1 * math.sin(g) + 0.05 * math.cos(2 * b), 0.08 * math.cos(g) + 0.1 * math.sin(b)


def pushes(random, beta, gamma, count):
    """alpha_z and alpha_x of pushes, each into a bed of its own that is looser or denser as a whole: shape (2, count)."""
    density = 1 + BED * random.standard_normal(count)
    noise = NOISE * random.standard_normal((2, count))
    return np.outer(truth(beta, gamma), density) + noise


def measured(random, repeats):
    """Fits of `repeats` pushes in each direction, each with an estimate of its noise."""
    rows = []
    for beta, gamma in DIRECTIONS:
        for number, alpha in enumerate(pushes(random, beta, gamma, repeats).T):
            name = f"{beta:g}_{gamma:g}_{number}"
            row = {"run_id": name, "beta_deg": beta, "gamma_deg": gamma, "tare_run": name}
            row |= {"depth_from_cm": 1.0, "depth_to_cm": 8.0, "lever_per_cm": 0.2, "reason": ""}
            for c, value in zip("zx", alpha, strict=True):
                seen = NOISE * math.sqrt(random.chisquare(NOISE_DOF) / NOISE_DOF)
                row |= {column(c): value, column(c, "_se"): seen, f"alpha_{c}_dof": NOISE_DOF}
            rows.append(row)
    return pd.DataFrame(rows)


def shares_inside(random, campaigns, repeats, fresh):
    """Share of fresh pushes inside the interval of the mean and of the next push."""
    inside = []
    for _ in range(campaigns):
        table = alpha_table(measured(random, repeats), "m", 0.95, 3, ErrorSettings(**EXACT))
        for cell in table.to_dict("records"):
            alphas = pushes(random, cell["beta_deg"], cell["gamma_deg"], fresh)
            for c, alpha in zip("zx", alphas, strict=True):
                for end in ("", "_next"):
                    low, high = cell[column(c, f"_lo{end}")], cell[column(c, f"_hi{end}")]
                    inside.append(np.mean((low <= alpha) & (alpha <= high)))
    return np.reshape(inside, (-1, 2)).mean(axis=0)


@pytest.mark.parametrize("repeats", [1, 2, 3, 5])
def test_a_fresh_push_falls_into_the_interval_of_the_next_push(repeats):
    """And often not into that of the mean."""
    of_mean, of_next = shares_inside(np.random.default_rng(repeats), 5, repeats, 40)
    assert 0.92 <= of_next <= 0.98
    assert of_mean < 0.9


def half_widths(runs, errors=None, surface=None, outliers=None):
    """Half widths of alpha_z(0, 90 deg), of the mean and of the next push."""
    table = alpha_table(runs, "m", 0.95, 3, errors, None, surface, outliers=outliers)
    (cell,) = table[(table["beta_deg"] == 0) & (table["gamma_deg"] == 90)].to_dict("records")
    return [cell[column("z", end)] - cell[column("z")] for end in ("_hi", "_hi_next")]


def runs_of(alpha, se=0.0, **columns):
    """Runs straight down with stated alpha_z."""
    rows = [
        {"run_id": f"r{k}", "beta_deg": 0, "gamma_deg": 90, "reason": "", "lever_per_cm": 0.2}
        | {"depth_from_cm": 1.0, "depth_to_cm": 8.0, "tare_run": "rod", "mirrored": False}
        | {column("z"): value, column("x"): 0.0, column("z", "_se"): se, column("x", "_se"): se}
        | {"alpha_z_dof": 1e6, "alpha_x_dof": 1e6}
        | columns
        for k, value in enumerate(alpha)
    ]
    return pd.DataFrame(rows)


def test_each_error_of_a_run_comes_once_more_and_what_runs_share_does_not():
    beds = ErrorSettings(**EXACT, bed_percent=4)
    z95 = 1.959964
    none = {"bed_percent": 0.0, "tare_percent": 0}
    # bed and noise of one run, averaged over four and once more
    of_mean, of_next = half_widths(runs_of([0.3] * 4, 0.006), beds)
    run_half_width = z95 * math.hypot(0.04 * 0.3, 0.006)
    assert of_mean == near(run_half_width / 2)
    assert of_next == near(run_half_width * math.sqrt(1.25))
    # a surface of a run, with its degrees of freedom, and one of all runs
    surface = SurfaceError(run=0.3, dof=4)
    of_mean, of_next = half_widths(runs_of([0.3]), beds, surface)
    run = math.hypot(z95 * 0.04 * 0.3, 2.776445 * 0.3 * 0.3 * 0.2)
    assert [of_mean, of_next] == near([run, run * math.sqrt(2)])
    common = z95 * 0.3 * 0.3 * 0.2
    of_mean, of_next = half_widths(runs_of([0.3]), beds, SurfaceError(session=0.3))
    assert of_mean == near(math.hypot(common, z95 * 0.012))
    assert of_next == near(math.hypot(common, z95 * 0.012 * math.sqrt(2)))
    # a tare that runs share
    tare = runs_of([0.3] * 2, 0.005, alpha_z_tare_N_per_cm3=0.005)
    assert half_widths(tare, beds)[1] == near(z95 * math.hypot(0.005, 0.012 * math.sqrt(1.5)))
    # also where an interval is of one bed as prepared, the next bed is another
    of_mean, of_next = half_widths(runs_of([0.3]), ErrorSettings(angle_deg=0, turn_deg=0, **none))
    assert [of_mean, of_next] == near([0, z95 * 0.05 * 0.3])


def test_the_next_push_of_repeats_that_scatter():
    """The interval of one further value from a sample, by Student; outlying runs count in it."""
    alpha = np.array([0.20, 0.30, 0.40])
    for outliers in (None, {"r2": (0.15, 0.0)}):
        of_mean, of_next = half_widths(runs_of(alpha, 0.001), None, None, outliers)
        expected = 4.302653 * 0.1 * math.sqrt(1 + 1 / 3)
        assert of_next == near(expected, rel=1e-3)
        assert of_mean == near(4.302653 * 0.1 / math.sqrt(3), rel=1e-3)


def test_a_row_of_a_table_that_several_runs_stand_behind():
    """One of them has the noise that the mean of four halves, and their beds are in it."""
    of_mean, of_next = half_widths(runs_of([0.3], 0.01, n_repeats=4))
    assert [of_mean, of_next] == near([1.959964 * 0.01, 1.959964 * math.hypot(0.01, 0.02)])
