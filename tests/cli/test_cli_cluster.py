"""`--cluster`: which profile, what is missing, and how jobs that go as one are shown."""

from __future__ import annotations

from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING

import pytest

from rftfit.cli import run
from rftfit.cli.run import cluster_words
from rftfit.errors import InputError
from rftfit.workflow.snakemake import Watcher, failure_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from .conftest import Said

GROUP = """\
Job stats:
total  3
[Sat Nov 21 12:14:34 2026] Group job medium (jobs in lexicogr. order):
    [Sat Nov 21 12:14:34 2026]
    rule ingest:
        output: results/traces/sand.parquet
        jobid: 3
        wildcards: medium=sand
        resources: mem_mb=1000
    [Sat Nov 21 12:14:34 2026]
    rule tare:
        jobid: 4
        wildcards: medium=sand
Job 66be0ecb has been submitted with SLURM jobid 1 (log: x.log).
[Sat Nov 21 12:15:34 2026]
Finished jobid: 3 (Rule: ingest)
[Sat Nov 21 12:15:34 2026]
Finished jobid: 4 (Rule: tare)
2 of 3 steps (67%) done
Finished jobid: 9 (Rule: page)
"""


FAILED_GROUP = """\
[Sat Nov 21 12:15:34 2026]
    message: SLURM-job '2' failed, SLURM status is: 'TIMEOUT'. For further error details see the log.
    log: 2.log (check log file(s) for error details)
    jobs:
        rule ingest:
            jobid: 3
            output: results/traces/sand.parquet
            log: ingest.log (check log file(s) for error details)
        rule tare:
            jobid: 4
            log: tare.log (check log file(s) for error details)
Logfile ingest.log:
================================================================================
"""


def watch(text: str) -> Watcher:
    watcher = Watcher()
    for line in text.splitlines():
        watcher.feed(line)
    watcher.close()
    return watcher


@pytest.fixture
def snakefile(tmp_path: Path) -> Path:
    for name, text in [("default", "cores: all\n"), ("slurm", "executor: slurm\n")]:
        (tmp_path / "top" / "profiles" / name).mkdir(parents=True)
        (tmp_path / "top" / "profiles" / name / "config.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "top" / "Snakefile"


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "find_spec", lambda name: ModuleSpec(name, None))
    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")


@pytest.mark.usefixtures("installed")
def test_the_projects_profile_and_an_own_one(snakefile: Path, tmp_path: Path) -> None:
    there = snakefile.parent / "profiles" / "slurm"
    assert cluster_words("slurm", snakefile, None) == ["--workflow-profile", str(there)]
    assert cluster_words("slurm", snakefile, 8)[2:] == ["--cores", "8"]
    own = tmp_path / "my site"
    own.mkdir()
    (own / "config.yaml").write_text("executor: local\n", encoding="utf-8")
    assert cluster_words(str(own), snakefile, None) == ["--workflow-profile", str(own)]


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("text", "words"), [("a: [", "cannot be read"), ("- a\n", "must hold keys and values")]
)
def test_a_profile_that_cannot_be_read(
    snakefile: Path, tmp_path: Path, text: str, words: str
) -> None:
    (tmp_path / "config.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        cluster_words(str(tmp_path), snakefile, None)
    with pytest.raises(InputError, match="found 'default'; allowed: slurm, or a folder"):
        cluster_words("default", snakefile, None)


def test_what_is_missing_is_named(snakefile: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "find_spec", lambda _: None)
    with pytest.raises(InputError, match="pip install snakemake-executor-plugin-slurm"):
        cluster_words("slurm", snakefile, None)
    monkeypatch.setattr(run, "find_spec", lambda name: ModuleSpec(name, None))
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(InputError, match="no program sbatch here"):
        cluster_words("slurm", snakefile, None)


@pytest.mark.parametrize("command", [("run",), ("sweep",)])
def test_both_commands_say_so(
    rftfit: Callable[..., Said], campaign: Path, command: tuple[str, ...]
) -> None:
    said = rftfit(*command, "--cluster", "nowhere")
    assert said.code == 2
    assert not (campaign / ".snakemake").exists()


def test_of_jobs_that_went_as_one_the_failed_one_is_named(tmp_path: Path) -> None:
    (tmp_path / "ingest.log").write_text("poppy: 3 of 4 runs\n", encoding="utf-8")
    (tmp_path / "tare.log").write_text("rftfit tare: no tare\n  in row 3\n", encoding="utf-8")
    head = GROUP.partition("Job 66be0ecb")[0]
    text = failure_text(watch(head + FAILED_GROUP), tmp_path, tmp_path / "log")
    assert "1 job failed" in text
    assert text.splitlines()[1:4] == ["  tare sand:", "    no tare", "      in row 3"]
    assert "ingest" not in text
    (tmp_path / "tare.log").unlink()
    text = failure_text(watch(head + FAILED_GROUP), tmp_path, tmp_path / "log")
    assert text.splitlines()[1:3] == [
        "  one of ingest sand, tare sand:",
        "    no message; Slurm says TIMEOUT",
    ]


def test_jobs_that_go_as_one_have_their_names() -> None:
    watcher = Watcher()
    shown = [job.title for line in GROUP.splitlines() if (job := watcher.feed(line))]
    assert shown == ["ingest sand", "tare sand", "page"]
    assert (watcher.done, watcher.total) == (3, 3)
    assert watcher.jobs["3"].fields["output"] == "results/traces/sand.parquet"
