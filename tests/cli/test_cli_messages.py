"""Messages of the commands that no other test calls forth, each with what it has to say."""

import errno
import os
import re
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pooch
import pytest
from light_campaign import LABORATORY, SAND, alpha_frame, make_campaign, one_cell

from rftfit import reference
from rftfit.cli import example
from rftfit.cli.main import crash_message
from rftfit.errors import InputError, OutputError, WorkflowError
from rftfit.lab.marker import MARKER, clear, find_earlier
from rftfit.store import read_parquet, write_csv
from rftfit.store.environment import shipped
from rftfit.workflow.run import Workflow

pytestmark = pytest.mark.usefixtures("here")
LEG = ("predict", "--leg", "c_leg")


def test_a_crash_that_can_be_written_nowhere(monkeypatch, tmp_path):
    nowhere = tmp_path / "file"
    nowhere.touch()
    monkeypatch.setattr(pooch, "os_cache", lambda name: nowhere / name)
    monkeypatch.setattr(tempfile, "tempdir", str(nowhere))
    said = crash_message(ZeroDivisionError("no sand"), ["check"])
    assert said.startswith("Unexpected error: ZeroDivisionError: no sand")
    assert "The full report could not be written anywhere." in said


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name on this system")
def test_inspecting_a_pipe(rftfit, here):
    os.mkfifo(here / "pipe")
    said = rftfit("inspect", here / "pipe", code=2)
    assert "pipe: this is a pipe or device; name a log, a regular file" in said.err


def test_an_example_that_is_not_installed():
    with pytest.raises(InputError, match=r"moon.*: not there.*; install"):
        shipped("examples/moon")


def test_an_example_whose_logs_cannot_be_had(here, monkeypatch):
    source, other = here / "source", here / "other"
    for folder in (source, other):
        folder.mkdir()
    (source / example.SUMS).write_text(f"{'0' * 64}  log.txt\n")
    (here / "file").write_text("")
    with pytest.raises(OutputError, match="raw: cannot be made: Not a directory"):
        example.fetch_logs(source, here / "file" / "raw", str(other))
    (other / "log.txt").write_text("1,2\n")
    with pytest.raises(InputError, match=r"--from: .*log.txt is not the log of that name"):
        example.fetch_logs(source, here / "raw", str(other))
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(InputError, match="downloaded with the package pooch; install it: pip"):
        example.fetch_logs(source, here / "raw", "https://example.org")


def test_a_test_without_its_error(rftfit, results):
    sand = results / "alpha" / "sand.csv"
    sand.write_text(re.sub(r"0\.003(?=,)", "", sand.read_text()))
    said = rftfit(*LEG, "--results", results, "--medium", "sand", "--profile", "generic", "--json")
    assert "no interval in 271 of 271 poses: no error of alpha is known there" in said.err


def test_an_interval_that_is_not_known(rftfit, here):

    folder = make_campaign(here / "c", {"poppy_LP": LABORATORY}, {})
    table = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    ends = [name for name in map(str, table) if "_lo_" in name or "_hi_" in name or "_se_" in name]
    table.loc[table["gamma_deg"] == 0, ends] = np.nan
    write_csv(table, folder / "alpha" / "poppy_LP.csv")
    said = rftfit(*LEG, "--results", folder, "--medium", "poppy_LP")
    assert re.search(
        r"warning: no interval in \d+ of \d+ poses: no error of alpha is known there", said.err
    )


def test_a_sand_scaled_with_the_published_media(rftfit, here):
    folder = make_campaign(here / "c", {"sand": SAND}, {"sand": one_cell(0.7)})
    words = ("--medium", "sand", "--profile", "generic", "--output")
    rftfit(*LEG, "--results", folder, *words, "a.csv")
    rftfit(*LEG, "--alpha", "0.7", "--se", "0.003", "--profile", "generic", "--output", "b.csv")
    one, other = ((here / name).read_text().splitlines() for name in ("a.csv", "b.csv"))
    assert "published Table S5, method lsq" in one[3]
    assert one[4:] == other[4:]


