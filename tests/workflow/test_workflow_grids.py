"""A planned grid of directions says which of its runs are missing or stray."""

import re

import pytest
from campaigns import make_campaign
from log_files import told

from rftfit.campaign.load import check_campaign

pytestmark = pytest.mark.slow


def test_a_planned_grid_finds_what_is_missing(tmp_path):
    """Runs in planned directions, one of them off by the arm's error; two cells without a run."""
    cells = [(b, g) for b in (-45.0, 0.0, 45.0, 90.0) for g in (-90.0, -45.0, 45.0, 90.0)]
    folder = make_campaign(tmp_path / "c", ("poppy_LP",), plates_only=True, directions=cells[:-2])
    config = folder.config.read_text("utf-8")
    grid = "grid: {beta_deg: [-45, 0, 45, 90], gamma_deg: [-90, -45, 45, 90]}\n"
    folder.config.write_text(config + grid, "utf-8")
    sheet = folder.root / "raw" / "paper" / "runs.csv"
    text = sheet.read_text("utf-8")
    assert ",45,45," in text
    sheet.write_text(text.replace(",45,45,", ",45,44.7,"), "utf-8")
    assert folder.rftfit("check").returncode == 0
    folder.run_here("checks")
    table = folder.table("alpha/poppy_LP.csv")
    assert set(zip(table["beta_deg"], table["gamma_deg"], strict=True)) == set(cells)
    empty = table[table["alpha_z_N_per_cm3"].isna()]
    assert list(zip(empty["beta_deg"], empty["gamma_deg"], strict=True)) == cells[-2:]
    assert set(empty["reason_code"]) == {"no-run"}
    sheet.write_text(text.replace(",45,45,", ",45,46,"), "utf-8")
    assert folder.rftfit("check").returncode == 2
    problems = check_campaign(folder.config)[1]
    rows = 18, 20
    assert told(problems) == [f"sheet.cell-unplanned {row} gamma_deg '45, 46'" for row in rows]
    # the tolerance and the nearest planned direction
    assert re.search(r" 0\.5 deg.* \(45, 45\)$", problems[1].allowed)
