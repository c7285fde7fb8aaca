"""The compiled force kernel agrees with plain numpy, and forces on single elements are physical.

Element: a short straight piece of an outline.
"""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from seeds import example_count

from rftfit import DepthOnlyProfile, FourierProfile, Profile, TableProfile, published_medium
from rftfit.forces import reference_kernel
from rftfit.model import kernel

TABLE = TableProfile.published("poppy_LP")
M0 = np.concatenate(published_medium("poppy_LP", "fourier").parameters)
"""Nine terms."""
BETA, GAMMA, ALPHA_Z, ALPHA_X = TableProfile.published("poppy_CP").cells
HOLES = np.where(np.arange(91) == 2 * 13 + 9, np.nan, 1.0)
"""One of 91 cells is NaN."""
HOLED = TableProfile(HOLES * ALPHA_Z, HOLES * ALPHA_X, BETA, GAMMA, name="holed")
"""A published table without that cell."""
RANDOM = np.random.default_rng(7)
UNEVEN = TableProfile(
    *RANDOM.normal(size=(2, 5, 7)),
    np.radians([-90.0, -67.0, 0.0, 67.0, 90.0])[:, None],
    np.radians([-90.0, -69.0, -67.0, 0.0, 67.0, 69.0, 90.0]),
    name="uneven",
)
"""A table on a grid of uneven steps."""
PROFILES: list[Profile] = [TABLE, HOLED, UNEVEN, FourierProfile(M0), DepthOnlyProfile.of(TABLE)]
each_profile = pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)

length = st.floats(-10, 10).map(lambda value: round(value, 9))
angle_deg = st.one_of(st.floats(-400, 400), st.sampled_from([*range(-180, 181, 15)]))
speed = st.one_of(st.just(0.0), st.floats(1e-6, 1e6))
# an area of 5e-324 has a force that is 0 in one order of factors and not in another
area = st.just(0.0) | st.floats(1e-9, 5)
element = st.tuples(length, length, angle_deg, st.floats(1e-6, 2), area, angle_deg, speed)


def direction(gamma):
    """Of a motion, x and z: downward at 90 degrees."""
    return -np.cos(gamma), -np.sin(gamma)


def tangent(beta):
    """Along a plate, x and z: level at 0."""
    return np.cos(beta), -np.sin(beta)


def elements_of(rows):
    """From (x, z, beta, half-length, area, gamma, speed), angles in degrees."""
    x, z, beta, half, area, gamma, fast = np.array(rows, dtype=float).T
    v = np.array(direction(np.radians(gamma))) * fast
    return np.column_stack([x, z, *tangent(np.radians(beta)), half, area, *v])


ARM = (0.7, -0.4)
"""Of single elements, from the reference point."""


def compiled(profile, elements):
    """Force z, x and moment about a point beside it, of each element as an outline of its own."""
    forces = []
    for x, z, tx, tz, half, area, vx, vz in elements.tolist():
        body = np.array([[*ARM, tx, tz, half]])
        pose = np.array([[x - ARM[0], z - ARM[1], 0.0, vx, vz, 0.0]])
        forces.append(kernel.pose_forces(profile.pack, body, area / half / 2, False, pose)[0])
    return np.array(forces)


def plain(profile, elements):
    forces = reference_kernel.element_forces(profile, elements)[:, None]
    return reference_kernel.net(forces, elements[:, 0] - ARM[0], elements[:, 1] - ARM[1])


@each_profile
@pytest.mark.statistics
@settings(max_examples=example_count(150))
@given(st.lists(element, min_size=1, max_size=30))
def test_compiled_and_plain_agree(profile, rows):
    elements = elements_of(rows)
    ours, theirs = compiled(profile, elements), plain(profile, elements)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-11)


@each_profile
@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("count", [0, 1, 31, 32, 33, 64, 65, 150])
def test_any_number_of_elements(profile, count, solid):
    """Blocks that are full, nearly full, or have lanes to spare; some of them in the air."""
    random = np.random.default_rng(count)
    turn, half = random.uniform(-4, 4, count), random.uniform(0, 0.3, count)
    body = np.column_stack([random.normal(size=(count, 2)), np.cos(turn), np.sin(turn), half])
    body[: count // 2, 1] += 5.0
    poses = random.normal(size=(60, 6))
    poses[0, 3:] = 0.0
    poses[1, 1] = 30.0
    ours = kernel.pose_forces(profile.pack, body, 2.5, solid, poses)
    theirs = reference_kernel.pose_forces(profile, body, 2.5, solid, poses)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-11)
    assert (ours[:2] == 0).all()


