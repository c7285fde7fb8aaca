"""Alpha over all directions: its symmetry, its scale, and what scaling and maps keep under them."""

import math
from functools import cache

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from seeds import example_count

import rftfit

MEDIA = ("poppy_LP", "poppy_CP", "glass0.3mm_LP", "glass0.3mm_CP", "glass3mm_CP")
SCATTERED = np.random.default_rng(1).uniform(-np.pi / 2, np.pi / 2, (2, 60))
"""Directions on no grid, beta and gamma in rad."""
POPPY = rftfit.published_medium("poppy_LP")
PROFILES = {
    "table": rftfit.published_medium("poppy_CP"),
    "fourier": rftfit.published_medium("glass0.3mm_LP", "fourier"),
    "generic": rftfit.published_medium("glass3mm_CP", "generic"),
    "depth_only": rftfit.published_medium("poppy_LP", "depth_only"),
    "in space": rftfit.rft3d_profile(0.9, 0.4, step_deg=15),
    "scattered": rftfit.TableProfile(*POPPY.alpha(*SCATTERED), *SCATTERED),
}


def printed(medium):
    """Rows of Table S5 of one medium."""
    rows = rftfit.published_table("table_s5")
    return rows[rows["medium"] == medium]


pytestmark = pytest.mark.statistics
law = settings(max_examples=example_count(80), derandomize=True)
slow_law = settings(max_examples=example_count(8), derandomize=True)
angles = st.floats(-1.5, 1.5)
factors = st.floats(0.05, 20)
nine = st.lists(st.floats(-1, 1), min_size=9, max_size=9).map(np.array)
PUSHES = pd.DataFrame(
    {
        "beta_deg": [0.0, 0.0, 30.0, -30.0],
        "gamma_deg": [90.0, 45.0, 45.0, 60.0],
        "alpha_z_N_per_cm3": [0.4, 0.3, 0.35, 0.2],
        "alpha_x_N_per_cm3": [0.01, 0.15, 0.2, 0.05],
    }
)
ALPHA = ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]


@pytest.mark.parametrize("kind", PROFILES)
@law
@given(angles, angles)
def test_a_mirror_image_in_x_turns_alpha_x_round(kind, beta, gamma):
    alpha_z, alpha_x = PROFILES[kind].alpha(beta, gamma)
    mirrored = PROFILES[kind].alpha(-beta, math.pi - gamma)
    assert_allclose(mirrored, [alpha_z, -alpha_x], atol=1e-9)


@pytest.mark.parametrize("kind", PROFILES)
@law
@given(angles, angles)
def test_half_a_turn_of_a_plate_and_a_turn_of_its_way_change_nothing(kind, beta, gamma):
    alpha = PROFILES[kind].alpha(beta, gamma)
    assert_allclose(PROFILES[kind].alpha(beta + math.pi, gamma), alpha, atol=1e-9)
    assert_allclose(PROFILES[kind].alpha(beta, gamma + 2 * math.pi), alpha, atol=1e-9)


@law
@given(nine, nine, factors, angles, angles)
def test_nine_terms_are_linear(first, second, factor, beta, gamma):
    together = rftfit.FourierProfile(first + factor * second).alpha(beta, gamma)
    parts = [rftfit.FourierProfile(terms).alpha(beta, gamma) for terms in (first, second)]
    assert_allclose(together, np.array(parts[0]) + factor * np.array(parts[1]), atol=1e-9)


@law
@given(nine, factors, angles, angles)
def test_generic_is_proportional_to_zeta(m0, zeta, beta, gamma):
    scaled = rftfit.scaled_generic(zeta, m0).alpha(beta, gamma)
    assert_allclose(
        scaled, zeta * np.array(rftfit.FourierProfile(m0).alpha(beta, gamma)), atol=1e-9
    )


@law
@given(st.floats(0.05, 5), st.floats(0.01, 2), angles, angles)
def test_a_law_in_space_is_proportional_to_its_push(alpha, friction, beta, gamma):
    unscaled = rftfit.rft3d_profile(1.0, friction, step_deg=15).alpha(beta, gamma)
    scaled = rftfit.rft3d_profile(alpha, friction, step_deg=15).alpha(beta, gamma)
    assert_allclose(scaled, alpha * np.array(unscaled), atol=1e-9)


