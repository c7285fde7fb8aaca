"""Help, exit codes, usage errors, crashes, pipes, start-up."""

import os
import subprocess
import sys
import tempfile

import pytest

import rftfit as package
from rftfit.cli import exit_codes, main
from rftfit.cli.main import CRASH_FILE
from rftfit.errors import OutputError, RftfitError

COMMANDS = ("init", "check", "inspect", "reenact", "run", "scale")
HEAVY = ("pandas", "matplotlib", "snakemake", "pyarrow", "pydantic", "scipy.stats", "numba")


def start(*words, cwd=None):
    command = [sys.executable, "-m", "rftfit.cli.main", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


def test_version(rftfit):
    said = rftfit("--version")
    assert (said.code, said.out) == (0, f"rftfit {package.__version__}\n")


@pytest.mark.parametrize("words", [[], ["--help"], ["-h"]])
def test_help_lists_commands_and_exit_codes(rftfit, words):
    said = rftfit(*words)
    assert said.code == 0
    assert [name for name in COMMANDS if name not in said.out] == []
    for code, meaning in exit_codes.MEANINGS.items():
        assert f"{code}: {meaning}" in said.out
    assert "Example" in said.out


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_each_command_has_an_example(rftfit, name):
    said = rftfit(name, "--help")
    assert said.code == 0
    assert f"Example: rftfit {name} " in said.out


def test_exit_codes_are_those_of_the_errors():
    codes = [getattr(exit_codes, name) for name in dir(exit_codes) if name.isupper()]
    numbers = [code for code in codes if isinstance(code, int)]
    assert sorted(numbers) == sorted(exit_codes.MEANINGS) == [0, 1, 2, 3, 4, 5, 130, 141]


@pytest.mark.parametrize("words", [["chekc"], ["check", "--strickt"], ["inspect"], ["init"]])
def test_usage_errors(rftfit, words):
    said = rftfit(*words)
    assert said.code == exit_codes.INPUT_NOT_VALID
    assert "Usage: rftfit" in said.err
    assert "Error: " in said.err


def fail_with(monkeypatch, error):
    def fail(*_):
        raise error

    monkeypatch.setattr("rftfit.workflow.check.check_all", fail)


@pytest.mark.parametrize("error", [RftfitError("one"), OutputError("three")])
def test_errors_of_the_program(rftfit, monkeypatch, error):
    fail_with(monkeypatch, error)
    said = rftfit("check")
    assert (said.code, said.out, said.err) == (error.exit_code, "", f"rftfit: {error}\n")


def test_crash(rftfit, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    fail_with(monkeypatch, ZeroDivisionError("no sand\nleft"))
    said = rftfit("check", "--strict")
    assert said.code == exit_codes.UNEXPECTED
    assert "ZeroDivisionError: no sand left" in said.err
    assert str(tmp_path / CRASH_FILE) in said.err
    report = (tmp_path / CRASH_FILE).read_text(encoding="utf-8")
    assert "Traceback (most recent call last)" in report
    assert "command: rftfit check --strict" in report
    assert package.__version__ in report


def test_crash_where_the_folder_cannot_be_written(rftfit, monkeypatch, tmp_path):
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    # a folder of the report's name: cannot be written, whoever runs this
    (here / CRASH_FILE).mkdir(parents=True)
    elsewhere.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setattr(tempfile, "tempdir", str(elsewhere))
    fail_with(monkeypatch, ZeroDivisionError())
    said = rftfit("check")
    assert said.code == exit_codes.UNEXPECTED
    assert str(elsewhere / CRASH_FILE) in said.err
    assert (elsewhere / CRASH_FILE).is_file()


@pytest.mark.parametrize(("text", "shown"), [("", main.STOPPED), ("Kept.", "Kept.")])
def test_interrupt(rftfit, monkeypatch, text, shown):
    fail_with(monkeypatch, KeyboardInterrupt(text))
    said = rftfit("check")
    assert (said.code, said.err) == (exit_codes.INTERRUPTED, f"{shown}\n")


@pytest.mark.skipif(os.name != "posix", reason="pipes close without an error here")
def test_reader_that_stops_reading():
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "rftfit.cli.main", "reenact", "--list-faults"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (exit_codes.PIPE_CLOSED, b"")


def test_commands_load_nothing_heavy():
    code = "import sys, rftfit.cli.app; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert "rftfit.cli.scale" in loaded
    assert [name for name in HEAVY if name in loaded] == []


def cpu_of_children():
    """Processor time of all processes that were started and have ended, s."""
    now = os.times()
    return now.children_user + now.children_system


def test_scale_starts_quickly(tmp_path):
    """Within 2.5 times the processor time in which Python imports the libraries that it needs."""
    own, libraries = [], []
    for _ in range(3):
        began = cpu_of_children()
        done = start("scale", "--alpha", "0.9", cwd=tmp_path)
        own.append(cpu_of_children() - began)
        assert done.returncode == 0, done.stderr
        began = cpu_of_children()
        subprocess.run([sys.executable, "-c", "import pandas, yaml, pydantic, typer"], check=True)
        libraries.append(cpu_of_children() - began)
    # the least of three: other tests run beside this one
    assert min(own) < 2.5 * min(libraries)
