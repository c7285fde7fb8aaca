"""The law by which stress in a natural sand grows with depth is named, or said to be unknown."""

from __future__ import annotations

import numpy as np
import pytest
from coverage_levels import measured
from depth_laws import LAWS, write_campaign

from rftfit.campaign.load import load_campaign
from rftfit.measure.laws import find_crust
from rftfit.workflow.measure import checks

CASES = {
    # patches of the bed bend one push as much as a law that would matter
    "alpha z": ("not checked", "law-open", ""),
    "z^1.4": ("failed", "law-power", "depth^1.4"),
    "z^2": ("failed", "law-power", "depth^"),
    "c + alpha z, c/alpha = 10 mm": ("failed", "law-intercept", "c = "),
    "crust of 0.4 cm, breaks": ("failed", "law-crust", " 1 of 1 "),
}
"""Law of the simulated stress: verdict, code, and what is found."""


def judged(tmp_path, law, pushes, end_cm=5.0, seed=2):
    results = measured(load_campaign(write_campaign(tmp_path, LAWS[law], pushes, end_cm, seed)), 0)
    verdicts, _, _, at_depth, *_ = checks(results, "sand")
    return verdicts.set_index("check").loc["linearity"], at_depth


@pytest.mark.parametrize("law", CASES)
def test_law_of_one_push(tmp_path, law):
    row, at_depth = judged(tmp_path, law, 1)
    verdict, code, number = CASES[law]
    assert (row["verdict"], row["code"]) == (verdict, code)
    assert number in row["found"]
    # stress over depth at stated depths where the law is known
    assert bool(len(at_depth)) == (code in ("law-power", "law-intercept"))


def test_five_pushes_tell_a_line(tmp_path):
    row, _ = judged(tmp_path, "alpha z", 5)
    assert (row["verdict"], row["code"]) == ("passed", "law-line")
    assert "depth^1.0" in row["found"]


def test_stress_over_depth_follows_the_law_that_was_told(tmp_path):
    """Of c + alpha depth it falls with depth, within its interval."""
    _, at_depth = judged(tmp_path, "c + alpha z, c/alpha = 10 mm", 5)
    with_alpha = at_depth.dropna(subset=["alpha_z_N_per_cm3"])
    assert len(with_alpha) > 1
    truth = 0.3 * (1 + 1.0 / with_alpha["depth_cm"])
    assert (with_alpha["alpha_z_lo_N_per_cm3"] < truth).all()
    assert (truth < with_alpha["alpha_z_hi_N_per_cm3"]).all()


def test_thirty_pushes_tell_less_than_one_can(tmp_path):
    assert judged(tmp_path, "z^1.27", 30)[0]["code"] == "law-power"


@pytest.mark.parametrize(
    ("disturb", "is_crust"),
    [
        (lambda depth: 1.2 * np.exp(-(((depth - 0.4) / 0.15) ** 2)), True),
        (lambda depth: 0 * depth, False),
        # stick-slip falls again and again
        (lambda depth: 0.5 * (8 * depth % 1 < 0.5), False),
        # a stone lies deep
        (lambda depth: 3 * np.exp(-(((depth - 4) / 0.2) ** 2)), False),
    ],
)
def test_a_crust_is_one_peak_near_the_surface(disturb, is_crust):
    depth = np.linspace(0, 5, 400)
    crust = find_crust(depth, 0.3 * (depth + disturb(depth)))
    assert (crust is not None) == is_crust
    if crust is not None:
        assert crust.depth_cm == pytest.approx(0.45, abs=0.1)
        line_N_per_cm2 = 0.3 * crust.depth_cm
        broken_N_per_cm2 = 0.3 * (crust.depth_cm + disturb(crust.depth_cm))
        # a moving mean lowers the peak
        assert 0.85 < (crust.excess + 1) * line_N_per_cm2 / broken_N_per_cm2 < 1
