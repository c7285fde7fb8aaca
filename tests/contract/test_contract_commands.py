"""Commands that need no campaign: exit codes, files, and JSON whose numbers are those of Python."""

import io
import json
import math
import os
import re
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import MadePush, answer_of, json_of, refused, run_targets
from numpy.testing import assert_allclose

import rftfit

BEADS: Any = rftfit.published_medium("glass3mm_CP")
COMMANDS = [
    "init",
    "check",
    "inspect",
    "reenact",
    "watch",
    "run",
    "verify",
    "diff",
    "compare",
    "example",
    "scale",
    "plan",
    "export",
    "predict",
    "wheel",
    "simulate",
    "sweep",
]
PUSHES = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3\n0,90,0.4,0\n0,45,0.3,0.15\n30,45,0.35,0.2\n"
ENDS = ("lo", "hi", "model_lo", "model_hi", "next_lo", "next_hi")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "field.csv").write_text(PUSHES)
    (tmp_path / "scoop.csv").write_text("x_cm,z_cm\n-2,0\n0,-1\n2,0\n")
    (tmp_path / "dig.csv").write_text("t_s,x_cm,z_cm,angle_deg\n0,0,0,0\n1,1,-1,10\n2,3,-2,20\n")
    return tmp_path


def table_of(path):
    return pd.read_csv(path, comment="#")


# --- help, version, words that are not understood


def test_all_commands_are_listed():
    code, out, _ = answer_of("--help")
    assert code == 0
    assert re.findall(r"^\S (\w+) ", out, re.MULTILINE) == COMMANDS
    # no words at all are a question for help
    assert answer_of()[:2] == answer_of("-h")[:2] == (0, out)


def test_the_version():
    assert answer_of("--version") == (0, f"rftfit {version('rftfit')}\n", "")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command(name):
    code, out, error = answer_of(name, "--help")
    assert (code, error) == (0, "")
    assert f"Example: rftfit {name} " in out
    assert "<bool>" not in out
    assert "]...]..." not in out
    assert answer_of(name, "-h") == (0, out, "")


@pytest.mark.parametrize(
    "words", [["scales"], ["--no-such"], *([n, "--no-such"] for n in COMMANDS)]
)
def test_unknown_words(words, tmp_path):
    refused(*words, folder=tmp_path)
    assert [*tmp_path.iterdir()] == []


# --- scale


@pytest.mark.parametrize(
    ("words", "pushes", "confidence"),
    [
        ("--alpha 0.9", None, 0.95),
        ("--alpha 0.9 --confidence 0.8", None, 0.8),
        ("--pushes field.csv", PUSHES, 0.95),
    ],
)
def test_scale_is_the_map(words, pushes, confidence, folder):
    one = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [0.9]})
    content = json_of("scale", *words.split(), "--output", "a.csv", folder=folder)
    table = pd.read_csv(io.StringIO(pushes)) if pushes else one
    estimated = rftfit.estimate_map(table, confidence=confidence)
    assert [*content["zeta"].values()] == pytest.approx([*estimated.zeta], rel=1e-6)
    assert content["confidence"] == confidence
    assert content["pushes"] == estimated.pushes == len(table)
    assert content["known_media"] == estimated.known_media.split(", ")
    assert content["degrees_of_freedom"] == estimated.dof
    if math.isnan(estimated.belongs):
        assert content["probability_if_it_belongs"] is None
    else:
        assert content["probability_if_it_belongs"] == pytest.approx(estimated.belongs)
    assert content["alpha_table"] == "a.csv"
    written, made = table_of(folder / "a.csv"), estimated.table()
    assert [*written] == [*made]
    angles = ["beta_deg", "gamma_deg"]
    numbers = [name for name in written if name not in (*angles, "source")]
    assert_allclose(written[angles], made[angles], atol=0.0051)
    assert_allclose(written[numbers], made[numbers], rtol=1e-4, atol=1e-5)
    assert [*written["source"]] == [*made["source"]]


