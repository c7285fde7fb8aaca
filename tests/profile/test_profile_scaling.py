"""The coefficients and scale of a medium agree with hand calculation, and intervals are right.

Right: they cover the truth in simulations. Scale: zeta, by which the generic coefficients are
multiplied.
"""

import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from paper import BETA, GAMMA

import rftfit
from rftfit import reference
from rftfit.compare.coefficients import penetration_row
from rftfit.forces.outlines import model_leg
from rftfit.forces.prediction import find_peaks
from rftfit.measure.alpha import column
from rftfit.measure.flags import codes_of, remark
from rftfit.model import fourier
from rftfit.model.draws import alpha_draws, interval, measured_profile
from rftfit.model.scaling import (
    ALL_METHODS,
    AS_PRINTED,
    Scaled,
    alpha_of_test,
    fit_media,
    fit_terms,
    generic_interval,
    reference_of,
    scale_new_medium,
    vertical_penetration,
)

Z95 = 1.959963985
"""Factor of the normal distribution for an interval of 95 %."""
CHI = np.array([1.37, 1.19, 1.27, 1.05, 1.33])


def alpha_frame(medium, alpha, se):
    beta, gamma = np.meshgrid(reference.BETA_DEG, reference.GAMMA_DEG, indexing="ij")
    data: dict[str, object] = {
        "medium": medium,
        "beta_deg": beta.ravel(),
        "gamma_deg": gamma.ravel(),
    }
    for component, values in zip("zx", alpha, strict=True):
        flat = values.ravel()
        data |= {
            column(component): flat,
            column(component, "_se"): se,
            column(component, "_lo"): flat - Z95 * se,
            column(component, "_hi"): flat + Z95 * se,
        }
    return pd.DataFrame(data)


def published(medium, se=0.002):
    return alpha_frame(medium, reference.alpha_grid(medium), se)


NUMBERS = [column(c, q) for c in "zx" for q in ("", "_se", "_lo", "_hi")]


@pytest.mark.parametrize("empty", [[], [40]])
def test_draws_do_not_depend_on_the_order_of_the_rows(empty):
    table = published("poppy_LP")
    table.loc[empty, NUMBERS] = np.nan
    shuffled = table.sample(frac=1, random_state=3)
    both = (alpha_draws(table, 20, 7, 0.95) for table in (table, shuffled))
    for draws, shuffled_draws in zip(*both, strict=True):
        assert_array_equal(draws[:, shuffled.index], shuffled_draws)
        assert np.isnan(draws).any(axis=0).nonzero()[0].tolist() == empty


def test_draws_have_the_tables_errors():
    table = published("poppy_LP", 0.002)
    table.loc[table["beta_deg"] == 30, [column("z", "_lo"), column("z", "_hi")]] += [-0.01, 0.01]
    draws = np.reshape(alpha_draws(table, 4000, 7, 0.95), (2, 4000, 7, 13))
    assert_allclose(draws.mean(axis=1), reference.alpha_grid("poppy_LP"), atol=8e-4)
    spread = draws[0].std(axis=0)
    assert_allclose(spread[[1, 2, 3, 5]], 0.002, rtol=0.08)
    assert_allclose(spread[4], 0.002 + 0.01 / Z95, rtol=0.08)
    # independent cells, but beta = -90 and 90 are one plate
    assert_array_equal(np.argsort(draws[0, :, 0, 4]), np.argsort(draws[0, :, -1, 4]))
    for cell_draws in (draws[0, :, 2, 4], draws[1, :, 1, 4]):
        assert abs(np.corrcoef(draws[0, :, 1, 4], cell_draws)[0, 1]) < 0.06


def test_percentile_interval():
    draws = np.random.default_rng(0).permutation(np.arange(1001.0))[:, None]
    for level, ends in ((0.95, (25, 975)), (0.5, (250, 750))):
        assert np.ravel(interval(draws, level)) == pytest.approx(ends)


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
        draws = fourier.fit_lsq(BETA, GAMMA, *alpha_draws(table, 250, seed, 0.95))
        lo, hi = interval(draws, 0.95)
        inside += (lo <= true) & (hi >= true)
    assert 0.93 <= inside.sum() / 2700 <= 0.97
    assert (inside / 300 > 0.9).all()


