"""The map of a few pushes: conditional mean and covariance, limits, symmetry, and media that do not belong."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rftfit
from rftfit.conventions import mirror
from rftfit.errors import InputError
from rftfit.model.profiles import TableProfile
from rftfit.model.shapes import (
    NOT_ALIKE,
    Pushes,
    Shapes,
    estimate,
    grid,
    published_shapes,
    usual_error,
)
from rftfit.reference import MEDIA

NODES = grid()
BETA, GAMMA = np.degrees(NODES)
COUNT = BETA.size
MATERIAL = {"poppy_LP": ("poppy_LP", "poppy_CP"), "glass3mm_CP": MEDIA[2:]}


def truth(medium: str) -> np.ndarray:
    return np.stack(TableProfile.published(medium).alpha(*NODES))


def node(beta_deg: float, gamma_deg: float) -> int:
    return int(np.argmin(np.hypot(BETA - beta_deg, GAMMA - gamma_deg)))


def pushed(medium: str, places: list[int], se: float = 0.005) -> Pushes:
    return Pushes.of(BETA[places], GAMMA[places], truth(medium)[:, places], se)


FEW = [node(0, 90), node(30, 56), node(-30, 72), node(60, 18), node(90, 45), node(0, 34)]


def test_covariance_has_the_symmetry_of_alpha() -> None:
    random = np.random.default_rng(1)
    beta, gamma = random.uniform(-1.5, 1.5, 12), random.uniform(-3, 3, 12)
    image = mirror(beta, gamma)
    both = np.concatenate([beta, image[0]]), np.concatenate([gamma, image[1]])
    mean, covariance = published_shapes().moments(*both)
    mean = mean.reshape(2, 2, 12)  # component, direction or image
    np.testing.assert_allclose(mean[0, 0], mean[0, 1], atol=1e-12)
    np.testing.assert_allclose(mean[1, 0], -mean[1, 1], atol=1e-12)
    parts = covariance.reshape(2, 2, 12, 2, 2, 12)
    np.testing.assert_allclose(parts[0, 0, :, 0, 0], parts[0, 1, :, 0, 0], atol=1e-12)
    np.testing.assert_allclose(parts[1, 0, :, 1, 0], -parts[1, 1, :, 1, 0], atol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9
    # a direction that is its own image: no horizontal force, and no more variance than elsewhere
    _, at_rest = published_shapes().moments(np.zeros(1), np.full(1, np.pi / 2))
    assert at_rest[1, 1] == pytest.approx(0, abs=1e-12)
    by = published_shapes().variation
    z = published_shapes().of_media(np.zeros(1), np.full(1, np.pi / 2))[:, 0]
    between = by.media * z.var(ddof=1) * (1 + 1 / 5)
    assert at_rest[0, 0] == pytest.approx((by.floor + by.share * z.mean()) ** 2 + between)


def test_one_solve_is_the_conditional_distribution() -> None:
    """Given the size: mean and covariance by the textbook formula, dense and slow."""
    shapes, size = published_shapes(without=["poppy_LP"]), 0.13
    places = FEW[1:]
    own = Pushes.of(BETA[places] + 3, GAMMA[places], truth("poppy_LP")[:, places], 0.01)
    found = estimate(own, shapes, size=size)
    beta, gamma = (
        np.concatenate([n, p]) for n, p in zip(NODES, (own.beta, own.gamma), strict=True)
    )
    mean, prior = shapes.moments(beta, gamma)
    index = np.arange(mean.size).reshape(2, -1)
    at, seen = index[:, :COUNT].ravel(), index[:, COUNT:].ravel()
    middle = size**2 * prior[np.ix_(seen, seen)] + 0.01**2 * np.eye(seen.size)
    gain = size**2 * prior[np.ix_(at, seen)] @ np.linalg.inv(middle)
    expected = size * mean[at] + gain @ (own.alpha.ravel() - size * mean[seen])
    covariance = size**2 * prior[np.ix_(at, at)] - gain @ middle @ gain.T
    np.testing.assert_allclose(found.alpha.ravel(), expected, atol=1e-9)
    rows = found.factor.reshape(len(found.factor), -1)
    np.testing.assert_allclose(rows.T @ rows, covariance, atol=1e-8)


def test_the_size_by_its_integral() -> None:
    """Mean and variance over the unknown size, against a sum over a fine grid of sizes."""
    shapes, own = published_shapes(without=["poppy_LP"]), pushed("poppy_LP", FEW[:2])
    found = estimate(own, shapes)
    mean, prior = shapes.moments(own.beta, own.gamma)
    free = np.diag(prior) > 1e-9
    y = own.alpha.ravel()[free]
    sizes = np.exp(np.linspace(np.log(0.01), np.log(2), 4000))
    weights = []
    for size in sizes:
        middle = size**2 * prior[np.ix_(free, free)] + 0.005**2 * np.eye(y.size)
        off = y - size * mean[free]
        weights.append(-0.5 * (np.linalg.slogdet(middle)[1] + off @ np.linalg.solve(middle, off)))
    chance = np.exp(np.array(weights) - max(weights))
    chance /= chance.sum()
    assert found.size == pytest.approx(float(chance @ sizes), rel=0.005)
    each = [estimate(own, shapes, size=size) for size in sizes[::100]]
    part = chance[::100] / chance[::100].sum()
    best = np.tensordot(part, [one.alpha for one in each], axes=1)
    np.testing.assert_allclose(found.alpha, best, atol=0.01 * np.abs(best).max())
    square = [(one.factor**2).sum(axis=0) + (one.alpha - best) ** 2 for one in each]
    spread = np.sqrt(np.tensordot(part, square, axes=1))
    np.testing.assert_allclose(
        np.sqrt((found.factor**2).sum(axis=0)), spread, atol=0.03 * spread.max()
    )


def test_a_pushed_direction_keeps_its_number_and_its_error() -> None:
    found = estimate(pushed("poppy_LP", FEW, se=0.02))
    np.testing.assert_allclose(found.alpha[:, FEW], truth("poppy_LP")[:, FEW], atol=1e-15)
    assert found.measured[FEW].all()
    deviation = np.sqrt((found.factor**2).sum(axis=0))[0, FEW]
    np.testing.assert_allclose(deviation, 0.02)
    table = found.table()
    assert set(table.loc[table["source"] == "measured", "beta_deg"].round()) == {0, 30, -30, 60, 90}
    # the mirror image of a push straight down is a push straight down
    assert found.measured[node(30, 90)] == found.measured[node(-30, 90)]


def test_every_direction_pushed_is_the_table() -> None:
    found = estimate(pushed("poppy_CP", list(range(COUNT))), published_shapes(without=["poppy_CP"]))
    np.testing.assert_allclose(found.alpha, truth("poppy_CP"), atol=1e-12)
    random = np.random.default_rng(2)
    beta, gamma = random.uniform(-3, 3, 50), random.uniform(-4, 4, 50)
    ours, table = (
        found.profile.alpha(beta, gamma),
        TableProfile.published("poppy_CP").alpha(beta, gamma),
    )
    np.testing.assert_allclose(ours, table, atol=1e-12)


@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("case", ["medium", "material"])
def test_media_that_were_left_out(medium: str, case: str) -> None:
    """Errors over 182 values, % of the largest, no worse than twice the trials' mean; intervals hold."""
    left_out = [m for m in MEDIA if m == medium or (case == "material" and m[:5] == medium[:5])]
    shapes = published_shapes(without=left_out)
    alpha = truth(medium)
    for count, most in ((1, 11), (6, 7), (COUNT, 0.1)):
        places = FEW[:count] if count <= 6 else list(range(COUNT))
        found = estimate(pushed(medium, places), shapes)
        assert 100 * np.sqrt(np.mean((found.alpha - alpha) ** 2)) / np.abs(alpha).max() < most
        table = found.table()
        lo, hi = (
            table[[f"alpha_{c}_{e}_N_per_cm3" for c in "zx"]].to_numpy().T for e in ("lo", "hi")
        )
        free = hi > lo
        assert np.mean(((lo <= alpha) & (alpha <= hi))[free]) >= 0.85
        assert found.belongs > NOT_ALIKE or count == 1
        # the estimate takes energy in every direction, to rounding
        assert found.work().min() > -0.01 * np.abs(alpha).max()
        assert (found.work(found.draws)[:, ~found.measured] >= -0.02 * np.abs(alpha).max()).all()


