"""The robot file holds the best calibration of what the paper does not say about the robot."""

from calibrate import GRID, grade_robot, laid_out, layout_of, measured

import rftfit

SPEEDS = measured(rftfit.published_table("fig_4c"))


def test_calibrated_values_stand_in_the_file(robot, table):
    # nowhere on the grid is there a better neighbour; the whole search is
    # `python studies/calibrate.py`
    layout = layout_of(robot)
    assert laid_out(robot, layout) == robot
    least = grade_robot(robot, table, SPEEDS)["misfit"]
    assert least < 0.7
    for name, values in GRID.items():
        place = values.index(getattr(layout, name))
        for neighbour in {max(place - 1, 0), min(place + 1, len(values) - 1)} - {place}:
            near = layout._replace(**{name: values[neighbour]})
            misfit = grade_robot(laid_out(robot, near), table, SPEEDS)["misfit"]
            assert misfit > least, near
