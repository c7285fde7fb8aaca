"""pytest plugin: which test runs which line of the program, and how long each test takes.

    PYTHONPATH=studies python -m pytest -p line_recorder --record-lines FOLDER

Writes two files a process into FOLDER: lines with their contexts as the package `coverage` keeps them, and
`tests-*.json`. A context is a test, or a fixture that several tests share: what a shared fixture runs is run for
each test that asks for it, so each of them can notice a change of it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import coverage
import pytest

SHARED_SCOPES = ("class", "module", "package", "session")


def processor_seconds() -> float:
    """Processor time of this process and of the children that have ended, s."""
    return sum(os.times()[:4])


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that says where the lines go."""
    parser.addoption("--record-lines", metavar="FOLDER", help="write which test runs which line")


def pytest_configure(config: pytest.Config) -> None:
    """Start to record in each process that runs tests."""
    folder = config.getoption("--record-lines")
    is_controller = getattr(config.option, "numprocesses", None) and not hasattr(
        config, "workerinput"
    )
    if folder and not is_controller:
        config.pluginmanager.register(Recorder(Path(folder)), "line-recorder")


def context_of_fixture(fixturedef: Any, parameter: int) -> str:
    """Name of what a shared fixture runs, for one of its parameters."""
    return f"fixture {fixturedef.baseid}::{fixturedef.argname}[{parameter}]"


def shared_fixtures(item: Any) -> list[str]:
    """Contexts of the shared fixtures that a test asks for, its own and theirs."""
    indices = item.callspec.indices if hasattr(item, "callspec") else {}
    return [
        context_of_fixture(definitions[-1], indices.get(name, 0))
        for name, definitions in item._fixtureinfo.name2fixturedefs.items()
        if definitions[-1].scope in SHARED_SCOPES
    ]


class Recorder:
    """Lines by test and by shared fixture, in this process."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.coverage = coverage.Coverage(
            data_file=str(folder / "lines"),
            data_suffix=True,
            source_pkgs=["rftfit"],
            config_file=False,
        )
        # a child that reads a file for its parent ends by `os._exit`: its lines count as well
        self.coverage.set_option("run:patch", ["_exit"])
        self.tests: dict[str, dict[str, Any]] = {}
        self.fixture_seconds: dict[str, float] = {}
        self.context = ""
        self.seconds_in_fixtures = 0.0
        self.coverage.start()

    def enter(self, context: str) -> str:
        """Count all lines from now on for another context; give the one before."""
        before, self.context = self.context, context
        self.coverage.switch_context(context)
        return before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Any:
        """Count what a test runs, and its time without that of shared fixtures."""
        self.enter(item.nodeid)
        self.seconds_in_fixtures = 0.0
        begin = processor_seconds()
        self.tests[item.nodeid] = {"fixtures": shared_fixtures(item), "passed": True}
        try:
            return (yield)
        finally:
            seconds = processor_seconds() - begin - self.seconds_in_fixtures
            self.tests[item.nodeid]["seconds"] = round(seconds, 4)
            self.enter("")

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Any:
        """Count what a shared fixture runs apart from the test that asks first."""
        if fixturedef.scope not in SHARED_SCOPES:
            return (yield)
        context = context_of_fixture(fixturedef, request.param_index)
        before, before_s = self.enter(context), self.seconds_in_fixtures
        begin = processor_seconds()
        try:
            return (yield)
        finally:
            seconds = processor_seconds() - begin
            inner_s = self.seconds_in_fixtures - before_s
            self.fixture_seconds[context] = round(seconds - inner_s, 4)
            self.seconds_in_fixtures = before_s + seconds
            self.enter(before)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep whether a test passed: no other can judge."""
        if report.nodeid in self.tests and not report.passed:
            self.tests[report.nodeid]["passed"] = False

    def pytest_sessionfinish(self) -> None:
        """Write all of it."""
        self.coverage.stop()
        self.coverage.save()
        record = {"tests": self.tests, "fixtures": self.fixture_seconds}
        path = self.folder / f"tests-{os.getpid()}.json"
        path.write_text(json.dumps(record), encoding="utf-8")
