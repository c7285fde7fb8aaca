"""Flags and reasons: each code has its sentence, comes back from a table, and is said in one place."""

import re
from pathlib import Path

import pytest

import rftfit
from rftfit.measure.flags import (
    SENTENCES,
    Remark,
    about,
    codes_of,
    flag_columns,
    flags_of,
    has,
    reason_columns,
    reason_of,
    remark,
    say,
)

DRIFT, CUT = remark("zero-drifted", newtons=0.3), remark("motion-log-cut")
ROWS = remark("cut-rows", count=3, file="a; b.csv", why="cut in mid-row")


def test_every_code_of_the_source_has_a_sentence():
    root = Path(rftfit.__file__).parent
    text = "".join(path.read_text(encoding="utf-8") for path in root.rglob("*.py"))
    used = re.findall(r'\b(?:remark|Refused)\(\s*"([^"]+)"', text)
    assert len(used) > 100
    assert {*used} <= {*SENTENCES}
    with pytest.raises(KeyError):
        remark("no-such-code")


def test_flags_come_back_from_a_table():
    flags = (DRIFT, ROWS, *about("p1", [CUT, ROWS]))
    row = flag_columns(flags)
    assert row["flag_codes"] == "zero-drifted cut-rows motion-log-cut cut-rows"
    assert row["flags"] == f"{DRIFT}; {ROWS}; p1: {CUT}, {ROWS}"
    assert flags_of(row) == flags
    assert (
        flags_of(flag_columns([])) == flags_of({}) == flags_of({"flag_values": float("nan")}) == ()
    )


def test_a_reason_has_the_codes_of_what_it_names():
    inner = Remark("wrong-kind", words="p: this is no log")
    row = reason_columns([remark("tare-missing", why=inner), CUT, CUT])
    assert row["reason_code"] == "tare-missing wrong-kind motion-log-cut"
    assert has(row, "wrong-kind")
    assert not has(row, "wrong")
    assert say(reason_of(row)) == row["reason"]
    assert codes_of(reason_of(row)) == row["reason_code"]
    assert reason_of({"reason": float("nan")}) == reason_of({"reason": ""}) == ()
