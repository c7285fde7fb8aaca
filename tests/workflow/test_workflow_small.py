"""Two media through the real Snakefile: same bytes whatever the circumstances; faults end well."""

from __future__ import annotations

import json
import os
import random
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from campaigns import make_campaign

from rftfit.workflow.provenance import unpacked

if TYPE_CHECKING:
    from campaigns import Folder

pytestmark = pytest.mark.slow

MEDIA = ("poppy_LP", "yuma")


RECORDER = Path(__file__).parents[1] / "helpers" / "section_recorder"


@pytest.fixture(scope="module")
def sections(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder for what the stages of the run read of the configuration."""
    return tmp_path_factory.mktemp("sections")


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory, sections: Path) -> Folder:
    folder = make_campaign(tmp_path_factory.mktemp("small") / "campaign", MEDIA)
    before = os.environ.get("PYTHONPATH", "")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RFTFIT_SECTIONS", str(sections))
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(RECORDER), before))))
        folder.run()
    return folder


UNREAD = {
    # where the logs lie; read while the campaign is loaded
    "ingest": {"raw"},
    # in-air runs that no leg names, of which this campaign has none, are read there
    "ledger": {"raw", "dialect", "force_log", "motion_log", "media"},
}
"""Sections that a rule names and this run does not read."""


def test_rules_name_the_sections_that_stages_read(small: Folder, sections: Path) -> None:
    """So that a changed value reruns what it must, and no more."""
    text = (small.root / "results" / "provenance.json").read_text(encoding="utf-8")
    graph = unpacked(json.loads(text))
    read: dict[str, set[str]] = {}
    for path in sections.glob("*.json"):
        job = json.loads(path.read_text(encoding="utf-8"))
        if job["words"][0] == "provenance":
            continue  # the record itself is no step of the record
        # a stage's last word is what it writes
        rule, _ = graph.makers[job["words"][-1].partition("=")[2]]
        read.setdefault(rule, set()).update(job["read"])
    assert len(read) == len(graph.steps) >= 35
    for name, found in sorted(read.items()):
        named = set(graph.steps[name].settings)
        assert found <= named, f"rule {name} does not name {', '.join(sorted(found - named))}"
        if name != "page":  # it prints whatever there is
            assert named - found == UNREAD.get(name, set()), f"rule {name} names more than it reads"


def test_same_bytes_whatever_the_circumstances(small: Folder, tmp_path: Path) -> None:
    """One core, another folder with a space and an accent, the sheet shuffled and with CRLF."""
    other = make_campaign(tmp_path / "été 2013 ü", MEDIA)
    sheet = other.root / "raw" / "paper" / "runs.csv"
    header, *rows = sheet.read_text(encoding="utf-8").splitlines()
    random.Random(1).shuffle(rows)
    sheet.write_bytes(("\r\n".join([header, *rows]) + "\r\n").encode())
    other.run(cores=1)
    assert other.digests() == small.digests()


def test_faults_are_named_and_nothing_is_lost(tmp_path: Path) -> None:
    faults = ("gap:poppy_LP_bp00_g90_in", "saturated:poppy_LP_bp30_g90_in",
              "missing_tare:poppy_LP_bm30_g90_in", "truncated:poppy_LP_bp60_g90_in",
              "wrong_unit:poppy_LP_bp30_g45_in", "never_touches:poppy_LP_bm30_g45_in")  # fmt: skip
    folder = make_campaign(tmp_path / "faults", ("poppy_LP",), faults, plates_only=True)
    folder.run()
    fits = folder.table("fits/poppy_LP.csv").set_index("run_id")
    words = {
        "poppy_LP_bp30_g90_in": "saturated",
        "poppy_LP_bm30_g90_in": "no tare",
        "poppy_LP_bp30_g45_in": "lbf, but the config says N",
        "poppy_LP_bm30_g45_in": "surface not reached",
    }
    for run, word in words.items():
        assert word in fits.at[run, "reason"]
        assert np.isnan(fits.at[run, "alpha_z_N_per_cm3"])
        assert np.isnan(fits.at[run, "alpha_x_N_per_cm3"])
    assert "gap" in fits.at["poppy_LP_bp00_g90_in", "flags"]
    assert "lacks" in fits.at["poppy_LP_bp60_g90_in", "flags"]
    ledger = folder.table("ledger.csv")
    cut = ledger[
        (ledger["run_id"] == "poppy_LP_bp60_g90_in") & (ledger["reason"] == "cut in mid-row")
    ]
    assert cut["rows"].sum() == 1
    alpha = folder.table("alpha/poppy_LP.csv")
    hole = alpha[(alpha["beta_deg"] == 30) & (alpha["gamma_deg"] == 90)].iloc[0]
    assert np.isnan(hole["alpha_z_N_per_cm3"])
    assert "saturated" in hole["reason"]
    # a transform needs every cell, least squares does not
    fourier = folder.table("coefficients.csv")
    lsq = fourier[(fourier["method"] == "lsq") & (fourier["medium"] == "poppy_LP")]
    dft = fourier[(fourier["method"] == "dft-index") & (fourier["medium"] == "poppy_LP")]
    assert lsq["value_N_per_cm3"].notna().all()
    assert dft["value_N_per_cm3"].isna().all()
    assert dft["reason"].str.contains("cells have no alpha").all()


def test_a_disk_that_refuses_is_told(small: Folder, tmp_path: Path) -> None:
    """A file-size limit stops the writing of the traces as a full disk would."""
    import subprocess
    import sys

    target = tmp_path / "traces.parquet"
    script = (
        "import resource, signal, sys\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))\n"
        "from rftfit.__main__ import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    words = ["ingest", f"config={small.root / 'config' / 'config.yaml'}", "medium=yuma",
             f"traces={target}", f"runs={tmp_path / 'runs.csv'}", f"ledger={tmp_path / 'l.csv'}"]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", script, *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 3
    assert "traces.parquet: cannot write" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []
