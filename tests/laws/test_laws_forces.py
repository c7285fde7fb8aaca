"""Forces on bodies: size, mirror image, place, time, and how the body is cut into elements."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from seeds import example_count

import rftfit

POPPY = rftfit.published_medium("poppy_LP")
TERMS: Any = rftfit.published_medium("poppy_CP", "fourier")
PLANE = ["force_z_N", "force_x_N", "moment_N_cm"]
pytestmark = pytest.mark.statistics
law = settings(max_examples=example_count(60), derandomize=True)
slow_law = settings(max_examples=example_count(16), derandomize=True)
factors = st.floats(0.1, 10)
coordinates = st.floats(-3, 3).map(lambda number: round(number, 3))
points = st.lists(st.tuples(coordinates, coordinates), min_size=2, max_size=5, unique=True)
shifts = st.floats(-2, 2).map(lambda number: round(number, 3))
"""In cm: rounding of a place leaves of a smaller shift no direction."""
steps = st.tuples(shifts, shifts, st.floats(-60, 60))
moves = st.lists(steps, min_size=2, max_size=4)
turns = st.lists(st.floats(-130, 130), min_size=1, max_size=5, unique=True)


def motion_of(places, *, time=1.0, start=0.0, x=0.0, mirror=1, z=-3.0):
    """Path through some places from depth 3 cm on; each place is the shift from the one before."""
    way = np.cumsum(np.array([(0, 0, 0), *places], dtype=float), axis=0)
    times = start + time * np.arange(len(way))
    return rftfit.path(times, mirror * way[:, 0] + x, way[:, 1] + z, mirror * way[:, 2])


def forces(body, motion, profile=POPPY, **words):
    return rftfit.predict(profile, body, motion, **({"model_error": 0} | words))[PLANE].to_numpy()


def times(factor):
    """Profile of loose poppy seeds, that much stronger."""
    rows = rftfit.published_table("table_s5").query("medium == 'poppy_LP'")
    names = ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]
    cells = rows.pivot_table(index="beta_deg", columns="gamma_deg", values=names)
    return rftfit.TableProfile(*(factor * cells[name].to_numpy() for name in names))


def close(first, second):
    assert_allclose(first, second, rtol=1e-7, atol=1e-7)


@law
@given(st.floats(-1, 1), turns, factors)
def test_a_leg_twice_as_wide_feels_twice_the_force(curvature, theta, factor):
    narrow, wide = (rftfit.arc(curvature, width_cm=width) for width in (1.0, factor))
    motion = rftfit.rotation(theta)
    close(forces(wide, motion), factor * forces(narrow, motion))


@law
@given(points, moves, factors)
def test_forces_are_proportional_to_alpha(line, places, factor):
    body, motion = rftfit.polyline(line, 2.0), motion_of(places)
    stronger = times(factor)
    close(forces(body, motion, stronger), factor * forces(body, motion))


@law
@given(points, moves)
def test_forces_of_two_media_add_up(line, places):
    body, motion = rftfit.polyline(line, 2.0), motion_of(places)
    other: Any = rftfit.published_medium("glass3mm_CP", "fourier")
    both = rftfit.FourierProfile(TERMS.coefficients + other.coefficients)
    close(forces(body, motion, both), forces(body, motion, TERMS) + forces(body, motion, other))


@law
@given(points, moves)
def test_the_mirror_image_feels_the_mirror_image(line, places):
    mirrored = rftfit.polyline([(-x, z) for x, z in line], 2.0)
    image = forces(mirrored, motion_of(places, mirror=-1))
    close(image * [1, -1, -1], forces(rftfit.polyline(line, 2.0), motion_of(places)))


@law
@given(st.floats(-1, 1), turns, st.floats(0.01, 5))
def test_a_leg_that_turns_back_at_any_rate_is_the_mirrored_leg(curvature, theta, rate):
    forward = forces(rftfit.arc(curvature), rftfit.rotation(theta))
    back = rftfit.rotation([-angle for angle in theta], rate_rad_per_s=-rate)
    close(forces(rftfit.arc(-curvature), back) * [1, -1, -1], forward)


@law
@given(points, moves, st.floats(-1e3, 1e3), factors)
def test_neither_clock_nor_speed_matters(line, places, start, time):
    body = rftfit.polyline(line, 2.0)
    close(forces(body, motion_of(places, start=start, time=time)), forces(body, motion_of(places)))


@law
@given(points, moves, st.floats(-100, 100))
def test_the_ground_is_the_same_everywhere(line, places, x):
    body = rftfit.polyline(line, 2.0)
    close(forces(body, motion_of(places, x=x)), forces(body, motion_of(places)))


@law
@given(turns)
def test_a_pose_does_not_know_of_the_others(theta):
    leg = rftfit.model_leg("reversed_c_leg")
    together = forces(leg, rftfit.rotation(theta))
    alone = [forces(leg, rftfit.rotation([angle]))[0] for angle in theta]
    close(together, alone)


@law
@given(st.floats(-80, 80), st.floats(-2, 2), st.floats(-2, 2), st.integers(2, 40))
def test_a_plate_below_the_surface_may_be_cut_finer(beta, dx, dz, elements):
    ends = [(-math.cos(math.radians(beta)), math.sin(math.radians(beta)))]
    ends.append((-ends[0][0], -ends[0][1]))
    coarse, fine = (rftfit.polyline(ends, 2.0, elements=n) for n in (1, elements))
    motion = motion_of([(dx, dz, 0.0)] * 2, z=-9.0)
    close(forces(fine, motion)[:, :2], forces(coarse, motion)[:, :2])


@law
@given(points, moves, st.randoms(use_true_random=False))
def test_elements_are_a_sum(line, places, luck):
    # without turns: a body that turns is cut by its own size, a part of it more finely
    motion = motion_of([(x, z, 0.0) for x, z, _ in places])
    body = rftfit.polyline(line, 2.0, elements=12)
    rows = [*body.body]
    luck.shuffle(rows)
    cut = luck.randrange(1, len(rows))
    parts = [rftfit.Outline(np.array(part), width_cm=2.0) for part in (rows[:cut], rows[cut:])]
    close(sum(forces(part, motion) for part in parts), forces(body, motion))


@law
@given(points, moves, coordinates, coordinates)
def test_a_moment_about_another_point_differs_by_the_lever(line, places, dx, dz):
    way = [(x, z, 0.0) for x, z, _ in places]
    shifted = rftfit.polyline([(x + dx, z + dz) for x, z in line], 2.0)
    plain = forces(rftfit.polyline(line, 2.0), motion_of(way))
    about_shifted = forces(shifted, motion_of(way, x=-dx, z=-3.0 - dz))
    close(about_shifted[:, :2], plain[:, :2])
    # from z toward x: z times force x less x times force z
    close(about_shifted[:, 2], plain[:, 2] + dz * plain[:, 1] - dx * plain[:, 0])


@law
@given(points, moves)
def test_a_line_has_no_direction(line, places):
    there, back = (rftfit.polyline(ends, 2.0) for ends in (line, line[::-1]))
    close(forces(there, motion_of(places)), forces(back, motion_of(places)))


@law
@given(points, moves, st.floats(50, 1e3))
def test_nothing_pushes_in_air(line, places, height):
    assert not forces(rftfit.polyline(line, 2.0), motion_of(places, z=height)).any()


@law
@given(st.floats(0.1, 5), factors)
def test_a_plate_twice_as_deep_feels_twice_the_force(depth, factor):
    plate = rftfit.polyline([(-1, 0), (1, 0)], 2.0)
    shallow, deep = (
        forces(plate, rftfit.path([0, 1], [0, 0], [1e-3 - d, -d], [0, 0]))[1]
        for d in (depth, factor * depth)
    )
    close(deep, factor * shallow)


@slow_law
@given(turns, st.floats(0.05, 0.3), st.floats(0.55, 0.85), st.floats(0.86, 0.99))
def test_intervals_are_nested_around_the_force(theta, error, low_level, high_level):
    leg, motion = rftfit.model_leg("c_leg"), rftfit.rotation(theta)
    narrow, wide = (
        rftfit.predict(POPPY, leg, motion, level, model_error=error)
        for level in (low_level, high_level)
    )
    for name in ("force_z", "force_x"):
        ends = [
            (wide[f"{name}_model_lo_N"], narrow[f"{name}_model_lo_N"]),
            (narrow[f"{name}_model_lo_N"], narrow[f"{name}_N"]),
            (narrow[f"{name}_N"], narrow[f"{name}_model_hi_N"]),
            (narrow[f"{name}_model_hi_N"], wide[f"{name}_model_hi_N"]),
            (narrow[f"{name}_next_lo_N"], narrow[f"{name}_model_lo_N"]),
            (narrow[f"{name}_model_hi_N"], narrow[f"{name}_next_hi_N"]),
        ]
        assert all((low <= high + 1e-9).all() for low, high in ends)


@slow_law
@given(st.floats(0.1, 3), turns)
def test_a_scaled_medium_is_its_profile(alpha, theta):
    sand, leg, motion = rftfit.scale(alpha), rftfit.model_leg("flat_leg"), rftfit.rotation(theta)
    close(forces(leg, motion, sand), forces(leg, motion, sand.profile))


# --- in space

SPACE = [
    f"{what}_{axis}_{unit}" for what, unit in (("force", "N"), ("moment", "N_cm")) for axis in "xyz"
]
CORNERS = np.array([(-1, -1.5, 0.4), (1, -1.5, 0.4), (1.2, 1.5, -0.3), (-1, 1.5, -0.3)])
TRIANGLES = [(0, 1, 2), (0, 2, 3)]
velocities = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-3, -0.1))


def sheet(corners=CORNERS):
    return rftfit.Mesh(corners, TRIANGLES, sheet=True)


def in_space(body, velocity, position=(0.0, 0.0, -3.0), rotation=None, profile=POPPY):
    motion = rftfit.Motion3D(position, velocity, rotation=rotation)
    table = rftfit.predict(profile, body, motion, model_error=0)
    return table[SPACE].iloc[0].to_numpy(float)


def about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([(c, -s, 0), (s, c, 0), (0, 0, 1)])


@slow_law
@given(velocities, st.floats(-math.pi, math.pi))
def test_a_body_and_its_way_turned_about_z_feel_the_turned_force(velocity, angle):
    turn = about_z(angle)
    plain = in_space(sheet(), velocity)
    turned = in_space(sheet(), turn @ velocity, rotation=turn)
    close(turned, [*(turn @ plain[:3]), *(turn @ plain[3:])])
    # the same when the corners are turned in place of the body
    close(in_space(sheet(CORNERS @ turn.T), turn @ velocity), turned)


@slow_law
@given(velocities, st.floats(-50, 50), st.floats(-50, 50))
def test_the_ground_in_space_is_the_same_everywhere(velocity, x, y):
    close(in_space(sheet(), velocity, (x, y, -3.0)), in_space(sheet(), velocity))


@slow_law
@given(velocities)
def test_a_mirror_image_in_y(velocity):
    image = in_space(sheet(CORNERS * [1, -1, 1]), np.multiply(velocity, [1, -1, 1]))
    close(image * [1, -1, 1, -1, 1, -1], in_space(sheet(), velocity))


@slow_law
@given(velocities, st.floats(0.4, 2))
def test_triangles_below_the_surface_may_be_cut_finer(velocity, longest_cm):
    body = sheet()
    close(in_space(body.refined(longest_cm), velocity)[:3], in_space(body, velocity)[:3])


@slow_law
@given(velocities, factors)
def test_forces_in_space_are_proportional_to_alpha(velocity, factor):
    stronger = times(factor)
    close(in_space(sheet(), velocity, profile=stronger), factor * in_space(sheet(), velocity))


@slow_law
@given(velocities, st.floats(0.1, 10))
def test_speed_in_space_does_not_matter(velocity, factor):
    close(in_space(sheet(), np.multiply(velocity, factor)), in_space(sheet(), velocity))


@slow_law
@given(st.floats(-80, 80), st.floats(-2, 2), st.floats(-2, -0.1))
def test_a_plate_in_space_is_the_plate_in_the_plane(beta, vx, vz):
    x, z = math.cos(math.radians(beta)), -math.sin(math.radians(beta))
    corners = [(-x, -1, -z), (x, -1, z), (x, 1, z), (-x, 1, -z)]
    space = in_space(sheet(corners), (vx, 0, vz))
    outline = rftfit.polyline([(-x, -z), (x, z)], 2.0)
    motion = rftfit.path([0, 1], [-vx, 0], [-3 - vz, -3], [0, 0])
    plane = forces(outline, motion)[1]
    close([space[2], space[0]], plane[:2])
    assert space[1] == pytest.approx(0, abs=1e-9)


@slow_law
@given(velocities)
def test_what_is_still_on_the_ground_is_what_moves(velocity):
    """One step of bodies on the ground is the prediction of the same pose."""
    ground = rftfit.Ground(POPPY, [sheet()], triangle_cm=10, delta_mm=0, tau_s=0)
    step = ground.step([[0, 0, -3]], np.eye(3), [velocity], [[0, 0, 0]], 1e-3)
    close(step[0, :3], in_space(sheet(), velocity)[:3])


@slow_law
@given(st.integers(1, 3))
def test_a_start_after_whole_turns_is_the_same_start(turns_before):
    plain, later = (
        rftfit.simulate(POPPY, 2.0, phase_turns=phase) for phase in (0.25, 0.25 + turns_before)
    )
    assert later.speed_cm_per_s == pytest.approx(plain.speed_cm_per_s, rel=1e-6)
