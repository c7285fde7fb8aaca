"""Where stress is curved, alpha at stated depths has intervals that contain the true force."""

import numpy as np
import pandas as pd
import pytest
from coverage_files import measured, written
from coverage_levels import alpha_cells
from curved_depths import DEPTHS_CM, forces_held
from disturbances import power_law
from seeds import seeds

from rftfit.campaign.load import load_campaign
from rftfit.measure.depths import alpha_at_depths, curved_law
from rftfit.page.tables import tabulate_at_depths
from rftfit.workflow import measure


@pytest.mark.statistics
def test_intervals_hold_the_force_at_stated_depths():
    """`make curved` is the same with 400 campaigns and other powers."""
    coverage = forces_held("poppy_LP", seeds(10, 4), 5, {"power": 1.3})
    assert list(coverage["cells"]) == [156, 132, 108]
    assert coverage["inside"].between(*seeds((0.92, 0.98), (0.88, 1))).all()
    assert (coverage["width"] < seeds(1.3, 2)).all()


def test_logs_of_a_curved_medium_give_alpha_at_depths(tmp_path):
    power = 1.1
    results = measured(load_campaign(written(tmp_path, {"power": power}, 0, 3, 200)))
    (medium,) = results.media
    verdicts, alpha, _, table, *_ = measure.checks(results, medium)
    # of a medium that passes the check of linearity there is none
    passed = {
        "fits": results[medium].fits,
        "alpha": alpha,
        "checks": verdicts.assign(verdict="passed"),
    }
    assert alpha_at_depths(results.campaign, medium, passed, lambda fits, *_: fits).empty
    results.hold(f"checks/{medium}.csv", verdicts)
    results.hold(f"alpha_at_depth/{medium}.csv", table)
    page = tabulate_at_depths(results).rows
    law = curved_law(results[medium].fits, verdicts)
    assert law is not None
    assert law.power == pytest.approx(power, abs=0.03)
    # the page has the power that the check has
    assert str(law) in str(verdicts.set_index("check").loc["linearity", "found"])
    assert len(page) == 1
    assert set(table["reason_code"]) == {"", "outside-window"}
    for depth in DEPTHS_CM:
        rows_at_depth = table[table["depth_cm"] == depth]
        lo, truth, hi = alpha_cells(rows_at_depth)
        is_finite = np.isfinite(lo)
        force = truth * power_law(np.array(depth), power) / depth
        assert ((lo <= force) & (force <= hi))[is_finite].mean() > 0.9
        assert page[0][f"_lo{depth:g}"] < page[0][f"{depth:g}"] < page[0][f"_hi{depth:g}"]
    # a window that holds none of the depths has no row on the page
    results.hold(f"alpha_at_depth/{medium}.csv", table.assign(alpha_z_N_per_cm3=np.nan))
    assert not tabulate_at_depths(results).rows


@pytest.mark.parametrize(
    ("verdict", "code", "law"),
    [
        ("failed", "linearity", "depth^1.20"),
        ("accepted", "law-power", "depth^1.20"),
        ("failed", "law-intercept", "c + alpha depth"),
        ("failed", "law-crust", "None"),
        ("passed", "linearity", "None"),
        ("not checked", "law-open", "None"),
    ],
)
def test_the_check_of_linearity_decides_what_is_curved(verdict, code, law):
    """By steep pushes that are clear; the last three runs are none."""
    fits = pd.DataFrame({
        "direction": ["intrusion"] * 5 + ["extraction"], "gamma_deg": [90.0, 60, 45, 30, 90, -90],
        "beta_deg": [0.0, 0, 0, 0, 30, 0],
        "exponent_z": [1.1, 1.2, 1.3, 2, 2, 2], "alpha_z_se_N_per_cm3": [0.01] * 4 + [0.2, 0.01],
        "alpha_z_N_per_cm3": 0.3,
    })  # fmt: skip
    checks = pd.DataFrame(
        {
            "check": ["surface", "linearity"],
            "verdict": ["failed", verdict],
            "code": ["surface-off", code],
        }
    )
    assert str(curved_law(fits, checks)) == law
