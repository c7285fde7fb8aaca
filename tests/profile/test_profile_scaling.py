"""Bootstrap draws, intervals of coefficients, and the scaling routine for a new medium."""

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from paper_grid import BETA, GAMMA, by_hand

from rftfit import reference
from rftfit.compare.coefficients import penetration_row
from rftfit.measure.alpha import column
from rftfit.measure.flags import codes_of, remark
from rftfit.model import fourier
from rftfit.model.draws import alpha_draws, draws_of, interval
from rftfit.model.scaling import (
    ALL_METHODS,
    AS_PRINTED,
    Reference,
    Scaled,
    alpha_of_test,
    fit_media,
    fit_medium,
    generic_interval,
    reference_of,
    routine,
    routines,
    scale,
    scale_new_medium,
    vertical_penetration,
)

Z95 = 1.959963985
CHI = np.array([1.37, 1.19, 1.27, 1.05, 1.33])
M0 = fourier.as_array(reference.coefficients("generic"))


def alpha_frame(medium, alpha, se):
    beta, gamma = np.meshgrid(reference.BETA_DEG, reference.GAMMA_DEG, indexing="ij")
    data: dict[str, object] = {
        "medium": medium, "beta_deg": beta.ravel(), "gamma_deg": gamma.ravel(),
    }  # fmt: skip
    for component, values in zip("zx", alpha, strict=True):
        flat = values.ravel()
        data |= {
            column(component): flat, column(component, "_se"): se,
            column(component, "_lo"): flat - Z95 * se, column(component, "_hi"): flat + Z95 * se,
        }  # fmt: skip
    return pd.DataFrame(data)


def published(medium, se=0.002):
    return alpha_frame(medium, reference.alpha_grid(medium), se)


def test_same_seed_same_draws():
    one = alpha_draws(published("poppy_LP"), 50, 7, 0.95)
    np.testing.assert_array_equal(one, alpha_draws(published("poppy_LP"), 50, 7, 0.95))
    assert not np.array_equal(one, alpha_draws(published("poppy_LP"), 50, 8, 0.95))
    # another medium draws its own errors, not the same ones again
    other = alpha_draws(published("poppy_CP"), 50, 7, 0.95)
    errors = [draws[0] - reference.alpha_grid(medium)[0].ravel()
              for draws, medium in ((one, "poppy_LP"), (other, "poppy_CP"))]  # fmt: skip
    assert abs(np.corrcoef(errors[0].ravel(), errors[1].ravel())[0, 1]) < 0.1


def test_draws_do_not_depend_on_the_order_of_the_rows():
    table = published("poppy_LP")
    shuffled = table.sample(frac=1, random_state=3)
    for one, other in zip(
        alpha_draws(table, 20, 7, 0.95), alpha_draws(shuffled, 20, 7, 0.95), strict=True
    ):
        np.testing.assert_array_equal(one[:, shuffled.index], other)


def test_draws_have_the_tables_errors():
    table = published("poppy_LP", 0.002)
    table.loc[table["beta_deg"] == 30, [column("z", "_lo"), column("z", "_hi")]] += [-0.01, 0.01]
    draws = alpha_draws(table, 4000, 7, 0.95)
    assert draws[0].shape == (4000, 91)
    draws = draws[0].reshape(-1, 7, 13), draws[1].reshape(-1, 7, 13)
    for part, alpha in zip(draws, reference.alpha_grid("poppy_LP"), strict=True):
        np.testing.assert_allclose(part.mean(axis=0), alpha, atol=8e-4)
    spread = draws[0].std(axis=0)
    np.testing.assert_allclose(spread[[1, 2, 3, 5]], 0.002, rtol=0.08)
    np.testing.assert_allclose(spread[4], 0.002 + 0.01 / Z95, rtol=0.08)
    # independent cells, but beta = -90 and 90 are one plate
    np.testing.assert_array_equal(np.argsort(draws[0][:, 0, 4]), np.argsort(draws[0][:, -1, 4]))
    assert abs(np.corrcoef(draws[0][:, 1, 4], draws[0][:, 2, 4])[0, 1]) < 0.06
    assert abs(np.corrcoef(draws[0][:, 1, 4], draws[1][:, 1, 4])[0, 1]) < 0.06


def test_cell_without_a_run_stays_empty():
    table = published("poppy_LP")
    names = [column(c, q) for c in "zx" for q in ("", "_se", "_lo", "_hi")]
    table.loc[40, names] = np.nan
    for part in alpha_draws(table, 10, 7, 0.95):
        assert np.isnan(part.reshape(10, -1)[:, 40]).all()
        assert np.isnan(part).sum() == 10