def test_order_of_rows_and_ignorance_change_nothing() -> None:
    rows = pd.DataFrame(
        {
            "beta_deg": BETA[FEW], "gamma_deg": GAMMA[FEW],
            "alpha_z_N_per_cm3": truth("poppy_LP")[0, FEW], "alpha_x_N_per_cm3": truth("poppy_LP")[1, FEW],
            "alpha_z_se_N_per_cm3": 0.01, "alpha_x_se_N_per_cm3": 0.01,
        }
    )  # fmt: skip
    one, other = (rftfit.estimate_map(table) for table in (rows, rows.iloc[::-1]))
    np.testing.assert_array_equal(one.alpha, other.alpha)
    np.testing.assert_array_equal(one.draws, other.draws)
    # pushes of which nothing is known, off the nodes, tell nothing
    first = Pushes.of([0], [90], [[0.35], [0.0]], 0.01)
    alpha = np.array([[0.35, 9, 9], [0, 9, 9]])
    many = Pushes.of([0, 40, 50], [90, 20, -30], alpha, np.tile([0.01, 1e6, 1e6], (2, 1)))
    alone, together = (estimate(pushes, size=0.13) for pushes in (first, many))
    np.testing.assert_allclose(together.alpha, alone.alpha, atol=1e-6)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.integers(0, COUNT - 1), min_size=2, max_size=12, unique=True),
    st.sampled_from(MEDIA),
)
def test_the_more_pushes_the_narrower(places: list[int], medium: str) -> None:
    """Given the size, a further push widens nothing; and nothing is narrower than the pushes allow."""
    size = float(np.sqrt(np.mean(truth(medium) ** 2)))

    def deviations(some: list[int]) -> np.ndarray:
        found = estimate(pushed(medium, some, se=0.01), size=size)
        result: np.ndarray = np.sqrt((found.factor**2).sum(axis=0))
        return np.where(found.measured, np.nan, result)

    fewer, more = deviations(places[:-1]), deviations(places)
    both = np.isfinite(fewer) & np.isfinite(more)
    assert (more[both] <= fewer[both] + 1e-9).all()
    exact = estimate(pushed(medium, places, se=1e-6), size=size)
    limit = np.sqrt((exact.factor**2).sum(axis=0))
    assert (more[both] >= limit[both] - 1e-6).all()


