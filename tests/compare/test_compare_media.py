"""Two sets of runs are compared in size and shape with intervals that contain the truth.

Size: ratio of strength of two media; shape: alpha over the directions, without the size. Sets that
cannot be compared are refused.
"""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from compare_media import Beds, compare_pair, grade, published, runs_of
from seeds import seeds

import rftfit
from rftfit.compare.contrast import RunSet, compare_run_sets

MEDIA = rftfit.published_reference().media
ALPHA = ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]


def sides(ratio=1.0, count=12, repeats=3, seed=0, **facts):
    """Two sets of runs of loose poppy seeds, of which B is stronger."""
    rng = np.random.default_rng(seed)
    table = published("poppy_LP")
    slanted = table[:, table[1] != 0]
    truth = slanted[:, rng.permutation(slanted.shape[1])[:count]]
    depth = np.full(count, 6.0)
    larger = np.vstack([truth[:2], ratio * truth[2:]])
    first, second = (runs_of(alpha, depth, repeats, rng, Beds()) for alpha in (truth, larger))
    return RunSet("A", first, **facts), RunSet("B", second, **facts)


def test_shares_of_the_study():
    pairs = seeds(100, 6)
    shares = grade(pairs, (20, 3))
    # a binomial share of so few pairs; of 100 at most 10
    most = 10 if pairs == 100 else 38
    assert shares["size, false"] <= most
    assert shares["shape, false"] <= most
    assert 100 - most <= shares["ratio covered"] <= 100
    assert shares["8 % of size"] >= 70
    assert shares["10 % of shape"] >= 70
    assert shares["shape covered"] >= 100 - most


def test_published_media_differ_in_shape():
    rng = np.random.default_rng(0)
    places = rng.permutation(78)[:20]
    depth = np.full(20, 6.0)
    sets = [
        RunSet(medium, runs_of(published(medium)[:, places], depth, 3, rng, Beds()))
        for medium in MEDIA
    ]
    for a, b in combinations(sets, 2):
        assert compare_run_sets(a, b).shape_p < 1e-10


@pytest.mark.parametrize("ratio", [1.0, 1.2])
def test_repeats_that_agree_exactly_are_compared(ratio):
    """Nothing that their logs do not explain scatters, and nothing is divided by it."""
    a, b = sides(ratio)
    same = [
        replace(
            side,
            runs=side.runs.assign(
                **side.runs.groupby(["beta_deg", "gamma_deg"])[ALPHA].transform("first")
            ),
        )
        for side in (a, b)
    ]
    identical = replace(b, runs=same[0].runs.assign(**ratio * same[0].runs[ALPHA]))
    comparison = compare_run_sets(same[0], identical)
    assert comparison.ratio == pytest.approx(ratio, rel=1e-4)
    assert comparison.scatter_along == 0
    assert (comparison.size_p < 0.05) == (ratio != 1)


@pytest.mark.parametrize("factors", [(1, 4), (4, 1), (1, 1)])
def test_sets_whose_runs_scatter_unlike_say_so(factors):
    def scattered(side, factor):
        directions = side.runs.groupby(["beta_deg", "gamma_deg"])[ALPHA]
        means = directions.transform("mean")
        return replace(side, runs=side.runs.assign(**means + factor * (side.runs[ALPHA] - means)))

    notes = compare_run_sets(*map(scattered, sides(), factors)).notes
    assert any(note.startswith("runs of A scatter by") for note in notes) == (factors != (1, 1))


def test_units_order_of_runs_and_order_of_sides_do_not_matter():
    a, b = sides(1.1)
    shuffled = [
        replace(
            side,
            runs=side.runs.sample(frac=1, random_state=1).assign(
                **{name: 1000 * side.runs[name] for name in side.runs if name.startswith("alpha")}
            ),
        )
        for side in (a, b)
    ]
    comparison, rescaled = compare_run_sets(a, b), compare_run_sets(shuffled[0], shuffled[1])
    for name in ("ratio", "ratio_lo", "size_p", "shape_percent", "shape_p", "least_ratio"):
        assert getattr(rescaled, name) == pytest.approx(getattr(comparison, name), rel=1e-4)
    backward = compare_run_sets(b, a)
    assert backward.ratio * comparison.ratio == pytest.approx(1, abs=1e-4)
    assert backward.shape_p == pytest.approx(comparison.shape_p, rel=0.02)