def test_percentile_interval():
    draws = np.random.default_rng(0).permutation(np.arange(1001.0))[:, None]
    lo, hi = interval(draws, 0.95)
    assert (lo[0], hi[0]) == pytest.approx((25, 975))
    lo, hi = interval(draws, 0.5)
    assert (lo[0], hi[0]) == pytest.approx((250, 750))


def test_intervals_of_coefficients_cover():
    """300 campaigns of a known medium: the bootstrap intervals of the nine terms cover it."""
    random = np.random.default_rng(17)
    true = fourier.as_array(reference.coefficients("poppy_CP"))
    alpha = fourier.evaluate(true, BETA, GAMMA)
    se, inside = 0.003, np.zeros(9)
    for seed in range(300):
        noise = random.normal(0, se, (2, 91))
        noise[:, :13] = noise[:, -13:]
        table = alpha_frame("m", (alpha[0] + noise[0], alpha[1] + noise[1]), se)
        draws = fourier.fit_lsq(BETA, GAMMA, *alpha_draws(table, 400, seed, 0.95))
        lo, hi = interval(draws, 0.95)
        inside += (lo <= true) & (hi >= true)
    assert 0.93 <= inside.sum() / 2700 <= 0.97
    assert (inside / 300 > 0.9).all()


def test_fit_media(paper_config):
    tables = [published(medium) for medium in reference.MEDIA]
    fits = fit_media(tables, paper_config)
    assert [(fit.method, fit.medium) for fit in fits] == [
        (method, medium) for method in ALL_METHODS for medium in reference.MEDIA
    ]
    for fit in fits:
        assert fit.why == ()
        assert (fit.used[~fit.keep] == 0).all()
        assert (fit.draws[:, ~fit.keep] == 0).all()
        lo, hi = interval(fit.draws, 0.999)
        assert (lo[fit.keep] < fit.used[fit.keep]).all()
        assert (fit.used[fit.keep] < hi[fit.keep]).all()
        assert fit.zeta == pytest.approx(fit.used[:5].sum())
        np.testing.assert_allclose(fit.zeta_draws, fit.draws[:, :5].sum(axis=1))
        assert fit.alpha_z == reference.alpha_grid(fit.medium)[0][3, -1]
        assert fit.alpha_z_draws.std() == pytest.approx(0.002, rel=0.1)
        printed = np.array(
            [reference.coefficients(fit.medium)[term] != 0 for term in fourier.TERMS]
        )
        if fit.method == AS_PRINTED:
            assert (fit.keep == printed).all()
        if fit.method == "lsq" and fit.keep.all():
            # the errors of the terms follow from the weights of the fit
            for draw, *alpha in zip(
                fit.draws[:3], *draws_of(fit.table, paper_config), strict=False
            ):
                np.testing.assert_allclose(draw, by_hand(BETA, GAMMA, *alpha), rtol=1e-6)


def test_fit_media_with_empty_cells(paper_config):
    table = published("poppy_LP")
    names = [column(c, q) for c in "zx" for q in ("", "_se", "_lo", "_hi")]
    table.loc[20, names] = np.nan
    lsq, dft, printed = fit_media([table], paper_config)
    whole, *_ = fit_media([published("poppy_LP")], paper_config)
    assert lsq.why == ()
    np.testing.assert_allclose(lsq.full, whole.full, atol=0.003)
    assert np.isfinite(lsq.draws).all()
    for fit in (dft, printed):
        assert fit.why == (remark("empty-cells", found=1, wanted=91),)
        assert np.isnan(fit.used).all()
        assert math.isnan(fit.zeta)
    table[names] = np.nan
    for fit in fit_media([table], paper_config):
        assert fit.why
        assert np.isnan(fit.draws).all()


def test_one_medium_of_its_own_is_not_enough_for_a_sand(paper_config):
    """The interval for a further medium is the scatter between media, which one does not show."""
    fits = fit_media([published("poppy_LP"), published("poppy_CP")], paper_config)
    one = reference_of([fit for fit in fits if fit.medium == "poppy_LP"], paper_config)
    assert one.printed
    assert one.chi.size == 5
    assert codes_of(one.remarks) == "published-media"
    scale_new_medium(0.5, 0.01, one.chi)
    two = reference_of(fits, paper_config)
    assert (two.printed, two.media, two.remarks) == (False, ("poppy_LP", "poppy_CP"), ())
    # by the method of the config: fits by others do not make up the number
    other = [fit for fit in fits if fit.medium == "poppy_LP" or fit.method != "lsq"]
    assert reference_of(other, paper_config).printed
    assert reference_of([], paper_config).printed