def test_scale_by_the_papers_routine(folder):
    words = "scale --alpha 0.9 --se 0.02 --profile generic"
    content, sand = json_of(*words.split(), folder=folder), rftfit.scale_by_paper(0.9, 0.02)
    assert content["zeta"]["value"] == pytest.approx(sand.zeta)
    assert content["zeta"]["lo"] == pytest.approx(sand.zeta_lo)
    assert content["chi"]["value"] == pytest.approx(sand.chi)
    assert len(table_of(folder / "alpha.csv")) == 91


# --- predict


@pytest.mark.parametrize(
    ("words", "body", "motion"),
    [
        ("--leg c_leg", lambda: rftfit.model_leg("c_leg"), lambda: None),
        ("--curvature 0.5 --width 3", lambda: rftfit.arc(0.5, width_cm=3), lambda: None),
        (
            "--leg flat_leg --hip 1 --elements 12",
            lambda: rftfit.model_leg("flat_leg", 12),
            lambda: rftfit.rotation(None, 1.0),
        ),
        (
            "--outline scoop.csv --width 5 --path dig.csv",
            lambda: rftfit.polyline([(-2, 0), (0, -1), (2, 0)], 5),
            lambda: rftfit.path([0, 1, 2], [0, 1, 3], [0, -1, -2], [0, 10, 20]),
        ),
    ],
)
def test_predict_is_the_prediction(words, body, motion, folder):
    content = json_of("predict", *words.split(), "--medium", "poppy_CP", folder=folder)
    forces = rftfit.predict(rftfit.published_medium("poppy_CP"), body(), motion())
    written = table_of(folder / "forces.csv")
    assert [*written] == [name for name in forces if name != "reason"]
    assert_allclose(written, forces[[*written]], rtol=1e-9, atol=1e-9)
    assert (content["rows"], content["rows_unknown"]) == (len(forces), 0)
    assert (content["model_error"], content["confidence"]) == (0.28, 0.95)
    key = next(iter(forces))
    for name, quantity, largest in (
        ("lift", "force_z_N", 1),
        ("suction", "force_z_N", -1),
        ("thrust", "force_x_N", 1),
    ):
        values = largest * forces[quantity]
        peak = content["peaks"][name]
        if peak is None:
            assert values.max() <= 0.05 * forces[quantity].abs().max()
            continue
        assert largest * peak[quantity] == pytest.approx(values.max(), rel=1e-9)
        assert peak[key] == forces[key].iloc[int(values.argmax())]
        assert {*ENDS} <= peak.keys()


def test_predict_without_the_error_of_the_model(folder):
    words = "predict --leg c_leg --medium poppy_LP --model-error 0"
    content = json_of(*words.split(), folder=folder)
    assert (content["model_error"], content["confidence"]) == (0, None)
    assert not [name for name in table_of(folder / "forces.csv") if "_lo" in name]


def plate_down(folder, beta_deg, gamma_deg):
    """Shares of the force in directions near one push, on a level plate that goes straight down."""
    (folder / "plate.csv").write_text("x_cm,z_cm\n-2,0\n2,0\n")
    (folder / "down.csv").write_text("t_s,x_cm,z_cm,angle_deg\n0,0,-1,0\n1,0,-3,0\n")
    rows = f"{beta_deg},{gamma_deg},0.5,0\n"
    (folder / "push.csv").write_text(f"beta_deg,gamma_deg,alpha_z,alpha_x\n{rows}")
    words = "predict --outline plate.csv --width 3 --path down.csv --pushes push.csv"
    return json_of(*words.split(), folder=folder)["shares_near_pushes"]


@pytest.mark.parametrize(("beta_deg", "gamma_deg", "share"), [(10, 80, 1), (0, 60, 0), (30, 90, 0)])
def test_the_share_of_a_force_near_pushes(beta_deg, gamma_deg, share, folder):
    assert plate_down(folder, beta_deg, gamma_deg)["lift"] == share


