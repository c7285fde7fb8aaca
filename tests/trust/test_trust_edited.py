"""`rftfit run` stops when its code is edited while it works, and records nothing false."""

import os
import shutil
import subprocess
import sys
import time

import pytest
from campaigns import make_campaign
from paper import PROJECT

pytestmark = pytest.mark.slow

PARTS = ("Snakefile", "workflow", "profiles", "config", "src")
"""What of the project is copied."""
EDIT = ("stress = stroke.force", "stress = 3 * stroke.force")
"""The line of the code that is changed, and its new text."""


def rftfit(checkout, root, *words):
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "rftfit", *words],
        cwd=root,
        text=True,
        env=os.environ | {"PYTHONPATH": str(checkout / "src")},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def test_code_that_changes_during_a_run(tmp_path):
    checkout = tmp_path / "checkout"
    checkout.mkdir()
    for name in PARTS:
        (shutil.copytree if (PROJECT / name).is_dir() else shutil.copy)(
            PROJECT / name, checkout / name
        )
    folder = make_campaign(tmp_path / "lab é", ("yuma",), plates_only=True)
    source = checkout / "src" / "rftfit" / "measure" / "fits.py"
    with rftfit(checkout, folder.root, "run") as run:
        while not (folder.root / "results" / "traces").is_dir() and run.poll() is None:
            time.sleep(0.01)
        text = source.read_text(encoding="utf-8")
        source.write_text(text.replace(*EDIT, 1), encoding="utf-8")
        printed = run.communicate()[0]
    assert run.returncode == 4, printed
    assert source.read_text(encoding="utf-8") != text
    assert " changed: code" in printed
    result = "results/alpha/yuma.csv"
    assert not (folder.root / result).exists()
    text_of_rerun = rftfit(checkout, folder.root, "run", result).communicate()[0]
    assert "Done: " in text_of_rerun
    alpha = folder.table("alpha/yuma.csv")["alpha_z_N_per_cm3"].iloc[0]
    assert alpha == pytest.approx(3 * 0.69, rel=0.02)