def test_new_medium_by_hand():
    scaled = scale_new_medium(0.9, 0.0, CHI)
    assert scaled.chi == pytest.approx(1.242)
    assert scaled.zeta == pytest.approx(0.9 / 1.242)
    medium = scale(0.9, reference=Reference("", reference.MEDIA, CHI, M0, np.tile(M0, (5, 1))))
    np.testing.assert_allclose(medium.coefficients, M0 * 0.9 / 1.242)
    # alpha_z(0, 90 deg) of the scaled profile is zeta, for M0 sums to 1 there
    assert medium.coefficients[:5].sum() == pytest.approx(medium.zeta, rel=1e-9)
    logs = [math.log(value) for value in CHI]
    mean = sum(logs) / 5
    spread = math.sqrt(sum((value - mean) ** 2 for value in logs) / 4 * 1.2)
    assert scaled.zeta_hi / scaled.zeta == pytest.approx(math.exp(2.776445 * spread), rel=1e-6)
    assert scaled.zeta_lo / scaled.zeta == pytest.approx(math.exp(-2.776445 * spread), rel=1e-6)
    assert scaled.chi_hi / scaled.chi == pytest.approx(math.exp(2.776445 * spread), rel=1e-6)
    # about 0.8 alpha, as the paper says
    assert scaled.zeta / 0.9 == pytest.approx(0.8, abs=0.02)


def test_an_error_that_is_not_known_gives_no_interval():
    scaled = scale_new_medium(0.42, np.nan, CHI)
    assert scaled.zeta == pytest.approx(0.42 / CHI.mean())
    assert np.isnan([scaled.zeta_lo, scaled.zeta_hi]).all()
    assert np.isfinite([scaled.chi_lo, scaled.chi_hi]).all()


def test_error_of_the_test_widens_zeta_and_not_chi():
    exact, rough = (scale_new_medium(0.9, se, CHI) for se in (0.0, 0.3))
    assert rough.zeta == exact.zeta
    assert rough.zeta_lo < exact.zeta_lo < exact.zeta < exact.zeta_hi < rough.zeta_hi
    assert (rough.chi_lo, rough.chi_hi) == (exact.chi_lo, exact.chi_hi)


def test_more_error_of_the_test_never_narrows_an_interval():
    random = np.random.default_rng(11)
    for _ in range(500):
        media = int(random.integers(2, 9))
        chi = 1.2 * np.exp(random.normal(0, 10 ** random.uniform(-3, -0.5), media))
        confidence, alpha = float(random.uniform(0.51, 0.995)), float(10 ** random.uniform(-1, 1))
        scatter = float(np.log(chi).std(ddof=1))
        steps = np.cumsum(alpha * scatter * 10 ** random.uniform(-3, 1, 4))
        errors = [0.0, *map(float, steps)]
        found = [scale_new_medium(alpha, se, chi, confidence) for se in errors]
        lo, hi = [one.zeta_lo for one in found], [one.zeta_hi for one in found]
        assert all(b < a for a, b in pairwise(lo)), (media, confidence, alpha, errors)
        assert all(b > a for a, b in pairwise(hi)), (media, confidence, alpha, errors)
        # what is derived from it: coefficients, whose own scatter joins
        own = M0 * np.exp(random.normal(0, 0.1, (media, 9)))
        ends = [one.with_interval(M0, own) for one in found]
        assert all((b[1] <= a[1]).all() and (b[2] >= a[2]).all() for a, b in pairwise(ends))


def test_half_widths_add_in_quadrature_by_hand():
    """Table S3 and a test of 0.9 +- 0.05 N/cm^3."""
    logs = [math.log(value) for value in CHI]
    mean = sum(logs) / 5
    spread = math.sqrt(sum((value - mean) ** 2 for value in logs) / 4 * 1.2)
    half = math.hypot(2.776445 * spread, 1.962339 * 0.05 / 0.9)
    found = scale_new_medium(0.9, 0.05, CHI)
    assert math.log(found.zeta_hi / found.zeta) == pytest.approx(half, rel=1e-6)
    assert math.log(found.zeta / found.zeta_lo) == pytest.approx(half, rel=1e-6)