# --- export


def test_export_is_the_profile(folder):
    code, out, _ = answer_of("export", "--medium", "glass3mm_CP", folder=folder)
    assert code == 0
    assert "profile.json" in out
    rftfit.write_profile(folder / "own.json", BEADS, name="glass3mm_CP", window=(0.0, 9.0))
    exported, own = (json.loads((folder / n).read_text()) for n in ("profile.json", "own.json"))
    for section in ("directions", "golden", "force_errors"):
        assert exported[section] == own[section]


# --- plan


def test_plan_is_the_plan(folder):
    content = json_of("plan", "--target", "zeta", "--count", "2", "--pairs", folder=folder)
    rig = rftfit.Rig(pairs=True)
    table = rftfit.plan("zeta", rig=rig, count=2).table()
    assert [row["push"] for row in content["pushes"]] == [0, 1, 2]
    widths = [row["half_width_percent"] for row in content["pushes"]]
    assert_allclose(widths, table["half_width_percent"], rtol=1e-6)
    rows = table_of(folder / content["run_sheet_rows"])
    assert {*rows["kind"]} == {"plate"}
    first = rows.iloc[0]
    assert first["beta_deg"] == pytest.approx(content["pushes"][1]["beta_deg"], abs=1e-3)
    assert first["gamma_deg"] == pytest.approx(content["pushes"][1]["gamma_deg"], abs=1e-3)


def test_a_plan_goes_on_from_the_map_that_the_same_pushes_give(folder):
    """Repeats that differ widen the map, and so what is known before the first push."""
    pushes = pd.DataFrame(
        {"beta_deg": 0.0, "gamma_deg": 90.0, "alpha_z_N_per_cm3": [0.62, 0.70]}, index=[0, 1]
    )
    pushes.to_csv(folder / "repeats.csv", index=False)
    content = json_of(
        *("plan", "--leg", "c_leg", "--pushes", "repeats.csv", "--count", "1", "--force"),
        folder=folder,
    )
    medium_map = rftfit.estimate_map(pushes)
    table = rftfit.plan(rftfit.model_leg("c_leg"), medium_map, count=1).table()
    widths = [row["half_width_percent"] for row in content["pushes"]]
    assert_allclose(widths, table["half_width_percent"], rtol=1e-6)
    once = rftfit.estimate_map(pushes.assign(alpha_z_N_per_cm3=0.66))
    assert widths[0] > 1.2 * rftfit.plan("map", once, count=1).table()["half_width_percent"][0]


def test_repeats_of_a_campaign_and_of_a_table_give_one_scatter_of_beds(tmp_path):
    depth_mm = np.arange(2.5, 45.0, 1.25)
    noise_kPa = np.random.default_rng(5).normal(0, 0.5, depth_mm.size)
    runs = [
        pd.DataFrame(
            {"run_id": name, "beta_deg": 0.0, "gamma_deg": 90.0, "depth_mm": depth_mm}
        ).assign(stress_z_kPa=alpha * depth_mm + noise_kPa)
        for name, alpha in (("first", 6.2), ("second", 7.0))
    ]
    pd.concat(runs).to_csv(tmp_path / "stress.csv", index=False)
    assert answer_of("init", "c", "--stress-table", "stress.csv", folder=tmp_path)[0] == 0
    assert run_targets(tmp_path / "c", ["results/alpha/stress.csv"]).failed == {}
    medium_map = rftfit.open(tmp_path / "c")["stress"].map()
    table = pd.DataFrame(
        {"beta_deg": 0.0, "gamma_deg": 90.0, "alpha_z_N_per_cm3": [0.62, 0.70]}, index=[0, 1]
    )
    assert medium_map.bed_spread == pytest.approx(rftfit.estimate_map(table).bed_spread, rel=0.02)
    assert medium_map.bed_spread > 0.1