def test_fit_media_with_empty_cells(paper_config):
    table = published("poppy_LP")
    table.loc[40, NUMBERS] = np.nan
    lsq, dft, printed = fit_media([table], paper_config)
    whole, *_ = fit_media([published("poppy_LP")], paper_config)
    assert lsq.why == ()
    assert_allclose(lsq.full, whole.full, atol=0.003)
    assert np.isfinite(lsq.draws).all()
    assert (dft.method, printed.method, dft.medium) == ("dft-index", AS_PRINTED, "poppy_LP")
    for fit in (dft, printed):
        assert fit.why == (remark("empty-cells", found=1, wanted=91),)
        assert np.isnan([fit.used, fit.full]).all()
        assert math.isnan(fit.zeta)
    table.loc[table["beta_deg"] != 0, NUMBERS] = np.nan
    level_fit = fit_media([table], paper_config)[0]
    assert (level_fit.medium, level_fit.method) == ("poppy_LP", "lsq")
    assert codes_of(level_fit.why) == "no-fit"
    assert re.findall(r"\d+", level_fit.reason) == ["12", "5"]
    table[NUMBERS] = np.nan
    none = fit_media([table], paper_config)
    assert codes_of(none[0].why) == "no-fit"
    assert re.findall(r"\d+", none[0].reason) == ["0", "5"]
    assert all(fit.why and np.isnan(fit.draws).all() for fit in none)


def test_one_medium_of_its_own_is_not_enough_for_a_sand(paper_config):
    """The interval for a further medium is the scatter between media, which one does not show."""
    fits = fit_media([published("poppy_LP"), published("poppy_CP")], paper_config)
    of_one_medium = reference_of(
        [fit for fit in fits if fit.medium == "poppy_LP"], paper_config.fourier.method
    )
    assert of_one_medium.printed
    assert of_one_medium.chi.size == 5
    assert codes_of(of_one_medium.remarks) == "published-media"
    scale_new_medium(0.5, 0.01, of_one_medium.chi)
    of_two_media = reference_of(fits, paper_config.fourier.method)
    assert (of_two_media.printed, of_two_media.media, of_two_media.remarks) == (
        False,
        ("poppy_LP", "poppy_CP"),
        (),
    )
    # by the method of the config: fits by others do not make up the number
    other_fits = [fit for fit in fits if fit.medium == "poppy_LP" or fit.method != "lsq"]
    assert reference_of(other_fits, paper_config.fourier.method).printed
    assert reference_of([], paper_config.fourier.method).printed


@pytest.mark.parametrize(
    ("alpha", "se", "chi", "student"),
    [
        (0.9, 0.0, CHI, 2.776445),
        (0.9, 0.05, CHI, 2.776445),
        (1.0, 0.0, [1.25, 1.25, 1.25], 4.302653),
        # two media: one degree of freedom
        (0.4, 0.0, [1.2, 1.3], 12.706205),
    ],
)
def test_intervals_by_hand(alpha, se, chi, student):
    """Half widths on the logarithm add in quadrature: scatter of chi for one further medium, and error."""
    scaled = scale_new_medium(alpha, se, np.array(chi))
    media, logs = len(chi), [math.log(value) for value in chi]
    mean = sum(logs) / media
    scatter = sum((value - mean) ** 2 for value in logs) / (media - 1)
    of_chi = student * math.sqrt(scatter * (1 + 1 / media))
    of_zeta = math.hypot(of_chi, 1.962339 * se / alpha)
    assert scaled.chi == pytest.approx(sum(chi) / media)
    assert scaled.zeta == pytest.approx(alpha * media / sum(chi))
    for half, value, lo, hi in (
        (of_chi, scaled.chi, scaled.chi_lo, scaled.chi_hi),
        (of_zeta, scaled.zeta, scaled.zeta_lo, scaled.zeta_hi),
    ):
        assert (lo, hi) == pytest.approx(
            (value * math.exp(-half), value * math.exp(half)), rel=1e-6
        )


def test_an_error_that_is_not_known_gives_no_interval():
    scaled = scale_new_medium(0.42, np.nan, CHI)
    assert scaled.zeta == pytest.approx(0.42 / CHI.mean())
    assert np.isnan([scaled.zeta_lo, scaled.zeta_hi]).all()
    assert np.isfinite([scaled.chi_lo, scaled.chi_hi]).all()


@pytest.mark.parametrize("media", [2, 3, 5])
@pytest.mark.parametrize("ratio", [0.1, 0.3, 1.0, 3.0])
def test_joined_half_widths_cover_at_least_as_stated(media, ratio):
    """Error of the test beside the scatter of few media; one quantile for both gives down to 87 %."""
    random = np.random.default_rng(5)
    inside = 0
    for _ in range(4000):
        chi = np.exp(random.normal(0, 0.02, media + 1))
        measured = chi[-1] * np.exp(random.normal(0, 0.02 * ratio))
        scaled = scale_new_medium(measured, 0.02 * ratio * measured, chi[:-1])
        inside += scaled.zeta_lo <= 1 <= scaled.zeta_hi
    assert 0.94 <= inside / 4000 <= 0.995


