"""`rftfit predict` writes the library's forces and intervals, or names all wrong input."""

import json
import math
import re
import shutil
from typing import Any

import numpy as np
import pytest
from light_campaign import LABORATORY, SE, alpha_frame, make_campaign
from numpy.testing import assert_allclose, assert_array_equal
from result_tables import read_output, read_result
from turning import sweep, sweep_draws

from rftfit import reference
from rftfit.forces.motion import THETA_DEG, path
from rftfit.forces.outlines import arc, model_leg, polyline
from rftfit.forces.plane import forces_on
from rftfit.measure.alpha import directions
from rftfit.model.draws import alpha_draws, beside_name, interval, model_end_names, next_end_names
from rftfit.model.fourier import TERMS, as_array
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile, scaled_generic
from rftfit.results import open_results
from rftfit.store import write_csv

QUANTITIES = ("force_z_N", "force_x_N", "moment_N_cm")


pytestmark = pytest.mark.usefixtures("work_folder")


def check(columns, forces):
    for name in QUANTITIES:
        value = getattr(forces, name)
        assert np.abs(value).max() > 0
        assert_allclose(columns[name], value, rtol=1e-9, atol=1e-9)


def published(medium):
    table = TableProfile.published(medium)
    generic = as_array(reference.coefficients("generic"))
    return {
        "table": table,
        "fourier": FourierProfile(as_array(reference.coefficients(medium))),
        "generic": scaled_generic(reference.coefficients(medium)["zeta"], generic),
        "depth_only": DepthOnlyProfile.of(table),
    }


@pytest.mark.parametrize("kind", ["table", "fourier", "generic", "depth_only"])
@pytest.mark.parametrize("leg", reference.LEGS)
def test_equals_the_sweep(rftfit, work_folder, kind, leg):
    profile_words = () if kind == "table" else ("--profile", kind)
    assert rftfit("predict --leg", leg, "--medium glass0.3mm_CP", *profile_words).err == ""
    columns = read_output(work_folder / "forces.csv")
    # printed tables have no errors; the model has
    model_ends = {name: (*model_end_names(name), *next_end_names(name)) for name in QUANTITIES}
    beside = {name: (beside_name(name),) for name in QUANTITIES}
    nothing: dict[str, tuple[str, ...]] = dict.fromkeys(QUANTITIES, ())
    added: dict[str, Any] = {"table": model_ends, "depth_only": nothing}
    more = added.get(kind, beside)
    ends = [[name, *more[name]] for name in QUANTITIES]
    assert list(columns) == ["theta_deg", *(name for names in ends for name in names)]
    assert columns["theta_deg"].tolist() == THETA_DEG.tolist()
    check(columns, sweep(published("glass0.3mm_CP")[kind], model_leg(leg)))


def test_peaks(rftfit, refusal, work_folder):
    words = "predict --leg c_leg --medium poppy_LP --hip 1.5"
    forces = sweep(TableProfile.published("poppy_LP"), model_leg("c_leg"), None, 1.5)
    result = json.loads(rftfit(words, "--json").out)
    peaks = result["peaks"]
    peak_index = int(forces.force_z_N.argmax())
    lift = {
        "force_z_N": pytest.approx(forces.force_z_N[peak_index], abs=1e-9),
        "theta_deg": THETA_DEG[peak_index],
    }
    assert {name: peaks["lift"][name] for name in lift} == lift
    assert peaks["lift"]["lo"] is peaks["lift"]["hi"] is None
    assert 0 < peaks["lift"]["model_lo"] < forces.force_z_N[peak_index] < peaks["lift"]["model_hi"]
    bare = json.loads(rftfit(words, "--json --model-error 0").out)
    assert (bare["model_error"], bare["peaks"]["lift"]["model_lo"]) == (0, None)
    assert list(read_output(work_folder / "forces.csv")) == ["theta_deg", *QUANTITIES]
    assert "--model-error: found -1" in refusal(words, "--model-error -1")
    assert peaks["suction"]["force_z_N"] == pytest.approx(forces.force_z_N.min(), abs=1e-9)
    assert peaks["thrust"]["theta_deg"] == THETA_DEG[forces.force_x_N.argmax()]
    assert peaks["moment_negative"]["moment_N_cm"] == pytest.approx(forces.moment_N_cm.min())
    # the medium pushes this leg forward and against its turning all the way
    assert peaks["drag"] is None
    assert peaks["moment"] is None
    assert (result["rows"], result["rows_unknown"], result["reason"]) == (271, 0, "")
    assert result["peaks_complete"] is True
    text = rftfit(words).out
    line = next(line for line in text.splitlines() if "peak lift (up)" in line)
    assert line.split()[3] == f"{forces.force_z_N[peak_index]:.4g}"
    assert "next lo, next hi: 95 % interval of the next bed (5 % from bed to bed)" in text
    assert line.split()[-2:] == ["N", f"{THETA_DEG[peak_index]:g}"]
    assert "with the model's own error (eps 0.28)" in text
    assert "peak drag" not in text
    assert text.endswith("Force and moment in 271 poses: forces.csv\n")


