"""Measured campaigns: alpha does not depend on clocks, on the order of runs and rows, or on units."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import MadePush, answer_of, config_of_push, row_of_push, run_targets, write_campaign
from numpy.testing import assert_allclose

import rftfit

ALPHA = ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]
DIRECTIONS = ((0.0, 90.0, 0.40, 0.0), (30.0, 90.0, 0.35, 0.05), (0.0, 45.0, 0.25, 0.15))
"""beta, gamma (deg), alpha_z and alpha_x (N/cm^3) of the pushes."""
MEDIA: dict[str, dict[str, Any]] = {
    "plain": {},
    "late": {"start_s": 4000.0},
    "strong": {"gain": 2.0},
    "shifted": {"zero_N": 3.0},
    "pooled": {},
}
"""How the pushes of a medium differ from the same pushes, noise and all."""


def pushes_of(medium, units):
    return [
        MadePush(alpha_z=z, alpha_x=x, gamma_deg=gamma, seed=place, **MEDIA[medium], **units)
        for place, (_, gamma, z, x) in enumerate(DIRECTIONS)
    ]


def make(folder, units, order=1):
    """Measure the pushes of all media; `order`: -1 for the rows of the run sheet from behind."""
    rows, logs = [], {}
    for medium in MEDIA:
        for (beta, gamma, *_), push in zip(DIRECTIONS, pushes_of(medium, units), strict=True):
            run = f"{medium}_{beta:g}_{gamma:g}"
            logs[f"{run}.csv"] = push.log().text()
            row = row_of_push(f"{gamma:g}", run, medium=medium, beta_deg=f"{beta:g}")
            rows.append(row)
            if medium == "pooled" and gamma == 45:
                logs[f"{run}_narrow.csv"] = replace(push, area_cm2=10.0, seed=9).log().text()
                narrow = {"run_id": f"{run}_narrow", "intruder": "narrow"}
                narrow |= {"force_log": f"{run}_narrow.csv", "motion_log": f"{run}_narrow.csv"}
                rows.append(row | narrow)
    force_unit, length_unit = units.get("force_unit", "N"), units.get("length_unit", "mm")
    config = config_of_push(
        "time",
        {c: {"column": c, "unit": length_unit} for c in "xz"},
        force_unit=force_unit,
        transducer={"precision_N": 0.02},
        media={medium: {"title": medium} for medium in MEDIA},
    )
    config["intruders"]["narrow"] = config["intruders"]["plate"] | {"width_cm": 2}
    write_campaign(folder, config, rows=rows[::order], logs=logs)
    report = run_targets(folder, [f"results/alpha/{medium}.csv" for medium in MEDIA])
    assert report.failed == {}
    flags = rftfit.open(folder).table("flags/pooled.csv")
    flags = flags[flags["code"] == "pooled-plates"]
    assert flags[["run_id", "beta_deg", "gamma_deg"]].to_numpy().tolist() == [["", 0.0, 45.0]]
    return {medium: alpha_of(folder, medium) for medium in MEDIA}


def alpha_of(folder, medium):
    table = rftfit.open(folder)[medium].alpha
    return table.sort_values(["beta_deg", "gamma_deg"]).reset_index(drop=True)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Alpha of all media, in the usual units and in others with the rows of the sheet from behind."""
    folder = tmp_path_factory.mktemp("laws")
    other_units = {"force_unit": "mN", "length_unit": "cm"}
    return make(folder / "a", {}), make(folder / "b", other_units, order=-1)


def compare_with_truth(table, **tolerance):
    assert len(table) == len(DIRECTIONS)
    for beta, gamma, *alpha in DIRECTIONS:
        row = table[np.isclose(table["beta_deg"], beta) & np.isclose(table["gamma_deg"], gamma)]
        assert_allclose(row[ALPHA].iloc[0], alpha, **tolerance)


def test_alpha_comes_back(measured):
    compare_with_truth(measured[0]["plain"], rtol=0, atol=0.01)


@pytest.mark.parametrize(
    ("medium", "factor", "rtol"), [("late", 1, 1e-5), ("shifted", 1, 1e-5), ("strong", 2, 1e-3)]
)
def test_time_and_zero_do_not_matter_and_twice_the_force_is_twice_alpha(
    measured, medium, factor, rtol
):
    table, plain = measured[0][medium], measured[0]["plain"]
    assert_allclose(table[ALPHA], factor * plain[ALPHA], rtol=rtol, atol=rtol / 10)
    assert [*table["reason_code"]] == [*plain["reason_code"]]


@pytest.mark.parametrize("medium", MEDIA)
def test_neither_units_nor_the_order_of_runs_matter(measured, medium):
    first, second = (tables[medium] for tables in measured)
    # a reading at the very edge of the window of depths may fall to either side of it
    assert_allclose(second[ALPHA], first[ALPHA], rtol=1e-4, atol=1e-6)
    for name in ("reason_code", "run_ids"):
        assert [*second[name]] == [*first[name]]


def test_the_order_of_a_stress_table_does_not_matter(tmp_path):
    """Pushes in another order, each from its deepest reading on."""
    depths_mm = np.arange(5.0, 81.0, 2.5)
    tables = []
    for medium, step in (("plain", 1), ("backward", -1)):
        for beta, gamma, alpha_z, alpha_x in DIRECTIONS[::step]:
            columns = {"medium": medium, "beta_deg": beta, "gamma_deg": gamma}
            columns |= {"depth_mm": depths_mm, "stress_z_kPa": alpha_z * depths_mm}
            tables.append(pd.DataFrame(columns | {"stress_x_kPa": alpha_x * depths_mm})[::step])
    pd.concat(tables).to_csv(tmp_path / "stress.csv", index=False)
    code, _, error = answer_of("init", "c", "--stress-table", "stress.csv", folder=tmp_path)
    assert code == 0, error
    names = [f"results/alpha/{medium}.csv" for medium in ("plain", "backward")]
    assert run_targets(tmp_path / "c", names).failed == {}
    plain, backward = (alpha_of(tmp_path / "c", medium) for medium in ("plain", "backward"))
    assert_allclose(backward[ALPHA], plain[ALPHA], rtol=1e-9, atol=1e-12)
    # 1 kPa is 0.1 N/cm^2, and 1 mm 0.1 cm
    compare_with_truth(plain, rtol=1e-6, atol=1e-9)