# --- simulate


def test_simulate_is_the_robot(folder):
    words = "simulate --frequency 2 --curvature 1 --medium poppy_LP --no-animation"
    content = json_of(*words.split(), folder=folder)
    run = rftfit.simulate(rftfit.published_medium("poppy_LP"), 2.0, 1.0)
    assert content["outcome"] == run.outcome == "steady"
    assert content["speed_cm_per_s"] == pytest.approx(run.speed_cm_per_s, rel=1e-6)
    assert content["frequency_Hz"] == 2.0
    motion = table_of(folder / "simulation" / "motion.csv")
    assert (np.diff(motion["time_s"]) > 0).all()
    low, high = content["last_two_strides"]["z_cm"]
    assert motion["z_cm"].min() <= low < high <= motion["z_cm"].max()
    assert (folder / "simulation" / "motion.png").read_bytes()[:4] == b"\x89PNG"


# --- inspect, and a log in Python


@pytest.mark.parametrize(
    "push", [MadePush(), MadePush(force_unit="gf", length_unit="cm", start_s=1000.0)]
)
def test_a_log_is_the_push_that_was_made(push, tmp_path):
    path = push.log().write(tmp_path / "push.csv")
    log = rftfit.read_log(path)
    assert log.units == {
        "time": "s",
        "Fx": push.force_unit,
        "Fz": push.force_unit,
        "x": push.length_unit,
        "z": push.length_unit,
    }
    content = json_of("inspect", path)
    (clock,) = content["clocks"]
    assert content["kinds"] == ["force", "motion"]
    assert (clock["rows"], clock["used"]) == (log.rows, log.size)
    assert clock["clock"]["duration"] == pytest.approx(18.95)
    assert clock["clock"]["rate"] == pytest.approx(20)
    assert_allclose(log.columns["Fz"], push.log().columns["Fz"], atol=1e-8)


@pytest.mark.parametrize(("mass", "weight"), [("kg", "kgf"), ("g", "gf")])
def test_a_force_in_a_unit_of_mass_is_read_as_its_weight(mass, weight, tmp_path):
    log = MadePush(force_unit="gf").log()
    log.units.update(dict.fromkeys(("Fx", "Fz"), mass))
    path = log.write(tmp_path / "push.csv")
    read = rftfit.read_log(path)
    assert (read.units["Fx"], read.units["Fz"]) == (weight, weight)
    assert json_of("inspect", path)["kinds"] == ["force", "motion"]


@pytest.mark.parametrize(
    ("dialect", "options"),
    [
        ("rigg", {}),
        ("rig", {"sheet": 1}),
        ("xlsx", {"page": 1}),
        ("tdms", {"group": 3}),
        ("tdms", {"channel": "a"}),
        ("ati-daq", {"rate_Hz": -1}),
        ("ati-netft", {"rate": 250}),
        (None, {"delimiter": "comma"}),
    ],
)
def test_options_that_a_dialect_does_not_have(dialect, options, tmp_path):
    path = MadePush().log().write(tmp_path / "push.csv")
    text = options if dialect is None else None
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.read_log(path, dialect, text, None if dialect is None else options)
    assert caught.value.exit_code == 2
    if dialect is not None:
        words = [f"--option={key}={setting}" for key, setting in options.items()]
        refused("inspect", path, "--dialect", dialect, *words)


@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_a_drawing_replaces_no_picture_of_somebody_else(ending, tmp_path):
    path = MadePush().log().write(tmp_path / "push.csv")
    picture = tmp_path / f"rig.{ending}"
    picture.write_bytes(b"a photograph of the rig")
    error = refused("inspect", path, "--plot", picture)
    assert "was not written by rftfit inspect" in error
    assert picture.read_bytes() == b"a photograph of the rig"
    assert answer_of("inspect", path, "--plot", picture, "--force")[0] == 0
    drawn = picture.read_bytes()
    # its own it draws anew unasked
    assert answer_of("inspect", path, "--plot", picture)[0] == 0
    assert picture.read_bytes() == drawn != b"a photograph of the rig"
    refused("inspect", path, "--plot", tmp_path / "log.bmp")


