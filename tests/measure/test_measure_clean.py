"""Log rows whose time cannot be right are dropped and counted, and gaps in time are found."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rftfit.logs.base import Log, LogError
from rftfit.measure.readings import clean, gaps


def log_of(time, values):
    columns = {"time": np.array(time, dtype=float), "x": np.array(values, dtype=float)}
    return Log(Path("a.csv"), columns, {}, len(time))


@pytest.mark.parametrize(
    ("time", "value", "kept", "dropped"),
    [
        # the same time with other values is no duplicate, nor are equal values at other times
        ([0, 1, 1, 2], [5, 6, 7, 8], [0, 1, 3], {"time runs backwards": 1}),
        ([0, 1, 2, 2], [5, 5, 5, 5], [0, 1, 2], {"duplicated row": 1}),
    ],
)
def test_rows_that_go_are_counted(time, value, kept, dropped):
    whole = log_of(time, value)
    log = clean(whole)
    for name, column in whole.columns.items():
        assert log.columns[name].tolist() == column[kept].tolist()
    assert (log.rows, log.dropped) == (len(time), dropped)


def test_log_without_a_good_row():
    log = Log(Path("a.csv"), {"time": np.empty(0)}, {}, 7, {"bad": 7})
    with pytest.raises(LogError, match="7: bad") as caught:
        clean(log)
    assert (caught.value.code, caught.value.rows) == ("no_good_row", 7)


@given(st.lists(st.integers(0, 30).map(float), min_size=1, max_size=40))
def test_whatever_the_times(time):
    log = log_of(time, range(len(time)))
    forward = np.count_nonzero(np.diff(np.maximum.accumulate([-1.0, *time])))
    if 2 * forward <= len(time) and len(time) > 1:
        with pytest.raises(LogError) as caught:
            clean(log)
        assert (caught.value.code, caught.value.rows) == ("time", len(time))
        return
    cleaned = clean(log)
    assert cleaned.columns["time"].size == forward
    assert (np.diff(cleaned.columns["time"]) > 0).all()
    assert cleaned.columns["time"].size + sum(cleaned.dropped.values()) == len(time)
    # rows that are kept keep their partners
    for stamp, index in zip(cleaned.columns["time"], cleaned.columns["x"], strict=True):
        assert time[int(index)] == stamp


def test_a_slow_log_is_no_row_of_gaps():
    """Steps of 0.1 s are partly longer than 0.1 in floating point; those of a 5 Hz log all are."""
    ten, five = np.linspace(7.3, 27.2, 200), np.linspace(0, 19.8, 100)
    assert (np.diff(ten) > 0.1).any()
    assert gaps(ten, 0.1).shape == gaps(five, 0.1).shape == (0, 2)
    lost = gaps(np.delete(five, 50), 0.1)
    np.testing.assert_array_equal(lost, [[five[49], five[51]]])
