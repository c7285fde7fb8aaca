"""`rftfit example` brings data as they were published or nothing, and judges each published number.

An example is made here as anybody makes one: a folder with three files, no code.
"""

import contextlib
import hashlib
import http.server
import shutil
import threading
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
import yaml
from makers import answer_of, json_of, refused
from third_party import CMU_SAND, ROBOT_LEG, WHEELS_MEASURED, YADE_WHEEL, needs

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
NAMES = ["cmu-sand", "paper", "robot-leg", "wheels"]
FROM_DATA = ("example", "./mine", "out", "--from", "data")
"""Words of the command that runs the example made here with the data that lie beside it."""
SPEEDS = "run,speed_cm_s\nslow,4.0\nfast,9\n"
SETTINGS = """\
title: One push and a table
citation: made for a test
files:
  - {{name: speeds.csv, address: "{address}", sha256: {digest}, size: {size}, licence: none stated}}
given:
  alpha: {{table: raw/speeds.csv, value: speed_cm_s, factor: 0.1, key: run=fast}}
commands:
  - scale --alpha {{alpha}} --output sand.csv --force
quantities:
  alpha_z:
    title: stress over depth
    domain: plates
    ours: {{table: sand.csv, value: alpha_z_N_per_cm3, lo: alpha_z_lo_N_per_cm3, hi: alpha_z_hi_N_per_cm3}}
  from_file:
    title: stress over depth
    domain: plates
    ours:
      table: sand.csv
      value: alpha_z_N_per_cm3
      lo: alpha_z_lo_N_per_cm3
      hi: alpha_z_hi_N_per_cm3
      row: {{beta_deg: "{{beta}}", gamma_deg: "90"}}
    published: {{table: raw/speeds.csv, value: speed_cm_s, factor: 0.1, row: {{run: "{{run}}"}}}}
remarks:
  - {{code: level-plate, match: {{gamma_deg: "0"}}, comparable: false, sentence: not pushed down}}
  - {{code: far-off, match: {{beta_deg: "30"}}, sentence: known to be wrong}}
  - {{code: shallow, match: {{run: "fast"}}, of_inside: true, sentence: no test of what lies deeper}}
"""
ANSWER = """\
quantity,key,value,error,unit,where
alpha_z,beta_deg=0; gamma_deg=90,0.9,,N/cm^3,Table 1
alpha_z,beta_deg=30; gamma_deg=90,60,,N/cm^3,Table 1
alpha_z,beta_deg=0; gamma_deg=45,-30,,N/cm^3,Table 1
alpha_z,beta_deg=-30; gamma_deg=45,9,100,N/cm^3,Table 1
alpha_z,beta_deg=0; gamma_deg=0,0.1,,N/cm^3,Table 1
alpha_z,beta_deg=77; gamma_deg=90,0.1,,N/cm^3,Table 1
from_file,run=fast; beta=0,,,N/cm^3,the file
"""
VERDICTS = [
    ("inside", "in-interval"),
    ("outside", "far-off"),
    ("outside", "not-explained"),
    ("inside", "within-errors"),
    ("not comparable", "level-plate"),
    ("not comparable", "no-row"),
    ("inside", "shallow"),
]


def write_example(folder, address="https://example.invalid/speeds.csv", content=SPEEDS):
    """Make an example: three files."""
    folder.mkdir()
    data = content.encode()
    digest = hashlib.sha256(data).hexdigest()
    settings = SETTINGS.format(address=address, digest=digest, size=len(data))
    (folder / "example.yaml").write_text(settings)
    (folder / "answer.csv").write_text(ANSWER)
    (folder / "README.md").write_text("# mine\n\nMade for a test.\n")
    return folder


@pytest.fixture
def mine(tmp_path):
    write_example(tmp_path / "mine")
    (tmp_path / "data" / "below").mkdir(parents=True)
    (tmp_path / "data" / "below" / "speeds.csv").write_text(SPEEDS)
    return tmp_path


class Whole(http.server.SimpleHTTPRequestHandler):
    """A mirror."""

    def log_message(self, *_):
        pass