# --- init, check, example, reenact


@pytest.mark.parametrize("words", [["check"], ["check", "--config", "config/none.yaml"]])
def test_no_campaign_is_a_problem_with_a_code(words, folder):
    code, out, error = answer_of(*words, "--json", folder=folder)
    content = json.loads(out)
    assert (code, error, content["errors"], content["campaign"]) == (2, "", 1, None)
    (problem,) = content["problems"]
    assert problem["place"]["file"] == words[-1] if len(words) > 1 else "config/config.yaml"
    assert problem["severity"] == "error"


def test_a_new_campaign(tmp_path):
    assert answer_of("init", "c", folder=tmp_path)[0] == 0
    written = {
        p.relative_to(tmp_path / "c").as_posix(): p.read_bytes()
        for p in (tmp_path / "c").rglob("*.*")
    }
    assert {"config/config.yaml", "config/runs.csv", "config/config.schema.json", "README.md"} <= {
        *written
    }
    refused("init", "c", folder=tmp_path)
    assert all((tmp_path / "c" / name).read_bytes() == content for name, content in written.items())
    codes = {problem.code for problem in rftfit.check(tmp_path / "c")}
    code, out, _ = answer_of("check", "--json", folder=tmp_path / "c")
    assert code == 2
    assert {problem["code"] for problem in json.loads(out)["problems"]} == codes