@law
@given(st.floats(0.01, 2), st.integers(-6, 6), st.integers(-12, 12))
def test_a_law_in_space_takes_work(friction, beta_steps, gamma_steps):
    beta, gamma = np.radians([15 * beta_steps, 15 * gamma_steps])
    alpha_z, alpha_x = rftfit.rft3d_profile(1.0, friction, step_deg=15).alpha(beta, gamma)
    assert alpha_z * math.sin(gamma) + alpha_x * math.cos(gamma) >= -1e-9


@pytest.mark.parametrize("medium", MEDIA)
def test_a_printed_medium_takes_work(medium):
    """Almost: the printed table gives back at most a twentieth of its largest alpha."""
    rows = printed(medium)
    gamma = np.radians(rows["gamma_deg"])
    work = rows[ALPHA[0]] * np.sin(gamma) + rows[ALPHA[1]] * np.cos(gamma)
    assert work.min() > -0.05 * rows[ALPHA].abs().max(axis=None)


@law
@given(st.floats(0.05, 5), st.floats(0, 0.3), factors)
def test_scaling_is_proportional_to_the_test(alpha, relative_se, factor):
    unscaled = rftfit.scale_by_paper(alpha, relative_se * alpha)
    scaled = rftfit.scale_by_paper(factor * alpha, factor * relative_se * alpha)
    assert scaled.chi == pytest.approx(unscaled.chi)
    for name in ("zeta", "zeta_lo", "zeta_hi"):
        assert getattr(scaled, name) == pytest.approx(factor * getattr(unscaled, name), rel=1e-9)
    assert_allclose(scaled.coefficients, factor * unscaled.coefficients)


@law
@given(st.floats(0.05, 5), st.floats(0.55, 0.8), st.floats(0.81, 0.999))
def test_a_higher_level_is_a_wider_interval(alpha, low_level, high_level):
    narrow, wide = (
        rftfit.scale_by_paper(alpha, 0.05, confidence=level) for level in (low_level, high_level)
    )
    assert wide.zeta_lo < narrow.zeta_lo < narrow.zeta == wide.zeta < narrow.zeta_hi < wide.zeta_hi
    assert wide.chi_lo < narrow.chi_lo < narrow.chi == wide.chi < narrow.chi_hi < wide.chi_hi


@law
@given(st.floats(0.2, 5), st.floats(0.01, 0.1), st.floats(1.5, 5))
def test_a_less_certain_test_is_a_wider_interval(alpha, se, factor):
    sure, unsure = (rftfit.scale_by_paper(alpha, error) for error in (se, factor * se))
    assert unsure.zeta_lo < sure.zeta_lo < sure.zeta_hi < unsure.zeta_hi


@cache
def map_of_pushes():
    return rftfit.estimate_map(PUSHES)


@slow_law
@given(factors)
def test_a_map_is_proportional_to_its_pushes(factor):
    unscaled = map_of_pushes()
    scaled = rftfit.estimate_map(PUSHES.assign(**{name: factor * PUSHES[name] for name in ALPHA}))
    assert_allclose(scaled.zeta, factor * np.array(unscaled.zeta), rtol=1e-6)
    assert_allclose(scaled.table()[ALPHA], factor * unscaled.table()[ALPHA], rtol=1e-6, atol=1e-9)
    # how well the pushes agree is a matter of their shape
    assert scaled.belongs == pytest.approx(unscaled.belongs)


@slow_law
@given(st.permutations(range(len(PUSHES))))
def test_the_order_of_pushes_does_not_matter(order):
    shuffled = rftfit.estimate_map(PUSHES.iloc[order].reset_index(drop=True))
    columns = ["beta_deg", "gamma_deg", *ALPHA]
    expected = map_of_pushes().table()[columns]
    assert_allclose(shuffled.table()[columns], expected, rtol=1e-7, atol=1e-9)


@slow_law
@given(st.floats(0.55, 0.99))
def test_a_map_itself_does_not_depend_on_the_level(level):
    table = rftfit.estimate_map(PUSHES, confidence=level).table()
    assert_allclose(table[ALPHA], map_of_pushes().table()[ALPHA], rtol=1e-9)
    for name in ("alpha_z_{}_N_per_cm3", "alpha_x_{}_N_per_cm3"):
        low, high = (table[name.format(end)] for end in ("lo", "hi"))
        next_low, next_high = (table[name.format(f"{end}_next")] for end in ("lo", "hi"))
        assert (low <= high).all()
        assert (next_low <= low + 1e-9).all()
        assert (high <= next_high + 1e-9).all()


