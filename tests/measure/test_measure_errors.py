"""Each named error adds its own amount to the interval of alpha and is shared where it is common.

Common: several runs or cells have it, so that their mean has it too.
"""

import itertools
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from seeds import seeds

import rftfit
from rftfit import reference
from rftfit.campaign.config import ErrorSettings
from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import gradient, spread_of_beds, surface_error
from rftfit.measure.repeats import FLOORS

NONE = ErrorSettings(
    surface_run_mm=0, surface_session_mm=0, angle_deg=0, turn_deg=0, tare_percent=0, bed_percent=0
)
"""All errors stated to be zero."""
UNKNOWN = ErrorSettings()
"""No error stated: each has its default."""


def fits(repeats=1, scatter=0.0):
    """Runs of loose poppy seeds in twelve directions, without noise but for the stated scatter."""
    random = np.random.default_rng(5)
    rows = []
    table = reference.alpha_grid("poppy_LP")
    for i, j in itertools.product((2, 3, 4), (0, 3, 9, 12)):
        for number in range(repeats):
            row: dict[str, Any] = {
                "run_id": f"{i}_{j}_{number}",
                "beta_deg": reference.BETA_DEG[i],
                "gamma_deg": reference.GAMMA_DEG[j],
                "depth_from_cm": 1.0,
                "depth_to_cm": 8.0,
                "lever_per_cm": 0.2,
                "mirrored": j < 6,
                "tare_run": f"rod_{j}",
                "reason": "",
            }
            for c, alphas in zip("zx", table, strict=True):
                value = float(alphas[i, j]) * (1 + scatter * random.standard_normal())
                row |= {
                    f"alpha_{c}_N_per_cm3": value,
                    f"alpha_{c}_se_N_per_cm3": 0.001,
                    f"alpha_{c}_dof": 12.0,
                    f"alpha_{c}_tare_N_per_cm3": 0.0005,
                }
            rows.append(row)
    return pd.DataFrame(rows)


def cell_table(errors=NONE, surface=None, runs=None):
    runs = fits() if runs is None else runs
    return alpha_table(runs, "m", 0.95, 3, errors, None, surface).set_index(
        ["beta_deg", "gamma_deg"], drop=False
    )


def test_a_surface_moves_alpha_by_what_the_lever_says():
    """The slope through zero of a stress that begins 2 mm deeper, against its own lever."""
    depth = np.linspace(1.0, 8.0, 700)
    right, late = (rftfit.fit_slope(depth, 0.3 * (depth - late_cm)) for late_cm in (0.0, 0.2))
    assert right.alpha[0] - late.alpha[0] == pytest.approx(0.3 * 0.2 * right.lever, rel=1e-9)
    assert late.offset[0] == pytest.approx(0.2, abs=1e-9)
    assert right.offset[0] == pytest.approx(0.0, abs=1e-9)
    # and the cell's error is that of 2 mm
    stated = ErrorSettings(surface_run_mm=2, surface_session_mm=0)
    surface = surface_error(np.zeros(3), np.zeros(3), stated)
    cell = cell_table(surface=surface).loc[(0, 90)]
    assert cell["alpha_z_surface_N_per_cm3"] == pytest.approx(0.2 * 0.2 * cell["alpha_z_N_per_cm3"])


def test_gradient_of_a_plane():
    random = np.random.default_rng(2)
    beta, gamma = random.uniform(-60, 60, 40), random.uniform(-90, 90, 40)
    slopes = gradient(beta, gamma, 0.3 + 0.01 * beta - 0.002 * gamma)
    # where neighbours lie on all sides within the turn of a plate, which is 180 degrees
    inner = np.abs(beta) < 30
    np.testing.assert_allclose(slopes[inner], np.tile([0.01, -0.002], (inner.sum(), 1)), atol=1e-9)
    # a neighbour is up to 45 degrees away
    elsewhere = np.array([[0.001, 0.002], [-0.003, 0.004]])
    for apart_deg, of_neighbours in ((45.0, True), (45.1, False)):
        gamma = np.array([0.0, apart_deg])
        slopes = gradient(np.zeros(2), gamma, 0.3 + 0.01 * gamma, elsewhere)
        expected_slopes = [0.01, 0.01] if of_neighbours else elsewhere[:, 1]
        np.testing.assert_allclose(slopes[:, 1], expected_slopes, atol=1e-12)


@pytest.mark.parametrize("off_deg", [0.0, 0.5])
def test_what_lies_across_a_line_of_neighbours_is_known_from_elsewhere(off_deg):
    """Cells on one line of gamma, as planned or as the arm reached them: the slope with beta is not theirs."""
    gamma = np.array([0.0, 20.0, 40.0])
    beta = np.array([30.0, 30 + off_deg, 30.0])
    slopes = gradient(beta, gamma, 0.3 + 0.01 * gamma, np.full((3, 2), 0.005))
    np.testing.assert_allclose(slopes, [[0.005, 0.01]] * 3, atol=2e-4)
    np.testing.assert_allclose(gradient(beta, gamma, 0.3 + 0.01 * gamma)[:, 0], 0, atol=4e-4)


