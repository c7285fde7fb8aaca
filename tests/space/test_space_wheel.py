"""Both laws predict forces and sinkage of 96 wheel runs with the errors stated here.

The runs are those of `examples/wheels`; the laws are the measured law and 3D-RFT. The map is the mean of the published ones,
as strong as a plate of 60 mm is in the same sand, or of the size that the paper's plate has.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from seeds import seeds

import rftfit

RUNS = pd.read_csv(Path(__file__).parents[2] / "examples" / "wheels" / "smooth.csv")
FORCES = ["force_x_N", "force_y_N", "force_z_N"]
RADIUS_CM = 6.25
DEPTHS_CM = np.arange(0.5, 12.1, 1.0)
PLATE, PAPERS_PLATE = 0.853, 1.26
"""alpha_z(0, 90 deg) of both plates in the sand, N/cm^3."""
EXPECTED = {  # rms error of x, y, z, N: all runs, those with abs(slip) <= 0.51; of sinkage, mm
    (PLATE, "measured", None): ((6.08, 4.21, 8.53), (6.03, 2.67, 6.67), 10.1),
    (PLATE, "measured", 0.6): ((5.16, 5.96, 6.32), (3.89, 3.65, 5.07), 9.6),
    (PLATE, "3d-rft", 0.4): ((4.43, 5.32, 10.15), (3.87, 3.77, 6.58), 12.6),
    (PAPERS_PLATE, "measured", None): ((9.11, 11.17, 16.56), (8.39, 12.37, 14.32), 14.3),
}


def mean_map():
    """Mean of the published maps, each over its own alpha_z(0, 90 deg): (2, 7, 13)."""
    tables = rftfit.published_shapes().profiles.values()
    maps = [np.stack(table.cells[2:]) / table.alpha(0, np.pi / 2)[0] for table in tables]
    return np.mean(maps, axis=0).reshape(2, 7, 13)


def predict(mesh, sinkage_cm, alpha, law, friction):
    """Forces on the wheel of all runs, driven as it was, so deep: (runs, 3), N."""
    angle, speed = np.radians(RUNS.slip_angle_deg), RUNS.travel_mm_per_s / 10
    nothing = 0 * RUNS.slip
    motion = rftfit.Motion3D(
        np.column_stack([nothing, nothing, RADIUS_CM - sinkage_cm]),
        np.column_stack([speed * np.cos(angle), -speed * np.sin(angle), nothing]),
        np.column_stack([nothing, RUNS.measured_rim_mm_per_s / 10 / RADIUS_CM, nothing]),
    )
    sand = rftfit.TableProfile(*(alpha * mean_map()))
    forces = rftfit.predict(sand, mesh, motion, law=law, friction=friction, model_error=0)
    return forces[FORCES].to_numpy()


def sinkage_of(*case):
    """Depth at which the measured load of each run is carried first, cm."""
    mesh = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=6, facets=48)
    lift = np.array([predict(mesh, 0 * RUNS.slip + depth, *case)[:, 2] for depth in DEPTHS_CM])
    depths_cm = []
    for of_run, load in zip(lift.T, RUNS.force_z_N, strict=True):
        first = int((of_run >= load).argmax())
        around = slice(max(first - 1, 0), first + 1)
        is_carried = of_run.max() >= load
        depth = np.interp(load, of_run[around], DEPTHS_CM[around]) if is_carried else np.nan
        depths_cm.append(depth)
    return np.array(depths_cm)


def rms(errors):
    return np.sqrt(np.nanmean(errors**2, axis=0))


@pytest.mark.statistics
@pytest.mark.parametrize("case", seeds([*EXPECTED], [*EXPECTED][:2]))
def test_errors_of_forces_and_sinkage(case):
    mesh = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=6)
    predicted = predict(mesh, RUNS.sinkage_mm / 10, *case)
    off, is_low_slip = predicted - RUNS[FORCES].to_numpy(), abs(RUNS.slip) <= 0.51
    every, modest, sinkage = EXPECTED[case]
    assert_allclose(rms(off), every, atol=0.1)
    assert_allclose(rms(off[is_low_slip]), modest, atol=0.1)
    assert rms(10 * sinkage_of(*case) - RUNS.sinkage_mm) == pytest.approx(sinkage, abs=0.3)
    if case == (PLATE, "measured", None):
        assert_allclose(np.median(predicted[:, 2] / RUNS.force_z_N), 0.995, atol=0.01)
        for (angle, rim), forces in (
            ((0, 5), (-13.475, 0, 21.888)),
            ((30, 10), (-2.765, 7.890, 19.064)),
        ):
            chosen = (
                (RUNS.slip_angle_deg == angle)
                & (RUNS.rim_speed_mm_per_s == rim)
                & (RUNS.trial == 1)
            )
            assert_allclose(predicted[chosen][0], forces, atol=1e-3)
