"""A profile of measured directions has no step in its angles and is NaN where it has no data."""

import math
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rftfit import TableProfile, published_table

RANDOM = np.random.default_rng(3)
ANY_BETA, ANY_GAMMA = RANDOM.uniform(-9, 9, (2, 2000))


def table(medium="poppy_LP"):
    return TableProfile.published(medium)


def test_table_is_bilinear_at_the_true_angles():
    alpha_z = table("poppy_CP").cells[2].reshape(7, 13)
    beta, gamma = math.radians(-30 + 0.3 * 30), math.atan(1 / 3) * 0.25 + math.atan(2 / 3) * 0.75
    corners = alpha_z[2:4, 7:9]
    by_hand = 0.7 * (0.25 * corners[0, 0] + 0.75 * corners[0, 1])
    by_hand += 0.3 * (0.25 * corners[1, 0] + 0.75 * corners[1, 1])
    assert float(table("poppy_CP").alpha(beta, gamma)[0]) == pytest.approx(by_hand, rel=1e-12)


def test_table_has_no_step_anywhere_along_the_wrap():
    profile, tiny = table("glass3mm_CP"), 1e-9
    gamma = np.linspace(-np.pi, np.pi, 721)
    above = np.array(profile.alpha(np.pi / 2 - tiny, gamma))
    below = np.array(profile.alpha(-np.pi / 2 + tiny, gamma))
    assert_allclose(above, below, atol=1e-7)
    beta = np.linspace(-np.pi, np.pi, 721)
    front, behind = profile.alpha(beta, np.pi - tiny), profile.alpha(beta, -np.pi + tiny)
    assert_allclose(front, behind, atol=1e-7)


def test_nothing_is_said_in_a_wide_gap_of_a_grid_and_all_is_said_beside_it():
    """The middle of the gap from -90 to 0 deg is not that of the circle."""
    published = published_table("table_s5")
    rows = published[published["medium"] == "poppy_LP"]
    rows = rows[rows["gamma_deg"].isin([-90, 0, 45, 90])]
    table = TableProfile.from_table(rows)
    alpha_z, _ = table.alpha(np.full(5, math.radians(30)), np.radians([-90, -80, -45, -10, 22.5]))
    assert np.isnan(alpha_z).tolist() == [False, True, True, True, False]
    level, oblique = (
        rows.query(f"beta_deg == 30 and gamma_deg == {gamma}")["alpha_z_N_per_cm3"].item()
        for gamma in (0, 45)
    )
    assert_allclose(alpha_z[4], (level + oblique) / 2)


def test_missing_plate_at_90_degrees_is_the_one_at_minus_90():
    beta, gamma, *alpha = table().cells
    is_known = np.where(beta > 1.57, np.nan, 1)
    profile = TableProfile(*(is_known * alpha), beta, gamma)
    whole = table().alpha(ANY_BETA, ANY_GAMMA)
    assert profile.reason == ""
    assert_allclose(profile.alpha(ANY_BETA, ANY_GAMMA), whole, atol=1e-14)


def test_a_missing_cell_is_told_by_its_image():
    beta, gamma, *alpha = table().cells

    def cell(*place_deg):
        return np.isclose([beta, gamma], np.radians(place_deg)[:, None], atol=1e-6).all(axis=0)

    # at gamma = -90 degrees one of two images, at 90 degrees both
    lost = cell(-60, -90) | cell(-30, 90) | cell(30, 90)
    holed = TableProfile(*np.where(lost, np.nan, alpha), beta, gamma)
    image = np.array(alpha)[:, cell(60, -90)].T * [1, -1]
    assert_allclose([holed.alpha(math.radians(-60), -math.pi / 2)], image, atol=1e-15)
    assert np.isnan(holed.alpha(np.radians([-30, 30]), math.pi / 2)).all()


def test_grid_or_scattered():
    """An arm that is off by a fifth of a degree still measures a grid, and so does one that leaves out directions."""
    beta, gamma, *alpha = np.array(table().cells)
    off = np.radians(RANDOM.uniform(-0.2, 0.2, (2, beta.size)))
    shaky = np.clip(beta + off[0], -np.pi / 2, np.pi / 2), gamma + off[1]
    some = RANDOM.permutation(beta.size)[:70]
    for angles, kept in (((beta, gamma), slice(None)), (shaky, slice(None)), ((beta, gamma), some)):
        profile = TableProfile(*(values[kept] for values in (*alpha, *angles)))
        assert not profile.scattered
        assert_allclose(np.degrees(profile.beta), np.arange(-90, 91, 30), atol=0.3)
    assert TableProfile(*alpha, *RANDOM.uniform(-1.5, 1.5, (2, beta.size))).scattered
    assert TableProfile(*(values[beta == 0] for values in (*alpha, beta, gamma))).scattered


