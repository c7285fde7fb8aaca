"""Messages of the commands that no other test calls forth, each with what it has to say."""

from __future__ import annotations

import errno
import os
import re
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rftfit.__main__ import main as stage
from rftfit.cli import example
from rftfit.cli.main import CRASH_FILE, crash_message
from rftfit.cli.reenact import MARKER, Earlier, clear, find_earlier
from rftfit.cli.scale import from_results
from rftfit.errors import InputError, OutputError

from .test_cli_predict import alpha_frame, here, results

if TYPE_CHECKING:
    from collections.abc import Callable

    from .conftest import Said

__all__ = ["here", "results"]  # fixtures

LEG = ("predict", "--leg", "c_leg")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "which stage? allowed: ingest"),
        (["ingst"], "no stage 'ingst'; allowed: ingest"),
        (["symmetry", "alfa=x"], "found 'alfa=x'; allowed: "),
        (["symmetry"], "= must be given once, found 0 times"),
    ],
)
def test_words_of_a_stage(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert stage(words) == 2
    assert said in capsys.readouterr().err


def test_a_crash_that_can_be_written_nowhere(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / CRASH_FILE).mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    said = crash_message(ZeroDivisionError("no sand"), ["check"])
    assert said.startswith("Unexpected error: ZeroDivisionError: no sand")
    assert "The full report could not be written anywhere." in said


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name on this system")
def test_inspecting_a_pipe(rftfit: Callable[..., Said], here: Path) -> None:
    os.mkfifo(here / "pipe")
    said = rftfit("inspect", here / "pipe")
    assert said.code == 2
    assert "pipe: this is a pipe or device; name a log, a regular file" in said.err


def test_an_example_that_is_not_installed() -> None:
    with pytest.raises(InputError, match="the files of the example moon are not there; install"):
        example.own_files("moon")


def test_an_example_whose_logs_cannot_be_had(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, other = here / "source", here / "other"
    for folder in (source, other):
        folder.mkdir()
    (source / example.SUMS).write_text(f"{'0' * 64}  log.txt\n")
    (here / "file").write_text("")
    chosen = example.EXAMPLES["cmu-sand"]
    with pytest.raises(OutputError, match="raw: cannot be made: Not a directory"):
        example.fetch_logs(chosen, source, here / "file" / "raw", None)
    (other / "log.txt").write_text("1,2\n")
    with pytest.raises(InputError, match=r"--from: .*log.txt is not the log of that name"):
        example.fetch_logs(chosen, source, here / "raw", str(other))
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(InputError, match="downloaded with the package pooch; install it: pip"):
        example.fetch_logs(chosen, source, here / "raw", None)


def test_an_example_without_an_alpha(monkeypatch: pytest.MonkeyPatch, here: Path) -> None:
    campaign = SimpleNamespace(config=SimpleNamespace(fit=SimpleNamespace(confidence=0.95)))
    lost = SimpleNamespace(name="a", plate="round", alpha=np.nan, reason="no contact")
    monkeypatch.setattr(example, "_chain", lambda _: SimpleNamespace(ledger=0, status=0))
    monkeypatch.setattr(example, "_runs", lambda *_: [lost])
    monkeypatch.setattr("rftfit.campaign.load.load_campaign", lambda _: campaign)
    monkeypatch.setattr("rftfit.measure.ledger.check", lambda *_: None)
    with pytest.raises(InputError, match="no run gives an alpha: a: no contact"):
        example.run_plates(here / "config.yaml", here)


def test_a_campaign_whose_tables_do_not_suffice(rftfit: Callable[..., Said], results: Path) -> None:
    def why(*more: str) -> str:
        said = rftfit(*LEG, "--results", results, *more)
        assert said.code == 2, said.out
        return said.err

    sand = results / "alpha" / "sand.csv"
    whole = sand.read_text()
    sand.write_text(re.sub(r"0\.003(?=,)", "", whole))
    said = why("--medium", "sand", "--profile", "generic")
    assert "alpha at (0, 90) deg has no standard error; make these tables again" in said
    # nine coefficients of a medium whose table has a single cell
    coefficients = results / "coefficients.csv"
    rows = coefficients.read_text()
    sand.write_text(whole)
    own = "".join(
        line.replace("poppy_LP", "sand") + "\n" for line in rows.splitlines() if "poppy_LP" in line
    )
    coefficients.write_text(rows + own)
    said = why("--medium", "sand", "--profile", "fourier")
    assert "has a fit that " in said
    assert "1 measured cells are too few for" in said
    coefficients.write_text(rows.splitlines()[0] + "\n")
    said = why("--medium", "poppy_LP", "--profile", "fourier")
    assert "no rows; a campaign without a medium measured over the grid has none" in said


def test_an_interval_that_is_not_known(rftfit: Callable[..., Said], here: Path) -> None:
    from rftfit import reference
    from rftfit.store import write_csv

    folder = here / "results"
    (folder / "alpha").mkdir(parents=True)
    table = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    ends = [name for name in map(str, table) if "_lo_" in name or "_hi_" in name or "_se_" in name]
    table.loc[table["gamma_deg"] == 0, ends] = np.nan
    write_csv(table, folder / "alpha" / "poppy_LP.csv")
    said = rftfit(*LEG, "--results", folder, "--medium", "poppy_LP")
    assert said.code == 0
    assert re.search(
        r"warning: no interval in \d+ of \d+ poses: a cell of the table has none", said.err
    )


def test_a_campaign_scaled_with_the_published_media(here: Path) -> None:
    from rftfit.model.scaling import routine

    (here / "penetration.csv").write_text(
        f'method,medium,chi\n"{routine("lsq", printed=True)}",yuma,1.2\n'
    )
    with pytest.raises(InputError, match="has no medium fitted by 'lsq', its sands are scaled"):
        from_results(here, "lsq")


def test_a_table_of_results_that_is_no_parquet(here: Path) -> None:
    from rftfit.store import read_parquet

    (here / "traces.parquet").write_text("no table")
    with pytest.raises(InputError, match=r"traces.parquet: cannot be read as Parquet: "):
        read_parquet(here / "traces.parquet")


def refuse(*_: Any, **__: Any) -> Any:
    raise PermissionError(errno.EACCES, "Permission denied", "raw/yuma")


def test_earlier_logs_that_cannot_be_touched(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (here / "raw").mkdir()
    (here / "raw" / MARKER).write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=f"{MARKER}: cannot be read: "):
        find_earlier(here / "raw", here / "runs.csv")
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OutputError, match=r"a.csv: cannot be removed: Permission denied"):
        clear(Earlier((here / "raw" / "a.csv",)))
    monkeypatch.setattr(
        os,
        "walk",
        lambda *_, onerror, **__: onerror(PermissionError(13, "Permission denied", "raw/yuma")),
    )
    with pytest.raises(InputError, match="raw/yuma: cannot be looked into: Permission denied"):
        find_earlier(here / "raw", here / "runs.csv")


def test_simulating_into_a_file(rftfit: Callable[..., Said], here: Path) -> None:
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
    )
    assert said.code == 3
    assert "out: this is a file; name a folder for the results" in said.err