@slow_law
@given(st.sampled_from(MEDIA), factors, st.floats(0, 3), st.floats(4, 12))
def test_a_profile_is_the_same_by_python_and_by_file(tmp_path_factory, medium, factor, low, high):
    cells = printed(medium).pivot_table(index="beta_deg", columns="gamma_deg", values=ALPHA)
    profile = rftfit.TableProfile(*(factor * cells[name].to_numpy() for name in ALPHA))
    folder = tmp_path_factory.mktemp("profile")
    rftfit.write_profile(folder / "a.json", profile, window=(low, high))
    again = rftfit.read_profile(folder / "a.json")
    beta, gamma = np.meshgrid(np.linspace(-1.5, 1.5, 7), np.linspace(-3, 3, 13))
    assert_allclose(
        again.alpha(beta, gamma), profile.alpha(beta, gamma), rtol=1e-5, atol=1e-6 * factor
    )
    assert again.window == pytest.approx((low, high))
    rftfit.write_profile(folder / "b.json", again, window=(low, high))
    first, second = (
        rftfit.read_profile(folder / name).alpha(beta, gamma) for name in ("a.json", "b.json")
    )
    assert_allclose(first, second, rtol=1e-9)


@slow_law
@given(st.integers(1, 3), st.sampled_from(["zeta", "map"]))
def test_a_longer_plan_begins_as_the_shorter_one(count, target):
    short, long = (rftfit.plan(target, count=n).table() for n in (count, count + 1))
    pd.testing.assert_frame_equal(short, long.iloc[: count + 1])
    assert (np.diff(long["half_width_percent"]) <= 1e-9).all()


@slow_law
@given(st.floats(1, 20), st.floats(1.2, 3))
def test_better_pushes_tell_more(error, factor):
    good, bad = (
        rftfit.plan("zeta", rig=rftfit.Rig(error_percent=size), count=1).table()
        for size in (error, factor * error)
    )
    assert good["half_width_percent"].iloc[-1] < bad["half_width_percent"].iloc[-1]


# --- slopes

depths = np.linspace(0.1, 7, 80)
stresses = st.builds(
    lambda alpha, noise, seed: (
        alpha * depths + noise * np.random.default_rng(seed).standard_normal(depths.size)
    ),
    st.floats(-2, 2),
    st.floats(0.001, 0.3),
    st.integers(0, 99),
)


@law
@given(stresses, factors, factors)
def test_a_slope_has_the_units_of_its_readings(stress, of_stress, of_depth):
    unscaled = rftfit.fit_slope(depths, stress)
    scaled = rftfit.fit_slope(of_depth * depths, of_stress * stress)
    assert_allclose(scaled.alpha, unscaled.alpha * of_stress / of_depth, rtol=1e-7, atol=1e-12)
    assert_allclose(scaled.se, unscaled.se * of_stress / of_depth, rtol=1e-6)
    assert_allclose(scaled.dof, unscaled.dof, rtol=1e-6)


@law
@given(stresses, stresses)
def test_each_component_has_its_own_slope(first, second):
    both = rftfit.fit_slope(depths, np.stack([first, -second]))
    alone = [rftfit.fit_slope(depths, stress).alpha[0] for stress in (first, second)]
    assert_allclose(both.alpha, [alone[0], -alone[1]], rtol=1e-9)


@law
@given(stresses, st.floats(0.55, 0.9), st.floats(0.91, 0.999))
def test_intervals_of_a_slope_are_nested(stress, low_level, high_level):
    slope = rftfit.fit_slope(depths, stress)
    (low,), (high,) = slope.interval(low_level)
    (lowest,), (highest,) = slope.interval(high_level)
    assert lowest < low < slope.alpha[0] < high < highest


@law
@given(stresses, stresses)
def test_slopes_add_up(first, second):
    together, *parts = (
        rftfit.fit_slope(depths, stress).alpha for stress in (first + second, first, second)
    )
    assert_allclose(together, parts[0] + parts[1], rtol=1e-7, atol=1e-9)
