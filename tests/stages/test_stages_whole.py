"""A whole medium and a sand of the re-enacted lab: what went in comes out."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from paper_grid import grid

from rftfit import reference
from rftfit.measure.alpha import column

MEDIUM = "glass3mm_CP"
RHO = 0.7
"""Correlation of the lab's noise from sample to sample."""


def errors(results):
    found = [grid(results.alpha, column(component)) for component in "zx"]
    off: np.ndarray = np.stack(found) - np.stack(reference.alpha_grid(MEDIUM))
    return off


def test_alpha_is_table_s5(results):
    wrong = np.abs(errors(results))
    assert np.mean(wrong <= 0.005) >= 0.95
    assert wrong.max() <= 0.01
    assert (results.alpha["reason"] == "").all()
    assert (results.fits["reason"] == "").all()
    assert (results.alpha["n_runs"] == np.where(results.alpha["gamma_deg"] == 0, 3, 1)).all()


def test_intervals_contain_table_s5(results):
    inside = []
    for component, alpha in zip("zx", reference.alpha_grid(MEDIUM), strict=True):
        lo, hi = (grid(results.alpha, column(component, q)) for q in ("_lo", "_hi"))
        # horizontal cells carry the lab's stick-slip on top; beta = -90 repeats beta = 90
        slanted = np.delete(np.arange(13), 6)
        inside.append(((lo <= alpha) & (alpha <= hi))[1:][:, slanted])
        assert (hi - lo)[1:].max() < 0.02
    assert np.mean(inside) >= 0.9


def test_signs_are_not_a_matter_of_size(results):
    """Every alpha that is large enough to have a sign has the published one."""
    for component, alpha in zip("zx", reference.alpha_grid(MEDIUM), strict=True):
        found, large = grid(results.alpha, column(component)), np.abs(alpha) > 0.01
        assert large.sum() > 40
        assert (np.sign(found) == np.sign(alpha))[large].all()


def test_windows_and_points(results):
    fits = results.fits
    assert (fits["n_points"] >= 30).all()
    assert (fits["depth_from_cm"] <= fits["depth_to_cm"]).all()
    level = fits["direction"] == "horizontal"
    assert (fits["depth_to_cm"] - fits["depth_from_cm"])[level].max() < 0.02
    # no plate is fitted nearer than 6 cm to the bottom of 15 cm
    half_z = 1.905 * np.abs(np.sin(np.radians(fits["beta_deg"]))) + 0.32 * np.abs(
        np.cos(np.radians(fits["beta_deg"]))
    )
    assert (fits["depth_to_cm"] + half_z)[~level].max() <= 9.001
    assert (fits["depth_from_cm"] - half_z)[~level].min() >= -0.001


def test_quality_figures_where_they_mean_something(results):
    fits = results.fits
    level = fits["direction"] == "horizontal"
    names = [f"{name}_{c}{unit}" for c in "zx" for name, unit in (
        ("free_slope", "_N_per_cm3"), ("intercept", "_N_per_cm2"),
        ("nonlinear", "_p"), ("nonlinear", "_ratio"))]  # fmt: skip
    assert fits.loc[level, names].isna().to_numpy().all()
    assert fits.loc[~level, names].notna().to_numpy().all()
    ratio = fits["alpha_z_se_N_per_cm3"] / fits["alpha_z_ols_se_N_per_cm3"]
    assert ratio.median() > 1.5


def test_ledger_counts_every_line_of_every_file(lab):
    for medium, results in lab.results.items():
        results.check_ledger(lab.counted(medium))
        used = results.book[results.book["fate"] == "used"]
        assert {"zero", "path", "tare"} <= set(used["reason_code"])
        assert set(used["file"]) == set(lab.counted(medium))


def test_raw_files_are_untouched(lab):
    assert lab.before == lab.after
    assert (
        len(lab.before) == 2 * len(lab.campaign.runs) + 2
    )  # the sheet, and the mark of a re-enactment


