"""`rftfit predict` writes the library's forces and intervals, or names all wrong input."""

import json
import math
import re
import shutil

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from result_tables import LABORATORY, alpha_frame, make_campaign, read_output

from rftfit import reference
from rftfit.store import write_csv

pytestmark = pytest.mark.usefixtures("work_folder")


def test_missing_cells_are_said(rftfit, work_folder, results):
    words = "predict --leg c_leg --medium sand --profile table --results", results
    output = rftfit(*words)
    assert "no alpha at (beta, gamma) in degrees (-90, -90): no run" in output.err
    assert "--profile map needs one push in any direction only" in output.err
    assert "Not stated, as it may lie in one of the" in output.out
    assert "no force in these poses" in output.out
    columns = read_output(work_folder / "forces.csv")
    unknown = np.isnan(columns["force_z_N"])
    assert 0 < unknown.sum() < unknown.size
    assert f"no number in {unknown.sum()} of 271 poses" in output.err
    # in the air there is no force, whatever is known of the sand
    assert (columns["force_z_N"][~unknown] == 0).all()
    assert np.isnan(columns["force_z_lo_N"][unknown]).all()
    assert "# empty cells: measured table of" in (work_folder / "forces.csv").read_text()
    result = json.loads(rftfit(*words, "--json").out)
    assert (result["rows_unknown"], result["peaks_complete"]) == (unknown.sum(), False)
    assert result["reason"].count("no run") == 90
    assert result["peaks"]["lift"] is None


def test_damaged_results(rftfit, results):
    def refusal(words):
        return rftfit("predict --leg c_leg --results", results, words, code=2).err

    assert "did you mean 'poppy_LP'?" in refusal("--medium poppy_lp")
    assert "allowed: table, map, generic" in refusal("--medium sand --profile fourier")
    assert "method: found 'lsqq'; allowed: lsq, dft-index; did you mean 'lsq'?" in refusal(
        "--medium poppy_LP --profile fourier --method lsqq"
    )
    assert "needs --profile fourier" in refusal("--medium poppy_LP --method lsq")
    table = results / "alpha" / "poppy_LP.csv"
    rows = table.read_text().splitlines(keepends=True)
    table.write_text("".join([*rows[:-1], rows[-2]]))
    assert "angles that are missing, outside of -90 to 90 degrees, or there" in refusal(
        "--medium poppy_LP"
    )
    table.write_text("".join([*rows[:-1], rows[-1].replace(",0.", ",x.", 1)]))
    assert "poppy_LP.csv: a column of numbers holds something else" in refusal("--medium poppy_LP")
    table.write_text("a,b\n1,2\n")
    assert "no column " in refusal("--medium poppy_LP")
    table.write_bytes(b"\xff\xfe\x00")
    assert "cannot be read as a table" in refusal("--medium poppy_LP")
    shutil.rmtree(results / "alpha")
    assert "poppy_LP.csv: there is no such table" in refusal("--medium poppy_LP")


def test_a_fit_that_is_missing(rftfit, work_folder):
    row_of_alpha = np.where(np.arange(7)[:, None] == 0, reference.alpha_grid("poppy_LP"), np.nan)
    alpha = {
        "poppy_LP": (row_of_alpha[0], row_of_alpha[1]),
        "poppy_CP": reference.alpha_grid("poppy_CP"),
    }
    folder = make_campaign(work_folder / "c", dict.fromkeys(alpha, LABORATORY), alpha)
    for kind in ("fourier", "generic"):
        words = "predict --leg c_leg --medium poppy_LP --json --results", folder, "--profile", kind
        output = rftfit(*words)
        for text in (output.err, json.loads(output.out)["reason"]):
            assert "measured directions" in text
        assert math.isnan(read_output(work_folder / "forces.csv")["force_z_N"][135])
        assert "null" in output.out


PATH = "t_s,x_cm,z_cm,angle_deg\n"


def test_one_missing_cell(rftfit, work_folder):
    """Only what needs the cell is unknown; the screen and the summary say why."""
    alpha_z, alpha_x = (np.array(grid) for grid in reference.alpha_grid("poppy_LP"))
    row, col = 3, list(np.round(reference.GAMMA_DEG, 1)).index(45.0)
    alpha_z[row, col] = alpha_x[row, col] = np.nan
    folder = make_campaign(
        work_folder / "c", {"poppy_LP": LABORATORY}, {"poppy_LP": (alpha_z, alpha_x)}
    )
    (work_folder / "plate.csv").write_text("x_cm,z_cm\n-1,0\n1,0\n")
    # straight down; then along gamma = 45 degrees; then level
    steps = "0,0,-1,0\n1,0,-2,0\n2,0,-3,0\n3,-1,-4,0\n4,-2,-5,0\n5,-3,-5,0\n6,-4,-5,0\n"
    (work_folder / "path.csv").write_text(PATH + steps)
    body = "predict --outline plate.csv --width 3 --path path.csv"
    words = body, "--medium poppy_LP --results", folder
    assert " (0, 45): " in rftfit(*words, "--profile table").err
    columns = read_output(work_folder / "forces.csv")
    # velocities are differences: at 2 s and 4 s the plate turns from one direction to the other,
    # and between 33.7 and 56.3 degrees every direction needs the cell
    unknown = np.isnan(columns["force_z_N"])
    assert unknown.tolist() == [False, False, False, True, False, False, False]
    for name in ("force_x_N", "moment_N_cm", "force_z_lo_N", "force_z_hi_N"):
        assert_array_equal(np.isnan(columns[name]), unknown)
    assert columns["force_z_N"][1] == pytest.approx(
        2 * 6 * reference.alpha_grid("poppy_LP")[0][3, -1]
    )
    result = json.loads(rftfit(*words, "--profile table --json").out)
    assert (result["rows_unknown"], result["peaks_complete"]) == (1, False)
    assert "(0, 45): no run" in result["reason"]
    # unasked: the table where every direction of the body was pushed, else the map
    output = rftfit(*words)
    assert output.out.count("Profile: map of poppy_LP") == 1
    assert not np.isnan(read_output(work_folder / "forces.csv")["force_z_N"]).any()
    (work_folder / "path.csv").write_text(PATH + "0,0,-1,0\n1,0,-2,0\n2,0,-3,0\n")
    assert "Profile: measured table" in rftfit(*words).out


def test_a_test_without_its_error(rftfit, results):
    sand = results / "alpha" / "sand.csv"
    sand.write_text(re.sub(r"0\.003(?=,)", "", sand.read_text()))
    output = rftfit("predict --leg c_leg --medium sand --profile generic --json --results", results)
    lift = json.loads(output.out)["peaks"]["lift"]
    assert (lift["lo"], lift["hi"]) == (None, None)


def test_an_interval_that_is_not_known(rftfit, work_folder):

    folder = make_campaign(work_folder / "c", {"poppy_LP": LABORATORY}, {})
    table = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    ends = [name for name in map(str, table) if "_lo_" in name or "_hi_" in name or "_se_" in name]
    table.loc[table["gamma_deg"] == 0, ends] = np.nan
    write_csv(table, folder / "alpha" / "poppy_LP.csv")
    output = rftfit("predict --leg c_leg --medium poppy_LP --results", folder)
    assert re.search(r"^warning: .* \d+ of 271 poses: ", output.err, re.MULTILINE)
