"""The robot file holds the best calibration, and each change of a study alters what it names.

Studies vary what the paper does not say about the robot.
"""

import math
from dataclasses import replace

import calibrate
import numpy as np
import pytest
from calibrate import GRID, Layout, fit, laid_out, layout_of, measured
from sensitivity import CHANGES_CM, PERTURBATIONS, changed, sensitivity

from rftfit import reference
from rftfit.robot.run import Condition
from rftfit.robot.sweep import CALIBRATED_ON

SPEEDS = measured(reference.load("fig_4c"))


def test_targets_and_layouts(robot):
    assert SPEEDS == (26.69, 21.92, 16.04)
    assert [round(frequency) for _, frequency in CALIBRATED_ON.values()] == [2, 2, 2]
    table = reference.load("fig_4c")
    with pytest.raises(KeyError):
        measured(table[table["curvature_times_Rprime"] != 0])
    with pytest.raises(ValueError, match="x = 7, "):
        laid_out(robot, Layout(7.0, 0.25, -1.0))


def test_calibrated_values_stand_in_the_file(robot, table):
    # nowhere on the grid is there a better neighbour; the whole search is
    # `python studies/calibrate.py`
    layout = layout_of(robot)
    assert laid_out(robot, layout) == robot
    best = fit(robot, table, layout, SPEEDS)
    assert best.misfit < 0.7
    for name, values in GRID.items():
        place = values.index(getattr(layout, name))
        for neighbour in {max(place - 1, 0), min(place + 1, len(values) - 1)} - {place}:
            near = replace(layout, **{name: values[neighbour]})
            assert fit(robot, table, near, SPEEDS).misfit > best.misfit, near


def test_main_says_the_best(monkeypatch, capsys):
    monkeypatch.setattr(
        calibrate,
        "GRID",
        {"hip_spacing_cm": (5.5,), "hip_height_cm": (1.0, 0.25), "belly_z_cm": (-1.0,)},
    )
    calibrate.main()
    lines = capsys.readouterr().out.splitlines()
    assert "c-leg 26.69 cm/s" in lines[0]
    assert lines[lines.index("best:") + 1] == lines[3]
    assert lines[3].split()[:3] == ["5.50", "0.25", "-1.00"]


def places(robot):
    plates = [
        [*plate.from_cm, *plate.to_cm, plate.width_cm] for plate in robot.body.plates.values()
    ]
    return [*np.ravel(plates), *np.ravel([(hip.x_cm, hip.z_cm) for hip in robot.legs.hips])]


@pytest.mark.parametrize("name", PERTURBATIONS)
def test_changes(robot, name):
    changed_robot = changed(robot, {name: 0.2})
    assert changed_robot != robot
    np.testing.assert_allclose(
        places(changed(changed_robot, {name: -0.2})), places(robot), atol=1e-12
    )


def test_what_the_changes_mean(robot):
    apart = changed(robot, {"hips_apart_cm": 0.5})
    assert [hip.x_cm for hip in apart.legs.hips] == [6.0, 0.0, -6.0, 6.0, 0.0, -6.0]
    belly = changed(robot, {"belly_up_cm": 0.25}).body.plates
    assert belly["belly"].from_cm == (-6.5, -0.75)
    assert belly["front"].to_cm == (6.5, 2.0)
    high = changed(robot, {"centre_of_mass_up_cm": 0.5})
    assert high.body.plates["belly"].from_cm == (-6.5, -1.5)
    assert high.legs.hips[0].z_cm == -1.25
    with pytest.raises(ValueError, match=r" x = 6\.6"):
        changed(robot, {"hips_apart_cm": 1.1})
    with pytest.raises(ValueError, match="greater than 0"):
        changed(robot, {"plates_wider_cm": -2.0})


def test_sensitivity(robot, nine):
    assert set(CHANGES_CM) == set(PERTURBATIONS)
    changes: dict[str, tuple[float, ...]] = {"belly_up_cm": (-0.5,), "hips_up_cm": (-0.5,)}
    table = sensitivity(robot, nine, [Condition(4.0, 1.0)], changes)
    assert len(table) == 2 * 3
    lower = table[table["unknown"] == "belly_up_cm"].set_index("quantity")
    np.testing.assert_allclose(lower["shift"], lower["value"] - lower["reference"])
    speed = dict(lower.loc["speed, R'/r 1, 4 Hz"].items())
    assert (speed["unit"], speed["reason"]) == ("cm/s", "")
    assert 0.01 < abs(speed["shift"]) < 0.5 * speed["reference"]
    assert lower["value"].to_dict()["best R'/r at 5 Hz"] == pytest.approx(0.8, abs=0.2)
    # hips below the belly: no such robot
    outside = table[table["unknown"] == "hips_up_cm"]
    assert outside["value"].map(math.isnan).all()
    assert outside["reason"].all()
