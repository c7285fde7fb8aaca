"""`rftfit example` copies logs from a folder or a mirror only if they have the expected content.

What the example makes of them: tests/workflow/test_workflow_lacking.py.
"""

import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from shared_data import CMU_SAND, needs, reason_absent

from rftfit.cli import example
from rftfit.cli.example import SUMS, fetch_logs
from rftfit.errors import InputError, OutputError
from rftfit.store.environment import shipped

needs_data = needs(CMU_SAND)


@pytest.fixture
def mirror():
    if not CMU_SAND.is_dir():
        pytest.skip(reason_absent(CMU_SAND))

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(CMU_SAND)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    thread.join()
    server.server_close()


def test_from_a_mirror(mirror, tmp_path, capsys):
    pytest.importorskip("pooch")
    lines = (shipped("examples/cmu-sand") / SUMS).read_text().splitlines()
    (tmp_path / SUMS).write_text("".join(f"{line}\n" for line in lines if "_1.txt" in line))
    fetch_logs(tmp_path, tmp_path / "raw", mirror)
    assert (tmp_path / "raw" / "force-displacement_1.txt").stat().st_size == 80445
    assert "1 log" in capsys.readouterr().out


def test_a_mirror_with_another_file(mirror, tmp_path):
    pytest.importorskip("pooch")
    (tmp_path / SUMS).write_text(f"{'0' * 64}  force-displacement_1.txt\n")
    with pytest.raises(InputError, match=r"force-displacement_1\.txt"):
        fetch_logs(tmp_path, tmp_path / "raw", mirror)
    assert not (tmp_path / "raw" / "force-displacement_1.txt").exists()


def test_no_such_example(refusal):
    assert "did you mean 'cmu-sand'?" in refusal("example cmu_sand")


def test_a_folder_without_the_logs(refusal, tmp_path):
    assert "no force-displacement_1.bag" in refusal(
        "example cmu-sand", tmp_path / "here", "--from", tmp_path
    )


@needs_data
def test_a_log_that_is_another(refusal, tmp_path):
    (tmp_path / "here" / "raw").mkdir(parents=True)
    (tmp_path / "here" / "raw" / "force-displacement_3.txt").write_text("1,2\n")
    err = refusal("example cmu-sand", tmp_path / "here", "--from", CMU_SAND)
    assert "force-displacement_3.txt" in err
    assert "move them away" in err
    assert (tmp_path / "here" / "raw" / "force-displacement_3.txt").read_text() == "1,2\n"


def test_an_example_that_is_not_installed():
    with pytest.raises(InputError, match=r"moon.*: not there.*; install"):
        shipped("examples/moon")


def test_an_example_whose_logs_cannot_be_had(work_folder, monkeypatch):
    source, mirror = work_folder / "source", work_folder / "other"
    for folder in (source, mirror):
        folder.mkdir()
    (source / example.SUMS).write_text(f"{'0' * 64}  log.txt\n")
    (work_folder / "file").write_text("")
    with pytest.raises(OutputError, match=r"raw: .*: Not a directory"):
        example.fetch_logs(source, work_folder / "file" / "raw", str(mirror))
    (mirror / "log.txt").write_text("1,2\n")
    with pytest.raises(InputError, match=r"--from: .*log.txt"):
        example.fetch_logs(source, work_folder / "raw", str(mirror))
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(InputError, match="pip install"):
        example.fetch_logs(source, work_folder / "raw", "https://example.org")
