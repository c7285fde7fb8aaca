"""Forces along a free path follow from its poses and times, and a wrong path is refused."""

import numpy as np
import pytest
from coverage_levels import sweep
from log_files import told

from rftfit import reference
from rftfit.campaign.problems import CampaignError
from rftfit.forces.motion import THETA_DEG, path, read_path
from rftfit.forces.outlines import model_leg, polyline
from rftfit.forces.plane import force_draws, forces_on
from rftfit.forces.prediction import predict
from rftfit.forces.reference_kernel import element_forces, place
from rftfit.model.profiles import TableProfile

TABLE = TableProfile.published("poppy_LP")
HEADER = "t_s,x_cm,z_cm,angle_deg\n"


def written(tmp_path, text):
    file = tmp_path / "path.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_turning_leg_is_a_path(tmp_path):
    time = np.radians(THETA_DEG + 135) / 0.2
    rows = "".join(f"{t:.12f},0,2,{a:.12f}\n" for t, a in zip(time, THETA_DEG, strict=True))
    motion = read_path(written(tmp_path, "# a sweep\n" + HEADER + rows))
    np.testing.assert_allclose(motion.poses[:, 5], 0.2, rtol=1e-8)
    for leg in ("c_leg", "flat_leg"):
        table, expected = predict(TABLE, model_leg(leg), motion), sweep(TABLE, model_leg(leg))
        for name in ("force_z_N", "force_x_N", "moment_N_cm"):
            np.testing.assert_allclose(table[name], getattr(expected, name), atol=1e-6)
        assert (expected.moment_N_cm <= 1e-12).all()  # sand resists the motor


def test_a_plate_pushed_down_and_pulled_up(tmp_path):
    rows = "".join(f"{t},0,{-t if t <= 4 else t - 8},0\n" for t in range(9))
    motion = read_path(written(tmp_path, HEADER + rows))
    plate = polyline([(-1.905, 0), (1.905, 0)], 2.54)
    table = predict(TABLE, plate, motion)
    alpha_z, _ = reference.alpha_grid("poppy_LP")
    area = 3.81 * 2.54
    np.testing.assert_allclose(table["force_z_N"][:4], alpha_z[3, -1] * area * np.arange(4.0))
    np.testing.assert_allclose(table["force_z_N"][5:8], alpha_z[3, 0] * area * np.array([3, 2, 1]))
    assert table["force_z_N"][4] == 0  # it turns round: no velocity, no force
    np.testing.assert_allclose(table["force_x_N"], 0, atol=1e-12)
    tilted = motion.poses[3:4].copy()
    tilted[:, 2] = np.radians(30)  # the angle of a plate along x is its beta
    expected = TABLE.alpha(np.radians(30), np.pi / 2)[0] * 3 * area
    np.testing.assert_allclose(forces_on(TABLE, plate, tilted).force_z_N, expected)


def test_angles_may_wrap():
    angle = [170.0, 178.0, -174.0, -166.0]
    poses = path([0, 1, 2, 3], np.zeros(4), np.zeros(4), angle).poses
    np.testing.assert_allclose(poses[:, 5], np.radians(8))


def test_uneven_times_keep_a_steady_velocity():
    time = np.array([0.0, 0.1, 0.5, 0.6, 2.0])
    poses = path(time, 3 * time, -2 * time, np.degrees(0.1 * time)).poses
    np.testing.assert_allclose(poses[:, 3:], np.tile([3.0, -2.0, 0.1], (5, 1)))
    with pytest.raises(ValueError, match="increase"):
        path([0, 1, 1], np.zeros(3), np.zeros(3), np.zeros(3))


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ("0,0,0,0\n1,0,-1,0\n1,0,-2,0\n", "repeated-time 4 t_s '1'"),
        ("0,0,0,0\n2,0,-1,0\n1,0,-2,0\n", "backward-time 4 t_s '1'"),
        ("0,0,0,0\n", "too-short 2"),
        ("", "empty"),
        ("0,0,0,0\n1,0,x,0\n", "not-a-number 3 z_cm 'x'"),
    ],
)
def test_bad_paths_are_refused_with_their_rows(tmp_path, rows, expected):
    with pytest.raises(CampaignError, match=r"path\.csv") as caught:
        read_path(written(tmp_path, HEADER + rows))
    assert told(caught.value.problems) == [f"path.{expected}"]