class Half(Whole):
    """A mirror that breaks off in the middle of a file."""

    def do_GET(self):
        data = Path(self.translate_path(self.path)).read_bytes()
        self.send_response(200)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data[: len(data) // 2])


@contextlib.contextmanager
def serving(folder, handler=Whole):
    """Serve a folder on a port of this machine."""
    server = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(handler, directory=str(folder))
    )
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_an_example_is_a_folder_with_three_files(mine):
    answer = json_of(*FROM_DATA, folder=mine)
    assert answer["example"] == "mine"
    rows = answer["rows"]
    assert [(row["verdict"], row["reason_code"]) for row in rows] == VERDICTS
    assert answer["counts"] == {"inside": 3, "outside": 2, "not comparable": 2}
    assert all(row["reason"] for row in rows)
    by_file = rows[-1]
    assert by_file["published"] == pytest.approx(0.9)
    assert by_file["from_file"] == "raw/speeds.csv"
    assert by_file["lo"] < by_file["published"] < by_file["hi"]
    written = pd.read_csv(mine / "out" / "verdicts.csv")
    assert list(written["reason_code"]) == [code for _, code in VERDICTS]
    page = (mine / "out" / "verdicts.html").read_text()
    for code in ("far-off", "level-plate", "known to be wrong"):
        assert code in page
    assert "Inside, but with a reservation, 1 row: no test of what lies deeper." in page
    assert "data:image/png" in page
    # what is there and right is not brought again: no origin is asked
    shutil.rmtree(mine / "data")
    assert json_of("example", "./mine", "out", folder=mine)["rows"] == rows


