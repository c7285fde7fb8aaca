"""Rotating legs: convergence, an independent integral, the paper's order of legs, its measurements."""

import math
from itertools import pairwise

import numpy as np
import pytest
from paper_grid import BETA, GAMMA, flat
from turning import sweep, sweep_draws

from rftfit import reference
from rftfit.model.fourier import as_array, fit_lsq
from rftfit.model.motion import THETA_DEG, rotation_poses
from rftfit.model.outlines import CURVATURES, arc, model_leg
from rftfit.model.profiles import (
    DepthOnlyProfile,
    FourierProfile,
    Profile,
    TableProfile,
    scaled_generic,
)

GENERIC = as_array(reference.coefficients("generic"))


def table(medium="poppy_LP"):
    return TableProfile.published(medium)


def nine_terms(medium):
    return FourierProfile(fit_lsq(BETA, GAMMA, *flat(reference.alpha_grid(medium))))


def profiles(medium):
    zeta = reference.coefficients(medium)["zeta"]
    return {
        "table": table(medium),
        "nine terms": nine_terms(medium),
        "generic": scaled_generic(zeta, GENERIC),
        "depth-only": DepthOnlyProfile.of(table(medium)),
    }


def peak_lift(profile, leg):
    return float(sweep(profile, model_leg(leg)).force_z_N.max())


def slow_integral(profile, leg, theta):
    """Force z, x and moment on a leg, from its own geometry and scipy's quadrature."""
    from scipy.integrate import quad_vec

    r, hip, width, side = 3.81, 2.0, 2.54, -CURVATURES[leg]

    def point(s):
        """At the part s of the leg's length, leg hanging straight down and then turned by theta."""
        if side:
            x, z = side * r * math.sin(math.pi * s), -r * (1 - math.cos(math.pi * s))
        else:
            x, z = 0.0, -2 * r * s
        c, n = math.cos(theta), math.sin(theta)
        return x * c + z * n, z * c - x * n

    length = math.pi * r if side else 2 * r

    def density(s):
        x, z = point(s)
        if z + hip >= 0:
            return np.zeros(3)
        (x0, z0), (x1, z1) = point(s - 1e-6), point(s + 1e-6)
        beta = math.atan2(z0 - z1, x1 - x0)
        # as theta grows the leg turns clockwise seen with x to the right
        gamma = math.atan2(x, -z)
        alpha_z, alpha_x = (float(alpha) for alpha in profile.alpha(beta, gamma))
        force = -(z + hip) * width * length * np.array([alpha_z, alpha_x])
        return np.array([*force, z * force[1] - x * force[0]])

    return np.asarray(quad_vec(density, 0, 1, epsabs=1e-5, epsrel=1e-6, limit=400)[0])


@pytest.mark.parametrize("leg", reference.LEGS)
@pytest.mark.parametrize("kind", ["table", "nine terms", "depth-only"])
def test_agrees_with_a_slow_integral(kind, leg):
    profile = profiles("poppy_LP")[kind]
    theta = np.radians([-95.0, -70.0, -52.0, -33.0, -11.0, 6.0, 27.0, 49.0, 71.0])
    slow = np.array([slow_integral(profile, leg, angle) for angle in theta])
    whole = sweep(profile, model_leg(leg))
    peaks = [np.abs(c).max() for c in (whole.force_z_N, whole.force_x_N, whole.moment_N_cm)]
    # the depth-only model steps where the motion turns from down to up: elements see it coarsely
    cases = (
        ((3000, 1e-3),)
        if kind == "depth-only"
        else ((120, 1e-3), (30, 2e-2 if kind == "table" else 2e-3))
    )
    for elements, tolerance in cases:
        fast = sweep(profile, model_leg(leg, elements), theta)
        found = np.column_stack([fast.force_z_N, fast.force_x_N, fast.moment_N_cm])
        error = (np.abs(found - slow) / peaks).max()
        print(f"{kind}, {leg}, {elements} elements: {error:.1e} of the peak")
        assert error < tolerance