@pytest.mark.parametrize(
    ("alpha", "se", "chi", "match"),
    [
        *(
            (alpha, 0.0, CHI, "must be a positive number")
            for alpha in (0, -0.3, math.nan, math.inf)
        ),
        (0.9, -0.1, CHI, "standard error"),
        *((0.9, 0.0, chi, "chi") for chi in ([], [1.2], [1.2, 0.0], [1.2, math.nan])),
    ],
)
def test_what_gives_no_scale(alpha, se, chi, match):
    with pytest.raises(ValueError, match=match):
        scale_new_medium(alpha, se, np.array(chi))


def test_generic_interval_is_that_of_a_mean_of_media(paper_config):
    """Errors of M / zeta of two media, 0.03 and 0.04, make sqrt(0.03^2 + 0.04^2) / 2 of M0."""
    random = np.random.default_rng(23)
    plain = fit_media([published("poppy_LP"), published("poppy_CP")], paper_config)[:2]
    fits: list[Any] = []
    for fit, error in zip(plain, (0.03, 0.04), strict=True):
        draws = np.tile(fit.used, (20000, 1))
        draws[:, 5:] += error * fit.zeta * random.standard_normal((20000, 4))
        zetas = vertical_penetration(draws)
        fits.append(SimpleNamespace(draws=draws, zeta_draws=zetas, dof=1e6))
    lo, hi = generic_interval(fits, 0.95)
    middle = np.mean([fit.used / fit.zeta for fit in plain], axis=0)
    assert_allclose((lo + hi)[5:] / 2, middle[5:], atol=1e-3)
    assert_allclose((hi - lo)[5:] / 2, Z95 * 0.025, rtol=0.03)
    assert_allclose((hi - lo)[:5], 0, atol=1e-9)


def test_a_medium_without_resistance_has_a_reason(paper_config):
    z, x = reference.alpha_grid("poppy_LP")
    fit = fit_terms(alpha_frame("poppy_LP", (0 * z, x), 0.002), paper_config, "lsq")
    assert codes_of(fit.why) == "zero-push"
    assert not fit.counts
    assert math.isnan(penetration_row(fit)["chi"])  # type: ignore[arg-type]


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
    for se, expected in ((0.01, 0.1 / 1.962339), (0.2, 0.2)):
        alpha_and_se = alpha_of_test(
            pd.Series(dict(zip(names, (0.5, se, 0.4, 0.6), strict=True))), 0.95
        )
        assert alpha_and_se == pytest.approx((0.5, expected), rel=1e-6)


def nine_terms(medium, off):
    """Alpha of nine known terms; two cells are flagged, and their alpha_z and alpha_x are `off`."""
    true = fourier.as_array(reference.coefficients("poppy_CP"))
    table = alpha_frame(medium, fourier.evaluate(true, BETA, GAMMA), 0.002)
    values = [column(c, end) for c in "zx" for end in ("", "_lo", "_hi")]
    table.loc[[44, 60], values] += off
    return table.assign(flagged=table.index.isin([44, 60]))


def test_flagged_cells_do_not_count_where_they_are_left_out(paper_config):
    """Exact cells give their terms back; what the other two would change is told beside it."""
    few_draws = paper_config.fourier.model_copy(update={"draws": 200})
    paper_config = paper_config.model_copy(update={"fourier": few_draws})
    true = fourier.as_array(reference.coefficients("poppy_CP"))
    table = nine_terms("poppy_LP", 0.5)
    kept = fit_terms(table, paper_config, "lsq")
    assert_allclose(kept.without_flagged, np.where(kept.keep, true, 0), atol=5e-3)
    assert np.abs(kept.used - true).max() > 0.01
    rule = paper_config.fit.model_copy(update={"flagged": "leave_out"})
    bare = fit_terms(table, paper_config.model_copy(update={"fit": rule}), "lsq")
    assert_allclose(bare.full, true, atol=1e-9)
    assert_array_equal(bare.used, bare.without_flagged)
    assert_allclose(bare.draws.mean(axis=0), bare.used, atol=2e-4)
    assert np.abs(kept.draws.mean(axis=0) - bare.used).max() > 0.01
    # the transform needs every cell, and nothing is known of it without some
    whole = fit_terms(table, paper_config, "dft-index")
    none = fit_terms(nine_terms("poppy_LP", 0).assign(flagged=False), paper_config, "lsq")
    assert whole.reason == ""
    assert np.isnan([whole.without_flagged, none.without_flagged]).all()


