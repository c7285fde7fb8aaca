"""A run repeats only what a change affects."""

import json
import os
import re
import shutil
import time

import numpy as np
import pytest
from campaigns import Folder

import rftfit

pytestmark = pytest.mark.slow


def test_results_of_a_medium_of_before_are_named_and_not_believed(small):
    results = small.root / "results"
    leftovers = {
        "alpha/dune.csv": "beta_deg\n",
        "checks/dune.csv": "medium,verdict,effect,sentence\ndune,failed,unusable,The axes are wrong.\n",
    }
    clean = small.rftfit("verify").stdout.splitlines()
    try:
        for name, content in leftovers.items():
            (results / name).write_text(content, "utf-8")
        repeated, verified = small.rftfit("run"), small.rftfit("verify")
    finally:
        for name in leftovers:
            (results / name).unlink()
    (line,) = (line for line in verified.stdout.splitlines() if line not in clean)
    assert line.endswith(": results/alpha/dune.csv, results/checks/dune.csv.")
    assert line in repeated.stdout
    assert "dune" not in repeated.stdout.replace(line, "")
    assert verified.returncode == 0


IN_2037 = 2.13e9


def test_a_setting_changed_in_a_copy_without_the_memory_of_snakemake(small, tmp_path):
    copy = Folder(tmp_path / "copy é")
    shutil.copytree(small.root, copy.root, ignore=shutil.ignore_patterns(".snakemake"))
    text = copy.config.read_text("utf-8")
    copy.config.write_text(text.replace("threshold: 0.05", "threshold: 0.3"), "utf-8")
    # a clock that was ahead: every result is newer than whatever is made now
    for path in (copy.root / "results").rglob("*"):
        os.utime(path, (IN_2037, IN_2037))
    process = copy.rftfit("run", "results/coefficients.csv", "results/penetration.csv")
    assert process.returncode == 0, process.stderr
    assert max(p.stat().st_mtime for p in (copy.root / "results").rglob("*.csv")) < time.time()
    # sentences and pictures are of before, so none is named
    assert "Found:" not in process.stdout
    assert "report.html" not in process.stdout
    assert "results/coefficients.csv" in process.stdout
    # what was not asked for is counted
    assert re.search(r": \d+ files; rftfit run ", process.stdout)
    assert ": fourier, scaling" in process.stderr
    kept_in_copy, kept_at_first = (
        folder.table("coefficients.csv")["kept"] for folder in (copy, small)
    )
    assert kept_in_copy.sum() < kept_at_first.sum()
    assert "fourier" not in copy.stale()
    # what was not asked for waits, and nothing of it is believed
    assert "page" in copy.stale()
    assert copy.rftfit("verify", "results/coefficients.csv").returncode == 0
    assert copy.rftfit("verify", "results/report.html").returncode != 0


def test_bekkers_law_of_the_pushes_straight_down(small, tmp_path):
    """Of Table S5 stress is a line: n is 1, and k_phi is alpha_z(0, 90 deg)."""
    medium = rftfit.open(small.root)["poppy_LP"]
    output = tmp_path / "bekker.json"
    words = ("--medium", "poppy_LP", "--results", small.root, "--bekker", "--output", output)
    process = small.rftfit("export", *words)
    law = json.loads(output.read_text("utf-8"))
    alpha_down = medium.alpha.query("beta_deg == 0 and gamma_deg == 90")
    assert law["n"] == pytest.approx(1, abs=0.05)
    assert law["widths_m"] == [0.0254]
    at_m = 0.05
    pressure = medium.pressure_sinkage().pressure_Pa(np.array([at_m]), law["widths_m"][0])
    assert pressure == pytest.approx(1e6 * at_m * alpha_down["alpha_z_N_per_cm3"].iloc[0], rel=0.03)
    assert "k_c from k_phi" in process.stderr
    refused = small.rftfit("export", "--medium", "poppy_LP", "--bekker")
    assert refused.returncode == 2
    assert "--results DIR" in refused.stderr
