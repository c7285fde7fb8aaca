"""`rftfit example`: the nine sand runs from a folder and from a mirror, and what it says of bad ones."""

import shutil
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from unittest.mock import patch

import pandas as pd
import pytest
from dictionary_check import columns_in, undescribed, wrong_kind

from rftfit.cli.example import EXAMPLES, SUMS, example, fetch_logs, own_files
from rftfit.errors import InputError
from rftfit.figures import style
from rftfit.outputs.dictionary import describe, outputs
from rftfit.store import write_bytes

DATA = Path(__file__).parents[3] / "shared" / "data" / "cmu-sand"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="cmu-sand of ../shared/data is absent")


@pytest.fixture(scope="module", autouse=True)
def one_format():
    """Figures are drawn once, as svg: the tests of figures write all formats."""

    def save(figure, base):
        write_bytes(base.with_name(f"{base.name}.svg"), style.content(figure, "svg"))

    with patch.object(style, "save", save):
        yield


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The whole example, once; by the very functions that the command calls."""
    if not DATA.is_dir():
        pytest.skip("cmu-sand of ../shared/data is absent")
    folder = tmp_path_factory.mktemp("with a blank") / "cmu sand"
    example("cmu-sand", folder, str(DATA))
    return folder


@pytest.fixture
def mirror():
    if not DATA.is_dir():
        pytest.skip("cmu-sand of ../shared/data is absent")

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(DATA)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    thread.join()
    server.server_close()


def test_every_column_is_in_the_dictionary(done):
    (plates,) = (one for one in outputs() if one.stage == "rftfit example")
    known = {name: describe(f"results/{name}/sand.csv") for name in ("runs", "fits")}
    for name, output in {
        **known,
        "ledger": describe("results/ledger.csv"),
        "plates": plates,
    }.items():
        assert output is not None
        names, table = columns_in(done / "results" / f"{name}.csv")
        assert undescribed(output, names) == []
        assert table is not None
        assert wrong_kind(output, table) == []


def test_every_clock_and_every_surface_is_found(done):
    runs = pd.read_csv(done / "results" / "runs.csv")
    assert len(runs) == 9
    assert (runs["status"] == "read").all()
    # five hours behind, as Pittsburgh is in January, and the rest of a tenth of a second
    assert (runs["clock_hours"] == -5).all()
    assert runs["clock_rest_s"].between(-0.05, 0.15).all()
    assert (runs["clock_se_s"] < 0.1).all()
    assert (runs["clock_explained"] > 0.999).all()
    # the offsets of one afternoon agree within their own errors
    apart = (runs["clock_rest_s"] - runs["clock_rest_s"].mean()) / runs["clock_se_s"]
    assert (apart.abs() < 3.5).all()
    # what the people who recorded it typed in by hand lies between -8.55 and -9.68 mm
    assert runs["surface_z_mm"].between(-10.2, -8.9).all()
    assert (runs["surface_se_mm"] < 0.5).all()


def test_repeated_runs_agree_within_ten_percent(done):
    plates = pd.read_csv(done / "results" / "plates.csv").set_index("plate")
    assert list(plates.index) == ["disc_60", "disc_80", "disc_100"]
    assert (plates["runs"] == 3).all()
    assert (plates["largest_deviation_percent"] < 10).all()
    inside = (plates["alpha_z_lo_N_per_cm3"] < plates["alpha_z_N_per_cm3"]) & (
        plates["alpha_z_N_per_cm3"] < plates["alpha_z_hi_N_per_cm3"]
    )
    assert inside.all()
    assert plates["alpha_z_N_per_cm3"].is_monotonic_increasing
    assert (plates["depth_exponent_lo"] > 1).all()


def test_the_summary_says_what_the_tables_hold(done):
    text = (done / "results" / "summary.txt").read_text(encoding="utf-8")
    plates = pd.read_csv(done / "results" / "plates.csv")
    for value in (*plates["alpha_z_N_per_cm3"], *plates["zeta"]):
        assert f"{value:.3f}" in text
    assert "Not linear: with every plate" in text
    assert "c_leg" in text
    forces = pd.read_csv(done / "results" / "forces.csv")
    peak = forces.query("plate == 'disc_60' and leg == 'c_leg'")["force_z_N"].max()
    assert f"{peak:.1f}" in text
    assert (forces["force_z_lo_N"] <= forces["force_z_hi_N"] + 1e-9).all()


def test_every_row_is_in_the_ledger(done):
    ledger = pd.read_csv(done / "results" / "ledger.csv")
    rows = ledger.groupby("file")["rows"].sum()
    assert rows["force-displacement_1.bag"] == 3004
    assert rows["force-displacement_1.txt"] == 1520
    assert len(rows) == 18


def test_again_gives_the_same_bytes(done, capsys):
    before = {path: path.read_bytes() for path in (done / "results").iterdir()}
    assert {path.suffix for path in before} == {".csv", ".txt", ".svg"}
    example("cmu-sand", done, "/nowhere")
    assert "All 18 logs are there" in capsys.readouterr().out
    assert all(path.read_bytes() == content for path, content in before.items())


def test_from_a_mirror(mirror, tmp_path, capsys):
    pytest.importorskip("pooch")
    source = own_files("cmu-sand")
    short = tmp_path / "example"
    shutil.copytree(source, short)
    lines = (short / SUMS).read_text().splitlines(keepends=True)
    (short / SUMS).write_text("".join(line for line in lines if "_1.txt" in line))
    fetch_logs(EXAMPLES["cmu-sand"], short, tmp_path / "raw", mirror)
    assert (tmp_path / "raw" / "force-displacement_1.txt").stat().st_size == 80445
    assert "1 log" in capsys.readouterr().out


def test_a_mirror_with_another_file(mirror, tmp_path):
    pytest.importorskip("pooch")
    (tmp_path / "example").mkdir()
    (tmp_path / "example" / SUMS).write_text(f"{'0' * 64}  force-displacement_1.txt\n")
    with pytest.raises(InputError, match="cannot be downloaded"):
        fetch_logs(EXAMPLES["cmu-sand"], tmp_path / "example", tmp_path / "raw", mirror)
    assert not (tmp_path / "raw" / "force-displacement_1.txt").exists()


def test_no_such_example(rftfit):
    said = rftfit("example", "cmu_sand")
    assert said.code != 0
    assert "did you mean 'cmu-sand'?" in said.err


def test_a_folder_without_the_logs(rftfit, tmp_path):
    said = rftfit("example", "cmu-sand", tmp_path / "here", "--from", tmp_path)
    assert said.code != 0
    assert "no force-displacement_1.bag" in said.err


@needs_data
def test_a_log_that_is_another(rftfit, tmp_path):
    (tmp_path / "here" / "raw").mkdir(parents=True)
    (tmp_path / "here" / "raw" / "force-displacement_3.txt").write_text("1,2\n")
    said = rftfit("example", "cmu-sand", tmp_path / "here", "--from", DATA)
    assert said.code != 0
    assert "force-displacement_3.txt" in said.err
    assert "move them away" in said.err
    assert (tmp_path / "here" / "raw" / "force-displacement_3.txt").read_text() == "1,2\n"