def test_curvature_width_and_elements(rftfit, work_folder):
    rftfit("predict --medium poppy_CP --curvature -0.5 --width 1 --elements 12 --hip -1")
    outline = arc(-0.5, width_cm=1.0, elements=12)
    forces = sweep(TableProfile.published("poppy_CP"), outline, None, -1.0)
    check(read_output(work_folder / "forces.csv"), forces)


def test_outline_along_a_path(rftfit, work_folder):
    (work_folder / "scoop.csv").write_text("x_cm,z_cm\n-2,0\n0,-1\n2,0\n")
    (work_folder / "dig.csv").write_text(
        "t_s,x_cm,z_cm,angle_deg\n0,0,2,0\n1,0,-1,10\n2,-1,-4,30\n4,-6,-4,40\n"
    )
    words = "predict --outline scoop.csv --width 5 --path dig.csv --medium poppy_LP"
    output = rftfit(words, "--output dug.csv --json")
    assert output.err.startswith("warning: ")
    assert {"(0.28)", "4"} <= set(output.err.split())
    columns = read_output(work_folder / "dug.csv")
    assert columns["t_s"].tolist() == [0, 1, 2, 4]
    assert columns["angle_deg"].tolist() == pytest.approx([0, 10, 30, 40])
    poses = path([0, 1, 2, 4], [0, 0, -1, -6], [2, -1, -4, -4], [0, 10, 30, 40]).poses

    scoop = polyline([(-2, 0), (0, -1), (2, 0)], 5.0)
    check(columns, forces_on(TableProfile.published("poppy_LP"), scoop, poses))
    assert json.loads(output.out)["peaks"]["lift"]["t_s"] in (1, 2, 4)


def test_one_penetration_test(rftfit, work_folder):
    words = "--alpha 0.9 --se 0.05 --profile generic --json"
    scaled = json.loads(rftfit("scale", words).out)["coefficients_N_per_cm3"]
    result = json.loads(rftfit("predict --leg flat_leg", words).out)
    columns = read_output(work_folder / "forces.csv")
    coefficients = np.array([scaled[term]["value"] for term in TERMS])
    check(columns, sweep(FourierProfile(coefficients), model_leg("flat_leg")))
    for name in ("force_z", "force_x"):
        assert (columns[f"{name}_lo_N"] <= columns[f"{name}_N"]).all()
        assert (columns[f"{name}_N"] <= columns[f"{name}_hi_N"]).all()
    lift = result["peaks"]["lift"]
    assert lift["lo"] < lift["force_z_N"] < lift["hi"]
    assert "(se 0.05) with published Table S5, method lsq" in result["profile"]
    # a flat plate pushed straight down feels just what the scaling routine says of (0, 90 deg)
    (work_folder / "plate.csv").write_text("x_cm,z_cm\n-1,0\n1,0\n")
    (work_folder / "down.csv").write_text("t_s,x_cm,z_cm,angle_deg\n0,0,-1,0\n1,0,-2,0\n")
    rftfit("predict --outline plate.csv --width 3 --path down.csv", words)
    pushed = read_output(work_folder / "forces.csv")
    alpha = read_output(work_folder / "alpha.csv")
    cell = alpha.query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    for end in ("", "_lo", "_hi"):
        alpha = cell[f"alpha_z{end}_N_per_cm3"]
        # published rounding: the nine generic terms add up to 1 within 1e-6
        assert pushed[f"force_z{end}_N"].tolist() == pytest.approx(
            [6 * alpha, 12 * alpha], rel=2e-5
        )


def test_intervals_are_those_of_the_draws(rftfit, work_folder, results):
    output = rftfit("predict --leg c_leg --results", results, "--medium poppy_LP")
    assert output.err == ""
    table = read_result(results / "alpha" / "poppy_LP.csv")
    columns = read_output(work_folder / "forces.csv")
    check(columns, sweep(TableProfile.from_table(table), model_leg("c_leg")))
    drawn_forces = sweep_draws(
        TableProfile(*alpha_draws(table, 2000, 2013, 0.95), *directions(table)), model_leg("c_leg")
    )
    for name in ("force_z", "force_x"):
        lo, hi = interval(getattr(drawn_forces, f"{name}_N"), 0.95)
        assert_allclose(columns[f"{name}_lo_N"], lo, atol=1e-7)
        assert_allclose(columns[f"{name}_hi_N"], hi, atol=1e-7)
        assert (hi - lo).max() > 0.01
    lo, hi = interval(drawn_forces.moment_N_cm, 0.95)
    assert_allclose(columns["moment_lo_N_cm"], lo, rtol=1e-7, atol=1e-7)
    assert "lo, hi: 95 % interval" in output.out