@pytest.mark.parametrize("leg", reference.LEGS)
@pytest.mark.parametrize("kind", ["table", "nine terms", "generic"])
def test_converges_in_the_number_of_elements(kind, leg):
    profile = profiles("glass3mm_CP")[kind]
    best = sweep(profile, model_leg(leg, 20000)).force_z_N
    errors = [
        np.abs(sweep(profile, model_leg(leg, count)).force_z_N - best).max() / best.max()
        for count in (10, 30, 90, 270, 810)
    ]
    if leg == "flat_leg":  # straight through the axle: angles are the same all along it
        assert max(errors) < 1e-12
        return
    assert all(fine < coarse for coarse, fine in pairwise(errors))
    assert errors[1] < 0.015
    assert errors[3] < 3e-4
    assert errors[4] < errors[0] / 300  # faster than first order


@pytest.mark.parametrize("medium", reference.MEDIA)
def test_what_thirty_elements_leave(medium):
    """The table bends at its nodes: as many newtons on either curved leg, whatever its peak."""
    error, peak, worst = {}, {}, {}
    for leg in ("c_leg", "reversed_c_leg"):
        best = sweep(table(medium), model_leg(leg, 20000)).force_z_N
        off = {
            count: np.abs(sweep(table(medium), model_leg(leg, count)).force_z_N - best)
            for count in (30, 120)
        }
        error[leg], peak[leg] = off[30].max(), best.max()
        assert off[120].max() < 1e-3 * peak[leg]
        worst[leg] = THETA_DEG[off[30].argmax()] % 6
        print(f"{medium}, {leg}: {error[leg]:.3f} N, {error[leg] / peak[leg]:.1e} of the peak")
    assert error["c_leg"] < 4e-3 * peak["c_leg"]
    assert error["reversed_c_leg"] < 2e-2 * peak["reversed_c_leg"]
    assert 0.8 < error["reversed_c_leg"] / error["c_leg"] < 1
    # six degrees an element: all bends in beta lie in the middle of one
    assert worst == {"c_leg": 3, "reversed_c_leg": 3}


@pytest.mark.parametrize("medium", reference.MEDIA)
def test_reversed_leg_lifts_least_by_the_measured_table(medium):
    peaks = [peak_lift(table(medium), leg) for leg in reference.LEGS]
    assert peaks[0] > peaks[1] > peaks[2] > 0


def test_nine_terms_turn_the_order_round():
    profile = nine_terms("poppy_LP")
    assert peak_lift(profile, "reversed_c_leg") > peak_lift(profile, "flat_leg")


@pytest.mark.parametrize("medium", reference.MEDIA)
def test_peaks_beside_the_measured_ones(medium):
    measured = reference.load("fig_s5")
    for leg in reference.LEGS:
        rows = measured[(measured["medium"] == medium) & (measured["leg"] == leg)]
        wanted = float(rows["force_z_N"].max())
        peaks = {name: peak_lift(profile, leg) for name, profile in profiles(medium).items()}
        told = ", ".join(
            f"{name} {peak:.2f} N ({100 * (peak / wanted - 1):+.0f} %)"
            for name, peak in peaks.items()
        )
        print(f"{medium}, {leg}: measured {wanted:.2f} N; {told}")
        if leg == "c_leg":
            # poppy seeds, close packed, are the paper's own exception
            assert abs(peaks["table"] / wanted - 1) < (0.3 if medium == "poppy_CP" else 0.15)
        if leg == "reversed_c_leg":
            assert peaks["depth-only"] > 8 * wanted


@pytest.mark.parametrize("leg", ["c_leg", "flat_leg"])
@pytest.mark.parametrize("medium", reference.MEDIA)
def test_curves_have_the_measured_shape(medium, leg):
    rows = reference.load("fig_s5")
    rows = rows[(rows["medium"] == medium) & (rows["leg"] == leg)]
    theta = np.radians(rows["theta_deg"].to_numpy(float))
    found = sweep(table(medium), model_leg(leg), theta)
    alike = [
        float(np.corrcoef(ours, rows[column])[0, 1])
        for ours, column in ((found.force_z_N, "force_z_N"), (found.force_x_N, "force_x_N"))
    ]
    print(f"{medium}, {leg}: correlation over theta {alike[0]:.3f} (z), {alike[1]:.3f} (x)")
    assert alike[0] > 0.9
    # the c-leg's horizontal force comes some 20 degrees too early in every medium but one
    assert alike[1] > (0.75 if leg == "c_leg" else 0.95)
    swapped = sweep(table(medium), model_leg(leg), -theta, rate_rad_per_s=-0.2)
    assert np.corrcoef(swapped.force_x_N, rows["force_x_N"])[0, 1] < 0


