"""`rftfit scale` agrees with hand calculation, has right intervals and names wrong input."""

import json
import math
from typing import Any

import numpy as np
import pytest
from result_tables import LABORATORY, SAND, make_campaign, one_cell, read_output

from rftfit import reference
from rftfit.model.fourier import TERMS, evaluate
from rftfit.model.scaling import Reference, published, scale_by_paper

T_4 = 2.776445  # Student, two-sided 95 %, four degrees of freedom
CHI = (1.37, 1.19, 1.27, 1.05, 1.33)  # Table S3
M0 = (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)  # Table S2


pytestmark = pytest.mark.usefixtures("work_folder")


def as_json(output):
    content: dict[str, Any] = json.loads(output.out)
    return content


def test_numbers_by_hand(rftfit, work_folder):
    output = rftfit("scale --profile generic --alpha 0.9 --method dft-index --json")
    assert output.err == ""
    result = as_json(output)
    assert result["scaled_from"] == "published Tables S2 and S3, method dft-index as printed"
    mean = sum(CHI) / 5
    logs = [math.log(chi) for chi in CHI]
    middle = sum(logs) / 5
    spread = math.sqrt(sum((x - middle) ** 2 for x in logs) / 4 * (1 + 1 / 5))
    zeta = 0.9 / mean
    assert result["zeta"]["value"] == pytest.approx(zeta)
    assert result["zeta"]["lo"] == pytest.approx(zeta * math.exp(-T_4 * spread), rel=1e-3)
    assert result["zeta"]["hi"] == pytest.approx(zeta * math.exp(T_4 * spread), rel=1e-3)
    assert result["chi"]["value"] == pytest.approx(mean)
    coefficients = result["coefficients_N_per_cm3"]
    assert [coefficients[term]["value"] for term in TERMS] == pytest.approx([zeta * m for m in M0])
    assert all(
        coefficients[term]["lo"] < coefficients[term]["value"] < coefficients[term]["hi"]
        for term in TERMS
    )

    table = read_output(work_folder / "alpha.csv").set_index(["beta_deg", "gamma_deg"])
    assert len(table) == 7 * 13
    beta_deg, gamma_deg = table.index.levels
    assert beta_deg.tolist() == list(reference.BETA_DEG)
    assert gamma_deg.tolist() == pytest.approx(reference.GAMMA_DEG, abs=0.005)
    # generic profile at (30, 45) and (0, 90) deg: 0.734 and 0.294, 1 and 0
    assert table.loc[30, 45]["alpha_z_N_per_cm3"] == pytest.approx(0.734 * zeta, abs=6e-4)
    assert table.loc[30, 45]["alpha_x_N_per_cm3"] == pytest.approx(0.294 * zeta, abs=6e-4)
    straight_down = table.loc[0, 90]
    assert straight_down["alpha_z_N_per_cm3"] == pytest.approx(zeta, abs=1e-6)
    assert straight_down["alpha_x_N_per_cm3"] == 0
    # there the nine terms of every medium add up to zeta, and miss by chi what was measured: it is in the interval
    chi = np.array(CHI)
    missed = np.hypot(chi.std(ddof=1) * math.sqrt(1 + 1 / 5), chi.mean() - 1) * T_4 * zeta
    ends = (result["zeta"][end] for end in ("lo", "hi"))
    below, above = (math.hypot(end - zeta, missed) for end in ends)
    assert straight_down["alpha_z_lo_N_per_cm3"] == pytest.approx(zeta - below, abs=0.03)
    assert straight_down["alpha_z_hi_N_per_cm3"] == pytest.approx(zeta + above, abs=0.03)
    assert straight_down["alpha_z_hi_N_per_cm3"] > 0.9


def test_intervals_hold_for_a_medium_left_out():
    source = published()
    beta, gamma = np.radians(reference.BETA_DEG)[:, None], np.radians(reference.GAMMA_DEG)
    of_coefficients, of_profiles = [], []
    for i, medium in enumerate(source.media):
        kept_indices = [j for j in range(5) if j != i]
        scaled = source.scaled[kept_indices]
        four = Reference(
            "",
            tuple(source.media[j] for j in kept_indices),
            source.chi[kept_indices],
            scaled.mean(axis=0),
            scaled,
        )
        alpha = reference.alpha_grid(medium)[0][3, -1]
        result = scale_by_paper(alpha, 0.0, four)
        true_coefficients = source.scaled[i] * alpha / source.chi[i]
        _, lo, hi = result.coefficients_with_interval()
        of_coefficients.append((lo - 1e-9 <= true_coefficients) & (true_coefficients <= hi + 1e-9))
        profile = evaluate(true_coefficients, beta, gamma)
        for truth, (_, low, high) in zip(profile, result.alpha(beta, gamma), strict=True):
            of_profiles.append((low - 1e-9 <= truth) & (truth <= high + 1e-9))
    # 45 coefficients and 910 alphas of five media; 0.95 is the promise, five media are few
    assert np.mean(of_coefficients) > 0.9
    assert np.mean(of_profiles) > 0.93


@pytest.mark.parametrize(
    ("alpha", "warned"), [(0.049, True), (0.05, False), (5, False), (900, True)]
)
def test_another_unit(rftfit, alpha, warned):
    assert ("another unit" in rftfit("scale --alpha", alpha).err) is warned


CAMPAIGN_MEDIA = ("poppy_LP", "glass3mm_CP")


@pytest.fixture
def results(work_folder):
    """Results of a campaign of two media."""
    alpha = {medium: reference.alpha_grid(medium) for medium in CAMPAIGN_MEDIA}
    return make_campaign(work_folder / "c", dict.fromkeys(CAMPAIGN_MEDIA, LABORATORY), alpha)


def test_one_medium_of_its_own_is_not_enough(refusal, work_folder):
    alpha = {"a": reference.alpha_grid("poppy_LP"), "sand": one_cell(0.7)}
    folder = make_campaign(work_folder / "one", {"a": LABORATORY, "sand": SAND}, alpha)
    assert "at least two laboratory media" in refusal(
        "scale --profile generic --alpha 0.9 --results", folder
    )
    assert not (work_folder / "alpha.csv").exists()


@pytest.mark.parametrize("alpha_x", [None, 0.3])
def test_alpha_x_that_no_tilted_push_measured_is_named(rftfit, work_folder, alpha_x):
    name, cell = ("", "") if alpha_x is None else (",alpha_x_N_per_cm3", f",{alpha_x}")
    straight = "" if alpha_x is None else ",0"
    (work_folder / "tilted.csv").write_text(
        f"beta_deg,gamma_deg,alpha_z_N_per_cm3{name}\n0,90,0.9{straight}\n30,45,0.62{cell}\n"
    )
    facts = as_json(rftfit("scale --pushes tilted.csv --json"))
    assert (facts["alpha_x_over_known"] is None) == (alpha_x is None)
    printed = rftfit("scale --pushes tilted.csv --force").out
    assert printed.count("alpha_x was not measured") == (alpha_x is None)
    assert " nan" not in printed
    assert f"{100 * facts['draws_not_passive']:.0f} % of all" in printed
