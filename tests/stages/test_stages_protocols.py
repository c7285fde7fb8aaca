"""Measuring protocols and grids other than the paper's give the true alpha or a reason."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from log_files import told
from measured import chain
from mistakes import MEDIUM, Case, make

import rftfit
from rftfit.lab.truth import table_s5


def measured(folder):
    """Alpha, fits, runs and codes of the flags of the only medium of a campaign, by run."""
    results = chain(rftfit.open(folder).campaign, MEDIUM)
    codes = {run_id: codes for run_id in results.runs["run_id"] if (codes := results.codes(run_id))}
    return results.alpha, results.fits, results.runs, codes


def edit(folder, old, new):
    """Replace words of the config."""
    config = folder / "config" / "config.yaml"
    text = config.read_text(encoding="utf-8")
    assert old in text
    config.write_text(text.replace(old, new), encoding="utf-8")


def off_by_half_widths(table):
    deviations = []
    for row in table.to_dict("records"):
        truth = table_s5(MEDIUM, row["beta_deg"], row["gamma_deg"])
        for c, true in zip("zx", truth, strict=True):
            name = f"alpha_{c}{{}}_N_per_cm3"
            half = (row[name.format("_hi")] - row[name.format("_lo")]) / 2
            deviations.append((row[name.format("")] - true) / half)
    return np.array(deviations)


@pytest.mark.parametrize("protocol", ["no-pause", "stroke-only", "separate-zero", "one-file"])
def test_a_protocol_measures_what_is_there(tmp_path, protocol):
    make(tmp_path, Case("other", protocol))
    alpha, fits, _, flags = measured(tmp_path)
    assert len(alpha) == 36
    assert (fits["reason"] == "").all()
    assert flags == {}
    assert np.mean(np.abs(off_by_half_widths(alpha)) <= 1) >= 0.9


def test_without_a_tare_alpha_is_off_and_says_so(tmp_path):
    make(tmp_path, Case("one-row", "paper", tare=False))
    alpha, fits, _, flags = measured(tmp_path)
    assert {name for name, codes in flags.items() if "no-tare" in codes} == set(fits["run_id"])
    assert np.mean(np.abs(off_by_half_widths(alpha)) <= 1) < 0.5


def test_without_a_rod_there_is_nothing_to_flag(tmp_path):
    make(tmp_path, Case("one-push", "stroke-only", tare=False))
    flagged = measured(tmp_path)[0]
    edit(tmp_path, "missing_tare: flag", "missing_tare: none")
    alpha, *_, flags = measured(tmp_path)
    assert flags == {}
    assert alpha["alpha_z_N_per_cm3"][0] == flagged["alpha_z_N_per_cm3"][0]


def test_the_error_of_a_stated_zero_widens_every_interval(tmp_path):
    make(tmp_path, Case("one-row", "stroke-only"))
    narrow = measured(tmp_path)[0]
    edit(tmp_path, "sd_N: 0.02", "sd_N: 0.2")
    wide = measured(tmp_path)[0]
    name = "alpha_z_se_N_per_cm3"
    assert (wide[name] > 3 * narrow[name]).all()
    edit(tmp_path, "  sd_N: 0.2\n", "")
    problems = rftfit.check(tmp_path)
    assert told(problems) == ["config.inconsistent zero"]
    assert "sd_N" in problems[0].allowed


@pytest.mark.parametrize("protocol", ["paper", "stroke-only", "separate-zero"])
def test_slow_noise_is_an_error_of_every_zero(tmp_path, protocol):
    make(tmp_path, Case("one-row", protocol))
    quiet, quiet_fits, before, _ = measured(tmp_path)
    edit(tmp_path, "transducer:\n", "transducer:\n  slow_noise_N: 0.3\n")
    slow, fits, after, _ = measured(tmp_path)
    for c in "zx":
        grown = after[f"zero_var_{c}_N2"] - before[f"zero_var_{c}_N2"]
        np.testing.assert_allclose(grown, 0.3**2, rtol=1e-9)
        name = f"alpha_{c}{{}}_N_per_cm3"
        assert (slow[name.format("_se")] > 1.5 * quiet[name.format("_se")]).all()
        # the tare has a zero of its own
        assert (fits[name.format("_tare")] > 1.5 * quiet_fits[name.format("_tare")]).all()
        np.testing.assert_array_equal(slow[name.format("")], quiet[name.format("")])


def test_a_log_without_rest_and_without_a_zero_says_what_to_do(tmp_path):
    make(tmp_path, Case("one-push", "stroke-only"))
    edit(tmp_path, "method: stated", "method: air")
    _, fits, *_ = measured(tmp_path)
    assert fits["reason_code"][0] == "no-zero"


def test_strokes_of_one_log(tmp_path):
    """Cyclic penetration: three pushes in one log, a row of the sheet each."""
    make(tmp_path, Case("one-push", "one-file"))
    sheet = tmp_path / "raw" / "paper" / "runs.csv"
    rows = pd.read_csv(sheet, dtype=str, keep_default_na=False)
    for name in rows["force_log"]:
        log = pd.read_csv(sheet.parent / name, comment="#")
        period = np.ptp(log["time_s"]) + 20
        cycles = (log.assign(time_s=log["time_s"] + k * period) for k in range(3))
        pd.concat(cycles).to_csv(sheet.parent / name, index=False, float_format="%.6f")
    plate = rows[rows["kind"] == "plate"].assign(tare_shared="yes")
    pushes = (plate.assign(run_id=f"push{k}", stroke=str(k)) for k in (1, 2, 3))
    rod = rows[rows["kind"] == "rod"].assign(stroke="1")
    pd.concat([*pushes, rod]).to_csv(sheet, index=False)
    alpha, fits, *_ = measured(tmp_path)
    assert list(fits["run_id"]) == ["push1", "push2", "push3"]
    np.testing.assert_allclose(fits["alpha_z_N_per_cm3"], fits["alpha_z_N_per_cm3"][0], rtol=2e-3)
    assert alpha["n_runs"].tolist() == [3]
    truth = table_s5(MEDIUM, 0, 90)[0]
    assert alpha["alpha_z_N_per_cm3"][0] == pytest.approx(truth, abs=0.002)
    text = sheet.read_text(encoding="utf-8").replace(",3\n", ",4\n")
    sheet.write_text(text, encoding="utf-8")
    _, fits, *_ = measured(tmp_path)
    assert fits["reason_code"][2] == "no-such-stroke"