@pytest.mark.parametrize("media", [2, 3, 5])
@pytest.mark.parametrize("ratio", [0.1, 0.3, 1.0, 3.0])
def test_joined_half_widths_cover_at_least_as_stated(media, ratio):
    """Error of the test beside the scatter of few media; one quantile for both gives down to 87 %."""
    random = np.random.default_rng(5)
    turns, inside = 4000, 0
    for _ in range(turns):
        chi = np.exp(random.normal(0, 0.02, media + 1))
        measured = chi[-1] * np.exp(random.normal(0, 0.02 * ratio))
        found = scale_new_medium(measured, 0.02 * ratio * measured, chi[:-1])
        inside += found.zeta_lo <= 1 <= found.zeta_hi
    assert 0.94 <= inside / turns <= 0.995


def test_zeta_scales_with_alpha():
    one, ten = (scale_new_medium(a, a / 50, CHI) for a in (0.3, 3.0))
    for name in ("zeta", "zeta_lo", "zeta_hi"):
        assert getattr(ten, name) == pytest.approx(10 * getattr(one, name))


def test_interval_of_a_further_medium_covers():
    """Media whose chi scatters: zeta of a sixth one lies in the interval 95 times in 100."""
    random = np.random.default_rng(23)
    inside = 0
    for _ in range(2000):
        chi = 1.25 * np.exp(random.normal(0, 0.1, 6))
        measured = 0.5 * chi[5] * (1 + random.normal(0, 0.05))
        found = scale_new_medium(measured, 0.05 * measured, chi[:5])
        inside += found.zeta_lo <= 0.5 <= found.zeta_hi
    assert 0.93 <= inside / 2000 <= 0.975


def test_media_that_agree_and_an_exact_test_leave_no_doubt():
    found = scale_new_medium(1.0, 0.0, np.array([1.25, 1.25, 1.25]))
    assert found.zeta_lo == pytest.approx(found.zeta) == pytest.approx(found.zeta_hi)
    assert found.zeta == pytest.approx(0.8)


@pytest.mark.parametrize("alpha", [0.0, -0.3, math.nan, math.inf])
def test_alpha_must_be_a_positive_number(alpha):
    with pytest.raises(ValueError, match="must be a positive number"):
        scale_new_medium(alpha, 0.0, CHI)


def test_error_must_be_one():
    with pytest.raises(ValueError, match="standard error"):
        scale_new_medium(0.9, -0.1, CHI)


@pytest.mark.parametrize("chi", [[], [1.2], [1.2, 0.0], [1.2, math.nan]])
def test_chi_of_the_reference_media(chi):
    with pytest.raises(ValueError, match="chi"):
        scale_new_medium(0.9, 0.0, np.array(chi))


def test_interval_of_chi_for_one_further_medium_by_hand():
    # two media: one degree of freedom, t = 12.706; log chi differ by log(1.3 / 1.2)
    found = scale_new_medium(0.4, 0.0, np.array([1.2, 1.3]))
    half = 12.706205 * math.log(1.3 / 1.2) / math.sqrt(2) * math.sqrt(1.5)
    assert found.chi == pytest.approx(1.25)
    assert (found.chi_lo, found.chi_hi) == pytest.approx(
        (1.25 * math.exp(-half), 1.25 * math.exp(half)), rel=1e-6
    )
    assert found.zeta == pytest.approx(0.4 / 1.25)
    assert (found.zeta_lo, found.zeta_hi) == pytest.approx(
        (0.32 * math.exp(-half), 0.32 * math.exp(half)), rel=1e-6
    )


def test_generic_interval_is_that_of_a_mean_of_media(paper_config):
    """Errors of M / zeta of two media, 0.03 and 0.04, make sqrt(0.03^2 + 0.04^2) / 2 of M0."""
    random = np.random.default_rng(23)
    plain = fit_media([published("poppy_LP"), published("poppy_CP")], paper_config)[:2]
    fits: list[Any] = []
    for fit, error in zip(plain, (0.03, 0.04), strict=True):
        draws = np.tile(fit.used, (20000, 1))
        draws[:, 5:] += error * fit.zeta * random.standard_normal((20000, 4))
        zeta_draws = vertical_penetration(draws)
        fits.append(SimpleNamespace(draws=draws, zeta_draws=zeta_draws, dof=1e6))
    lo, hi = generic_interval(fits, 0.95)
    middle = (plain[0].used / plain[0].zeta + plain[1].used / plain[1].zeta) / 2
    np.testing.assert_allclose((lo + hi)[5:] / 2, middle[5:], atol=1e-3)
    np.testing.assert_allclose((hi - lo)[5:] / 2, Z95 * 0.025, rtol=0.03)
    np.testing.assert_allclose((hi - lo)[:5], 0, atol=1e-9)


