"""Rare errors and warnings of commands name the file or option and the cause.

Rare: pipes, locks, missing rights, files of others; no other test file causes them.
"""

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

pytestmark = pytest.mark.usefixtures("work_folder")
LEG = ("predict", "--leg", "c_leg")
"""A command line that lacks its medium."""


def test_a_crash_that_can_be_written_nowhere(monkeypatch, tmp_path):
    nowhere = tmp_path / "file"
    nowhere.touch()
    monkeypatch.setattr(pooch, "os_cache", lambda name: nowhere / name)
    monkeypatch.setattr(tempfile, "tempdir", str(nowhere))
    text = crash_message(ZeroDivisionError("no sand"), ["check"])
    assert text.startswith("Unexpected error: ZeroDivisionError: no sand")
    assert "The full report could not be written anywhere." in text


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name on this system")
def test_inspecting_a_pipe(rftfit, work_folder):
    os.mkfifo(work_folder / "pipe")
    output = rftfit("inspect", work_folder / "pipe", code=2)
    assert f"{work_folder / 'pipe'}: " in output.err


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


def test_a_test_without_its_error(rftfit, results):
    sand = results / "alpha" / "sand.csv"
    sand.write_text(re.sub(r"0\.003(?=,)", "", sand.read_text()))
    output = rftfit(
        *LEG, "--results", results, "--medium", "sand", "--profile", "generic", "--json"
    )
    assert " 271 of 271 poses: " in output.err


def test_an_interval_that_is_not_known(rftfit, work_folder):

    folder = make_campaign(work_folder / "c", {"poppy_LP": LABORATORY}, {})
    table = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    ends = [name for name in map(str, table) if "_lo_" in name or "_hi_" in name or "_se_" in name]
    table.loc[table["gamma_deg"] == 0, ends] = np.nan
    write_csv(table, folder / "alpha" / "poppy_LP.csv")
    output = rftfit(*LEG, "--results", folder, "--medium", "poppy_LP")
    assert re.search(r"^warning: .* \d+ of 271 poses: ", output.err, re.MULTILINE)


def test_a_sand_scaled_with_the_published_media(rftfit, work_folder):
    folder = make_campaign(work_folder / "c", {"sand": SAND}, {"sand": one_cell(0.7)})
    words = ("--medium", "sand", "--profile", "generic", "--output")
    rftfit(*LEG, "--results", folder, *words, "a.csv")
    rftfit(*LEG, "--alpha", "0.7", "--se", "0.003", "--profile", "generic", "--output", "b.csv")
    results_lines, alpha_lines = (
        (work_folder / name).read_text().splitlines() for name in ("a.csv", "b.csv")
    )
    assert "published Table S5, method lsq" in results_lines[3]
    assert results_lines[4:] == alpha_lines[4:]


def test_a_table_of_results_that_is_no_parquet(work_folder):

    (work_folder / "traces.parquet").write_text("no table")
    with pytest.raises(InputError, match=r"traces.parquet: .*Parquet: "):
        read_parquet(work_folder / "traces.parquet")


def refuse(*_, **__):
    raise PermissionError(errno.EACCES, "Permission denied", "raw/yuma")


def test_earlier_logs_that_cannot_be_touched(work_folder, monkeypatch):
    (work_folder / "raw").mkdir()
    (work_folder / "raw" / MARKER).write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=f"{MARKER}: cannot be read: "):
        find_earlier(work_folder / "raw", work_folder / "runs.csv")
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OutputError, match=r"a.csv: .*: Permission denied"):
        clear([work_folder / "raw" / "a.csv"])
    monkeypatch.setattr(
        os,
        "walk",
        lambda *_, onerror, **__: onerror(PermissionError(13, "Permission denied", "raw/yuma")),
    )
    with pytest.raises(InputError, match=r"raw/yuma: .*: Permission denied"):
        find_earlier(work_folder / "raw", work_folder / "runs.csv")


def test_simulating_into_a_file(rftfit, work_folder):
    (work_folder / "out").write_text("mine")
    output = rftfit(
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
    assert "out: " in output.err


def test_a_file_that_may_not_be_read(rftfit, work_folder, monkeypatch):
    (work_folder / "config.yaml").write_text("title: a\n")
    monkeypatch.setattr(Path, "read_bytes", refuse)
    output = rftfit("check", "--config", "config.yaml", code=2)
    assert re.search("config.yaml: .*: Permission denied", output.out)


def workflow(monkeypatch, root):
    """A workflow in a folder without a campaign."""

    states = SimpleNamespace(campaign=SimpleNamespace(root=root))
    monkeypatch.setattr("rftfit.workflow.run.read_states", lambda _: (states, 0))
    return Workflow(root / "config.yaml", say=print)


def test_locks(monkeypatch, work_folder):

    process_ids: list[int] = [12, 34]
    monkeypatch.setattr("rftfit.workflow.run.working_in", lambda _: process_ids)
    flow = workflow(monkeypatch, work_folder)
    with pytest.raises(WorkflowError, match=r"\(process 12, 34\)"):
        flow.unlock()
    assert "12, 34" in flow._lock_text()
    process_ids.clear()
    assert "rftfit run --unlock" in flow._lock_text()

    def refused(_words, _log, tell):
        tell("no room left")
        return 1

    monkeypatch.setattr("rftfit.workflow.run.listen", refused)
    with pytest.raises(WorkflowError, match="no room left"):
        flow.unlock()


def test_a_lock_of_a_killed_run(monkeypatch, work_folder, capsys):
    from contextlib import nullcontext

    flow = workflow(monkeypatch, work_folder)
    monkeypatch.setattr("rftfit.workflow.run.listen", lambda *_: 0)
    for certain in (False, True):
        monkeypatch.setattr("rftfit.workflow.run.stale_lock", lambda _, c=certain: nullcontext(c))
        flow._clear_stale_lock()
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
def test_files_of_others_are_left(rftfit, work_folder, words, file):
    output_path = work_folder / file
    output_path.write_text("mine")
    assert "was not written by rftfit" in rftfit(*words, code=2).err
    assert output_path.read_text() == "mine"
    rftfit(*words, "--force")
    written_bytes = output_path.read_bytes()
    # its own file it overwrites unasked, and the same numbers are the same bytes
    rftfit(*words)
    assert output_path.read_bytes() == written_bytes
    for nowhere in (work_folder, work_folder / file / "below.csv"):
        rftfit(*words, "--output", nowhere, code=3)
