"""Both laws predict forces and sinkage of 96 wheel runs with the errors stated here.

The runs are those of `examples/wheels`; the laws are the measured law and 3D-RFT.
"""

import numpy as np
import pandas as pd
import pytest
import side_slip
from numpy.testing import assert_allclose

RUNS = pd.read_csv(side_slip.RUNS)
EXPECTED = {  # rms error of x, y, z, N: all runs, those with abs(slip) <= 0.51; of sinkage, mm
    "measured law": ((6.09, 4.21, 8.58), (6.06, 2.67, 6.73), 10.2),
    "measured law, friction 0.6": ((5.03, 5.96, 6.32), (3.92, 3.65, 5.08), 9.5),
    "3D-RFT, friction 0.4": ((4.26, 5.32, 10.15), (3.87, 3.77, 6.58), 12.5),
}


@pytest.mark.parametrize("case", EXPECTED)
def test_errors_of_forces_and_sinkage(case, monkeypatch):
    monkeypatch.setattr(side_slip, "DEPTHS_CM", np.arange(0.5, 12.1, 0.5))
    predicted, depth = side_slip.predicted(RUNS, case)
    off, is_low_slip = predicted - RUNS[side_slip.FORCES].to_numpy(), abs(RUNS.slip) <= 0.51
    every, modest, sinkage = EXPECTED[case]
    assert_allclose(side_slip.rms(off), every, atol=0.1)
    assert_allclose(side_slip.rms(off[is_low_slip]), modest, atol=0.1)
    assert side_slip.rms(10 * depth - RUNS.sinkage_mm) == pytest.approx(sinkage, abs=0.3)
    if case == "measured law":
        assert_allclose(np.median(predicted[:, 2] / RUNS.force_z_N), 0.995, atol=0.01)
        for (angle, rim), forces in (
            ((0, 5), (-12.586, 0, 21.509)),
            ((30, 10), (-2.765, 7.890, 19.064)),
        ):
            chosen = (
                (RUNS.slip_angle_deg == angle)
                & (RUNS.rim_speed_mm_per_s == rim)
                & (RUNS.trial == 1)
            )
            assert_allclose(predicted[chosen][0], forces, atol=1e-3)
