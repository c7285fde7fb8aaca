"""The coefficients and scale of a medium agree with hand calculation, and intervals are right.

Right: they cover the truth in simulations. Scale: zeta, by which the generic coefficients are
multiplied.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from paper import BETA, GAMMA
from result_tables import SE, alpha_frame

import rftfit
from rftfit.model.draws import alpha_draws, interval
from rftfit.model.fourier import fit_lsq
from rftfit.model.scaling import fit_terms

NINE = rftfit.published_medium("poppy_CP", "fourier")
TRUE = np.concatenate(NINE.parameters)
"""Nine coefficients of a published medium."""
CHI = np.array([1.37, 1.19, 1.27, 1.05, 1.33])


def test_draws_do_not_depend_on_the_order_of_the_rows():
    table = alpha_frame("poppy_LP", np.array(NINE.alpha(BETA, GAMMA)))
    shuffled = table.sample(frac=1, random_state=3)
    both = (alpha_draws(rows, 20, 7, 0.95) for rows in (table, shuffled))
    for draws, draws_of_shuffled in zip(*both, strict=True):
        assert_array_equal(draws[:, shuffled.index], draws_of_shuffled)


def test_intervals_of_coefficients_cover():
    """300 campaigns of a known medium: the bootstrap intervals of the nine terms cover it."""
    random = np.random.default_rng(17)
    alpha = np.array(NINE.alpha(BETA, GAMMA))
    inside = np.zeros(9)
    for seed in range(300):
        noise = random.normal(0, SE, (2, 91))
        noise[:, :13] = noise[:, -13:]
        table = alpha_frame("m", alpha + noise)
        draws = fit_lsq(BETA, GAMMA, *alpha_draws(table, 250, seed, 0.95))
        lo, hi = interval(draws, 0.95)
        inside += (lo <= TRUE) & (hi >= TRUE)
    assert 0.93 <= inside.sum() / 2700 <= 0.97
    assert (inside / 300 > 0.9).all()


def scale_by(alpha, se, chi):
    """Scale a medium from known ones of these chi."""
    known = replace(rftfit.published_reference(), chi=np.array(chi))
    return rftfit.scale_by_paper(alpha, se, known)


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
    scaled = scale_by(alpha, se, chi)
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


@pytest.mark.parametrize("media", [2, 3, 5])
@pytest.mark.parametrize("ratio", [0.1, 0.3, 1.0, 3.0])
def test_joined_half_widths_cover_at_least_as_stated(media, ratio):
    """Error of the test beside the scatter of few media; one quantile for both gives down to 87 %."""
    random = np.random.default_rng(5)
    inside = 0
    for _ in range(4000):
        chi = np.exp(random.normal(0, 0.02, media + 1))
        measured = chi[-1] * np.exp(random.normal(0, 0.02 * ratio))
        scaled = scale_by(measured, 0.02 * ratio * measured, chi[:-1])
        inside += scaled.zeta_lo <= 1 <= scaled.zeta_hi
    assert 0.94 <= inside / 4000 <= 0.995


def test_a_medium_without_resistance_has_a_reason(paper_config):
    *_, z, x = rftfit.TableProfile.published("poppy_LP").cells
    fit = fit_terms(alpha_frame("poppy_LP", (0 * z, x)), paper_config, "lsq")
    assert [why.code for why in fit.why] == ["zero-push"]
    assert not fit.counts


def nine_terms(medium, off):
    """Alpha of nine known terms; two cells are flagged, and their alpha_z and alpha_x are `off`."""
    table = alpha_frame(medium, np.array(NINE.alpha(BETA, GAMMA)))
    values = [f"alpha_{c}{end}_N_per_cm3" for c in "zx" for end in ("", "_lo", "_hi")]
    table.loc[[44, 60], values] += off
    return table.assign(flagged=table.index.isin([44, 60]))


def test_flagged_cells_do_not_count_where_they_are_left_out(paper_config):
    """Exact cells give their terms back; what the other two would change is told beside it."""
    few_draws = paper_config.fourier.model_copy(update={"draws": 200})
    paper_config = paper_config.model_copy(update={"fourier": few_draws})
    table = nine_terms("poppy_LP", 0.5)
    kept = fit_terms(table, paper_config, "lsq")
    assert_allclose(kept.without_flagged, np.where(kept.keep, TRUE, 0), atol=5e-3)
    assert np.abs(kept.used - TRUE).max() > 0.01
    rule = paper_config.fit.model_copy(update={"flagged": "leave_out"})
    bare = fit_terms(table, paper_config.model_copy(update={"fit": rule}), "lsq")
    assert_allclose(bare.full, TRUE, atol=1e-9)
    assert_array_equal(bare.used, bare.without_flagged)
    assert_allclose(bare.draws.mean(axis=0), bare.used, atol=2e-4)
    assert np.abs(kept.draws.mean(axis=0) - bare.used).max() > 0.01
    # the transform needs every cell, and nothing is known of it without some
    whole = fit_terms(table, paper_config, "dft-index")
    none = fit_terms(nine_terms("poppy_LP", 0).assign(flagged=False), paper_config, "lsq")
    assert whole.reason == ""
    assert np.isnan([whole.without_flagged, none.without_flagged]).all()