@pytest.mark.parametrize("kind", ["fourier", "generic", "depth_only"])
def test_other_profiles_of_a_campaign(rftfit, work_folder, results, kind):
    words = "predict --leg c_leg --medium poppy_CP --profile", kind, "--results", results
    assert rftfit(*words).err == ""
    columns = read_output(work_folder / "forces.csv")
    profile = open_results(results)["poppy_CP"].profile(kind, draws=False)
    check(columns, sweep(profile, model_leg("c_leg")))
    low, middle, high = (columns[f"force_z{end}_N"] for end in ("_lo", "", "_hi"))
    is_shown = np.isfinite(low)
    assert ((low <= middle) & (middle <= high))[is_shown].all()
    assert (high - low)[is_shown].max() > 0.01
    assert is_shown.all() == (kind == "depth_only")


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


def test_a_sand_by_its_penetration_test(rftfit, work_folder, results):
    words = "predict --leg c_leg --profile generic --results", results
    assert rftfit(*words, "--medium sand").err == ""
    columns = read_output(work_folder / "forces.csv")
    rftfit(*words, "--alpha 0.7 --se", SE)
    by_alpha = read_output(work_folder / "forces.csv")
    # the same forces and intervals; the map beside them knows of few repeats in the campaign, and of none here
    assert list(columns) == list(by_alpha)
    for name in columns:
        both = columns[name].notna() & by_alpha[name].notna()
        tolerance = 0.05 * columns[name].abs().max() if "_beside_" in name else 0
        assert_allclose(columns[name][both], by_alpha[name][both], rtol=1e-9, atol=tolerance)
    assert columns["force_z_hi_N"].max() > columns["force_z_N"].max() > 1
    table = results / "alpha" / "sand.csv"
    table_text = table.read_text()
    assert ",0.7," in table_text
    table.write_text(table_text.replace(",0.7,", ",,").replace("0.003,\n", "0.003,broken\n"))
    assert "(0, 90) deg" in rftfit(*words, "--medium sand").err


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("--medium poppy_LP", "found no outline; allowed: one of --leg"),
        ("--leg c_leg --curvature 0 --medium poppy_LP", "found --leg and --curvature"),
        ("--leg cleg --medium poppy_LP", "flat_leg, reversed_c_leg; did you mean 'c_leg'?"),
        ("--curvature 1.5 --medium poppy_LP", "--curvature: found 1.5; allowed: R/r from -1"),
        ("--curvature nan --medium poppy_LP", "--curvature: found nan;"),
        ("--curvature 0,5 --medium poppy_LP", "write a decimal point: 0.5"),
        ("--leg c_leg --width 2 --medium poppy_LP", "--width: the model legs are 2.54 cm wide"),
        ("--curvature 1 --width 0 --medium poppy_LP", "--width: found 0; allowed: above 0"),
        ("--curvature 1 --width inf --medium poppy_LP", "--width: found inf;"),
        ("--leg c_leg --elements 0 --medium poppy_LP", "--elements: found 0; allowed: 1 to 10000"),
        ("--leg c_leg --hip nan --medium poppy_LP", "--hip: found nan;"),
        ("--leg c_leg --hip 2 --path p.csv --medium poppy_LP", "--hip is for a rotation"),
        ("--leg c_leg", "found no medium; allowed: one of --medium"),
        ("--leg c_leg --medium poppy_LP --alpha 0.9", "found --medium and --alpha"),
        ("--leg c_leg --medium popy_LP", "did you mean 'poppy_LP'? (published media;"),
        ("--leg c_leg --medium yuma", "--alpha for one penetration test"),
        ("--leg c_leg --medium poppy_LP --profile forier", "did you mean 'fourier'?"),
        ("--leg c_leg --alpha 0.9 --profile table", "map, generic (pushes give no other profile)"),
        ("--leg c_leg --alpha -1", "--alpha: found -1; allowed: a positive number"),
        ("--leg c_leg --alpha 0.9 --se -1", "--se: found -1;"),
        ("--leg c_leg --alpha 0.9 --confidence 95", "--confidence: found 95;"),
        ("--leg c_leg --medium poppy_LP --se 0.1", "so it needs --alpha"),
        ("--leg c_leg --medium poppy_LP --method lsq", "so it needs --results DIR or --alpha"),
        ("--leg c_leg --medium poppy_LP --results none", "no config/config.yaml there; allowed"),
        ("--outline none.csv --medium poppy_LP", "--outline needs --width"),
        ("--outline none.csv --width 1 --medium poppy_LP", "none.csv"),
        ("--leg c_leg --path none.csv --medium poppy_LP", "none.csv"),
    ],
)
def test_messages(refusal, work_folder, words, text):
    err = refusal("predict", words)
    # a usage error is drawn in a frame that breaks its lines
    assert text in err or text in " ".join(err.replace("│", " ").split())
    assert list(work_folder.iterdir()) == []


