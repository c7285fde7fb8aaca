"""Each disturbance changes the simulated logs by as much as was asked and changes nothing else.

Disturbance: an error of a real lab, such as a wrong surface, a lag or slow noise.
"""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest
from paper import DISTURBANCES, along_path, bed_of, disturbed_logs, pink, sizes_of

from rftfit.errors import InputError
from rftfit.lab.enact import run_logs
from rftfit.lab.plan import plan_runs, plate_of
from rftfit.lab.rig import LabStroke, ideal, nuisance

PUSH, ROD, LEG, AIR = (
    "poppy_CP_bp00_g90_in",
    "poppy_CP_bp00_g90_in_rod",
    "poppy_CP_c_leg",
    "air_c_leg",
)
"""Runs of one direction: a push, its rod; and a leg in the medium and in air."""
SLANTED = "poppy_CP_bp30_g34_in"
SEED = 5
NONE: Mapping[str, float] = {}
"""No disturbance."""


@pytest.fixture(scope="module")
def runs(config):
    return {run.run_id: run for run in plan_runs(config)}


def read(content):
    assert content is not None
    return pd.read_csv(io.BytesIO(content), comment="#")


def force(run, config, sizes=NONE):
    """Force (z, x, y) of the written log in the lab frame, N, shape (3, n); axes and turn by hand."""
    log = read(disturbed_logs(run, config, SEED, sizes)[run.force_log])
    f1, f2, f3 = (log[f"F{k}_N"].to_numpy() for k in (1, 2, 3))
    turn = np.radians(4.0)
    x, z = -f2, -f3
    return np.array([-x * np.sin(turn) + z * np.cos(turn), x * np.cos(turn) + z * np.sin(turn), f1])


def bed(run, config, sizes, spread=0.0, seed=SEED, cycle=0):
    return bed_of(LabStroke(run, config, seed, cycle), sizes, spread)


def change(run, config, sizes):
    """By how much disturbances change the force (z, x) of a log: noise and bias are the same."""
    return np.asarray((force(run, config, sizes) - force(run, config))[:2])


def granular(run, config):
    """Undisturbed granular force (z, x) at the samples of the log."""
    phase = nuisance(run, SEED).force_phase_s
    return np.array(ideal(run, config, phase_s=phase).granular)


def depth(run, config):
    return -ideal(run, config, phase_s=nuisance(run, SEED).force_phase_s).motion.z_cm


CHANGED = {
    "surface": {PUSH, ROD, LEG},
    "surface-session": {PUSH, ROD, LEG},
    "lag": {PUSH, ROD, LEG, AIR},
    "spread-percent": {PUSH, LEG},
    "pink": {PUSH, ROD, LEG, AIR},
    "patches": {PUSH, LEG},
    "deep-noise": {PUSH, LEG},
    "power": {PUSH},
    "tare-bed": {ROD},
    "turn": {PUSH, ROD, LEG, AIR},
}


@pytest.mark.parametrize("name", DISTURBANCES)
def test_what_is_changed(config, runs, name):
    disturbance = DISTURBANCES[name]
    changed_runs = set()
    for run in (runs[run_id] for run_id in (PUSH, ROD, LEG, AIR)):
        plain = run_logs(run, config, SEED)
        disturbed = disturbed_logs(run, config, SEED, {name: disturbance.size})
        assert disturbed == disturbed_logs(run, config, SEED, {name: disturbance.size})
        assert disturbed_logs(run, config, SEED, {name: disturbance.nothing}) == plain
        assert disturbed[run.motion_log] == plain[run.motion_log]
        log_before, log_after = read(plain[run.force_log]), read(disturbed[run.force_log])
        for column in ("time_s", "arm_moving"):
            np.testing.assert_array_equal(log_after[column], log_before[column])
        if disturbed[run.force_log] != plain[run.force_log]:
            changed_runs.add(run.run_id)
    assert changed_runs == CHANGED[name]


