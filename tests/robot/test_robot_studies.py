"""The robot file holds the best calibration, and each change of a study alters what it names.

Studies vary what the paper does not say about the robot.
"""

from dataclasses import replace

from calibrate import GRID, fit, laid_out, layout_of, measured

from rftfit import reference

SPEEDS = measured(reference.load("fig_4c"))


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