def test_the_surface_of_a_session_widens_the_ratio_and_not_the_shape():
    a, b = sides()
    wide = [replace(side, surface_cm=0.3) for side in (a, b)]
    without_surface, with_surface = compare_run_sets(a, b), compare_run_sets(wide[0], wide[1])
    # 3 mm of 6 cm are 7.5 % of a slanted run, on each side
    half = math.log(with_surface.ratio_hi / with_surface.ratio_lo) / 2
    assert half == pytest.approx(1.96 * math.sqrt(2) * 0.075, rel=0.15)
    assert math.log(without_surface.ratio_hi / without_surface.ratio_lo) / 2 < half / 3
    assert with_surface.shape_p == pytest.approx(without_surface.shape_p, abs=0.1)
    assert with_surface.least_shape_percent == pytest.approx(
        without_surface.least_shape_percent, rel=0.3
    )


def test_a_turn_of_the_mount_cancels_within_one_campaign():
    a, b = sides(turn_deg=10.0)
    apart = compare_run_sets(a, b)
    together = compare_run_sets(replace(a, campaign="lab"), replace(b, campaign="lab"))
    exact = compare_run_sets(replace(a, turn_deg=0), replace(b, turn_deg=0))
    assert abs(together.shape_p - exact.shape_p) < 0.05 < apart.shape_p
    # a mount that was turned by 12 degrees is a difference of shape, unless it may be turned by 10
    angle = math.radians(12)
    z, x = (b.runs[f"alpha_{c}_N_per_cm3"] for c in "zx")
    turned = b.runs.assign(
        alpha_z_N_per_cm3=z * math.cos(angle) - x * math.sin(angle),
        alpha_x_N_per_cm3=x * math.cos(angle) + z * math.sin(angle),
    )
    assert compare_run_sets(a, replace(b, runs=turned)).shape_p > 0.01
    assert (
        compare_run_sets(replace(a, turn_deg=0), replace(b, runs=turned, turn_deg=0)).shape_p < 1e-4
    )


def test_the_direction_that_differs_comes_first():
    a, b = sides(count=8)
    place = b.runs.iloc[6]
    changed = (b.runs["beta_deg"] == place["beta_deg"]) & (
        b.runs["gamma_deg"] == place["gamma_deg"]
    )
    size = np.hypot(a.runs["alpha_z_N_per_cm3"], a.runs["alpha_x_N_per_cm3"]).max()
    runs = b.runs.assign(alpha_z_N_per_cm3=b.runs["alpha_z_N_per_cm3"] + 0.5 * size * changed)
    comparison = compare_run_sets(a, replace(b, runs=runs))
    first = comparison.directions.iloc[0]
    assert (first["beta_deg"], first["gamma_deg"]) == (place["beta_deg"], place["gamma_deg"])
    assert first["p"] < 0.01
    assert first["difference_z_lo_N_per_cm3"] > 0
    assert comparison.shape_lo_percent > 0
    assert "another shape" in comparison.sentence


def test_without_repeats_a_scatter_is_assumed_and_said():
    comparison = compare_pair(3, (20, 1))
    assert (comparison.repeats, comparison.assumed, len(comparison.notes)) == (0, True, 1)
    assert comparison.least_shape_percent > 20
    different = compare_pair(3, (20, 1), 1.0, 0.6)
    assert different.shape_p < 0.01
    assert f" {100 * different.explained_by:.2g} %." in different.sentence


def test_the_interval_of_shape_begins_above_0_where_p_is_small():
    for seed in range(20):
        comparison = compare_pair(seed, (8, 3), 1.0, 0.05)
        assert (comparison.shape_lo_percent > 0) == (comparison.shape_p < 0.05)
        assert comparison.shape_lo_percent <= comparison.shape_percent < comparison.shape_hi_percent


def test_runs_without_alpha_x_and_level_runs_at_other_depths():
    a, b = sides(1.2)
    bare = [replace(side, runs=side.runs.assign(alpha_x_N_per_cm3=math.nan)) for side in (a, b)]
    comparison = compare_run_sets(bare[0], bare[1])
    assert comparison.ratio == pytest.approx(1.2, rel=0.08)
    assert comparison.directions["difference_x_N_per_cm3"].isna().all()
    assert comparison.directions["alpha_z_a_N_per_cm3"].notna().all()
    assert "nan" not in comparison.summary(most=None)
    level = pd.DataFrame(
        {
            "beta_deg": 0.0,
            "gamma_deg": 0.0,
            "alpha_z_N_per_cm3": 0.2,
            "alpha_x_N_per_cm3": 0.1,
            "depth_from_cm": [2.0, 4.0],
        }
    )
    level_b = level.assign(depth_from_cm=[2.04, 5.0])
    met = compare_run_sets(RunSet("A", level), RunSet("B", level_b))
    assert met.directions["depth_cm"].tolist() == [2.0]


