"""Tables of tared samples give exact tables of fits and leg curves, and every sample is counted.

No logs are read.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaigns import plate_run

from rftfit.campaign.load import Campaign
from rftfit.measure.fits import FIT_COLUMNS, fit_medium
from rftfit.measure.flags import attach_run, remark

AREA = 3.81 * 2.54
"""Of the plate, cm^2."""
ALPHA = np.array([0.31, -0.12])
"""Slopes z and x of the stress in the medium, N/cm^3."""
ROD = np.array([0.02, -0.03])
"""Slopes z and x of the force on the rod, over the area of the plate, N/cm^3."""
DOWN = np.linspace(0.0, 9.0, 901)


def run(run_id, kind="plate", **changes):
    usual = {"beta_deg": 30.0, "gamma_deg": 45.0, "tare_run": "air", "tare_shared": True}
    return plate_run(run_id, kind=kind, **usual | changes)


def fact(run_id, **changes):
    """What the ingest stage says about a run that has no error."""
    values: dict[str, Any] = {
        "run_id": run_id,
        "reason": "",
        "note": "",
        "sample_step_s": 0.01,
        "surface_se_mm": math.nan,
        "clock_se_s": 0.0,
        "clock_shared_se_s": math.nan,
        "zero_var_z_N2": 0.0,
        "zero_var_x_N2": 0.0,
        "zero_dof": 12.0,
    }
    return values | changes


def samples(run_id, depth=DOWN, **changes):
    """Tared samples of a stress, and of a force on the rod, that are exactly linear in depth."""
    force, rod = AREA * ALPHA[:, None] * depth, AREA * ROD[:, None] * depth
    columns: dict[str, Any] = {
        "run_id": run_id,
        "depth_cm": depth,
        "x_cm": 0.0,
        "path_cm": np.abs(depth - depth[0]),
        "angle_deg": 0.0,
        "why": np.zeros(depth.size, dtype=np.int8),
        "force_z_N": force[0],
        "force_x_N": force[1],
        "tare_z_N": rod[0],
        "tare_x_N": rod[1],
    }
    return pd.DataFrame(columns | changes)


def together(*parts):
    table = pd.concat(parts, ignore_index=True)
    return table.astype({"run_id": "category"})


def fitted(config, runs, tared, facts=None, lost=None, medium="poppy_LP", **options):
    """Table of the fits by run, windows, and ledger; `lost`: runs whose tare gave nothing, with the reason."""
    status = pd.DataFrame(facts or [fact(run.run_id) for run in runs])
    tares = pd.DataFrame({"run_id": list(lost or {}), "reason": list((lost or {}).values())})
    campaign = Campaign(Path(), Path(), Path(), config, tuple(runs))
    fits, windows, ledger = fit_medium(campaign, medium, status, tared, tares, **options)
    assert list(fits.columns) == FIT_COLUMNS
    return fits.set_index("run_id"), windows, ledger


def test_errors_of_clocks_and_surface_add_up_in_squares(paper_config):
    # 0.04 s at 0.5 cm/s are 0.02 cm, and the surface may be 0.015 cm off: together 0.025 cm
    depth = np.linspace(2.0, 7.0, 501)
    facts = [fact("a", sample_step_s=0.02, clock_se_s=0.04, surface_se_mm=0.15), fact("air")]
    fits, _, _ = fitted(paper_config, [run("a")], together(samples("a", depth)), facts)
    lever = depth.sum() / (depth**2).sum()
    for name, alpha in zip("zx", ALPHA, strict=True):
        se = fits.loc["a", f"alpha_{name}_se_N_per_cm3"]
        assert se == pytest.approx(0.025 * lever * abs(alpha), rel=3e-3)


def test_each_run_says_which_of_several_plates_it_has(paper_config):
    fit = paper_config.fit.model_copy(update={"missing_tare": "flag"})
    intruders = paper_config.intruders | {"other": paper_config.intruders["plate"]}
    config = paper_config.model_copy(update={"fit": fit, "intruders": intruders})
    runs = [run("a", tare_run=""), run("b", intruder="other", tare_run="")]
    tared = together(samples("a", tare_z_N=np.nan, tare_x_N=np.nan))
    fits, _, ledger = fitted(config, runs, tared)
    plates = {"a": "plate", "b": "other"}
    assert ledger.flags == [
        *(
            attach_run(name, [remark("several-plates", plate=plate, count=2)])[0]
            for name, plate in plates.items()
        )
    ]
    # the force on the rod is not known
    assert fits["alpha_z_rod_N_per_cm3"].isna().all()


def test_each_sand_ends_where_its_own_test_showed_it(paper_config):
    sand: dict[str, Any] = {"medium": "yuma", "beta_deg": 0.0, "gamma_deg": 90.0}
    runs = [run("a", **sand), run("b", **sand)]
    tared = together(samples("a"), samples("b"))
    fits, _, _ = fitted(paper_config, runs, tared, medium="yuma", linear_to_cm={"b": 1.5})
    assert list(fits["depth_to_cm"]) == [paper_config.media["yuma"].linear_to_cm, 1.5]