@each_profile
@pytest.mark.parametrize("column", range(6))
def test_missing_poses_are_missing_as_in_plain_numpy(profile, column):
    body = np.tile([0.0, 0.0, 0.0, 1.0, 0.05], (40, 1))
    body[:, 1] = -np.linspace(0, 4, 40)
    poses = np.tile([0.0, 1.0, 0.4, -0.5, -1.0, 0.2], (4, 1))
    poses[2:, 1] = 9.0  # in the air
    poses[1::2, column] = np.nan
    ours = kernel.pose_forces(profile.pack, body, 1.0, False, poses)
    theirs = reference_kernel.pose_forces(profile, body, 1.0, False, poses)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)
    assert np.isnan(ours[1]).any()


@each_profile
@pytest.mark.parametrize("velocity", [(-1, -1), (1, -1), (1, 1), (0, -1), (0, 1), (-1, 0)])
def test_exact_axes_and_diagonals(profile, velocity):
    """Where components of the velocity are equal or 0 to the last digit."""
    parts = [[1.0, -2.0, *tangent(np.radians(beta)), 0.5, 2.0, *velocity] for beta in (-30, 60, 90)]
    elements = np.array(parts, dtype=float)
    forces = compiled(profile, elements)
    np.testing.assert_allclose(forces, plain(profile, elements), rtol=1e-12, atol=1e-12)
    if isinstance(profile, DepthOnlyProfile):
        # each component opposes its own velocity, and there is none without it
        assert (np.sign(forces[:, 1]) == -velocity[0]).all()
        level = np.abs(elements[:, 2]) > 1e-9
        assert (np.sign(forces[level, 0]) == -velocity[1]).all()


@pytest.mark.parametrize("beta", [90, 30, -50, 2])
def test_force_is_continuous_through_the_surface(beta):
    profile, half = FourierProfile(M0), 0.6
    rise = half * abs(math.sin(math.radians(beta)))
    heights = np.linspace(-3 * rise, 1.5 * rise, 20001)
    tx, tz = tangent(math.radians(beta))
    poses = np.zeros((heights.size, 6))
    poses[:, 1], (poses[:, 3], poses[:, 4]) = heights, direction(math.radians(60))
    body = np.array([[0.0, 0.0, tx, tz, half]])
    forces = kernel.pose_forces(profile.pack, body, 1 / half / 2, False, poses)
    step = heights[1] - heights[0]
    # |dF/dz| is at most alpha A
    assert np.abs(np.diff(forces[:, :2], axis=0)).max() <= 1.5 * step
    wet = heights < rise
    assert (np.abs(forces[wet, 0]) > 0).all()
    assert (forces[~wet] == 0).all()
    # the force acts in the middle of what is below the surface
    crossing = np.abs(heights) < 0.999 * rise
    force_z, force_x, moment = forces[crossing].T
    along = moment / (tz * force_x - tx * force_z)
    depth = heights[crossing] + along * tz
    np.testing.assert_allclose(depth, (heights[crossing] - rise) / 2, atol=1e-9)


ALPHA_BY_NUMPY = [
    (HOLED, TableProfile(*(HOLES * [ALPHA_Z, ALPHA_X])[:, None], BETA, GAMMA)),
    (FourierProfile(M0), FourierProfile(M0[None])),
    (DepthOnlyProfile.of(TABLE), DepthOnlyProfile(DepthOnlyProfile.of(TABLE).values[None])),
]
"""Profiles, and each as a stack of one draw: draws are carried in numpy."""
MANY = 500_000
"""Angles of one call that go through the compiled kernel."""


@pytest.mark.parametrize(("profile", "stack"), ALPHA_BY_NUMPY, ids=lambda p: p.name)
def test_angles_may_be_broadcast_read_only_and_not_finite(profile, stack):
    gamma = np.linspace(-3, 3, MANY)
    gamma[:2] = np.inf, 1e300
    gamma.flags.writeable = False
    ours = np.stack(profile.alpha([[0.4]], gamma))
    assert ours.shape == (2, 1, MANY)
    theirs = np.stack(stack.alpha(0.4, gamma[2:]))[:, 0]
    np.testing.assert_allclose(ours[:, 0, 2:], theirs, rtol=0, atol=1e-12)
    assert np.isnan(ours[:, 0, 0]).all()


def test_few_elements_do_not_import_the_compiler_and_importing_compiles_nothing():
    code = (
        "import sys, numpy as np, rftfit, rftfit.forces.plane, rftfit.model.profiles\n"
        "table, leg = rftfit.published_medium('poppy_LP'), rftfit.model_leg('c_leg')\n"
        "table.alpha(0.1, np.linspace(-3, 3, 10_000))\n"
        "few = rftfit.predict(table, leg)\n"
        "assert 'numba' not in sys.modules\n"
        "from rftfit.model import kernel\n"
        "assert not kernel.advance.signatures and not kernel.pose_forces.signatures\n"
        "table.alpha(0.1, np.linspace(-3, 3, 1_000_000))\n"
        "assert 'numba' in sys.modules\n"
        "assert few.equals(rftfit.predict(table, leg))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