def test_the_list(tmp_path):
    listed = json_of("example", "--list", folder=tmp_path)
    assert [facts["name"] for facts in listed] == NAMES
    assert all(facts["answers"] and facts["domains"] and facts["title"] for facts in listed)
    code, out, _ = answer_of("example", "--list", folder=tmp_path)
    assert code == 0
    assert all(name in out for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_shipped_that_may_not_be(name):
    settings = yaml.safe_load((EXAMPLES / name / "example.yaml").read_text())
    allowed = {"example.yaml", "answer.csv", "README.md", "LICENSE"}
    allowed |= {file["name"] for file in settings.get("files", []) if file.get("may_be_shipped")}
    assert {path.name for path in (EXAMPLES / name).iterdir()} <= allowed


# --- What cannot be had: a message, and nothing is left half


def test_a_mirror(mine):
    pytest.importorskip("pooch")
    with serving(mine / "data" / "below") as address:
        answer = json_of("example", "./mine", "out", "--from", address, folder=mine)
    assert answer["counts"]["inside"] == 3


@pytest.mark.parametrize("fault", ["half", "other", "absent", "unreachable"])
def test_a_mirror_that_fails(fault, mine):
    pytest.importorskip("pooch")
    data = mine / "data" / "below"
    if fault == "other":
        (data / "speeds.csv").write_text(SPEEDS.replace("9", "8"))
    if fault == "absent":
        (data / "speeds.csv").unlink()
    handler = Half if fault == "half" else Whole
    with serving(data, handler) as address:
        origin = "http://127.0.0.1:9/" if fault == "unreachable" else address
        code, _, error = answer_of("example", "./mine", "out", "--from", origin, folder=mine)
    assert code == 2
    assert f"{origin.rstrip('/')}/speeds.csv" in error
    assert "--from" in error
    assert not (mine / "out").exists()


@pytest.mark.parametrize("fault", ["half", "other", "absent", "no-folder"])
def test_a_folder_that_lacks_data(fault, mine):
    file = mine / "data" / "below" / "speeds.csv"
    if fault == "half":
        file.write_text(SPEEDS[:10])
    elif fault == "other":
        file.write_text(SPEEDS.replace("9", "8"))
    elif fault == "absent":
        file.unlink()
    else:
        shutil.rmtree(mine / "data")
    error = refused(*FROM_DATA, folder=mine)
    assert "data" in error
    assert ("10 bytes" in error) == (fault == "half")
    assert not (mine / "out").exists()


def test_a_file_of_that_name_stays(mine):
    (mine / "out" / "raw").mkdir(parents=True)
    there = mine / "out" / "raw" / "speeds.csv"
    there.write_text("my own\n")
    error = refused(*FROM_DATA, folder=mine)
    assert str(Path("out") / "raw" / "speeds.csv") in error
    assert there.read_text() == "my own\n"
    assert [path.name for path in (mine / "out").rglob("*")] == ["raw", "speeds.csv"]


def test_a_folder_that_cannot_be_written(mine):
    (mine / "out").mkdir()
    (mine / "out" / "raw").write_text("no folder\n")
    code, _, error = answer_of(*FROM_DATA, folder=mine)
    assert code == 3
    assert "raw" in error
    assert [path.name for path in (mine / "out").iterdir()] == ["raw"]


def test_a_command_that_fails_leaves_no_verdict(mine):
    settings = mine / "mine" / "example.yaml"
    settings.write_text(settings.read_text().replace("scale --alpha", "scale --alphabet"))
    code, _, error = answer_of(*FROM_DATA, folder=mine)
    assert code == 4
    assert "verdicts.csv" in error
    assert not (mine / "out" / "verdicts.csv").exists()


# --- Faults of an example: all at once


def test_no_such_example(tmp_path):
    assert "'cmu-sand'" in refused("example", "cmu_sand", folder=tmp_path)
    assert "--list" in refused("example", folder=tmp_path)
    assert "example.yaml" in refused("example", "./empty", folder=tmp_path)


def test_faults_of_an_example(mine):
    folder = mine / "mine"
    (folder / "answer.csv").write_text(
        "quantity,key,value,error,unit,where\nalpha,beta_deg=0,1,,,T\nalpha_z,beta,1,,,T\n"
        "alpha_z,beta_deg=0,,,,T\nalpha_z,beta_deg=0,x,-1,,T\n"
    )
    error = refused(*FROM_DATA, folder=mine)
    for place in (
        "row 2, column quantity",
        "row 3, column key",
        "row 4, column value",
        "row 5, column value",
    ):
        assert place in error
    assert "'alpha_z'" in error
    settings = (folder / "example.yaml").read_text()
    for old, new, place in (
        ("size:", "sizes:", "sizes"),
        ("domain: plates", "domain: moons", "domain"),
        (
            "raw/speeds.csv, value: speed_cm_s, factor",
            "../speeds.csv, value: speed_cm_s, factor",
            "table",
        ),
        ("commands:\n  - scale", "note: >-\n  scale", "commands"),
        ("address:", "#", ""),
    ):
        assert old in settings
        (folder / "example.yaml").write_text(settings.replace(old, new, 1))
        error = refused(*FROM_DATA, folder=mine)
        assert "example.yaml" in error
        assert place in error
    assert not (mine / "out").exists()
    (folder / "README.md").unlink()
    assert "README.md" in refused("example", "./mine", "out", folder=mine)


def test_an_example_is_not_run_in_its_own_folder(mine):
    refused("example", "./mine", "mine", "--from", "data", folder=mine)
    assert sorted(path.name for path in (mine / "mine").iterdir()) == sorted(
        ["example.yaml", "answer.csv", "README.md"]
    )


# --- The examples of the program


def leg_log(slopes, rows=1100):
    """A log as the robot's leg wrote it: depth (m) and force (N) of two packings, no names."""
    lines = []
    for row in range(rows):
        start_m = -0.009525
        depth_m = row * 1e-4
        depth_cm = 100 * (depth_m + start_m)
        forces = [-max(0.0, slope * depth_cm) * 1.27**2 for slope in slopes]
        wave = 0.02 * (row % 7 - 3)
        lines.append(f"{depth_m:.6f},{forces[0] + wave:.5f},,{depth_m:.6f},{forces[1] - wave:.5f}")
    return "\n".join(lines) + "\n"


@pytest.mark.slow
def test_windows_of_depth(tmp_path):
    """A log of the same layout with known slopes: in every window both lie inside."""
    shutil.copytree(EXAMPLES / "robot-leg", tmp_path / "leg")
    log = leg_log((0.5, 0.8))
    settings = yaml.safe_load((tmp_path / "leg" / "example.yaml").read_text())
    settings["files"][0] |= {
        "sha256": hashlib.sha256(log.encode()).hexdigest(),
        "size": len(log.encode()),
    }
    (tmp_path / "leg" / "example.yaml").write_text(yaml.safe_dump(settings))
    answer = (tmp_path / "leg" / "answer.csv").read_text()
    (tmp_path / "leg" / "answer.csv").write_text(
        answer.replace("0.545", "0.5").replace("0.896", "8")
    )
    (tmp_path / "VolumeFracTrials.csv").write_text(log)
    loose, dense = json_of("example", "./leg", "out", "--from", ".", folder=tmp_path)["rows"]
    assert (loose["verdict"], dense["verdict"]) == ("inside", "outside")
    assert loose["windows"] == loose["windows_inside"] == dense["windows"] == 66
    assert dense["windows_inside"] == 0
    assert loose["ours"] == pytest.approx(0.5, rel=0.02)
    assert dense["ours"] == pytest.approx(0.8, rel=0.02)


@needs(ROBOT_LEG)
@pytest.mark.slow
def test_the_legs_answer(tmp_path):
    rows = json_of("example", "robot-leg", "--from", ROBOT_LEG, folder=tmp_path)["rows"]
    for row, published in zip(rows, (0.545, 0.896), strict=True):
        assert row["published"] == published
        assert row["lo"] < published < row["hi"]
        assert row["verdict"] == "inside"
        assert row["windows"] == 66
        # of the windows alone: some miss it, and the row says how many
        assert 0.6 < row["windows_inside"] / 66 < 0.9
    assert (tmp_path / "robot-leg" / "results" / "report.html").is_file()


@needs(WHEELS_MEASURED)
def test_answers_of_the_wheels_are_the_measured_ones():
    measured = pd.read_csv(WHEELS_MEASURED / "single_wheel_experiments.csv")
    answer = pd.read_csv(EXAMPLES / "wheels" / "answer.csv")
    sources = {"ding": "ding2011", "kls1": "wang_han_2016_kls1", "rashid1": "hurrell2025_rashid1"}
    columns = {"drawbar": ("meas_drawbar_pull_n", 1), "torque": ("meas_torque_nm", 1)}
    columns["sinkage"] = ("meas_sinkage_m", 100)
    stated = answer[answer["quantity"].isin(columns)]
    numbers = measured[[name for name, _ in columns.values()]]
    assert len(stated) == numbers.notna().sum().sum()
    for quantity, key, value in stated[["quantity", "key", "value"]].itertuples(index=False):
        rig, slip = (pair.split("=")[1] for pair in key.split(";"))
        name, shape = rig.split("_")
        rows = measured[
            (measured["source"] == sources[name])
            & ((measured["grouser_count"] > 0) == (shape == "lugged"))
            & (measured["slip"] == float(slip))
        ]
        column, factor = columns[quantity]
        assert len(rows) == 1
        assert value == pytest.approx(factor * rows.iloc[0][column])


@pytest.mark.parametrize(
    ("name", "folder"), [("cmu-sand", CMU_SAND), ("robot-leg", ROBOT_LEG), ("wheels", YADE_WHEEL)]
)
def test_digests_are_those_of_the_data(name, folder):
    if not folder.exists():
        pytest.skip(needs(folder).kwargs["reason"])
    files = yaml.safe_load((EXAMPLES / name / "example.yaml").read_text())["files"]
    for file in files:
        path = EXAMPLES / name / file["name"] if "address" not in file else folder / file["name"]
        assert path.stat().st_size == file["size"]
        assert hashlib.sha256(path.read_bytes()).hexdigest() == file["sha256"]


def test_numbers_of_the_readme_are_those_of_the_page():
    page = (ROOT / "docs" / "validation.md").read_text("utf-8")
    readme = (ROOT / "README.md").read_text("utf-8")
    words = page.partition("**")[2].partition("**")[0]
    numbers = [word for word in words.split() if word.isdigit()]
    sentence = next(line for line in readme.splitlines() if "docs/validation.md" in line)
    assert [word for word in sentence.replace(",", " ").split() if word.isdigit()] == numbers
    assert readme.index("docs/validation.md") < len(readme) / 3