def test_a_medium_without_resistance_has_a_reason(paper_config):
    z, x = reference.alpha_grid("poppy_LP")
    fit = fit_medium(alpha_frame("poppy_LP", (0 * z, x), 0.002), paper_config, "lsq")
    assert codes_of(fit.why) == "zero-push"
    assert not fit.counts
    assert math.isnan(penetration_row(fit)["chi"])  # type: ignore[arg-type]


def test_a_medium_that_cannot_be_fitted_keeps_its_name(paper_config):
    table = published("poppy_LP")
    names = [column(c, q) for c in "zx" for q in ("", "_se", "_lo", "_hi")]
    table.loc[40, names] = np.nan
    by_method = {fit.method: fit for fit in fit_media([table], paper_config)}
    assert set(by_method) == set(ALL_METHODS)
    assert by_method["lsq"].reason == ""
    whole = by_method["dft-index"]
    assert whole.medium == "poppy_LP"
    assert codes_of(whole.why) == "empty-cells"
    assert np.isnan([whole.used, whole.full]).all()
    table.loc[table["beta_deg"] != 0, names] = np.nan
    few = next(fit for fit in fit_media([table], paper_config) if fit.method == "lsq")
    assert (few.medium, few.method) == ("poppy_LP", "lsq")
    assert "12 measured directions do not determine 5 separate terms" in few.reason
    table[names] = np.nan
    none = next(fit for fit in fit_media([table], paper_config) if fit.method == "lsq")
    assert none.reason == "0 measured directions are too few for 5 terms"


def test_few_degrees_of_freedom_of_alpha_are_those_of_its_coefficients(paper_config):
    table = published("poppy_LP")
    for c in "zx":  # 95 % intervals with Student's t of four degrees of freedom
        table[column(c, "_lo")] = table[column(c)] - 2.776445 * table[column(c, "_se")]
        table[column(c, "_hi")] = table[column(c)] + 2.776445 * table[column(c, "_se")]
    fits = fit_media([table], paper_config)
    assert [fit.dof for fit in fits] == pytest.approx([4.0] * len(ALL_METHODS), rel=1e-4)


def test_the_error_of_a_test_is_the_larger_of_two():
    """0.1 N/cm^3 either side at 95 % is a standard error of 0.1 / 1.9623."""
    names = [column("z", end) for end in ("", "_se", "_lo", "_hi")]
    for se, wanted in ((0.01, 0.1 / 1.962339), (0.2, 0.2)):
        found = alpha_of_test(pd.Series(dict(zip(names, (0.5, se, 0.4, 0.6), strict=True))), 0.95)
        assert found == pytest.approx((0.5, wanted), rel=1e-6)


def nine_terms(medium, spoiled):
    """Alpha of nine known terms; two cells are flagged, and their alpha_z and alpha_x are `spoiled` off."""
    true = fourier.as_array(reference.coefficients("poppy_CP"))
    z, x = fourier.evaluate(true, BETA, GAMMA)
    table = alpha_frame(medium, (z, x), 0.002).assign(flag_codes="")
    for row in (44, 60):
        for c in "zx":
            table.loc[row, [column(c, end) for end in ("", "_lo", "_hi")]] += spoiled
        table.loc[row, "flag_codes"] = "not-linear"
    return table


def test_flagged_cells_do_not_count_where_they_are_left_out(paper_config):
    """Exact cells give their terms back; what the other two would change is told beside it."""
    few = paper_config.fourier.model_copy(update={"draws": 200})
    paper_config = paper_config.model_copy(update={"fourier": few})
    true = fourier.as_array(reference.coefficients("poppy_CP"))
    table = nine_terms("poppy_LP", 0.5)
    kept = fit_medium(table, paper_config, "lsq")
    np.testing.assert_allclose(kept.without_flagged, np.where(kept.keep, true, 0), atol=5e-3)
    assert np.abs(kept.used - true).max() > 0.01
    rule = paper_config.fit.model_copy(update={"flagged": "leave_out"})
    config = paper_config.model_copy(update={"fit": rule})
    bare = fit_medium(table, config, "lsq")
    np.testing.assert_allclose(bare.full, true, atol=1e-9)
    np.testing.assert_array_equal(bare.used, bare.without_flagged)
    np.testing.assert_allclose(bare.draws.mean(axis=0), bare.used, atol=2e-4)
    assert np.abs(kept.draws.mean(axis=0) - bare.used).max() > 0.01
    # the transform needs every cell, and nothing is known of it without some
    whole = fit_medium(table, paper_config, "dft-index")
    assert whole.reason == ""
    assert np.isnan(whole.without_flagged).all()
    assert np.isnan(fit_medium(nine_terms("poppy_LP", 0).assign(flag_codes=""), paper_config, "lsq")
                    .without_flagged).all()  # fmt: skip


