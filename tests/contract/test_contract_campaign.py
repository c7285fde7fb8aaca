"""A campaign that was run: its results by Python and by commands, its records, edited outputs, killed runs."""

import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from makers import answer_of, json_of, refused, run_targets
from numpy.testing import assert_allclose

import rftfit

LAB, SAND = "poppy_LP", "yuma"
DOWN = (0.0, math.pi / 2)


@pytest.fixture(scope="module")
def folder(small_root, tmp_path_factory):
    """A copy of the campaign that all tests share: some tests edit it, and make it whole again."""
    copied = tmp_path_factory.mktemp("contract") / "campaign"
    shutil.copytree(small_root, copied)
    return copied


@pytest.fixture(scope="module")
def results(folder):
    return rftfit.open(folder)


@pytest.fixture
def changed(folder, tmp_path):
    """Another copy, to be put wrong."""
    return Path(shutil.copytree(folder, tmp_path / "changed"))


def table_of(path):
    return pd.read_csv(path, comment="#")


def test_results_and_their_media(results, folder):
    assert isinstance(results, rftfit.Results)
    assert results.media == (LAB, SAND)
    assert (results.laboratory, results.sands) == ((LAB,), (SAND,))
    assert [medium.name for medium in results] == [LAB, SAND]
    medium = results[LAB]
    assert isinstance(medium, rftfit.Medium)
    with pytest.raises(rftfit.RftfitError):
        results["poppy"]
    table = table_of(folder / "results" / "alpha" / f"{LAB}.csv")
    assert len(medium.alpha) == len(table)
    assert_allclose(
        medium.alpha["alpha_z_N_per_cm3"].sort_values(), table["alpha_z_N_per_cm3"].sort_values()
    )


def test_alpha_is_that_of_the_printed_table(results):
    """The logs were simulated from Table S5, so alpha has to come back."""
    printed = rftfit.published_medium(LAB)
    table = results[LAB].alpha.query("abs(gamma_deg) < 90")
    angles = np.radians(table["beta_deg"]), np.radians(table["gamma_deg"])
    for component, alpha in zip("zx", printed.alpha(*angles), strict=True):
        off = np.abs(table[f"alpha_{component}_N_per_cm3"] - alpha)
        assert off.max() < 0.1 * np.abs(alpha).max()


def test_a_profile_is_the_table(results):
    medium = results[LAB]
    row = medium.alpha.query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    alpha_z, alpha_x = medium.map().profile.alpha(*DOWN)
    assert float(alpha_z) == pytest.approx(row["alpha_z_N_per_cm3"], rel=0.15)
    assert abs(float(alpha_x)) < 0.1 * float(alpha_z)
    assert medium.zeta == pytest.approx(row["alpha_z_N_per_cm3"] / medium.chi)


def test_check_by_python_and_by_command(folder):
    problems = rftfit.check(folder)
    content = json_of("check", folder=folder)
    assert [p.code for p in problems] == [p["code"] for p in content["problems"]]
    assert content["errors"] == 0
    assert content["warnings"] == sum(problem.severity == "warning" for problem in problems)
    assert content["checks"] is None
    code, _, _ = answer_of("check", "--strict", folder=folder)
    assert code == (2 if content["warnings"] else 0)


def test_compare_by_python_and_by_command(folder, results):
    comparison = rftfit.compare_media(results[LAB], results[SAND])
    assert isinstance(comparison, rftfit.Comparison)
    content = json_of("compare", LAB, SAND, folder=folder)
    for name in ("ratio", "ratio_lo", "ratio_hi", "size_p", "least_ratio"):
        assert content[name] == pytest.approx(getattr(comparison, name), nan_ok=True), name
    assert comparison.ratio_lo < comparison.ratio < comparison.ratio_hi
    # the ratio of sizes is that of alpha straight down, where both were pushed
    down = [results[name].alpha.query("gamma_deg == 90 and beta_deg == 0") for name in (LAB, SAND)]
    alpha_lab, alpha_sand = (float(table["alpha_z_N_per_cm3"].iloc[0]) for table in down)
    assert comparison.ratio == pytest.approx(alpha_sand / alpha_lab, rel=0.1)
    backward = rftfit.compare_media(results[SAND], results[LAB])
    assert backward.ratio == pytest.approx(1 / comparison.ratio, rel=1e-6)
    assert backward.ratio_hi == pytest.approx(1 / comparison.ratio_lo, rel=2e-3)
    refused("compare", LAB, LAB, folder=folder)
    refused("compare", LAB, f"{folder}:nowhere", folder=folder)


def test_maps_are_compared_where_no_direction_is_common(small_root, changed):
    path = changed / "results" / "fits" / f"{LAB}.csv"
    table = pd.read_csv(path)
    table.assign(beta_deg=table["beta_deg"] + 4).to_csv(path, index=False)
    sides = [f"{root}:{LAB}" for root in (small_root, changed)]
    code, out, _ = answer_of("compare", *sides, "--figure", "c.svg", folder=changed)
    assert code == 0
    assert f"Note: {sides[0]} and {sides[1]} " in out
    assert (changed / "c.svg").is_file()
    first, second = (rftfit.open(root)[LAB] for root in (small_root, changed))
    comparison = rftfit.compare_media(first, second)
    assert comparison.ratio_lo < 1 < comparison.ratio_hi
    assert comparison.ratio_lo * comparison.ratio_hi == pytest.approx(comparison.ratio**2)