@pytest.mark.parametrize("name", ["surface", "surface-session"])
def test_surface_moves_the_onset_of_the_force(config, runs, name):
    area = plate_of(config.intruders)[1].area_cm2
    drawn = []
    for medium in ("poppy_CP", "glass0.3mm_CP", "glass3mm_CP"):
        run = runs[f"{medium}_bp00_g90_in"]
        depth_cm, clean = depth(run, config), granular(run, config)
        alpha = clean[0][depth_cm > 5][0] / depth_cm[depth_cm > 5][0] / area
        inside = (depth_cm > 1) & (depth_cm < 7)
        moved = change(run, config, {name: 2.0})[0] / area / alpha
        raised_cm = float(np.median(moved[inside]))  # cm
        # rod and mount feel it too, a little
        assert moved[inside] == pytest.approx(raised_cm, abs=0.03)
        # the plate touches it higher by as much
        onsets = [
            np.argmax(log[0] - log[0][:150].mean() > 1.0)
            for log in (force(run, config), force(run, config, {name: 2.0}))
        ]
        assert depth_cm[onsets[0]] - depth_cm[onsets[1]] == pytest.approx(raised_cm, abs=0.035)
        assert bed(run, config, {name: 2.0}).surface_cm == pytest.approx(raised_cm, abs=0.02)
        assert bed(run, config, {name: 4.0}).surface_cm == pytest.approx(2 * raised_cm, abs=0.04)
        drawn.append(raised_cm)
    assert (np.ptp(drawn) < 0.02) == (name == "surface-session")
    # 933 runs, or 2000 campaigns
    beds = [bed(run, config, {name: 2.0}).surface_cm for run in runs.values()]
    seeds = [bed(runs[PUSH], config, {name: 2.0}, seed=seed).surface_cm for seed in range(2000)]
    assert np.std(seeds) == pytest.approx(0.2, rel=0.06)
    assert np.std(beds) == pytest.approx(0.2 if name == "surface" else 0, rel=0.08, abs=1e-12)


@pytest.mark.parametrize("lag", [0.03, 0.07])
def test_lag_is_so_many_samples(config, runs, lag):
    for name in (PUSH, SLANTED, LEG, AIR):
        run = runs[name]
        moved = change(run, config, {"lag": lag})[0, 20:]
        true = ideal(run, config, phase_s=nuisance(run, SEED).force_phase_s)
        undisturbed = true.granular[0] + true.rod[0] + true.steady[0]
        misfit = [
            np.std(moved - undisturbed[20 - k : undisturbed.size - k] + undisturbed[20:])
            for k in range(15)
        ]
        assert np.argmin(misfit) == round(100 * lag)
        assert min(misfit) < 0.004  # of rounding to 1/160 N, twice


@pytest.mark.parametrize(
    ("run_id", "at_rest"), [(PUSH, slice(150)), ("glass3mm_CP_bp60_g56_ex", slice(-150, None))]
)
def test_a_push_on_a_mount_that_is_turned_leans_toward_minus_x(config, runs, run_id, at_rest):
    run = runs[run_id]
    deep = np.abs(granular(run, config)[0]).argmax()
    before, after = (
        log[:2, deep] - log[:2, at_rest].mean(axis=1)
        for log in (force(run, config), force(run, config, {"turn": 3.0}))
    )
    angle = np.degrees(np.arctan2(*before[::-1]) - np.arctan2(*after[::-1]))
    assert angle == pytest.approx(3, abs=0.3)
    assert np.hypot(*after) == pytest.approx(np.hypot(*before), rel=0.01)


def stress_curve(runs, config, sizes):
    """Depth and force of a push less that of its rod, both from the logs."""
    plate, rod = (force(runs[name], config, sizes)[0] for name in (PUSH, ROD))
    depth_cm, rod_depth_cm = depth(runs[PUSH], config), depth(runs[ROD], config)
    in_window = (depth_cm > 1) & (depth_cm < 8)
    going_down = np.arange(rod_depth_cm.size) <= rod_depth_cm.argmax()
    tare = np.interp(depth_cm, rod_depth_cm[going_down], (rod - rod[:150].mean())[going_down])
    return depth_cm[in_window], (plate - plate[:150].mean() - tare)[in_window]


@pytest.mark.parametrize("power", [1.0, 0.8, 1.2, 1.3])
def test_power_is_found_by_a_fit(config, runs, power):
    depth_cm, load = stress_curve(runs, config, {"power": power})
    slope, _ = np.polyfit(np.log(depth_cm), np.log(load), 1)
    assert slope == pytest.approx(power, abs=0.012)
    # the same as in the table at 5 cm
    _, plain = stress_curve(runs, config, NONE)
    near_5_cm = np.abs(depth_cm - 5) < 0.05
    assert load[near_5_cm].mean() == pytest.approx(plain[near_5_cm].mean(), rel=0.003)