def test_a_campaign_of_a_table(tmp_path):
    rows = rftfit.published_table("table_s5").query("medium == 'poppy_LP'")
    rows.to_csv(tmp_path / "alpha.csv", index=False)
    assert answer_of("init", "c", "--alpha-table", "alpha.csv", folder=tmp_path)[0] == 0
    content = json_of("check", folder=tmp_path / "c")
    assert (content["errors"], content["problems"]) == (0, [])
    refused(
        "init", "d", "--alpha-table", "alpha.csv", "--stress-table", "alpha.csv", folder=tmp_path
    )
    refused("init", "d", "--alpha-table", "none.csv", folder=tmp_path)
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize(
    "words",
    [
        "example cmu-sands",
        "example",
        "reenact",
        "reenact --protocol papers",
        "reenact --seed -1",
        "run",
        "run --cores 0",
        "verify",
        "sweep",
        "diff a b",
        "diff a",
        "compare a b",
        "compare a b --confidence 1",
        "watch --no-page --wait 0",
        "watch --no-page",
        "inspect nowhere.csv",
        "inspect .",
        "scale",
        "scale --alpha 0.9 --pushes field.csv",
        "scale --alpha 0,9",
        "scale --alpha -1",
        "scale --alpha nan",
        "scale --alpha inf",
        "scale --alpha 0.9 --se -0.1",
        "scale --pushes field.csv --se 0.1",
        "scale --pushes none.csv",
        "scale --alpha 0.9 --confidence 0.5",
        "scale --alpha 0.9 --profile fourier",
        "scale --alpha 0.9 --method lsqr --profile generic",
        "scale --alpha 0.9 --leg c_leg",
        "scale --alpha 0.9 --output field.csv",
        "scale --pushes field.csv --output field.csv --force",
        "predict",
        "predict --leg c_leg",
        "predict --leg c_legs --medium poppy_LP",
        "predict --leg c_leg --medium poppy",
        "predict --leg c_leg --medium poppy_LP --alpha 0.9",
        "predict --leg c_leg --curvature 1 --medium poppy_LP",
        "predict --leg c_leg --width 3 --medium poppy_LP",
        "predict --curvature 1.5 --medium poppy_LP",
        "predict --leg c_leg --elements 0 --medium poppy_LP",
        "predict --leg c_leg --hip 1e9 --medium poppy_LP",
        "predict --leg c_leg --model-error -1 --medium poppy_LP",
        "predict --leg c_leg --profile tables --medium poppy_LP",
        "predict --leg c_leg --profile-file field.csv",
        "predict --leg c_leg --unit mm --medium poppy_LP",
        "predict --outline scoop.csv --medium poppy_LP",
        "predict --outline none.csv --width 3 --medium poppy_LP",
        "predict --outline field.csv --width 3 --medium poppy_LP",
        "predict --mesh none.stl --unit mm --press 1 --medium poppy_LP",
        "predict --leg c_leg --medium poppy_LP --output .",
        "export",
        "export --medium poppy",
        "export --medium poppy_LP --se 0.1",
        "export --medium poppy_LP --bekker",
        "export --medium poppy_LP --output field.csv",
        "plan --target maps",
        "plan --target zeta --leg c_leg",
        "plan --count 0",
        "plan --beta 0,100",
        "plan --error-percent 0",
        "plan --turn c_legs",
        "plan --medium sand",
        "simulate --frequency 2",
        "simulate --frequency two --curvature 1 --medium poppy_LP",
        "simulate --frequency 1000 --curvature 1 --medium poppy_LP",
        "simulate --frequency 2 --curvature 2 --medium poppy_LP",
        "simulate --frequency 2 --curvature 1 --medium poppy_LP --robot none.yaml",
    ],
)
def test_words_that_do_not_fit_are_refused_and_nothing_is_written(words, folder):
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    code, out, error = answer_of(*words.split(), folder=folder)
    # a folder in place of a file is a result that cannot be written
    assert code == (3 if words.endswith("--output .") else 2), error
    assert out == ""
    assert error
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("scale --alpha 0.9", "alpha.csv"),
        ("predict --leg c_leg --medium poppy_LP", "forces.csv"),
        ("export --medium poppy_LP", "profile.json"),
        ("plan --target zeta --count 1", "plan.csv"),
    ],
)
def test_a_file_of_somebody_else_is_left_alone(words, name, folder):
    target = folder / name
    target.write_text("mine\n")
    refused(*words.split(), folder=folder)
    assert target.read_text() == "mine\n"
    assert answer_of(*words.split(), "--force", folder=folder)[0] == 0
    content = target.read_bytes()
    assert content != b"mine\n"
    # what the command itself has written is replaced unasked, by the same bytes
    assert answer_of(*words.split(), folder=folder)[0] == 0
    assert target.read_bytes() == content


@pytest.mark.parametrize("kind", ["link", "dangling", "pipe", "folder"])
def test_a_target_that_is_no_file_is_refused(kind, folder):
    target, elsewhere = folder / "alpha.csv", folder / "elsewhere.csv"
    if kind == "pipe":
        os.mkfifo(target)
    elif kind == "folder":
        target.mkdir()
    else:
        target.symlink_to(elsewhere)
        if kind == "link":
            elsewhere.write_text("mine\n")
    code, out, error = answer_of("scale", "--alpha", "0.9", "--force", folder=folder)
    assert code in (2, 3)
    assert out == ""
    assert "alpha.csv" in error
    assert elsewhere.exists() == (kind == "link")
    if kind == "link":
        assert elsewhere.read_text() == "mine\n"


@pytest.mark.parametrize(
    "words",
    [
        "init field.csv/below",
        "scale --alpha 0.9 --json --output field.csv/a.csv",
        "simulate --frequency 5 --curvature 1 --medium poppy_LP --output field.csv",
    ],
)
def test_where_nothing_can_be_written_it_is_said(words, folder):
    code, _, error = answer_of(*words.split(), folder=folder)
    assert code == 3
    assert "field.csv" in error


