"""Forces along a free path follow from its poses and times, and a wrong path is refused."""

import numpy as np
import pytest
from log_files import told

from rftfit import Motion, RftfitError, TableProfile, model_leg, path, polyline, predict
from rftfit.forces.motion import read_path

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
    with pytest.raises(RftfitError, match=r"path\.csv") as caught:
        read_path(written(tmp_path, HEADER + rows))
    assert told(getattr(caught.value, "problems", ())) == [f"path.{expected}"]


def forces_in(profile, body, poses):
    """Forces in poses that stand for themselves."""
    return predict(profile, body, Motion("poses", poses, {"t_s": np.arange(float(len(poses)))}))


def test_a_missing_cell_says_why():
    beta, gamma, z, x = TABLE.cells
    # of 7 x 13 cells that of a flat plate at gamma = 45 degrees
    hole = np.where(np.arange(91) == 3 * 13 + 9, np.nan, 1.0)
    profile = TableProfile(hole * z, hole * x, beta, gamma)
    plate = polyline([(-1, 0), (1, 0)], 1.0)
    poses = np.zeros((2, 6))
    poses[:, 1] = -2.0
    poses[:, 3:5] = [[0, -1], [-1, -1]]
    forces = forces_in(profile, plate, poses)
    np.testing.assert_array_equal(np.isnan(forces["force_z_N"]), [False, True])
    assert forces["reason"].map(lambda reason: "(0, 45)" in reason).tolist() == [False, True]
    poses[1, 1] = np.nan
    assert "missing" in forces_in(TABLE, plate, poses)["reason"][1]


def test_a_leg_that_stands_still_or_is_in_the_air_feels_nothing():
    """Even where the direction of its motion is not known."""
    poses = np.zeros((3, 6))
    poses[:, 1] = [1.0, 9.0, 9.0]
    poses[2, 3] = np.nan
    forces = forces_in(TABLE, model_leg("c_leg"), poses)
    assert (forces[["force_z_N", "force_x_N", "moment_N_cm"]] == 0).all(axis=None)
    assert (forces["reason"] == "").all()
