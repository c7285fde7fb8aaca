"""The spread between runs is found without bias from repeats, or stated, and widens intervals."""

import math

import numpy as np
import pytest
from seeds import seeds

from rftfit import TableProfile
from rftfit.measure.errors import ErrorTerm, bed_of_mean, combined_half_width, spread_of_beds

SPREAD = 0.005
"""Standard deviation between runs, N/cm^3."""


def pairs(count, seed, se=0.001):
    """Alpha and its error of pairs of repeats."""
    random = np.random.default_rng(seed)
    deviation = math.hypot(SPREAD, se)
    return [z_alone(random.normal(0.3, deviation, 2), np.full(2, se)) for _ in range(count)]


def z_alone(alpha, se):
    """Runs of which x was not measured."""
    return tuple(np.stack([values, np.full(len(values), math.nan)]) for values in (alpha, se))


def error_of_z(spread, alpha):
    return spread.error_at(np.array([alpha, math.nan]), 0)


def test_spread_from_repeats_by_hand():
    groups = [z_alone(np.array([0.30, 0.31]), np.array([0.001, 0.002]))] * 5
    spread = spread_of_beds(groups)
    # each pair has the sum of squares 2 x 0.005^2 and one degree of freedom
    variance_between, variance_within = 5e-5, (1e-6 + 4e-6) / 2
    assert spread.source == "repeats"
    error = error_of_z(spread, 0.305)
    assert error.sd == pytest.approx(math.sqrt(variance_between - variance_within), rel=1e-3)
    assert error.dof == pytest.approx(5)


def test_spread_from_repeats_is_unbiased():
    variances = [error_of_z(spread_of_beds(pairs(12, seed)), 0.3).sd ** 2 for seed in range(400)]
    assert np.mean(variances) == pytest.approx(SPREAD**2, rel=0.06)


@pytest.mark.parametrize(("a", "b"), [(0.004, 0.0), (0.0, 0.05), (0.002, 0.03)])
def test_a_spread_that_grows_with_alpha_is_found(a, b):
    random = np.random.default_rng(3)
    alphas = np.tile([0.01, 0.05, 0.1, 0.2, 0.35], 12)
    variances, inside = [], []
    levels = np.array([0.01, 0.1, 0.35])
    for _ in range(60):
        se = np.full(3, 0.0005)
        groups = [
            z_alone(alpha + random.normal(0, math.hypot(a, b * alpha, 0.0005), 3), se)
            for alpha in alphas
        ]
        spread = spread_of_beds(groups)
        variances.append([error_of_z(spread, alpha).sd ** 2 for alpha in levels])
        one_more = random.normal(0, math.hypot(a, b * 0.35))
        half_width = combined_half_width([error_of_z(spread, 0.35)], 0.95)
        inside.append(abs(one_more) <= half_width)
    expected = np.hypot(a, b * levels)
    # a floor of 0 can only be found too large
    np.testing.assert_allclose(
        np.sqrt(np.mean(variances, axis=0)), expected, rtol=0.15, atol=0.0012 if a == 0 else 0.0
    )
    assert np.mean(inside) > 0.88


def test_where_no_repeat_is_near_the_interval_is_wide_and_not_endless():
    """Four cells of three runs each: there a^2 may be found small, with a large error."""
    random = np.random.default_rng(1)
    ratios, inside = [], []
    for _ in range(300):
        groups = [
            z_alone(alpha * (1 + random.normal(0, 0.04, 3)), np.full(3, 0.0001))
            for alpha in (0.6, 0.45, 0.22, 0.15)
        ]
        error = error_of_z(spread_of_beds(groups), 0.02)
        half = combined_half_width([error], 0.95)
        ratios.append(half / 0.0008)
        inside.append(abs(random.normal(0, 0.0008)) <= half)
    assert max(ratios) < 100
    assert np.mean(inside) > 0.93


BEDS = {
    "normal": lambda random, shape: random.standard_normal(shape),
    "heavy-tailed": lambda random, shape: random.standard_t(3, shape) / math.sqrt(3),
}


@pytest.mark.parametrize("beds", BEDS)
@pytest.mark.parametrize("percent", [3, 5, 8])
@pytest.mark.parametrize("cells", [1, 2, 4])
def test_few_repeats_cover_with_intervals_that_are_of_use(cells, percent, beds):
    """Some cells of two runs, four of one, in beds that are not made as the estimator takes them."""
    random = np.random.default_rng(5)
    inside, halves = [], []
    for _ in range(60):
        truth = np.stack(
            [random.uniform(0.1, 0.6, cells + 4), random.uniform(0.05, 0.3, cells + 4)]
        )
        bed = 1 + percent / 100 * BEDS[beds](random, (cells + 4, 2))
        runs = truth[..., None] * (bed + 0.005 * random.standard_normal((2, cells + 4, 2)))
        se = 0.005 * truth
        counts = [2] * cells + [1] * 4
        groups = [
            (runs[:, cell, :n], np.repeat(se[:, cell, None], n, axis=1))
            for cell, n in enumerate(counts)
        ]
        spread = spread_of_beds(groups)
        for (alpha, error), true in zip(groups, truth.T, strict=True):
            n = alpha.shape[1]
            mean, share = alpha.mean(axis=1), np.full(n, 1 / n)
            for component in (0, 1):
                noise = ErrorTerm(float(error[component, 0]) / math.sqrt(n))
                bed_error = spread.error_at(mean, component)
                errors = bed_of_mean(alpha[component], share, noise, bed_error, spread.source)
                half = combined_half_width(errors[:2], 0.95)
                inside.append(abs(mean[component] - true[component]) <= half)
                halves.append(half / true[component])
    assert np.mean(inside) > 0.89
    # a cell whose two runs differ by more than the others has Student's interval of these two
    assert np.quantile(halves, 0.98) < 0.55
    assert np.median(halves) < 0.2


