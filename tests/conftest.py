"""What several rooms' tests share."""

import gc
import importlib
import os
import pkgutil
import shutil
import tempfile
from collections import Counter
from pathlib import Path

MEMORY = Path("/dev/shm")  # noqa: S108 (folders in it have drawn names)
"""Where Linux keeps files in memory: what tests write goes there if there is room, since a disk may delete slowly."""

if MEMORY.is_dir() and os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > 4 * 2**30:
    os.environ["TMPDIR"] = str(MEMORY)
    tempfile.tempdir = str(MEMORY)

# two workers share two processors: threads of linear algebra would wait for one another
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# tests and figures are many objects that live long: to look for garbage among them takes a tenth of the time
gc.set_threshold(50_000, 20, 50)

import hypothesis
import pytest
import seeds
from makers import SMALL, GoldenCampaign
from waiting import make_once

import rftfit

# a test is judged by what it finds: another program on the processors may make an example slow
hypothesis.settings.register_profile("any-time", deadline=None)
hypothesis.settings.load_profile("any-time")

LONGEST = (
    "test_trust_stranger.py",
    "test_workflow_whole.py",
    "test_golden.py",
    "test_stages_real_logs.py",
    "test_validate_legs.py",
)
"""The first one makes the small campaign; so long the second one measures the whole demonstration."""


PUBLIC_ROOMS = ("contract", "laws", "golden")
"""Folders of tests that import nothing below `rftfit`, so that no rebuild of a room breaks them."""


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
    import paper

    return paper.paper_config()


@pytest.fixture(scope="session", autouse=True)
def unit_push_once(request):
    """Pages of one process share the unit push; tests of what a user has run without it, too."""
    if all(item.path.parent.name in PUBLIC_ROOMS for item in request.session.items):
        yield
        return
    from result_tables import shared_unit_push

    with shared_unit_push():
        yield


@pytest.fixture(scope="session")
def small_root(tmp_path_factory):
    """Folder of few directions in loose poppy seeds, its legs and robot, and one sand, run by the workflow: a golden campaign.

    One worker makes it, the others wait; nobody changes it.
    """
    campaign = GoldenCampaign(SMALL)

    def make(root):
        campaign.write(root)
        contents_before = raw_contents(root)
        campaign.run_commands(root)
        assert raw_contents(root) == contents_before, "the workflow wrote into raw/"

    return make_once(tmp_path_factory, "small", make)


def raw_contents(root):
    """Return the bytes of each raw file of a campaign."""
    return {path: path.read_bytes() for path in (root / "raw").rglob("*") if path.is_file()}


@pytest.fixture(scope="session")
def small_made(small_root):
    """The same, with what tests of inner rooms ask of a folder."""
    from campaigns import Folder

    return Folder(small_root)


@pytest.fixture(scope="module")
def small(small_made, tmp_path_factory):
    """A copy of it for the tests of a module."""
    from campaigns import Folder

    root = tmp_path_factory.mktemp("small") / "campaign"
    shutil.copytree(small_made.root, root)
    return Folder(root)