@pytest.mark.parametrize(
    "name",
    [
        "a b.csv",
        "ä.csv",
        "-x.csv",
        "$(touch bad).csv",
        "a;b.csv",
        "a'b\".csv",
        "a\nb.csv",
        "\x1b[31m.csv",
    ],
)
def test_a_log_may_have_any_name(name, tmp_path):
    path = MadePush().log().write(tmp_path / name)
    assert rftfit.read_log(path).size == MadePush().time_s.size
    content = json_of("inspect", path)
    assert content["file"] == path.as_posix()
    assert answer_of("inspect", path)[0] == 0
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("cell", ["1e308", "1e999", "-1e308", "9" * 400, "0x1p9999", "1_000", "٣"])
def test_huge_and_strange_numbers_in_a_log(cell, tmp_path):
    log = MadePush().log()
    rows = [*log.rows]
    rows[40] = rows[40].rsplit(",", 1)[0] + f",{cell}"
    path = log.write(tmp_path / "a.csv", rows)
    read = rftfit.read_log(path)
    assert read.size + sum(read.dropped.values()) == read.rows == len(rows)
    assert np.isfinite(read.columns["z"]).all()
    content = json_of("inspect", path)
    assert content["clocks"][0]["dropped"] == read.dropped


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00" * 500,
        bytes(range(256)) * 20,
        b"{" * 5000,
        b"PK\x03\x04" + bytes(600),
        b"\x89HDF\r\n\x1a\n" + bytes(100),
        b"TDSm" + bytes(10),
        b"#ROSBAG V2.0\n" + bytes(20),
        b"\x1f\x8b" + bytes(50),
        b"PAR1" + bytes(50),
        b"MATLAB 5.0 MAT-file" + bytes(200),
        b"LabVIEW Measurement\n" * 50,
    ],
    ids=lambda content: repr(content[:12]),
)
def test_files_that_are_no_logs(content, tmp_path):
    path = tmp_path / "log.dat"
    path.write_bytes(content)
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.read_log(path)
    assert caught.value.exit_code == 2
    assert "log.dat" in str(caught.value)
    assert "log.dat" in refused("inspect", path)


def test_a_log_without_a_row_has_a_code(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,x_mm,z_mm,angle_deg\n")
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.read_log(path)
    assert getattr(caught.value, "code") == "header_only"  # noqa: B009
    assert "log.csv" in refused("inspect", path)


def test_a_link_to_a_log_is_read_and_a_circle_is_refused(tmp_path):
    path = MadePush().log().write(tmp_path / "push.csv")
    (tmp_path / "link.csv").symlink_to(path)
    assert rftfit.read_log(tmp_path / "link.csv").size == rftfit.read_log(path).size
    (tmp_path / "circle.csv").symlink_to(tmp_path / "circle.csv")
    refused("inspect", tmp_path / "circle.csv")
    os.mkfifo(tmp_path / "pipe")
    refused("inspect", tmp_path / "pipe")


def test_errors_have_the_exit_codes_that_help_lists():
    code, out, _ = answer_of("--help")
    assert code == 0
    listed = [int(word[:-1]) for word in out.split() if word[:-1].isdigit() and word.endswith(":")]
    assert {0, 1, 2, 3, 4, 5, 130, 141} <= {*listed}
    assert rftfit.RftfitError.exit_code == 1


def test_inspect_names_gauges_in_volts_and_states_rows_a_second(tmp_path):
    rows = "".join(f"{40 * index},{0.1 * index},{3 - index}\n" for index in range(4))
    (tmp_path / "gauges.csv").write_text(f"time (ms),gauge1 (V),z (mm)\n{rows}")
    code, out, _ = answer_of("inspect", "gauges.csv", folder=tmp_path)
    assert code == 0
    assert "rate: 25 rows/s (median step 40 ms" in out
    assert "in volts: gauge1; force_log.calibration" in out
