"""The compiled kernel against its numpy twin, and the physics of single elements."""

from __future__ import annotations

import math
import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rftfit import reference
from rftfit.conventions import direction, tangent
from rftfit.model import fourier, kernel, reference_kernel
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile, scaled_generic

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.model.profiles import Profile

M0 = fourier.as_array(reference.coefficients("generic"))
TABLE = TableProfile.published("poppy_LP")
HOLES = np.where(np.arange(91).reshape(7, 13) == 2 * 13 + 9, np.nan, 1.0)
HOLED = TableProfile(
    HOLES * reference.alpha_grid("poppy_CP")[0],
    HOLES * reference.alpha_grid("poppy_CP")[1],
    name="holed",
)
RANDOM = np.random.default_rng(7)
UNEVEN = TableProfile(
    RANDOM.normal(size=(5, 7)),
    RANDOM.normal(size=(5, 7)),
    np.radians([-90.0, -7.0, 0.0, 7.0, 90.0]),
    np.radians([-90.0, -80.0, -79.0, 0.0, 79.0, 80.0, 90.0]),
    name="uneven",
)
PROFILES: list[Profile] = [
    TABLE, HOLED, UNEVEN, FourierProfile(M0), DepthOnlyProfile.of(TABLE),
]  # fmt: skip
each_profile = pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)

length = st.floats(-10, 10).map(lambda value: round(value, 9))
angle_deg = st.one_of(st.floats(-400, 400), st.sampled_from([*range(-180, 181, 15)]))
speed = st.one_of(st.just(0.0), st.floats(1e-6, 1e6))
element = st.tuples(length, length, angle_deg, st.floats(0, 2), st.floats(0, 5), angle_deg, speed)


def elements_of(rows: Sequence[Sequence[float]]) -> np.ndarray:
    """From (x, z, beta, half-length, area, gamma, speed), angles in degrees."""
    x, z, beta, half, area, gamma, fast = np.array(rows, dtype=float).T
    v = np.array(direction(np.radians(gamma))) * fast
    return np.column_stack([x, z, *tangent(np.radians(beta)), half, area, *v])


def one(
    profile: Profile, z: float, beta: float = 0, gamma: float = 90, half: float = 0.0,
    area: float = 1.0, fast: float = 1.0,
) -> np.ndarray:  # fmt: skip
    result = kernel.element_forces(
        profile.pack, elements_of([(0.0, z, beta, half, area, gamma, fast)])
    )
    return np.asarray(result[0])


@each_profile
@settings(max_examples=150, deadline=None)
@given(st.lists(element, min_size=1, max_size=70))
def test_compiled_and_plain_agree(profile: Profile, rows: list[tuple[float, ...]]) -> None:
    elements = elements_of(rows)
    ours = kernel.element_forces(profile.pack, elements)
    theirs = reference_kernel.element_forces(profile, elements)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


