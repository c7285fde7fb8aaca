"""What several rooms' tests share."""

import gc
import importlib
import os
import pkgutil
import shutil
import tempfile
from collections import Counter
from pathlib import Path

MEMORY = Path("/dev/shm")
"""Where Linux keeps files in memory: what tests write goes there if there is room, since a disk may delete slowly."""

if MEMORY.is_dir() and os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > 4 * 2**30:
    os.environ["TMPDIR"] = str(MEMORY)
    tempfile.tempdir = str(MEMORY)

# two workers share two processors: threads of linear algebra would wait for one another
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# tests and figures are many objects that live long: to look for garbage among them takes a tenth of the time
gc.set_threshold(50_000, 20, 50)

import paper
import pytest
import seeds
from campaigns import Folder
from golden_campaigns import SMALL, GoldenCampaign
from once import make_once
from unit_push import unit_push_once

import rftfit

__all__ = ["unit_push_once"]
"""Fixtures of helpers that all tests have."""

LONGEST = (
    "test_trust_stranger.py",
    "test_workflow_whole.py",
    "test_golden.py",
    "test_stages_real_logs.py",
    "test_validate_legs.py",
)
"""The first one makes the small campaign; so long the second one measures the whole demonstration."""


def pytest_addoption(parser):
    """Tests of statistics make a few random campaigns, or all of them."""
    parser.addoption("--all-seeds", action="store_true", help="all seeds of tests of statistics")


def pytest_configure(config):
    """Tell it before the tests are read, also in a process of pytest-xdist."""
    seeds.ALL = config.getoption("--all-seeds")


def pytest_collection_modifyitems(items):
    """Begin with whole workflows: one of them at the end would leave the other processor idle."""
    places = {name: place for place, name in enumerate(LONGEST)}
    items.sort(
        key=lambda item: (
            places.get(item.path.name, len(places)),
            item.get_closest_marker("slow") is None,
        )
    )


def pytest_collection_finish():
    """Import what the whole suite needs, so that code edited meanwhile changes no test; keep it from the collector."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        for module in pkgutil.walk_packages(rftfit.__path__, "rftfit."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    gc.freeze()


def pytest_terminal_summary(terminalreporter):
    """Count the skipped tests by their reason."""
    reasons = [report.longrepr[2] for report in terminalreporter.stats.get("skipped", [])]
    if reasons:
        terminalreporter.section("skipped tests by reason")
    for reason, test_count in Counter(reasons).most_common():
        terminalreporter.write_line(f"{test_count:5}  {reason.removeprefix('Skipped: ')}")


@pytest.fixture(scope="session")
def paper_config():
    """The configuration of the demonstration campaign."""
    return paper.paper_config()


@pytest.fixture(scope="session")
def small_made(tmp_path_factory):
    """Few directions in loose poppy seeds, its legs and robot, and one sand, run by the workflow: a golden campaign.

    One worker makes it, the others wait; nobody changes it.
    """
    campaign = GoldenCampaign(SMALL)

    def make(root):
        campaign.write(root)
        digests_before = Folder(root).raw_digests()
        campaign.run_commands(root)
        assert Folder(root).raw_digests() == digests_before, "the workflow wrote into raw/"

    return Folder(make_once(tmp_path_factory, "small", make))


@pytest.fixture(scope="module")
def small(small_made, tmp_path_factory):
    """A copy of it for the tests of a module."""
    root = tmp_path_factory.mktemp("small") / "campaign"
    shutil.copytree(small_made.root, root)
    return Folder(root)
