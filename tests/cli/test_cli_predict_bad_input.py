"""`rftfit predict` with files that are wrong in several places, and with one cell missing."""

import json

import numpy as np
import pytest
from light_campaign import LABORATORY, make_campaign

from rftfit import reference

from .test_cli_predict import read_forces

pytestmark = pytest.mark.usefixtures("here")

PLATE = "x_cm,z_cm\n-1,0\n1,0\n"
PATH = "t_s,x_cm,z_cm,angle_deg\n"


@pytest.mark.parametrize(
    ("points", "texts"),
    [
        # an eight that closes: a solid body whose skin crosses itself
        ("0,0\n2,2\n2,0\n0,2\n0,0\n", ["points.csv, row 4", "the line from row 2 to 3 meets"]),
        # every crossing is told, not just the first
        ("0,0\n4,0\n4,1\n1,-1\n1,2\n2,2\n2,-2\n", ["row 4", "row 5", "row 7"]),
        ("1,2\n", ["points.csv, row 2: 1 point; an outline has at least two"]),
    ],
)
def test_outline(rftfit, here, points, texts):
    (here / "points.csv").write_text(f"x_cm,z_cm\n{points}")
    words = ("--medium", "poppy_LP", "--width", "2", "--outline", "points.csv")
    said = rftfit("predict", *words)
    assert said.code == 2
    for text in texts:
        assert text in said.err
    assert not (here / "forces.csv").exists()


def test_every_repeated_time_is_told(rftfit, here):
    rows = "0,0,0,0\n1,0,-1,0\n1,0,-1,0\n2,0,-2,0\n2,0,-2,0\n1.5,0,-2,0\n"
    (here / "path.csv").write_text(PATH + rows)
    said = rftfit("predict", "--leg", "c_leg", "--medium", "poppy_LP", "--path", "path.csv")
    assert said.code == 2
    for row, before in ((4, "1 s of row 3"), (6, "2 s of row 5"), (7, "2 s of row 6")):
        assert f"path.csv, row {row}, column t_s" in said.err
        assert f"later than the {before}" in said.err


def test_outline_path_and_medium_are_told_at_once(rftfit, here):
    (here / "points.csv").write_text("x_cm,z_cm\n1,2\n")
    (here / "path.csv").write_text(PATH + "0,0,0,0\n0,0,-1,0\n")
    files = ("--width", "2", "--outline", "points.csv", "--path", "path.csv")
    said = rftfit("predict", *files, "--medium", "popy_LP")
    assert said.code == 2
    for text in ("points.csv, row 2", "path.csv, row 3, column t_s", "popy_LP"):
        assert text in said.err
    assert not (here / "forces.csv").exists()


def test_one_missing_cell(rftfit, here):
    """Only what needs the cell is unknown; the file, the screen and the summary say why."""
    alpha_z, alpha_x = (np.array(part) for part in reference.alpha_grid("poppy_LP"))
    row, col = 3, list(np.round(reference.GAMMA_DEG, 1)).index(45.0)
    alpha_z[row, col] = alpha_x[row, col] = np.nan
    folder = make_campaign(here / "c", {"poppy_LP": LABORATORY}, {"poppy_LP": (alpha_z, alpha_x)})
    (here / "plate.csv").write_text(PLATE)
    # straight down; then along gamma = 45 degrees; then level
    steps = "0,0,-1,0\n1,0,-2,0\n2,0,-3,0\n3,-1,-4,0\n4,-2,-5,0\n5,-3,-5,0\n6,-4,-5,0\n"
    (here / "path.csv").write_text(PATH + steps)
    words = ("--outline", "plate.csv", "--width", "3", "--path", "path.csv",
             "--results", folder, "--medium", "poppy_LP")  # fmt: skip
    said = rftfit("predict", *words)
    assert said.code == 0
    assert "no alpha at (beta, gamma) in degrees (0, 45): no run" in said.err
    found = read_forces(here / "forces.csv")
    # velocities are differences: at 2 s and 4 s the plate turns from one direction to the other,
    # and between 33.7 and 56.3 degrees every direction needs the cell
    unknown = np.isnan(found["force_z_N"])
    assert unknown.tolist() == [False, False, False, True, False, False, False]
    for name in ("force_x_N", "moment_N_cm", "force_z_lo_N", "force_z_hi_N"):
        np.testing.assert_array_equal(np.isnan(found[name]), unknown)
    assert found["force_z_N"][1] == pytest.approx(
        2 * 6 * reference.alpha_grid("poppy_LP")[0][3, -1]
    )
    assert "# empty cells: measured table of" in (here / "forces.csv").read_text()
    result = json.loads(rftfit("predict", *words, "--json").out)
    assert (result["rows_unknown"], result["peaks_complete"]) == (1, False)
    assert "(0, 45): no run" in result["reason"]
