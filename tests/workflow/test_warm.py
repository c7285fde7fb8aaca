"""Jobs forked from a warm process: the same end, files, folder and environment as jobs of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import psutil  # type: ignore[import-untyped]
import pytest

from rftfit.errors import InputError
from rftfit.store.environment import child_environment
from rftfit.workflow import warm

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="jobs are forked on Linux only")

LONGEST_S = 20.0


SLOW = """import os, sys, time
def heard(event, words):
    if event == "open" and str(words[0]).endswith("slow.yaml"):
        print(os.environ.get("MARK", "none"), file=sys.stderr, flush=True)
        time.sleep(60)
sys.addaudithook(heard)
"""
"""Every Python that opens ``slow.yaml`` says a variable of its environment, and waits."""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    folder = tmp_path_factory.mktemp("site")
    (folder / "sitecustomize.py").write_text(SLOW, encoding="utf-8")
    with warm.warm(child_environment(PYTHONPATH=str(folder))) as made:
        yield made


def job(folder: Path, environment: dict[str, str], *words: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-P", "-m", "rftfit", *words]
    with (folder / "err").open("wb") as errors:
        return subprocess.Popen(command, cwd=folder, env=environment, stderr=errors)


def children() -> set[int]:
    """Jobs that were forked from the warm processes of this test and still live."""
    kept = [one for one in psutil.Process().children() if warm.WARM in one.cmdline()]
    return {job.pid for one in kept for job in one.children() if job.status() != "zombie"}


@pytest.fixture
def waiting(
    tmp_path: Path, environment: dict[str, str]
) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """A job that waits for its config, and the process that does its work."""
    (tmp_path / "slow.yaml").touch()
    before = children()
    own = environment | {"MARK": "of the job"}
    started = job(tmp_path, own, "ingest", "--config", "slow.yaml")
    end = time.monotonic() + LONGEST_S
    while not (new := children() - before) and time.monotonic() < end:
        time.sleep(0.02)
    try:
        (worker,) = new
        while psutil.Process(worker).cwd() != str(tmp_path) and time.monotonic() < end:
            time.sleep(0.02)
        yield started, worker
    finally:
        started.kill()
        started.wait()


def gone(process: int) -> bool:
    end = time.monotonic() + LONGEST_S
    while psutil.pid_exists(process) and time.monotonic() < end:
        time.sleep(0.02)
    return not psutil.pid_exists(process)


def test_nothing_warm_means_that_the_job_does_it_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(warm.VARIABLE, raising=False)
    assert warm.ask(["ingest"]) is None
    monkeypatch.setenv(warm.VARIABLE, "rftfit-nobody")
    assert warm.ask(["ingest"]) is None


def test_another_python_is_refused(environment: dict[str, str]) -> None:
    """In an environment of its own (conda), a job must not be done by the libraries of another."""
    text = (
        "import sys; sys.prefix = '/elsewhere'\n"
        "from rftfit.workflow import warm; print(warm.ask(['ingest']))"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", text],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "None\n"


def test_status_errors_and_folder_are_those_of_the_job(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    alone = {name: value for name, value in environment.items() if name != warm.VARIABLE}
    ends = []
    for one in (environment, alone):
        started = job(tmp_path, one, "ingest", "--config", "here.yaml")
        ends.append((started.wait(LONGEST_S), (tmp_path / "err").read_text(encoding="utf-8")))
    assert ends[0] == ends[1]
    status, text = ends[0]
    assert status == InputError.exit_code
    assert "here.yaml" in text


def test_environment_folder_and_files_are_those_of_the_job(
    waiting: tuple[subprocess.Popen[bytes], int], tmp_path: Path
) -> None:
    _, worker = waiting
    end = time.monotonic() + LONGEST_S
    while not (said := (tmp_path / "err").read_text(encoding="utf-8")) and time.monotonic() < end:
        time.sleep(0.02)
    assert said == "of the job\n"
    found = psutil.Process(worker)
    assert found.cwd() == str(tmp_path)
    assert os.readlink(f"/proc/{worker}/fd/2") == str(tmp_path / "err")  # noqa: PTH115


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_the_work_ends_with_the_job(
    waiting: tuple[subprocess.Popen[bytes], int], number: signal.Signals
) -> None:
    started, worker = waiting
    started.send_signal(number)
    assert started.wait(LONGEST_S) == -number
    if number is signal.SIGKILL:
        assert gone(worker)
    # a job that can still act ends its work first: nothing is written after it
    assert not psutil.pid_exists(worker)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
def test_the_job_ends_as_the_work_ended(
    waiting: tuple[subprocess.Popen[bytes], int], number: signal.Signals
) -> None:
    started, worker = waiting
    os.kill(worker, number)
    assert started.wait(LONGEST_S) == -number


def test_nothing_warm_is_left(tmp_path: Path) -> None:
    def kept() -> set[psutil.Process]:
        return {one for one in psutil.Process().children() if warm.WARM in one.cmdline()}

    before = kept()
    with warm.warm(child_environment()) as made:
        assert job(tmp_path, made, "ingest", "--config", "none.yaml").wait(LONGEST_S)
        assert len(kept()) == len(before) + 1
    assert kept() == before


def test_a_warm_process_ends_with_the_run_that_was_killed() -> None:
    text = (
        "import time\nfrom rftfit.store.environment import child_environment\n"
        "from rftfit.workflow import warm\n"
        "with warm.warm(child_environment()): print(flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-P", "-c", text], stdout=subprocess.PIPE) as run:
        assert run.stdout is not None
        run.stdout.readline()
        (kept,) = psutil.Process(run.pid).children()
        run.kill()
    assert gone(kept.pid)
