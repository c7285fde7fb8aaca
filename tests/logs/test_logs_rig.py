"""The reader of the rig's logs keeps or counts every data line and invents no row."""

from collections import Counter

import numpy as np
import pytest
from makers import sentence_of

from rftfit.logs.base import LogError
from rftfit.logs.registry import dialect

FORCE_HEADER = "time_s,arm_moving,F1_N,F2_N,F3_N"
FORCE_ROWS = ["0.00,0,1.5,-2.25,3", "0.01,0,1.25,-2.5,3.125", "0.02,1,1,-2.75,3.25"]
FORCE = "# a comment\n" + "\n".join([FORCE_HEADER, *FORCE_ROWS]) + "\n"


def read(folder, content):
    path = folder / "log.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    log = dialect("rig").load(path)
    kept_rows = next(iter(log.columns.values())).size
    assert kept_rows + sum(log.dropped.values()) == log.rows
    assert all(np.isfinite(values).all() for values in log.columns.values())
    return log


def refused(folder, content):
    with pytest.raises(LogError) as caught:
        read(folder, content)
    assert "log.csv" in str(caught.value)
    return caught.value


def expect(log, rows):
    expected_cells = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    np.testing.assert_array_equal(np.stack(list(log.columns.values())), expected_cells.T)


def body(*rows):
    return "\n".join([FORCE_HEADER, *rows]) + "\n"


def test_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr("rftfit.logs.text.MAX_BYTES", 10)
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 50)
    assert refused(tmp_path, FORCE).code == "too_large"


NO_NUMBERS = "one", "", "0x10", "1_0", "1 0", '"1"', "--1", "\N{ARABIC-INDIC DIGIT ONE}", "1\x00"
INFINITE = "nan", "NaN", "inf", "-Infinity", "1e999"
BAD = {
    "cells": [
        "0.01,0,1,2",
        "0.01,0,1,2,3,4",
        "0.01,0,1,2,3,",
        "0.01;0;1;2;3",
        "0,01,0,1,5,2,5,3,5",
    ],
    "number": [f"0.01,0,{cell},2,3" for cell in NO_NUMBERS],
    "finite": ["nan,0,1,2,3", *(f"0.01,0,{cell},2,3" for cell in INFINITE)],
}


@pytest.mark.parametrize(
    ("row", "reason"), [(row, reason) for reason, rows in BAD.items() for row in rows]
)
def test_bad_row(tmp_path, row, reason):
    # the same verdict alone (fast path) and beside a row of another fault (line by line)
    for other_bad_rows in ([], ["x,x,x,x,x"]):
        log = read(tmp_path, body(FORCE_ROWS[0], row, *other_bad_rows, FORCE_ROWS[1]))
        assert log.dropped == Counter(
            map(sentence_of, [reason, *("number" for _ in other_bad_rows)])
        )
        expect(log, FORCE_ROWS[:2])


def test_header_in_other_units(tmp_path):
    log = read(tmp_path, "time_ms,x_cm,z (mm),angle [rad]\n1,2,3,4\n")
    assert log.units == {"time": "ms", "x": "cm", "z": "mm", "angle": "rad"}
    expect(log, ["1,2,3,4"])
