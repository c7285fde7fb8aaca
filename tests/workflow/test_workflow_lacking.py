"""Campaigns without a tare, or with a medium of which nothing is usable, run to their end."""

import pandas as pd
import pytest
import yaml
from campaigns import FEW, Folder, make_campaign
from makers import read_rows, write_rows, write_yaml
from third_party import CMU_SAND, needs

pytestmark = pytest.mark.slow

ALPHA = ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]


def rewrite(folder, keep, **cells):
    """Keep some rows of the run sheet, with these cells changed, and return them."""
    sheet = folder.root / "raw" / "paper" / "runs.csv"
    rows = [row | cells for row in read_rows(sheet) if keep(row)]
    write_rows(sheet, rows)
    return rows


def damage(folder, row):
    (folder.root / "raw" / "paper" / row["force_log"]).write_text("nothing\n", "utf-8")


def allow_no_tare(root):
    path = root / "config" / "config.yaml"
    values = yaml.safe_load(path.read_text("utf-8"))
    values["fit"]["missing_tare"] = "flag"
    del values["robot"]
    write_yaml(path, values)


def run(folder, drawn=()):
    """Run, verify, and return the page on one line."""
    folder.run_here(drawn=drawn)
    process = folder.rftfit("verify")
    assert process.returncode == 0, process.stdout + process.stderr
    return " ".join((folder.root / "results" / "report.html").read_text("utf-8").split())


@pytest.fixture(scope="module")
def untared(tmp_path_factory):
    """No tare at all; the first medium has damaged logs only."""
    media = ("poppy_LP", "poppy_CP", "yuma")
    folder = make_campaign(tmp_path_factory.mktemp("untared") / "campaign", media, directions=FEW)
    allow_no_tare(folder.root)

    def keep(row):
        lost = row["medium"] == "poppy_LP" and "bp00_g90" not in row["run_id"]
        return row["kind"] in ("plate", "leg") and not lost

    for row in rewrite(folder, keep, tare_run="", tare_shared=""):
        if row["medium"] == "poppy_LP":
            damage(folder, row)
    return folder, run(folder)


def test_runs_without_a_tare_give_flagged_numbers(untared):
    folder, page = untared
    fits = folder.table("fits/poppy_CP.csv")
    assert len(fits) == 28
    assert fits[ALPHA].notna().all(axis=None)
    flags = pd.concat(folder.table(f"flags/{medium}.csv") for medium in ("poppy_CP", "yuma"))
    bare = set(flags.loc[flags["code"] == "no-tare", "run_id"])
    assert set(fits["run_id"]) <= bare
    for medium in ("poppy_CP", "yuma"):
        curves = folder.table(f"legs/{medium}.csv")
        assert set(curves["leg"]) == {"c_leg", "flat_leg", "reversed_c_leg"}
        assert curves[["force_z_N", "zero_se_z_N"]].notna().all(axis=None)
        assert set(curves["run_id"]) <= bare
    errors = folder.table("leg_errors.csv")
    # the table has holes in this campaign
    errors = errors[(errors["medium"] != "poppy_LP") & (errors["profile"] != "table")]
    assert set(errors["medium"]) == {"poppy_CP", "yuma"}
    assert errors["peak_error_percent"].notna().all()
    assert errors["reason_code"].str.contains("no-tare").all()
    sands = folder.table("sands.csv")
    assert (
        sands[["alpha_z_N_per_cm3", "alpha_z_lo_N_per_cm3", "alpha_z_hi_N_per_cm3", "zeta"]]
        .notna()
        .all(axis=None)
    )
    assert sands["reason_code"].str.contains("no-tare").all()
    assert " at the same " not in page.partition('id="methods"')[2]


def test_a_medium_without_a_cell_takes_no_other_down(untared):
    folder, _ = untared
    lost = folder.table("alpha/poppy_LP.csv")
    assert lost[ALPHA].isna().all(axis=None)
    assert lost["reason"].notna().all()
    for name, column in (("coefficients", "value_N_per_cm3"), ("penetration", "zeta")):
        table = folder.table(f"{name}.csv")
        table = table[~table["method"].str.contains("dft-index")]  # which needs the whole grid
        none = table["medium"] == "poppy_LP"
        assert none.any()
        assert table.loc[none, column].isna().all()
        assert table.loc[none, "reason"].notna().all()
        assert table.loc[~none, column].notna().all()


@needs(CMU_SAND)
def test_the_sand_example_runs(tmp_path):
    """Nine penetrations without a tare, as `rftfit example` lays them out and judges them."""
    folder = Folder(tmp_path)
    process = folder.rftfit("example", "cmu-sand", ".", "--from", str(CMU_SAND))
    assert process.returncode == 0, process.stderr
    assert " any of 9 runs" in folder.rftfit("check").stdout
    # the only figure that no other campaign has
    page = run(folder, ("clocks_sand_60mm",))
    verdicts = pd.read_csv(folder.root / "verdicts.csv")
    assert list(verdicts["reason_code"].unique()) == ["in-interval", "typed-by-hand"]
    assert (verdicts["verdict"] == "inside").sum() == 3
    counted = {path.name: len(path.read_bytes().splitlines()) for path in CMU_SAND.glob("*_?.txt")}
    ledger = folder.table("ledger.csv").groupby("file")["rows"].sum()
    assert {name: ledger[name] for name in counted} == counted
    assert ledger["force-displacement_1.bag"] == 3004
    assert len(ledger) == 2 * len(counted) == 18
    alpha = []
    for medium in ("sand_60mm", "sand_80mm", "sand_100mm"):
        runs, fits = (folder.table(f"{name}/{medium}.csv") for name in ("runs", "fits"))
        # five hours behind, as Pittsburgh is in January, and the rest of a tenth of a second
        assert (runs["clock_hours"] == -5).all()
        deviation = (runs["clock_rest_s"] - 0.045) / runs["clock_se_s"]
        assert (deviation.abs() < 3.5).all()
        assert (runs["clock_se_s"] < 0.1).all()
        assert (runs["clock_explained"] > 0.999).all()
        # one afternoon: its nine pushes show one offset
        assert (runs["clock_pushes"] == 9).all()
        # what the people who recorded it typed in by hand lies between -8.55 and -9.68 mm
        assert runs["surface_z_mm"].between(-10.2, -8.9).all()
        assert (runs["surface_se_mm"] < 0.5).all()
        assert len(fits) == 3
        assert fits[ALPHA].notna().all(axis=None)
        assert (fits["exponent_z"] > 1).all()
        alpha.append(folder.table(f"alpha/{medium}.csv").loc[0, "alpha_z_N_per_cm3"])
        assert (abs(fits[ALPHA[0]] / alpha[-1] - 1) < 0.1).all()
    assert alpha == pytest.approx([0.853, 1.202, 1.735], abs=1e-3)
    zeta = folder.table("penetration.csv").set_index("medium")["zeta"]
    assert zeta.tolist() == pytest.approx([0.758, 1.068, 1.542], abs=1e-3)
    assert " all 9 runs were used." in page
