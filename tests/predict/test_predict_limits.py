"""A prediction outside of what was measured or tested has a warning that names the limit."""

import re
import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from paper import few_draws

import rftfit

PLATE = rftfit.Outline(np.array([[0.0, 0.0, 1.0, 0.0, 1.0]]), width_cm=2.0)


def limits(path, window=(1, 9), **box):
    """What is said of a plate along a path (x, z), by the first words; without a box without walls."""
    x, z = np.array(path).T
    motion = rftfit.path(np.arange(len(path)), x, z, np.zeros(len(path)))
    profile = rftfit.published_medium("poppy_LP")
    profile.window = window
    size = {"length_cm": 24.0, "width_cm": 22.0, "depth_cm": 15.0} | box
    config: Any = SimpleNamespace(
        container=SimpleNamespace(**size), fit=SimpleNamespace(wall_clearance_cm=6.0)
    )
    remarks = rftfit.beyond_measured(profile, PLATE, motion, config if box else None)
    return [remark.partition(":")[0] for remark in remarks if "own error" not in remark]


DOWN = [(0.0, -depth) for depth in (2.0, 4.0, 6.0)]


@pytest.mark.parametrize(
    ("path", "words", "expected"),
    [
        (DOWN, {}, []),
        (DOWN, {"depth_cm": 15.0}, []),
        (DOWN, {"depth_cm": 10.0}, ["near the container"]),
        (DOWN, {"width_cm": 13.0}, ["near the container"]),
        ([(x - 50, -3.0) for x in (-8.0, 0.0, 8.0)], {"length_cm": 24.0}, ["near the container"]),
        ([(x - 50, -3.0) for x in (-5.0, 0.0, 5.0)], {"length_cm": 24.0}, []),
        (DOWN, {"window": (1.0, 5.0)}, ["deeper than measured"]),
        (DOWN, {"window": (3.0, 9.0)}, ["nearer to the surface than measured"]),
        ([(0.0, -0.2), (0.0, -80.0)], {"window": (0.0, 99.0)}, ["faster than quasi-static"]),
        ([(0.0, 1.0), (0.0, 2.0)], {}, []),
    ],
)
def test_each_limit_is_told(path, words, expected):
    assert limits(path, **words) == expected


@pytest.mark.parametrize(
    ("length_cm", "rate", "sizes"),
    [
        (7.62, 0.2, []),
        (12.5, 0.2, []),
        (4.1, 0.2, [("a body of", 4.1, "cm")]),
        (25.0, 0.2, [("a body of", 25, "cm")]),
        (7.62, 5.0, [("at", 38.1, "cm/s")]),
        (4.1, 10.0, [("a body of", 4.1, "cm"), ("at", 41, "cm/s")]),
    ],
)
def test_what_the_error_of_the_model_was_not_tested_on_is_told(length_cm, rate, sizes):
    blade = rftfit.polyline([(0, 0), (0, -length_cm)], 2.54, elements=30)
    motion = rftfit.rotation([0.0], 0.0, rate)
    remarks = rftfit.beyond_measured(rftfit.published_medium("poppy_LP"), blade, motion)
    told = re.findall(r"own error.* (a body of|at) (\S+) (cm\S*)[:,]", "\n".join(remarks))
    assert [(of, unit) for of, _, unit in told] == [(of, unit) for of, _, unit in sizes]
    found = [float(size) for _, size, _ in told]
    assert found == pytest.approx([size for _, size, _ in sizes], rel=0.02)


def test_a_map_of_pushes_whose_depth_is_not_known_is_held_against_known_media():
    deep = rftfit.path([0, 1], [0, 0], [-1.0, -15.0], [0, 0])
    (limit,) = (
        limit
        for limit in rftfit.beyond_measured(rftfit.scale(0.5), PLATE, deep)
        if limit.startswith("deeper")
    )
    assert "known media were measured to 9.0 cm" in limit
    assert "not stated" in limit


def test_a_prediction_within_all_limits_has_no_warning(recwarn):
    rftfit.predict(rftfit.published_medium("poppy_LP"), rftfit.model_leg("c_leg"))
    assert not recwarn.list


def test_the_share_of_a_push_that_lies_below_the_measured_depths():
    x, z = np.array(DOWN).T
    motion = rftfit.path(np.arange(len(DOWN)), x, z, np.zeros(len(DOWN)))
    profile = rftfit.published_medium("poppy_LP")
    profile.window = (1, 4)
    (deeper,) = (t for t in rftfit.beyond_measured(profile, PLATE, motion) if "deeper" in t)
    # depths of 2, 4 and 6 cm, of which one is below 4 cm
    assert re.findall(r"\d+\.\d|\d+(?= %)", deeper) == ["6.0", "4.0", "50"]


ONE_PUSH = {"beta_deg": [0.0], "gamma_deg": [90.0], "alpha_z_N_per_cm3": [0.5]}


