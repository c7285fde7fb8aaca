"""Penetration tests of a natural sand give slope and zeta of each linear regime, or the reason.

Zeta: the scaling factor of a medium. Regime: the depths in which stress is linear, as stated in
the config or as detected.
"""

import math

import numpy as np
import pytest
from campaigns import Folder
from makers import MadePush, config_of_push, row_of_push, write_campaign

ALPHA = 0.5
PUSHES = {
    "bent": MadePush(ALPHA, exponent=2, noise_N=1e-4),
    "pulls": MadePush(-ALPHA, noise_N=1e-4),
    "straight": MadePush(ALPHA, rod_N_per_cm=1.5, noise_N=1e-4),
}
"""Push of a level plate straight down into each sand; of one, the rod feels the sand, too."""
ROD = MadePush(0.0, rod_N_per_cm=1.5, noise_N=1e-4)


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """Rows of `sands.csv` by sand and window; beds scatter by 4 %, a surface by 0.1 mm and, of all runs, 0.2 mm; intervals of 80 %."""
    sand = {"role": "natural_sand", "linear_to_cm": 2}
    surface = {"surface_run_mm": 0.1, "surface_session_mm": 0.2}
    config = config_of_push(
        "time",
        {c: {"column": c, "unit": "mm"} for c in "xz"},
        media={name: sand | {"title": name} for name in PUSHES},
        fit={"missing_tare": "none", "confidence": 0.8},
        errors=surface
        | {"bed_N_per_cm3": 0, "bed_percent": 4, "tare_percent": 10, "angle_deg": 0, "turn_deg": 0},
    )
    folder = tmp_path_factory.mktemp("sands")
    write_campaign(
        folder,
        config,
        rows=[
            *(row_of_push(run_id=name, medium=name) for name in ("bent", "pulls")),
            row_of_push(run_id="straight", medium="straight", tare_run="rod"),
            row_of_push(run_id="rod", medium="straight", kind="rod"),
        ],
        logs={f"{name}.csv": push.log().text() for name, push in {**PUSHES, "rod": ROD}.items()},
    )
    Folder(folder).run_here("natural_sands")
    table = Folder(folder).table("sands.csv")
    return {(row["medium"], row["window"]): row for row in table.to_dict("records")}


def test_a_regime_that_is_not_found_has_its_reason_and_no_number(rows):
    """A curve that is bent from the start has none to detect."""
    lost, stated = rows["bent", "detected"], rows["bent", "stated"]
    assert "no-linear-regime" in lost["reason_code"].split()
    assert math.isnan(lost["linear_to_cm"])
    assert math.isnan(lost["alpha_z_N_per_cm3"])
    assert stated["alpha_z_N_per_cm3"] > 0


def test_bed_rod_and_surface_are_in_the_interval_of_a_test(rows):
    stated = rows["straight", "stated"]
    depth_cm = np.unique(PUSHES["straight"].depth_cm)
    depth_cm = depth_cm[depth_cm <= 2]
    # a surface that lies deeper by d takes slope times d from each stress of the line through zero
    lever = depth_cm.sum() / (depth_cm @ depth_cm)
    # the force on the rod is known to 10 %
    of_rod = 0.1 * ROD.rod_N_per_cm / ROD.area_cm2 / ALPHA
    half = 1.281552 * ALPHA * math.hypot(0.04, of_rod, 0.01 * lever, 0.02 * lever)
    assert stated["alpha_z_N_per_cm3"] == pytest.approx(ALPHA, rel=1e-4)
    assert stated["alpha_z_hi_N_per_cm3"] == pytest.approx(ALPHA + half, rel=1e-4)
    assert stated["alpha_z_lo_N_per_cm3"] == pytest.approx(ALPHA - half, rel=1e-4)


@pytest.mark.parametrize("window", ["stated", "detected"])
def test_a_sand_that_pulls_has_a_slope_and_no_zeta(rows, window):
    row = rows["pulls", window]
    assert row["alpha_z_N_per_cm3"] == pytest.approx(-ALPHA, rel=1e-4)
    assert "no-zeta" in row["reason_code"].split()
    assert math.isnan(row["zeta"])
