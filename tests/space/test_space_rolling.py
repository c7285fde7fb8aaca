"""A rolling wheel pushes nothing into its own track, and its facets stand for a round rim."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rftfit
from rftfit import Mesh, Motion3D
from rftfit.forces import faces
from rftfit.forces.space import compiled_mesh_forces

POPPY = rftfit.TableProfile.published("poppy_LP")


def turned_about_z(angle_deg):
    """Matrix of a rotation about the vertical."""
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


PADDLES = Mesh.wheel(3, 2, lug_cm=1, lugs=8)
"""A cylinder with lugs, 4 cm to their tips."""


def test_what_does_not_count_lies_behind_the_axle_and_faces_back():
    with_track, without = (Motion3D.roll(PADDLES, 2, 0.3, 9, track=on) for on in (True, False))
    for pose, frame in enumerate(without.frames):
        every, _, areas, _, arms = faces.moving_faces(PADDLES, frame, without.rolling[pose])
        counted = faces.moving_faces(PADDLES, frame, with_track.rolling[pose])[0]
        in_track = (arms[:, 0] < -1e-9) & (areas[:, 0] < -1e-9)
        assert_array_equal(counted, every[~in_track])
    forces = [compiled_mesh_forces(POPPY, PADDLES, m)[:, 0].mean() for m in (with_track, without)]
    assert forces[0] < forces[1]


def test_a_smooth_wheel_up_to_half_slip_is_as_its_faces_move():
    wheel = Mesh.cylinder(6.25, 6, 48)
    for slip in (-0.5, 0.1, 0.5):
        motion = Motion3D.roll(wheel, 2, slip)
        plain = Motion3D(
            motion.frames[:, :3],
            motion.frames[:, 3:6],
            motion.frames[:, 6:9],
            motion.frames[:, 9:].reshape(-1, 3, 3),
        )
        assert_array_equal(
            compiled_mesh_forces(POPPY, wheel, motion), compiled_mesh_forces(POPPY, wheel, plain)
        )


def test_slip_and_sinkage_belong_to_the_rim():
    of_tips = Motion3D.roll(PADDLES, 2, 1 - 0.8 * 3 / 4)
    of_rim = Motion3D.roll(PADDLES, 1, 0.2, rim_cm=3)
    assert_allclose(of_rim.frames[:, 2], of_tips.frames[:, 2])
    ratios = [m.frames[:, 3] / m.frames[:, 7] for m in (of_rim, of_tips)]
    assert_allclose(*ratios)
    with pytest.raises(ValueError, match="farthest point"):
        Motion3D.roll(PADDLES, 1, 0.2, rim_cm=5)


# --- Ground: a body declared a wheel


def drive(mesh, wheels, velocity, steps=40, **options):
    """Forces of a ground on a wheel that rolls 1.5 cm deep with a slip of 0.3, one row a step."""
    ground = rftfit.Ground(POPPY, [mesh], wheels=wheels, triangle_cm=9, **options)
    rows = []
    for step in range(steps):
        rate = [0, velocity / 0.7 / 4, 0]
        turn = 0.001 * step * rate[1]
        cos, sin = np.cos(turn), np.sin(turn)
        rotation = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
        place = [0.001 * step * velocity, 0, 2.5]
        rows.append(ground.step([place], [rotation], [[velocity, 0, 0]], [rate], 0.001)[0])
    return ground, np.array(rows)


def test_a_wheel_of_a_ground_obeys_the_rule_of_roll():
    ground, forces = drive(PADDLES, [0], 1.0, steps=3, delta_mm=0, tau_s=0)
    assert ground.rules == ("own-track",)
    cos, sin = np.cos(0.002 / 2.8), np.sin(0.002 / 2.8)
    motion = Motion3D.roll(PADDLES, 1.5, 0.3, 1)
    motion.frames[:, 9:] = np.array([cos, 0, sin, 0, 1, 0, -sin, 0, cos])
    expected = compiled_mesh_forces(POPPY, PADDLES, motion)[0, :6]
    assert_allclose(forces[-1], expected, atol=1e-6)
    plain, of_plain = drive(PADDLES, (), 1.0, steps=3, delta_mm=0, tau_s=0)
    assert plain.rules == ("none",)
    assert of_plain[-1, 0] > forces[-1, 0]
    assert drive(PADDLES, [0], 1.0, steps=1, track=False)[0].rules == ("none",)


def test_the_rut_comes_with_the_way():
    """On the first micrometres the rule has no share; after delta it holds, as on the plain body before."""
    _, with_rule = drive(PADDLES, [0], 1.0, steps=60)
    _, without = drive(PADDLES, (), 1.0, steps=60)
    lost = without[:, 0] - with_rule[:, 0]
    assert abs(lost[0]) < 0.1 * lost[-1]
    assert (np.diff(lost[:25]) > 0).all()


def test_wheels_of_a_ground_that_are_refused():
    for wheels, words in (
        ([1], "found body 1"),
        ({0: [1, 0, 0]}, "axle lies along y"),
        ({0: [0, 0, 0]}, "an axle of three numbers"),
    ):
        with pytest.raises(rftfit.RftfitError, match=words):
            rftfit.Ground(POPPY, [PADDLES], wheels=wheels)
    along_x = PADDLES.moved(turned_about_z(-90), np.zeros(3))
    assert rftfit.Ground(POPPY, [along_x], wheels={0: [1, 0, 0]}).rules == ("own-track",)


@pytest.mark.parametrize("slip", [0.9, 0.99])
def test_facets_of_a_smooth_wheel_at_high_slip(slip):
    means = []
    for facets in (48, 96, 384):
        wheel = Mesh.cylinder(6.25, 6, facets)
        mean = compiled_mesh_forces(POPPY, wheel, Motion3D.roll(wheel, 2, slip)).mean(axis=0)
        means.append((mean[0], mean[2], mean[0] / mean[2]))
    assert_allclose(means[:2], [means[2]] * 2, rtol=0.01)


@pytest.mark.parametrize(
    ("lug_cm", "lugs", "rim_cm", "doubtful"), [(1, 12, None, 1), (1, 12, 8, 0), (0, 0, None, 0)]
)
def test_a_rim_that_was_not_given_of_a_wheel_with_lugs_is_doubted(lug_cm, lugs, rim_cm, doubtful):
    mesh = rftfit.Mesh.wheel(8, 6, lug_cm, lugs)
    motion = Motion3D.roll(mesh, 2, 0.2, rim_cm=rim_cm)
    assert mesh.lowest_radius_cm == pytest.approx(8, rel=1e-3)
    assert motion.rim is not None
    assert motion.rim.is_doubtful == doubtful
    beyond = rftfit.beyond_measured(rftfit.published_medium("poppy_LP"), mesh, motion)
    assert (
        len([doubt for doubt in beyond if f"--rim {mesh.lowest_radius_cm:.4g}" in doubt])
        == doubtful
    )


def test_a_wheel_that_was_turned_after_a_refusal_has_its_own_least_radius():
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    lying = PADDLES.moved(turn, np.zeros(3))
    with pytest.raises(ValueError, match="turn or move it"):
        Motion3D.roll(lying, 2, 0.2)
    upright = lying.moved(turn.T, np.zeros(3))
    assert upright.lowest_radius_cm == pytest.approx(PADDLES.lowest_radius_cm)
    assert upright.lowest_radius_cm > 2 * lying.lowest_radius_cm
