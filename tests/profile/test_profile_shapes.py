"""The map of a medium from few pushes has the right mean, intervals and symmetry, or is refused.

Map: alpha in all directions, estimated from few pushes and from the shapes of known media.
"""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from paper import few_draws
from seeds import seeds

import rftfit
from rftfit import Shapes, TableProfile, find_peaks, published_shapes
from rftfit.forces.plane import force_draws

NOT_ALIKE = 0.03
"""Chance below which a medium is told to be of no known shape."""
MEDIA = tuple(published_shapes().profiles)
CELLS = np.stack(TableProfile.published("poppy_LP").cells[:2])
NODES = CELLS[:, CELLS[0] > np.radians(-89)]
"""Directions of the published grid, the first nodes of a map: a plate at -90 degrees is that at 90."""
COUNT = NODES.shape[1]
BETA, GAMMA = np.degrees(NODES)


def truth(medium):
    """Published alpha of a medium at all directions, shape (2, n)."""
    return np.stack(TableProfile.published(medium).alpha(*NODES))


def node(beta_deg, gamma_deg):
    """Place of a direction in the grid."""
    return int(np.argmin(np.hypot(BETA - beta_deg, GAMMA - gamma_deg)))


def pushes_of(beta_deg, gamma_deg, alpha, se=np.nan):
    """Table of pushes; `alpha`, `se`: shape (2, n), or one error of all."""
    angles = {"beta_deg": beta_deg, "gamma_deg": gamma_deg}
    return pd.DataFrame(
        angles
        | dict(zip(["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"], np.array(alpha, float), strict=True))
        | dict(zip(["se_z", "se_x"], np.broadcast_to(se, np.shape(alpha)), strict=True))
    )


def pushed(medium, places, se=0.005, alpha=None):
    """Pushes in the directions of these places: into a published medium, or one with `alpha` at all nodes."""
    alpha = truth(medium) if alpha is None else alpha
    return pushes_of(BETA[places], GAMMA[places], alpha[:, places], se)


LINES = pd.DataFrame({"beta_deg": BETA, "gamma_deg": GAMMA, "place": range(COUNT)})
"""All directions and the place of each."""
FEW = [node(0, 90), node(30, 56), node(-30, 72), node(60, 18), node(90, 45), node(0, 34)]
"""Places of six of them."""


