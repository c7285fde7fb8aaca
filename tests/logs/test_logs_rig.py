"""The reader of the rig's logs keeps or counts every data line and invents no row."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from rftfit.errors import InputError
from rftfit.logs.base import Log, LogError
from rftfit.logs.registry import DIALECTS, claimants, dialect, read_head
from rftfit.table.parse import CELLS, FINITE, NUMBER

FORCE_HEADER = "time_s,arm_moving,F1_N,F2_N,F3_N"
MOTION_HEADER = "time_s,x_mm,z_mm,angle_deg"
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


@pytest.mark.parametrize(
    ("content", "code"),
    [
        *((content, "empty") for content in (b"", b"\n\n", b"  \r\n")),
        *((FORCE_HEADER + tail, "header_only") for tail in ("", "\n", "\r\n", "\n\n# nothing\n")),
        ("# one\n# two\n", "header"),
    ],
)
def test_no_row(tmp_path, content, code):
    error = refused(tmp_path, content)
    assert (error.code, error.rows) == (code, 0)


def test_no_file(tmp_path):
    for path, code in ((tmp_path / "nowhere.csv", "missing"), (tmp_path, "unreadable")):
        with pytest.raises(LogError, match=path.name) as caught:
            dialect("rig").load(path)
        assert (caught.value.code, caught.value.rows) == (code, 0)


def test_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr("rftfit.logs.text.MAX_BYTES", 10)
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 50)
    assert refused(tmp_path, FORCE).code == "too_large"


NO_NUMBERS = "one", "", "0x10", "1_0", "1 0", '"1"', "--1", "\N{ARABIC-INDIC DIGIT ONE}", "1\x00"
INFINITE = "nan", "NaN", "inf", "-Infinity", "1e999"
BAD = {
    CELLS: ["0.01,0,1,2", "0.01,0,1,2,3,4", "0.01,0,1,2,3,", "0.01;0;1;2;3", "0,01,0,1,5,2,5,3,5"],
    NUMBER: [f"0.01,0,{cell},2,3" for cell in NO_NUMBERS],
    FINITE: ["nan,0,1,2,3", *(f"0.01,0,{cell},2,3" for cell in INFINITE)],
}


@pytest.mark.parametrize(
    ("row", "reason"), [(row, reason) for reason, rows in BAD.items() for row in rows]
)
def test_bad_row(tmp_path, row, reason):
    # the same verdict alone (fast path) and beside a row of another fault (line by line)
    for other_bad_rows in ([], ["x,x,x,x,x"]):
        log = read(tmp_path, body(FORCE_ROWS[0], row, *other_bad_rows, FORCE_ROWS[1]))
        assert log.dropped == Counter([reason, *(NUMBER for _ in other_bad_rows)])
        expect(log, FORCE_ROWS[:2])


def test_no_good_row_at_all(tmp_path):
    log = read(tmp_path, body("a,b,c,d,e", "nan,nan,nan,nan,nan"))
    assert (log.rows, log.dropped) == (2, {NUMBER: 1, FINITE: 1})
    assert log.columns["time"].size == 0


@pytest.mark.parametrize(
    "header",
    [
        "time_s,x_mm,z_mm",
        "Time,F1,F2,F3",
        "arm_moving,time_s,F1_N,F2_N,F3_N",
        "time_s,arm_moving,F1_N,F2_N,F2_N",
        "time_s,arm_moving,F1_N,F2_N,F3_N,F4_N",
        "time_furlong,arm_moving,F1_N,F2_N,F3_N",
        "0.00,0,1.5,-2.25,3",
    ],
)
def test_other_header(tmp_path, header):
    error = refused(tmp_path, "\n".join([header, *FORCE_ROWS]) + "\n")
    assert (error.code, error.rows) == ("header", 3)
    for words in (header, FORCE_HEADER, MOTION_HEADER):
        assert words in str(error)


def test_header_in_other_units(tmp_path):
    log = read(tmp_path, "time_ms,x_cm,z (mm),angle [rad]\n1,2,3,4\n")
    assert log.units == {"time": "ms", "x": "cm", "z": "mm", "angle": "rad"}
    expect(log, ["1,2,3,4"])


@pytest.mark.parametrize(("columns", "rows"), [({}, 3), ({"x": np.zeros(3)}, 2)])
def test_log_that_does_not_add_up_cannot_be_made(columns, rows):
    with pytest.raises(AssertionError, match=r"a\.csv"):
        Log(Path("a.csv"), {"time": np.zeros(2), **columns}, {"time": "s"}, rows)


def test_take_counts_what_goes():
    log = Log(Path("a.csv"), {"time": np.arange(4.0)}, {"time": "s"}, 5, {"early": 1})
    assert log.take(np.ones(4, dtype=bool), "late") is log
    kept_log = log.take(np.array([1, 0, 1, 0], dtype=bool), "late")
    kept_log = kept_log.take(np.array([True, False]), "early")
    assert kept_log.dropped == {"early": 2, "late": 2}
    assert kept_log.columns["time"].tolist() == [0.0]


def test_registry(tmp_path):
    assert dialect("rig") is DIALECTS["rig"]
    assert "rig" in dialect("rig").describe()
    with pytest.raises(InputError, match=r"'rigg'; allowed: .*did you mean 'rig'"):
        dialect("rigg")
    path = tmp_path / "log.csv"
    path.write_text(FORCE, "utf-8")
    assert claimants(read_head(path)) == [DIALECTS["rig"]]
    path.write_text("<html>", "utf-8")
    assert claimants(read_head(path)) == []
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        read_head(tmp_path / "nowhere.csv")