@each_profile
@pytest.mark.parametrize("solid", [False, True])
def test_compiled_and_plain_agree_on_poses(profile: Profile, solid: bool) -> None:
    turn = RANDOM.uniform(-4, 4, 150)
    body = np.column_stack(
        [RANDOM.normal(size=(150, 2)), np.cos(turn), np.sin(turn), RANDOM.uniform(0, 0.3, 150)]
    )
    poses = RANDOM.normal(size=(40, 6))
    poses[0, 3:] = 0.0
    poses[1, 1] = 30.0
    each = np.empty((40, 150, 4))
    ours = kernel.pose_forces(profile.pack, body, 2.5, solid, poses, each)
    theirs = reference_kernel.pose_forces(profile, body, 2.5, solid, poses)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-11)
    assert (ours[:2] == 0).all()
    single = reference_kernel.element_forces(
        profile, reference_kernel.place(body, 2.5, poses), solid
    )
    np.testing.assert_allclose(each, single, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(each[:, :, :2].sum(axis=1), ours[:, :2], rtol=1e-12, atol=1e-11)
    without = kernel.pose_forces(profile.pack, body, 2.5, solid, poses, np.empty((0, 0, 4)))
    np.testing.assert_array_equal(without, ours)


@each_profile
@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("count", [0, 1, 31, 32, 33, 64, 65, 97])
def test_any_number_of_elements(profile: Profile, count: int, solid: bool) -> None:
    """Blocks that are full, nearly full, or have lanes to spare."""
    random = np.random.default_rng(count)
    turn = random.uniform(-4, 4, count)
    body = np.column_stack(
        [random.normal(size=(count, 2)), np.cos(turn), np.sin(turn), random.uniform(0, 0.3, count)]
    )
    poses = random.normal(size=(60, 6))
    each = np.full((60, count, 4), 7.0)
    ours = kernel.pose_forces(profile.pack, body, 2.5, solid, poses, each)
    theirs = reference_kernel.pose_forces(profile, body, 2.5, solid, poses)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)
    placed = reference_kernel.place(body, 2.5, poses)
    single = reference_kernel.element_forces(profile, placed, solid)
    np.testing.assert_allclose(each, single, rtol=1e-12, atol=1e-12)
    elements = np.ascontiguousarray(placed[0])
    found = kernel.element_forces(profile.pack, elements)
    np.testing.assert_allclose(
        found, reference_kernel.element_forces(profile, elements), atol=1e-12
    )


@each_profile
@pytest.mark.parametrize("column", range(6))
def test_missing_poses_are_missing_as_in_plain_numpy(profile: Profile, column: int) -> None:
    body = np.column_stack(
        [np.zeros(40), -np.linspace(0, 4, 40), np.zeros(40), np.ones(40), np.full(40, 0.05)]
    )
    poses = np.tile([0.0, 1.0, 0.4, -0.5, -1.0, 0.2], (4, 1))
    poses[2:, 1] = 9.0  # in the air
    poses[1::2, column] = np.nan
    each = np.empty((4, 40, 4))
    ours = kernel.pose_forces(profile.pack, body, 1.0, False, poses, each)
    np.testing.assert_allclose(
        ours, reference_kernel.pose_forces(profile, body, 1.0, False, poses), rtol=1e-12, atol=1e-12
    )
    single = reference_kernel.element_forces(profile, reference_kernel.place(body, 1.0, poses))
    np.testing.assert_allclose(each[..., :2], single[..., :2], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(each[::2], single[::2], rtol=1e-12, atol=1e-12)
    assert np.isnan(ours[1]).any()


@pytest.mark.parametrize(
    ("beta", "gamma", "alpha_z", "alpha_x"), [(30, 45, 0.734, 0.294), (0, 90, 1.0, 0.0)]
)
def test_golden_values(beta: float, gamma: float, alpha_z: float, alpha_x: float) -> None:
    found = one(scaled_generic(0.25, M0), -2.0, beta, gamma, area=3.0)
    np.testing.assert_allclose(found[:2], 0.25 * 2 * 3 * np.array([alpha_z, alpha_x]), atol=8e-4)
    np.testing.assert_array_equal(found[2:], [0.0, -2.0])


@each_profile
def test_no_motion_or_no_sand_is_no_force(profile: Profile) -> None:
    assert (one(profile, -3.0, 30, 45, 0.5, fast=0.0)[:2] == 0).all()
    for height in (0.0, 1e-9, 5.0):
        assert (one(profile, height, 0, 90, 0.5)[:2] == 0).all()
    assert (one(profile, 0.5001, 90, 90, 0.5)[:2] == 0).all()


@each_profile
def test_missing_numbers_stay_missing(profile: Profile) -> None:
    elements = elements_of([(0.0, -2.0, 20, 0.1, 1.0, 30, 1.0)] * 8)
    for column in range(8):
        if column != 0:
            elements[column, column] = np.nan
    found = kernel.element_forces(profile.pack, elements)
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1:, :2]).any(axis=1).all()