def test_sweep_of_the_mirror_image():
    front = sweep(table(), model_leg("c_leg"))
    back = sweep(table(), model_leg("reversed_c_leg"), np.radians(-THETA_DEG), rate_rad_per_s=-5.0)
    np.testing.assert_allclose(back.force_z_N, front.force_z_N, atol=1e-12)
    np.testing.assert_allclose(back.force_x_N, -front.force_x_N, atol=1e-12)
    np.testing.assert_allclose(back.moment_N_cm, -front.moment_N_cm, atol=1e-11)


def test_double_width_and_double_size():
    once = sweep(table(), model_leg("c_leg"))
    wide = sweep(table(), arc(1.0, width_cm=5.08))
    np.testing.assert_allclose(wide.force_z_N, 2 * once.force_z_N, rtol=1e-13)
    large = sweep(table(), arc(1.0, 15.24, 5.08), hip_height_cm=4.0)
    np.testing.assert_allclose(large.force_x_N, 8 * once.force_x_N, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(large.moment_N_cm, 16 * once.moment_N_cm, rtol=1e-11, atol=1e-12)


def test_a_leg_in_air_feels_nothing():
    forces = sweep(table(), model_leg("flat_leg"), hip_height_cm=7.7)
    assert (forces.force_z_N == 0).all()
    assert (forces.moment_N_cm == 0).all()
    assert rotation_poses([0.1, 0.2]).shape == (2, 6)


@pytest.mark.parametrize("leg", reference.LEGS)
def test_draws_are_what_each_draw_gives(leg):
    random = np.random.default_rng(11)
    shape = (4, 7, 13)
    alpha_z, alpha_x = (a + random.normal(0, 0.01, shape) for a in reference.alpha_grid("poppy_LP"))
    coefficients = GENERIC * random.normal(1, 0.1, (4, 9))
    stack = TableProfile(alpha_z, alpha_x)
    cases: list[tuple[Profile, list[Profile]]] = [
        (stack, [TableProfile(z, x) for z, x in zip(alpha_z, alpha_x, strict=True)]),
        (FourierProfile(coefficients), [FourierProfile(row) for row in coefficients]),
        (
            DepthOnlyProfile.of(stack),
            [DepthOnlyProfile(row) for row in DepthOnlyProfile.of(stack).values],
        ),
    ]
    for together, apart in cases:
        found = sweep_draws(together, model_leg(leg))
        for draw, profile in enumerate(apart):
            wanted = sweep(profile, model_leg(leg))
            np.testing.assert_allclose(found.force_z_N[draw], wanted.force_z_N, atol=1e-11)
            np.testing.assert_allclose(found.force_x_N[draw], wanted.force_x_N, atol=1e-11)
            np.testing.assert_allclose(found.moment_N_cm[draw], wanted.moment_N_cm, atol=1e-10)


def test_missing_cells_spoil_the_same_angles_in_draws():
    alpha_z, alpha_x = np.array(reference.alpha_grid("poppy_LP"))
    alpha_z[4, 9] = alpha_x[4, 9] = np.nan
    profile = TableProfile(alpha_z, alpha_x)
    one = sweep(profile, model_leg("flat_leg"))
    many = sweep_draws(TableProfile(alpha_z[None], alpha_x[None]), model_leg("flat_leg"))
    assert 0 < np.isnan(one.force_z_N).sum() < THETA_DEG.size
    np.testing.assert_array_equal(np.isnan(many.force_z_N[0]), np.isnan(one.force_z_N))
    np.testing.assert_array_equal(np.isnan(many.moment_N_cm[0]), np.isnan(one.moment_N_cm))
    assert one.reason == many.reason != ""
