"""The records of jobs show which result is edited, missing or outdated, and what rests on it.

The campaign has three jobs, each made from the one before.
"""

import json
import os
import time
from types import SimpleNamespace
from typing import Any

import pytest

from rftfit.errors import OutputError
from rftfit.store.digests import sha256_of
from rftfit.workflow.records import Record, Recorded, record_holds
from rftfit.workflow.state import state_file

CHAIN = (("tare", "sand"), ("slopes", "sand"), ("provenance", ""))
"""Jobs (rule, medium), each made from the one before."""
STATE = {"code": "c", "rows": "r"}
"""Digests of what a job depends on."""


class Now:
    """States as they are now; the campaign has the jobs of `CHAIN` and one of ``rftfit sweep``."""

    def __init__(self, root):
        self.campaign, self.state = SimpleNamespace(root=root), dict(STATE)

    def state_of(self, rule, key):
        return self.state if (rule, key) == CHAIN[1] else STATE

    def has_job(self, rule, key):
        return (rule, key) in (*CHAIN, ("robot_full_speeds", ""))

    def on_demand(self, name):
        return name == "robot_full_speeds"


def result(rule):
    return f"results/{rule}/sand.csv"


@pytest.fixture
def states_now(tmp_path):
    """All three jobs done; a state of a medium of before, and one of the sweep, lie there too."""
    reads: dict[str, str] = {}
    for rule, key in CHAIN:
        path = tmp_path / result(rule)
        path.parent.mkdir(parents=True)
        path.write_text(rule, encoding="utf-8")
        writes = {result(rule): sha256_of(path)}
        record = Record(rule, key, STATE, reads, writes)
        record.save(tmp_path)
        plan(tmp_path, record.name)
        reads = writes
    for name in ("tare/dune", "robot_full_speeds"):
        plan(tmp_path, name)
    return Now(tmp_path)


def plan(root, name):
    path = root / state_file(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(STATE), encoding="utf-8")


def findings_of(states_now, *targets):
    states: Any = states_now
    return [
        (finding.job, finding.sort, finding.what)
        for finding in Recorded(states).findings_of_targets(targets)
    ]


def edit(states_now):
    (states_now.campaign.root / result("tare")).write_text("edited", encoding="utf-8")


def lose(states_now):
    (states_now.campaign.root / result("slopes")).unlink()


def change(states_now):
    states_now.state = {"code": "other", "rows": "r", "logs": "l"}


def forget(states_now):
    (states_now.campaign.root / "results/records/tare/sand.json").unlink()


@pytest.mark.parametrize(
    ("happens", "expected"),
    [
        (lambda _: None, []),
        (edit, [("tare/sand", "edited", result("tare")), ("slopes/sand", "input", result("tare"))]),
        (
            lose,
            [
                ("slopes/sand", "missing", result("slopes")),
                ("provenance", "input", result("slopes")),
            ],
        ),
        (change, [("slopes/sand", "changed", "code"), ("slopes/sand", "changed", "logs")]),
        (forget, [("tare/sand", "new", ""), ("slopes/sand", "input", result("tare"))]),
    ],
)
def test_findings(states_now, happens, expected):
    happens(states_now)
    assert findings_of(states_now) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"rule": 1}',
        '{"rule": "slopes", "key": "sand"}',
        '{"rule": "slopes", "key": "sand", "state": {"code": 1}, "reads": {}, "writes": {}}',
    ],
)
def test_a_damaged_record_counts_as_none(states_now, text):
    record = states_now.campaign.root / "results/records/tare/sand.json"
    record.write_text(text, encoding="utf-8")
    damaged = findings_of(states_now)
    forget(states_now)
    assert damaged == findings_of(states_now) != []


def test_findings_of_targets(states_now):
    change(states_now)
    assert findings_of(states_now, result("tare")) == []
    assert [finding[1] for finding in findings_of(states_now, result("slopes"))] == [
        "changed",
        "changed",
    ]
    # which jobs a result needs that was never made, nobody knows
    assert {finding[0] for finding in findings_of(states_now, "results/never.csv")} == {
        "slopes/sand"
    }
    states_now.state = dict(STATE)
    # all that was made is as recorded: it stays
    assert findings_of(states_now, "results/never.csv") == [("results/never.csv", "new", "")]


