"""Two media through the real Snakefile: same bytes whatever the circumstances; faults end well."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import jobs
import pytest
from campaigns import Folder

from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign
from rftfit.figures.registry import figures
from rftfit.workflow.job import do_job
from rftfit.workflow.records import split
from rftfit.workflow.stages import ALL, FIGURE_RULES, STAGES
from rftfit.workflow.state import States, job_of, read_states

pytestmark = pytest.mark.slow

SECTIONS = frozenset(Config.model_fields)
LISTS = ("runs_of", "of_role", "with_legs")
"""Which media there are decides on a task's files, which are recorded by name."""
UNREAD = {
    # where the logs lie; read while the campaign is loaded
    "ingest": {"raw"},
    # of fits by a power where stress is curved; of these media none is
    "checks": {"container", "intruders"},
    # in-air runs that no leg names, of which this campaign has none, are read there
    "ledger": {"raw", "dialect", "force_log", "motion_log", "media"},
    # of the map, on which the robot runs where the table has holes; here it has none
    "robot_intervals": {"maps"},
    "robot_motion": {"maps"},
}
"""Sections that are declared and that this run does not read."""


@contextlib.contextmanager
def watched(patch):
    """Collect the sections of the configuration that are read outside of `LISTS`."""
    found: set[str] = set()
    deep = 0
    plain = Config.__getattribute__

    def look(self, name):
        if not deep and name in SECTIONS:
            found.add(name)
        elif not deep and name in ("__dict__", "model_dump"):
            found.update(SECTIONS)
        return plain(self, name)

    def hidden(function):
        def call(*words, **more):
            nonlocal deep
            deep += 1
            try:
                return function(*words, **more)
            finally:
                deep -= 1

        return call

    for name in LISTS:
        patch.setattr(Campaign, name, hidden(getattr(Campaign, name)))
    # a copy reads nothing: its own sections are watched as well
    patch.setattr(Config, "model_copy", hidden(Config.model_copy))
    patch.setattr(Config, "__getattribute__", look)
    yield found


@pytest.fixture(scope="module")
def again(small, tmp_path_factory):
    """One process, another folder with a space and an accent, the sheet with CRLF.

    With the sections of the configuration that each stage and each figure read.
    """
    other = Folder(tmp_path_factory.mktemp("again") / "été 2013 ü")
    for part in ("config", "raw"):
        shutil.copytree(small.root / part, other.root / part)
    sheet = other.root / "raw" / "paper" / "runs.csv"
    # the order of its rows is that of the runs, by which a drift over the campaign is looked for
    rows = sheet.read_text(encoding="utf-8").splitlines()
    sheet.write_bytes(("\r\n".join(rows) + "\r\n").encode())
    campaign = read_states(other.config)[0].campaign
    lists = {name: getattr(campaign, name) for name in ("media_with_runs", "robot_medium")}
    assert all(lists.values())
    seen: dict[str, set[str]] = {}
    with pytest.MonkeyPatch.context() as patch, watched(patch) as read:

        def alone(states, reads, writes):
            rule, key = job_of(split(reads)[0])
            # nothing is at hand from another job
            fresh = States(replace(campaign))
            fresh.campaign.__dict__.update(lists)
            before, plain = fresh.of(rule, key), States.of
            name = states.stage(rule, key)[0].run if rule in FIGURE_RULES else rule
            patch.setattr(
                States, "of", lambda own, *job: before if job == (rule, key) else plain(own, *job)
            )
            read.clear()
            do_job(fresh, reads, writes)
            seen.setdefault(name, set()).update(read)
            patch.setattr(States, "of", plain)

        patch.setattr("jobs.do_job", alone)
        other.run_here(drawn=None, real_run=small)
    return other, seen


def test_stages_declare_the_sections_that_they_read(again):
    """So that a changed value makes what it must again, and no more."""
    declared = {rule: {*stage.settings} for rule, stage in STAGES.items()}
    declared |= {figure.run: {*figure.settings} for figure in figures()}
    _, seen = again
    assert len(seen) >= 35
    wrong = {}
    for name, found in seen.items():
        named = declared[name]
        if ALL in named:
            continue
        unread = UNREAD.get(name, set())
        if found - named or named - found != unread:
            wrong[name] = {"not declared": found - named, "not read": named - found - unread}
    assert wrong == {}


def test_same_bytes_whatever_the_circumstances(small, again):
    """Of png and pdf, which were not made again, the tests of the figures say the same."""
    assert again[0].digests() == small.digests()


def test_an_encoding_without_the_letters_of_the_folder(small, tmp_path):
    other = Folder(tmp_path / "été")
    for part in ("config", "raw"):
        shutil.copytree(small.root / part, other.root / part)
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    tares = ("results/tares/yuma.csv", "results/tares/poppy_LP.csv")
    done = subprocess.run(
        [sys.executable, "-P", "-m", "rftfit.cli.main", "run", *tares],
        cwd=other.root,
        env=os.environ | ascii_only,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for name in ("traces/yuma.parquet", "tared/poppy_LP.parquet"):
        ours, wanted = (folder.root / "results" / name for folder in (other, small))
        assert ours.read_bytes() == wanted.read_bytes()


def test_a_disk_that_refuses_is_told(small, tmp_path):
    """A file-size limit stops the writing of the traces as a full disk would."""
    script = (
        "import resource, signal, sys\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))\n"
        "from rftfit.workflow.job import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    root = tmp_path / "campaign"
    for part in ("config", "raw"):
        shutil.copytree(small.root / part, root / part)
    job = jobs.planned_jobs(root / "config" / "config.yaml", ["results/traces/poppy_LP.parquet"])[0]
    words = [job.reads[-1], "--reads", *job.reads, "--writes", *job.writes]
    done = subprocess.run(
        [sys.executable, "-c", script, *words],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3
    assert "poppy_LP.parquet: cannot write" in done.stderr
    assert "Traceback" not in done.stderr
    assert [path for path in (root / "results").rglob("*.*") if path.suffix != ".json"] == []
