"""Campaigns in other directions than the paper's give the true alpha through the whole workflow."""

import re

import numpy as np
import pytest
from campaigns import make_campaign
from log_files import told

from rftfit.campaign.load import check_campaign
from rftfit.lab.plan import parse_directions
from rftfit.lab.truth import table_s5
from rftfit.measure.alpha import alpha_columns

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def scattered(tmp_path_factory):
    """Forty directions on no grid, in loose poppy seeds."""
    root = tmp_path_factory.mktemp("scattered") / "campaign"
    cells = parse_directions("scattered:40", 2013)
    folder = make_campaign(root, ("poppy_LP",), plates_only=True, directions=cells)
    folder.run_here(drawn=("poppy_LP",))
    return folder


def shares(table):
    """Part of the cells whose intervals hold the truth, for alpha_z and alpha_x."""
    truth = [
        table_s5("poppy_LP", *angles)
        for angles in zip(table["beta_deg"], table["gamma_deg"], strict=True)
    ]
    return [
        float(
            np.mean(
                (table[f"alpha_{c}_lo_N_per_cm3"] <= true_alpha)
                & (true_alpha <= table[f"alpha_{c}_hi_N_per_cm3"])
            )
        )
        for c, true_alpha in zip("zx", np.transpose(truth), strict=True)
    ]


def test_every_scattered_direction_is_measured(scattered):
    table = scattered.table("alpha/poppy_LP.csv")
    directions_measured = set(zip(table["beta_deg"], table["gamma_deg"], strict=True))
    assert directions_measured == set(parse_directions("scattered:40", 2013))
    assert np.isfinite(alpha_columns(table)).all()
    assert min(shares(table)) >= 0.9
    assert not (scattered.root / "results" / "quality" / "poppy_LP_page2.png").exists()


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