def test_a_missing_cell_says_why():
    alpha = np.array(reference.alpha_grid("poppy_LP"))
    alpha[:, 3, 9] = np.nan
    profile = TableProfile(*alpha)
    plate = polyline([(-1, 0), (1, 0)], 1.0)
    poses = np.zeros((2, 6))
    poses[:, 1] = -2.0
    poses[:, 3:5] = [[0, -1], [-1, -1]]  # straight down; at gamma = 45 degrees
    for forces in (forces_on(profile, plate, poses), force_draws(profile, plate, poses)):
        np.testing.assert_array_equal(np.isnan(forces.force_z_N), [False, True])
        assert "(0, 45)" in forces.reason
    assert forces_on(profile, plate, poses[:1]).reason == ""
    poses[1, 1] = np.nan
    assert "missing" in forces_on(TABLE, plate, poses).reason


def test_solid_body_feels_the_sand_ahead_only():
    box = polyline([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)], 2.0, elements=80)
    poses = np.array([[0, -3.0, 0, 0, -1.0, 0]])
    forces = forces_on(TABLE, box, poses)
    forces_on_elements = element_forces(TABLE, place(box.body, box.width_cm, poses), box.solid)
    np.testing.assert_array_equal(forces_on_elements[0, :, 0] != 0, box.body[:, 1] == -1)
    alone = forces_on(TABLE, polyline([(-1, -1), (1, -1)], 2.0), poses)
    assert forces.force_z_N[0] == pytest.approx(float(alone.force_z_N[0]), rel=1e-12)
    np.testing.assert_allclose(force_draws(TABLE, box, poses).force_z_N, forces.force_z_N)


def test_no_poses_and_wrong_ones():
    with pytest.raises(ValueError, match="shape"):
        forces_on(TABLE, model_leg("c_leg"), np.zeros((3, 5)))
    many = TableProfile(*np.repeat(np.array(reference.alpha_grid("poppy_LP"))[:, None], 3, axis=1))
    for forces, shape in (
        (force_draws(many, model_leg("c_leg"), np.zeros((0, 6))), (3, 0)),
        (force_draws(TABLE, model_leg("c_leg"), np.zeros((0, 6))), (0,)),
        (forces_on(TABLE, model_leg("c_leg"), np.zeros((0, 6))), (0,)),
    ):
        shapes = {
            component.shape
            for component in (forces.force_z_N, forces.force_x_N, forces.moment_N_cm)
        }
        assert (shapes, forces.reason) == ({shape}, "")


@pytest.mark.parametrize("most", [1, 2_000_000])
def test_draws_have_the_forces_and_the_moment_of_a_single_profile(monkeypatch, most):
    """However many poses are taken at once, and also if nothing is missing."""
    monkeypatch.setattr("rftfit.forces.plane._MOST_AT_ONCE", most)
    z, x = reference.alpha_grid("poppy_LP")
    poses = np.tile([0.5, 1.0, 0.3, 0.4, -1.0, 0.2], (5, 1)) * np.linspace(0.5, 1, 5)[:, None]
    leg = model_leg("c_leg")
    drawn = force_draws(TableProfile(np.stack([z, 2 * z]), np.stack([x, 2 * x])), leg, poses)
    expected = forces_on(TABLE, leg, poses)
    for name in ("force_z_N", "force_x_N", "moment_N_cm"):
        component = getattr(expected, name)
        assert (component != 0).all()
        np.testing.assert_allclose(getattr(drawn, name), [component, 2 * component], rtol=1e-9)
    assert drawn.reason == expected.reason == ""
    poses[2, 0] = np.nan
    lost = force_draws(TABLE, leg, poses)
    assert lost.reason == forces_on(TABLE, leg, poses).reason != ""
    np.testing.assert_array_equal(np.isnan(lost.moment_N_cm), np.arange(5) == 2)


def test_a_leg_that_stands_still_or_is_in_the_air_feels_nothing_in_any_draw():
    """Even where the direction of its motion is not known."""
    poses = np.zeros((3, 6))
    poses[:, 1] = [1.0, 9.0, 9.0]
    poses[2, 3] = np.nan
    forces = force_draws(TABLE, model_leg("c_leg"), poses)
    for force in (forces.force_z_N, forces.force_x_N, forces.moment_N_cm):
        np.testing.assert_array_equal(force, 0)
    assert forces.reason == ""