def test_sessions_of_a_medium_are_compared(changed):
    sheet = changed / "raw" / "paper" / "runs.csv"
    rows = pd.read_csv(sheet, dtype=str)
    is_down = (rows["kind"] == "plate") & (rows["gamma_deg"] == "90")
    rows["session"] = np.where(is_down, "monday", "friday")
    rows.to_csv(sheet, index=False)
    error = refused("compare", f"{LAB}@sunday", f"{LAB}@monday", folder=changed)
    assert "found 'sunday'; allowed: friday, monday" in error
    error = refused("compare", f"{LAB}@friday", f"{LAB}@monday", folder=changed)
    assert "no common direction" in error


@pytest.mark.parametrize("kind", ["map", "fourier", "generic"])
def test_predict_with_a_medium_of_the_campaign(kind, folder, results, tmp_path):
    words = f"predict --leg c_leg --medium {LAB} --results results --profile {kind} --output"
    output = tmp_path / "forces.csv"
    content = json_of(*words.split(), output, folder=folder)
    profile = results[LAB].map().profile if kind == "map" else results[LAB].profile(kind)
    forces = rftfit.predict(profile, rftfit.model_leg("c_leg"))
    assert_allclose(table_of(output)["force_z_N"], forces["force_z_N"], rtol=1e-6, atol=1e-9)
    assert content["rows_unknown"] == 0


def test_export_of_a_medium_of_the_campaign(folder, results, tmp_path):
    path = tmp_path / "profile.json"
    words = ["export", "--medium", LAB, "--results", "results", "--profile", "map"]
    assert answer_of(*words, "--output", path, folder=folder)[0] == 0
    beta, gamma = np.radians([0, 30, -45]), np.radians([90, 45, -30])
    expected = results[LAB].map().profile.alpha(beta, gamma)
    assert_allclose(rftfit.read_profile(path).alpha(beta, gamma), expected, atol=1e-5)


def test_plan_from_a_medium_of_the_campaign(folder, tmp_path):
    words = ["plan", "--results", "results", "--medium", SAND, "--target", "zeta", "--count", "1"]
    content = json_of(*words, "--output", tmp_path / "plan.csv", folder=folder)
    before, after = (row["half_width_percent"] for row in content["pushes"])
    assert 0 < after < before < 100


def test_all_is_as_recorded(folder):
    content = json_of("verify", folder=folder)
    assert len(content["as_recorded"]) > 50
    assert all(content["as_recorded"].values())
    assert (content["changed"], content["why"], content["others"]) == ([], [], [])
    one = json_of("verify", "results/coefficients.csv", folder=folder)
    assert one["as_recorded"] == {"results/coefficients.csv": True}
    refused("verify", "results/coefficient.csv", folder=folder)
    refused("verify", "--again", "results/coefficients.csv", folder=folder)


def test_a_campaign_does_not_differ_from_its_copy(folder, small_root):
    content = json_of("diff", folder, small_root)
    assert not any(content.values())


def test_another_number_is_told_with_its_size(small_root, changed):
    path = changed / "results" / "alpha" / f"{SAND}.csv"
    table = pd.read_csv(path)
    was = table["alpha_z_N_per_cm3"].iloc[0]
    half_width = table["alpha_z_hi_N_per_cm3"].iloc[0] - was
    table["alpha_z_N_per_cm3"] += 2 * half_width
    table.to_csv(path, index=False)
    content = json_of("diff", small_root, changed)
    (difference,) = [d for d in content["changed"] if d["file"].endswith(f"{SAND}.csv")]
    assert difference["was"] == pytest.approx(was)
    assert difference["now"] == pytest.approx(was + 2 * half_width)
    assert difference["half_widths"] == pytest.approx(2, rel=0.1)
    assert content["not_as_recorded"] == [f"{changed}/results/alpha/{SAND}.csv"]


def test_other_origins_are_told_and_many_of_one_sort_in_one_line(small_root, changed):
    results = changed / "results"
    record = results / "records" / "checks" / f"{SAND}.json"
    job = json.loads(record.read_text())
    record.write_text(
        json.dumps(job | {"state": job["state"] | {"rows": "other", "code": "other"}})
    )
    gone = re.compile(rf"(^|/)({SAND}_|{LAB}_bp00_g90_in(,|_force))")
    for name in ("manifest.sha256", "run_sheet.csv"):
        lines = (results / name).read_text().splitlines(keepends=True)
        (results / name).write_text("".join(line for line in lines if not gone.search(line)))
    content = json_of("diff", small_root, changed)
    assert content["since_the_record"] == {str(results): ["code", "rows"]}
    assert len(content["because"]) == 17
    lines = answer_of("diff", small_root, changed)[1].splitlines()
    assert [line.partition(":")[0].split(maxsplit=1) for line in lines[-4:]] == [
        ["file", f"raw/paper/{LAB}/{LAB}_bp00_g90_in_force.csv"],
        ["file", f"raw/paper/{SAND}/{SAND}_* (10 of them)"],
        ["run", f"{LAB}_bp00_g90_in"],
        ["run", f"{SAND}_* (5 of them)"],
    ]
    assert answer_of("diff", small_root, changed, "--all")[1].count(f"  run {SAND}_") == 5


