"""The robot's part of the report page shows the numbers of its tables and pictures of its run."""

import json

import numpy as np
import pytest
from result_tables import bare_campaign, write, write_robot

from rftfit import Results, TableProfile
from rftfit.errors import InputError
from rftfit.page.robot import robot_data, robot_tables
from rftfit.robot.config import paper_robot
from rftfit.robot.motion import frames_of


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    results = bare_campaign(tmp_path_factory.mktemp("campaign"), ("poppy_LP",), robot=True)
    write_robot(results)
    return results


def cells(table):
    """What a table shows, with its small print."""
    shown = [[column.cell(row) for column in table.columns] for row in table.rows]
    return [["|".join(filter(None, (cell.text, *cell.notes))) for cell in row] for row in shown]


def test_tables_say_what_the_errors_say(results):
    tables = robot_tables(results)
    assert tables is not None
    near, far = cells(tables["shares"])
    # within the errors of alpha alone, and with the model's own error: none was given
    assert near[1:] == [*["42 of 42|predicted: 39 of 39"] * 2, *["no value"] * 2]
    assert far[2] == "0 of 42|predicted: 0 of 39"
    conditions = cells(tables["conditions"])
    assert len(conditions) == 42
    assert sum(row[-1] == "yes" for row in conditions) == 3
    assert all(row[-2].endswith("|+100 %") for row in conditions)
    assert [float(row[0].replace("\N{MINUS SIGN}", "-")) for row in conditions[::41]] == [-1, 1]
    assert [row[1:4] for row in cells(tables["best"])] == [["5.0", "0.40", "74.8"]] * 2


def test_speeds_inside_an_interval_are_counted_without_the_calibration_too(tmp_path):
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
    assert cells(tables["shares"])[0][4] == "41 of 42|predicted: 38 of 39"


def test_numbers_for_the_script(results):
    data = robot_data(results)
    assert data is not None
    json.dumps(data, allow_nan=False)
    curvatures = [curve["curvature"] for curve in data["curves"]["table"]]
    assert curvatures == [-1, -0.92, -0.6, 0, 0.6, 0.92, 1]
    assert data["curves"]["table"][0] == {"curvature": -1.0, "f": [1.0, 5.0], "v": [6.0, 30.0]}
    assert sum(data["measured"]["calibrated"]) == 3
    assert len(data["measured"]["frequency_Hz"]) == 42


def test_nothing_without_a_robot_and_damaged_pictures_are_named(tmp_path):
    results = bare_campaign(tmp_path / "none", ("poppy_LP",))
    assert (robot_tables(results), robot_data(results)) == (None, None)
    results = bare_campaign(tmp_path / "damaged", ("poppy_LP",), robot=True)
    write_robot(results)
    frames = tmp_path / "damaged" / "results" / "robot" / "frames.json"
    frames.write_text("{", "utf-8")
    with pytest.raises(InputError, match=r"frames\.json"):
        robot_data(results)


def test_pictures_are_those_of_the_run():
    frames = frames_of(paper_robot(), TableProfile.published("poppy_LP"))
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
    ends = np.array(frames["legs"]["1"])
    assert np.hypot(*(ends[-1] - ends[0])) == pytest.approx(4.1, abs=0.01)
    # a flat leg hangs straight down from its hip
    flat = np.array(frames["legs"]["0"])
    np.testing.assert_allclose(flat[:, 0], 0, atol=1e-9)
    np.testing.assert_allclose(flat[:, 1], np.linspace(0, -4.1, len(flat)), atol=0.001)
