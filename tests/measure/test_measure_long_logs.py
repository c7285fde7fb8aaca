"""Logs of more rows than are kept: read part by part, as means of neighbours; all others as they are."""

import numpy as np
import pytest
import yaml
from makers import GOLDEN, MadePushes, write_campaign

from rftfit.campaign.load import load_campaign
from rftfit.measure.fits import fit_medium
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.ledger import check_ledger, join
from rftfit.measure.long_logs import memory_need
from rftfit.measure.tare import tare_medium

MOST_ROWS = 200
"""In place of a million: the logs of this page have 380 and 420 rows."""
FULL_GF = 100 / 9.80665e-3
"""Reading at the end of the range of F3."""
COLUMNS = ("run_id", "kind", "intruder", "beta_deg", "gamma_deg", "tare_run")
RUNS = (("rod", "rod", "plate", 0, 90, ""), ("a", "plate", "plate", 0, 90, "rod"))
PUSHES = MadePushes(force_unit="gf")


@pytest.fixture
def campaign(tmp_path):
    config = yaml.safe_load((GOLDEN / "home-rig" / "config.yaml").read_text("utf-8"))
    rows = [
        dict(zip(COLUMNS, run, strict=True))
        | {
            "medium": "sand",
            "direction": "intrusion",
            "force_log": f"{run[0]}_force.csv",
            "motion_log": f"{run[0]}_stage.csv",
        }
        for run in RUNS
    ]
    config["clock"] = {"method": "same_clock"}
    return load_campaign(write_campaign(tmp_path, config, rows=rows, pushes=PUSHES))


@pytest.fixture
def parted(monkeypatch):
    monkeypatch.setattr("rftfit.measure.long_logs.LEAST_BYTES", 0)
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 1000)


@pytest.fixture
def averaged(parted, monkeypatch):  # noqa: ARG001
    monkeypatch.setattr("rftfit.measure.long_logs.MOST_ROWS", MOST_ROWS)


def measure(campaign):
    """Samples, fits and tables of runs, whose rows add up."""
    samples, runs, ingested = ingest_medium(campaign, "sand")
    tared, tares, tare_book = tare_medium(campaign, "sand", samples, runs)
    fits, _, fit_book = fit_medium(campaign, "sand", runs, tared, tares)
    books = [book.table() for book in (ingested, tare_book, fit_book)]
    check_ledger(join(books), runs)
    return samples, fits.set_index("run_id"), runs.set_index("run_id"), join(books)


def edit_force_log(campaign, edit):
    path = campaign.raw / "a_force.csv"
    lines = path.read_text("utf-8").splitlines()
    path.write_text("\n".join(edit(lines)) + "\n", "utf-8")


def test_a_log_in_parts_is_that_of_one_piece(campaign, request):
    whole_samples, whole_fits, _, _ = measure(campaign)
    request.getfixturevalue("parted")
    samples, fits, _, _ = measure(campaign)
    assert samples.equals(whole_samples)
    assert fits.equals(whole_fits)


def test_means_give_the_same_alpha(campaign, request):
    whole_samples, whole_fits, _, _ = measure(campaign)
    assert len(whole_samples) > 3 * MOST_ROWS
    request.getfixturevalue("averaged")
    samples, fits, runs, book = measure(campaign)
    counts = samples["run_id"].value_counts()
    assert counts.between(MOST_ROWS / 2, MOST_ROWS).all()
    step_s = runs["sample_step_s"].to_numpy()
    np.testing.assert_allclose(step_s, 2 / 20, rtol=0.02)
    went_into_means = book.query("reason_code == 'averaged-rows' and file == 'a_force.csv'")["rows"]
    assert went_into_means.sum() == 380 - counts["a"]
    fit, whole_fit = fits.loc["a"], whole_fits.loc["a"]
    half = whole_fit["alpha_z_hi_N_per_cm3"] - whole_fit["alpha_z_N_per_cm3"]
    assert abs(fit["alpha_z_N_per_cm3"] - whole_fit["alpha_z_N_per_cm3"]) < half / 5


@pytest.mark.usefixtures("averaged")
def test_readings_that_stand_alone_are_in_no_mean(campaign):
    _, sound_fits, _, _ = measure(campaign)
    alone = [201, 202, 300]

    def disturb(lines):
        for row in alone:
            lines[row] = f"{lines[row].rpartition(',')[0]},6000.0"
        return lines

    edit_force_log(campaign, disturb)
    _, fits, _, book = measure(campaign)
    # two that lie at the edge of two parts are seen as their mean
    assert book.query("reason_code == 'lone-readings'")["rows"].sum() == len(alone) - 1
    assert fits.loc["a", "alpha_z_N_per_cm3"] == pytest.approx(
        sound_fits.loc["a", "alpha_z_N_per_cm3"], rel=2e-3
    )


@pytest.mark.usefixtures("averaged")
def test_a_mean_shows_that_a_reading_was_saturated(campaign):
    # the last readings of the push reach the end of the range of F3
    edit_force_log(
        campaign,
        lambda lines: [
            f"{line.rpartition(',')[0]},{FULL_GF}" if 300 < row <= 341 else line
            for row, line in enumerate(lines)
        ],
    )
    _, fits, _, book = measure(campaign)
    assert book.query("reason_code == 'saturated'")["rows"].sum() >= 10
    assert "window-saturated" in fits.loc["a", "reason_code"]


@pytest.mark.usefixtures("averaged")
def test_a_time_that_stands_is_refused_with_all_rows(campaign):
    edit_force_log(
        campaign, lambda lines: [*lines[:250], *(f"7.0,{row},1.0" for row in range(250, 381))]
    )
    _, _, runs, book = measure(campaign)
    assert runs.loc["a", "reason_code"] == "time"
    assert book.query("file == 'a_force.csv'")["rows"].sum() == 380


def test_the_need_of_memory_grows_with_rows_and_is_bounded(tmp_path):
    for name, megabytes in (("small", 1), ("large", 40), ("huge", 4000)):
        with (tmp_path / name).open("wb") as file:
            file.truncate(megabytes * 10**6)
    needs = {name: memory_need(tmp_path, [name]) for name in ("small", "large", "huge")}
    assert not needs["small"].long_logs
    assert needs["large"].long_logs == {"large": 40 * 10**6}
    assert needs["small"].megabytes < needs["large"].megabytes == needs["huge"].megabytes
    together = memory_need(tmp_path, ["large", "huge", "none"])
    assert together.megabytes > needs["huge"].megabytes
