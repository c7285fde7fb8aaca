"""The parts behind provenance and verify: digests of files, imports, the graph, text in csv."""

from __future__ import annotations

import ast
import csv
import os
import random
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rftfit.errors import InputError
from rftfit.robot.config import paper_robot_path
from rftfit.store import digests, read_csv, write_csv
from rftfit.store.digests import Seen, read_sums, sha256_of, sums_text
from rftfit.store.tables import guarded, unguarded
from rftfit.workflow.plan import Plan, Record, Records
from rftfit.workflow.provenance import changes_between, present_state

if TYPE_CHECKING:
    from collections.abc import Callable

PACKAGE = Path(digests.__file__).parents[1]
SIGNS = "=+-@\t\r\n\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH COMMERCIAL AT}"


# --- digests of logs, remembered -------------------------------------------------------------------


@pytest.fixture
def logs(tmp_path: Path) -> list[str]:
    """Three old files and a place to remember them."""
    (tmp_path / "state").mkdir()
    paths = [tmp_path / f"{name}.csv" for name in "abc"]
    for place, path in enumerate(paths):
        path.write_bytes(bytes([place]) * 1000)
    return [str(path) for path in paths]


def memory_of(logs: list[str]) -> Path:
    return Path(logs[0]).parent / "state" / "rftfit" / "seen.tsv"


def settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a minute pass, so that what was just written counts as old."""
    now = time.time_ns
    monkeypatch.setattr("rftfit.store.digests.time.time_ns", lambda: now() + 60_000_000_000)


def count_reading(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    read: list[str] = []

    def note(path: str | Path) -> str:
        read.append(str(path))
        return sha256_of(path)

    monkeypatch.setattr("rftfit.store.digests.sha256_of", note)
    return read


def test_what_has_not_changed_is_not_read_again(
    logs: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    settled(monkeypatch)
    first = Seen(memory_of(logs))
    wanted = first.digests(logs)
    assert wanted == {path: sha256_of(path) for path in logs}
    first.save()
    read = count_reading(monkeypatch)
    assert Seen(memory_of(logs)).digests(logs) == wanted
    assert read == []


@pytest.mark.skipif(os.name != "posix", reason="names are text on Windows")
def test_a_name_that_is_no_text_is_remembered(
    logs: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As every folder with an accent is where the system's encoding is ASCII."""
    settled(monkeypatch)
    name = os.fsdecode(os.fsencode(logs[0]) + b"\xe9")
    Path(logs[0]).rename(name)
    first = Seen(memory_of(logs))
    wanted = first.digests([name])
    first.save()
    read = count_reading(monkeypatch)
    assert Seen(memory_of(logs)).digests([name]) == wanted
    assert read == []


