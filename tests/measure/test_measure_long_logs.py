"""Logs of more rows than are kept: read part by part, as means of neighbours; all others as they are."""

import numpy as np
import pytest
import yaml
from makers import GOLDEN, MadePushes, write_campaign
from measured import chain

from rftfit.campaign.load import load_campaign
from rftfit.measure.ledger import check_ledger
from rftfit.measure.long_logs import memory_need

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
    """What the stages make of the logs, whose rows add up."""
    results = chain(campaign, "sand")
    check_ledger(results.book, results.runs)
    return results


def edit_force_log(campaign, edit):
    path = campaign.raw / "a_force.csv"
    lines = path.read_text("utf-8").splitlines()
    path.write_text("\n".join(edit(lines)) + "\n", "utf-8")


def test_a_log_in_parts_is_that_of_one_piece(campaign, request):
    whole = measure(campaign)
    request.getfixturevalue("parted")
    parted = measure(campaign)
    assert parted.traces.equals(whole.traces)
    assert parted.fits.equals(whole.fits)


def test_means_give_the_same_alpha(campaign, request):
    whole = measure(campaign)
    assert len(whole.traces) > 3 * MOST_ROWS
    request.getfixturevalue("averaged")
    averaged = measure(campaign)
    counts = averaged.traces["run_id"].value_counts()
    assert counts.between(MOST_ROWS / 2, MOST_ROWS).all()
    np.testing.assert_allclose(averaged.runs["sample_step_s"], 2 / 20, rtol=0.02)
    assert averaged.fates("a_force.csv")["dropped", "averaged-rows"] == 380 - counts["a"]
    fit, whole_fit = averaged.fit("a"), whole.fit("a")
    half = whole_fit["alpha_z_hi_N_per_cm3"] - whole_fit["alpha_z_N_per_cm3"]
    assert abs(fit["alpha_z_N_per_cm3"] - whole_fit["alpha_z_N_per_cm3"]) < half / 5


@pytest.mark.usefixtures("averaged")
def test_readings_that_stand_alone_are_in_no_mean(campaign):
    sound = measure(campaign)
    alone = [201, 202, 300]

    def disturb(lines):
        for row in alone:
            lines[row] = f"{lines[row].rpartition(',')[0]},6000.0"
        return lines

    edit_force_log(campaign, disturb)
    disturbed = measure(campaign)
    # two that lie at the edge of two parts are seen as their mean
    assert disturbed.fates("a_force.csv")["dropped", "lone-readings"] == len(alone) - 1
    alpha, sound_alpha = (results.fit("a")["alpha_z_N_per_cm3"] for results in (disturbed, sound))
    assert alpha == pytest.approx(sound_alpha, rel=2e-3)


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
    results = measure(campaign)
    assert results.fates("a_force.csv")["dropped", "saturated"] >= 10
    assert "window-saturated" in results.fit("a")["reason_code"]


@pytest.mark.usefixtures("averaged")
def test_a_time_that_stands_is_refused_with_all_rows(campaign):
    edit_force_log(
        campaign, lambda lines: [*lines[:250], *(f"7.0,{row},1.0" for row in range(250, 381))]
    )
    results = measure(campaign)
    assert results.run("a")["reason_code"] == "time"
    assert sum(results.fates("a_force.csv").values()) == 380


def test_the_need_of_memory_grows_with_rows_and_is_bounded(tmp_path):
    for name, megabytes in (("small", 1), ("large", 40), ("huge", 4000)):
        with (tmp_path / name).open("wb") as file:
            file.truncate(megabytes * 10**6)
    small, large, huge = (memory_need(tmp_path, [name]) for name in ("small", "large", "huge"))
    assert (small.long_logs, large.long_logs) == ({}, {"large": 40 * 10**6})
    assert small.megabytes < large.megabytes == huge.megabytes
    assert memory_need(tmp_path, ["large", "huge", "none"]).megabytes > huge.megabytes
