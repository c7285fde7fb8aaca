"""What is made of Snakemake's lines, without Snakemake."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import pytest
from rich.console import Console

from rftfit.workflow.snakemake import Bar, Watcher, failure_text

if TYPE_CHECKING:
    from pathlib import Path

STAMP = "[Sat Nov 21 05:52:21 2026]"


def begun(number: int, rule: str, medium: str) -> str:
    return f"{STAMP}\nlocalrule {rule}:\n    jobid: {number}\n    wildcards: medium={medium}\n"


def failed(number: int, rule: str, status: str = "returned non-zero exit status 2.") -> str:
    return (
        'RuleException:\nCalledProcessError in file "Snakefile", line 6:\n'
        f"Command 'set -euo pipefail;  python -m rftfit {rule}' {status}\n{STAMP}\n"
        f"Error in rule {rule}:\n    message: None\n    jobid: {number}\n    shell:\n"
        f"        python -m rftfit {rule} medium=x\n        (command exited with non-zero exit code)\n"
    )


def watch(text: str) -> Watcher:
    watcher = Watcher()
    for line in text.splitlines():
        watcher.feed(line)
    watcher.close()
    return watcher


def test_messages_go_to_the_job_that_they_are_of(tmp_path: Path) -> None:
    watcher = watch(
        "Job stats:\ntotal  9\n"
        + begun(1, "ingest", "sand_a")
        + begun(2, "ingest", "sand_b")
        + begun(3, "tare", "sand_c")
        # all three speak before Snakemake says who failed
        + "rftfit ingest: sand_b/x.csv: empty\nrftfit tare: no tare\n"
        + "rftfit ingest: sand_a/y.csv: missing\n  in row 3\n"
        + failed(1, "ingest")
        + failed(2, "ingest")
        + failed(3, "tare")
        + "Exiting because a job execution failed.\nWorkflowError:\n"
        + "At least one job did not complete successfully.\n"
    )
    text = failure_text(watcher, tmp_path, tmp_path / "log")
    assert text.splitlines()[1:7] == [
        "  ingest sand_a:",
        "    sand_a/y.csv: missing",
        "      in row 3",
        "  ingest sand_b:",
        "    sand_b/x.csv: empty",
        "  tare sand_c:",
    ]
    assert "    no tare\n" in text
    assert text.startswith("the workflow stopped: 3 jobs failed; 0 of 9 are done")
    assert "RuleException" not in text
    assert "At least one job" not in text


def test_a_traceback_becomes_its_last_line(tmp_path: Path) -> None:
    trace = (
        'Traceback (most recent call last):\n  File "a.py", line 1, in <module>\n    fail()\n'
        "    ^^^^^^\nValueError: no sand\n"
    )
    text = failure_text(
        watch(begun(1, "tare", "a") + trace + failed(1, "tare")), tmp_path, tmp_path
    )
    assert "    ValueError: no sand\n    (an error that the program did not expect" in text
    assert "File " not in text


@pytest.mark.parametrize(
    ("status", "shown"),
    [
        ("returned non-zero exit status 137.", "the memory was full"),
        ("died with <Signals.SIGKILL: 9>.", "the memory was full"),
        ("died with <Signals.SIGSEGV: 11>.", "ended by SIGSEGV"),
        ("returned non-zero exit status 7.", "no message; exit status 7"),
    ],
)
def test_jobs_that_say_nothing(tmp_path: Path, status: str, shown: str) -> None:
    watcher = watch(begun(1, "tare", "a") + failed(1, "tare", status))
    assert shown in failure_text(watcher, tmp_path, tmp_path)


def test_an_empty_log_of_its_own_leaves_the_status(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text("")
    block = failed(1, "tare").replace("    shell:", "    log: a.log (check log file(s) for error "
                                      "details)\n    shell:")  # fmt: skip
    watcher = watch(begun(1, "tare", "a") + block)
    assert "no message; exit status 2" in failure_text(watcher, tmp_path, tmp_path)
    (tmp_path / "a.log").write_text("Killed\n")
    assert "    Killed\n" in failure_text(watcher, tmp_path, tmp_path)


def test_a_retried_job_is_one_failure(tmp_path: Path) -> None:
    watcher = watch(begun(1, "tare", "a") + failed(1, "tare") + failed(1, "tare"))
    assert failure_text(watcher, tmp_path, tmp_path).startswith(
        "the workflow stopped: 1 job failed"
    )


def test_no_reason_at_all(tmp_path: Path) -> None:
    assert "gave no reason" in failure_text(watch("hm\n"), tmp_path, tmp_path)


def test_the_bar_follows() -> None:
    screen = io.StringIO()
    watcher = Watcher()
    console = Console(file=screen, force_terminal=True, width=100)
    text = (
        begun(1, "tare", "[red]a")
        + f"{STAMP}\nFinished jobid: 1 (Rule: tare)\n1 of 2 steps (50%) done\n"
    )
    with Bar(console) as bar:
        for line in text.splitlines():
            bar.update(watcher, watcher.feed(line))
    assert "1/2" in screen.getvalue()
    # a name in brackets is no markup
    assert "tare [red]a" in screen.getvalue()
