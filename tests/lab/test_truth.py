"""The force in the simulated logs is the published one, with the signs of the lab frame."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit import reference
from rftfit.lab.plan import plate_of, segments, submerged_depths
from rftfit.lab.rig import ideal
from rftfit.lab.truth import BUILD_UP, pull_alpha, table_s5


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
