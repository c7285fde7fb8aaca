"""Penetration tests of a natural sand give slope and zeta of each linear regime, or the reason.

Zeta: the scaling factor of a medium. Regime: the depths in which stress is linear, as stated in
the config or as detected.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pushes import plate_run
from result_tables import alpha_frame, one_cell

from rftfit.campaign.load import Campaign
from rftfit.compare.sands import penetration_rows
from rftfit.measure.fits import fit_medium

AREA_CM2 = 3.81 * 2.54
CHI = np.array([1.2, 1.3])
"""Chi of two reference media."""
DEPTH_CM = np.arange(0.01, 5.0, 0.01)


def push(name="down", **facts):
    return plate_run(name, **{"medium": "yuma", "tare_run": "rod", "tare_shared": True, **facts})


def kneed(knee_cm):
    """Stress of 0.5 N/cm^3 times depth, four times as steep below the knee."""
    return np.asarray(0.5 * DEPTH_CM + 1.5 * np.clip(DEPTH_CM - knee_cm, 0, None))


def fit_tests(config, stresses, runs=(push(),), *, alpha=None, reasons=None, numbers=False):
    """Rows by run and window; `stresses` of the runs that have a tared stroke, `reasons` of the others."""
    folder = Path("no campaign is here")
    table = {run.run_id: {"depth_cm": np.ones(1)} for run in runs} if numbers else {}
    campaign = Campaign(folder, folder, folder, config, runs, table)
    facts = {
        "note": "",
        "sample_step_s": 0.01,
        "clock_se_s": 0.0,
        "clock_shared_se_s": 0.0,
        "surface_se_mm": 0.0,
        "zero_var_z_N2": 0.0,
        "zero_var_x_N2": 0.0,
        "zero_dof": 12.0,
    }
    status = pd.DataFrame(
        facts | {"run_id": run.run_id, "reason": (reasons or {}).get(run.run_id, "")}
        for run in runs
    )
    nothing = dict.fromkeys(("x_cm", "force_x_N", "tare_z_N", "tare_x_N"), 0.0)
    tared = pd.concat(
        pd.DataFrame(
            {
                "run_id": name,
                "depth_cm": DEPTH_CM,
                "path_cm": DEPTH_CM,
                **nothing,
                "force_z_N": AREA_CM2 * stresses[name],
                "why": np.int8(0),
            }
        )
        for name in sorted(stresses)
    )
    tared["run_id"] = tared["run_id"].astype("category")
    tares = pd.DataFrame(columns=["run_id", "reason"])
    fits, *_ = fit_medium(campaign, "yuma", status, tared, tares)
    table_of = alpha_frame("yuma", one_cell(0.5)) if alpha is None else alpha
    tables = {"runs": status, "tared": tared, "tares": tares, "fits": fits, "alpha": table_of}
    rows: list[Any] = penetration_rows(campaign, "yuma", tables, CHI)
    assert {row["medium"] for row in rows} <= {"yuma"}
    rows_by_window = {(row["run_id"], row["window"]): row for row in rows}
    assert len(rows_by_window) == len(rows)
    return rows_by_window


def test_a_regime_that_ends_with_the_test_is_said(paper_config):
    rows = fit_tests(paper_config, {"down": kneed(9.0)})
    assert rows["down", "stated"]["reason"] == ""
    assert rows["down", "detected"]["reason_code"] == "no-linear-end"
    assert rows["down", "detected"]["linear_to_cm"] == pytest.approx(4.95, abs=0.051)
    assert rows["down", "detected"]["zeta"] == pytest.approx(0.5 / 1.25)


def test_a_regime_that_is_not_found_has_its_reason_and_no_number(paper_config):
    """A curve that is bent from the start has none to detect."""
    rows = fit_tests(paper_config, {"down": DEPTH_CM**2})
    lost = rows.pop(("down", "detected"))
    assert lost["reason_code"] == "no-linear-regime"
    assert math.isnan(lost["linear_to_cm"])
    assert "alpha_z_N_per_cm3" not in lost
    (stated,) = rows.values()
    assert (stated["reason"], stated["alpha_z_N_per_cm3"] > 0) == ("", True)


def test_a_regime_that_the_config_does_not_state_has_no_row(paper_config):
    media = dict(paper_config.media)
    media["yuma"] = media["yuma"].model_copy(update={"linear_to_cm": None})
    rows = fit_tests(paper_config.model_copy(update={"media": media}), {"down": kneed(3.0)})
    assert list(rows) == [("down", "detected")]
    assert rows["down", "detected"]["alpha_z_N_per_cm3"] > 0


def test_the_bed_and_the_surface_are_in_the_interval_of_a_test(paper_config):
    """Beds 4 % apart, rods 3 %, a surface known to 0.1 mm and, of all runs, 0.2 mm; no noise."""
    alpha = alpha_frame("yuma", one_cell(0.5)).assign(
        run_to_run_z_N_per_cm3=0.02, alpha_z_rod_N_per_cm3=0.015
    )
    errors = paper_config.errors.model_copy(
        update={"surface_run_mm": 0.1, "surface_session_mm": 0.2}
    )
    config = paper_config.model_copy(update={"errors": errors})
    stated = fit_tests(config, {"down": kneed(3.0)}, alpha=alpha)["down", "stated"]
    depth_cm = DEPTH_CM[DEPTH_CM <= 2]
    # a surface that lies deeper by d takes slope times d from each stress of the line through zero
    lever = depth_cm.sum() / (depth_cm @ depth_cm)
    half = 1.959964 * 0.5 * math.hypot(0.04, 0.03, 0.01 * lever, 0.02 * lever)
    assert stated["alpha_z_hi_N_per_cm3"] == pytest.approx(0.5 + half, rel=1e-4)
    assert stated["alpha_z_lo_N_per_cm3"] == pytest.approx(0.5 - half, rel=1e-4)
    fit = paper_config.fit.model_copy(update={"confidence": 0.8})
    config = config.model_copy(update={"fit": fit})
    narrow = fit_tests(config, {"down": kneed(3.0)}, alpha=alpha)["down", "stated"]
    assert narrow["alpha_z_hi_N_per_cm3"] == pytest.approx(
        0.5 + 1.281552 / 1.959964 * half, rel=1e-4
    )
    assert narrow["zeta_hi"] < stated["zeta_hi"]


def test_a_sand_that_pulls_has_a_slope_and_no_zeta(paper_config):
    for row in fit_tests(paper_config, {"down": -kneed(3.0)}).values():
        assert row["alpha_z_N_per_cm3"] < -0.4
        assert row["reason_code"] == "no-zeta"
        assert "zeta" not in row
