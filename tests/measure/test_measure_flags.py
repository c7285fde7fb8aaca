"""Each flag and reason has one code with one sentence and comes back unchanged from a table."""

import re
from pathlib import Path

import pytest

import rftfit
from rftfit.checks.declared import CHECKS
from rftfit.measure.flags import (
    Flags,
    Remark,
    attach_run,
    codes_of,
    flag_table,
    format_remarks,
    has,
    reason_columns,
    reason_of,
    remark,
)
from rftfit.measure.sentences import FLAGS, SENTENCES

DRIFT, CUT = remark("zero-drifted", newtons=0.3), remark("motion-log-cut")
"""Flags of runs."""
GAIN = remark("channel-gain", channel="F1", times=2.0)
ROWS = remark("cut-rows", count=3, file="a; b.csv", why="cut in mid-row")


def test_every_code_of_the_source_has_a_sentence():
    root = Path(rftfit.__file__).parent
    text = "".join(path.read_text(encoding="utf-8") for path in root.rglob("*.py"))
    used = re.findall(r'\b(?:remark|Refused)\(\s*"([^"]+)"', text)
    assert len(used) > 100
    assert {*used} <= {*SENTENCES}
    with pytest.raises(KeyError):
        remark("no-such-code")


def test_every_outcome_of_a_check_has_its_words_and_no_words_are_left_over():
    folder = Path(rftfit.__file__).parent / "checks"
    source = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    # a code whose only mention is its own declaration; that of the check itself is the default
    unused = [
        code
        for name, check in CHECKS.items()
        for code in check.outcomes
        if source.count(f'"{code}"') == 1 and code != name
    ]
    # the code of a shifted lag is built from the name of what shifted
    assert unused == ["lag-differs"]
    assert all(name in check.outcomes for name, check in CHECKS.items())


def test_flags_come_back_from_a_table():
    cell = {"beta_deg": 0.0, "gamma_deg": 90.0, "run_ids": "p1", "lost_run_ids": "p2"}
    few_depths = remark("few-depths", (0.0, 90.0), found=2, wanted=3)
    of_ingest = flag_table(
        "sand", "ingest", [*attach_run("p1", [DRIFT, ROWS, ROWS]), *attach_run("p2", [CUT])]
    )
    of_checks = flag_table(
        "sand", "checks", [*attach_run("p1", [GAIN]), *attach_run("p2", [GAIN]), few_depths]
    )
    assert list(of_ingest["code"]) == ["zero-drifted", "cut-rows", "motion-log-cut"]
    assert list(of_ingest["words"]) == [str(DRIFT), str(ROWS), str(CUT)]
    flags = Flags(of_ingest, of_checks)
    assert flags.of_run("p1") == [DRIFT, ROWS]
    assert flags.of_run("p3") == []
    assert flags.runs_with("motion-log-cut") == {"p2": CUT}
    # what stands out beside other runs is a doubt about runs that are used
    sentence = format_remarks(flags.of_cell(cell))
    assert sentence == f"p1: {DRIFT}, {ROWS}; p2: {CUT}; p1: {GAIN}; 2 of 3 depths"
    assert flags.of_cell_alone(cell) == [remark("few-depths", found=2, wanted=3)]
    assert Flags().of_cell(cell) == []


def test_the_severity_of_a_flag_is_a_rank_of_its_own_or_0():
    ranks = [flag.severity for flag in FLAGS.values() if flag.severity]
    assert len(ranks) == len({*ranks}) > 10


def test_a_reason_has_the_codes_of_what_it_names():
    inner = Remark("wrong-kind", words="p: this is no log")
    row = reason_columns([remark("tare-missing", why=inner), CUT, CUT])
    assert row["reason_code"] == "tare-missing wrong-kind motion-log-cut"
    assert has(row, "wrong-kind")
    assert not has(row, "wrong")
    assert format_remarks(reason_of(row)) == row["reason"]
    assert codes_of(reason_of(row)) == row["reason_code"]
    assert reason_of({"reason": float("nan")}) == reason_of({"reason": ""}) == ()
