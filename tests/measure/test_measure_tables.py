"""Tables of tared samples give exact tables of fits and leg curves, and every sample is counted.

No logs are read.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaign_room import plate_run

from rftfit.campaign.config import ForceLog
from rftfit.campaign.load import Campaign
from rftfit.measure.fits import FIT_COLUMNS, fit_medium
from rftfit.measure.flags import attach_run, remark
from rftfit.measure.ledger import RowStatus
from rftfit.measure.leg_curves import LEG_COLUMNS, leg_curves

AREA = 3.81 * 2.54
"""Of the plate, cm^2."""
ALPHA = np.array([0.31, -0.12])
"""Slopes z and x of the stress in the medium, N/cm^3."""
ROD = np.array([0.02, -0.03])
"""Slopes z and x of the force on the rod, over the area of the plate, N/cm^3."""
DOWN = np.linspace(0.0, 9.0, 901)
INSIDE = DOWN[123:778]
"""Depths at which a plate at 30 degrees is submerged and 6 cm above the bottom."""


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


def fates(ledger, run_id):
    book = ledger.table()
    rows = book[book["run_id"] == run_id]
    assert (rows["file"] == f"{run_id}.csv").all()
    return dict(zip(zip(rows["fate"], rows["reason_code"], strict=True), rows["rows"], strict=True))


@pytest.mark.parametrize(("direction", "sign"), [("intrusion", 1), ("extraction", -1)])
def test_the_row_of_a_run_tells_its_cell_and_its_slopes(paper_config, direction, sign):
    depth, path = np.linspace(2.0, 7.0, 501)[::sign], np.linspace(0.0, 5.0, 501)
    facts = [fact("a", note="rain", zero_var_z_N2=9e-4, zero_var_x_N2=1e-4), fact("air")]
    fits, _, _ = fitted(
        paper_config,
        [run("a", direction=direction)],
        together(samples("a", depth, path_cm=path)),
        facts,
    )
    row = fits.loc["a"]
    assert (row["beta_deg"], row["gamma_deg"], row["mirrored"]) == (30 * sign, 45 * sign, sign < 0)
    labels = (row["medium"], row["direction"], row["tare_run"], row["note"], row["reason"])
    assert labels == ("poppy_LP", direction, "air", "rain", "")
    # an extraction is fitted after its first 0.1 cm
    used = depth if sign > 0 else depth[10:]
    assert row["n_points"] == used.size
    assert (row["depth_from_cm"], row["depth_to_cm"]) == (used.min(), used.max())
    lever = used.sum() / (used**2).sum()
    assert row["lever_per_cm"] == pytest.approx(lever)
    # the depth of no stress is off by as much as the zero of the stress is
    assert row["offset_cm"] == pytest.approx(0, abs=1e-9)
    assert row["offset_se_cm"] == pytest.approx(0.03 / AREA / ALPHA[0], rel=1e-6)
    # Student's factor of 95 % for the 12 degrees of freedom of the zero
    for name, alpha, rod, zero in zip(
        "zx", ALPHA * [1, sign], ROD * [1, sign], (0.03, 0.01), strict=True
    ):
        assert row[f"alpha_{name}_N_per_cm3"] == pytest.approx(alpha, rel=1e-9)
        assert row[f"alpha_{name}_rod_N_per_cm3"] == pytest.approx(rod, rel=1e-9)
        half = 2.178813 * zero / AREA * lever
        assert row[f"alpha_{name}_lo_N_per_cm3"] == pytest.approx(alpha - half, rel=1e-6)
        assert row[f"alpha_{name}_hi_N_per_cm3"] == pytest.approx(alpha + half, rel=1e-6)
        assert row[f"alpha_{name}_dof"] == pytest.approx(12, rel=1e-6)
        assert row[f"free_slope_{name}_N_per_cm3"] == pytest.approx(alpha, rel=1e-9)
        assert row[f"intercept_{name}_N_per_cm2"] == pytest.approx(0, abs=1e-9)


def test_errors_of_clocks_and_surface_add_up_in_squares(paper_config):
    # 0.04 s at 0.5 cm/s are 0.02 cm, and the surface may be 0.015 cm off: together 0.025 cm
    depth = np.linspace(2.0, 7.0, 501)
    facts = [fact("a", sample_step_s=0.02, clock_se_s=0.04, surface_se_mm=0.15), fact("air")]
    fits, _, _ = fitted(paper_config, [run("a")], together(samples("a", depth)), facts)
    lever = depth.sum() / (depth**2).sum()
    for name, alpha in zip("zx", ALPHA, strict=True):
        se = fits.loc["a", f"alpha_{name}_se_N_per_cm3"]
        assert se == pytest.approx(0.025 * lever * abs(alpha), rel=3e-3)


def test_other_laws_are_told_beside_the_line_through_zero(paper_config):
    depth = np.linspace(2.0, 7.0, 60)
    shape = (depth / 5) ** 1.25
    power = 0.3 * 5 * shape
    straight = np.polynomial.Polynomial.fit(depth, power, 1)
    # a rest that none of the laws can take up, so that it stays the same under all of them
    laws = np.stack([np.ones(60), depth, shape, shape * np.log(depth / 5)], axis=1)
    residual = 1e-2 * np.sin(40 * depth)
    residual -= laws @ np.linalg.lstsq(laws, residual)[0]
    tared = together(samples("a", depth, force_z_N=AREA * (power + residual), force_x_N=0.0))
    row = fitted(paper_config, [run("a")], tared)[0].loc["a"]
    line = ((power + residual) @ depth) / (depth @ depth)
    assert row["alpha_z_N_per_cm3"] == pytest.approx(line)
    assert row["exponent_z"] == pytest.approx(1.25, abs=1e-5)
    at_the_end = 0.3 * (7 / 5) ** 0.25
    assert row["power_stress_z_percent"] == pytest.approx(100 * (at_the_end / line - 1), abs=1e-3)
    free = straight(7.0) / 7
    assert row["free_stress_z_percent"] == pytest.approx(100 * (free / line - 1), abs=1e-6)
    missed = ((power - straight(depth)) ** 2).sum()
    misfit = (residual @ residual) / (missed + residual @ residual)
    assert row["power_misfit_z_ratio"] == pytest.approx(misfit, rel=1e-4)
    # a component that is not felt has no other law
    columns = (
        "free_stress_x_percent",
        "exponent_x",
        "power_stress_x_percent",
        "power_misfit_x_ratio",
    )
    assert row[[*columns]].isna().all()


def test_runs_without_samples_keep_their_reason(paper_config):
    log = ForceLog.model_validate({"columns": {"F2": {"constant": 0.0, "unit": "N"}}})
    config = paper_config.model_copy(update={"force_log": log})
    facts = [fact("bad", reason="excluded: dust"), fact("good"), fact("untared")]
    runs = [run("bad"), run("good"), run("untared")]
    lost = {"untared": "no tare", "good": ""}
    fits, _, ledger = fitted(config, runs, together(samples("good")), facts, lost)
    assert list(fits.index) == ["bad", "good", "untared"]
    assert list(fits["reason"]) == ["excluded: dust", "", "no tare"]
    assert fits["alpha_x_N_per_cm3"].isna().all()
    assert list(fits["n_points"]) == [0, INSIDE.size, 0]
    assert list(fits["alpha_z_N_per_cm3"].isna()) == [True, False, True]
    assert list(fits["beta_deg"]) == [30] * 3
    assert fates(ledger, "bad") == {}


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


def test_every_sample_has_its_place_in_windows_and_ledger(paper_config):
    # lost before: 5 samples above the window of the first run, 3 inside that of the second
    early, spoilt = np.zeros(901, dtype=np.int8), np.zeros(901, dtype=np.int8)
    early[10:15] = RowStatus.MOTION_GAP
    spoilt[500:503] = RowStatus.SATURATED
    tared = together(samples("a", why=early), samples("b", why=spoilt), samples("leg"))
    runs = [run("a"), run("b"), run("leg", "leg", intruder="c_leg", tare_run="")]
    fits, windows, ledger = fitted(paper_config, runs, tared)
    assert list(fits.index) == ["a", "b"]
    assert fates(ledger, "a") == {
        ("dropped", "above"): 118,
        ("dropped", "bottom"): 123,
        ("used", "slope"): 655,
    }
    assert fates(ledger, "b") == {
        ("dropped", "above"): 123,
        ("dropped", "bottom"): 123,
        ("dropped", "no-alpha window-saturated"): 652,
    }
    assert list(windows.columns) == ["run_id", "why"]
    assert list(windows["run_id"]) == list(tared["run_id"])
    counts = windows.groupby(["run_id", "why"], observed=True).size()
    assert counts["a", RowStatus.ABOVE] == 118
    assert counts["a", RowStatus.MOTION_GAP] == 5
    assert counts["a", RowStatus.GOOD] == 655
    assert counts["b", RowStatus.SATURATED] == 3
    assert (tared["why"] != 0).sum() == 8  # nothing was written into the table that came in


def legs(config, runs, tared, facts):
    campaign = Campaign(Path(), Path(), Path(), config, tuple(runs))
    return leg_curves(campaign, "poppy_LP", pd.DataFrame(facts), tared)


def test_a_leg_curve_is_the_mean_force_of_each_degree(paper_config):
    fit = paper_config.fit.model_copy(update={"missing_tare": "flag"})
    config = paper_config.model_copy(update={"fit": fit})
    air = run("air", "leg_air", medium="", tare_run="")
    runs = [
        run("a", "leg", intruder="c_leg"),
        air,
        run("b", "leg", intruder="flat_leg", tare_run=""),
        run("lost", "leg", intruder="c_leg"),
        run("plate"),
    ]
    why = np.array([0, 0, 0, 0, 0, RowStatus.UNTARED], dtype=np.int8)
    turned = samples(
        "a", np.zeros(6), why=why, angle_deg=[-1.4, -0.6, -0.4, 0.4, 1.2, 1.3],
        force_z_N=[1.0, 2.0, 4.0, 6.0, 8.0, 1e3], force_x_N=[0.0, -1.0, -3.0, -5.0, -7.0, 1e3],
    )  # fmt: skip
    once = samples("b", np.zeros(1), angle_deg=[3.0], force_z_N=[2.5], force_x_N=[0.5])
    facts = [
        fact("a", zero_var_z_N2=9e-4, zero_var_x_N2=25e-4),
        fact("air", zero_var_z_N2=16e-4, zero_var_x_N2=144e-4),
        fact("b", zero_var_z_N2=4e-4),
        fact("lost"),
        fact("plate"),
    ]
    curves, ledger = legs(config, runs, together(turned, once, samples("plate")), facts)
    expected = pd.DataFrame(
        [["poppy_LP", "c_leg", "a", -1.0, 1.5, -0.5, 2, 0.05, 0.13, "", ""],
         ["poppy_LP", "c_leg", "a", 0.0, 5.0, -4.0, 2, 0.05, 0.13, "", ""],
         ["poppy_LP", "c_leg", "a", 1.0, 8.0, -7.0, 1, 0.05, 0.13, "", ""],
         ["poppy_LP", "flat_leg", "b", 3.0, 2.5, 0.5, 1, 0.02, 0.0, "", ""]],
        columns=LEG_COLUMNS,
    )  # fmt: skip
    pd.testing.assert_frame_equal(curves, expected)
    assert fates(ledger, "a") == {("used", "leg-curve"): 5}
    assert fates(ledger, "b") == {("used", "leg-curve"): 1}
    none, _ = legs(config, runs[-1:], together(samples("plate")), facts[-1:])
    assert (list(none.columns), len(none)) == (LEG_COLUMNS, 0)