def test_covariance_has_the_symmetry_of_alpha():
    random = np.random.default_rng(1)
    beta, gamma = random.uniform(-1.5, 1.5, 12), random.uniform(-3, 3, 12)
    both = np.concatenate([beta, -beta]), np.concatenate([gamma, np.pi - gamma])
    mean, covariance = published_shapes().moments(*both)
    mean = mean.reshape(2, 2, 12)  # component, direction or image
    assert_allclose(mean[0, 0], mean[0, 1], atol=1e-12)
    assert_allclose(mean[1, 0], -mean[1, 1], atol=1e-12)
    parts = covariance.reshape(2, 2, 12, 2, 2, 12)
    assert_allclose(parts[0, 0, :, 0, 0], parts[0, 1, :, 0, 0], atol=1e-12)
    assert_allclose(parts[1, 0, :, 1, 0], -parts[1, 1, :, 1, 0], atol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9
    # a direction that is its own image: no horizontal force
    _, at_rest = published_shapes().moments(np.zeros(1), np.full(1, np.pi / 2))
    assert at_rest[1, 1] == pytest.approx(0, abs=1e-12)


def _dense(mean, covariance, y, errors, size):
    """Mean and variance at the nodes by the textbook formula, and the logarithm of the likelihood.

    `mean`, `covariance`: of a medium of size 1, at nodes and pushes.
    """
    index = np.arange(mean.size).reshape(2, -1)
    nodes, seen = index[:, :COUNT].ravel(), index[:, COUNT:].ravel()
    free = np.diag(covariance)[seen] > 1e-9
    seen, y = seen[free], y[free]
    middle = size**2 * covariance[np.ix_(seen, seen)] + np.diag(errors[free] ** 2)
    across = size**2 * covariance[np.ix_(nodes, seen)]
    gain = across @ np.linalg.inv(middle)
    off = y - size * mean[seen]
    likelihood = -0.5 * (np.linalg.slogdet(middle)[1] + off @ np.linalg.solve(middle, off))
    variance = size**2 * np.diag(covariance)[nodes] - (gain * across).sum(axis=1)
    return size * mean[nodes] + gain @ off, np.maximum(variance, 0), float(likelihood)


def test_draws_are_of_the_whole_posterior(monkeypatch):
    """Without passivity: mean and covariance, against a sum over fine grids of size, departure and share."""
    monkeypatch.setattr("rftfit.model.energy._CHOSEN.least_work", np.inf)
    monkeypatch.setattr("rftfit.model.shapes.TILT_SHARE", 0.0)
    monkeypatch.setattr("rftfit.model.posterior.DRAWS", 20_000)
    shapes = published_shapes(without=["poppy_LP"])
    for places, off in ((FEW[:3], 0), (FEW[1:], 3)):
        alpha = truth("poppy_LP")[:, places]
        directions = BETA[places] + off, GAMMA[places]
        estimated = rftfit.estimate_map(pushes_of(*directions, alpha, 0.01), shapes)
        sizes = np.exp(np.linspace(np.log(0.005), np.log(4.0), 70))
        parts, weights = [], []
        places_of_all = zip(NODES, np.radians(directions), strict=True)
        prior = shapes.prior(*(np.concatenate(both) for both in places_of_all))
        for departure in np.exp(np.linspace(np.log(0.25), np.log(25), 10)):
            before = 3.5 / departure + 2.5 * np.log(departure)
            for share in np.linspace(0.1, 0.6, 3):
                covariance = departure * prior.covariance(share)
                for size in sizes:
                    *moments, likelihood = _dense(
                        prior.mean, covariance, alpha.ravel(), np.full(alpha.size, 0.01), size
                    )
                    parts.append(moments)
                    weights.append(likelihood - before)
        weight = np.exp(np.array(weights) - max(weights))
        weight /= weight.sum()
        means, variances = (np.stack(values) for values in zip(*parts, strict=True))
        best = weight @ means
        deviation = np.sqrt(weight @ (variances + (means - best) ** 2))
        draws = estimated.draws[..., :COUNT]
        is_estimated = ~np.tile(estimated.measured[:COUNT], 2) & (deviation > 1e-6)
        ours, wide = draws.mean(axis=0).ravel(), draws.std(axis=0).ravel()
        np.testing.assert_array_less(
            np.abs(ours - best)[is_estimated], 0.05 * deviation[is_estimated]
        )
        assert_allclose(wide[is_estimated], deviation[is_estimated], rtol=0.05)


@few_draws()
@pytest.mark.parametrize(
    ("switch", "numbers"),
    [("likelihood._CHOSEN.few_numbers", 0), ("prior._CHOSEN.many_numbers", 2)],
)
def test_a_map_does_not_depend_on_the_routine_that_decomposes_a_covariance(
    monkeypatch, switch, numbers
):
    pushes = pushed("poppy_LP", [*range(0, COUNT, 3)], 0.02)
    maps = [rftfit.estimate_map(pushes)]
    monkeypatch.setattr(f"rftfit.model.{switch}", numbers)
    maps.append(rftfit.estimate_map(pushes))
    assert_allclose(maps[0].alpha, maps[1].alpha, rtol=1e-6, atol=1e-9)
    assert_allclose(maps[0].distance, maps[1].distance, rtol=1e-6)
    assert_allclose(maps[0].factor, maps[1].factor, atol=1e-6 * np.abs(maps[0].factor).max())
    apart = [
        abs(of_map.farthest.measured - of_map.farthest.expected) / of_map.farthest.error
        for of_map in maps
        if of_map.farthest
    ]
    assert apart[0] == pytest.approx(apart[1], rel=1e-6)


def root_of(covariance):
    """Rows by which independent normal numbers become numbers of this covariance."""
    variances, axes = np.linalg.eigh(covariance)
    return (axes * np.sqrt(np.maximum(variances, 0))).T


def work_of(alpha):
    """Energy that a medium takes at the nodes, of alpha of shape (..., 2, n)."""
    return alpha[..., 0, :] * np.sin(NODES[1]) + alpha[..., 1, :] * np.cos(NODES[1])


@pytest.mark.statistics
def test_media_take_energy_because_that_is_known_beforehand():
    """Against media drawn from all that is known beforehand, weighted by how well they explain two pushes.

    And by the tilt towards media that take as little energy as the mean of the known ones.
    """
    shapes, random = published_shapes(without=["poppy_LP"]), np.random.default_rng(5)
    places = [FEW[0], FEW[3]]
    measured = truth("poppy_LP")[:, places]
    estimated = rftfit.estimate_map(pushed("poppy_LP", places, 0.02), shapes)
    prior, many = shapes.prior(*NODES), seeds(400_000, 160_000)
    variation = shapes.variation
    values = []
    roots = [root_of(blocks.whole()) for blocks in (prior.smooth, prior.rough)]
    for _ in range(many // 4000):
        share = random.uniform(0, variation.most_rough, (4000, 1))
        departure = 3.5 / random.gamma(2.5, size=(4000, 1))
        size = np.exp(random.uniform(np.log(0.05), np.log(0.4), (4000, 1)))
        normal = [
            random.standard_normal((4000, len(rows))) @ rows for rows in (prior.between, *roots)
        ]
        moved = normal[0] + np.sqrt(1 - share) * normal[1] + np.sqrt(share) * normal[2]
        alpha = (size * (prior.mean + np.sqrt(departure) * moved)).reshape(-1, 2, COUNT)
        takes = -0.02 * np.abs(alpha).max(axis=(1, 2)) <= work_of(alpha).T
        takes[places] = True
        alpha = alpha[takes.all(axis=0)]
        off = (alpha[..., places] - measured) / 0.02
        off[:, 1, 0] = 0  # straight down alpha_x is 0 in every medium
        chance = np.exp(-0.5 * (off**2).sum(axis=(1, 2)))
        down = alpha[:, 0, node(0, 90)]
        effort = work_of(alpha).mean(axis=-1) / np.where(down > 0, down, 1)
        chance *= np.where(down > 0, np.exp(-shapes.tilt * effort), 0)
        values.append((chance, alpha))
    weight = np.concatenate([batch_chance for batch_chance, _ in values])
    alpha = np.concatenate([batch_alpha for _, batch_alpha in values])
    weight /= weight.sum()
    assert 1 / (weight**2).sum() > seeds(300, 100)
    best = np.tensordot(weight, alpha, axes=1)
    deviation = np.sqrt(np.tensordot(weight, (alpha - best) ** 2, axes=1))
    draws, is_free = (
        estimated.draws[..., :COUNT],
        ~estimated.measured[:COUNT] & (deviation[1] > 1e-6),
    )
    off = ((draws.mean(axis=0) - best) / deviation)[:, is_free]
    assert np.abs(off).max() < seeds(0.25, 0.4)
    ratio = (draws.std(axis=0) / deviation)[:, is_free]
    assert ratio.mean() == pytest.approx(1, abs=seeds(0.04, 0.07))


@pytest.mark.statistics
@settings(max_examples=seeds(8, 4))
@given(st.integers(1, 30), st.sampled_from(MEDIA), st.integers(0, 2**31))
@few_draws()
def test_a_number_is_the_mean_of_its_draws(count, medium, seed):
    """Of alpha, zeta and the force on a leg; the bands are quantiles of the same draws."""
    places = [*np.random.default_rng(seed).choice(COUNT, count, replace=False)]
    try:
        estimated = rftfit.estimate_map(pushed(medium, places, se=0.01))
    except ValueError:  # no push that tells of the medium, or no medium like it
        return
    assert_allclose(estimated.alpha, estimated.draws.mean(axis=0), atol=1e-12)
    # the five terms of alpha_z straight down
    zeta = estimated.coefficients(estimated.draws)[:, :5].sum(axis=-1)
    assert_allclose(estimated.zeta, [zeta.mean(), *np.quantile(zeta, [0.025, 0.975])], rtol=1e-9)
    leg, spread = rftfit.model_leg("c_leg"), estimated.profile.spread
    assert isinstance(spread, TableProfile)
    table, many = (
        rftfit.predict(estimated.profile, leg),
        force_draws(spread, leg, rftfit.rotation().poses),
    )
    for name, forces in (("force_z", many.force_z_N), ("force_x", many.force_x_N)):
        ends = np.quantile(forces, [0.025, 0.975], axis=0)
        for end, expected in zip(("", "_lo", "_hi"), (forces.mean(axis=0), *ends), strict=True):
            assert_allclose(table[f"{name}{end}_N"], expected, atol=1e-9)
    for peak in find_peaks(estimated.profile, leg)[:3]:
        peak_draws = getattr(many, peak.quantity)
        sign = -1 if peak.name in ("suction", "drag") else 1
        top = (sign * peak_draws.mean(axis=0)).max()
        tops = (sign * peak_draws).max(axis=1)
        ends = np.maximum(np.quantile(tops + top - tops.mean(), [0.025, 0.975]), 0)
        expected = [sign * top, *sorted(sign * ends)]
        if peak.withheld:
            expected[1:] = [np.nan, np.nan]
        assert_allclose([peak.value, peak.lo, peak.hi], expected, atol=1e-9)
    assert estimated.draws[:, :, ~estimated.measured].std(axis=0)[0].min() > 0


def test_a_pushed_direction_keeps_its_number_and_its_error():
    estimated = rftfit.estimate_map(pushed("poppy_LP", FEW, se=0.02))
    assert_allclose(estimated.alpha[:, FEW], truth("poppy_LP")[:, FEW], atol=1e-15)
    assert estimated.measured[FEW].all()
    assert_allclose(estimated.draws.std(axis=0)[0, FEW], 0.02, rtol=0.1)
    table = estimated.table()
    assert set(table.loc[table["source"] == "measured", "beta_deg"].round()) == {0, 30, -30, 60, 90}
    # the mirror image of a push straight down is a push straight down
    assert estimated.measured[node(30, 90)] == estimated.measured[node(-30, 90)]


def test_every_direction_pushed_is_the_table_on_its_lines():
    pushes, shapes = pushed("poppy_CP", [*range(COUNT)]), published_shapes(without=["poppy_CP"])
    estimated = rftfit.estimate_map(pushes, shapes)
    assert_allclose(estimated.alpha[:, :COUNT], truth("poppy_CP"), atol=1e-12)
    assert estimated.measured[:COUNT].all()
    angles = np.random.default_rng(2).uniform(-3, 3, (2, 50)) * [[1], [4 / 3]]
    table = TableProfile.published("poppy_CP").alpha(*angles)
    # between the lines the map has a course, with an error there
    assert np.abs(estimated.profile.alpha(*angles)[0] - table[0]).max() > 0.02
    assert estimated.draws[:, 0, COUNT:].std(axis=0).max() > 0.02


LEFT_OUT = [(medium, case) for case in ("material", "medium") for medium in MEDIA]


@pytest.mark.statistics
@pytest.mark.parametrize(("medium", "case"), seeds(LEFT_OUT, LEFT_OUT[:2]))
def test_media_that_were_left_out(medium, case):
    """Errors over 182 values, % of the largest, no worse than twice the trials' mean; intervals hold."""
    left_out = [m for m in MEDIA if m == medium or (case == "material" and m[:5] == medium[:5])]
    shapes = published_shapes(without=left_out)
    alpha = truth(medium)
    for count, most in ((1, 11), (6, 7), (COUNT, 0.1)):
        places = FEW[:count] if count <= 6 else list(range(COUNT))
        estimated = rftfit.estimate_map(pushed(medium, places), shapes)
        off = estimated.alpha[:, :COUNT] - alpha
        assert 100 * np.sqrt(np.mean(off**2)) / np.abs(alpha).max() < most
        table = estimated.table().merge(LINES, on=["beta_deg", "gamma_deg"]).sort_values("place")
        assert len(table) == COUNT
        lo, hi = (
            table[[f"alpha_{c}_{e}_N_per_cm3" for c in "zx"]].to_numpy().T for e in ("lo", "hi")
        )
        free = hi > lo
        assert np.mean(((lo <= alpha) & (alpha <= hi))[free]) >= 0.85
        assert estimated.belongs > NOT_ALIKE or count == 1
        # the estimate takes energy in every direction, to rounding
        work = estimated.work() / np.abs(alpha).max()
        assert work[:COUNT].min() > -0.01
        # between pushes that take none (poppy_CP at (30, -45) degrees: -0.0002 of the largest alpha) the course
        # would give back 0.025, and draws are let through down to 0.02: their mean may lie below 0 by as much
        assert work[COUNT:].min() > -0.02
        least = -0.021 * np.abs(estimated.draws[..., :COUNT]).max(axis=(1, 2))
        takes = estimated.work(estimated.draws) >= least[:, None]
        assert takes[:, :COUNT][:, ~estimated.measured[:COUNT]].all()
        # between the lines too, but beside pushes that give energy back
        assert takes[:, COUNT:].mean() > 0.98


@few_draws()
def test_a_rougher_medium_widens_its_own_intervals():
    """The same directions with the same errors, of a medium of the known shape and of one far from it."""
    places = [*np.random.default_rng(5).permutation(COUNT)[:24]]
    largest, widths = np.abs(truth("poppy_LP")).max(), []
    for percent in (0, 2, 4):
        alpha = truth("poppy_LP")
        noise = np.random.default_rng(6).standard_normal((2, 24))
        alpha[:, places] += percent / 100 * largest * noise
        estimated = rftfit.estimate_map(pushed("", places, alpha=alpha))
        free = ~estimated.measured
        widths.append(np.sqrt(estimated.draws.var(axis=0)[:, free].mean()))
    assert widths[1] > 1.04 * widths[0]
    assert widths[2] > 1.2 * widths[1]


@pytest.mark.statistics
@few_draws()
def test_a_medium_that_does_not_belong_is_told_so():
    directions_deg = [(-30, 56), (-60, -45), (60, 72), (30, 18), (0, 45), (60, -18)]
    places = [*FEW, *(node(*direction) for direction in directions_deg), *range(2, COUNT, 10)]
    beta, gamma = NODES
    for medium in seeds(MEDIA, MEDIA[:2]):
        alpha = truth(medium)
        depth_only = rftfit.DepthOnlyProfile.of(TableProfile.published(medium)).alpha(beta, gamma)
        isotropic = alpha[0, node(0, 90)] * np.stack([np.sin(gamma), np.cos(gamma)])
        for law_alpha, belongs in (
            (alpha, True),
            (isotropic, False),
            (np.stack(depth_only), False),
            (alpha * [[1], [2]], False),
        ):
            estimated = rftfit.estimate_map(pushed("", places, np.nan, law_alpha))
            assert (estimated.belongs > NOT_ALIKE) == belongs, medium
    # one number tells the size only
    assert np.isnan(rftfit.estimate_map(pushed("poppy_LP", FEW[:1])).belongs)


@few_draws()
def test_the_push_that_does_not_fit_is_named():
    pushes = pushed("poppy_LP", FEW)
    pushes.loc[3, "alpha_z_N_per_cm3"] += 0.2
    farthest = rftfit.estimate_map(pushes).farthest
    assert farthest is not None
    assert (round(farthest.beta_deg), round(farthest.gamma_deg)) == (60, 18)
    assert farthest.component == "z"
    assert farthest.measured - farthest.expected == pytest.approx(0.2, abs=0.06)


def upside_down():
    """A whole grid with z upside down: its own alpha is kept, what lies between takes no energy."""
    angles = np.meshgrid([-45, 0, 45, 75], [-60, -30, 0, 30, 60, 90], indexing="ij")
    beta, gamma = (angle.ravel() for angle in angles)
    z, x = rftfit.scale_by_paper(0.6).profile.alpha(np.radians(beta), np.radians(gamma))
    se = 0.01 * np.abs([z, x]) + 0.002
    return pushes_of(beta, gamma, [-z, x], se)


HOLED = np.where(np.arange(91) == 29, np.nan, 0.3).reshape(7, 13)
POPPY = TableProfile.published("poppy_LP")


@few_draws()
@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Shapes({"one": POPPY}), "at least two known media"),
        (lambda: Shapes({"one": POPPY, "holed": TableProfile(HOLED, HOLED)}), "holed has"),
        (
            lambda: rftfit.estimate_map(upside_down()),
            "would push the plate along .*: check the signs",
        ),
    ],
)
def test_what_cannot_be_estimated_says_why(make, match):
    with pytest.raises(ValueError, match=match):
        make()


