"""Tables that commands make campaigns of: alpha with a free intercept is the slope, and two rows of a direction have an interval."""

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import Folder

INTERCEPT, SLOPE = 1.0, 0.5
"""Stress of all directions, N/cm^2 and N/cm^3."""


def alpha_of(root, option, rows, **settings):
    """Alpha table of a campaign that `init` makes of rows of text, with sections of its config."""
    table = root / "sand.csv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    folder = Folder(root / "lab")
    completed = Folder(root).rftfit("init", option, "sand.csv", "lab")
    assert completed.returncode == 0, completed.stderr
    config = folder.root / "config" / "config.yaml"
    with config.open("a", encoding="utf-8") as stream:
        stream.write(yaml.safe_dump(settings) if settings else "")
    folder.run_here("checks")
    alpha = pd.read_csv(folder.root / "results" / "alpha" / "sand.csv")
    return alpha.set_index(["beta_deg", "gamma_deg"])


def test_alpha_with_a_free_intercept_is_the_slope(tmp_path):
    """Of many depths, of few, of level runs one after the other; a single depth has no slope, and says so."""
    header = "beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2,run_id"
    depths = {
        (0, 90): np.linspace(0.5, 8, 31),
        (30, 45): np.array([2.0, 4.0, 7.0]),
        (30, 0): np.array([2.5, 5.0, 7.5]),
        (60, 45): np.array([3.0]),
    }
    rows = [
        f"{beta},{gamma},{depth},{INTERCEPT + SLOPE * depth},0,r{beta}_{gamma}{f'_{depth}' * (gamma == 0)}"
        for (beta, gamma), depths_cm in depths.items()
        for depth in depths_cm
    ]
    alpha = alpha_of(tmp_path, "--stress-table", [header, *rows], fit={"law": "free_intercept"})
    slopes = alpha["alpha_z_N_per_cm3"]
    for direction in ((0, 90), (30, 45), (30, 0)):
        assert slopes[direction] == pytest.approx(SLOPE, abs=1e-6)
    assert np.isnan(slopes[60, 45])
    assert "few-points" in alpha.loc[(60, 45), "reason_code"]


def test_two_rows_of_a_direction_have_an_interval(tmp_path):
    """What is usual of beds counts for two degrees of freedom, where two rows have one."""
    header = (
        "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3,"
        "alpha_z_se_N_per_cm3,alpha_x_se_N_per_cm3"
    )
    rows = ["0,90,1.433,0,0.02,0.02", "0,90,1.738,0,0.02,0.02"]
    cell = alpha_of(tmp_path, "--alpha-table", [header, *rows]).loc[(0, 90)]
    assert cell["alpha_z_N_per_cm3"] == pytest.approx(1.5855)
    # Student's quantile for two degrees of freedom
    assert cell["alpha_z_hi_N_per_cm3"] == pytest.approx(1.5855 + 4.302653 * 0.1525, abs=1e-3)
    assert 0.8 < cell["alpha_z_lo_N_per_cm3"] < 1.433
    assert 1.738 < cell["alpha_z_hi_N_per_cm3"] < min(2.4, cell["alpha_z_hi_next_N_per_cm3"])


def test_a_direction_of_few_depths_has_alpha_at_depth(tmp_path):
    """By the power that the pushes of many depths show."""
    random = np.random.default_rng(4)
    header = "beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2,run_id"
    rows = []
    for beta, gamma in [(b, g) for b in (0, 30, 60, -30) for g in (90, 60, 45)]:
        for depth in np.arange(1.0, 6.5, 1.0 if beta == 60 else 0.25):
            stress = 0.5 * depth**1.6 * (1 + 0.002 * random.normal())
            rows.append(f"{beta},{gamma},{depth},{stress},{0.3 * stress},r{beta}_{gamma}")
    alpha_of(tmp_path, "--stress-table", [header, *rows])
    cells = pd.read_csv(tmp_path / "lab" / "results" / "alpha_at_depth" / "sand.csv")
    few = cells[(cells["beta_deg"] == 60) & (cells["depth_cm"] == 5)]
    assert len(few) == 3
    np.testing.assert_allclose(few["alpha_z_N_per_cm3"], 0.5 * 5**0.6, rtol=5e-3)
    assert few["alpha_z_se_N_per_cm3"].gt(0).all()