def test_a_table_of_results_that_is_no_parquet(here):

    (here / "traces.parquet").write_text("no table")
    with pytest.raises(InputError, match=r"traces.parquet: cannot be read as Parquet: "):
        read_parquet(here / "traces.parquet")


def refuse(*_, **__):
    raise PermissionError(errno.EACCES, "Permission denied", "raw/yuma")


def test_earlier_logs_that_cannot_be_touched(here, monkeypatch):
    (here / "raw").mkdir()
    (here / "raw" / MARKER).write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=f"{MARKER}: cannot be read: "):
        find_earlier(here / "raw", here / "runs.csv")
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OutputError, match=r"a.csv: cannot be removed: Permission denied"):
        clear([here / "raw" / "a.csv"])
    monkeypatch.setattr(
        os,
        "walk",
        lambda *_, onerror, **__: onerror(PermissionError(13, "Permission denied", "raw/yuma")),
    )
    with pytest.raises(InputError, match="raw/yuma: cannot be looked into: Permission denied"):
        find_earlier(here / "raw", here / "runs.csv")


def test_simulating_into_a_file(rftfit, here):
    (here / "out").write_text("mine")
    said = rftfit(
        "simulate",
        "--frequency",
        "5",
        "--curvature",
        "1",
        "--medium",
        "poppy_LP",
        "--profile",
        "fourier",
        "--output",
        "out",
        code=3,
    )
    assert "out: this is a file; name a folder for the results" in said.err


def test_a_file_that_may_not_be_read(rftfit, here, monkeypatch):
    (here / "config.yaml").write_text("title: a\n")
    monkeypatch.setattr(Path, "read_bytes", refuse)
    said = rftfit("check", "--config", "config.yaml", code=2)
    assert "config.yaml: the file cannot be read: Permission denied" in said.out


def workflow(monkeypatch, root):
    """A workflow in a folder without a campaign."""

    states = SimpleNamespace(campaign=SimpleNamespace(root=root))
    monkeypatch.setattr("rftfit.workflow.run.read_states", lambda _: (states, 0))
    return Workflow(root / "config.yaml", say=print)


def test_locks(monkeypatch, here):

    others: list[int] = [12, 34]
    monkeypatch.setattr("rftfit.workflow.run.working_in", lambda _: others)
    own = workflow(monkeypatch, here)
    with pytest.raises(WorkflowError, match=r"\(process 12, 34\)"):
        own.unlock()
    assert "12, 34" in own._lock_text()
    others.clear()
    assert "rftfit run --unlock" in own._lock_text()

    def refused(_words, _log, tell):
        tell("no room left")
        return 1

    monkeypatch.setattr("rftfit.workflow.run.listen", refused)
    with pytest.raises(WorkflowError, match="no room left"):
        own.unlock()


def test_a_lock_of_a_killed_run(monkeypatch, here, capsys):
    from contextlib import nullcontext

    own = workflow(monkeypatch, here)
    monkeypatch.setattr("rftfit.workflow.run.listen", lambda *_: 0)
    for certain in (False, True):
        monkeypatch.setattr("rftfit.workflow.run.stale_lock", lambda _, c=certain: nullcontext(c))
        own._clear_stale_lock()
        assert bool(capsys.readouterr().out) == certain


@pytest.mark.parametrize(
    ("words", "file"),
    [
        (("scale", "--alpha", "0.9"), "alpha.csv"),
        (("predict", *LEG[1:], "--medium", "poppy_LP"), "forces.csv"),
        (("plan", "--count", "1"), "plan.csv"),
        (("export", "--medium", "poppy_LP"), "profile.json"),
    ],
)
def test_files_of_others_are_left(rftfit, here, words, file):
    mine = here / file
    mine.write_text("mine")
    assert "was not written by rftfit" in rftfit(*words, code=2).err
    assert mine.read_text() == "mine"
    rftfit(*words, "--force")
    first = mine.read_bytes()
    # its own file it overwrites unasked, and the same numbers are the same bytes
    rftfit(*words)
    assert mine.read_bytes() == first
    for nowhere in (here, here / file / "below.csv"):
        rftfit(*words, "--output", nowhere, code=3)