@few_draws()
def test_an_upright_plate_is_one_under_both_of_its_angles():
    """Pushed once as 90 and once as -90 deg, each with an error of 0.01: their mean, with 0.01 / sqrt(2)."""
    alpha = [[0.30, 0.119, 0.121], [0.0, 0.229, 0.231]]
    twice = pushes_of([0, 90, -90], [90, 45, 45], alpha, 0.01)
    errors = [[0.01, 0.01 / np.sqrt(2)]] * 2
    once = pushes_of([0, -90], [90, 45], [[0.30, 0.12], [0.0, 0.23]], errors)
    of_twice, of_once = map(rftfit.estimate_map, (twice, once))
    assert (of_twice.pushes, of_once.pushes) == (3, 2)
    assert_allclose(of_twice.draws, of_once.draws, atol=1e-9)


@few_draws()
def test_errors_that_nobody_stated():
    """5 % of alpha, beside 1 % of the largest alpha."""
    se = [[0.01, np.nan], [np.nan, 0.02]]
    given = rftfit.estimate_map(pushes_of([0, 30], [90, 45], [[0.3, 0.2], [0, 0.1]], se)).given
    assert given is not None
    errors = np.sqrt(np.diag(given.covariance))[[0, 1, 3]]
    assert_allclose(errors, [0.01, np.hypot(0.05 * 0.2, 0.01 * 0.3), 0.02])


@few_draws()
def test_pushes_without_a_horizontal_component_can_belong():
    pushes = pushed("poppy_LP", FEW)
    pushes["alpha_x_N_per_cm3"] = np.nan
    estimated = rftfit.estimate_map(pushes, published_shapes(without=["poppy_LP"]))
    assert np.isnan(estimated.horizontal)
    assert estimated.belongs > NOT_ALIKE
    # and still they need not
    pushes["alpha_z_N_per_cm3"] = 0.3
    assert rftfit.estimate_map(pushes).belongs < NOT_ALIKE
