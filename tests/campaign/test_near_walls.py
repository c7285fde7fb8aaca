"""Settings by which readings count that were taken near the walls of a small box have a warning."""

import pytest
from makers import config_of_push, write_campaign

import rftfit

ROW = {
    "run_id": "push",
    "kind": "plate",
    "medium": "bed",
    "intruder": "plate",
    "direction": "intrusion",
    "beta_deg": "0",
    "gamma_deg": "90",
    "force_log": "push.csv",
    "motion_log": "push.csv",
}
BOX = {"length_cm": 40, "width_cm": 30, "depth_cm": 20}
OPEN = {"length_cm": 1000, "width_cm": 1000}
PLATE = {"shape": "plate", "length_cm": 4, "width_cm": 3, "thickness_cm": 0.3}


@pytest.mark.parametrize(
    ("settings", "keys"),
    [
        ({"fit": {"wall_clearance_cm": 4}, "container": BOX}, []),
        ({"fit": {"wall_clearance_cm": 3.9}, "container": BOX}, ["fit.wall_clearance_cm"]),
        ({"fit": {"max_depth_cm": 16}, "container": BOX}, []),
        ({"fit": {"max_depth_cm": 16.1}, "container": BOX}, ["fit.max_depth_cm"]),
        ({"fit": {}, "container": BOX | {"width_cm": 11}}, []),
        ({"fit": {}, "container": BOX | {"width_cm": 10.9}}, ["container.width_cm"]),
        # open ground has no walls
        ({"fit": {"wall_clearance_cm": 1}, "container": BOX | OPEN}, []),
        (
            {"fit": {"wall_clearance_cm": 1, "max_depth_cm": 19}, "container": BOX},
            ["fit.wall_clearance_cm", "fit.max_depth_cm"],
        ),
    ],
)
def test_readings_nearer_to_a_wall_than_the_length_of_the_plate(tmp_path, settings, keys):
    config = config_of_push("time", {}, intruders={"plate": PLATE}, **settings)
    config["media"] = {"bed": {"title": "our bed"}}
    write_campaign(tmp_path, config, rows=[ROW], logs={"push.csv": "time\n0\n"})
    problems = rftfit.check(tmp_path)
    near = [problem for problem in problems if problem.code == "config.near-walls"]
    assert {problem.place.key for problem in near} == {*keys}
    assert {problem.severity for problem in near} <= {"warning"}
    assert all(problem.place.line for problem in near)
    assert all("length, 4 cm" in problem.allowed for problem in near)
