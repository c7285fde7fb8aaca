"""Intervals of a scaled medium hold for a medium that was left out, and too few media are said."""

import json

import numpy as np
import pytest
from result_tables import LABORATORY, SAND, make_campaign, one_cell

from rftfit import FourierProfile, Reference, published_reference, reference, scale_by_paper

pytestmark = pytest.mark.usefixtures("work_folder")


def test_intervals_hold_for_a_medium_left_out():
    source = published_reference()
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
        profile = FourierProfile(true_coefficients).alpha(beta, gamma)
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
    facts = json.loads(rftfit("scale --pushes tilted.csv --json").out)
    assert (facts["alpha_x_over_known"] is None) == (alpha_x is None)
    printed = rftfit("scale --pushes tilted.csv --force").out
    assert printed.count("alpha_x was not measured") == (alpha_x is None)
    assert " nan" not in printed
    assert f"{100 * facts['draws_not_passive']:.0f} % of all" in printed
