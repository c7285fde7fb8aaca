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

from rftfit.campaign.config import ErrorSettings, TableSettings
from rftfit.measure.alpha import alpha_table, column
from rftfit.measure.errors import (
    ASSUMED,
    ASSUMED_DOF,
    FEW_REPEATS,
    OF_CELL,
    ONE_BED,
    PRIOR_CM,
    REPEATS,
    SOURCES,
    STATED,
    Part,
    SurfaceError,
    bed_of_mean,
    combined_half_width,
    errors_of,
    gradient,
    shares,
    spread_of_beds,
    surface_error,
)
from rftfit.measure.slopes import fit_slope
from rftfit.model.draws import alpha_draws, errors_behind
from rftfit.model.profiles import TableProfile
from rftfit.model.rft3d import rft3d_profile
from rftfit.model.shapes import published_shapes
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


def test_an_angle_without_neighbours_is_covered():
    """Plates turned by 2 degrees in media that are not the mean shape, in directions far from one another."""
    random = np.random.default_rng(3)
    stated = NONE.model_copy(update={"angle_deg": 2})
    beta, gamma = np.array([[-60.0, 0.0, 40.0, 0.0, 60.0], [20.0, 70.0, 30.0, -60.0, -25.0]])
    inside = []
    for medium in ("poppy_LP", "glass0.3mm_CP", "glass3mm_CP", "rft"):
        profile = rft3d_profile(0.9, 0.4, 5) if medium == "rft" else TableProfile.published(medium)
        truth = np.stack(profile.alpha(np.radians(beta), np.radians(gamma)))
        for _ in range(15):
            turned = (np.radians(angle_deg + random.normal(0, 2, 5)) for angle_deg in (beta, gamma))
            runs = pd.DataFrame({"run_id": [*"abcde"], "beta_deg": beta, "gamma_deg": gamma})
            for c, values in zip("zx", profile.alpha(*turned), strict=True):
                runs[column(c)], runs[column(c, "_se")], runs[f"alpha_{c}_dof"] = values, 0.001, 50
            table = alpha_table(runs, "m", 0.95, 3, stated, shape=published_shapes().slopes)
            order = [*zip(table["beta_deg"], table["gamma_deg"], strict=True)]
            order = [order.index(place) for place in zip(beta, gamma, strict=True)]
            for c, value in zip("zx", truth, strict=True):
                ends = table[[column(c, "_lo"), column(c, "_hi")]].to_numpy()[order].T
                inside.append((ends[0] <= value) & (value <= ends[1]))
    assert np.mean(inside) > 0.88


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


def test_shares_of_a_sum_are_those_of_its_variance(paper_config):
    table = cell_table(surface=SurfaceError(session=0.1)).reset_index(drop=True)
    behind = errors_behind(table, paper_config, lambda alpha: alpha[0].mean(axis=1))
    whole = alpha_draws(table, 20_000, 1, 0.95)[0].mean(axis=1).std()
    assert math.sqrt(sum(sd**2 for sd in behind.values())) == pytest.approx(whole, rel=0.08)
    # noise averages over the cells, the surface does not
    assert behind["session"] == pytest.approx(0.02 * table[column("z")].mean(), rel=0.2)
    assert behind["noise"] < 0.5 * table[column("z", "_noise")].mean()


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


@given(
    parts=st.lists(st.tuples(st.floats(0, 5), st.floats(1, 50)), min_size=1, max_size=5),
    which=st.integers(0, 4),
    increase=st.floats(0, 5),
)
def test_nor_does_a_larger_part(parts, which, increase):
    before = [Part(*sd_and_dof) for sd_and_dof in parts]
    after = list(before)
    enlarged = after[which % len(after)]
    after[which % len(after)] = Part(enlarged.sd + increase, enlarged.dof)
    assert combined_half_width(after, 0.95) >= combined_half_width(before, 0.95) * (1 - 1e-12)


def test_curvature_is_no_noise_with_a_long_memory():
    """A stress as depth^1.3 under white noise: the bend has its own error, the noise stays small."""
    random = np.random.default_rng(4)
    depth = np.linspace(0.5, 8.0, 750)
    noise = random.normal(0, 0.005, (2, depth.size))
    stress = np.stack([0.3 * depth, 0.3 * depth * (depth / 5) ** 0.3]) + noise
    slope = fit_slope(depth, stress, np.zeros((1, 2)), np.ones((1, 2)))
    assert slope.curvature[0] == 0
    assert slope.curvature[1] == pytest.approx(
        abs(slope.nonlinear_ratio[1]) * 0.3 / 3**0.5, rel=0.1
    )
    noise_se = np.sqrt(slope.se**2 - slope.curvature**2)
    assert noise_se[1] < 0.2 * slope.curvature[1]
    # stress at 5 cm lies within the interval of the line there
    lo, hi = slope.interval(0.95)
    assert lo[1] < 0.3 < hi[1]


def drawn_groups(seed, a, b, cells):
    """Repeats in beds that differ by sd^2 = a^2 + (b alpha)^2, one a each for z and x."""
    random = np.random.default_rng(seed)
    groups = []
    for constant_sd in a:
        levels = random.uniform(0.02, 0.5, cells)
        group = []
        for level, runs in zip(levels, random.integers(2, 5, cells), strict=True):
            sd = math.hypot(constant_sd, b * level, 0.002)
            group.append((level + sd * random.standard_normal(runs), np.full(runs, 0.002)))
        groups.append(group)
    return groups