@pytest.mark.parametrize("beta", [90, 30, -50, 2])
def test_force_is_continuous_through_the_surface(beta: float) -> None:
    profile, half = FourierProfile(M0), 0.6
    rise = half * abs(math.sin(math.radians(beta)))
    heights = np.linspace(-3 * rise, 1.5 * rise, 20001)
    rows = [(0.0, z, beta, half, 1.0, 60, 1.0) for z in heights.tolist()]
    forces = kernel.element_forces(profile.pack, elements_of(rows))
    step = heights[1] - heights[0]
    # |dF/dz| is at most alpha A
    assert np.abs(np.diff(forces[:, :2], axis=0)).max() <= 1.5 * step
    wet = heights < rise
    assert (np.abs(forces[wet, 0]) > 0).all()
    assert (forces[~wet, :2] == 0).all()
    # the force acts in the middle of what is below the surface, on the element's own line
    crossing = np.abs(heights) < rise
    np.testing.assert_allclose(forces[crossing, 3], (heights[crossing] - rise) / 2, atol=1e-12)
    slope = -math.tan(math.radians(beta))
    if beta != 90:
        np.testing.assert_allclose(
            forces[crossing, 3] - heights[crossing], slope * forces[crossing, 2], atol=1e-12
        )


def test_half_submerged_by_hand() -> None:
    profile = FourierProfile(M0)
    alpha_z, alpha_x = (float(value) for value in profile.alpha(math.pi / 2, math.pi / 4))
    found = one(profile, 0.0, 90, 45, half=0.5, area=2.0)
    # half of the area, its middle 0.25 cm deep
    np.testing.assert_allclose(found, [0.25 * alpha_z, 0.25 * alpha_x, 0.0, -0.25], atol=1e-15)


@each_profile
def test_forces_are_homogeneous_and_mirror(profile: Profile) -> None:
    n = 500
    rows = np.column_stack([
        RANDOM.normal(size=n), RANDOM.uniform(-5, 1, n), RANDOM.uniform(-90, 90, n),
        RANDOM.uniform(0, 1, n), RANDOM.uniform(0, 2, n), RANDOM.uniform(-180, 180, n), np.ones(n),
    ])  # fmt: skip
    elements = elements_of(rows.tolist())
    found = kernel.element_forces(profile.pack, elements)
    changed = elements.copy()
    changed[:, 5] *= 2
    changed[:, 6:] *= 7.3  # speed does not matter
    changed[:, 2:4] *= -1  # nor does the end from which an element is seen
    np.testing.assert_allclose(
        kernel.element_forces(profile.pack, changed)[:, :2], 2 * found[:, :2], atol=1e-12
    )
    longer = elements.copy()
    longer[:, [0, 1, 4]] *= 3
    np.testing.assert_allclose(
        kernel.element_forces(profile.pack, longer)[:, :2], 3 * found[:, :2], atol=1e-12
    )
    mirrored = elements * [-1, 1, -1, 1, 1, 1, -1, 1]
    np.testing.assert_allclose(
        kernel.element_forces(profile.pack, mirrored), found * [1, -1, -1, 1], atol=1e-12
    )


def test_a_missing_corner_spoils_only_its_own_cells() -> None:
    alpha_z, alpha_x = np.array(reference.alpha_grid("poppy_LP"))
    alpha_z[4, -1] = alpha_z[2, -1] = np.nan  # (+-30, 90) degrees
    alpha_x[4, -1] = alpha_x[2, -1] = np.nan
    profile = TableProfile(alpha_z, alpha_x)
    assert one(profile, -1.0, 0, 90)[0] == pytest.approx(float(TABLE.alpha(0, np.pi / 2)[0]))
    assert np.isnan(one(profile, -1.0, 1, 90)[:2]).all()
    assert (one(profile, 1.0, 1, 90)[:2] == 0).all()


def test_importing_compiles_nothing() -> None:
    code = (
        "import sys, rftfit, rftfit.model.motion, rftfit.model.motion, rftfit.model.profiles\n"
        "assert 'numba' not in sys.modules\n"
        "from rftfit.predict import kernel\n"
        "assert not kernel.element_forces.signatures and not kernel.pose_forces.signatures"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