@pytest.mark.parametrize(("near_0", "lines"), [(0.2, [0]), (0.3, [-0.3, 0.3])])
def test_lines_of_a_grid(near_0, lines):
    """Angles closer than half a degree are one line; within a quarter of a degree of 0 and 90 it is that line exactly."""
    degrees = np.array([near_0, 29.7, 30.0, 30.4, 31.0, 89.8])
    beta, gamma = (np.radians(a.ravel()) for a in np.meshgrid(degrees, [-60.0, 60.0]))
    profile = TableProfile(np.ones(beta.size), np.ones(beta.size), beta, gamma)
    # and the mirror images
    assert_allclose(np.degrees(profile.beta), [-90, -31, -30, *lines, 30, 31, 90], atol=1e-9)
    expected = [-180, -120, -60, 0, 60, 120, 180]
    assert_allclose(np.degrees(profile.gamma), expected, atol=1e-9)


PATCH = np.random.default_rng(2).uniform([[5], [0]], [[65], [60]], (2, 60))
"""Scattered directions in a part of the plane, beta and gamma, degrees."""


def plane(beta_deg, gamma_deg):
    """Alpha_z and alpha_x that rise evenly, shape (2, n)."""
    return np.array(
        [0.1 + 0.002 * beta_deg + 0.003 * gamma_deg, 0.3 - 0.004 * beta_deg + 0.001 * gamma_deg]
    )


def joined(alpha, directions_deg=PATCH, reasons=None):
    """Profile of scattered directions, degrees, with alpha of shape (2, ..., n)."""
    beta, gamma = np.radians(directions_deg)
    return TableProfile(alpha[0], alpha[1], beta, gamma, "patch", reasons)


@pytest.mark.parametrize("shift", [(0, 0), (-70, -80)])
def test_scattered_directions_are_joined_by_planes(shift):
    moved = np.array(shift)[:, None]
    profile = joined(plane(*(PATCH + moved)), PATCH + moved)
    beta, gamma = RANDOM.uniform([[20], [15]], [[50], [45]], (2, 200)) + moved
    alpha = profile.alpha(*np.radians([beta, gamma]))
    assert_allclose(alpha, plane(beta, gamma), atol=1e-12)
    # seen from behind, the force along x has the other sign
    found_z, found_x = profile.alpha(*np.radians([-beta, 180 - gamma]))
    assert_allclose([found_z, -found_x], plane(beta, gamma), atol=1e-12)


def test_nothing_is_said_farther_than_35_degrees_from_every_push():
    profile = joined(plane(*PATCH))
    assert re.findall(r"patch|\d+", profile.reason) == ["patch", "35"]
    beta, gamma = np.meshgrid(np.arange(-90, 91, 5), np.arange(-180, 181, 5))
    # a turn of the plate by 180 degrees, or of the motion by 360, changes nothing
    turns = [(b, g) for b in (-180, 0, 180) for g in (-360, 0, 360)]
    both = np.concatenate([PATCH.T, [0, 180] - PATCH.T])
    pushed = np.concatenate([both + turn for turn in turns])
    off = np.hypot(beta[..., None] - pushed[:, 0], gamma[..., None] - pushed[:, 1]).min(axis=-1)
    for alpha in profile.alpha(np.radians(beta), np.radians(gamma)):
        assert_array_equal(np.isnan(alpha), off > 35)


def test_a_scattered_direction_missing_in_one_draw_is_missing_in_all():
    many = np.stack([plane(*PATCH), 2 * plane(*PATCH) + RANDOM.normal(0, 0.01, (2, 60))], axis=1)
    holed = many.copy()
    holed[0, 1, 7] = np.nan
    beta, gamma = PATCH[:, 7].round(1).tolist()
    draws = joined(holed, reasons={(beta, gamma): "dust"})
    assert f" ({beta:g}, {gamma:g}): dust; " in draws.reason
    assert draws.reason.count(" (") == 2
    assert re.findall(r"^patch|\b35\b", draws.reason) == ["patch", "35"]
    is_kept, angles = np.arange(60) != 7, np.radians(RANDOM.uniform(-90, 90, (2, 50)))
    alpha = np.array(draws.alpha(*angles))
    assert alpha.shape == (2, 2, 50)
    for number in (0, 1):
        alone = joined(many[:, number, is_kept], PATCH[:, is_kept])
        assert_allclose(alpha[:, number], alone.alpha(*angles), atol=1e-14)


def test_scattered_directions_without_a_number_give_none():
    nothing = joined(np.full((2, 3, 60), np.nan))
    alpha = np.array(nothing.alpha([0.1, 0.2], 0.3))
    assert alpha.shape == (2, 3, 2)
    assert np.isnan(alpha).all()
    assert " 35 deg " in nothing.reason