def test_a_change_with_size_and_date_put_back_is_seen(
    logs: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    settled(monkeypatch)
    first = Seen(memory_of(logs))
    before = first.digests(logs)
    first.save()
    path = Path(logs[1])
    state = path.stat()
    path.write_bytes(b"x" * state.st_size)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    read = count_reading(monkeypatch)
    after = Seen(memory_of(logs)).digests(logs)
    assert read == [logs[1]]
    assert [path for path in logs if before[path] != after[path]] == [logs[1]]


def test_what_was_just_written_is_not_trusted(
    logs: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second change within a tick of the clock would look like none."""
    first = Seen(memory_of(logs))
    first.digests(logs)
    first.save()
    read = count_reading(monkeypatch)
    Seen(memory_of(logs)).digests(logs)
    assert sorted(read) == logs


@pytest.mark.parametrize(
    "rest", [b"", b"\xff\xfe", b"something else\n", b"rftfit logs seen 1\nx\n"]
)
def test_a_damaged_memory_is_no_harm(logs: list[str], rest: bytes) -> None:
    memory = memory_of(logs)
    memory.parent.mkdir()
    memory.write_bytes(rest)
    assert Seen(memory).digests(logs) == {path: sha256_of(path) for path in logs}


def test_pipes_devices_folders_and_nothing_are_not_read(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    if hasattr(os, "mkfifo"):
        os.mkfifo(pipe)
    names = [str(pipe), str(tmp_path), str(tmp_path / "absent"), os.devnull, "a\0b"]
    assert Seen(None).digests(names) == dict.fromkeys(names, "")


def test_sums_come_back_and_are_those_of_sha256sum(logs: list[str], tmp_path: Path) -> None:
    digests = {path: sha256_of(path) for path in logs}
    (tmp_path / "sums").write_text(sums_text({**digests, "missing.csv": ""}), encoding="utf-8")
    assert read_sums(tmp_path / "sums") == digests
    line = (tmp_path / "sums").read_text(encoding="utf-8").splitlines()[0]
    assert line == f"{digests[logs[0]]}  {logs[0]}"
    (tmp_path / "sums").write_text("nothing\n", encoding="utf-8")
    with pytest.raises(InputError, match="sums"):
        read_sums(tmp_path / "sums")


# --- imports ----------------------------------------------------------------------------------------


def test_no_import_is_overlooked() -> None:
    """The quick look at imports finds all that the syntax tree has."""
    problems = []
    modules = sorted(PACKAGE.rglob("*.py"))
    for path in modules:
        name = ".".join(["rftfit", *path.relative_to(PACKAGE).with_suffix("").parts])
        name = name.removesuffix(".__init__")
        if name == "rftfit":  # the public names are found when they are asked for
            continue
        wanted: set[str] = set()
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                wanted.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
                wanted.add(node.module)
                wanted.update(f"{node.module}.{alias.name}" for alias in node.names)
        own = {one for one in wanted if one.split(".")[0] == "rftfit" and digests._path(one)}
        if lost := own - digests._imports(name):
            problems.append(f"{name}: {sorted(lost)}")
    assert len(modules) > 100
    assert problems == []


# --- records of tasks ---------------------------------------------------------------------------------


def record() -> Record:
    return Record({"code": "c1", "settings": "s1"}, {"results/a.csv": "1"}, {"results/b.csv": "2"})


def test_records_come_back(tmp_path: Path) -> None:
    records = Records.load(tmp_path, "slopes")
    assert records.tasks == {}
    records.tasks["sand"] = record()
    records.save()
    assert Records.load(tmp_path, "slopes").tasks == {"sand": record()}


@pytest.mark.parametrize("text", ["", "{", "[]", '{"sand": 1}', '{"sand": {"depends": {}}}',
    '{"sand": {"depends": {"code": 1}, "reads": {}, "writes": {}}}'])  # fmt: skip
def test_a_damaged_record_counts_as_none(tmp_path: Path, text: str) -> None:
    path = Records.load(tmp_path, "slopes").path
    path.parent.mkdir(parents=True)
    path.write_text(text, encoding="utf-8")
    assert Records.load(tmp_path, "slopes").tasks == {}


# --- the robot ---------------------------------------------------------------------------------------


@pytest.fixture
def robot_campaign(tmp_path: Path) -> Path:
    """One plate run, one trial of the robot, a robot of its own."""
    root = tmp_path / "campaign"
    (root / "raw" / "paper" / "robot").mkdir(parents=True)
    (root / "config").mkdir()
    here = PACKAGE.parents[1] / "config"
    text = (here / "config.yaml").read_text("utf-8")
    text = text.replace("robot:", "robot:\n  file: config/mine.yaml", 1)
    (root / "config" / "config.yaml").write_text(text, "utf-8")
    (root / "config" / "mine.yaml").write_bytes((here / "robot.yaml").read_bytes())
    (root / "raw" / "paper" / "runs.csv").write_text(
        "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
        "p1,plate,poppy_LP,plate,intrusion,0,90,f.csv,m.csv\n", "utf-8"
    )  # fmt: skip
    (root / "raw" / "paper" / "robot" / "runs.csv").write_text(
        "run_id,condition,medium,curvature_times_R,frequency_Hz,track\na1,a,poppy_LP,1,2,a1.csv\n",
        "utf-8",
    )
    (root / "raw" / "paper" / "robot" / "a1.csv").write_text("t_s,x_cm,z_cm\n0,0,0\n", "utf-8")
    return root


def test_the_robots_files_are_watched(robot_campaign: Path) -> None:
    plan = Plan(robot_campaign / "config" / "config.yaml")
    names = {"config/mine.yaml", "raw/paper/robot/runs.csv", "raw/paper/robot/a1.csv"}
    assert {name: sha256_of(robot_campaign / name) for name in names} == plan.robot_digests
    state = present_state(plan)
    for name in sorted(names):
        path = robot_campaign / name
        content = path.read_bytes()
        # the sheet has to stay readable, a track and a comment need not
        new = (
            content.replace(b",1,2,", b",1,3,")
            if name.endswith("runs.csv")
            else content + b"# changed\n"
        )
        path.write_bytes(new)
        changed = Plan(plan.config, fresh=True)
        found = changes_between(state, present_state(changed))
        assert [(one.sort, one.name) for one in found] == [("log", name)]
        for stage, watches in (("robot_measured", True), ("robot_sweep", True), ("fourier", False)):
            before, after = plan.stages[stage][0].depends, changed.stages[stage][0].depends
            assert (before != after) is watches, stage
        path.write_bytes(content)


def test_the_papers_robot_counts_as_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = "rftfit.robot.config"
    read = [top / digests._READS[module] for top in digests._tops()]
    assert paper_robot_path() in read
    before = (
        digests.code_digest("rftfit.workflow.robot"),
        digests.code_digest("rftfit.model.fourier"),
    )
    (tmp_path / "config").mkdir()
    changed = paper_robot_path().read_bytes().replace(b"mass_g: 150", b"mass_g: 151")
    (tmp_path / "config" / "robot.yaml").write_bytes(changed)
    monkeypatch.setattr(digests, "_tops", lambda: (tmp_path,))
    digests._source_digest.cache_clear()
    after = (
        digests.code_digest("rftfit.workflow.robot"),
        digests.code_digest("rftfit.model.fourier"),
    )
    digests._source_digest.cache_clear()
    assert after[0] != before[0]
    assert after[1] == before[1]


# --- text that a spreadsheet would calculate ---------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("=1+1", "'=1+1"), ("+SUM(A1)", "'+SUM(A1)"), ("-2+3", "'-2+3"), ("@A1", "'@A1"),
        ("\t=1", "'\t=1"), ("\r=1", "'\n=1"), ("'=1", "''=1"), ("-", "'-"),
        ("-5", "-5"), ("+0.25", "+0.25"), ("-1e-3", "-1e-3"), ("a=1", "a=1"), ("it's", "it's"), ("", ""),
    ],
)  # fmt: skip
def test_text_is_guarded_and_numbers_are_left(text: str, written: str) -> None:
    assert guarded(text) == written
    assert unguarded(written) == text.replace("\r", "\n")


@given(st.text(st.sampled_from([*SIGNS, "'", "1", "a", '"', ",", ";"]), max_size=6))
def test_guarded_text_comes_back(text: str) -> None:
    written = guarded(text)
    plain = text.replace("\r\n", "\n").replace("\r", "\n")
    assert unguarded(written) == plain
    assert written[:1] not in SIGNS or not written or float(written) == float(plain)


def test_tables_come_back_and_hold_no_formula(tmp_path: Path) -> None:
    pick = random.Random(3)
    texts = ["".join(pick.choices("=+-@'\"\n,;1a ", k=pick.randint(1, 6))) for _ in range(300)]
    table = pd.DataFrame(
        {"run_id": [f"r{i}" for i in range(300)], "note": texts, "force_N": [-i / 7 for i in range(300)]}
    )  # fmt: skip
    write_csv(table, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as handle:
        rows = list(csv.DictReader(handle))
    for row in rows:
        assert row["note"][0] not in SIGNS or is_number(row["note"]), row
        assert is_number(row["force_N"])
    back = read_csv(tmp_path / "t.csv", lambda name: "" if name == "force_N" else "text")
    assert back["note"].tolist() == texts
    assert back["force_N"].to_numpy() == pytest.approx(table["force_N"].to_numpy(), rel=1e-5)


def test_names_as_categories_are_guarded_too(tmp_path: Path) -> None:
    write_csv(pd.DataFrame({"note": pd.Categorical(["=a", "b", "=a"])}), tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text(encoding="utf-8") == "note\n'=a\nb\n'=a\n"


def is_number(text: str) -> bool:
    convert: Callable[[str], float] = float
    try:
        convert(text)
    except ValueError:
        return False
    return True