def test_a_medium_that_does_not_belong_is_told_so() -> None:
    places = [
        *FEW,
        node(-30, 56),
        node(-60, -45),
        node(60, 72),
        node(30, 18),
        node(0, 45),
        node(60, -18),
        *range(2, COUNT, 10),
    ]
    beta, gamma = NODES
    for medium in MEDIA:
        alpha = truth(medium)
        down = alpha[0, node(0, 90)]
        depth_only = rftfit.DepthOnlyProfile.of(TableProfile.published(medium)).alpha(beta, gamma)
        foreign = {
            "isotropic": down * np.stack([np.sin(gamma), np.cos(gamma)]),
            "depth-only": np.stack(depth_only),
            "alpha_x doubled": alpha * [[1], [2]],
        }
        for name, other in foreign.items():
            found = estimate(Pushes.of(BETA[places], GAMMA[places], other[:, places]))
            assert found.belongs < NOT_ALIKE, (medium, name)
        assert (
            estimate(Pushes.of(BETA[places], GAMMA[places], alpha[:, places])).belongs > NOT_ALIKE
        )
    # one number tells the size only
    assert np.isnan(estimate(pushed("poppy_LP", FEW[:1])).belongs)


def test_the_push_that_does_not_fit_is_named() -> None:
    own = pushed("poppy_LP", FEW)
    own.alpha[0, 3] += 0.2
    farthest = estimate(own).farthest
    assert farthest is not None
    assert (round(farthest.beta_deg), round(farthest.gamma_deg), farthest.component) == (
        60,
        18,
        "z",
    )
    assert farthest.found - farthest.expected == pytest.approx(0.2, abs=0.06)


def test_what_cannot_be_estimated_says_why() -> None:
    with pytest.raises(ValueError, match="no resistance"):
        estimate(Pushes.of([0], [90], [[-0.3], [0.0]]))
    with pytest.raises(ValueError, match="no push has a number"):
        estimate(Pushes.of([0], [90], [[np.nan], [0.3]]))
    with pytest.raises(ValueError, match="at least two known media"):
        Shapes({"one": TableProfile.published("poppy_LP")})
    holes = np.full((7, 13), 0.3)
    holes[2, 3] = np.nan
    with pytest.raises(ValueError, match="holed has"):
        Shapes({"one": TableProfile.published("poppy_LP"), "holed": TableProfile(holes, holes)})