def test_errors_of_zeta_by_name_make_its_whole_error(paper_config):
    """A table of noise and bed, 3 to 4: their squares add to that of the draws."""
    table = published("poppy_LP", 0.005)
    for c in "zx":
        table[[column(c, "_noise"), column(c, "_bed")]] = 0.003, 0.004
    fit = fit_terms(table, paper_config, "lsq")
    zeta_errors = fit.zeta_errors
    assert set(zeta_errors) == {"noise", "bed"}
    assert zeta_errors["bed"] / zeta_errors["noise"] == pytest.approx(4 / 3, rel=1e-6)
    whole = math.hypot(zeta_errors["noise"], zeta_errors["bed"])
    assert whole == pytest.approx(fit.zeta_draws.std(ddof=1), rel=0.15)
    table[[column(c, end) for c in "zx" for end in ("_lo", "_hi")]] = np.nan
    silent = fit_terms(table, paper_config, "lsq")
    assert (silent.reason, silent.zeta_errors) == ("", {})
    assert np.isnan(silent.draws).all()
    assert silent.draws.shape == fit.draws.shape


def test_a_medium_without_a_level_plate_straight_down_is_no_reference(paper_config):
    tables = [published(medium) for medium in ("poppy_LP", "poppy_CP", "glass3mm_CP")]
    tables[1] = tables[1].query("beta_deg != 0 or gamma_deg != 90")
    fits = [fit_terms(table, paper_config, "lsq") for table in tables]
    assert [fit.reason for fit in fits] == ["", "", ""]
    assert math.isnan(fits[1].alpha_z)
    assert np.isnan(fits[1].alpha_z_draws).all()
    campaign_reference = reference_of(fits, paper_config.fourier.method)
    assert (campaign_reference.printed, campaign_reference.media) == (
        False,
        ("poppy_LP", "glass3mm_CP"),
    )
    assert campaign_reference.chi == pytest.approx(
        [fit.alpha_z / fit.zeta for fit in (fits[0], fits[2])]
    )
    generic = (fits[0].used / fits[0].zeta + fits[2].used / fits[2].zeta) / 2
    assert campaign_reference.m0 == pytest.approx(generic)
    assert campaign_reference.name.endswith(" lsq")


def test_the_interval_of_a_quantity_by_hand():
    """zeta 0.8 (0.7 to 1.0); two media have 1.9 and 2.1 of a quantity that is 2: t = 12.7062."""
    scaled = Scaled(0.8, 0.7, 1.0, 1.25, 1.2, 1.3, 0.95)
    media_values = np.array([[1.9, -1.9, 0.0], [2.1, -2.1, 0.0]])
    value, lo, hi = scaled.with_interval(np.array([2.0, -2.0, 0.0]), media_values)
    shape = 12.706205 * 0.1 * math.sqrt(2) * math.sqrt(1.5) * 0.8
    assert value == pytest.approx([1.6, -1.6, 0])
    assert lo == pytest.approx([1.6 - math.hypot(0.2, shape), -1.6 - math.hypot(0.4, shape), 0])
    assert hi == pytest.approx([1.6 + math.hypot(0.4, shape), -1.6 + math.hypot(0.2, shape), 0])


def test_errors_of_a_part_of_the_directions(paper_config, tmp_path):
    """A peak where alpha has no error has none; of an image with and one without, the mean has none."""
    table = published("poppy_LP")
    of_error = [column(c, end) for c in "zx" for end in ("_se", "_lo", "_hi")]
    table.loc[table["beta_deg"] <= 0, of_error] = math.nan
    partly, bare = (measured_profile(table, paper_config, draws=draws) for draws in (True, False))
    leg = model_leg("c_leg")
    for peak, expected in zip(find_peaks(partly, leg), find_peaks(bare, leg), strict=True):
        assert (peak.name, peak.value, peak.position) == (
            expected.name,
            expected.value,
            expected.position,
        )
    assert math.isnan(find_peaks(partly, leg)[0].lo)
    rftfit.write_profile(tmp_path / "partly.json", partly)
    same = rftfit.read_profile(tmp_path / "partly.json")
    assert find_peaks(same, leg)[0].value == pytest.approx(find_peaks(bare, leg)[0].value, rel=1e-4)
    # between scattered directions draws of some would be another table
    table["gamma_deg"] += table["beta_deg"] / 10
    assert measured_profile(table, paper_config).spread is None