@pytest.mark.parametrize(
    ("depths", "window"),
    [
        ({}, (0.0, np.inf)),
        ({"depth_to_cm": [4.0]}, (0.0, 4.0)),
        ({"depth_from_cm": [1.5], "depth_to_cm": [4.0]}, (1.5, 4.0)),
        ({"depth_from_cm": [np.nan], "depth_to_cm": [np.nan]}, (0.0, np.inf)),
    ],
)
@few_draws()
def test_pushes_state_how_deep_they_went(depths, window):
    sand = rftfit.estimate_map(pd.DataFrame(ONE_PUSH | depths))
    assert sand.profile.window == window
    motion = rftfit.path([0, 1, 2], [0, 0, 0], [-3, -5, -6], [0, 0, 0])
    deeper = [told for told in rftfit.beyond_measured(sand, PLATE, motion) if "deeper" in told]
    assert len(deeper) == (window[1] < 6)


def corner(rows_before_it):
    """Path of a plate down to 3 cm and then along -x, with the last pose so many seconds before the corner, and after it."""
    times = np.array([0, 1, *(2 - rows_before_it), 2, *(2 + rows_before_it[::-1]), 3, 4])
    down, along = np.minimum(times, 2), np.maximum(times - 2, 0)
    return times, -along, -1 - down


@pytest.mark.parametrize("solid", [False, True])
def test_a_corner_that_hides_a_force_is_told_with_its_size(solid):
    sand = rftfit.published_medium("poppy_LP")
    body = rftfit.Mesh.cylinder(radius_cm=1.5, width_cm=2, facets=24) if solid else PLATE

    def motion_and_lift(rows):
        times, x, z = corner(np.array(rows))
        zeros = np.zeros_like(times)
        motion: rftfit.Motion | rftfit.Motion3D
        if solid:
            turns = np.stack([zeros] * 3, axis=-1)
            motion = rftfit.Motion3D.path(times, np.stack([x, zeros, z], axis=-1), turns)
        else:
            motion = rftfit.path(times, x, z, zeros)
        told = [text for text in rftfit.beyond_measured(sand, body, motion) if "corner" in text]
        peaks = rftfit.find_peaks(sand, body, motion, model_error=0)
        [lift] = [peak.value for peak in peaks if peak.quantity == "force_z_N"][:1]
        return told, lift

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rftfit.LimitWarning)
        [text], lift = motion_and_lift([])
        nothing, true_lift = motion_and_lift([1e-3])
    assert "force z" not in str(nothing)
    numbers = re.findall(r"force z has (\S+) N in the table and (\S+) by", text)[0]
    in_table, by_steps = map(float, numbers)
    assert in_table == pytest.approx(lift, rel=1e-3)
    assert by_steps == pytest.approx(true_lift, rel=0.01)


def said_of_steps(body, motion):
    """What is said of the velocities of a path, in loose poppy seeds."""
    told = rftfit.beyond_measured(rftfit.published_medium("poppy_LP"), body, motion)
    return [text for text in told if "of the path" in text or "path has" in text]


@pytest.mark.parametrize("step_deg", [2.0, 5.0])
@pytest.mark.parametrize("solid", [False, True])
def test_a_leg_that_turns_has_no_corner_wherever_its_reference_point_is(step_deg, solid):
    """By the velocity of a step alone a force of the solid foot is a fifth too large: its sole moves nearly along itself."""
    angle_deg = np.arange(-50, 50.1, step_deg)
    angle = np.radians(angle_deg)
    x, z, zeros = -10 * np.sin(angle), 8 - 10 * np.cos(angle), np.zeros_like(angle)
    corners = np.array([(-3, 0.3), (-1.5, 0.075), (0, 0), (1.5, 0.2), (3, 0.8), (3, 2), (-3, 2)])
    if solid:
        sides = [np.insert(corners, 1, y, axis=1) for y in (-2, 2)]
        n = len(corners)
        faces = [(0, k, k + 1) for k in range(1, n - 1)]
        faces += [(n, n + k + 1, n + k) for k in range(1, n - 1)]
        for k in range(n):
            after = (k + 1) % n
            faces += [(k, k + n, after), (after, k + n, after + n)]
        foot: rftfit.Mesh | rftfit.Outline = rftfit.Mesh(np.concatenate(sides), faces)
        position = np.stack([x, zeros, z], axis=-1)
        turn = np.stack([zeros, angle_deg, zeros], axis=-1)
        motion: Any = rftfit.Motion3D.path(angle_deg, position, turn)
    else:
        foot = rftfit.polyline(corners, 4.0, elements=40)
        motion = rftfit.path(angle_deg, x, z, angle_deg)
    assert not said_of_steps(foot, motion)


def test_steps_that_are_too_coarse_are_told_as_such():
    def dip(step_s):
        time = np.arange(0, 6.3, step_s)
        return rftfit.path(time, time / 2, -3 - np.sin(time), np.degrees(0.8 * np.sin(time)))

    assert not said_of_steps(PLATE, dip(0.2))
    told = said_of_steps(PLATE, dip(1.0))[-1]
    assert told.startswith("the steps of the path are too coarse near t_s")
    assert "write more poses" in told
    assert "quote" not in told
    [curved] = re.findall(r"force z has \S+ N in the table and (\S+) by a smooth curve", told)
    sand = rftfit.published_medium("poppy_LP")
    assert float(curved) == pytest.approx(
        rftfit.predict(sand, PLATE, dip(0.02))["force_z_N"].max(), rel=0.04
    )
