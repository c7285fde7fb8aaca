"""The whole demonstration campaign: the paper's numbers come back."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

import numpy as np
import pytest
from dictionary_check import check_results
from paper_grid import grid

from rftfit.campaign.load import load_campaign
from rftfit.figures.registry import figures
from rftfit.measure.alpha import column
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import AS_PRINTED
from rftfit.reference import LEGS, MEDIA, SANDS, alpha_grid, coefficients, load
from rftfit.workflow.stages import ALL, ON_DEMAND, STAGES

if TYPE_CHECKING:
    from campaigns import Folder

pytestmark = pytest.mark.slow


def test_alpha_is_table_s5(whole: Folder) -> None:
    off = []
    for medium in MEDIA:
        table = whole.table(f"alpha/{medium}.csv")
        for component, paper in zip("zx", alpha_grid(medium), strict=True):
            off.append(np.abs(grid(table, column(component)) - paper).ravel())
    every = np.concatenate(off)
    assert every.size == 5 * 7 * 13 * 2
    assert np.isfinite(every).all()
    assert np.mean(every <= 0.005) >= 0.95
    assert every.max() <= 0.01


def test_intervals_cover_table_s5(whole: Folder) -> None:
    inside = []
    for medium in MEDIA:
        table = whole.table(f"alpha/{medium}.csv")
        for component, paper in zip("zx", alpha_grid(medium), strict=True):
            low, high = (grid(table, column(component, part)) for part in ("_lo", "_hi"))
            # beta = -90 repeats +90
            inside.append(((low <= paper) & (paper <= high))[1:].ravel())
    share = np.concatenate(inside).mean()
    # 780 cells: three standard errors about 95 %
    assert 0.925 <= share <= 0.975


def test_coefficients_are_table_s2(whole: Folder) -> None:
    table = whole.table("coefficients.csv").set_index(["method", "medium", "coefficient"])
    for medium in (*MEDIA, "generic"):
        printed = coefficients(medium)
        tolerance = 0.003 if medium == "generic" else 0.002
        for term in TERMS:
            if printed[term] != 0:
                ours = table.loc[(AS_PRINTED, medium, term), "value_N_per_cm3"]
                assert abs(ours - printed[term]) <= tolerance, (medium, term)


def test_chi_is_table_s3(whole: Folder) -> None:
    table = whole.table("penetration.csv").set_index(["method", "medium"])
    printed = load("table_s3").set_index(["medium", "quantity"])["value"].astype(float)
    for medium in MEDIA:
        row = table.loc[(AS_PRINTED, medium)]
        assert abs(row["chi"] - printed[medium, "chi"]) <= 0.02
        assert row["chi_lo"] <= row["chi"] <= row["chi_hi"]


def test_sands_are_scaled(whole: Folder) -> None:
    table = whole.table("penetration.csv").set_index("medium")
    for sand, slope in zip(SANDS, (0.69, 0.88, 0.76), strict=True):
        row = table.loc[sand]
        # slope of Fig. S11 over the stated linear regime
        assert row["alpha_z_measured_N_per_cm3"] == pytest.approx(slope, abs=0.01)
        assert row["zeta"] == pytest.approx(
            row["alpha_z_measured_N_per_cm3"] / row["chi"], rel=1e-4
        )


def test_leg_curves_are_the_published_ones(whole: Folder) -> None:
    published = {"laboratory": load("fig_s5"), "natural_sand": load("fig_s12")}
    for role, media in (("laboratory", MEDIA), ("natural_sand", SANDS)):
        keys = ["medium", "leg", "theta_deg"]
        for medium in media:
            curves = whole.table(f"legs/{medium}.csv")
            both = curves.merge(published[role], on=keys, suffixes=("", "_paper"))
            assert set(both["leg"]) == set(LEGS)
            for component in "zx":
                off = both[f"force_{component}_N"] - both[f"force_{component}_N_paper"]
                # 0.05 N correlated noise, nine samples a degree, in the run and in its tare
                assert np.sqrt((off**2).mean()) < 0.07


def test_ledger_accounts_for_every_row(whole: Folder) -> None:
    ledger = whole.table("ledger.csv")
    counted = ledger.groupby("file")["rows"].sum()
    raw = whole.root / "raw" / "paper"
    logs = sorted(path for path in raw.rglob("*.csv") if path.name != "runs.csv")
    assert len(logs) == len(counted)
    for path in logs:
        lines = path.read_text(encoding="utf-8").splitlines()
        data = sum(1 for line in lines if line and not line.startswith("#")) - 1
        assert counted[path.relative_to(raw).as_posix()] == data, path
    assert set(ledger["fate"]) == {"used", "dropped"}
    assert ledger["reason"].notna().all()


def test_reproduction_table_says_where_the_paper_differs(whole: Folder) -> None:
    table = whole.table("reproduction.csv")
    assert list(table.columns) == ["item", "where", "paper", "ours", "lo", "hi", "verdict", "why"]
    assert set(table["verdict"]) == {"same", "differs", "paper inconsistent"}
    assert table["why"].notna().all()
    own = table[table["where"].isin(["Table S5", "Table S3"])]
    assert (own["verdict"] == "same").all()


def test_every_promised_file_is_there(whole: Folder) -> None:
    results = whole.root / "results"
    promised = [f"alpha/{medium}.csv" for medium in (*MEDIA, *SANDS)]
    promised += ["alpha_tables.xlsx", "coefficients.csv", "coefficients.xlsx", "penetration.csv"]
    names = ["protocol_poppy_LP", "linearity", "stress_of_runs", "alpha_maps_poppy_LP",
             "alpha_maps", "fit_maps", "generic_profile"]  # fmt: skip
    promised += [f"figures/{name}.{end}" for name in names for end in ("png", "pdf", "svg")]
    promised += [f"quality/{m}.{end}" for m in (*MEDIA, *SANDS) for end in ("png", "pdf", "svg")]
    assert [name for name in promised if not (results / name).stat().st_size > 300] == []


def test_every_file_and_column_is_in_the_dictionary(whole: Folder) -> None:
    found = check_results(whole.root / "results")
    # the logs of Snakemake and its jobs, which this run did not need
    assert [line for line in found if not line.startswith("results/logs/")] == []


def test_nothing_is_done_twice(whole: Folder) -> None:
    assert whole.stale() == {}
    before = whole.digests()
    assert "Nothing to be done" in whole.run()
    assert whole.digests() == before


def test_one_changed_log_reruns_its_medium_only(whole: Folder) -> None:
    log = whole.root / "raw" / "paper" / "poppy_CP" / "poppy_CP_bp30_g45_in_force.csv"
    content = log.read_bytes()
    try:
        # one row less: another content, not only another date
        log.write_bytes(content[: content.rstrip().rfind(b"\n") + 1])
        later = time.time() + 2
        os.utime(log, (later, later))
        stale = whole.stale()
    finally:
        log.write_bytes(content)
    # the others follow where what they read comes out changed
    assert stale == {"ingest": {"poppy_CP"}, "provenance": {""}}


def test_a_changed_setting_reruns_what_depends_on_it(whole: Folder) -> None:
    path = whole.root / "config" / "config.yaml"
    before = path.read_text(encoding="utf-8")
    try:
        path.write_text(before.replace("threshold: 0.05", "threshold: 0.06"), encoding="utf-8")
        campaign = load_campaign(path)
        stale = whole.stale()
    finally:
        path.write_text(before, encoding="utf-8")
    named = {stage.name for stage in STAGES if {"fourier", ALL} & {*stage.settings}}
    drawn = {
        (one.group, one.file(medium))
        for one in figures()
        if "fourier" in one.settings and one.group not in ON_DEMAND
        for medium in one.media(campaign)
    }
    assert {*stale} == (named - {*ON_DEMAND}) | {group for group, _ in drawn}
    assert {(group, key) for group, _ in drawn for key in stale[group]} == drawn


def test_a_changed_row_of_the_sheet_reruns_its_medium_only(whole: Folder) -> None:
    path = whole.root / "raw" / "paper" / "runs.csv"
    before = path.read_text(encoding="utf-8")
    try:
        lines = before.splitlines()
        header = lines[0].split(",")
        place = next(i for i, line in enumerate(lines) if line.startswith("poppy_CP_bp30_g45_in,"))
        cells = lines[place].split(",")
        cells[header.index("excluded")], cells[header.index("reason")] = "yes", "dust on the plate"
        lines[place] = ",".join(cells)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        stale = whole.stale()
    finally:
        path.write_text(before, encoding="utf-8")
    for stage in ("ingest", "tare", "slopes", "legs"):
        assert stale[stage] == {"poppy_CP"}
    assert not {"fourier", "scaling", "legs_predicted", "figures", "quality"} & {*stale}
