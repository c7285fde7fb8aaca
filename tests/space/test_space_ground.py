"""A measured medium acts on the bodies of any simulator with the forces of `rftfit.predict`.

Also tested: a body at rest is held.
"""

import numpy as np
import pytest

import rftfit

from .test_space_fineness import wedge

POPPY = rftfit.TableProfile.published("poppy_LP")


def test_a_resting_body_is_held_and_a_plain_law_holds_nothing():
    """After it was pushed down, the elastic law bears its weight without motion."""
    plate = rftfit.Mesh.cylinder(radius_cm=3, width_cm=1).moved(
        np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), np.zeros(3)
    )
    for delta_mm, is_held in ((0.3, True), (0.0, False)):
        ground = rftfit.Ground(POPPY, [plate], delta_mm=delta_mm)
        for depth in np.linspace(0, 2, 400):
            pushed = ground.step([[0, 0, -depth]], np.eye(3), [[0, 0, -5]], [[0, 0, 0]], 0.001)
        at_rest = ground.step([[0, 0, -2]], np.eye(3), [[0, 0, 0]], [[0, 0, 0]], 0.001)
        assert pushed[0, 2] > 10
        assert (at_rest[0, 2] > 0.5 * pushed[0, 2]) == is_held


def test_refused():
    with pytest.raises(rftfit.RftfitError, match="allowed"):
        rftfit.Ground(POPPY, [rftfit.Mesh.sphere(1)], law="other")
    ground = rftfit.Ground(POPPY, [rftfit.Mesh.sphere(1)])
    with pytest.raises(rftfit.RftfitError, match="too long"):
        ground.step([[0, 0, 1]], np.eye(3), [[0, 0, 0]], [[0, 0, 0]], 0.01)


@pytest.mark.filterwarnings("error::rftfit.LimitWarning")
def test_each_limit_is_told_once_when_a_body_in_the_medium_leaves_it():
    ground = rftfit.Ground(POPPY, [rftfit.Mesh.sphere(2, 4)], delta_mm=0)
    straight = np.eye(3), [[0, 0, 0]], 0.001

    def move(height_cm, speed_cm_per_s):
        rotation, rate, step = straight
        ground.step([[0, 0, height_cm]], rotation, [[0, 0, -speed_cm_per_s]], rate, step)

    move(5, 300)  # fast, but in the air
    move(-6.9, 10)
    with pytest.warns(rftfit.LimitWarning, match=r"deeper than measured: down to 9\.1 cm") as told:
        move(-7.1, 10)
    assert len(told) == 1
    move(-8, 10)
    with pytest.warns(rftfit.LimitWarning, match="faster than quasi-static: up to 300 cm/s"):
        move(0, 300)


def test_depths_of_pushes_that_do_not_say_theirs_are_held_against_those_of_known_media():
    ground = rftfit.Ground(rftfit.scale(0.5), [rftfit.Mesh.sphere(2, 4)])
    with pytest.warns(
        rftfit.LimitWarning, match="how deep the pushes of this one went is not stated"
    ):
        ground.step([[0, 0, -8]], np.eye(3), [[0, 0, -10]], [[0, 0, 0]], 0.001)


def test_a_foot_that_is_pressed_and_then_dragged_needs_more_way_than_delta():
    foot, step_s = wedge(), 1e-3
    ground = rftfit.Ground(rftfit.scale(0.35), [foot])
    lowest_cm = foot.vertices_cm[:, 2].min()
    for depth_cm in np.arange(0, 2.5, 5 * step_s):
        pose = [[0, 0, -lowest_cm - depth_cm]], [np.eye(3)]
        ground.step(*pose, [[0, 0, -5]], [[0, 0, 0]], time_step_s=step_s)
    drag_N = {}
    for way_cm in np.arange(1, 101) * 20 * step_s:
        pose = [[-way_cm, 0, -lowest_cm - 2.5]], [np.eye(3)]
        forces = ground.step(*pose, [[-20, 0, 0]], [[0, 0, 0]], time_step_s=step_s)
        drag_N[round(10 * way_cm, 1)] = forces[0, 0]
    # the direction in which the sole gives way turns by a part on each way of delta, and it bears by its direction
    assert drag_N[3.0] / drag_N[20.0] == pytest.approx(0.85, abs=0.02)
    assert drag_N[5.0] == pytest.approx(drag_N[20.0], rel=0.01)
