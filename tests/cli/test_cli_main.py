"""The command returns the documented exit codes and loads no heavy library."""

import os
import subprocess
import sys
import tempfile

import pooch
import pytest

import rftfit as package
from rftfit import RftfitError

HEAVY = ("pandas", "matplotlib", "snakemake", "pyarrow", "pydantic", "scipy.stats", "numba")
"""Libraries that take long to load."""
UNEXPECTED, INTERRUPTED, PIPE_CLOSED = 1, 130, 141
STOPPED = "Stopped. Files are written whole or not at all; to go on, give the same command again."


def fail_with(monkeypatch, error):
    def fail(*_, **_options):
        raise error

    monkeypatch.setattr("rftfit.cli.check.check_all", fail)


def test_an_error_of_the_program(rftfit, monkeypatch):
    fail_with(monkeypatch, RftfitError("one"))
    assert rftfit("check", code=RftfitError.exit_code) == ("", "rftfit: one\n")


def test_crash(rftfit, monkeypatch, tmp_path):
    current_folder, temp_folder = tmp_path / "here", tmp_path / "elsewhere"
    temp_folder.mkdir()
    current_folder.mkdir()
    monkeypatch.chdir(current_folder)
    cache = tmp_path / "cache"
    monkeypatch.setattr(pooch, "os_cache", lambda name: cache / name)
    monkeypatch.setattr(tempfile, "tempdir", str(temp_folder))
    (current_folder / "config").mkdir()
    (current_folder / "config" / "config.yaml").touch()
    # a stranger's text must not stand on a line of its own
    fail_with(monkeypatch, ZeroDivisionError("no sand\nimport os"))
    output = rftfit("check --strict", code=UNEXPECTED)
    assert "ZeroDivisionError: no sand import os" in output.err
    (path,) = (cache / "rftfit" / "crashes").iterdir()
    assert str(path) in output.err
    assert path.name.startswith("rftfit-crash-")
    if os.name == "posix":
        assert path.stat().st_mode & 0o077 == path.parent.stat().st_mode & 0o077 == 0
    report = path.read_text("utf-8")
    for text in (
        "Traceback (most recent call last)",
        "command: rftfit check --strict",
        package.__version__,
        "ZeroDivisionError: 'no sand\\nimport os'",
    ):
        assert text in report
    assert not [line for line in report.splitlines() if line.startswith("import")]
    # nothing is written into the current folder, which a stranger may have filled with links
    assert [*current_folder.iterdir()] == [current_folder / "config"]
    monkeypatch.setattr(pooch, "os_cache", lambda _: current_folder.joinpath("\0"))
    assert str(temp_folder / "rftfit-crash-") in rftfit("check", code=UNEXPECTED).err
    assert len([*temp_folder.iterdir()]) == 1


@pytest.mark.parametrize(("text", "message"), [("", STOPPED), ("Kept.", "Kept.")])
def test_interrupt(rftfit, monkeypatch, text, message):
    fail_with(monkeypatch, KeyboardInterrupt(text))
    assert rftfit("check", code=INTERRUPTED).err == f"{message}\n"


@pytest.mark.skipif(os.name != "posix", reason="pipes close without an error here")
def test_reader_that_stops_reading():
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "rftfit", "reenact", "--list-faults"]
    process = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (process.returncode, process.stderr) == (PIPE_CLOSED, b"")


def test_commands_load_nothing_heavy():
    code = "import sys, rftfit.cli.app; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert "rftfit.cli.scale" in loaded
    assert [name for name in HEAVY if name in loaded] == []


def test_one_push_is_scaled_without_a_library_of_tables(tmp_path):
    script = (
        "import sys; from rftfit.cli.main import main; main(['scale', '--alpha', '0.9']); "
        "print('pandas.core' in sys.modules, 'numba' in sys.modules); "
        "import pandas; print(pandas.DataFrame({'push': [1, 2]}).shape)"
    )
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path)
    assert run.stdout.splitlines()[-2:] == ["False False", "(2, 1)"]


def test_a_crash_that_can_be_written_nowhere(rftfit, monkeypatch, tmp_path):
    nowhere = tmp_path / "file"
    nowhere.touch()
    monkeypatch.setattr(pooch, "os_cache", lambda name: nowhere / name)
    fail_with(monkeypatch, ZeroDivisionError("no sand"))
    with monkeypatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(nowhere))
        text = rftfit("check", code=UNEXPECTED).err
    assert "Unexpected error: ZeroDivisionError: no sand" in text
    assert "The full report could not be written anywhere." in text


def test_a_command_asks_for_one_thread_before_numpy_is_imported():
    script = "import os, sys, rftfit.cli.main; print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in sys.modules)"
    command = [sys.executable, "-c", script]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "4"}
    run = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    assert run.stdout.split() == ["1", "False"]
