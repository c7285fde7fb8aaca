"""Code that is edited while a run works, through the real workflow: it stops, and nothing false is recorded."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pandas as pd
import pytest
from campaigns import PROJECT, Folder, make_campaign

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow

PARTS = ("Snakefile", "workflow", "profiles", "config", "src")
EDITS = {
    "measure": (
        "measure/fits.py",
        "stress = stroke.force",
        "stress = 3 * stroke.force",
        "traces",
        "alpha/yuma.csv",
    ),
    "model": (
        "model/shapes.py",
        "\nNOT_ALIKE",
        "\nEDITED = True\nNOT_ALIKE",
        "fits",
        "maps/yuma.csv",
    ),
    "page": ("page/methods.py", "\ndef ", "\nEDITED = True\n\n\ndef ", "alpha", "report.html"),
}
"""By room: a file, its edit, the folder of results after which it is edited, and a result that it is used for."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return make_campaign(tmp_path_factory.mktemp("logs") / "lab", ("yuma",), plates_only=True)


def rftfit(checkout: Path, root: Path, word: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "rftfit.cli.main", word], cwd=root, text=True,
        env=os.environ | {"PYTHONPATH": str(checkout / "src")},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


@pytest.mark.parametrize("room", EDITS)
def test_code_that_changes_during_a_run(logs: Folder, tmp_path: Path, room: str) -> None:
    file, old, new, after, result = EDITS[room]
    checkout, root = tmp_path / "checkout", tmp_path / "lab é"
    checkout.mkdir()
    for part in PARTS:
        (shutil.copytree if (PROJECT / part).is_dir() else shutil.copy)(
            PROJECT / part, checkout / part
        )
    shutil.copytree(logs.root, root)
    source = checkout / "src" / "rftfit" / file
    with rftfit(checkout, root, "run") as run:
        while not (root / "results" / after).is_dir() and run.poll() is None:
            time.sleep(0.01)
        text = source.read_text(encoding="utf-8")
        source.write_text(text.replace(old, new, 1), encoding="utf-8")
        said = run.communicate()[0]
    assert run.returncode == 4, said
    assert source.read_text(encoding="utf-8") != text
    assert "while the workflow ran, this changed: code" in said
    assert not (root / "results" / result).exists()
    if room != "measure":
        return
    again = rftfit(checkout, root, "run").communicate()[0]
    assert "Done: " in again
    with rftfit(checkout, root, "verify") as verify:
        assert "all as recorded" in verify.communicate()[0]
    alpha = pd.read_csv(root / "results" / "alpha" / "yuma.csv")["alpha_z_N_per_cm3"].iloc[0]
    assert alpha == pytest.approx(3 * 0.69, rel=0.02)
