"""Settings by which readings count that were taken near the walls of a small box have a warning."""

import pytest
from makers import config_of_push, row_of_push, write_campaign

import rftfit

BOX = {"length_cm": 40, "width_cm": 30, "depth_cm": 20}
OPEN = {"length_cm": 1000, "width_cm": 1000}


@pytest.mark.parametrize(
    ("fit", "container", "keys"),
    [
        ({"wall_clearance_cm": 5}, {}, []),
        ({"wall_clearance_cm": 4.9}, {}, ["fit.wall_clearance_cm"]),
        ({"max_depth_cm": 15}, {}, []),
        ({"max_depth_cm": 15.1}, {}, ["fit.max_depth_cm"]),
        ({}, {"width_cm": 13}, []),
        ({}, {"width_cm": 12.9}, ["container.width_cm"]),
        # open ground has no walls
        ({"wall_clearance_cm": 1}, OPEN, []),
        (
            {"wall_clearance_cm": 1, "max_depth_cm": 19},
            {},
            ["fit.wall_clearance_cm", "fit.max_depth_cm"],
        ),
    ],
)
def test_readings_nearer_to_a_wall_than_the_length_of_the_plate(tmp_path, fit, container, keys):
    """The plate is 5 cm long and 3 cm wide."""
    config = config_of_push("time", {}, fit=fit, container=BOX | container)
    write_campaign(tmp_path, config, rows=[row_of_push()], logs={"p.csv": "time\n0\n"})
    problems = rftfit.check(tmp_path)
    near = [problem for problem in problems if problem.code == "config.near-walls"]
    assert {problem.place.key for problem in near} == {*keys}
    assert {problem.severity for problem in near} <= {"warning"}
    assert all(problem.place.line for problem in near)
    assert all("length, 5 cm" in problem.allowed for problem in near)
