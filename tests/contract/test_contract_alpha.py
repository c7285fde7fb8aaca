"""Alpha of media: published tables, nine terms, scaling, maps, profiles as files; against formulas by hand."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import rftfit

MEDIA = ("poppy_LP", "poppy_CP", "glass0.3mm_LP", "glass0.3mm_CP", "glass3mm_CP")
TERMS = ("A00", "A10", "B11", "B01", "Bm1", "C11", "C01", "Cm1", "D10")
SHAPES_OF_TABLES = {
    "table_s1": (5, 8),
    "table_s2": (60, 3),
    "table_s3": (15, 3),
    "table_s4": (10, 4),
    "table_s5": (455, 5),
    "fig_s5": (3861, 5),
    "fig_s11": (903, 3),
    "fig_s12": (2331, 5),
    "fig_4c": (49, 3),
    "discrepancies": (5, 5),
}
ONE_PUSH = pd.DataFrame({"beta_deg": [0.0], "gamma_deg": [90.0], "alpha_z_N_per_cm3": [0.9]})
SOME_PUSHES = pd.DataFrame(
    {
        "beta_deg": [0.0, 0.0, 30.0],
        "gamma_deg": [90.0, 45.0, 45.0],
        "alpha_z_N_per_cm3": [0.4, 0.3, 0.35],
        "alpha_x_N_per_cm3": [0.0, 0.15, 0.2],
    }
)


def nine_terms(coefficients, beta, gamma):
    """Alpha_z and alpha_x of Li, Zhang and Goldman (2013), equation S1, written out."""
    a00, a10, b11, b01, bm1, c11, c01, cm1, d10 = coefficients
    alpha_z = a00 + a10 * np.cos(2 * beta) + b11 * np.sin(2 * beta + gamma)
    alpha_z += b01 * np.sin(gamma) + bm1 * np.sin(gamma - 2 * beta)
    alpha_x = c11 * np.cos(2 * beta + gamma) + c01 * np.cos(gamma)
    alpha_x += cm1 * np.cos(gamma - 2 * beta) + d10 * np.sin(2 * beta)
    return alpha_z, alpha_x


def printed(medium):
    table = rftfit.published_table("table_s2")
    rows = table[table["medium"] == medium]
    return rows.set_index("coefficient")["value"].reindex(list(TERMS)).to_numpy()


@pytest.mark.parametrize("name", SHAPES_OF_TABLES)
def test_a_published_table(name):
    table = rftfit.published_table(name)
    assert table.shape == SHAPES_OF_TABLES[name]
    # a copy of its own
    table[table.columns[0]] = ""
    assert (rftfit.published_table(name).iloc[:, 0] != "").all()


def test_a_table_that_is_not_published():
    with pytest.raises(KeyError):
        rftfit.published_table("table_s6")


@pytest.mark.parametrize("medium", MEDIA)
def test_a_published_medium_has_the_printed_alpha(medium):
    profile = rftfit.published_medium(medium)
    rows = rftfit.published_table("table_s5").query("medium == @medium and abs(gamma_deg) < 90")
    alpha = profile.alpha(np.radians(rows["beta_deg"]), np.radians(rows["gamma_deg"]))
    angles_are_exact = 2e-5  # gamma is printed in thousandths of a degree
    assert_allclose(alpha[0], rows["alpha_z_N_per_cm3"], atol=angles_are_exact)
    assert_allclose(alpha[1], rows["alpha_x_N_per_cm3"], atol=angles_are_exact)
    assert isinstance(profile, rftfit.TableProfile)
    assert isinstance(profile, rftfit.Profile)


@pytest.mark.parametrize("medium", MEDIA)
def test_nine_terms_of_a_published_medium(medium):
    beta, gamma = np.meshgrid(np.linspace(-1.5, 1.5, 7), np.linspace(-1.5, 1.5, 9))
    profile = rftfit.published_medium(medium, "fourier")
    assert isinstance(profile, rftfit.FourierProfile)
    assert_allclose(
        profile.alpha(beta, gamma), nine_terms(printed(medium), beta, gamma), atol=1e-12
    )


@pytest.mark.parametrize("medium", MEDIA)
def test_depth_alone(medium):
    table: Any = rftfit.published_medium(medium)
    baseline: Any = rftfit.DepthOnlyProfile.of(table)
    down, up, forward = (
        table.alpha(0.0, math.pi / 2)[0],
        table.alpha(0.0, -math.pi / 2)[0],
        table.alpha(math.pi / 2, 0.0)[1],
    )
    beta: Any = 0.4
    assert_allclose(baseline.alpha(beta, math.pi / 2), [down * math.cos(beta), 0], atol=1e-12)
    assert_allclose(baseline.alpha(beta, -math.pi / 2), [up * math.cos(beta), 0], atol=1e-12)
    assert_allclose(baseline.alpha(beta, 0.0), [0, forward * math.sin(beta)], atol=1e-12)


def test_nine_coefficients_and_three_values_are_wanted():
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.FourierProfile(np.zeros(8))
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.DepthOnlyProfile([1.0, 2.0])


@pytest.mark.parametrize("words", [("poppy_lp",), ("poppy_LP", "fourrier")])
def test_a_medium_that_is_not_published(words):
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.published_medium(*words)
    assert caught.value.exit_code == 2
    if len(words) == 1:
        with pytest.raises(rftfit.RftfitError):
            rftfit.TableProfile.published(*words)


def test_the_published_reference():
    reference = rftfit.published_reference()
    assert isinstance(reference, rftfit.Reference)
    assert reference.media == MEDIA
    assert reference.printed
    # chi is the measured over the fitted slope straight down
    for medium, chi in zip(MEDIA, reference.chi, strict=True):
        measured = rftfit.published_medium(medium).alpha(0.0, math.pi / 2)[0]
        fitted = float(measured / chi)
        assert fitted > 0
        stated = rftfit.published_table("table_s3").query("medium == @medium and quantity == 'chi'")
        assert chi == pytest.approx(float(stated["value"].iloc[0]), rel=0.15)
    # generic: fitted alpha_z straight down is 1 in every scaled medium
    for coefficients in reference.scaled:
        assert nine_terms(coefficients, 0.0, math.pi / 2)[0] == pytest.approx(1.0)
    assert_allclose(reference.m0, reference.scaled.mean(axis=0), atol=1e-12)


def test_scaling_by_hand():
    reference = rftfit.published_reference()
    sand = rftfit.scale_by_paper(0.9, 0.02)
    assert isinstance(sand, rftfit.ScaledMedium)
    assert sand.chi == pytest.approx(reference.chi.mean())
    assert sand.zeta == pytest.approx(0.9 / reference.chi.mean())
    assert sand.zeta_lo < sand.zeta < sand.zeta_hi
    assert_allclose(sand.coefficients, sand.zeta * reference.m0)
    by_name = rftfit.scaled_generic(sand.zeta, reference.m0)
    assert_allclose(by_name.coefficients, sand.coefficients)
    assert_allclose(sand.profile.alpha(0.3, 0.7), nine_terms(sand.coefficients, 0.3, 0.7))


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ((-1.0,), ValueError),
        ((0.0,), ValueError),
        ((0.9, -0.1), ValueError),
        (("0.9",), TypeError),
        ((math.nan,), ValueError),
        ((math.inf,), ValueError),
    ],
)
def test_a_test_that_cannot_be_is_not_scaled(words, error):
    with pytest.raises(error):
        rftfit.scale_by_paper(*words)


def test_known_shapes():
    shapes = rftfit.published_shapes(without=["poppy_CP"])
    assert [*shapes.profiles] == [medium for medium in MEDIA if medium != "poppy_CP"]
    two = {name: shapes.profiles[name] for name in MEDIA[2:4]}
    assert [*rftfit.Shapes(two).profiles] == [*MEDIA[2:4]]


def cell_of(table, beta_deg, gamma_deg):
    return np.isclose(table["beta_deg"], beta_deg) & np.isclose(table["gamma_deg"], gamma_deg)


def test_a_map_of_one_push():
    estimated = rftfit.estimate_map(ONE_PUSH)
    assert isinstance(estimated, rftfit.Map)
    assert estimated.pushes == 1
    zeta, low, high = estimated.zeta
    assert 0 < low < zeta < high
    table = estimated.table()
    is_pushed = cell_of(table, 0, 90)
    assert table.loc[is_pushed, "alpha_z_N_per_cm3"].iloc[0] == pytest.approx(0.9, rel=0.15)
    assert [*table.loc[is_pushed, "source"]] == ["measured"]
    assert {*table.loc[~is_pushed, "source"]} == {"estimated"}
    alpha_z, _ = estimated.profile.alpha(0.0, math.pi / 2)
    assert_allclose(alpha_z, table.loc[is_pushed, "alpha_z_N_per_cm3"].iloc[0])


def test_a_map_holds_its_pushes_within_their_errors():
    estimated = rftfit.estimate_map(SOME_PUSHES)
    assert estimated.pushes == 3
    table = estimated.table()
    for row in SOME_PUSHES.to_dict("records"):
        (cell,) = table[cell_of(table, row["beta_deg"], row["gamma_deg"])].to_dict("records")
        for c in "zx":
            low, high = (cell[f"alpha_{c}_{end}_next_N_per_cm3"] for end in ("lo", "hi"))
            assert low <= row[f"alpha_{c}_N_per_cm3"] <= high
    assert (table["alpha_z_lo_N_per_cm3"] <= table["alpha_z_hi_N_per_cm3"]).all()
    assert (table["alpha_z_lo_next_N_per_cm3"] <= table["alpha_z_lo_N_per_cm3"] + 1e-12).all()
    assert 0 <= estimated.belongs <= 1


@pytest.mark.parametrize(
    "pushes",
    [
        ONE_PUSH.assign(alpha_z_N_per_cm3=math.nan),
        ONE_PUSH.iloc[:0],
        ONE_PUSH.assign(alpha_z_N_per_cm3=-0.9),
    ],
)
def test_pushes_that_tell_nothing_give_no_map(pushes):
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.estimate_map(pushes)


def test_a_law_in_space_as_a_table():
    sand = rftfit.rft3d_profile(0.9, friction=0.4, step_deg=5)
    assert_allclose(sand.alpha(0.0, math.pi / 2), [0.9, 0.0], atol=1e-9)
    for wrong in ({"alpha": -1.0}, {"friction": -0.1}, {"step_deg": 7.0}):
        with pytest.raises(ValueError, match=r"\w"):
            rftfit.rft3d_profile(**{"alpha": 0.9, "friction": 0.4} | wrong)


def test_a_slope_is_least_squares_through_zero():
    depth = np.linspace(0.1, 7, 400)
    stress = np.stack([0.35 * depth + 0.02 * np.sin(9 * depth), -0.1 * depth])
    slope = rftfit.fit_slope(depth, stress)
    assert_allclose(slope.alpha, stress @ depth / (depth @ depth), rtol=1e-6)
    low, high = slope.interval(0.95)
    assert (low <= slope.alpha).all()
    assert (slope.alpha <= high).all()
    assert slope.se[1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("depth", "stress"),
    [
        (np.arange(7.0), np.arange(7.0)),
        (np.zeros(20), np.ones(20)),
        (np.arange(20.0), np.full(20, math.nan)),
        (np.arange(20.0), np.arange(19.0)),
        (np.full(20, math.inf), np.ones(20)),
    ],
)
def test_readings_that_give_no_slope(depth, stress):
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.fit_slope(depth, stress)


def test_a_plan_says_what_each_push_brings():
    planned = rftfit.plan("zeta", rig=rftfit.Rig(pairs=True), count=2)
    assert isinstance(planned, rftfit.Plan)
    table = planned.table()
    assert [*table["push"]] == [0, 1, 2]
    assert (np.diff(table["half_width_percent"]) < 0).all()
    on_top = "The model's own error and the scatter of the next bed come on top"
    assert on_top not in planned.summary()
    assert on_top in rftfit.plan(rftfit.model_leg("c_leg"), count=1).summary()
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.plan("zetta")
    assert caught.value.exit_code == 2
