"""The gate for time: what fails, what is only named, and what cannot be compared."""

import json
import sys

import pytest

if sys.platform == "win32":
    pytest.skip("the gate forks the jobs that it measures", allow_module_level=True)

import time_gate
from time_gate import ALL, SHORT, Stored, beyond, factors, slower_twice


def stored(rule, ratio, judged=""):
    return Stored(rule, judged or rule, ratio, "2026-11-28", "0.1.0", "0123abc", "a machine")


TABLE = [
    stored("ingest", 10.0),
    stored("page", 30.0),
    stored("legs", 1.0, SHORT),
    stored("ledger", 3.0, SHORT),
]
RATIOS = {row.rule: row.ratio for row in TABLE}


class Measured:
    """Measurements in turns, each with some rules slower by a factor."""

    def __init__(self, *slowed):
        self.slowed = list(slowed)
        self.asked = []

    def __call__(self, rules):
        self.asked.append(sorted(rules))
        factor_of = self.slowed.pop(0)
        return {rule: RATIOS[rule] * factor_of.get(rule, 1.0) for rule in rules}


@pytest.mark.parametrize(
    ("slowed", "groups"),
    [
        ({}, []),
        ({"ingest": 1.24}, []),
        ({"ingest": 1.4}, ["ingest"]),
        ({"legs": 1.4}, []),
        ({"legs": 1.4, "ledger": 1.4}, [SHORT]),
        ({"page": 1.24}, [ALL]),
        ({"page": 1.4}, [ALL, "page"]),
        ({"page": 0.5, "ingest": 1.3}, ["ingest"]),
    ],
)
def test_a_rule_fails_where_two_measurements_are_beyond(slowed, groups):
    assert sorted(beyond(factors(Measured(slowed)([*RATIOS]), TABLE))) == sorted(groups)
    assert sorted(slower_twice(Measured(slowed, slowed), TABLE)[1]) == sorted(groups)


def test_one_slow_measurement_is_no_failure():
    measured = Measured({"ingest": 1.5}, {})
    factor_of, slower = slower_twice(measured, TABLE)
    assert slower == []
    assert factor_of["ingest"] == pytest.approx(1.0)
    assert measured.asked == [sorted(RATIOS), ["ingest"]]


def all_slower(factor):
    return lambda rules: {rule: factor * RATIOS[rule] for rule in rules}


@pytest.mark.parametrize(
    ("factor", "new", "status"), [(1.0, [], 0), (1.4, [], 1), (1.0, ["new"], 1)]
)
def test_the_status_of_the_gate(monkeypatch, factor, new, status):
    """A new rule is a failure until the table has it."""
    monkeypatch.setattr(time_gate, "read_table", lambda: TABLE)
    monkeypatch.setattr(time_gate, "machine", lambda: "a machine")
    assert time_gate.check([*RATIOS, *new], all_slower(factor)) == status


def test_another_processor_is_not_checked_and_named(monkeypatch):
    monkeypatch.setattr(time_gate, "machine", lambda: "a machine")
    assert time_gate.why_not_checked(TABLE) == ""
    monkeypatch.setattr(time_gate, "machine", lambda: "another machine")
    why = time_gate.why_not_checked(TABLE)
    assert "those of a machine; this is another machine" in why


def test_the_kept_table_has_every_rule_of_a_run(small_root):
    table = time_gate.read_table()
    record = json.loads((small_root / "results" / "provenance.json").read_text("utf-8"))
    rules = {name.partition("/")[0] for name in record["jobs"]}
    rules |= {"provenance", *time_gate.COMMANDS}
    assert all(row.ratio > 0 for row in table)
    for machine in {row.machine for row in table}:
        assert sorted(row.rule for row in time_gate.rows_of(machine, table)) == sorted(rules)


def test_a_table_written_anew_keeps_the_rows_of_other_processors(monkeypatch, tmp_path):
    path = tmp_path / "times.csv"
    for name, factor in (("a machine", 1.0), ("another machine", 2.0), ("a machine", 3.0)):
        monkeypatch.setattr(time_gate, "machine", lambda name=name: name)
        time_gate.write_table({rule: factor * ratio for rule, ratio in RATIOS.items()}, path)
    table = time_gate.read_table(path)
    for name, factor in (("a machine", 3.0), ("another machine", 2.0)):
        rows = time_gate.rows_of(name, table)
        assert {row.rule: row.ratio / factor for row in rows} == pytest.approx(RATIOS)
    assert len(table) == 2 * len(RATIOS)