def test_clocks(results):
    runs = results.runs
    assert (runs["status"] == "read").all()
    assert runs["clock_residual_s"].max() < 0.02
    late = runs["note"].str.contains("clocks differ by -1 h")
    assert not runs["flags"].str.contains("clocks").any()
    # the legs in air were logged before the clocks were changed
    own = ~runs["run_id"].str.startswith("air_")
    assert late[own].all()
    assert not late[~own].any()


def bin_deviation(samples):
    """Standard deviation of the mean of so many samples of the lab's noise, run minus tare, N."""
    lags = np.arange(1, 40)
    result = []
    for n in samples:
        inner = lags[lags < n]
        total = n + 2 * np.sum((n - inner) * RHO**inner)
        result.append(0.05 * np.sqrt(2 * total) / n)
    return np.array(result)


@pytest.mark.parametrize("leg", reference.LEGS)
def test_leg_curves_are_fig_s5(results, leg):
    published = reference.load("fig_s5")
    published = published[(published["medium"] == MEDIUM) & (published["leg"] == leg)]
    found = results.curves[results.curves["leg"] == leg]
    both = found.merge(published, on="theta_deg", suffixes=("", "_published"))
    assert len(both) >= 240
    assert both["samples"].between(7, 10).mean() > 0.95
    noise = bin_deviation(both["samples"].to_numpy())
    for component in "zx":
        zero = both[f"zero_se_{component}_N"].to_numpy()
        assert (zero == zero[0]).all()
        assert 0 < zero[0] < 0.05
        off = both[f"force_{component}_N"] - both[f"force_{component}_N_published"]
        # a bin of one degree averages the corners of the published curve; the ends fade
        inner = both["theta_deg"].between(-128, 128).to_numpy()
        bend = np.abs(np.gradient(np.gradient(both[f"force_{component}_N_published"].to_numpy())))
        allowed = 4 * np.hypot(noise, zero) + bend / 4
        assert (np.abs(off.to_numpy()) <= allowed)[inner].all()
        # and it is noise, neither a bias nor a wrong scale
        pull = off.to_numpy()[inner] / np.hypot(noise, zero)[inner]
        assert 0.7 < np.sqrt(np.mean(pull**2)) < 1.3
        assert abs(off[inner].mean()) < 3.5 * zero[0] + 0.01


def test_slope_of_a_sand(lab):
    yuma = lab.results["yuma"]
    found = yuma.cell(0, 90)
    # independent of the program: zero-intercept fit of the published curve itself
    curve = reference.load("fig_s11")
    curve = curve[(curve["medium"] == "yuma") & (curve["depth_cm"] <= 2)]
    depth, stress = curve["depth_cm"].to_numpy(), curve["stress_z_N_per_cm2"].to_numpy()
    expected = float(stress @ depth / (depth @ depth))
    assert found[column("z")] == pytest.approx(expected, abs=0.01)
    assert found[column("z")] == pytest.approx(0.69, abs=0.012)
    assert abs(found[column("x")]) < 0.01
    assert yuma.fits.iloc[0]["depth_to_cm"] == pytest.approx(2, abs=0.02)
    others = yuma.alpha.drop(index=found.name)
    assert (others["reason_code"] == "no-run").all()
    assert set(yuma.curves["leg"]) == set(reference.LEGS)


def test_phases_and_traces(results):
    traces = results.traces
    assert list(traces.columns) == [
        "run_id", "time_s", "phase", "x_cm", "depth_cm", "angle_deg", "force_z_N", "force_x_N", "why",
    ]  # fmt: skip
    assert np.isfinite(traces.drop(columns=["run_id", "phase"]).to_numpy(float)).all()
    seconds = traces.groupby("phase", observed=True).size() / 100 / traces["run_id"].nunique()
    assert seconds["air"] == pytest.approx(1.9, abs=0.2)
    assert seconds["pause"] == pytest.approx(1.2, abs=0.5)
    air = traces[traces["phase"] == "air"].groupby("run_id", observed=True)
    assert air[["force_z_N", "force_x_N"]].mean().abs().max().max() < 0.01


def test_tables_hold_no_machine_and_no_time(results):
    text = pd.concat([results.runs, results.fits]).to_csv()
    assert "/tmp" not in text
    assert "\\" not in text