def test_a_file_that_may_not_be_read(
    rftfit: Callable[..., Said], here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "config.yaml").write_text("title: a\n")
    monkeypatch.setattr(Path, "read_bytes", refuse)
    said = rftfit("check", "--config", "config.yaml")
    assert said.code == 2
    assert "config.yaml: the file cannot be read: Permission denied" in said.out


def test_locks(monkeypatch: pytest.MonkeyPatch, here: Path) -> None:
    from rftfit.cli import run
    from rftfit.errors import WorkflowError

    others: list[int] = [12, 34]
    monkeypatch.setattr("rftfit.workflow.snakemake.working_in", lambda _: others)
    with pytest.raises(
        WorkflowError, match=r"a workflow is running in .* \(process 12, 34\), so its"
    ):
        run._unlock([], here)
    assert "another workflow is running in" in run._lock_text(here)
    others.clear()
    assert "and run again. Finished results are kept." in run._lock_text(here)

    def refused(_words: list[str], _log: None, tell: Any) -> int:
        tell("no room left")
        return 1

    monkeypatch.setattr("rftfit.workflow.snakemake.listen", refused)
    with pytest.raises(WorkflowError, match="the lock cannot be cleared: no room left"):
        run._unlock([], here)


def test_notes_of_verify() -> None:
    from rftfit.cli.verify import Finding, _notes

    was: Any = SimpleNamespace(rules={"tare": "1"}, versions={"numpy": "2.0"})
    now: Any = SimpleNamespace(rules={"tare": "2"}, versions={"numpy": "2.1"})
    unused = [Finding("log", f"{number}.csv", "a", "b") for number in range(10)]
    notes = list(_notes(was, now, unused))
    assert "the workflow's rules have changed in tare; `rftfit run --dry-run` says" in notes[0]
    assert notes[1] == "made with numpy 2.0; here is 2.1"
    assert notes[2] == "file 0.csv: was a, is b; no result hangs on it"
    assert notes[-1] == "2 more changes that no result hangs on"


def test_a_lock_of_a_killed_run(
    monkeypatch: pytest.MonkeyPatch, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from contextlib import nullcontext

    from rftfit.cli import run

    monkeypatch.setattr("rftfit.workflow.snakemake.listen", lambda *_: 0)
    for certain, said in ((False, ""), (True, "An earlier run was killed: its lock is cleared")):
        monkeypatch.setattr(
            "rftfit.workflow.processes.left_by_the_dead", lambda _, c=certain: nullcontext(c)
        )
        run._clear_lock_of_the_dead([], here)
        assert capsys.readouterr().err.startswith(said)
        assert bool(said) == certain


def test_snakemake_that_is_ended() -> None:
    from rftfit.workflow.snakemake import Watcher, failure_text

    said = failure_text(Watcher(total=9, done=4), Path(), Path("the.log"), -9)
    assert (
        "the workflow stopped: Snakemake itself was ended by SIGKILL, most often because the"
        in said
    )
    assert "4 of 9 jobs are done and kept; `rftfit run` goes on from there." in said
    assert "memory" not in failure_text(Watcher(), Path(), Path("the.log"), -15)


def test_a_part_of_the_sweep_on_a_cluster(monkeypatch: pytest.MonkeyPatch, here: Path) -> None:
    from rftfit.cli.simulate import sweep

    campaign = SimpleNamespace(media_with_runs=("poppy_LP",), root=here)
    section = SimpleNamespace(medium="poppy_LP")
    monkeypatch.setattr("rftfit.campaign.load.load_campaign", lambda _: campaign)
    monkeypatch.setattr("rftfit.workflow.robot.robot_of", lambda _: (section, None))
    with pytest.raises(InputError, match="--cluster and --profile: a cluster runs all profiles at"):
        sweep(profile=["table"], config=here / "config.yaml", cluster="slurm")