def test_spread_of_beds_is_the_most_likely_one():
    """Against the likelihood of the sample variances (chi squared), by another optimiser."""
    groups = drawn_groups(4, (0.006, 0.012), 0.08, 40)
    spreads = spread_of_beds(groups)

    def unlikely(logs):
        *squares, slope = np.exp(logs)
        total = 0.0
        for group, square in zip(groups, squares, strict=True):
            for alpha, se in group:
                dof, s2 = alpha.size - 1, alpha.var(ddof=1)
                level = max(alpha.mean() ** 2 - s2 / alpha.size, 0.0)
                variance = float(np.mean(se**2)) + square + slope * level
                total += dof / 2 * (math.log(variance) + s2 / variance)
        return total

    start = np.log([0.006**2, 0.012**2, 0.08**2])
    best = np.exp(minimize(unlikely, start, method="Nelder-Mead", tol=1e-10).x)
    for place, spread in enumerate(spreads):
        np.testing.assert_allclose(spread.size, [best[place], best[-1]], rtol=2e-3)
        assert spread.source == REPEATS
        assert spread.repeats == sum(alpha.size - 1 for alpha, _ in groups[place])
        for level, most_dof in ((0.3, spread.repeats), (0.02, None)):
            terms = np.array([1.0, level**2])
            variance = float(terms @ spread.size)
            own_dof = 2 * variance**2 / float(terms @ spread.covariance @ terms)
            bed_error = spread.error_at(level)
            assert bed_error.sd == pytest.approx(math.sqrt(variance))
            # no more than the repeats have
            assert bed_error.dof == pytest.approx(most_dof or own_dof)
            assert (own_dof > spread.repeats) == (most_dof is not None)


def test_fewer_than_five_degrees_of_freedom_do_not_speak_for_all_cells():
    five, six = ([[(np.linspace(0.2, 0.3, runs), np.full(runs, 0.001))]] * 2 for runs in (5, 6))
    assert {spread.source for spread in spread_of_beds(five)} == {FEW_REPEATS}
    assert {spread.source for spread in spread_of_beds([[], []])} == {ASSUMED}
    assert {spread.source for spread in spread_of_beds(six)} == {REPEATS}
    for spread in spread_of_beds(five, (0.003, 0.1)):
        assert spread.source == STATED
        assert spread.error_at(0.4).sd == pytest.approx(math.hypot(0.003, 0.04))
    assert spread_of_beds(five, (0.0, 0.0))[0].error_at(0.4).sd == 0
    assert spread_of_beds([[], []])[0].error_at(0.4).sd == pytest.approx(0.02)


def test_few_repeats_moderate_what_is_assumed():
    """By hand: one bed of z and x, its squares relative to 5 % of alpha and the noise, beside the assumed two."""
    z, x = np.array([0.20, 0.24]), np.array([0.01, 0.02])
    pair = [(z, np.full(2, 0.004))], [(x, np.full(2, 0.003))]
    # x is weak: 5 % of a fifth of the largest alpha
    squares = 0.0008 / ((0.05 * 0.22) ** 2 + 0.004**2) + 0.00005 / ((0.01 * 0.22) ** 2 + 0.003**2)
    for single in spread_of_beds(pair):
        bed_error = single.error_at(0.3)
        assert bed_error.sd == pytest.approx(0.015 * math.sqrt((ASSUMED_DOF + squares / 2) / 3))
        assert (bed_error.dof, single.source) == (3, FEW_REPEATS)
    # x was not measured: its want is no reason to leave z
    (alone, _) = spread_of_beds([pair[0], []])
    assert alone.error_at(0.3).sd > bed_error.sd
    # repeats that agree make it smaller, though not as small as they are
    agreeing = spread_of_beds([[(np.full(2, 0.3), np.full(2, 0.001))] * 4] * 2)[0].error_at(0.3)
    assert agreeing.sd == pytest.approx(0.015 * math.sqrt(2 / 6))
    assert agreeing.dof == 6
    noise, share = Part(0.001, 12), np.array([0.5, 0.5])
    mean_errors = bed_of_mean(z, share, noise, single)
    assert (mean_errors[0], mean_errors[1].dof, mean_errors[2]) == (noise, 3, FEW_REPEATS)
    assert mean_errors[1].sd == pytest.approx(single.error_at(0.22).sd / math.sqrt(2))


def test_repeats_of_a_bed_as_prepared_count_in_their_cell_alone():
    share, noise = np.array([0.5, 0.5]), Part(0.001, 12)
    apart = bed_of_mean(np.array([0.2, 0.4]), share, noise, ONE_BED)
    # the usual spread counts for two degrees of freedom, where two runs have one
    assert (apart[0].sd, apart[1].dof, apart[2]) == (0, ASSUMED_DOF, OF_CELL)
    assert apart[1].sd == pytest.approx(0.1)
    none = bed_of_mean(np.array([0.3, 0.3]), share, noise, ONE_BED)
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