def test_repeated_pushes_are_one_with_their_weighted_mean() -> None:
    # the second of the level plate and the mirror image of the third are the same directions
    alpha = np.array([[0.30, 0.36, 0.20, 0.22], [np.nan, 0.0, 0.10, -0.16]])
    se = np.array([[0.01, 0.02, 0.01, 0.01], [0.01, 0.01, 0.01, 0.03]])
    several = Pushes.of([0, 0, 30, -30], [90, 90, 45, 135], alpha, se)
    once = np.array([[0.8 * 0.30 + 0.2 * 0.36, 0.21], [0.0, 0.9 * 0.10 + 0.1 * 0.16]])
    errors = np.array([[np.sqrt(1 / (1e4 + 2.5e3)), 0.01 / np.sqrt(2)],
                       [0.01, np.sqrt(1 / (1e4 + 1e4 / 9))]])  # fmt: skip
    one, other = estimate(several), estimate(Pushes.of([0, 30], [90, 45], once, errors))
    np.testing.assert_allclose(one.alpha, other.alpha, atol=1e-9)
    rows = [made.factor.reshape(len(made.factor), -1) for made in (one, other)]
    np.testing.assert_allclose(rows[0].T @ rows[0], rows[1].T @ rows[1], atol=1e-9)
    assert (one.pushes, other.pushes) == (4, 2)
    assert one.dof == other.dof


def test_errors_that_nobody_stated() -> None:
    np.testing.assert_allclose(usual_error(np.array([2.0, 0.0])), [np.hypot(0.1, 0.02), 0.02])
    stated = Pushes.of(
        [0, 30], [90, 45], [[0.3, 0.2], [0, np.nan]], [[0.01, np.nan], [np.nan, 0.02]]
    )
    deviations = np.sqrt(np.diag(stated.covariance))
    np.testing.assert_allclose(
        deviations[[0, 1, 3]], [0.01, usual_error(np.array([0.3, 0.2]))[1], 0.02]
    )


def test_own_lines_become_nodes() -> None:
    beta, gamma = grid([15, 30.2], [22.5])
    assert 15 in np.degrees(beta).round(6)
    assert 22.5 in np.degrees(gamma).round(6)
    assert 30.2 not in np.degrees(beta).round(6)
    assert beta.size == 7 * 14


def test_pushes_without_a_horizontal_component_can_belong() -> None:
    own = pushed("poppy_LP", FEW)
    own.alpha[1] = np.nan
    found = estimate(own, published_shapes(without=["poppy_LP"]))
    assert np.isnan(found.horizontal)
    assert found.belongs > NOT_ALIKE
    # and still they need not
    own.alpha[0] = 0.3
    assert estimate(own).belongs < NOT_ALIKE


def test_a_medium_that_gives_energy_back_in_every_draw_is_told() -> None:
    """A whole grid with z upside down: its own alpha is kept, what lies between takes no energy."""
    angles = np.meshgrid([-45, 0, 45, 75], [-60, -30, 0, 30, 60, 90], indexing="ij")
    beta, gamma = (part.ravel() for part in angles)
    z, x = rftfit.scale(0.6).profile.alpha(np.radians(beta), np.radians(gamma))
    pushes = pd.DataFrame({
        "beta_deg": beta, "gamma_deg": gamma, "alpha_z_N_per_cm3": -z, "alpha_x_N_per_cm3": x,
        "se_z": 0.01 * abs(z) + 0.002, "se_x": 0.01 * abs(x) + 0.002,
    })  # fmt: skip
    found = rftfit.estimate_map(pushes)
    with pytest.raises(InputError, match=r"gives energy back .*: look at the signs"):
        found.table()


def test_columns_have_the_names_that_the_command_takes() -> None:
    full = pd.DataFrame({"beta_deg": [0, 30.0], "gamma_deg": [90, 45.0], "alpha_z_N_per_cm3": [0.3, 0.2],
                         "alpha_x_N_per_cm3": [0.0, 0.1], "alpha_z_se_N_per_cm3": 0.05,
                         "alpha_x_se_N_per_cm3": 0.02})  # fmt: skip
    short = full.set_axis(["beta", "gamma", "alpha_z", "alpha_x", "se_z", "se_x"], axis=1)
    one, other = (rftfit.estimate_map(pushes) for pushes in (full, short))
    pd.testing.assert_frame_equal(one.table(), other.table())
    with pytest.raises(InputError, match=r"no column beta_deg, gamma_deg; found: .*alpha_z"):
        rftfit.estimate_map(short[["alpha_z", "se_z"]])
