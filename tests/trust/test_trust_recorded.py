"""The records of jobs show which result is edited, missing or outdated, and what rests on it.

The campaign has three jobs, each made from the one before.
"""

import hashlib
import json
import os
import time
from types import SimpleNamespace
from typing import Any

import pytest

from rftfit.errors import OutputError
from rftfit.workflow.records import Record, Recorded

CHAIN = (("tare", "sand"), ("slopes", "sand"), ("provenance", ""))
"""Jobs (rule, medium), each made from the one before."""
STATE = {"code": "c", "rows": "r"}
"""Digests of what a job depends on."""


class Now:
    """States as they are now; the campaign has the jobs of `CHAIN`."""

    def __init__(self, root):
        self.campaign, self.state = SimpleNamespace(root=root), dict(STATE)

    def state_of(self, rule, key):
        return self.state if (rule, key) == CHAIN[1] else STATE

    def has_job(self, rule, key):
        return (rule, key) in CHAIN

    def on_demand(self, _):
        return False


def result(rule):
    return f"results/{rule}/sand.csv"


@pytest.fixture
def states_now(tmp_path):
    """All three jobs done."""
    reads: dict[str, str] = {}
    for rule, key in CHAIN:
        path = tmp_path / result(rule)
        path.parent.mkdir(parents=True)
        path.write_text(rule, encoding="utf-8")
        writes = {result(rule): hashlib.sha256(rule.encode()).hexdigest()}
        record = Record(rule, key, STATE, reads, writes)
        record.save(tmp_path)
        state = tmp_path / "results" / "state" / f"{record.name}.json"
        state.parent.mkdir(parents=True, exist_ok=True)
        state.write_text(json.dumps(STATE), encoding="utf-8")
        reads = writes
    return Now(tmp_path)


def findings_of(states_now):
    states: Any = states_now
    return [
        (finding.job, finding.sort, finding.what)
        for finding in Recorded(states).findings_of_targets()
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


def test_a_time_that_cannot_be_set_is_told_with_its_cure(states_now, monkeypatch):
    states: Any = states_now
    hour_ahead = time.time() + 3600
    os.utime(states_now.campaign.root / result("tare"), (hour_ahead, hour_ahead))

    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "utime", refuse)
    with pytest.raises(OutputError, match=rf"{result('tare')}: .*Operation not permitted"):
        Recorded(states).bring_times_back()