@pytest.mark.parametrize("percent", [5, 8, 15])
@pytest.mark.parametrize("runs", [3, 5])
def test_one_repeated_direction_covers_in_beds_that_differ_much(runs, percent):
    """The scatter moderated by the assumed 5 % alone holds too few of the means of three beds that differ by 15 %."""
    random = np.random.default_rng(8)
    inside, inside_moderated = [], []
    for alpha in 0.4 * np.exp(percent / 100 * random.standard_normal((800, runs))):
        spread = spread_of_beds([z_alone(alpha, np.zeros(runs))])
        share = np.full(runs, 1 / runs)
        of_bed = error_of_z(spread, alpha.mean())
        errors = bed_of_mean(alpha, share, ErrorTerm(0.0), of_bed, spread.source)
        off = abs(alpha.mean() - 0.4 * np.exp((percent / 100) ** 2 / 2))
        inside.append(off <= combined_half_width(errors[:2], 0.95))
        inside_moderated.append(off <= combined_half_width([of_bed], 0.95) / math.sqrt(runs))
    assert np.mean(inside) > 0.92
    if (percent, runs) == (15, 3):
        assert np.mean(inside_moderated) == pytest.approx(0.86, abs=0.02)


TWENTY = np.repeat([-60, -30, 0, 30, 60], 4), np.tile([-60, 30, 60, 90], 5)
SIX = np.array([0, 0, 30, -30, 60, 0]), np.array([90, 45, 60, 60, 30, -60])
DESIGNS = {
    "20 twice": (TWENTY, [2] * 20),
    "20 three times": (TWENTY, [3] * 20),
    "6 twice": (SIX, [2] * 6),
    "6 five times": (SIX, [5] * 6),
    "5 of 20 three times": (TWENTY, [3] * 5 + [1] * 15),
    "1 of 6 six times": (SIX, [6] + [1] * 5),
}
"""Angles in degrees, and runs of each direction."""

KINDS = {
    "beds": (0.05, 0.0, 0.0),
    "beds and patches": (0.05, 0.03, 0.0),
    "heavy-tailed": (0.08, 0.02, 0.0),
    "patches": (0.02, 0.05, 0.0),
    "the same everywhere": (0.0, 0.0, 0.02),
    "beds, and the same everywhere": (0.03, 0.0, 0.02),
}
"""Scatter of beds as a whole and of patches, relative to alpha, and of all directions, relative to the largest alpha."""

NOISE = 0.004


@pytest.mark.parametrize("design", DESIGNS)
def test_alpha_and_the_next_bed_are_covered_in_beds_of_many_kinds(design):
    """Truths that are not of the estimator's kind; 95 % intervals of all cells together."""
    (beta_deg, gamma_deg), counts = DESIGNS[design]
    by_kind = []
    for kind, scatter in KINDS.items():
        random = np.random.default_rng(8)
        inside = []
        for medium in ("poppy_LP", "poppy_CP") * seeds(20, 3):
            profile = TableProfile.published(medium)
            truth = np.stack(profile.alpha(np.radians(beta_deg), np.radians(gamma_deg)))
            inside.append(covered(truth, np.array(counts), scatter, kind == "heavy-tailed", random))
        by_kind.append(np.mean(inside, axis=0))
    assert np.mean(by_kind) > 0.93
    assert np.min(by_kind) > seeds(0.86, 0.75)


def covered(truth, counts, scatter, heavy_tailed, random):
    """Share of the means of all cells that hold the truth, and of the next beds that are where they are said to be."""
    cell, largest = np.repeat(np.arange(counts.size), counts), np.hypot(*truth).max()
    runs = drawn_runs(truth[:, cell], largest, scatter, heavy_tailed, random)
    next_runs = drawn_runs(truth, largest, scatter, heavy_tailed, random)
    se = np.full(runs.shape, NOISE * largest)
    spread = spread_of_beds([(runs[:, cell == k], se[:, cell == k]) for k in range(counts.size)])
    noise, inside = ErrorTerm(NOISE * largest), []
    for k, n in enumerate(counts):
        mean = runs[:, cell == k].mean(axis=1)
        for component in (0, 1):
            bed = spread.error_at(mean, component)
            of_mean = [ErrorTerm(part.sd / math.sqrt(n), part.dof) for part in (bed, noise)]
            half_of_mean, half_of_next = (
                combined_half_width(parts, 0.95) for parts in (of_mean, [*of_mean, bed, noise])
            )
            off, next_off = (mean - alpha[:, k] for alpha in (truth, next_runs))
            inside.append(
                [abs(off[component]) <= half_of_mean, abs(next_off[component]) <= half_of_next]
            )
    return np.mean(inside, axis=0)


def drawn_runs(truth, largest, scatter, heavy_tailed, random):
    """One run of each direction in beds of their own, of the true alpha of shape (2, n)."""
    of_beds, of_patches, everywhere = scatter
    count = truth.shape[1]
    bed = random.standard_t(4, count) / math.sqrt(2) if heavy_tailed else random.normal(size=count)
    rest = of_patches * np.hypot(np.hypot(*truth), 0.15 * largest)
    rest = rest * random.normal(size=truth.shape)
    constant = math.hypot(everywhere, NOISE) * largest * random.normal(size=truth.shape)
    return truth * (1 + of_beds * bed) + rest + constant