def test_what_a_result_is_made_from_and_what_is_nobodys(states_now):
    states: Any = states_now
    recorded = Recorded(states)
    assert [*recorded.records] == ["tare/sand", "slopes/sand", "robot_full_speeds", "provenance"]
    assert [*recorded.collect_records()] == ["provenance", "slopes/sand", "tare/sand"]
    assert [*recorded.collect_records(recorded.records["slopes/sand"])] == [
        "slopes/sand",
        "tare/sand",
    ]
    for name in ("mine.txt", "logs/tare.log"):
        path = states_now.campaign.root / "results" / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert recorded.list_foreign_files() == ["results/mine.txt"]


def test_the_state_file_of_a_job_that_is_not_as_recorded_is_emptied(states_now):
    states: Any = states_now
    edit(states_now)
    recorded = Recorded(states)
    recorded.make_outdated(recorded.findings_of_targets())
    states_left = {
        name: (states_now.campaign.root / state_file(name)).read_text("utf-8")
        for name in recorded.records
    }
    kept = json.dumps(STATE)
    assert states_left == {
        "tare/sand": "",
        "slopes/sand": "",
        "robot_full_speeds": kept,
        "provenance": kept,
    }


@pytest.mark.parametrize("happens", [None, edit, lose, forget, change])
def test_a_run_of_a_part_forgets_no_job_that_it_does_not_need(states_now, happens):
    states: Any = states_now
    if happens:
        happens(states_now)
    before = Recorded(states)
    before.make_outdated(before.findings_of_targets(["results/never.csv"]))
    after = Recorded(states)
    assert [*after.records] == [*before.records]
    assert after.findings_of_targets() == before.findings_of_targets()
    assert after.list_foreign_files() == before.list_foreign_files()


@pytest.mark.parametrize("happens", [None, edit, lose, forget])
def test_whether_a_record_holds(states_now, happens):
    root = states_now.campaign.root
    jobs = {
        "slopes": ([result("tare"), state_file("slopes/sand")], [result("slopes")]),
        "tare": ([state_file("tare/sand")], [result("tare")]),
    }
    if happens:
        happens(states_now)
    holds = {rule: record_holds(root, *files) for rule, files in jobs.items()}
    broken: dict[Any, set[str]] = {edit: {"tare", "slopes"}, lose: {"slopes"}, forget: {"tare"}}
    assert {rule for rule, is_held in holds.items() if not is_held} == broken.get(happens, set())
    assert not record_holds(root, jobs["tare"][0], [result("tare"), "results/more.csv"])
    (root / state_file("tare/sand")).write_text('{"code": "other"}', encoding="utf-8")
    assert not record_holds(root, *jobs["tare"])


def test_what_is_made_from_an_outdated_result_is_outdated(states_now):
    states: Any = states_now
    assert Recorded(states).outdated == {"robot_full_speeds"}
    change(states_now)
    recorded = Recorded(states)
    assert recorded.outdated == {"robot_full_speeds", "slopes/sand", "provenance"}
    assert recorded.is_current(result("tare"))
    assert not recorded.is_current(result("slopes"))
    assert not recorded.is_current(result("provenance"))
    assert not recorded.is_current("results/never.csv")


def test_times_in_the_future_are_brought_back_and_those_of_outdated_results_long_gone(states_now):
    root = states_now.campaign.root
    states: Any = states_now
    hour_ahead = time.time() + 3600
    for rule in ("tare", "provenance"):
        os.utime(root / result(rule), (hour_ahead, hour_ahead))
    time_before = (root / result("slopes")).stat().st_mtime
    change(states_now)
    recorded = Recorded(states)
    recorded.bring_times_back()
    recorded.make_outdated(recorded.findings_of_targets())
    times = {rule: (root / result(rule)).stat().st_mtime for rule, _ in CHAIN}
    assert times["slopes"] == 1.0 < time_before
    assert time.time() - 60 < times["tare"] == times["provenance"] < time.time() - 5


def test_a_time_that_cannot_be_set_is_told_with_its_cure(states_now, monkeypatch):
    states: Any = states_now
    hour_ahead = time.time() + 3600
    os.utime(states_now.campaign.root / result("tare"), (hour_ahead, hour_ahead))

    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "utime", refuse)
    with pytest.raises(OutputError, match=rf"{result('tare')}: .*Operation not permitted"):
        Recorded(states).bring_times_back()