def test_pink_noise_falls_as_one_over_f():
    noise = pink(np.random.default_rng(1), 300, 4096)
    power = (np.abs(np.fft.rfft(noise, axis=1)) ** 2).mean(axis=0)[1:-1]
    number = np.arange(1, power.size + 1)
    assert np.polyfit(np.log(number), np.log(power), 1)[0] == pytest.approx(-1, abs=0.02)
    assert power[:4] * number[:4] == pytest.approx(power[-400:] @ number[-400:] / 400, rel=0.25)


@pytest.mark.parametrize("length", [2.0, 0.1])
def test_a_path_is_uneven_over_a_length(length):
    travel = np.linspace(0, 6 * length, 601)
    drawn = along_path(np.random.default_rng(2), 4000, travel, length)
    assert drawn.std(axis=0) == pytest.approx(1, abs=0.05)
    assert drawn.mean(axis=0) == pytest.approx(0, abs=0.06)
    correlation = [float(np.mean(drawn[:, 200] * drawn[:, 200 + k])) for k in (10, 100, 200, 300)]
    # the same patch, the next one (the mean of cosine times sine over a patch), the ones after it
    assert correlation == pytest.approx([0.98, 1 / np.pi, 0, 0], abs=0.05)
    # a way back meets the same patches
    ways = [along_path(np.random.default_rng(2), 3, way, length) for way in (travel, travel[::-1])]
    np.testing.assert_array_equal(ways[1], ways[0][:, ::-1])


def test_proportional_spread(config, runs):
    for run_id in (PUSH, SLANTED, LEG, "yuma_bp00_g90_in", "poppy_CP_bp90_g00_h762"):
        run = runs[run_id]
        moved, clean = change(run, config, {"spread-percent": 10.0}), granular(run, config)
        factor = bed(run, config, {"spread-percent": 10.0}).factor - 1
        # z and x by one factor
        np.testing.assert_allclose(moved, factor * clean, atol=0.02)
        double = bed(run, config, {"spread-percent": 20.0}).factor - 1
        assert double == pytest.approx(2 * factor)
    drawn = [bed(run, config, {"spread-percent": 5.0}).factor for run in runs.values()]
    assert np.std(drawn) == pytest.approx(0.05, rel=0.08)
    assert np.mean(drawn) == pytest.approx(1, abs=0.005)


def test_spread_between_beds(config, runs):
    """Of alpha, so that a push feels as much more for each depth and area; a leg feels it too."""
    drawn = [bed(run, config, NONE, 0.05).off for run in runs.values()]
    assert np.std(drawn, axis=0) == pytest.approx(0.05, rel=0.08)
    # F3 is 4 degrees off the vertical
    run = runs[PUSH]
    f3 = [
        read(disturbed_logs(run, config, SEED, NONE, spread)[run.force_log])["F3_N"].to_numpy()
        for spread in (0.0, 0.05)
    ]
    off_z, off_x = bed(run, config, NONE, 0.05).off
    off = off_z * np.cos(np.radians(4)) + off_x * np.sin(np.radians(4))
    depth_cm, area = depth(run, config), plate_of(config.intruders)[1].area_cm2
    deep = (depth_cm > 5) & (np.gradient(depth_cm) > 0.003)
    np.testing.assert_allclose((f3[0] - f3[1])[deep], (off * area * depth_cm)[deep], atol=0.02)
    legs = [disturbed_logs(runs[LEG], config, SEED, NONE, spread) for spread in (0.0, 0.05)]
    assert legs[0] != legs[1]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("surfce", r"found 'surfce'; allowed: surface, .* power, .*; did you mean 'surface'"),
        ("real-lab=2", r"turn \(or real-lab, which is all of them\)"),
        ("surface=", r"disturbance surface: found ''; allowed: a number from 0 to 20 mm"),
        ("surface=-1", "from 0 to 20 mm"),
        ("pink=nan", "from 0 to 10 N"),
        ("power=0", "from 0.3 to 3 .exponent"),
        ("lag=1,5", "from 0 to 2 s"),
    ],
)
def test_sizes_that_cannot_be(asked, words):
    with pytest.raises(InputError, match=words):
        sizes_of([asked])
