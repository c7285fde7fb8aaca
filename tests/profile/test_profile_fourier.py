"""Both fits of the nine Fourier terms keep the symmetry of alpha and give Tables S2 and S3.

Fits: least squares (`lsq`), and the transform of the even grid (`dft-index`).
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from paper import BETA, GAMMA, by_hand

import rftfit
from rftfit.model import fourier

RANDOM = np.random.default_rng(2013)
TABLE_S2 = rftfit.published_table("table_s2").pivot_table("value", "medium", "coefficient")
GENERIC = TABLE_S2.loc["generic", [*fourier.TERMS]].to_numpy()


def cells(medium):
    return rftfit.TableProfile.published(medium).cells[2:]


@pytest.mark.parametrize("medium", ["poppy_LP", "glass3mm_CP"])
@pytest.mark.parametrize("case", ["grid", "holes", "scattered", "both ways"])
def test_lsq_is_plain_least_squares_over_the_measured_directions(case, medium):
    """Each direction has one weight: straight up and down too, and where mirror images were measured."""
    random = np.random.default_rng(40)
    beta, gamma, alpha = BETA, GAMMA, np.array(cells(medium))
    # two sides of a bed, and a plate planned at -90 and 90 degrees, are never quite alike
    alpha += random.normal(0, 0.02, alpha.shape)
    if case == "holes":
        lost = random.uniform(size=91) < 0.3
        # one of two mirror images, and a plate at -90 degrees without its other name
        lost[[12, 13, 90]], lost[[0, 78]] = True, False
        alpha[:, lost] = np.nan
    if case == "scattered":
        beta, gamma = random.uniform(-np.pi / 2, np.pi / 2, (2, 40))
        gamma[:10], gamma[10:15] = np.pi / 2, -np.pi / 2
        beta[5:10], beta[10:12] = -beta[:5], (0, np.pi / 2)
    if case == "both ways":
        gamma = np.where(random.uniform(size=91) < 0.5, GAMMA, np.pi - GAMMA)
        beta, gamma = np.append(beta, -beta[20:40]), np.append(gamma, np.pi - gamma[20:40])
    if gamma is not GAMMA:
        alpha = random.normal(fourier.evaluate(GENERIC, beta, gamma), 0.1)
    fitted = fourier.fit_lsq(beta, gamma, *alpha)
    assert_allclose(fitted, by_hand(beta, gamma, *alpha), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("bad", ["row", "line", "scattered", "coarse"])
def test_dft_index_says_where_it_does_not_apply(bad):
    is_measured = {
        "row": BETA > -1.0,
        "line": GAMMA != 0,
        "scattered": RANDOM.permutation(91) < 30,
        "coarse": np.isclose(BETA % (np.pi / 2), 0),
    }[bad]
    with pytest.raises(ValueError, match=r"\blsq\b"):
        fourier.fit_dft_index(
            BETA[is_measured], GAMMA[is_measured], *np.array(cells("poppy_LP"))[:, is_measured]
        )


def as_printed(medium):
    """The transform, with the terms that Table S2 prints as zero left out."""
    keep = TABLE_S2.loc[medium, [*fourier.TERMS]].to_numpy() != 0
    return np.where(keep, fourier.fit_dft_index(BETA, GAMMA, *cells(medium)), 0)


@pytest.mark.parametrize(
    ("medium", "fit", "chi", "chi_lsq"),
    [
        ("poppy_LP", "0.26", "1.37", 1.24),
        ("poppy_CP", "0.47", "1.19", 1.09),
        ("glass0.3mm_LP", "0.19", "1.27", 1.11),
        ("glass0.3mm_CP", "0.38", "1.05", 0.97),
        ("glass3mm_CP", "0.22", "1.33", 1.22),
    ],
)
def test_table_s3_to_the_printed_digit(medium, fit, chi, chi_lsq):
    zeta = as_printed(medium)[:5].sum()
    vertical = cells(medium)[0][3 * 13 + 12]
    assert (f"{zeta:.2f}", f"{vertical / zeta:.2f}") == (fit, chi)
    lsq = fourier.fit_lsq(BETA, GAMMA, *cells(medium))[:5].sum()
    assert vertical / lsq == pytest.approx(chi_lsq, abs=0.0051)


def test_kept_terms():
    coefficients = np.array([-1.0, 0.04, -0.06, 0.05, 0.9, 0, 0.051, -0.049, 2])
    kept = fourier.kept_terms(coefficients, 0.05)
    assert kept.tolist() == [True, False, True, False, True, False, True, False, True]
    assert fourier.kept_terms(np.zeros(9), 0.05).tolist() == [True] + [False] * 8


def test_as_many_cells_as_terms_are_enough():
    """Five cells give the five terms of alpha_z, and more than the four of alpha_x, exactly."""
    measured_cells = [15, 33, 49, 56, 73]
    alpha = np.full((2, 91), np.nan)
    alpha[:, measured_cells] = fourier.evaluate(
        GENERIC, BETA[measured_cells], GAMMA[measured_cells]
    )
    fitted = fourier.fit_lsq(BETA, GAMMA, *alpha)
    assert_allclose(fitted, GENERIC, atol=1e-9)
    alpha[:, 49] = np.nan
    with pytest.raises(ValueError, match=r"^4 .* 5 terms$"):
        fourier.fit_lsq(BETA, GAMMA, *alpha)


@pytest.mark.parametrize("row", [0, 3, 5])
def test_one_attack_angle_does_not_tell_the_terms_apart(row):
    """At one beta, A00 and A10 are one and the same: no number instead of one of many."""
    alpha = np.array(fourier.evaluate(GENERIC, BETA, GAMMA))
    alpha[:, np.arange(91) // 13 != row] = np.nan
    with pytest.raises(ValueError, match=r" 13 .* 5 "):
        fourier.fit_lsq(BETA, GAMMA, *alpha)
    if row == 3:  # a flat plate tells sin gamma and cos gamma, where nothing else is asked
        keep = np.isin(fourier.TERMS, ["A00", "B01", "C01"])
        assert np.count_nonzero(fourier.fit_lsq(BETA, GAMMA, *alpha, keep)) == 3
