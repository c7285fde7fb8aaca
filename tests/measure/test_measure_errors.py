"""Each named error adds its own amount to the interval of alpha and is shared where it is common.

Common: several runs or cells have it, so that their mean has it too.
"""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from rftfit.campaign.config import ErrorSettings, TableSettings
from rftfit.measure.alpha import alpha_table, column
from rftfit.measure.errors import (
    AS_PREPARED,
    ASSUMED,
    ASSUMED_DOF,
    FEW_REPEATS,
    OF_CELL,
    PRIOR_CM,
    REPEATS,
    SOURCES,
    STATED,
    Part,
    Spread,
    SurfaceError,
    bed_of_mean,
    errors_of,
    gradient,
    shares,
    spread_of_beds,
    surface_error,
)
from rftfit.measure.repeats import FLOORS, RunScatter
from rftfit.measure.slopes import fit_slope
from rftfit.model.draws import alpha_draws
from rftfit.reference import BETA_DEG, GAMMA_DEG, alpha_grid

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
    table = alpha_grid("poppy_LP")
    for i, j in itertools.product((2, 3, 4), (0, 3, 9, 12)):
        for number in range(repeats):
            row: dict[str, Any] = {
                "run_id": f"{i}_{j}_{number}",
                "beta_deg": BETA_DEG[i],
                "gamma_deg": GAMMA_DEG[j],
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
                    column(c): value,
                    column(c, "_se"): 0.001,
                    f"alpha_{c}_dof": 12.0,
                    column(c, "_tare"): 0.0005,
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
    nothing = np.zeros((1, 1))
    right = fit_slope(depth, 0.3 * depth[None], nothing, np.ones((1, 1)))
    late = fit_slope(depth, 0.3 * (depth - 0.2)[None], nothing, np.ones((1, 1)))
    assert right.alpha[0] - late.alpha[0] == pytest.approx(0.3 * 0.2 * right.lever, rel=1e-9)
    assert late.offset[0] == pytest.approx(0.2, abs=1e-9)
    assert right.offset[0] == pytest.approx(0.0, abs=1e-9)
    # and the cell's error is that of 2 mm
    cell = cell_table(surface=SurfaceError(run=0.2)).loc[(0, 90)]
    assert cell["alpha_z_surface_N_per_cm3"] == pytest.approx(0.2 * 0.2 * cell[column("z")])


def test_the_turn_of_the_mount_moves_one_component_into_the_other():
    table = cell_table(NONE.model_copy(update={"turn_deg": 1.0}))
    cell, turn = table.loc[(30, 90)], math.radians(1)
    assert cell["alpha_x_turn_N_per_cm3"] == pytest.approx(turn * cell[column("z")])
    assert cell["alpha_z_turn_N_per_cm3"] == pytest.approx(-turn * cell[column("x")])
    # a run that is filed as its mirror image errs to the other side
    back = table[table["gamma_deg"] < 0].iloc[0]
    assert back["alpha_x_turn_N_per_cm3"] == pytest.approx(-turn * back[column("z")])


def test_gradient_of_a_plane():
    random = np.random.default_rng(2)
    beta, gamma = random.uniform(-60, 60, 40), random.uniform(-90, 90, 40)
    slopes = gradient(beta, gamma, 0.3 + 0.01 * beta - 0.002 * gamma)
    # where neighbours lie on all sides within the turn of a plate, which is 180 degrees
    inner = np.abs(beta) < 30
    np.testing.assert_allclose(slopes[inner], np.tile([0.01, -0.002], (inner.sum(), 1)), atol=1e-9)
    apart = np.array([0.0, 80.0]), np.array([90.0, -90.0]), np.array([0.3, 0.1])
    assert (gradient(*apart) == 0).all()
    elsewhere = np.array([[0.001, 0.002], [-0.003, 0.004]])
    np.testing.assert_allclose(gradient(*apart, elsewhere), elsewhere)


@pytest.mark.parametrize("off_deg", [0.0, 0.5])
def test_what_lies_across_a_line_of_neighbours_is_known_from_elsewhere(off_deg):
    """Cells on one line of gamma, as planned or as the arm reached them: the slope with beta is not theirs."""
    gamma = np.array([0.0, 20.0, 40.0])
    beta = np.array([30.0, 30 + off_deg, 30.0])
    slopes = gradient(beta, gamma, 0.3 + 0.01 * gamma, np.full((3, 2), 0.005))
    np.testing.assert_allclose(slopes, [[0.005, 0.01]] * 3, atol=2e-4)
    np.testing.assert_allclose(gradient(beta, gamma, 0.3 + 0.01 * gamma)[:, 0], 0, atol=4e-4)


def test_an_angle_has_an_error_where_no_cell_is_near():
    """The slope of the known shape, as large as the medium is beside it; where cells are near, their own."""
    runs = fits()
    far = runs[runs["run_id"].isin(["2_0_0", "3_9_0"])]
    stated = NONE.model_copy(update={"angle_deg": 0.5})
    mean = np.array([[0.5, -0.5], [0.1, 0.2]])
    slopes = np.array([[[0.01, 0.0], [0.003, 0.004]], [[0.002, 0.0], [0.0, 0.001]]])
    table = alpha_table(far, "m", 0.95, 3, stated, shape=lambda *_: (mean, slopes))
    size = table[[column(c) for c in "zx"]].abs().to_numpy().sum() / np.abs(mean).sum()
    for c, expected in zip("zx", 0.5 * size * np.hypot(*np.moveaxis(slopes, -1, 0)), strict=True):
        np.testing.assert_allclose(table[column(c, "_angle")], expected)
    assert (alpha_table(far, "m", 0.95, 3, stated)[column("z", "_angle")] == 0).all()
    lost = far.assign(**{column(c): math.nan for c in "zx"})
    assert alpha_table(lost, "m", 0.95, 3, stated, shape=None)[column("z")].isna().all()


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
    blind = surface_error(np.full(60, 3.0), np.full(60, 0.5), UNKNOWN)
    assert (blind.run, blind.session) == (PRIOR_CM, 0.0)
    stated = surface_error(
        np.full(60, 3.0), noise, ErrorSettings(surface_run_mm=1, surface_session_mm=2)
    )
    assert (stated.run, stated.session) == (0.1, 0.2)
    assert surface_error(np.full(3, 0.3), noise[:3], UNKNOWN).run > PRIOR_CM
    assert surface_error(np.full(60, 0.3), noise, UNKNOWN, is_given=False).run == 0


def test_cells_with_one_tare_are_drawn_together():
    table = cell_table().reset_index(drop=True)
    draws = alpha_draws(table, 20_000, 1, 0.95)[0]
    same = (table["gamma_deg"] == 90).to_numpy()
    correlation = np.atleast_2d(np.corrcoef(draws[:, same].T))
    # the tare has a quarter of the variance
    np.testing.assert_allclose(correlation[np.triu_indices(3, 1)], 0.25, atol=0.03)
    across_tares = np.atleast_2d(np.corrcoef(draws[:, same].T, draws[:, ~same].T))[:3, 3:]
    assert np.abs(across_tares).max() < 0.04
    width = (table[column("z", "_hi")] - table[column("z", "_lo")]) / 2
    np.testing.assert_allclose(draws.std(axis=0) * 1.959964, width, rtol=0.03)


def test_a_common_surface_moves_all_cells_in_proportion():
    table = cell_table(surface=SurfaceError(session=0.5)).reset_index(drop=True)
    draws = alpha_draws(table, 4000, 1, 0.95, only="session")[0] - table[column("z")].to_numpy()
    ratio = draws / table[column("z")].to_numpy() / 0.2
    # up to the quantiles, which go with the degrees of freedom of each cell
    assert np.abs(ratio / ratio[:, :1] - 1).max() < 0.06
    assert ratio[:, 0].std() == pytest.approx(0.5, rel=0.15)
    errors = dict.fromkeys(SOURCES, 0.0) | {"noise": 3.0, "session": 4.0}
    assert shares(errors) == "session 64 %, noise 36 %"


ERRORS = dict.fromkeys(
    ("surface_run_mm", "surface_session_mm", "angle_deg", "turn_deg", "bed_percent"),
    st.floats(0.0, 3.0),
) | {"bed_N_per_cm3": st.floats(0, 0.02)}
"""Errors that may be stated, and their sizes."""


@settings(deadline=None, max_examples=40)
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
        return np.concatenate([table[column(c, "_hi")] - table[column(c, "_lo")] for c in "zx"])

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
    assert spread.source == REPEATS
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


def test_the_error_of_a_component_by_hand():
    """Along and across a force of (0.24, 0.07) N/cm^3, of the largest one, whose floor makes no difference."""
    along, across, dof = 0.05, 0.02, 9.0
    one_floor = np.eye(FLOORS.size)[2]
    scatter = RunScatter(np.full(FLOORS.size, along), np.full(FLOORS.size, across), one_floor, dof)
    spread = Spread(scatter=scatter, largest=0.25, source=REPEATS)
    # the force lies at cos = 0.96 and sin = 0.28
    of_z = (0.25 * along * 0.96) ** 2, (0.25 * across * 0.28) ** 2
    error = spread.error_at(np.array([0.24, 0.07]), 0)
    assert error.sd == pytest.approx(math.sqrt(sum(of_z)))
    assert error.dof == pytest.approx(dof * sum(of_z) ** 2 / (of_z[0] ** 2 + of_z[1] ** 2))
    # a component that nobody measured has no error, and z has its own
    assert math.isnan(spread.error_at(np.array([0.24, math.nan]), 1).sd)
    assert spread.error_at(np.array([0.25, math.nan]), 0).sd == pytest.approx(0.25 * along)
    # floors that repeats cannot tell apart leave less known of a weak direction
    floors = np.where(FLOORS < 1, 0.2, 0.0)
    unknown = Spread(scatter=replace(scatter, weight=floors), largest=0.25, source=REPEATS)
    weak = unknown.error_at(np.array([0.01, 0.0]), 0)
    assert weak.dof < dof
    assert weak.sd > 0.01 * along


def test_fewer_than_five_degrees_of_freedom_do_not_speak_for_all_cells():
    five, six = (
        [(np.stack([np.linspace(0.2, 0.3, runs)] * 2), np.full((2, runs), 0.001))]
        for runs in (5, 6)
    )
    assert spread_of_beds(five).source == FEW_REPEATS
    assert spread_of_beds([]).source == ASSUMED
    assert spread_of_beds(six).source == REPEATS
    stated = spread_of_beds(five, (0.003, 0.1))
    alpha = np.array([0.4, 0.1])
    assert stated.source == STATED
    assert stated.error_at(alpha, 0).sd == pytest.approx(math.hypot(0.003, 0.04))
    assert stated.error_at(alpha, 1).sd == pytest.approx(math.hypot(0.003, 0.01))
    assert spread_of_beds(five, (0.0, 0.0)).error_at(alpha, 0).sd == 0
    assert spread_of_beds([]).error_at(alpha, 0).sd == pytest.approx(0.02)


def test_few_repeats_moderate_what_is_assumed():
    """By hand: one bed, its squares relative to alpha, beside the assumed two of 5 %."""
    z, none = np.array([0.20, 0.24]), np.full(2, math.nan)
    spread = spread_of_beds([(np.stack([z, none]), np.zeros((2, 2)))])
    bed_error = spread.error_at(np.array([0.22, math.nan]), 0)
    variance = (ASSUMED_DOF * 0.05**2 + 0.0008 / 0.22**2) / 3
    assert bed_error.sd == pytest.approx(0.22 * math.sqrt(variance), rel=1e-3)
    assert bed_error.dof == pytest.approx(3)
    assert spread.source == FEW_REPEATS
    # repeats that agree make it smaller, though not as small as they are
    agreeing = spread_of_beds([(np.full((2, 2), 0.3), np.full((2, 2), 0.0001))] * 4)
    error = agreeing.error_at(np.array([0.3, 0.3]), 0)
    assert error.sd == pytest.approx(0.3 * math.hypot(0.05, 0.015) * math.sqrt(2 / 6), rel=1e-2)
    assert error.dof >= 6
    noise, share = Part(0.001, 12), np.array([0.5, 0.5])
    mean_errors = bed_of_mean(z, share, noise, bed_error, spread.source)
    assert (mean_errors[0], mean_errors[1].dof, mean_errors[2]) == (
        noise,
        bed_error.dof,
        FEW_REPEATS,
    )
    assert mean_errors[1].sd == pytest.approx(bed_error.sd / math.sqrt(2))


def test_repeats_of_a_bed_as_prepared_count_in_their_cell_alone():
    share, noise = np.array([0.5, 0.5]), Part(0.001, 12)
    apart = bed_of_mean(np.array([0.2, 0.4]), share, noise, Part(0.0), AS_PREPARED)
    # the usual spread counts for two degrees of freedom, where two runs have one
    assert (apart[0].sd, apart[1].dof, apart[2]) == (0, ASSUMED_DOF, OF_CELL)
    assert apart[1].sd == pytest.approx(0.1)
    none = bed_of_mean(np.array([0.3, 0.3]), share, noise, Part(0.0), AS_PREPARED)
    assert (none[0], none[1].sd, none[2]) == (noise, 0, OF_CELL)


def test_the_surface_of_few_runs_by_hand():
    # five runs speak for themselves, by their median and its distances
    offset, se = np.array([0.05, 0.1, 0.2, 0.35, 0.4]), np.full(5, 0.01)
    five = surface_error(offset, se, UNKNOWN)
    scatter = 1.4826 * 0.15
    assert five.run == pytest.approx(math.sqrt(scatter**2 - 1e-4))
    assert five.session == pytest.approx(math.sqrt(max(0.04 - math.pi / 2 * scatter**2 / 5, 0)))
    assert five.dof == 3
    many = surface_error(np.tile(offset, 8), np.full(40, 0.01), UNKNOWN)
    assert many.session == pytest.approx(math.sqrt(0.04 - math.pi / 2 * scatter**2 / 40))
    assert many.dof == pytest.approx(0.37 * 39)
    # two are filled up with three of 1 mm
    two = surface_error(np.array([0.3, 0.05]), np.array([0.1, 0.06]), UNKNOWN)
    assert two.run == pytest.approx(math.sqrt((0.09 - 0.01 + 3 * 0.01) / 5))
    assert (two.session, two.dof) == (0, 5)


def test_errors_of_logs_and_of_a_table(paper_config):
    runs = pd.DataFrame({"offset_cm": [0.3, 0.2, 0.1], "offset_se_cm": [0.01, 0.02, 9.0]})
    stated, surface = errors_of(runs, paper_config)
    assert stated == paper_config.errors
    by_hand = surface_error(np.array([0.3, 0.2]), np.array([0.01, 0.02]), stated)
    assert surface == by_hand
    found_surface = paper_config.surface.model_copy(update={"method": "found"})
    assert errors_of(runs, paper_config.model_copy(update={"surface": found_surface}))[1].run == 0
    # depths and angles of a table are what it says
    held = {
        "table": TableSettings(holds="alpha"),
        "errors": ErrorSettings(turn_deg=2, tare_percent=7),
    }
    exact, surface = errors_of(runs, paper_config.model_copy(update=held))
    assert surface == SurfaceError()
    assert (exact.angle_deg, exact.turn_deg, exact.tare_percent, exact.bed) == (0, 0, 0, (0, 0))
    held["errors"] = ErrorSettings(bed_percent=3)
    assert errors_of(runs, paper_config.model_copy(update=held))[0].bed == (0, 0.03)


def test_a_neighbour_is_up_to_45_degrees_away():
    beta = np.zeros(2)
    for apart, expected_slope in ((45.0, 0.01), (45.1, 0.0)):
        slopes = gradient(beta, np.array([0.0, apart]), np.array([0.3, 0.3 + 0.01 * apart]))
        np.testing.assert_allclose(slopes[:, 1], expected_slope, atol=1e-12)