def test_errors_of_zeta_by_name_make_its_whole_error(paper_config):
    """A table of noise and bed, 3 to 4: their squares add to that of the draws."""
    table = published("poppy_LP", 0.005)
    for c in "zx":
        table[column(c, "_noise")] = 0.003
        table[column(c, "_bed")] = 0.004
    fit = fit_medium(table, paper_config, "lsq")
    found = fit.zeta_errors
    assert set(found) == {"noise", "bed"}
    assert found["bed"] / found["noise"] == pytest.approx(4 / 3, rel=1e-6)
    whole = math.hypot(found["noise"], found["bed"])
    assert whole == pytest.approx(fit.zeta_draws.std(ddof=1), rel=0.15)
    for c in "zx":
        table[[column(c, "_lo"), column(c, "_hi")]] = np.nan
    silent = fit_medium(table, paper_config, "lsq")
    assert (silent.reason, silent.zeta_errors) == ("", {})
    assert np.isnan(silent.draws).all()
    assert silent.draws.shape == fit.draws.shape


def test_a_medium_without_a_level_plate_straight_down_is_no_reference(paper_config):
    tables = [published(medium) for medium in ("poppy_LP", "poppy_CP", "glass3mm_CP")]
    row = tables[1][(tables[1]["beta_deg"] == 0) & (tables[1]["gamma_deg"] == 90)].index
    tables[1] = tables[1].drop(index=row)
    fits = [fit_medium(table, paper_config, "lsq") for table in tables]
    assert [fit.reason for fit in fits] == ["", "", ""]
    assert math.isnan(fits[1].alpha_z)
    assert np.isnan(fits[1].alpha_z_draws).all()
    found = reference_of(fits, paper_config)
    assert (found.printed, found.media) == (False, ("poppy_LP", "glass3mm_CP"))
    assert found.chi == pytest.approx([fit.alpha_z / fit.zeta for fit in (fits[0], fits[2])])
    assert found.m0 == pytest.approx(
        (fits[0].used / fits[0].zeta + fits[2].used / fits[2].zeta) / 2
    )
    assert found.name == "this campaign, method lsq"


def test_the_interval_of_a_quantity_by_hand():
    """zeta 0.8 (0.7 to 1.0); two media have 1.9 and 2.1 of a quantity that is 2: t = 12.7062."""
    found = Scaled(0.8, 0.7, 1.0, 1.25, 1.2, 1.3, 0.95)
    own = np.array([[1.9, -1.9, 0.0], [2.1, -2.1, 0.0]])
    value, lo, hi = found.with_interval(np.array([2.0, -2.0, 0.0]), own)
    shape = 12.706205 * 0.1 * math.sqrt(2) * math.sqrt(1.5) * 0.8
    assert value == pytest.approx([1.6, -1.6, 0])
    assert lo == pytest.approx([1.6 - math.hypot(0.2, shape), -1.6 - math.hypot(0.4, shape), 0])
    assert hi == pytest.approx([1.6 + math.hypot(0.4, shape), -1.6 + math.hypot(0.2, shape), 0])


def test_a_sand_says_whether_it_is_scaled_with_the_published_media():
    names = "scaling routine (lsq)", "scaling routine (lsq, published media)"
    assert routines("lsq") == names
    assert tuple(routine("lsq", printed=printed) for printed in (False, True)) == names


def test_a_scaled_medium_keeps_its_test_at_another_level():
    medium = scale(0.9, 0.05).at(0.8)
    assert (medium.alpha_z, medium.alpha_z_se, medium.confidence) == (0.9, 0.05, 0.8)
    assert medium.reference == scale(0.9).reference
    for level in (0.5, 1.0):
        with pytest.raises(ValueError, match="level"):
            scale(0.9, confidence=level)