@pytest.mark.parametrize(
    ("option", "content", "text"),
    [
        ("--outline", "x_cm,z_cm\n0,0\n", "row 2: 1 point; an outline has at least two"),
        ("--outline", "x_cm,z_cm\n0,0\n2,2\n2,0\n0,2\n", "crosses or touches itself"),
        # a solid body whose skin crosses itself
        ("--outline", "x_cm,z_cm\n0,0\n2,2\n2,0\n0,2\n0,0\n", "the line from row 2 to 3 meets"),
        ("--outline", "x_cm,z_cm\n0,0\n0,0\n1,1\n", "the point of row 2 again"),
        ("--outline", "x_cm,z_cm\n0,0\n1,one\n", "found 'one'; allowed: a number"),
        ("--outline", "x_cm,y_cm\n0,0\n", "column z_cm: this column is missing"),
        ("--outline", "", "column x_cm: this column is missing"),
        ("--path", "t_s,x_cm,z_cm,angle_deg\n0,0,0,0\n0,0,-1,0\n", "later than the 0 s of row 2"),
        ("--path", "t_s,x_cm,z_cm,angle_deg\n1,0,0,0\n0,0,-1,0\n", "later than the 1 s of row 2"),
        ("--path", "t_s,x_cm,z_cm,angle_deg\n1,0,0,0\n", "a velocity needs at least two"),
        ("--path", "t_s,x_cm,z_cm,angle_deg\n1,0,,0\n2,0,1,0\n", "row 2, column z_cm"),
    ],
)
def test_bad_files(refusal, work_folder, option, content, text):
    (work_folder / "points.csv").write_text(content)
    body = "--leg c_leg" if option == "--path" else "--width 2"
    words = "predict --medium poppy_LP", body, option, "points.csv"
    assert text in refusal(*words)
    assert not (work_folder / "forces.csv").exists()


def test_every_crossing_is_told(refusal, work_folder):
    (work_folder / "points.csv").write_text("x_cm,z_cm\n0,0\n4,0\n4,1\n1,-1\n1,2\n2,2\n2,-2\n")
    err = refusal("predict --medium poppy_LP --width 2 --outline points.csv")
    assert all(f"row {row}" in err for row in (4, 5, 7))


def test_nothing_in_the_sand(rftfit, work_folder):
    output = rftfit("predict --leg c_leg --medium poppy_LP --hip 9")
    assert "above the surface" in output.err
    assert (read_output(work_folder / "forces.csv")["force_z_N"] == 0).all()


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


def test_every_repeated_time_is_told(refusal, work_folder):
    rows = "0,0,0,0\n1,0,-1,0\n1,0,-1,0\n2,0,-2,0\n2,0,-2,0\n1.5,0,-2,0\n"
    (work_folder / "path.csv").write_text(PATH + rows)
    err = refusal("predict --leg c_leg --medium poppy_LP --path path.csv")
    for row, earlier_time in ((4, "1 s of row 3"), (6, "2 s of row 5"), (7, "2 s of row 6")):
        assert f"path.csv, row {row}, column t_s" in err
        assert f" {earlier_time}" in err


def test_outline_path_and_medium_are_told_at_once(refusal, work_folder):
    (work_folder / "points.csv").write_text("x_cm,z_cm\n1,2\n")
    (work_folder / "path.csv").write_text(PATH + "0,0,0,0\n0,0,-1,0\n")
    words = "predict --width 2 --outline points.csv --path path.csv --medium popy_LP"
    err = refusal(words)
    for text in ("points.csv, row 2", "path.csv, row 3, column t_s", "popy_LP"):
        assert text in err
    assert not (work_folder / "forces.csv").exists()


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


def test_what_is_read_is_never_overwritten(refusal, work_folder):
    path = work_folder / "path.csv"
    path.write_text(PATH + "0,0,0,0\n1,0,-1,0\n")
    words = "predict --leg c_leg --medium poppy_LP --path path.csv --output ./path.csv --force"
    assert "this file is read" in refusal(words)
    assert path.read_text().startswith("t_s")


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
