"""A run that stands twice in a table of stress or alpha is found and used once.

Also tested: a table without force along x.
"""

from __future__ import annotations

import numpy as np
import pytest
from campaigns import Folder, run_rules
from makers import answer_of, json_of

from rftfit.measure.flags import remark

STRESS = "run_id,beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2"
"""Header of a table of stress."""


def stress(name, beta, gamma, depths=8, seed=0, digits=3):
    noise = np.random.default_rng(seed).normal(0, 0.01, (depths, 2))
    rows = []
    for depth, (z, x) in enumerate(noise, start=1):
        values = (round(0.3 * depth + z, digits), round(-0.1 * depth + x, digits))
        rows.append(f"{name},{beta},{gamma},{depth},{values[0]},{values[1]}")
    return rows


def campaign_of(folder, lines, holds="stress"):
    """Make a campaign around a table of these lines."""
    (folder / "table.csv").write_text("\n".join(lines))
    assert answer_of("init", "c", f"--{holds}-table", "table.csv", folder=folder)[0] == 0
    return Folder(folder / "c")


def outcomes_of(campaign):
    """Outcome of each check, as the command prints it."""
    checks = json_of("check", "--diagnose", folder=campaign.root)["checks"]
    return {outcome["check"]: outcome for outcome in checks}


def tables_of(campaign, *names):
    """Tables of the only medium, up to its checks."""
    run_rules(campaign.config, "ingest", "tare", "slopes", "checks")
    (fits,) = (campaign.root / "results" / "fits").glob("*.csv")
    return [campaign.table(f"{name}/{fits.name}") for name in names]


@pytest.mark.parametrize(
    ("rows", "verdict", "copies"),
    [
        (stress("a", 0, 90) + stress("b", 30, 90, seed=1), "passed", ""),
        (stress("a", 0, 90) + stress("b", 0, 45), "failed", "a and b"),
        (stress("a", 0, 90) + stress("rep2", 0, 90), "failed", "a and rep2"),
        # one plate under both of its angles
        (stress("a", -90, 45) + stress("b", 90, 45), "passed", ""),
        # no copy, but digits that are equal by chance
        (stress("a", 0, 90, 3, digits=1) + stress("b", 0, 90, 3, 1, 1), "not checked", ""),
        (["a,0,90,0.3,0", "b,0,90,0.3,0"], "not checked", ""),
    ],
)
def test_a_run_that_stands_twice_in_a_table(tmp_path, rows, verdict, copies):
    holds = "stress" if rows[0].count(",") == STRESS.count(",") else "alpha"
    head = (
        STRESS
        if holds == "stress"
        else "run_id,beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3"
    )
    outcome = outcomes_of(campaign_of(tmp_path, [head, *rows], holds))["same_logs"]
    code = {"passed": "", "failed": "-copied", "not checked": "-table"}[verdict]
    assert (outcome["verdict"], outcome["code"]) == (verdict, f"same_logs{code}")
    assert not copies or outcome["found"].endswith(f": {copies}")


@pytest.mark.parametrize("has_x", [True, False])
def test_a_copy_is_not_counted_among_the_runs_that_are_used(tmp_path, has_x):
    rows = [*stress("a", 60, 90), *stress("rep2", 60, 90), *stress("b", 30, 90, seed=1)]
    lines = [STRESS, *rows]
    if not has_x:
        lines = [line.rpartition(",")[0] for line in lines]
    campaign = campaign_of(tmp_path, lines)
    fits, book = tables_of(campaign, "fits", "ledger/slopes")
    fit_of_run = {row["run_id"]: row for row in fits.to_dict("records")}
    assert [name for name, row in fit_of_run.items() if row["alpha_z_N_per_cm3"] > 0] == ["a", "b"]
    assert (fit_of_run["rep2"]["reason"], fit_of_run["rep2"]["reason_code"]) == (
        str(remark("same-readings", runs="a")),
        "same-readings",
    )
    fates = set(
        zip(*(book[name] for name in ("run_id", "fate", "reason_code", "rows")), strict=True)
    )
    assert {("a", "used", "slope", 8), ("rep2", "dropped", "same-readings", 8)} <= fates


def test_a_table_without_a_force_along_x(tmp_path):
    """Of a machine with one axis: alpha_x is blank but where symmetry makes it 0, and nothing is silent or symmetric."""
    rows = ["0,90,0.35,", "30,90,0.28,", "-30,45,0.1,", "60,45,0.16,"]
    for table in (
        ["beta_deg,gamma_deg,alpha_z,alpha_x", *rows],
        [row.rpartition(",")[0] for row in ["beta_deg,gamma_deg,alpha_z,", *rows]],
    ):
        folder = tmp_path / str(len(table[0]))
        folder.mkdir()
        campaign = campaign_of(folder, table, "alpha")
        verdicts = {check: outcome["verdict"] for check, outcome in outcomes_of(campaign).items()}
        assert "failed" not in verdicts.values()
        assert verdicts["symmetry"] == "not checked"
        fits, flags = tables_of(campaign, "fits", "flags")
        assert fits.loc[fits["alpha_x_N_per_cm3"].notna(), "beta_deg"].tolist() == [0]
        assert set(flags.loc[flags["code"] == "no-force-x", "run_id"]) == set(fits["run_id"])
