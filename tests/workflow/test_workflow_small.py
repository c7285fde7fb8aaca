"""The workflow writes the same bytes in any circumstances.

Also tested: each stage declares the sections of the config that it reads.
"""

import contextlib
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest
from campaigns import Folder

from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign
from rftfit.workflow.job import do_job
from rftfit.workflow.records import split_inputs
from rftfit.workflow.stages import FIGURE_RULES
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
    # of a campaign without a tare, to say why the figure is not drawn
    "rftfit.figures.protocol:plot_tare": {"fit"},
    # of the intervals of several laboratory media, of which this campaign has one
    "rftfit.figures.legs:plot_forces_over_zeta": {"fit"},
}
"""Sections that are declared and that this run does not read."""


@contextlib.contextmanager
def watched(patch):
    """Collect the sections of the configuration that are read outside of `LISTS`."""
    sections_read: set[str] = set()
    deep = 0
    plain = Config.__getattribute__

    def record_read(self, name):
        if not deep and name in SECTIONS:
            sections_read.add(name)
        elif not deep and name in ("__dict__", "model_dump"):
            sections_read.update(SECTIONS)
        return plain(self, name)

    def hidden(function):
        def call(*words, **options):
            nonlocal deep
            deep += 1
            try:
                return function(*words, **options)
            finally:
                deep -= 1

        return call

    for name in LISTS:
        patch.setattr(Campaign, name, hidden(getattr(Campaign, name)))
    # a copy reads nothing: its own sections are watched as well
    patch.setattr(Config, "model_copy", hidden(Config.model_copy))
    patch.setattr(Config, "__getattribute__", record_read)
    yield sections_read


@pytest.fixture(scope="module")
def second_run(small, tmp_path_factory):
    """One process, another folder with a space and an accent, the sheet with CRLF.

    With the sections of the configuration that each stage and each figure read.
    """
    second_folder = Folder(tmp_path_factory.mktemp("again") / "été 2013 ü")
    for folder_name in ("config", "raw"):
        shutil.copytree(small.root / folder_name, second_folder.root / folder_name)
    sheet = second_folder.root / "raw" / "paper" / "runs.csv"
    # the order of its rows is that of the runs, by which a drift over the campaign is looked for
    rows = sheet.read_text("utf-8").splitlines()
    sheet.write_bytes(("\r\n".join(rows) + "\r\n").encode())
    campaign = read_states(second_folder.config).campaign
    lists = {name: getattr(campaign, name) for name in ("media_with_runs", "robot_medium")}
    assert all(lists.values())
    sections_by_stage: dict[str, set[str]] = {}
    declared: dict[str, set[str]] = {}
    with pytest.MonkeyPatch.context() as patch, watched(patch) as read:

        def do_alone(states, reads, writes):
            rule, key = job_of(split_inputs(reads)[0])
            # nothing is at hand from another job
            fresh = States(replace(campaign))
            fresh.campaign.__dict__.update(lists)
            job_state, plain = fresh.state_of(rule, key), States._make_state
            stage, _ = states.stage(rule, key)
            name = stage.run if rule in FIGURE_RULES else rule
            declared[name] = {*stage.settings}
            patch.setattr(
                States,
                "_make_state",
                lambda any_states, *job: (
                    job_state if job == (rule, key) else plain(any_states, *job)
                ),
            )
            read.clear()
            do_job(fresh, reads, writes)
            sections_by_stage.setdefault(name, set()).update(read)
            patch.setattr(States, "_make_state", plain)

        patch.setattr("campaigns.do_job", do_alone)
        second_folder.run_here(drawn=None, real_run=small)
    return second_folder, sections_by_stage, declared


def test_stages_declare_the_sections_that_they_read(second_run):
    """So that a changed value makes what it must again, and no more."""
    _, sections_by_stage, declared = second_run
    assert len(sections_by_stage) >= 35
    wrong = {}
    for name, sections_read in sections_by_stage.items():
        sections_declared = declared[name]
        if "*" in sections_declared:
            continue
        unread = UNREAD.get(name, set())
        if sections_read - sections_declared or sections_declared - sections_read != unread:
            wrong[name] = {
                "not declared": sections_read - sections_declared,
                "not read": sections_declared - sections_read - unread,
            }
    assert wrong == {}, "\n".join(f"{name}: {sections}" for name, sections in wrong.items())


def test_same_bytes_whatever_the_circumstances(small, second_run):
    """Of figures, which were put together and not drawn again, `test_report_figures` says the same."""
    assert second_run[0].digests() == small.digests()


def test_an_encoding_without_the_letters_of_the_folder(small, tmp_path):
    second_folder = Folder(tmp_path / "été")
    for folder_name in ("config", "raw"):
        shutil.copytree(small.root / folder_name, second_folder.root / folder_name)
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    tares = ("results/tares/yuma.csv", "results/tares/poppy_LP.csv")
    process = subprocess.run(
        [sys.executable, "-P", "-m", "rftfit", "run", *tares],
        cwd=second_folder.root,
        env=os.environ | ascii_only,
        capture_output=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    for name in ("traces/yuma.parquet", "tared/poppy_LP.parquet"):
        ours, expected = (folder.root / "results" / name for folder in (second_folder, small))
        assert ours.read_bytes() == expected.read_bytes()