def test_results_of_a_version_with_other_columns_are_compared(small_root, changed):
    """Numbers that both have are compared; a column of one of them is named."""
    path = changed / "results" / "leg_errors.csv"
    table = pd.read_csv(path)
    table["peak_late_deg"] += 1
    table.drop(columns=["model_error"]).to_csv(path, index=False)
    content = json_of("diff", small_root, changed)
    assert {difference["quantity"] for difference in content["changed"]} == {"peak_late_deg"}
    assert content["only_in_one"] == ["leg_errors.csv, column model_error"]
    table[["model_error"]].to_csv(path, index=False)
    assert "leg_errors.csv: no column medium" in refused("diff", small_root, changed)


def test_marks_of_a_medium_are_handed_on(changed):
    path = changed / "results" / "checks" / f"{LAB}.csv"
    table = pd.read_csv(path, dtype=str)
    table.loc[0, ["verdict", "effect"]] = "failed", "unusable"
    table.to_csv(path, index=False)
    code, _, error = answer_of("export", "--results", "results", "--medium", LAB, folder=changed)
    assert code == 0
    mark = json.loads((changed / "profile.json").read_text())["validity"]["marks"]
    assert mark.startswith("unusable: ")
    assert f"warning: {LAB} is {mark}" in error


@pytest.mark.parametrize("damage", ["edited", "linked"])
def test_a_damaged_result_is_told_and_made_again(damage, folder):
    name = f"results/fits/{SAND}.csv"
    path, copy = folder / name, folder / "copy.csv"
    content = path.read_bytes()
    if damage == "edited":
        path.write_bytes(content.replace(b"0", b"1", 1))
    else:
        copy.write_bytes(content + b"\n")
        path.unlink()
        path.symlink_to(copy)
    code, out, _ = answer_of("verify", "--json", folder=folder)
    assert code == 5
    as_recorded = json.loads(out)["as_recorded"]
    assert as_recorded[name] is False
    # what is made from it is not as recorded either, what is not is
    assert as_recorded[f"results/alpha/{SAND}.csv"] is False
    assert as_recorded[f"results/alpha/{LAB}.csv"] is True
    if damage == "linked":
        assert "files.link-in-the-way" in refused("run", name, folder=folder)
        assert copy.read_bytes() == content + b"\n"
        path.unlink()
    report = run_targets(folder, [name])
    assert f"slopes {SAND}" in report.made
    assert f"slopes {LAB}" not in report.made
    assert report.failed == {}
    assert (path.read_bytes(), path.is_symlink()) == (content, False)
    assert json_of("verify", name, folder=folder)["as_recorded"] == {name: True}


def test_another_log_is_told(folder):
    log = min((folder / "raw").rglob(f"*/{SAND}/*force*.csv"))
    content = log.read_bytes()
    log.write_bytes(content + b"\n")
    try:
        code, out, _ = answer_of("verify", "--json", folder=folder)
        assert code == 5
        as_recorded = json.loads(out)["as_recorded"]
        assert as_recorded[f"results/alpha/{SAND}.csv"] is False
        assert as_recorded[f"results/alpha/{LAB}.csv"] is True
        assert any(log.name in change for change in json.loads(out)["changed"])
    finally:
        log.write_bytes(content)
    assert all(json_of("verify", folder=folder)["as_recorded"].values())


def run_when_free(folder, name, until_s=20.0):
    """Run a target as soon as the children of a killed run have ended, too."""
    last_try = time.monotonic() + until_s
    while True:
        try:
            return rftfit.run(folder, [name], cores=1)
        except rftfit.RftfitError:
            if time.monotonic() > last_try:
                raise
            time.sleep(0.1)


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path):
    rows = rftfit.published_table("table_s5").query("medium == 'poppy_LP'")
    rows.to_csv(tmp_path / "alpha.csv", index=False)
    assert answer_of("init", "c", "--alpha-table", "alpha.csv", folder=tmp_path)[0] == 0
    folder, name = tmp_path / "c", "results/alpha/poppy_LP.csv"
    shutil.copytree(folder, tmp_path / "unbroken")
    program = Path(sys.executable).with_name("rftfit")
    process = subprocess.Popen(
        [program, "run", "--cores", "1", name],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        until = time.monotonic() + 300
        while not (folder / "results" / "records").exists() and process.poll() is None:
            assert time.monotonic() < until
            time.sleep(0.02)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    went_on = run_when_free(folder, name)
    assert went_on.failed == {}
    unbroken = rftfit.run(tmp_path / "unbroken", [name], cores=1)
    assert len(unbroken.made) >= len(went_on.made)
    assert (folder / name).read_bytes() == (tmp_path / "unbroken" / name).read_bytes()
    assert rftfit.run(folder, [name], cores=1).made == []
