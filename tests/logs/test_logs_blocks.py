"""A long log that is read in blocks gives the same rows and errors as one read in one piece."""

import threading

import numpy as np
import pytest
from log_files import TEXTS, netft, refused

from rftfit.logs.registry import dialect

NAMES = sorted(TEXTS)
"""Dialects of text."""
ROWS = 900


@pytest.fixture
def blocks(monkeypatch):
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 3000)


def damaged(name):
    foreign_log = TEXTS[name](ROWS)
    lines = list(foreign_log.lines)
    for row in range(40, ROWS, 41):
        lines[row] = (b"rubbish\n", b"1,2\n", lines[row].replace(b"1", b"x"))[row % 3]
    return foreign_log.header + b"".join(lines) + foreign_log.lines[0][:-3]


def assert_same(log, whole_log):
    assert list(log.columns) == list(whole_log.columns)
    for name, values in log.columns.items():
        np.testing.assert_array_equal(values, whole_log.columns[name])
    assert (log.rows, log.dropped, log.missing) == (
        whole_log.rows,
        whole_log.dropped,
        whole_log.missing,
    )
    assert (log.units, log.notes) == (whole_log.units, whole_log.notes)


@pytest.mark.parametrize("name", NAMES)
def test_blocks_give_what_the_whole_gives(name, tmp_path, request):
    path = tmp_path / "log.txt"
    path.write_bytes(damaged(name))
    reader = TEXTS[name](1).reader
    whole_log = reader.load(path)
    assert len(whole_log.dropped) > 1
    request.getfixturevalue("blocks")
    block_logs = list(reader.stream(path))
    assert len(block_logs) > 5
    assert sum(block_log.rows for block_log in block_logs) == whole_log.rows
    assert_same(reader.load(path), whole_log)


@pytest.mark.usefixtures("blocks")
def test_a_reader_may_stop_after_the_first_block(tmp_path):
    path = tmp_path / "log.txt"
    path.write_bytes(netft(ROWS).content)
    thread_count = threading.active_count()
    stream = iter(dialect("ati-netft").stream(path))
    assert next(stream).size > 0
    stream.close()  # type: ignore[attr-defined]
    assert threading.active_count() == thread_count


@pytest.mark.usefixtures("blocks")
def test_long_rig_logs_are_refused_like_short_ones(tmp_path):
    path = tmp_path / "log.csv"
    for content, code, rows in (
        (b"time_s,x_mm,z_mm\n" + b"1,2,3\n" * 900 + b"1,2", "header", 901),
        (b"time_s,x_mm,z_mm,angle_deg\n" + b"# nothing\n" * 900, "header_only", 0),
        (b"\n" * 5000, "empty", 0),
    ):
        path.write_bytes(content)
        assert refused(dialect("rig"), path, code).rows == rows
