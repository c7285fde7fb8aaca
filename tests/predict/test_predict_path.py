"""Forces along a free path follow from its poses and times, and a wrong path is refused."""

import numpy as np
import pytest
from log_files import told

from rftfit import TableProfile, model_leg, path, polyline, reference
from rftfit.campaign.problems import CampaignError
from rftfit.forces.motion import read_path
from rftfit.forces.plane import force_draws, forces_on

TABLE = TableProfile.published("poppy_LP")
HEADER = "t_s,x_cm,z_cm,angle_deg\n"


def written(tmp_path, text):
    file = tmp_path / "path.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_angles_may_wrap():
    angle = [170.0, 178.0, -174.0, -166.0]
    poses = path([0, 1, 2, 3], np.zeros(4), np.zeros(4), angle).poses
    np.testing.assert_allclose(poses[:, 5], np.radians(8))


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


def test_a_leg_that_stands_still_or_is_in_the_air_feels_nothing_in_any_draw():
    """Even where the direction of its motion is not known."""
    poses = np.zeros((3, 6))
    poses[:, 1] = [1.0, 9.0, 9.0]
    poses[2, 3] = np.nan
    forces = force_draws(TABLE, model_leg("c_leg"), poses)
    for force in (forces.force_z_N, forces.force_x_N, forces.moment_N_cm):
        np.testing.assert_array_equal(force, 0)
    assert forces.reason == ""
