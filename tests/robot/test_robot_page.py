"""The robot's part of the report page shows the numbers of its tables and pictures of its run."""

import json
import math

import numpy as np
import pytest
from result_tables import bare_campaign, write, write_robot

from rftfit import Results
from rftfit.page.robot import robot_tables


def test_shares_are_counted_with_and_without_the_calibration(tmp_path):
    """Simulated speeds are 1.1 and 2 times the measured ones; 3 of 42 conditions were calibrated on."""
    results = bare_campaign(tmp_path, ("poppy_LP",), robot=True)
    write_robot(results)
    errors = results.table("robot/errors.csv")
    # the interval of every condition but the first holds its measured speed
    measured = errors["measured_cm_per_s"]
    is_first = errors["condition"] == errors["condition"].iloc[0]
    assert set(errors.loc[is_first, "calibrated"]) == {"no"}
    errors["simulated_model_lo_cm_per_s"] = measured - 1 + 2 * is_first
    errors["simulated_model_hi_cm_per_s"] = measured + 3
    write(results, "robot/errors.csv", errors)
    tables = robot_tables(Results(results.campaign))
    assert tables is not None
    near, far = (
        ["|".join(filter(None, (cell.text, *map(str, cell.notes)))) for cell in cells]
        for cells in (
            [column.cell(row) for column in tables["shares"].columns]
            for row in tables["shares"].rows
        )
    )
    whole = "42 of 42|predicted: 39 of 39"
    assert near[1:] == [whole, whole, "no value", "41 of 42|predicted: 38 of 39"]
    assert far[1] == "0 of 42|predicted: 0 of 39"


def test_pictures_are_those_of_the_run(small_root):
    frames = json.loads((small_root / "results" / "robot" / "frames.json").read_text("utf-8"))
    assert len(frames["runs"]) == 4 * 3
    weight = 150 * 980.665 / 1e5
    for run in frames["runs"]:
        assert len(run["pose"]) == len(run["arrows"]) == 36
        lift = np.mean([sum(arrows[3::4]) for arrows in run["arrows"]]) / 1000
        assert lift == pytest.approx(weight, rel=0.25)  # of few samples
        x = run["pose"][-1][0] * 36 / 35
        assert x * run["frequency_Hz"] == pytest.approx(run["speed_cm_per_s"], rel=0.1)
        # what is loaded lies below the surface
        assert max(z for arrows in run["arrows"] for z in arrows[1::4]) <= 0.01
    # a c-leg is half a circle, here of 8 pieces
    pieces = np.diff(frames["legs"]["1"], axis=0)
    assert np.hypot(*pieces.T).sum() == pytest.approx(math.pi / 2 * 4.1, rel=0.012)
    # a flat leg hangs straight down from its hip
    flat = np.array(frames["legs"]["0"])
    np.testing.assert_allclose(flat[:, 0], 0, atol=1e-9)
    np.testing.assert_allclose(flat[:, 1], np.linspace(0, -4.1, len(flat)), atol=0.001)