def test_the_surface_is_judged_by_the_offsets():
    random = np.random.default_rng(1)
    noise = np.full(60, 0.01)
    surfaces = [
        surface_error(random.normal(0.2, math.hypot(0.1, 0.01), 60), noise, UNKNOWN)
        for _ in range(200)
    ]
    assert np.mean([surface.run for surface in surfaces]) == pytest.approx(0.1, rel=0.08)
    assert np.mean([surface.session for surface in surfaces]) == pytest.approx(0.2, rel=0.05)
    # what says nothing of the surface, or is told, does not count
    stated = ErrorSettings(surface_run_mm=1, surface_session_mm=2)
    for noise_cm, errors, session_cm in ((0.5, UNKNOWN, 0.0), (0.01, stated, 0.2)):
        surface = surface_error(np.full(60, 3.0), np.full(60, noise_cm), errors)
        assert (surface.run, surface.session) == (0.1, session_cm)
    assert surface_error(np.full(3, 0.3), noise[:3], UNKNOWN).run > 0.1
    assert surface_error(np.full(60, 0.3), noise, UNKNOWN, is_given=False).run == 0


ERRORS = dict.fromkeys(
    ("surface_run_mm", "surface_session_mm", "angle_deg", "turn_deg", "bed_percent"),
    st.floats(0.0, 3.0),
) | {"bed_N_per_cm3": st.floats(0, 0.02)}
"""Errors that may be stated, and their sizes."""


@pytest.mark.statistics
@settings(max_examples=seeds(40, 12))
@given(
    start=st.fixed_dictionaries(ERRORS),
    name=st.sampled_from([*ERRORS]),
    increase=st.floats(0.01, 3.0),
    scatter=st.sampled_from([0.0, 0.02, 0.1]),
    repeats=st.sampled_from([1, 2, 3]),
)
def test_no_error_when_enlarged_narrows_an_interval(start, name, increase, scatter, repeats):
    runs = fits(repeats, scatter)

    def widths(values):
        errors = ErrorSettings(**values)
        surface = surface_error(np.zeros(12), np.zeros(12), errors)
        table = cell_table(errors, surface, runs)
        return np.concatenate(
            [table[f"alpha_{c}_hi_N_per_cm3"] - table[f"alpha_{c}_lo_N_per_cm3"] for c in "zx"]
        )

    assert (widths(start | {name: start[name] + increase}) >= widths(start) * (1 - 1e-9)).all()


def drawn_groups(seed, along, across, floor, cells):
    """Repeats that scatter along and across their force, in proportion to it, with a floor."""
    random = np.random.default_rng(seed)
    groups = []
    for runs in random.integers(2, 5, cells):
        angle, size = random.uniform(-math.pi, math.pi), random.uniform(0.02, 0.5)
        units = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        level = math.hypot(size, 0.5 * floor)
        scatter = np.array([along, across])[:, None] * level * random.standard_normal((2, runs))
        noise = 0.002 * random.standard_normal((2, runs))
        alpha = size * units[0][:, None] + units.T @ scatter + noise
        groups.append((alpha, np.full((2, runs), 0.002)))
    return groups


def test_the_scatter_of_repeats_is_the_most_likely_one():
    """Against the likelihood of the runs of each floor, by another optimiser."""
    groups = drawn_groups(4, 0.08, 0.03, 0.4, 60)
    spread = spread_of_beds(groups)
    assert spread.source == "repeats"
    assert spread.scatter is not None
    largest = max(np.hypot(*alpha.mean(axis=1)) for alpha, _ in groups)
    likelihoods = []
    for floor, along, across in zip(
        FLOORS, spread.scatter.along, spread.scatter.across, strict=True
    ):

        def unlikely(logs, floor=floor):
            total = 0.0
            for alpha, se in groups:
                mean = alpha.mean(axis=1)
                unit = mean / np.hypot(*mean)
                level = (mean @ mean + (floor * largest) ** 2) / (1 + floor**2)
                for way, log in zip((unit, [-unit[1], unit[0]]), logs, strict=True):
                    variance = math.exp(2 * log) * level + se[0, 0] ** 2
                    squares = float(((np.array(way) @ (alpha - mean[:, None])) ** 2).sum())
                    total += (alpha.shape[1] - 1) / 2 * math.log(variance) + squares / variance / 2
            return total

        best = minimize(unlikely, np.log([0.05, 0.05]), method="Nelder-Mead", tol=1e-10)
        np.testing.assert_allclose([along, across], np.exp(best.x), rtol=1e-3)
        likelihoods.append(-best.fun)
    weight = np.exp(np.array(likelihoods) - max(likelihoods))
    np.testing.assert_allclose(spread.scatter.weight, weight / weight.sum(), rtol=2e-3, atol=1e-9)
    # what was drawn is found, and the floors between which it lies
    expected = math.hypot(1, 0.4) * np.array([0.08, 0.03])
    np.testing.assert_allclose(spread.scatter.relative(), expected, rtol=0.25)
    assert FLOORS[spread.scatter.weight.argmax()] in (0.2, 0.4, 1.0)


def test_fewer_than_five_degrees_of_freedom_do_not_speak_for_all_cells():
    five, six = (
        [(np.stack([np.linspace(0.2, 0.3, runs)] * 2), np.full((2, runs), 0.001))]
        for runs in (5, 6)
    )
    assert spread_of_beds(five).source == "few repeats"
    assert spread_of_beds(six).source == "repeats"
    stated = spread_of_beds(five, (0.003, 0.1))
    assert stated.source == "stated"
    alpha = np.array([0.4, 0.1])
    for component, part in enumerate((0.04, 0.01)):
        assert stated.error_at(alpha, component).sd == pytest.approx(math.hypot(0.003, part))
    assert spread_of_beds(five, (0.0, 0.0)).error_at(alpha, 0).sd == 0
    assert spread_of_beds([]).error_at(alpha, 0).sd == pytest.approx(0.02)
