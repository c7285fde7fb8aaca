"""The force in the simulated logs is the published one, with the signs of the lab frame."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit import reference
from rftfit.lab.plan import plan_runs, plate_of, segments, submerged_depths
from rftfit.lab.rig import LabStroke, ideal, nuisance, record
from rftfit.lab.truth import BUILD_UP, pull_alpha, sand_law, sand_stress, submerged_depth, table_s5


@pytest.fixture(scope="module")
def runs(config):
    return {run.run_id: run for run in plan_runs(config)}


def _in_stroke(run, config, true):
    phases = [segment.phase for segment in segments(run, config)]
    return np.asarray(true.motion.segment == phases.index("stroke"))


@pytest.mark.parametrize("beta_deg", [-60, -30, 0, 30, 60, 90])
@pytest.mark.parametrize("gamma_deg", [18.43495, 45, 71.56505, 90])
def test_pull_is_the_mirror_image_of_its_cell(beta_deg, gamma_deg):
    # the pull: plate held at beta, moved back up along the path
    beta, gamma = np.radians([beta_deg, gamma_deg])
    tangent = np.array([np.cos(beta), -np.sin(beta)])
    velocity = -np.array([-np.cos(gamma), -np.sin(gamma)])
    flip = np.array([-1.0, 1.0])
    seen_tangent, seen_velocity = flip * tangent, flip * velocity
    # the cell of the table whose tangent (a line, no arrow) and velocity are those seen
    cells = []
    for cell_beta in reference.BETA_DEG:
        for cell_gamma in reference.GAMMA_DEG:
            b, g = np.radians([cell_beta, cell_gamma])
            cross = seen_tangent @ np.array([np.sin(b), np.cos(b)])
            difference = seen_velocity - np.array([-np.cos(g), -np.sin(g)])
            if abs(cross) < 1e-9 and np.abs(difference).max() < 1e-6:
                cells.append((cell_beta, cell_gamma))
    assert cells
    for cell in cells:
        seen_z, seen_x = table_s5("glass3mm_CP", *cell)
        physical_x, physical_z = flip * np.array([seen_x, seen_z])
        assert pull_alpha("glass3mm_CP", beta_deg, gamma_deg) == (physical_z, physical_x)


def test_forces_oppose_the_motion_where_they_must(config, runs):
    push_down = ideal(runs["poppy_CP_bp00_g90_in"], config)
    assert push_down.granular[0].max() > 40
    assert push_down.granular[0].min() == 0
    toward_minus_x = ideal(runs["poppy_CP_bp90_g00_h762"], config)
    assert toward_minus_x.granular[1].max() > 5
    toward_plus_x = ideal(runs["poppy_CP_bp90_g18_ex"], config)
    assert toward_plus_x.granular[1].min() < -0.5


@pytest.mark.parametrize("medium", ["poppy_LP", "glass0.3mm_CP"])
def test_force_in_the_window_is_exactly_the_published_one(config, runs, medium):
    area = plate_of(config.intruders)[1].area_cm2
    checked = 0
    for run in runs.values():
        if run.kind != "plate" or run.medium != medium or run.direction == "horizontal":
            continue
        assert run.beta_deg is not None
        assert run.gamma_deg is not None
        true = ideal(run, config)
        depth = -true.motion.z_cm
        shallow, deep = submerged_depths(run, config)
        in_window = _in_stroke(run, config, true) & (depth > shallow) & (depth < deep)
        in_window &= true.motion.travel > BUILD_UP
        if run.direction == "extraction":
            alpha_z, alpha_x = table_s5(medium, -run.beta_deg, -run.gamma_deg)
            alpha_x = -alpha_x
        else:
            alpha_z, alpha_x = table_s5(medium, run.beta_deg, run.gamma_deg)
        assert in_window.sum() > 100
        np.testing.assert_allclose(
            true.granular[0][in_window], alpha_z * depth[in_window] * area, rtol=1e-12
        )
        np.testing.assert_allclose(
            true.granular[1][in_window], alpha_x * depth[in_window] * area, rtol=1e-12
        )
        checked += 1
    assert checked == 72


def test_a_plate_that_touches_the_sand_feels_a_share_of_its_stress(config, runs):
    """Of 3.81 cm x 2.54 cm and 0.64 cm thick: 0.16 cm above the sand is half in it, 0.32 cm is out of it."""
    run = runs["palms29_bp00_g90_in"]
    stroke = next(segment for segment in segments(run, config) if segment.phase == "stroke")
    z_cm = np.array([0.4, 0.32, 0.16, 0.0, -1.0])
    force_z, force_x = sand_law(run, config)(stroke, np.zeros(5), z_cm, np.zeros(5))
    at_surface, one_deep = sand_stress("palms29", np.array([0.0, 1.0]))
    expected = 3.81 * 2.54 * np.array([0, 0, at_surface / 2, at_surface, one_deep])
    np.testing.assert_allclose(force_z, expected, atol=1e-12)
    assert at_surface > 0
    assert not force_x.any()


def test_level_runs_reach_their_steady_state(config, runs):
    area = plate_of(config.intruders)[1].area_cm2
    for run in runs.values():
        if run.kind != "plate" or run.medium != "poppy_CP" or run.direction != "horizontal":
            continue
        true = ideal(run, config)
        assert run.beta_deg is not None
        assert run.depth_cm is not None
        is_steady = _in_stroke(run, config, true) & (true.motion.travel > 2)
        expected_N = np.array(table_s5("poppy_CP", run.beta_deg, 0.0)) * run.depth_cm * area
        for force, value in zip(true.granular, expected_N, strict=True):
            assert force[is_steady].mean() == pytest.approx(value, rel=0.003)
            assert np.abs(force[is_steady] / value - 1).max() < 0.007 + 0.016
            start = _in_stroke(run, config, true) & (true.motion.travel < 0.3)
            assert np.abs(force[start] / value - 1).max() > 0.2


def test_written_numbers_give_the_force_back(config, runs):
    turn = np.radians(config.transducer.turn_deg)
    for name in ("poppy_CP_bm30_g45_in", "glass3mm_CP_bp60_g56_ex", "yuma_c_leg"):
        run = runs[name]
        odd, log = nuisance(run, 5), record(LabStroke(run, config, 5))
        true = ideal(run, config, phase_s=odd.force_phase_s)
        f1, f2, f3 = (log.channels_N - odd.bias_N).T
        s_x, s_y, s_z = -f2, f1, -f3  # the axes of the config, read off by hand
        minutes = (log.force_time_s - odd.start_s) / 60
        drift = odd.drift_N_per_min * minutes[:, None]
        force_x = s_x * np.cos(turn) + s_z * np.sin(turn) - drift[:, 0]
        force_z = -s_x * np.sin(turn) + s_z * np.cos(turn) - drift[:, 2]
        for force, number in ((force_z, 0), (force_x, 1)):
            noise_N = force - true.rod[number] - true.steady[number] - true.granular[number]
            assert abs(noise_N.mean()) < 0.02
            assert noise_N.std() == pytest.approx(0.05, rel=0.2)
            assert np.corrcoef(noise_N[1:], noise_N[:-1])[0, 1] == pytest.approx(0.7, abs=0.1)
        assert s_y.std() == pytest.approx(0.05, rel=0.2)


def test_motion_log_and_its_clock(config, runs):
    for name, late in (("poppy_LP_bp00_g45_in", 0.0), ("glass3mm_CP_bp00_g45_in", 3600.0)):
        run = runs[name]
        log, true = record(LabStroke(run, config, 2013)), ideal(run, config)
        odd = nuisance(run, 2013)
        assert abs(odd.motion_offset_s + late) <= 0.4
        elapsed = log.motion_time_s - odd.start_s - odd.motion_offset_s
        z_mm = np.interp(elapsed, true.motion.elapsed_s, 150 + 10 * true.motion.z_cm)
        x_mm = np.interp(elapsed, true.motion.elapsed_s, 10 * true.motion.x_cm)
        assert np.abs(log.z_mm - z_mm).max() < 0.03
        assert np.abs(log.x_mm - x_mm).max() < 0.03
        assert np.diff(log.motion_time_s) == pytest.approx(0.02)
        moved = np.diff(true.motion.x_cm) ** 2 + np.diff(true.motion.z_cm) ** 2 > 1e-12
        assert np.mean(moved == log.arm_moving[:-1].astype(bool)) > 0.99


def test_rod(config, runs):
    for run in runs.values():
        if run.kind == "rod" and run.medium in ("poppy_CP", "glass0.3mm_LP", "palms29"):
            true, with_plate = ideal(run, config), ideal(runs[run.run_id[:-4]], config)
            np.testing.assert_array_equal(true.rod, with_plate.rod)
            assert not np.any(true.granular)
            peak = np.hypot(*true.rod).max()
            assert peak < 1.6
            if run.gamma_deg == 90:
                assert peak > 0.25


def test_partly_submerged_plate_meets_the_whole_one_smoothly():
    depth = np.linspace(-2, 3, 5001)
    load = submerged_depth(depth, 1.9)
    assert np.all(load[depth < -1.9] == 0)
    np.testing.assert_array_equal(load[depth >= 1.9], depth[depth >= 1.9])
    assert np.all(np.diff(load) >= 0)
    assert np.abs(np.diff(load, 2)).max() < 1e-5


def test_legs_and_sands(config, runs):
    for figure, name in (("fig_s5", "poppy_CP_c_leg"), ("fig_s12", "palms29_flat_leg")):
        run = runs[name]
        table = reference.load(figure)
        table = table[(table["medium"] == run.medium) & (table["leg"] == run.leg)]
        true = ideal(run, config)
        theta = true.motion.angle_deg
        order = np.flatnonzero(true.motion.segment == 1)[5:]
        for force, column in zip(true.granular, ("force_z_N", "force_x_N"), strict=True):
            force_N = np.interp(table["theta_deg"], theta[order], force[order])
            span = np.ptp(table[column])
            assert np.abs(force_N - table[column]).max() < 0.01 * span
            assert force[0] == force[-1] == 0
        air = ideal(runs[run.tare_run], config)
        np.testing.assert_array_equal(air.steady, true.steady)
        assert not np.any(air.granular)
    run = runs["yuma_bp00_g90_in"]
    true = ideal(run, config)
    in_stroke = _in_stroke(run, config, true) & (true.motion.travel > BUILD_UP)
    area = plate_of(config.intruders)[1].area_cm2
    np.testing.assert_allclose(
        true.granular[0][in_stroke], area * sand_stress("yuma", -true.motion.z_cm[in_stroke])
    )
    assert true.granular[0].max() > 90