def test_what_cannot_be_compared_is_refused():
    a, b = sides()
    elsewhere = b.runs.assign(beta_deg=b.runs["beta_deg"] + 3)
    with pytest.raises(rftfit.RftfitError, match="no common direction"):
        compare_run_sets(a, replace(b, runs=elsewhere))
    with pytest.raises(rftfit.RftfitError, match="opposite"):
        compare_run_sets(a, replace(b, runs=b.runs.assign(**{c: -b.runs[c] for c in ALPHA})))
    with pytest.raises(rftfit.RftfitError, match="no force"):
        compare_run_sets(a, replace(b, runs=b.runs.assign(**dict.fromkeys(ALPHA, 0.0))))


def test_repeats_of_one_medium_tell_little_of_the_other():
    is_detected = []
    for seed in range(10):
        a = sides(seed=seed)[0]
        truth = a.runs.groupby(["beta_deg", "gamma_deg"], as_index=False).mean(numeric_only=True)
        single = truth[[f"{name}_deg" for name in ("beta", "gamma")]].to_numpy().T
        alpha = truth[ALPHA].to_numpy().T
        rng = np.random.default_rng(seed)
        rough = runs_of(np.vstack([single, alpha]), np.full(12, 6.0), 1, rng, Beds(0.1, 0.06))
        comparison = compare_run_sets(a, RunSet("B", rough))
        assert comparison.assumed
        [note] = comparison.notes
        assert note.startswith("B ")
        assert note.endswith(" A")
        is_detected.append(comparison.shape_p < 0.05)
    assert sum(is_detected) <= 2


def test_a_published_medium_is_compared_by_its_map(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = rftfit.published_table("table_s5")
    pushes = table[table["medium"] == "poppy_LP"].copy()
    pushes[ALPHA] *= 2
    sand = rftfit.estimate_map(pushes)
    comparison = rftfit.compare_media("published:poppy_LP", sand)
    assert comparison.ratio == pytest.approx(2, rel=0.03)
    assert comparison.ratio_lo < 2 < comparison.ratio_hi
    # told in 4 of 5 cases at 5 %: 1.96 + 0.84 standard errors of the logarithm
    se = math.log(comparison.ratio_hi / comparison.ratio_lo) / (2 * 1.95996)
    assert math.log(comparison.least_ratio) == pytest.approx(2.80158 * se, rel=1e-4)
    with pytest.raises(rftfit.RftfitError, match="did you mean 'poppy_LP'"):
        rftfit.compare_media("published:popy_LP", sand)
    with pytest.raises(rftfit.RftfitError, match="published:MEDIUM"):
        rftfit.compare_media("poppy_LP", sand)


@pytest.mark.parametrize("error", ["startup", "tare", "curvature"])
def test_an_error_that_is_counted_by_itself_leaves_that_of_a_run(error):
    """The standard error of a run without the error is that of runs which do not have it; units in which none is small."""

    def with_errors(side, se, named_error):
        alpha = {name: 1000 * side.runs[name] for name in ALPHA}
        errors = {f"alpha_{c}_se_N_per_cm3": se for c in "zx"}
        errors |= {f"alpha_{c}_{error}_N_per_cm3": named_error for c in "zx"}
        return replace(side, runs=side.runs.assign(**alpha, **errors))

    both = sides(1.1)
    plain = compare_run_sets(*(with_errors(side, 4.0, 0.0) for side in both))
    reduced = compare_run_sets(*(with_errors(side, 5.0, 3.0) for side in both))
    assert reduced.scatter_along == pytest.approx(plain.scatter_along, rel=1e-9)
    assert reduced.scatter_across == pytest.approx(plain.scatter_across, rel=1e-9)


def test_the_campaign_of_the_current_folder_may_be_broken_if_both_media_are_elsewhere(
    tmp_path, monkeypatch
):
    (tmp_path / "config.yaml").write_text("broken")
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rftfit.RftfitError, match="other"):
        rftfit.compare_media("other:a", "other:b")
